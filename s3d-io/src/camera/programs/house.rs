//! The panoramas of a Matterport3D house as scan locations. Source: see [`crate::house`].

use crate::camera::located::{check_distance, uuid_of};
use crate::camera::table::ScanLocation;
use crate::error::{Error, Result};
use crate::house::{House, Panorama};
use s3d_geom::Pose;
use s3d_geom::glam::DVec3;
use std::path::Path;

/// Reads the scan locations of a house, in the order of its file.
///
/// A panorama with pictures is where raw captures put it: at the mean place of the level camera, turned as
/// that camera was at stop 0. The place that the file tells is the one of the first picture, which is a few
/// centimetres off, so it counts for panoramas without pictures alone. These are level and look along +Y.
///
/// # Errors
/// The errors of [`House::read`]; [`Error::Format`] if there is no panorama, and with the line for pictures
/// of which none is of the level camera at stop 0.
pub(crate) fn read(path: &Path) -> Result<Vec<ScanLocation>> {
    let panoramas = House::read(path)?.panoramas;
    if panoramas.is_empty() {
        return Err(Error::format(path, "lists no panorama, so there is no scan location"));
    }
    panoramas.iter().map(|panorama| location(path, panorama)).collect()
}

fn location(path: &Path, panorama: &Panorama) -> Result<ScanLocation> {
    let Panorama { name, place, level, has_pictures, line } = panorama;
    let first = level.iter().find(|(stop, _)| *stop == 0);
    let pose = match first {
        Some((_, first)) => {
            let sum: DVec3 = level.iter().map(|(_, pose)| pose.location).sum();
            Pose { location: sum / level.len() as f64, ..*first }
        }
        None if *has_pictures => {
            let message = "has pictures, but none of camera 1 at stop 0, from which its original camera \
                           would be taken";
            return Err(Error::line(path, *line, message));
        }
        None => Pose::level(*place, 0.0),
    };
    check_distance(path, *line, name, pose.location)?;
    Ok(ScanLocation { uuid: uuid_of(name), pose, line: *line })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::house::tests::{HOUSE, UUIDS, with};
    use s3d_geom::glam::dvec3;
    use std::fs;

    #[test]
    fn panoramas_are_where_raw_captures_put_them() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.house");
        fs::write(&path, HOUSE).unwrap();
        let found = read(&path).unwrap();
        let uuids: Vec<&str> = found.iter().map(|location| location.uuid.as_str()).collect();
        assert_eq!(uuids, UUIDS);

        // The level camera stood at (1, 1, 1.5) and (1.2, 1, 1.5), and looked along +X first.
        let first = &found[0].pose;
        assert!(first.location.abs_diff_eq(dvec3(1.1, 1.0, 1.5), 1e-12), "{first:?}");
        assert!(first.forward().abs_diff_eq(DVec3::X, 1e-12) && first.up().abs_diff_eq(DVec3::Z, 1e-12));
        let second = &found[1].pose;
        assert_eq!(second.location, dvec3(1.0, 2.0, 4.5));
        assert!(second.forward().abs_diff_eq(DVec3::Y, 1e-12), "{second:?}");
    }

    #[test]
    fn faults_are_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.house");
        for (from, to, words) in [
            (" 4.5  0 0 0 0 0", " 4.5e9  0 0 0 0 0", "a.house, line 11: `"),
            ("1 0  0 -1 0 1", "1 3  0 -1 0 1", "a.house, line 10: has pictures, but none of camera 1"),
        ] {
            fs::write(&path, with(from, to)).unwrap();
            let message = read(&path).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
