//! Depth of a `transforms.json`: each frame's `depth_file_path`, in steps of `depth_unit_scale_factor` units,
//! which is 0.001 if the file does not say it. Source: nerfstudio, docs "Data conventions", and
//! nerfstudio/data/utils/data_utils.py, `get_depth_image_from_path`.

use crate::camera::programs::nerfstudio::{DepthFrames, read_depth};
use crate::error::Result;
use crate::raw::depth::list::{Entry, Listed};
use crate::raw::form::RawForm;
use memchr::memmem;
use std::path::{Path, PathBuf};

/// The key of a frame's depth.
const KEY: &[u8] = b"\"depth_file_path\"";

/// Returns whether a file is a list of frames with depth.
pub(super) fn has_depth(path: &Path) -> bool {
    let is_json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    // Some writers put null where a frame has no depth.
    let has_key = |bytes: Vec<u8>| {
        memmem::find_iter(&bytes, KEY).any(|at| {
            let rest = bytes.get(at + KEY.len()..).unwrap_or_default().trim_ascii_start();
            rest.strip_prefix(b":")
                .is_some_and(|value| value.trim_ascii_start().starts_with(b"\""))
        })
    };
    is_json && crate::fs::read_file(path).is_ok_and(has_key)
}

/// Returns the list in a folder, if it has depth.
pub(super) fn find(dir: &Path) -> Option<PathBuf> {
    let path = dir.join("transforms.json");
    has_depth(&path).then_some(path)
}

/// Lists the frames that have depth.
pub(super) fn list(path: &Path) -> Result<Listed> {
    let mut listed = Listed::new(RawForm::Nerfstudio, path.to_owned());
    let DepthFrames { frames, bad, unit } = read_depth(path)?;
    listed.files.push(path.to_owned());
    if bad > 0 {
        listed
            .warnings
            .push(format!("{}: {bad} frames are marked as bad, left out", path.display()));
    }

    for (camera, depth) in frames {
        let Some(depth) = depth else {
            listed.unpictured += 1;
            continue;
        };
        let color = camera.clone();
        listed.entries.push(Entry {
            unit_m: unit.unwrap_or(super::MILLIMETRE),
            color: Some(color),
            ..super::in_millimetres(camera, depth)
        });
    }
    Ok(listed)
}
