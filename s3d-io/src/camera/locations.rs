//! Scan locations, from any supported list of cameras.

use crate::camera::matterport::{PictureFolder, read_matterport_locations};
use crate::camera::other_kind::refuse_other_kind;
use crate::camera::posed::PosedCamera;
use crate::camera::programs::{colmap, house, nerfstudio};
use crate::camera::table::{ScanLocation, parse_cameras};
use crate::camera::{located, poses};
use crate::error::{Error, Result};
use crate::fs::open::read_file;
use s3d_geom::glam::DAffine3;
use std::path::{Path, PathBuf};

/// The supported forms, for messages.
const FORMS: &str = "scan locations are a CSV table of uuid,x,y,z,qx,qy,qz,qw, a folder of pose files \
                     (*.json), the raw captures of a Matterport, a house of Matterport3D (.house), an E57 \
                     file, a COLMAP model (images.txt or images.bin) or a transforms.json";

/// Reads the scan locations of `path`, a file or a folder:
///
/// - `.csv`, or any extension that is not named here: the table that
///   [`read_cameras`](crate::camera::read_cameras) reads;
/// - `images.txt`, `images.bin`, or a folder that holds one, itself or in `0`, `sparse` or `sparse/0`: a
///   COLMAP model;
/// - `transforms.json`, or a folder that holds one: the frames of nerfstudio and related programs;
/// - a `.house` file of Matterport3D: its panoramas, as raw captures would put them;
/// - an E57 file: the places of its scans, level, each with the heading of its +Y;
/// - a folder of pose files of images, as published: where the scanner stood and how it was turned;
/// - a folder with the raw captures of a Matterport: see [`read_matterport_locations`].
///
/// Each picture of a COLMAP model or a `transforms.json` gives a scan location where it was taken, level and
/// with the picture's heading. There is one for each uuid in the names. `world_from_file` is the transform
/// from the file's frame to the world (metres, Z-up): a rotation, a shift and a scale.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the place; [`Error::Unsupported`] for a folder that holds none of
/// these, and for a file of another kind, which the message names.
pub fn read_scan_locations(path: &Path, world_from_file: &DAffine3) -> Result<Vec<ScanLocation>> {
    if path.is_dir() {
        return read_folder(path, world_from_file);
    }
    if is_colmap_images(path) {
        return picture_locations(path, colmap::read(path)?, world_from_file);
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        return picture_locations(path, nerfstudio::read(path)?, world_from_file);
    }
    if crate::house::is_house(path) {
        return Ok(all_moved(house::read(path)?, world_from_file));
    }

    #[cfg(feature = "e57")]
    if starts_with(path, crate::camera::programs::e57::MAGIC)? {
        return picture_locations(path, crate::camera::programs::e57::read(path)?, world_from_file);
    }

    let bytes = read_file(path)?;
    refuse_other_kind(path, &bytes)?;
    Ok(all_moved(parse_cameras(&bytes, path)?, world_from_file))
}

/// Brings locations from a file's frame to the world.
fn all_moved(mut locations: Vec<ScanLocation>, world_from_file: &DAffine3) -> Vec<ScanLocation> {
    locations
        .iter_mut()
        .for_each(|l| l.pose = l.pose.moved(world_from_file));
    locations
}

fn read_folder(path: &Path, world_from_file: &DAffine3) -> Result<Vec<ScanLocation>> {
    if let Some(images) = colmap::find(path) {
        return picture_locations(&images, colmap::read(&images)?, world_from_file);
    }
    if let Some(transforms) = has_transforms(path) {
        return picture_locations(&transforms, nerfstudio::read(&transforms)?, world_from_file);
    }

    let found = poses::read(&[path.to_owned()], world_from_file, &Default::default())?;
    if !found.is_empty() {
        return Ok(found.into_iter().map(|(_, published)| published.location).collect());
    }

    if PictureFolder::open(path)?.uuids().is_empty() {
        return Err(Error::unsupported(path, format!("holds no scan locations: {FORMS}")));
    }
    let mut locations = read_matterport_locations(path)?;
    for location in &mut locations {
        location.pose = location.pose.moved(world_from_file);
        // Captures have no lines.
        location.line = 0;
    }
    Ok(locations)
}

/// Returns the scan locations of the pictures in the list `path`.
fn picture_locations(
    path: &Path,
    mut pictures: Vec<PosedCamera>,
    world_from_file: &DAffine3,
) -> Result<Vec<ScanLocation>> {
    pictures.iter_mut().for_each(|p| p.pose = p.pose.moved(world_from_file));
    located::locations_of(path, pictures)
}

/// Returns whether a file begins with these bytes.
#[cfg(feature = "e57")]
fn starts_with(path: &Path, magic: &[u8]) -> Result<bool> {
    use std::io::Read;
    let mut head = Vec::new();
    let read = crate::fs::open::open_file(path)?
        .take(magic.len() as u64)
        .read_to_end(&mut head);
    read.map_err(|e| Error::io(path, "read", e))?;
    Ok(head == magic)
}

