//! Depth of Matterport3D's undistorted pictures: the first name of each line `scan` in a `.conf`, in quarters
//! of a millimetre. Source: niessner/Matterport, data_organization.md, "undistorted_depth_images".

use crate::camera::programs::undistorted;
use crate::error::Result;
use crate::fs::encoding::text_of;
use crate::fs::{open_file, read_file};
use crate::raw::depth::forms::matterport::STEP_M;
use crate::raw::depth::list::{Entry, Listed};
use crate::raw::form::RawForm;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Returns whether a file is a list of undistorted pictures.
pub(super) fn is_list(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = open_file(path).map(|file| file.take(256).read_to_end(&mut start));
    let mut lines = start.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
    read.is_ok() && first.is_some_and(undistorted::is_list)
}

/// Returns the list in a folder, or in its folder of such lists.
pub(super) fn find(dir: &Path) -> Option<PathBuf> {
    let folders = [dir.to_owned(), dir.join("undistorted_camera_parameters")];
    folders
        .iter()
        .find_map(|folder| undistorted::find(folder))
        .filter(|list| is_list(list))
}

/// Lists the depth pictures.
pub(super) fn list(path: &Path) -> Result<Listed> {
    let mut listed = Listed::new(RawForm::MatterportUndistorted, path.to_owned());
    let bytes = read_file(path)?;
    listed.files.push(path.to_owned());
    for (camera, depth) in undistorted::read_depth(path, &text_of(&bytes, path)?)? {
        if !depth.is_file() {
            listed.unpictured += 1;
            continue;
        }
        let color = camera.clone();
        let entry = super::in_millimetres(camera, depth);
        listed
            .entries
            .push(Entry { unit_m: STEP_M, color: Some(color), ..entry });
    }
    Ok(listed)
}
