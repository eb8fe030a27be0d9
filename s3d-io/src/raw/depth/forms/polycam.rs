//! Depth in the raw data of a Polycam capture: `keyframes/depth/NAME.png` in millimetres, smaller than the
//! photographs, whose intrinsics are scaled, and `keyframes/confidence` with three shades. Source: Polycam's
//! polyform, README, "depth" and "confidence".

use crate::camera::programs::polycam::{find, read};
use crate::error::Result;
use crate::raw::depth::confidence::Confidence;
use crate::raw::depth::list::{Entry, Listed};
use crate::raw::form::RawForm;
use std::path::Path;

/// Returns whether a folder holds a capture with depth.
pub(super) fn is_capture(dir: &Path) -> Result<bool> {
    Ok(find(dir)?.is_some_and(|(_, images)| images.with_file_name("depth").is_dir()))
}

/// Lists the depth pictures of a capture.
pub(super) fn list(dir: &Path) -> Result<Listed> {
    let mut listed = Listed::new(RawForm::Polycam, dir.to_owned());
    let Some((files, images)) = find(dir)? else { return Ok(listed) };
    let (cameras, files) = read(files, &images)?;
    listed.files = files;

    for color in cameras {
        let file = |folder: &str| images.with_file_name(folder).join(format!("{}.png", color.name));
        let depth = file("depth");
        if !depth.is_file() {
            listed.unpictured += 1;
            continue;
        }
        let confidence = Confidence::shaded(file("confidence"));
        listed.entries.push(Entry {
            confidence: Some(confidence),
            color: Some(color.clone()),
            ..super::in_millimetres(color, depth)
        });
    }
    Ok(listed)
}
