//! Depth of ARKitScenes: `lowres_depth/VIDEO_TIME.png` in millimetres, of the size and the camera of
//! `lowres_wide`, and `confidence` with the numbers 0 to 2. Source: apple/ARKitScenes, DATA.md.

use crate::camera::PosedCamera;
use crate::camera::programs::arkit::{find, read_pictures};
use crate::error::Result;
use crate::fs::encoding::text_of;
use crate::fs::read_file;
use crate::raw::depth::confidence::Confidence;
use crate::raw::depth::list::{Entry, Listed};
use crate::raw::form::RawForm;
use std::path::Path;

/// The folders of depth, of colours, of intrinsics, and of how sure the sensor was.
const DEPTH: &str = "lowres_depth";
const COLORS: &str = "lowres_wide";
const INTRINSICS: &str = "lowres_wide_intrinsics";
const CONFIDENCE: &str = "confidence";

/// Returns whether a folder holds a video with depth.
pub(super) fn is_video(dir: &Path) -> bool {
    find(dir).is_some() && dir.join(DEPTH).is_dir()
}

/// Lists the depth pictures of a video.
pub(super) fn list(dir: &Path) -> Result<Listed> {
    let mut listed = Listed::new(RawForm::ArkitScenes, dir.to_owned());
    let Some(trajectory) = find(dir) else { return Ok(listed) };
    let bytes = read_file(&trajectory)?;
    let text = text_of(&bytes, &trajectory)?;
    let (cameras, untracked, files) =
        read_pictures(&trajectory, &text, &dir.join(DEPTH), &dir.join(INTRINSICS))?;
    listed.untracked = untracked;
    listed.files = files;

    for camera in cameras {
        let Some(depth) = camera.picture.as_ref().map(|picture| picture.path.clone()) else { continue };
        let color =
            PosedCamera { picture: Some(dir.join(COLORS).join(&camera.name).into()), ..camera.clone() };
        let confidence = Confidence::numbered(dir.join(CONFIDENCE).join(&camera.name));
        listed.entries.push(Entry {
            confidence: Some(confidence),
            color: Some(color),
            ..super::in_millimetres(camera, depth)
        });
    }
    Ok(listed)
}
