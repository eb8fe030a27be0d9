//! A file that is made beside its place, and moved there when it is complete.

use crate::context::Context;
use crate::error::Result;
use crate::store::staging::Staging;
use crate::store::{parent_of, refuse_existing};
use std::path::{Path, PathBuf};

/// A file that is made in a folder beside its place, and moved there when it is complete. Dropped before, it
/// leaves nothing behind; what a killed process has left is taken over by the next that makes the same file.
pub struct NewFile {
    parent: PathBuf,
    path: PathBuf,
    staging: Staging,
}

impl NewFile {
    /// Whether `place` can be written, asked before long work whose result goes there.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::Error::Usage) if something is there that is not to be replaced.
    pub fn check_free(place: &Path, overwrite: bool) -> Result<()> {
        // What a killed process left is put in its place.
        if Staging::is_left(&parent_of(place), name_of(place)) {
            Ok(())
        } else {
            refuse_existing(place, overwrite)
        }
    }

    /// Begins what will be the file `place`, whose folder must be there.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::Error::Usage) if something is there that is not to be replaced;
    /// [`Error::Temporary`](crate::Error::Temporary) if another process makes it;
    /// [`Error::File`](crate::Error::File) if no file can be made there.
    pub fn begin(ctx: &Context, place: &Path, overwrite: bool) -> Result<Self> {
        Self::check_free(place, overwrite)?;
        let (parent, name) = (parent_of(place), name_of(place));
        let staging = Staging::begin(ctx, &parent, name)?;
        refuse_existing(place, overwrite || staging.was_placing())?;
        Ok(Self { parent, path: staging.path().join(name), staging })
    }

    /// The file to write.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Moves the file to its place, instead of an earlier one.
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
