//! A change of a complete data set that is ready but not completed, as `store/change.rs` writes it.

use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::read_json;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::ErrorKind;
use std::path::PathBuf;

/// The content of the file `ready`.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ready {
    /// The call that makes the change, in words. Equal words mean the same call.
    pub(crate) call: String,
    /// The folders that are replaced as a whole. Paths start at the data set's folder.
    pub(crate) replaced: Vec<PathBuf>,
}

/// Returns the folder in which a change of a data set is prepared.
pub(crate) fn folder(layout: &Layout) -> PathBuf {
    layout.work_dir().join("change")
}

/// Returns the file whose presence says that a change is ready to be completed.
pub(crate) fn ready_file(layout: &Layout) -> PathBuf {
    folder(layout).join("ready")
}

/// Returns the call whose change is not completed, if there is one. The data set is then half old and half
/// new.
pub(crate) fn pending(layout: &Layout) -> Result<Option<String>, FileError> {
    let path = ready_file(layout);
    match fs::symlink_metadata(&path) {
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(None),
        Err(e) => Err(FileError::io(&path, "look for", e)),
        Ok(_) => read_json::<Ready>(&path).map(|ready| Some(ready.call)),
    }
}
