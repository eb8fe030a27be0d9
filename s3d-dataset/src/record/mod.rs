//! The records of a data set: the request, the finished work, the manifest, tables, and lists of files.

pub(crate) mod assets;
pub(crate) mod checked;
pub(crate) mod data_set;
pub(crate) mod journal;
pub(crate) mod label_list;
pub(crate) mod labelled_area;
pub(crate) mod legend;
pub(crate) mod listing;
pub(crate) mod manifest;
pub(crate) mod pending_change;
pub(crate) mod request;
pub(crate) mod tables;
pub(crate) mod unfinished;

use crate::error::{Result, passes_io};
use s3d_io::Error as FileError;
use std::io::ErrorKind;

/// Returns the content of a file, or `None` if the file is missing or not ours.
///
/// # Errors
/// Errors of permissions, and temporary ones of the disk or the network. The file may exist although it
/// cannot be read now, so it must not count as missing.
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
