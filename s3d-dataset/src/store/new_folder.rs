//! A folder of a kind that is made of a data set: beside its place, and moved there when it is complete.

use crate::context::Context;
use crate::error::{Overwriting, Result, UsageError};
use crate::store::parent_of;
use crate::store::staging::Staging;
use s3d_io::Error as FileError;
use s3d_io::fs::{create_dir, read_json};
use serde::Deserialize;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// A kind of folder that is made of a data set, and how one is known again: a JSON file in it has the member
/// `"generator"` with the name of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FolderKind {
    /// The JSON file that says what made the folder, such as `pack.json`.
    pub about: &'static str,
    /// What its member `generator` says: `s3d pack`.
    pub generator: &'static str,
    /// What such a folder is called in messages: `the package`.
    pub noun: &'static str,
    /// What cannot be done with a file that has the folder's name, in messages.
    pub action: &'static str,
}

impl FolderKind {
    /// Whether a folder is of this kind.
    pub fn is_of(&self, folder: &Path) -> bool {
        #[derive(Deserialize)]
        struct About {
            generator: String,
        }
        read_json::<About>(&folder.join(self.about)).is_ok_and(|about| about.generator == self.generator)
    }

    fn check_free(&self, place: &Path, overwrite: bool) -> Result<()> {
        let mut entries = match fs::read_dir(place) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
            Err(e) => return Err(FileError::io(place, self.action, e).into()),
            Ok(entries) => entries,
        };
        let Some(first) = entries.next() else { return Ok(()) };
        let first = first.map_err(|e| FileError::io(place, "read", e))?.file_name();
        let folder = place.to_owned();
        let entry = first.display().to_string();
        match (self.is_of(place), overwrite) {
            (true, true) => Ok(()),
            (true, false) => {
                let overwriting = Overwriting::Replaces(self.noun);
                Err(UsageError::Holds { folder, entry, overwriting }.into())
            }
            (false, _) => Err(UsageError::Foreign { folder, entry, generator: self.generator }.into()),
        }
    }
}

/// A folder that is made beside its place, and moved there when it is complete. Dropped before, it leaves
/// nothing behind; what a killed process has left is taken over by the next that makes the same folder.
pub struct NewFolder {
    place: PathBuf,
    kind: FolderKind,
    staging: Staging,
}

impl NewFolder {
    /// Begins what will be the folder `place`, made of the data set in `root`.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::Error::Usage) if it lies in the data set or holds it, or if there is something in it that is not of
    /// this kind, or is not to be replaced; [`Error::Temporary`](crate::Error::Temporary) if another process makes it;
    /// [`Error::File`](crate::Error::File) if no file can be made there.
    pub fn begin(
        ctx: &Context,
        place: &Path,
        root: &Path,
        kind: FolderKind,
        overwrite: bool,
    ) -> Result<Self> {
        check_apart(place, root)?;
        let (parent, name) = (parent_of(place), Path::new(place.file_name().unwrap_or_default()));
        // What a killed process left may be about to come back.
        if !Staging::is_left(&parent, name) {
            kind.check_free(place, overwrite)?;
        }
        create_dir(&parent)?;
        let staging = Staging::begin(ctx, &parent, name)?;
        kind.check_free(place, overwrite || staging.was_placing())?;
        Ok(Self { place: place.to_owned(), kind, staging })
    }

    /// The folder to write to.
    pub fn path(&self) -> &Path {
        self.staging.path()
    }

    /// The folder that it will be.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Moves the folder to its place, instead of an earlier one. [`FolderKind::about`] must be in it by now.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File); what was there before is there again.
    pub fn finish(self) -> Result<()> {
        self.staging.place_folder(&self.place, self.kind.is_of(&self.place))
    }
}

/// The path beside the folder of a data set that is called after it: `…/OUT` and `_report` give
/// `…/OUT_report`.
///
/// # Errors
/// [`Error::File`](crate::Error::File) if the folder has no name of its own, as `.` has none, and is not there to be asked.
pub fn beside(dataset: &Path, ending: &str) -> Result<PathBuf> {
    // The name of "." is that of the folder it is.
    let named = match dataset.file_name() {
        Some(_) => dataset.to_owned(),
        None => resolved(dataset).map_err(|e| FileError::io(dataset, "look for", e))?,
    };
    let mut name = named.file_name().unwrap_or("dataset".as_ref()).to_owned();
    name.push(ending);
    Ok(named.with_file_name(name))
}

/// Refuses a place in the data set in `root`, or one that holds it.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage).
pub fn check_apart(place: &Path, root: &Path) -> Result<()> {
    let (Ok(place_at), Ok(root_at)) = (resolved(place), resolved(root)) else { return Ok(()) };
    if place_at.starts_with(&root_at) || root_at.starts_with(&place_at) {
        return Err(UsageError::Nested { place: place.to_owned(), dataset: root.to_owned() }.into());
    }
    Ok(())
}

/// An absolute path without links, also if its end is not there yet.
pub(crate) fn resolved(path: &Path) -> std::io::Result<PathBuf> {
    match fs::canonicalize(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => {
            let absolute = std::path::absolute(path)?;
            match (absolute.parent(), absolute.file_name()) {
                (Some(parent), Some(name)) => Ok(resolved(parent)?.join(name)),
                _ => Err(e),
            }
        }
        other => other,
    }
}
