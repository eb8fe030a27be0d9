//! The forms in which programs and data sets keep depth pictures with poses, a file each. Their lists of
//! cameras are read by [`crate::camera`].

mod arkit;
mod matterport;
mod nerfstudio;
mod polycam;
mod scannet;
mod sequence;
mod tum;
mod undistorted;

use crate::camera::PosedCamera;
use crate::error::Result;
use crate::raw::depth::DepthPictures;
use crate::raw::depth::file::DepthPlace;
use crate::raw::depth::list::Entry;
use crate::raw::form::RawForm;
use crate::raw::options::RawOptions;
use std::path::{Path, PathBuf};

/// A millimetre, the usual step.
const MILLIMETRE: f64 = 0.001;

/// What was found at a path.
#[derive(Clone, Debug)]
pub(in crate::raw) struct Found {
    pub(in crate::raw) form: RawForm,
    /// The file or folder that the form begins with.
    path: PathBuf,
}

/// Finds depth pictures in a folder, or in the folder of a file that lists them. Only names, and first bytes
/// of files, are looked at.
pub(in crate::raw) fn find(path: &Path) -> Result<Option<Found>> {
    let found = |form, path: PathBuf| Ok(Some(Found { form, path }));
    if path.is_file() {
        return match scannet::recording(path)? {
            true => found(RawForm::Recording, path.to_owned()),
            false if nerfstudio::has_depth(path) => found(RawForm::Nerfstudio, path.to_owned()),
            false if undistorted::is_list(path) => found(RawForm::MatterportUndistorted, path.to_owned()),
            false => Ok(None),
        };
    }

    if let Some(transforms) = nerfstudio::find(path) {
        return found(RawForm::Nerfstudio, transforms);
    }
    if scannet::is_scan(path)? {
        return found(RawForm::ScanNet, path.to_owned());
    }
    if let Some(form) = sequence::form_of(path)? {
        return found(form, path.to_owned());
    }
    if arkit::is_video(path) {
        return found(RawForm::ArkitScenes, path.to_owned());
    }
    if tum::is_sequence(path) {
        return found(RawForm::Tum, path.to_owned());
    }
    if polycam::is_capture(path)? {
        return found(RawForm::Polycam, path.to_owned());
    }
    if let Some(recording) = crate::camera::programs::sens::find(path) {
        return found(RawForm::Recording, recording);
    }
    if let Some(list) = undistorted::find(path) {
        return found(RawForm::MatterportUndistorted, list);
    }
    if matterport::has_depth(path)? {
        return found(RawForm::Matterport, path.to_owned());
    }
    Ok(None)
}

impl Found {
    /// Lists the depth pictures.
    pub(in crate::raw) fn open(&self, options: &RawOptions) -> Result<DepthPictures> {
        let path = &self.path;
        let listed = match self.form {
            RawForm::Matterport => matterport::list(path)?,
            RawForm::MatterportUndistorted => undistorted::list(path)?,
            RawForm::Recording => scannet::list_recording(path)?,
            RawForm::ScanNet => scannet::list(path)?,
            RawForm::ArkitScenes => arkit::list(path)?,
            RawForm::Tum => tum::list(path)?,
            RawForm::Polycam => polycam::list(path)?,
            RawForm::Nerfstudio => nerfstudio::list(path)?,
            _ => sequence::list(path, self.form)?,
        };
        listed.finish(options)
    }
}

/// Returns the entry of a depth picture in millimetres, in a file of its own.
fn in_millimetres(camera: PosedCamera, file: PathBuf) -> Entry {
    Entry {
        camera,
        place: DepthPlace::File(file),
        unit_m: MILLIMETRE,
        missing: None,
        confidence: None,
        color: None,
    }
}
