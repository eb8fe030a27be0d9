//! A change of a complete data set that is ready, but not completed: what `store/change.rs` writes of it.

use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::read_json;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::ErrorKind;
use std::path::PathBuf;

/// What `ready` holds.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ready {
    /// The call that makes the change, in words: the same words are the same call.
    pub(crate) call: String,
    /// Folders that give way as a whole, from the data set's.
    pub(crate) replaced: Vec<PathBuf>,
}

/// The folder in which a change of a data set is made ready.
pub(crate) fn folder(layout: &Layout) -> PathBuf {
    layout.work_dir().join("change")
}

/// The file that says that a change is ready, and is to be completed.
pub(crate) fn ready_file(layout: &Layout) -> PathBuf {
    folder(layout).join("ready")
}

/// The call whose change is not completed, if there is one: the data set is half of the old and half of the
/// new then.
pub(crate) fn pending(layout: &Layout) -> Result<Option<String>, FileError> {
    let path = ready_file(layout);
    match fs::symlink_metadata(&path) {
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(None),
        Err(e) => Err(FileError::io(&path, "look for", e)),
        Ok(_) => read_json::<Ready>(&path).map(|ready| Some(ready.call)),
    }
}