/// Returns whether a file is the list of pictures of a COLMAP model.
pub(crate) fn is_colmap_images(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default();
    name.eq_ignore_ascii_case("images.txt") || name.eq_ignore_ascii_case("images.bin")
}

/// Returns the `transforms.json` in a folder, if there is one.
pub(crate) fn has_transforms(dir: &Path) -> Option<PathBuf> {
    Some(dir.join("transforms.json")).filter(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::layout::Frame;
    use crate::dataset::pose::PoseFile;
    use s3d_geom::Pose;
    use s3d_geom::glam::{DMat3, DQuat, DVec3, dvec3};
    use std::fs;

    const IMAGES: &str = "1 1 0 0 0 0 0 0 1 a.jpg\n\n";

    fn pose_file(uuid: &str) -> Vec<u8> {
        let pose = Pose::level(dvec3(1.0, -2.0, 1.5), 0.3);
        let camera = s3d_geom::Camera::equirectangular(pose, 64);
        PoseFile::new(&camera, &pose, uuid, "office_5_3", Frame::Panorama).to_json()
    }

    #[test]
    fn the_form_is_found_by_name() {
        let dir = tempfile::tempdir().unwrap();
        let at = |p: &str| dir.path().join(p);
        fs::create_dir_all(at("colmap/sparse/0")).unwrap();
        fs::create_dir(at("empty")).unwrap();
        fs::write(at("colmap/sparse/0/images.txt"), IMAGES).unwrap();
        let transforms =
            r#"{"frames": [{"file_path": "a.jpg", "transform_matrix": [[1,0,0,0],[0,0,-1,0],[0,1,0,0]]}]}"#;
        fs::write(at("transforms.json"), transforms).unwrap();
        fs::write(at("cameras.csv"), "8eb9955b866b4b5f74abb1071416c628,1,2,3,0,0,0,1\n").unwrap();
        let read = |p: &str| read_scan_locations(&at(p), &DAffine3::IDENTITY);
        for p in ["colmap", "colmap/sparse", "colmap/sparse/0/images.txt"] {
            // Looking along +z of the world, the picture's top towards −y.
            let location = &read(p).unwrap()[0];
            assert!(location.pose.forward().abs_diff_eq(DVec3::Y, 1e-12), "{p}: {:?}", location.pose);
        }
        for p in ["", "transforms.json"] {
            assert!(read(p).unwrap()[0].pose.forward().abs_diff_eq(DVec3::Y, 1e-12));
        }
        assert_eq!(read("cameras.csv").unwrap()[0].pose.location, dvec3(1.0, 2.0, 3.0));

        fs::create_dir(at("poses")).unwrap();
        let uuids = ["8eb9955b866b4b5f74abb1071416c628", "508160ba5d80a2e365609578a09bab8b"];
        for uuid in uuids {
            fs::write(at(&format!("poses/{uuid}.json")), pose_file(uuid)).unwrap();
        }
        let poses = read("poses").unwrap();
        assert_eq!((poses.len(), poses[0].uuid.as_str()), (2, uuids[1]));
        assert!(poses[1].pose.location.abs_diff_eq(dvec3(1.0, -2.0, 1.5), 1e-12));

        fs::create_dir(at("raw")).unwrap();
        let capture = "1 0 0 7\n0 0 1 8\n0 -1 0 9\n0 0 0 1";
        fs::write(at(&format!("raw/{}_pose_1_0.txt", uuids[0])), capture).unwrap();
        let raw = read("raw").unwrap();
        assert_eq!((raw.len(), raw[0].pose.location), (1, dvec3(7.0, 8.0, 9.0)));

        let message = read("empty").unwrap_err().to_string();
        assert!(message.contains("empty") && message.contains("images.txt"), "{message}");
        assert!(matches!(read("gone"), Err(Error::Io { .. })));
        fs::write(at("scan.las"), b"LASF\x01\0\0\0").unwrap();
        let message = read("scan.las").unwrap_err().to_string();
        assert!(message.contains("is a cloud of points (LAS)"), "{message}");
    }

    #[test]
    fn frames_are_turned_shifted_and_scaled() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("images.txt");
        fs::write(&path, "1 1 0 0 0 0 0 -4 1 a.jpg\n\n").unwrap();
        // A world with y down, twice as large: its −y is up, its z the world's y.
        let turn = DMat3::from_cols(DVec3::X, -DVec3::Z, DVec3::Y);
        let world = DAffine3::from_mat3_translation(turn * 0.5, dvec3(10.0, 0.0, 1.0));
        let location = &read_scan_locations(&path, &world).unwrap()[0];
        assert!(location.pose.location.abs_diff_eq(dvec3(10.0, 2.0, 1.0), 1e-12), "{:?}", location.pose);
        assert!(location.pose.forward().abs_diff_eq(DVec3::Y, 1e-12));
        let turned = Pose::level(DVec3::ZERO, 0.0).moved(&DAffine3::from_quat(DQuat::from_rotation_z(0.5)));
        assert!(
            turned
                .forward()
                .abs_diff_eq(Pose::level(DVec3::ZERO, 0.5).forward(), 1e-12)
        );
    }
}
