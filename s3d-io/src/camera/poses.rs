//! Scan locations from the pose files of images. Source: [`crate::formats`], "What is written".

use crate::camera::table::{FARTHEST_M, ScanLocation};
use crate::dataset::layout::{ImageName, is_valid_uuid};
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use s3d_geom::glam::{DAffine3, DVec3};
use s3d_geom::{Pose, rotation_from_euler};
use s3d_label::{Room, Taxonomy};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A scan location, and the room that its pose files name.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedLocation {
    /// The location. Its line is 0.
    pub location: ScanLocation,
    /// The room, if the pose file names one.
    pub room: Option<Room>,
}

/// The fields of a pose file that are read. The published files differ in the others.
#[derive(Deserialize)]
struct PoseFields {
    camera_uuid: Option<String>,
    point_uuid: Option<String>,
    camera_original_rotation: [f64; 3],
    camera_location: [f64; 3],
    room: Option<String>,
}

/// Returns the scan locations of the pose files in `folders`, sorted by uuid, each with its file. One file is
/// read for each location, from the first folder that has one. `world_from_file` turns, shifts and scales.
/// Rooms are looked up in `taxonomy`. A folder may be missing.
pub(crate) fn read(
    folders: &[PathBuf],
    world_from_file: &DAffine3,
    taxonomy: &Taxonomy,
) -> Result<Vec<(PathBuf, PublishedLocation)>> {
    let files = files_by_uuid(folders)?;
    let m = world_from_file.matrix3;
    let turn = m * (1.0 / libm::cbrt(m.determinant()));

    let mut found = Vec::new();
    let mut in_lower_case: BTreeMap<String, String> = BTreeMap::new();
    for (uuid, (file, pose)) in files {
        // Files are named by the uuid.
        if let Some(other) = in_lower_case.insert(uuid.to_ascii_lowercase(), uuid.clone()) {
            let message = format!(
                "its camera_uuid {uuid} differs from {other} of another file in case only; many file systems \
                 would take the files of both for the same: rename one"
            );
            return Err(Error::format(&file, message));
        }

        let location = DVec3::from_array(pose.camera_location);
        let angles = DVec3::from_array(pose.camera_original_rotation);
        if !angles.is_finite() || location.abs().max_element() > FARTHEST_M || !location.is_finite() {
            return Err(Error::format(&file, format!("has its camera at {location}, turned by {angles}")));
        }

        let room = pose.room.as_deref().and_then(|name| room_of(name, taxonomy));
        let pose = Pose {
            location: world_from_file.transform_point3(location),
            world_from_camera: turn * rotation_from_euler(angles),
        };
        found.push((file, PublishedLocation { location: ScanLocation { uuid, pose, line: 0 }, room }));
    }
    Ok(found)
}

/// Reads one pose file for each uuid, from the first folder that has one.
fn files_by_uuid(folders: &[PathBuf]) -> Result<BTreeMap<String, (PathBuf, PoseFields)>> {
    let mut files = BTreeMap::new();
    for folder in folders {
        for file in json_files(folder)? {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            if ImageName::parse(&name).is_some_and(|n| files.contains_key(&n.uuid)) {
                continue;
            }

            let pose: PoseFields = read_json(&file)?;
            let uuid = pose.camera_uuid.as_ref().or(pose.point_uuid.as_ref());
            let Some(uuid) = uuid.filter(|u| is_valid_uuid(u)).cloned() else {
                return Err(Error::format(&file, "has no camera_uuid of letters and digits"));
            };
            files.entry(uuid).or_insert((file, pose));
        }
    }
    Ok(files)
}

/// Returns the room in a name such as "office_5_3". Its last field is the area.
fn room_of(name: &str, taxonomy: &Taxonomy) -> Option<Room> {
    taxonomy.room(name.rsplit_once('_')?.0).ok()
}

/// Returns the `.json` files of a folder, sorted by name; none if there is no such folder.
fn json_files(dir: &Path) -> Result<Vec<PathBuf>> {
    let failed = |e| Error::io(dir, "read the folder", e);
    let entries = match std::fs::read_dir(dir) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(failed)?,
    };

    let mut files = Vec::new();
    for entry in entries {
        let path = entry.map_err(failed)?.path();
        let is_hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
        if path.extension().is_some_and(|e| e == "json") && !is_hidden {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
