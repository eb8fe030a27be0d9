//! How a folder or a file is written whole or not at all.
//!
//! Crates that write results of their own beside a data set use [`NewFolder`] and [`NewFile`], as the exports
//! and packages of this crate do.

// The folder of a data set has more: its state, the finished part of an export, and who may write to it.

pub(crate) mod backup;
pub(crate) mod change;
mod links;
pub(crate) mod lock;
pub(crate) mod new_file;
pub(crate) mod new_folder;
pub(crate) mod output;
pub(crate) mod staging;
pub(crate) mod state;

pub use new_file::NewFile;
pub use new_folder::{FolderKind, NewFolder, beside, check_apart};

use crate::error::{Result, UsageError};
use s3d_io::Error as FileError;
use std::path::{Path, PathBuf};

/// Refuses to replace a file unless `overwrite` is set.
pub(crate) fn refuse_existing(path: &Path, overwrite: bool) -> Result<()> {
    match path.try_exists() {
        Ok(true) if !overwrite => Err(UsageError::Exists { path: path.to_owned(), note: None }.into()),
        Ok(_) => Ok(()),
        Err(e) => Err(FileError::io(path, "look for", e).into()),
    }
}

/// Returns whether a folder holds a plan. Its journals must not be mistaken for an export's.
pub(crate) fn is_plan(folder: &Path) -> bool {
    plan_file(folder).exists()
}

/// Returns the file that describes a plan.
pub(crate) fn plan_file(folder: &Path) -> PathBuf {
    folder.join("plan.jsonl")
}

/// Returns the folder that holds a path.
pub(crate) fn parent_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}
