//! A place for output that must appear whole: a folder beside its final place, held by a lock.
//!
//! A killed process leaves the folder. The next process that makes the same thing takes it over: it removes
//! what was written, and restores an earlier thing that was just being replaced. If the process was killed
//! while it moved the new thing into place, [`Staging::was_placing`] says so: the files in place are its own,
//! and the same call may replace them. It says so until a call comes to its end, however many are killed.

use crate::context::Context;
use crate::error::{Activity, Error, Result, TemporaryError};
use crate::store::backup::{remove, rename};
use crate::store::links::refuse_link;
use crate::store::lock::{Lock, Sharing};
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::{Checksum, create_dir};
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// A folder to write to, beside the final place.
pub(crate) struct Staging {
    folder: PathBuf,
    new: PathBuf,
    lock: Option<Lock>,
    was_placing: bool,
}

/// Returns where the replaced thing lies while the new one moves into place.
fn old_in(folder: &Path) -> PathBuf {
    folder.join("old")
}

/// Returns the file that exists while things move into place.
fn placing_in(folder: &Path) -> PathBuf {
    folder.join("placing")
}

/// Returns the folder of parts that outlast a kill.
fn kept_in(folder: &Path) -> PathBuf {
    folder.join("kept")
}

/// Returns the folder for what will be called `name` in `parent`. Its name has a fixed length, since `name`
/// may be as long as the system allows.
fn folder_of(parent: &Path, name: &Path) -> PathBuf {
    let sum = Checksum::of(name.as_os_str().as_encoded_bytes()).to_string();
    parent.join(format!(".s3d-{}.part", sum.get(..8).unwrap_or_default()))
}

impl Staging {
    /// Returns whether a killed process left something of what will be called `name` in `parent`.
    pub(crate) fn is_left(parent: &Path, name: &Path) -> bool {
        folder_of(parent, name).exists()
    }

    /// Begins what will be called `name` in `parent`, which must exist.
    ///
    /// # Errors
    /// [`Error::Temporary`] if another process makes the same thing. [`Error::File`] if no file can be made
    /// there, or a device or pipe has the name. [`Error::Usage`] if the folder is a link.
    pub(crate) fn begin(ctx: &Context, parent: &Path, name: &Path) -> Result<Self> {
        let place = parent.join(name);
        let refused = |e| Err(FileError::io(&place, "write", e).into());

        if !parent.is_dir() {
            return refused(io::Error::from(ErrorKind::NotFound));
        }
        if fs::metadata(&place).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
            return refused(io::Error::new(ErrorKind::InvalidInput, "it is a device or a pipe, no file"));
        }

        let folder = folder_of(parent, name);
        refuse_link(&folder)?;
        let lock = Lock::take(ctx, &Layout::new(&folder), Sharing::Alone).map_err(|e| match e {
            Error::Temporary(_) => {
                TemporaryError::InUse { path: place.clone(), by: Activity::Writing }.into()
            }
            Error::File(FileError::Io { source, .. }) => FileError::io(&place, "write", source).into(),
            other => other,
        })?;

        let staging = Self {
            new: folder.join("new"),
            was_placing: placing_in(&folder).exists(),
            folder,
            lock: Some(lock),
        };

        // An earlier thing that was just being replaced comes back.
        let old = old_in(&staging.folder);
        if old.exists() && !place.exists() {
            rename(&old, &place)?;
        }
        [&staging.new, &old].into_iter().try_for_each(|path| remove(path))?;
        create_dir(&staging.new)?;
        Ok(staging)
    }

    /// Returns whether a process was killed while it moved the same thing into place.
    pub(crate) fn was_placing(&self) -> bool {
        self.was_placing
    }

    /// The folder to write to.
    pub(crate) fn path(&self) -> &Path {
        &self.new
    }

    /// The folder for parts that the next process goes on with if this one is killed or fails.
    pub(crate) fn kept(&self) -> PathBuf {
        kept_in(&self.folder)
    }

    /// Moves the whole folder into place. If `replaced`, everything in the place is removed; otherwise only
    /// an empty folder is.
    pub(crate) fn place_folder(self, place: &Path, replaced: bool) -> Result<()> {
        let failed = |e| FileError::io(place, "move what is finished to this name", e);
        self.begin_placing()?;

        let old = old_in(&self.folder);
        let moved = if replaced {
            fs::rename(place, &old)
        } else {
            fs::remove_dir(place).or_else(|e| {
                if e.kind() == ErrorKind::NotFound {
                    Ok(())
                } else {
                    Err(e)
                }
            })
        };

        if let Err(e) = moved.and_then(|()| fs::rename(&self.new, place)) {
            if old.exists() {
                fs::rename(old, place).map_err(failed)?;
            }
            // Everything is as it was before.
            if !self.was_placing {
                remove(&placing_in(&self.folder))?;
            }
            return Err(failed(e).into());
        }
        self.clear()
    }

    /// Moves the files into `folder` under their names, over earlier files.
    pub(crate) fn place_files(self, folder: &Path) -> Result<()> {
        let failed = |e| FileError::io(&self.new, "read the folder", e);
        let mut paths = Vec::new();
        for entry in fs::read_dir(&self.new).map_err(failed)? {
            paths.push(entry.map_err(failed)?.path());
        }

        // `camera.json` comes last, since it says what the images beside it are.
        paths.sort_by(|a, b| b.cmp(a));

        self.begin_placing()?;
        for path in paths {
            let place = folder.join(path.file_name().unwrap_or_default());
            fs::rename(&path, &place)
                .map_err(|e| FileError::io(&place, "rename the finished file to this name", e))?;
        }
        self.clear()
    }

    /// Records that the new thing is being moved into place. The file is empty, so it either exists or does
    /// not; a temporary file beside it would stay after a kill.
    pub(crate) fn begin_placing(&self) -> Result<()> {
        let path = placing_in(&self.folder);
        fs::File::create(&path).map_err(|e| FileError::io(&path, "write", e))?;
        Ok(())
    }

    /// Removes everything but the lock.
    fn clear(&self) -> Result<()> {
        let paths = [self.new.clone(), self.kept(), old_in(&self.folder), placing_in(&self.folder)];
        paths.iter().try_for_each(|path| remove(path))
    }
}

