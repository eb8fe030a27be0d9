//! Depth of a Matterport's captures, as Matterport3D publishes them: `{uuid}_d{camera}_{yaw}.png`, 16 bits, a
//! quarter of a millimetre a step, along the optical axis, with the pose and the lens of the colour picture
//! `{uuid}_i{camera}_{yaw}.jpg`, with which it is aligned. Source: niessner/Matterport, data_organization.md,
//! "matterport_depth_images".

use crate::camera::{Distortion, Optics, PictureFolder, PosedCamera, read_capture_pose, read_intrinsics};
use crate::error::{Error, Result};
use crate::raw::depth::file::DepthPlace;
use crate::raw::depth::list::{Entry, Listed};
use crate::raw::form::RawForm;
use s3d_geom::Lens;
use std::collections::BTreeMap;
use std::path::Path;

/// A step of the numbers, metres.
pub(super) const STEP_M: f64 = 0.000_25;

/// A depth picture's name: the uuid of its location, the camera and the stop.
type Name = (String, u8, u8);

/// Returns whether a folder, or a folder in it, holds depth of a Matterport.
pub(super) fn has_depth(dir: &Path) -> Result<bool> {
    Ok(PictureFolder::open(dir)?.names().any(|name| name_of(name).is_some()))
}

/// Lists the depth pictures, by location, camera and stop.
pub(super) fn list(dir: &Path) -> Result<Listed> {
    let folder = PictureFolder::open(dir)?;
    let mut listed = Listed::new(RawForm::Matterport, dir.to_owned());
    let mut lenses: BTreeMap<(String, u8), Lens> = BTreeMap::new();

    for name in folder.names().filter_map(name_of) {
        let (uuid, camera, yaw) = name;
        let file = |kind: &str, rest: &str| folder.find(&format!("{uuid}_{kind}{rest}"));
        let Some(depth) = file("d", &format!("{camera}_{yaw}.png")) else { continue };
        let Some(pose) = file("pose_", &format!("{camera}_{yaw}.txt")) else {
            listed.untracked += 1;
            continue;
        };

        let key = (uuid.clone(), camera);
        let lens = match lenses.get(&key) {
            Some(lens) => *lens,
            None => {
                let intrinsics = file("intrinsics_", &format!("{camera}.txt")).ok_or_else(|| {
                    let message = format!("has no intrinsics: {uuid}_intrinsics_{camera}.txt is not there");
                    Error::format(depth, message)
                })?;
                listed.files.push(intrinsics.clone());
                *lenses.entry(key).or_insert(read_intrinsics(intrinsics)?)
            }
        };
        listed.files.push(pose.clone());
        let camera = PosedCamera {
            size: Some([lens.width(), lens.height()]),
            optics: Some(Optics::Pinhole {
                focal_px: lens.focal_px(),
                center_px: Some(lens.center_px()),
                distortion: Distortion::opencv(lens.distortion()),
            }),
            picture: folder.picture(&format!("{uuid}_i{camera}_{yaw}")).map(Into::into),
            ..PosedCamera::new(format!("{uuid}_{camera}_{yaw}"), read_capture_pose(pose)?)
        };
        listed.entries.push(Entry {
            color: Some(camera.clone()),
            camera,
            place: DepthPlace::File(depth.clone()),
            unit_m: STEP_M,
            missing: None,
            confidence: None,
        });
    }
    Ok(listed)
}

/// Returns what the name of a depth picture says. The name is in lower case.
fn name_of(name: &str) -> Option<Name> {
    let (uuid, rest) = name.split_at_checked(32)?;
    let (camera, yaw) = rest.strip_prefix("_d")?.strip_suffix(".png")?.split_once('_')?;
    let is_uuid = uuid.bytes().all(|b| b.is_ascii_hexdigit());
    is_uuid.then_some((uuid.to_owned(), camera.parse().ok()?, yaw.parse().ok()?))
}
