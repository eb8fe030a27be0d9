//! Depth of ScanNet: recordings (`.sens`), and the folders that its exporter makes of them. Source:
//! ScanNet/ScanNet, SensReader/README.md and SensReader/python/SensorData.py: depth is in steps of 1 /
//! `depthShift` metres, which is 1000 in exported pictures.

use crate::camera::PosedCamera;
use crate::camera::Recording;
use crate::camera::numbered::numbered_files;
use crate::camera::programs::scannet::{find, optics, read};
use crate::camera::programs::sens::is_recording;
use crate::error::{Error, Result};
use crate::fs::open_file;
use crate::raw::depth::file::DepthPlace;
use crate::raw::depth::list::{Entry, Listed};
use crate::raw::form::RawForm;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Returns whether a file is a recording.
pub(super) fn recording(path: &Path) -> Result<bool> {
    let mut start = Vec::new();
    open_file(path)?
        .take(12)
        .read_to_end(&mut start)
        .map_err(|e| Error::io(path, "read", e))?;
    Ok(is_recording(&start))
}

/// Returns whether a folder holds poses and depth that were exported.
pub(super) fn is_scan(dir: &Path) -> Result<bool> {
    Ok(find(dir)?.is_some_and(|(scan, _)| scan.join("depth").is_dir()))
}

/// Lists the frames of a recording.
pub(super) fn list_recording(path: &Path) -> Result<Listed> {
    let recording = Arc::new(Recording::open(path)?);
    let mut listed = Listed::new(RawForm::Recording, path.to_owned());
    listed.files.push(path.to_owned());
    let (size, optics) = recording.depth;
    let (color_size, color_optics) = recording.color;

    for (number, frame) in recording.frames.iter().enumerate() {
        let Some(pose) = frame.pose else {
            listed.untracked += 1;
            continue;
        };
        let camera = |size, optics, picture| PosedCamera {
            size: Some(size),
            optics: Some(optics),
            picture,
            ..PosedCamera::new(number.to_string(), pose)
        };
        listed.entries.push(Entry {
            camera: camera(size, optics, None),
            place: DepthPlace::Frame(Arc::clone(&recording), number),
            unit_m: 1.0 / recording.depth_scale,
            missing: None,
            confidence: None,
            color: Some(camera(color_size, color_optics, Some(frame.color.clone()))),
        });
    }
    Ok(listed)
}

/// Lists the pictures of an exported scan.
pub(super) fn list(dir: &Path) -> Result<Listed> {
    let mut listed = Listed::new(RawForm::ScanNet, dir.to_owned());
    let Some((scan, poses)) = find(dir)? else { return Ok(listed) };
    let mut depths: BTreeMap<u64, PathBuf> =
        numbered_files(&scan.join("depth"), "png")?.into_iter().collect();

    let intrinsics = scan.join("intrinsic").join("intrinsic_depth.txt");
    let own = match intrinsics.is_file() {
        true => Some(optics(&intrinsics)?),
        false => None,
    };
    let (cameras, _, files) = read(&scan, poses)?;
    listed.files = files;
    listed.files.extend(own.iter().map(|_| intrinsics.clone()));

    for color in cameras {
        let depth = color.name.parse().ok().and_then(|number| depths.remove(&number));
        let Some(depth) = depth else {
            listed.unpictured += 1;
            continue;
        };
        let mut camera = color.clone();
        if own.is_some() {
            camera.size = None;
            camera.optics = own;
        }
        listed
            .entries
            .push(Entry { color: Some(color), ..super::in_millimetres(camera, depth) });
    }
    // What is left has no pose, or a pose that is marked as unknown.
    listed.untracked = depths.len();
    Ok(listed)
}
