//! The folder of a scene file, in which the files that it names are looked up.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// The folder of a scene file. It resolves the paths in the file, and makes errors about the file.
#[derive(Clone, Copy)]
pub(crate) struct SceneFolder<'p> {
    scene: &'p Path,
    folder: &'p Path,
}

impl<'p> SceneFolder<'p> {
    /// Returns the folder of the scene file `scene`.
    pub(crate) fn of(scene: &'p Path) -> Self {
        Self { scene, folder: scene.parent().unwrap_or(Path::new("")) }
    }

    /// Returns an error about the scene file.
    pub(crate) fn fault(self, message: impl Into<String>) -> Error {
        Error::format(self.scene, message)
    }

    /// Returns the path of the file that the key `key` names.
    pub(crate) fn file(self, key: &str, written: &Path) -> Result<PathBuf> {
        self.find(key, written, Some("file"), Path::is_file)
    }

    /// Returns the path of the folder that the key `key` names.
    pub(crate) fn folder(self, key: &str, written: &Path) -> Result<PathBuf> {
        self.find(key, written, Some("folder"), Path::is_dir)
    }

    /// Returns the path of the file or folder that the key `key` names.
    pub(crate) fn any(self, key: &str, written: &Path) -> Result<PathBuf> {
        self.find(key, written, None, Path::exists)
    }

    fn find(self, key: &str, written: &Path, kind: Option<&str>, fits: fn(&Path) -> bool) -> Result<PathBuf> {
        let path = self.folder.join(written);
        if fits(&path) {
            return Ok(path);
        }
        let state = match kind {
            Some(kind) if path.exists() => format!("is no {kind}"),
            Some(kind) => format!("is not there; it should be a {kind}"),
            None => "is not there".to_owned(),
        };
        Err(self.fault(format!("{key} = {written:?}: {} {state}", path.display())))
    }
}
