//! A file that is written beside its place, and moved there when it is complete.

use crate::context::Context;
use crate::error::Result;
use crate::store::staging::Staging;
use crate::store::{parent_of, refuse_existing};
use s3d_io::Error as FileError;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// A file that is written in a folder beside its place, and moved there when it is complete. Dropped before
/// that, it leaves nothing behind. The next process that makes the same file takes over what a killed process
/// left.
pub struct NewFile {
    parent: PathBuf,
    path: PathBuf,
    staging: Staging,
}

impl NewFile {
    /// Checks whether `place` can be written, before long work whose result goes there.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::Error::Usage) if a file is there and `overwrite` is not set.
    /// [`Error::File`](crate::Error::File) if its folder does not exist.
    pub fn check_free(place: &Path, overwrite: bool) -> Result<()> {
        if !parent_of(place).is_dir() {
            return Err(FileError::io(place, "write", ErrorKind::NotFound.into()).into());
        }
        // What a killed process left goes back to its place later.
        if Staging::is_left(&parent_of(place), name_of(place)) {
            Ok(())
        } else {
            refuse_existing(place, overwrite)
        }
    }

    /// Begins the file that will be `place`. Its folder must exist.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::Error::Usage) if a file is there and `overwrite` is not set.
    /// [`Error::Temporary`](crate::Error::Temporary) if another process makes it.
    /// [`Error::File`](crate::Error::File) if no file can be made there.
    pub fn begin(ctx: &Context, place: &Path, overwrite: bool) -> Result<Self> {
        Self::check_free(place, overwrite)?;
        let parent = parent_of(place);
        let name = name_of(place);
        let staging = Staging::begin(ctx, &parent, name)?;
        refuse_existing(place, overwrite || staging.was_placing())?;
        Ok(Self { parent, path: staging.path().join(name), staging })
    }

    /// Returns the path to write to.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of a folder for parts that the same call goes on with after a kill or a failure. It
    /// need not exist, and is removed when the file is in its place.
    pub fn kept(&self) -> PathBuf {
        self.staging.kept()
    }

    /// Returns whether a process was killed while it moved the same file into place. Then what it had moved
    /// before may be replaced.
    pub fn was_placing(&self) -> bool {
        self.staging.was_placing()
    }

    /// Records that things are being moved into place, of which this file is the last.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn begin_placing(&self) -> Result<()> {
        self.staging.begin_placing()
    }

    /// Moves the file to its place, over an earlier one.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn finish(self) -> Result<()> {
        self.staging.place_files(&self.parent)
    }
}

fn name_of(place: &Path) -> &Path {
    Path::new(place.file_name().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_missing_is_told_before_the_work() {
        let dir = tempfile::tempdir().unwrap();
        let place = dir.path().join("scores.json");
        assert!(NewFile::check_free(&place, false).is_ok());
        let fault = NewFile::check_free(&dir.path().join("gone/scores.json"), true).unwrap_err();
        assert!(fault.to_string().contains("gone/scores.json"), "{fault}");
        std::fs::write(&place, "").unwrap();
        assert!(NewFile::check_free(&place, false).is_err() && NewFile::check_free(&place, true).is_ok());
    }
}
