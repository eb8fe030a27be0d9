//! The pictures of each scan location: where they are, and whether they are as they should be.

use crate::error::Result;
use crate::export::input::area::PictureSet;
use glam::{DAffine3, DVec3};
use s3d_geom::Pose;
use s3d_io::Error as FileError;
use s3d_io::camera::{
    CaptureFile, E57Owners, E57Pictures, PictureFolder, ScanLocation, check_picture, read_cameras,
};
use s3d_io::scene::PictureKind;
use std::path::{Path, PathBuf};

/// The pictures of a location.
pub(super) enum LocationPictures {
    SkyBox([PathBuf; 6]),
    Captures(Vec<CaptureFile>),
    Panorama(PathBuf),
    /// The numbers of images in the E57 file.
    E57(Vec<usize>),
}

/// Finds the pictures of locations.
pub(super) enum PictureFinder {
    SkyBox(PictureFolder),
    Captures(PictureFolder),
    Panorama(PictureFolder),
    E57 {
        pictures: E57Pictures,
        /// The pictures of each location, and what is not used.
        owners: E57Owners,
    },
}

impl PictureFinder {
    /// Opens the pictures of `locations`, which the set is of.
    pub(super) fn open(set: &PictureSet, locations: &[ScanLocation]) -> Result<Self> {
        let source = &set.source;
        Ok(match source.kind {
            PictureKind::SkyBox => Self::SkyBox(PictureFolder::open(&source.path)?),
            PictureKind::Captures => Self::Captures(PictureFolder::open(&source.path)?),
            PictureKind::Panorama => Self::Panorama(PictureFolder::open(&source.path)?),
            PictureKind::E57 => {
                let mut pictures = E57Pictures::open(&source.path, &source.world_from_file)?;
                pictures.move_all(&set.mesh_from_poses());
                let owners = pictures.of_locations(locations);
                if let Some(table) = &source.motions {
                    let motions = motions(table, locations, &set.scene_from_part)?;
                    pictures.move_pictures(&owners, &motions);
                }
                Self::E57 { pictures, owners }
            }
        })
    }

    /// Returns what is odd about the pictures as a whole, a sentence each.
    pub(super) fn warnings(&self) -> Vec<String> {
        match self {
            Self::SkyBox(_) | Self::Captures(_) | Self::Panorama(_) => Vec::new(),
            Self::E57 { owners, .. } => owners.warnings.clone(),
        }
    }

    /// Finds the pictures of a location by its index and its uuid, or returns the names of the missing ones.
    pub(super) fn find(&self, index: usize, uuid: &str) -> Result<Result<LocationPictures, String>> {
        Ok(match self {
            Self::SkyBox(folder) => folder.sky_box(uuid).map(LocationPictures::SkyBox),
            Self::Panorama(folder) => folder.panorama(uuid).map(LocationPictures::Panorama),
            Self::Captures(folder) => match folder.captures(uuid)? {
                captures if captures.is_empty() => Err(format!("{uuid}_i0_0.jpg to {uuid}_i2_5.jpg")),
                captures => Ok(LocationPictures::Captures(captures)),
            },
            Self::E57 { owners, .. } => match owners.pictures.get(index) {
                Some(numbers) if !numbers.is_empty() => Ok(LocationPictures::E57(numbers.clone())),
                _ => Err(format!("{uuid} (no image is of its scan or was taken within 0.5 m)")),
            },
        })
    }

    /// Checks the sizes and the ends of pictures, without decoding whole pictures.
    pub(super) fn check(&self, found: &LocationPictures) -> Result<()> {
        match found {
            LocationPictures::SkyBox(paths) => {
                let mut sizes = [(0, 0); 6];
                for (size, path) in sizes.iter_mut().zip(paths) {
                    *size = check_picture(path)?;
                }
                check_sky_box(&paths[0], sizes)
            }
            LocationPictures::Panorama(path) => {
                let (w, h) = check_picture(path)?;
                if w.abs_diff(h.saturating_mul(2)) > 1 {
                    let message = format!(
                        "has {w} × {h} pixels: an equirectangular photograph is twice as wide as high"
                    );
                    return Err(FileError::format(path, message).into());
                }
                Ok(())
            }
            // Captures were checked when they were found.
            LocationPictures::Captures(_) => Ok(()),
            LocationPictures::E57(numbers) => match self {
                Self::E57 { pictures, .. } => Ok(pictures.check(numbers)?),
                Self::SkyBox(_) | Self::Captures(_) | Self::Panorama(_) => Ok(()),
            },
        }
    }

    /// Returns the file of the pictures, if they are in one.
    pub(super) fn into_e57(self) -> Option<E57Pictures> {
        match self {
            Self::SkyBox(_) | Self::Captures(_) | Self::Panorama(_) => None,
            Self::E57 { pictures, .. } => Some(pictures),
        }
    }
}

/// Returns the motion of each location that a table names, in the world of the scene.
fn motions(
    table: &Path,
    locations: &[ScanLocation],
    scene_from_part: &DAffine3,
) -> Result<Vec<Option<DAffine3>>> {
    let listed = read_cameras(table)?;
    // A table of locations holds the rotations of scanners.
    let still = Pose::level(DVec3::ZERO, 0.0).world_from_camera.transpose();
    let part_from_scene = scene_from_part.inverse();
    let motion = |of: &ScanLocation| {
        let turn = of.pose.world_from_camera * still;
        let in_part = DAffine3 { matrix3: turn, translation: of.pose.location };
        *scene_from_part * in_part * part_from_scene
    };
    let of = |location: &ScanLocation| listed.iter().find(|moved| moved.uuid == location.uuid).map(motion);
    Ok(locations.iter().map(of).collect())
}

impl LocationPictures {
    /// Moves the poses of captures.
    pub(super) fn move_captures(&mut self, by: &DAffine3) {
        if let Self::Captures(captures) = self {
            captures
                .iter_mut()
                .for_each(|capture| capture.pose = capture.pose.moved(by));
        }
    }
}

pub(super) fn check_sky_box(first: &Path, sizes: [(u32, u32); 6]) -> Result<()> {
    let side = sizes[0].0;
    match sizes.iter().zip(0..).find(|(size, _)| **size != (side, side)) {
        None => Ok(()),
        Some(((w, h), k)) => {
            let message = format!(
                "has {} × {} pixels, and picture {k} of its sky box {w} × {h}: six are square and of one \
                 size",
                sizes[0].0, sizes[0].1
            );
            Err(FileError::format(first, message).into())
        }
    }
}
