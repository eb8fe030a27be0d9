//! What is written down of a data set: what was asked for, what is done, the manifest, tables, lists of files.

pub(crate) mod assets;
pub(crate) mod checked;
pub(crate) mod data_set;
pub(crate) mod journal;
pub(crate) mod label_list;
pub(crate) mod labelled_area;
pub(crate) mod legend;
pub(crate) mod listing;
pub(crate) mod manifest;
pub(crate) mod missing;
pub(crate) mod pending_change;
pub(crate) mod request;
pub(crate) mod statistics;
pub(crate) mod tables;
pub(crate) mod unfinished;

use crate::error::{Result, passes_io};
use s3d_io::Error as FileError;
use std::io::ErrorKind;

/// What a file holds; nothing if it is not there, or is none of ours.
///
/// # Errors
/// Those of the disk or the network at this moment, and of permissions: what cannot be read now may be there
/// all the same, and must not be taken for gone.
pub(crate) fn if_there<T>(read: s3d_io::Result<T>) -> Result<Option<T>> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(FileError::Io { path, action, source })
            if passes_io(&source) || source.kind() == ErrorKind::PermissionDenied =>
        {
            Err(FileError::Io { path, action, source }.into())
        }
        Err(_) => Ok(None),
    }
}
