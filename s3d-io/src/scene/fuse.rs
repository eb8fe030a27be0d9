//! The keys of `[mesh]` in a `scene.toml` that say that the mesh is fused from a raw scan.

use crate::error::Result;
use crate::mesh::file::UpAxis;
use crate::scene::folder::SceneFolder;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The raw scan that a mesh is fused from, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct FuseSource {
    /// The files and folders of the raw scan, at least one.
    pub inputs: Vec<PathBuf>,
    /// The folder that the fused mesh is kept in: it is named after the scene file, and lies beside it.
    pub folder: PathBuf,
    /// The axis of the scan's world that points up; `None`: what its files say, or Z. The fused mesh is Z-up.
    pub up: Option<UpAxis>,
    /// The edge of a cell, metres. `None`: what the call says, or its default.
    pub cell_m: Option<f64>,
    /// How far the simplified surface may lie from the fused one, metres.
    pub max_error_m: Option<f64>,
    /// The range beyond which measurements are left out, metres.
    pub range_m: Option<f64>,
    /// The widest hole that is closed along its plane, metres.
    pub close_m: Option<f64>,
}

/// The name of the mesh in [`FuseSource::folder`].
const MESH: &str = "mesh.ply";

impl FuseSource {
    /// Returns the path of the fused mesh.
    pub fn mesh(&self) -> PathBuf {
        self.folder.join(MESH)
    }

    /// Returns the folder beside a scene file or a raw scan in which its fused mesh is kept:
    /// `scan/scene.toml` gives `scan/scene.fused`, and `scan.e57` gives `scan.fused`.
    pub fn folder_of(scan: &Path) -> PathBuf {
        let mut name = if scan.is_dir() {
            scan.file_name()
        } else {
            scan.file_stem()
        }
        .unwrap_or("scan".as_ref())
        .to_owned();
        name.push(".fused");
        scan.with_file_name(name)
    }
}

/// One path, or several.
#[derive(Deserialize)]
#[serde(untagged)]
pub(crate) enum FusePaths {
    One(PathBuf),
    Several(Vec<PathBuf>),
}

/// The keys as they are written.
pub(crate) struct FuseKeys<'t> {
    pub(crate) fuse: Option<&'t FusePaths>,
    pub(crate) up: Option<UpAxis>,
    pub(crate) cell_m: Option<f64>,
    pub(crate) max_error_m: Option<f64>,
    pub(crate) range_m: Option<f64>,
    pub(crate) close_m: Option<f64>,
}

impl FuseKeys<'_> {
    /// Returns the source that the keys describe; `None` if the mesh is a file.
    ///
    /// # Errors
    /// [`Error::Format`](crate::Error::Format) for the scene file if a file does not exist or a value is
    /// wrong.
    pub(crate) fn source(&self, scene: &Path, folder: SceneFolder<'_>) -> Result<Option<FuseSource>> {
        let lengths = [
            ("cell_m", self.cell_m),
            ("max_error_m", self.max_error_m),
            ("range_m", self.range_m),
            ("close_m", self.close_m),
        ];
        let Some(fuse) = self.fuse else {
            return match lengths.iter().find(|(_, value)| value.is_some()) {
                None => Ok(None),
                Some((key, _)) => Err(folder.fault(format!("mesh.{key} is a key beside mesh.fuse"))),
            };
        };
        for (key, value) in lengths {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(folder.fault(format!("mesh.{key} = {value} must be metres above 0")));
            }
        }

        let written = match fuse {
            FusePaths::One(path) => std::slice::from_ref(path),
            FusePaths::Several(paths) => paths,
        };
        if written.is_empty() {
            return Err(folder.fault("mesh.fuse needs at least one path"));
        }
        let inputs = written
            .iter()
            .map(|path| folder.any("mesh.fuse", path))
            .collect::<Result<_>>()?;
        let Self { up, cell_m, max_error_m, range_m, close_m, .. } = *self;
        let folder = FuseSource::folder_of(scene);
        Ok(Some(FuseSource { inputs, folder, up, cell_m, max_error_m, range_m, close_m }))
    }
}
