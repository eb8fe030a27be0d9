//! The lock of an output folder: one process at a time exports into it.

use crate::context::Context;
use crate::error::{Activity, Result, TemporaryError};
use crate::store::change;
use crate::store::links::refuse_links_below;
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::create_dir;
use std::fs::{self, File, TryLockError};

/// The lock of a folder, held until it is dropped or the process ends, however it ends.
#[derive(Debug)]
pub(crate) struct Lock {
    layout: Layout,
    // The open file holds the lock. Closing it frees the lock.
    _file: File,
}

/// The processes that may hold a lock together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sharing {
    /// One process only.
    Alone,
    /// All shards of the same export.
    Shards,
}

impl Lock {
    /// Takes the lock of OUT. Makes the folder and `.s3d`.
    ///
    /// # Errors
    /// [`Error::Temporary`](crate::Error::Temporary) if another process holds it.
    /// [`Error::Usage`](crate::Error::Usage) if `.s3d` or a folder in it is a link.
    pub(crate) fn take(ctx: &Context, layout: &Layout, sharing: Sharing) -> Result<Self> {
        let path = layout.lock();
        refuse_links_below(&layout.work_dir())?;
        loop {
            create_dir(&layout.work_dir())?;

            let opened = File::options()
                .create(true)
                .truncate(false)
                .write(true)
                .read(true)
                .open(&path);
            let file = match opened {
                // The earlier holder has just ended and removed the folder.
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => continue,
                opened => opened.map_err(|e| FileError::io(&path, "write", e))?,
            };

            let taken = match sharing {
                Sharing::Alone => file.try_lock(),
                Sharing::Shards => file.try_lock_shared(),
            };

            match taken {
                Ok(()) if is_still(&file, layout) => return Ok(Self { layout: layout.clone(), _file: file }),
                // The lock belongs to a file that is no longer at the path. Try again.
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let path = layout.root().to_owned();
                    return Err(TemporaryError::InUse { path, by: Activity::Exporting }.into());
                }
                Err(TryLockError::Error(e)) if e.kind() == std::io::ErrorKind::Unsupported => {
                    ctx.warn(format_args!(
                        "{}: no locks on this file system; see to it that one process at a time exports into \
                         it",
                        path.display()
                    ));
                    return Ok(Self { layout: layout.clone(), _file: file });
                }
                Err(TryLockError::Error(e)) => return Err(FileError::io(&path, "lock", e).into()),
            }
        }
    }

    /// Returns whether a process works alone in OUT.
    pub(crate) fn is_held(layout: &Layout) -> bool {
        let opened = File::options().read(true).open(layout.lock());
        opened.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }

    /// Holds the lock of a complete data set while `work` changes it. A change of a killed process is
    /// completed first, and `work` gets the call that made it.
    ///
    /// # Errors
    /// The errors of [`Lock::take`] and of `work`.
    pub(crate) fn during<T>(
        ctx: &Context,
        layout: &Layout,
        work: impl FnOnce(Option<String>) -> Result<T>,
    ) -> Result<T> {
        let lock = Self::take(ctx, layout, Sharing::Alone)?;
        let done = change::settle(layout).and_then(work);
        lock.abandon();
        done
    }

    /// Frees the lock, and removes the working folder if nothing was begun.
    pub(crate) fn abandon(self) {
        if !self.layout.request().exists() {
            // Only an empty folder is removed.
            let _ = fs::remove_file(self.layout.lock());
            let _ = fs::remove_dir(self.layout.work_dir());
        }
    }
}

/// Returns whether the open file is the one at the lock's path.
#[cfg(unix)]
fn is_still(file: &File, layout: &Layout) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), fs::metadata(layout.lock())) {
        (Ok(ours), Ok(there)) => (ours.dev(), ours.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

/// Returns whether a file is at the lock's path. On these systems an open file cannot be removed.
#[cfg(not(unix))]
fn is_still(_: &File, layout: &Layout) -> bool {
    layout.lock().exists()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn one_holds_it_until_it_is_dropped() {
        let dir = tempfile::tempdir().unwrap();
        let layout = Layout::new(dir.path().join("out"));
        let lock = Lock::take(&Context::default(), &layout, Sharing::Alone).unwrap();
        for sharing in [Sharing::Alone, Sharing::Shards] {
            let refused = Lock::take(&Context::default(), &layout, sharing).unwrap_err();
            assert!(
                matches!(&refused, Error::Temporary(TemporaryError::InUse { by: Activity::Exporting, .. })),
                "{refused}"
            );
        }

        drop(lock);
        let shared = [(); 2].map(|()| Lock::take(&Context::default(), &layout, Sharing::Shards).unwrap());
        assert!(Lock::take(&Context::default(), &layout, Sharing::Alone).is_err());
        drop(shared);

        Lock::take(&Context::default(), &layout, Sharing::Alone)
            .unwrap()
            .abandon();
        assert!(!layout.work_dir().exists());

        let lock = Lock::take(&Context::default(), &layout, Sharing::Alone).unwrap();
        fs::write(layout.request(), "{}").unwrap();
        lock.abandon();
        assert!(layout.lock().exists());
    }
}
