//! The scanner's pictures as the source of colours: found and checked before anything is written, and made
//! into one cube map at a time.

mod finder;

use crate::context::Context;
use crate::error::Result;
use crate::export::input::area::{AreaInput, PictureSet};
use crate::export::input::cameras::Cameras;
use crate::export::modality::picture_colors::PictureColors;
use finder::{LocationPictures, PictureFinder, check_sky_box};
use s3d_geom::Raster;
use s3d_io::Error as FileError;
use s3d_io::camera::{CAPTURES_A_LOCATION, CaptureFile, E57Pictures, E57Shot, ScanLocation, read_picture};
use s3d_io::scene::{PictureKind, PictureSource, SkyBoxCaps};
use s3d_render::{Capture, CubeMap, Scene, SkyBoxTurn, StitchOptions, stitch};
use std::path::PathBuf;
use std::time::Instant;

/// How many locations without pictures a message names.
const MAX_NAMED: usize = 20;

/// An area's pictures.
pub(crate) struct Pictures {
    sets: Vec<OpenSet>,
    /// The pictures of each location, and the number of their set; `None` where no image is asked for, or no
    /// set is of the location.
    found: Vec<Option<(usize, LocationPictures)>>,
    /// What was odd about them, as a sentence each.
    pub(crate) warnings: Vec<String>,
}

/// The pictures of some locations.
struct OpenSet {
    source: PictureSource,
    /// The file of the pictures, if they are in one.
    e57: Option<E57Pictures>,
}

impl Pictures {
    /// Finds the pictures of an area's locations, and checks their sizes. Returns `None` if the area has no
    /// source of pictures. Locations need pictures only where `is_asked` is true.
    ///
    /// # Errors
    /// If pictures are missing, with all of them; for the first picture that is not as it should be.
    pub(crate) fn open(area: &AreaInput, is_asked: impl Fn(&ScanLocation) -> bool) -> Result<Option<Self>> {
        let Some(first) = area.pictures.first() else { return Ok(None) };
        if matches!(area.cameras, Cameras::Placed(_)) {
            return Err(FileError::format(
                &area.path,
                format!(
                    "takes colours from {} pictures, but its scan locations are placed where none was taken: \
                     give it the locations of the pictures, or rgb = \"texture\"",
                    first.source.kind
                ),
            )
            .into());
        }

        let listed = area.cameras.listed();
        let mut found: Vec<Option<(usize, LocationPictures)>> = listed.iter().map(|_| None).collect();
        let (mut sets, mut warnings) = (Vec::new(), Vec::new());
        for set in &area.pictures {
            let locations = &listed[set.locations.clone()];
            let (e57, of_set) = open_set(area, set, locations, &is_asked, &mut warnings)?;
            let of_set = of_set.into_iter().map(|found| found.map(|found| (sets.len(), found)));
            found.splice(set.locations.clone(), of_set);
            sets.push(OpenSet { source: set.source.clone(), e57 });
        }
        Ok(Some(Self { sets, found, warnings }))
    }

    /// Describes the pictures in a line.
    pub(crate) fn summary(&self) -> String {
        let of_set = |(number, set): (usize, &OpenSet)| {
            let locations = self.found.iter().flatten().filter(|(of, _)| *of == number).count();
            let kind = match set.source.kind {
                PictureKind::E57 => "images",
                kind => kind.name(),
            };
            format!("{kind} of {locations} locations in {}", set.source.path.display())
        };
        let sets: Vec<String> = self.sets.iter().enumerate().map(of_set).collect();
        sets.join(", ")
    }

