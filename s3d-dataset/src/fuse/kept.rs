//! The fused meshes of scenes, which are kept beside them and made again when the raw scan changes.

use super::{FUSED, FuseOptions, fuse_folder};
use crate::context::Context;
use crate::error::Result;
use s3d_io::Error as FileError;
use s3d_io::fs::{Checksum, read_json};
use s3d_io::raw::RawScan;
use s3d_io::scene::{FuseSource, find_scene, read_scene};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// What a kept mesh was made from. It is written beside the mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    pub(super) generator: String,
    version: String,
    options: FuseOptions,
    inputs: Vec<InputState>,
}

/// The state of an input: a file, or all files of a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct InputState {
    path: PathBuf,
    files: u64,
    bytes: u64,
    /// A checksum of the names, sizes and times of the files.
    state: String,
}

impl Record {
    /// The record of a mesh that is made of inputs as they are now.
    pub(super) fn of(inputs: &[PathBuf], options: &FuseOptions) -> Result<Self> {
        Ok(Self {
            generator: FUSED.generator.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            options: options.clone(),
            inputs: inputs.iter().map(|path| InputState::of(path)).collect::<Result<_>>()?,
        })
    }
}

impl InputState {
    fn of(path: &Path) -> Result<Self> {
        let mut files = Vec::new();
        list(path, &mut files)?;
        files.sort();

        let mut text = String::new();
        let mut bytes = 0;
        for file in &files {
            let found = fs::metadata(file).map_err(|e| FileError::io(file, "read", e))?;
            let since = found
                .modified()
                .ok()
                .and_then(|time| time.duration_since(UNIX_EPOCH).ok());
            let name = file.strip_prefix(path).unwrap_or(file).display();
            text.push_str(&format!("{name}\n{} {}\n", found.len(), since.unwrap_or_default().as_nanos()));
            bytes += found.len();
        }
        let state = Checksum::of(text.as_bytes()).to_string();
        Ok(Self { path: path.to_owned(), files: files.len() as u64, bytes, state })
    }
}

/// Lists a file, or all files in a folder.
fn list(path: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    if !path.is_dir() {
        files.push(path.to_owned());
        return Ok(());
    }
    for entry in fs::read_dir(path).map_err(|e| FileError::io(path, "read the folder", e))? {
        let entry = entry.map_err(|e| FileError::io(path, "read the folder", e))?;
        list(&entry.path(), files)?;
    }
    Ok(())
}

/// Returns the scene file of what `path` names, if it is fused from a raw scan; the mesh is made if it is not
/// there yet, or if the raw scan has changed. Returns `None` for a scene of another kind.
///
/// # Errors
/// Those of [`fuse_folder`].
pub(crate) fn fused_scene(path: &Path, ctx: &Context) -> Result<Option<PathBuf>> {
    let file = if path.is_dir() {
        path.join("scene.toml")
    } else {
        path.to_owned()
    };
    let is_toml = file
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    if is_toml && file.is_file() {
        // A faulty scene file is told by those that read it.
        let Some(source) = read_scene(&file).ok().and_then(|scene| scene.fuse) else { return Ok(None) };
        ensure(&source.inputs, &source.folder, &FuseOptions::of_scene(&source), ctx)?;
        return Ok(Some(file));
    }

    let is_known = path.is_dir() && (path.join("3d").is_dir() || find_scene(path)?.is_some());
    if is_known || !path.exists() || RawScan::form_of(path)?.is_none() {
        return Ok(None);
    }
    let folder = FuseSource::folder_of(path);
    ensure(&[path.to_owned()], &folder, &FuseOptions::default(), ctx)?;
    Ok(Some(folder.join("scene.toml")))
}

/// Makes the fused mesh of inputs in `folder`, unless it is there.
fn ensure(inputs: &[PathBuf], folder: &Path, options: &FuseOptions, ctx: &Context) -> Result<()> {
    let record = Record::of(inputs, options)?;
    let kept = read_json::<Record>(&folder.join(FUSED.about)).ok();
    if kept.as_ref() == Some(&record) {
        ctx.info(format_args!("{}: fused earlier, and its raw scan has not changed", folder.display()));
        return Ok(());
    }
    fuse_folder(inputs, folder, options, true, ctx).map(drop)
}
