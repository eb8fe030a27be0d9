//! A scan that appears in its folder whole or not at all.

use crate::{AnnotatedScene, ScanError, ScanOptions};
use s3d_io::Error as FileError;
use s3d_io::fs::create_dir;
use std::path::Path;
use std::{fs, io};

impl AnnotatedScene {
    /// Writes a scan with [`AnnotatedScene::write_scan`] into `part`, and moves that to `folder`. A scan that
    /// is in `folder` already stays if it is the same to the byte. If it differs, somebody may have changed
    /// it, and only `overwrite` replaces its files. Other files in `folder` stay.
    ///
    /// # Errors
    /// [`ScanError::Differs`] if another scan is in `folder`; those of [`AnnotatedScene::write_scan`].
    pub fn put_scan(
        &self,
        folder: &Path,
        part: &Path,
        options: &ScanOptions,
        overwrite: bool,
        go_on: impl Fn() -> bool,
    ) -> Result<(), ScanError> {
        remove(part)?;
        self.write_scan(part, options, &go_on)?;

        if !folder.exists() {
            if let Some(parent) = folder.parent() {
                create_dir(parent)?;
            }
            return Ok(fs::rename(part, folder).map_err(|e| FileError::io(folder, "move the scene to", e))?);
        }

        let is_same = is_in(part, folder).map_err(|e| FileError::io(folder, "read", e))?;
        remove(part)?;
        match (is_same, overwrite) {
            (true, _) => Ok(()),
            (false, true) => self.write_scan(folder, options, &go_on).map(drop),
            (false, false) => Err(ScanError::Differs(folder.to_owned())),
        }
    }
}

/// Whether every file and folder of `a` is in `b` with the same bytes.
fn is_in(a: &Path, b: &Path) -> io::Result<bool> {
    if !a.is_dir() {
        return Ok(b.is_file() && fs::read(a)? == fs::read(b)?);
    }
    for entry in fs::read_dir(a)? {
        let entry = entry?;
        if !is_in(&entry.path(), &b.join(entry.file_name()))? {
            return Ok(false);
        }
    }
    Ok(true)
}

fn remove(folder: &Path) -> Result<(), FileError> {
    match fs::remove_dir_all(folder) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(FileError::io(folder, "remove", e)),
        _ => Ok(()),
    }
}
