//! The fused meshes of scenes, which are kept beside them and made again when the raw scan changes.

use super::{FUSED, FuseOptions, fuse_folder};
use crate::context::Context;
use crate::error::Result;
use rayon::prelude::*;
use s3d_io::Error as FileError;
use s3d_io::fs::{Checksum, checksum_of_file, read_json};
use s3d_io::mesh::MeshFormat;
use s3d_io::raw::RawScan;
use s3d_io::scene::{FuseSource, find_scene, read_scene};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// The scene file in a folder.
const SCENE: &str = "scene.toml";

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
    /// The name of the file or folder.
    name: String,
    files: u64,
    bytes: u64,
    /// A checksum of the names and contents of the files.
    checksum: String,
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

        let sums = files
            .par_iter()
            .map(|file| Ok(checksum_of_file(file)?))
            .collect::<Result<Vec<_>>>()?;
        let mut text = String::new();
        for (file, (_, sum)) in files.iter().zip(&sums) {
            let name = file.strip_prefix(path).unwrap_or(file).display();
            let _ = writeln!(text, "{name} {sum}");
        }
        Ok(Self {
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            files: files.len() as u64,
            bytes: sums.iter().map(|(bytes, _)| bytes).sum(),
            checksum: Checksum::of(text.as_bytes()).to_string(),
        })
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
/// there yet, or if the raw scan has changed. Returns `None` for a scene of another kind. The parts of a
/// scene file are made likewise.
///
/// # Errors
/// Those of [`fuse_folder`].
pub(crate) fn fused_scene(path: &Path, ctx: &Context) -> Result<Option<PathBuf>> {
    // A faulty scene file is told by those that read it.
    let scene = scene_file(path).and_then(|file| read_scene(&file).ok());
    let parts = scene.into_iter().flat_map(|scene| scene.parts).map(|part| part.path);
    for path in parts.filter(|path| MeshFormat::of(path).is_none()) {
        fused_alone(&path, ctx)?;
    }
    fused_alone(path, ctx)
}

/// Does what [`fused_scene`] does, but for parts.
fn fused_alone(path: &Path, ctx: &Context) -> Result<Option<PathBuf>> {
    if let Some(file) = scene_file(path) {
        let Some(source) = read_scene(&file).ok().and_then(|scene| scene.fuse) else { return Ok(None) };
        ensure(&source.inputs, &source.folder, &FuseOptions::of_scene(&source), ctx)?;
        return Ok(Some(file));
    }

    let Some(folder) = raw_folder(path)? else { return Ok(None) };
    ensure(&[path.to_owned()], &folder, &FuseOptions::default(), ctx)?;
    Ok(Some(folder.join(SCENE)))
}

/// Returns the scene file that `path` names, or that is in the folder of this name.
fn scene_file(path: &Path) -> Option<PathBuf> {
    let file = if path.is_dir() {
        path.join(SCENE)
    } else {
        path.to_owned()
    };
    let is_toml = file
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    (is_toml && file.is_file()).then_some(file)
}

/// Returns the scene file that [`fused_scene`] has made of what `path` names, if that is a raw scan itself. A
/// scene file in the folder of a raw scan goes before.
pub(crate) fn scene_of_raw(path: &Path) -> Result<Option<PathBuf>> {
    if scene_file(path).is_some() {
        return Ok(None);
    }
    Ok(raw_folder(path)?.map(|folder| folder.join(SCENE)))
}

/// Returns the folder that a raw scan is fused into; `None` if `path` is none.
fn raw_folder(path: &Path) -> Result<Option<PathBuf>> {
    let is_known = path.is_dir() && (path.join("3d").is_dir() || find_scene(path)?.is_some());
    let is_raw = !is_known && path.exists() && RawScan::form_of(path)?.is_some();
    Ok(is_raw.then(|| FuseSource::folder_of(path)))
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
