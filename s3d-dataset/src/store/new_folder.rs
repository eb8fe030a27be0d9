//! A folder that is made from a data set: beside its place, and moved there when it is complete.

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

/// A kind of folder that is made from a data set. A folder of the kind is recognised by a JSON file in it,
/// whose member `"generator"` names the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FolderKind {
    /// The JSON file that describes the folder, such as `pack.json`.
    pub about: &'static str,
    /// The value of its member `generator`: `s3d pack`.
    pub generator: &'static str,
    /// The name of such a folder in messages: `the package`.
    pub noun: &'static str,
    /// The action that fails if a file has the folder's name, in messages.
    pub action: &'static str,
}

impl FolderKind {
    /// Returns whether a folder is of this kind.
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
        if !self.is_of(place) {
            return Err(UsageError::Foreign { folder, entry, generator: self.generator }.into());
        }
        if overwrite {
            return Ok(());
        }
        let overwriting = Overwriting::Replaces(self.noun);
        Err(UsageError::Holds { folder, entry, overwriting }.into())
    }
}

/// A folder that is made beside its place, and moved there when it is complete. Dropped before that, it
/// leaves nothing behind. The next process that makes the same folder takes over what a killed process left.
pub struct NewFolder {
    place: PathBuf,
    kind: FolderKind,
    staging: Staging,
}

impl NewFolder {
    /// Begins the folder that will be `place`, made from the data set in `root`.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::Error::Usage) if `place` lies in the data set or holds it, or if it holds
    /// something that is of another kind, or of this kind while `overwrite` is not set.
    /// [`Error::Temporary`](crate::Error::Temporary) if another process makes it.
    /// [`Error::File`](crate::Error::File) if no file can be made there.
    pub fn begin(
        ctx: &Context,
        place: &Path,
        root: &Path,
        kind: FolderKind,
        overwrite: bool,
    ) -> Result<Self> {
        check_apart(place, root)?;
        Self::begin_anywhere(ctx, place, kind, overwrite)
    }

    /// Begins a folder like [`NewFolder::begin`] that is made from no data set.
    ///
    /// # Errors
    /// Like [`NewFolder::begin`].
    pub fn begin_anywhere(ctx: &Context, place: &Path, kind: FolderKind, overwrite: bool) -> Result<Self> {
        let parent = parent_of(place);
        let name = Path::new(place.file_name().unwrap_or_default());

        // After a kill, an earlier folder may be about to come back.
        if !Staging::is_left(&parent, name) {
            kind.check_free(place, overwrite)?;
        }

        create_dir(&parent)?;
        let staging = Staging::begin(ctx, &parent, name)?;
        kind.check_free(place, overwrite || staging.was_placing())?;
        Ok(Self { place: place.to_owned(), kind, staging })
    }

    /// Returns the folder to write to.
    pub fn path(&self) -> &Path {
        self.staging.path()
    }

    /// Returns the path of a folder for parts that the same call goes on with after a kill or a failure. It
    /// need not exist, and is removed when the folder is in its place.
    pub fn kept(&self) -> PathBuf {
        self.staging.kept()
    }

    /// Returns the final place of the folder.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Returns whether a process was killed while it moved the same folder into place. Then what it had moved
    /// before may be replaced.
    pub fn was_placing(&self) -> bool {
        self.staging.was_placing()
    }

    /// Records that things are being moved into place, of which this folder is the last.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn begin_placing(&self) -> Result<()> {
        self.staging.begin_placing()
    }

    /// Moves the folder to its place, over an earlier one. It must hold [`FolderKind::about`] by now.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File). The earlier folder is then back in place.
    pub fn finish(self) -> Result<()> {
        self.staging.place_folder(&self.place, self.kind.is_of(&self.place))
    }
}

/// Returns the path beside a data set's folder, with its name and an ending: `…/OUT` and `_report` give
/// `…/OUT_report`.
///
/// # Errors
/// [`Error::File`](crate::Error::File) if the path has no name, like `.`, and the folder does not exist.
pub fn beside(dataset: &Path, ending: &str) -> Result<PathBuf> {
    // The name of "." is the name of the folder it stands for.
    let named = match dataset.file_name() {
        Some(_) => dataset.to_owned(),
        None => resolved(dataset).map_err(|e| FileError::io(dataset, "look for", e))?,
    };
    let mut name = named.file_name().unwrap_or("dataset".as_ref()).to_owned();
    name.push(ending);
    Ok(named.with_file_name(name))
}

/// Refuses a place that lies in the data set in `root`, or holds it.
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

/// Returns an absolute path without links, even if its end does not exist yet.
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