impl Drop for Staging {
    /// Leaves nothing behind, unless some files are in place and others not, the replaced thing could not be
    /// restored, or parts are kept for the next process.
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.new);
        if let Some(lock) = self.lock.take() {
            lock.abandon();
        }
        let _ = fs::remove_dir(&self.folder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn begin(dir: &Path) -> Staging {
        Staging::begin(&Context::default(), dir, Path::new("thing")).unwrap()
    }

    /// Leaves things as a kill does: nothing is tidied up, and the lock is free.
    fn killed(mut staging: Staging) {
        drop(staging.lock.take());
        std::mem::forget(staging);
    }

    #[test]
    fn what_a_killed_process_left_is_taken_over() {
        let dir = tempfile::tempdir().unwrap();
        let place = dir.path().join("thing");
        let staging = begin(dir.path());
        fs::write(staging.path().join("half"), "").unwrap();
        let other = Staging::begin(&Context::default(), dir.path(), Path::new("thing"));
        assert!(matches!(other, Err(Error::Temporary(_))));
        killed(staging);
        assert!(Staging::is_left(dir.path(), Path::new("thing")) && !place.exists());

        let staging = begin(dir.path());
        assert!(!staging.was_placing() && fs::read_dir(staging.path()).unwrap().next().is_none());
        fs::write(staging.path().join("file"), "1").unwrap();
        staging.place_folder(&place, false).unwrap();
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);

        // Killed while the earlier thing was aside.
        let staging = begin(dir.path());
        fs::write(placing_in(&staging.folder), "").unwrap();
        fs::rename(&place, old_in(&staging.folder)).unwrap();
        killed(staging);
        let staging = begin(dir.path());
        assert!(staging.was_placing());
        assert_eq!(fs::read_to_string(place.join("file")).unwrap(), "1");
        fs::write(staging.path().join("file"), "2").unwrap();
        staging.place_folder(&place, true).unwrap();
        assert_eq!(fs::read_to_string(place.join("file")).unwrap(), "2");
        assert!(!Staging::is_left(dir.path(), Path::new("thing")));
    }

    #[test]
    fn kept_parts_outlast_a_kill_and_a_failure_but_not_the_end() {
        let dir = tempfile::tempdir().unwrap();
        let part = begin(dir.path()).kept().join("part");
        let staging = begin(dir.path());
        fs::create_dir(staging.kept()).unwrap();
        fs::write(&part, "1").unwrap();
        killed(staging);
        drop(begin(dir.path()));

        let staging = begin(dir.path());
        assert_eq!(fs::read_to_string(&part).unwrap(), "1");
        fs::write(staging.path().join("thing"), "new").unwrap();
        staging.place_files(dir.path()).unwrap();
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_is_half_in_its_place_is_told_until_a_call_has_ended() {
        let dir = tempfile::tempdir().unwrap();
        let staging = begin(dir.path());
        staging.begin_placing().unwrap();
        fs::write(dir.path().join("a"), "new").unwrap();
        killed(staging);

        // The next process is killed before it places anything, and the one after that is stopped.
        let staging = begin(dir.path());
        assert!(staging.was_placing());
        killed(staging);
        let staging = begin(dir.path());
        assert!(staging.was_placing());
        drop(staging);
        assert!(Staging::is_left(dir.path(), Path::new("thing")));

        let staging = begin(dir.path());
        assert!(staging.was_placing());
        fs::write(staging.path().join("b"), "new").unwrap();
        staging.place_files(dir.path()).unwrap();
        assert!(!Staging::is_left(dir.path(), Path::new("thing")));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
    }

    #[test]
    fn files_take_the_places_of_others() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("a"), "old").unwrap();
        let staging = begin(dir.path());
        ["a", "b"]
            .iter()
            .for_each(|name| fs::write(staging.path().join(name), "new").unwrap());
        staging.place_files(dir.path()).unwrap();
        for name in ["a", "b"] {
            assert_eq!(fs::read_to_string(dir.path().join(name)).unwrap(), "new");
        }
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
    }
}