    /// Makes a location's cube map, on all threads. Returns `None` if no image of the location is asked for.
    pub(crate) fn cube(
        &self,
        ctx: &Context,
        index: usize,
        location: &ScanLocation,
        scene: &Scene<'_>,
    ) -> Result<Option<CubeMap>> {
        let Some((set, found)) = &self.found[index] else { return Ok(None) };
        let OpenSet { source, e57 } = &self.sets[*set];
        let started = Instant::now();
        let options = &source.options;
        let pose = &location.pose;

        let cube = match found {
            LocationPictures::SkyBox(paths) => {
                let pictures = read_all(paths)?;
                let turn = match options.caps {
                    SkyBoxCaps::Detect => SkyBoxTurn::Detect,
                    SkyBoxCaps::Front => SkyBoxTurn::Front,
                    SkyBoxCaps::Right => SkyBoxTurn::Right,
                    SkyBoxCaps::Back => SkyBoxTurn::Back,
                    SkyBoxCaps::Left => SkyBoxTurn::Left,
                };
                let pictures: [&Raster<[u8; 3]>; 6] = std::array::from_fn(|k| &pictures[k]);
                check_sky_box(&paths[0], pictures.map(|p| (p.width(), p.height())))?;
                CubeMap::from_sky_box(pictures, turn, pose, options.size)
            }
            LocationPictures::Panorama(path) => {
                let photo = read_picture(path)?;
                CubeMap::from_equirectangular(&photo, options.yaw_deg.to_radians(), pose, options.size)
            }
            LocationPictures::Captures(files) => {
                let mut captures = Vec::new();
                for read in in_parallel(files, CaptureFile::read) {
                    let file = &files[captures.len()];
                    captures.push(Capture {
                        image: read?,
                        lens: file.lens.into(),
                        pose: file.pose,
                        mask: None,
                        border_px: 0,
                    });
                }
                let scene = options.parallax.then_some(scene);
                stitch(captures, pose, scene, &StitchOptions { size: options.size, gains: options.gains })
            }
            LocationPictures::E57(numbers) => {
                let Some(pictures) = e57 else { return Ok(None) };
                let shots = pictures.read(numbers)?;
                let captures = shots.into_iter().map(capture_of_shot).collect();
                let scene = options.parallax.then_some(scene);
                stitch(captures, pose, scene, &StitchOptions { size: options.size, gains: options.gains })
            }
        };

        ctx.debug(format_args!(
            "{}: a cube map of 6 × {}² pixels, {:.1} % of it seen ({:.2} s)",
            location.uuid,
            cube.size(),
            100.0 * cube.coverage(),
            started.elapsed().as_secs_f64()
        ));

        Ok(Some(cube))
    }

    /// The colours that the cube map of a location gives.
    pub(crate) fn colors<'a>(&self, index: usize, cube: &'a CubeMap) -> Option<PictureColors<'a>> {
        let (set, _) = self.found[index].as_ref()?;
        Some(PictureColors::Cube { cube, unseen: self.sets[*set].source.options.unseen })
    }
}

/// The pictures of each location of a set.
type Found = Vec<Option<LocationPictures>>;

/// Finds the pictures of the locations that a set is of, with the file that they are in, if there is one.
fn open_set(
    area: &AreaInput,
    set: &PictureSet,
    locations: &[ScanLocation],
    is_asked: &impl Fn(&ScanLocation) -> bool,
    warnings: &mut Vec<String>,
) -> Result<(Option<E57Pictures>, Found)> {
    let finder = PictureFinder::open(set, locations)?;
    let mut found = Vec::new();
    let mut missing = Vec::new();
    warnings.extend(finder.warnings());

    for (index, location) in locations.iter().enumerate() {
        let uuid = &location.uuid;
        let of_location = if is_asked(location) {
            Some(finder.find(index, uuid)?)
        } else {
            None
        };

        found.push(match of_location {
            Some(Ok(mut pictures)) => {
                finder.check(&pictures)?;
                pictures.move_captures(&set.mesh_from_poses());
                if let LocationPictures::Captures(captures) = &pictures
                    && captures.len() < CAPTURES_A_LOCATION
                {
                    warnings.push(format!(
                        "location {uuid} has {} captures of {CAPTURES_A_LOCATION}: what none sees is taken \
                         from elsewhere",
                        captures.len()
                    ));
                }
                Some(pictures)
            }
            Some(Err(names)) => {
                missing.push(names);
                None
            }
            None => None,
        });
    }

    if !missing.is_empty() {
        let count = missing.len();
        let of = locations.len();
        let more = count.saturating_sub(MAX_NAMED);
        missing.truncate(MAX_NAMED);
        let mut names = missing.join("; ");
        if more > 0 {
            names += &format!("; and those of {more} more");
        }

        let source = &set.source;
        let mut message = format!(
            "pictures of {count} of {of} locations are missing (rgb = \"{}\" in {}): {names}",
            source.kind,
            area.path.display()
        );
        // A picture that is of no location may be one of the missing.
        for warning in finder.warnings() {
            message += &format!("; {warning}");
        }
        return Err(FileError::format(&source.path, message).into());
    }
    Ok((finder.into_e57(), found))
}

/// Does `work` on all items in parallel. The results are in the items' order.
fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Send + Sync) -> Vec<R> {
    use rayon::prelude::*;
    items.par_iter().map(work).collect()
}

fn read_all(paths: &[PathBuf]) -> Result<Vec<Raster<[u8; 3]>>> {
    Ok(in_parallel(paths, |path| read_picture(path))
        .into_iter()
        .collect::<s3d_io::Result<_>>()?)
}

/// Returns a picture of an E57 file as a capture. Such pictures may be the faces of a cube, which meet at
/// their borders.
fn capture_of_shot(shot: E57Shot) -> Capture {
    let E57Shot { image, lens, pose, mask } = shot;
    Capture { image, lens, pose, mask, border_px: 0 }.with_border()
}
