//! One process at a time exports into a folder.

use crate::context::Context;
use crate::error::{Result, TemporaryError, Work};
use crate::store::change;
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::create_dir;
use std::fs::{self, File, TryLockError};

/// The lock of a folder, held until it is dropped or the process ends, however it ends.
#[derive(Debug)]
pub(crate) struct Lock {
    layout: Layout,
    // It is the lock: closed, it is gone.
    _file: File,
}

/// With whom a lock is shared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sharing {
    /// With nobody.
    Alone,
    /// With other shards of the same export.
    Shards,
}

impl Lock {
    /// Takes the lock of OUT, for which it makes the folder and `.s3d`.
    ///
    /// # Errors
    /// [`Error::Temporary`](crate::Error::Temporary) if another process holds it.
    pub(crate) fn take(ctx: &Context, layout: &Layout, sharing: Sharing) -> Result<Self> {
        let path = layout.lock();
        loop {
            create_dir(&layout.work_dir())?;
            let opened = File::options()
                .create(true)
                .truncate(false)
                .write(true)
                .read(true)
                .open(&path);
            let file = match opened {
                // Whoever had it was just done, and took the folder away.
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => continue,
                opened => opened.map_err(|e| FileError::io(&path, "write", e))?,
            };
            let taken = match sharing {
                Sharing::Alone => file.try_lock(),
                Sharing::Shards => file.try_lock_shared(),
            };
            match taken {
                Ok(()) if is_still(&file, layout) => return Ok(Self { layout: layout.clone(), _file: file }),
                // A lock of a file that is not there any more is worth nothing.
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let path = layout.root().to_owned();
                    return Err(TemporaryError::InUse { path, by: Work::Exporting }.into());
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

    /// The lock of a complete data set that a command changes, for the time of `work`. That is told which
    /// call's change, begun by a process that was killed, was completed before.
    ///
    /// # Errors
    /// As [`Lock::take`], and those of `work`.
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

    /// Gives the lock back, and takes the working folder away if nothing was begun.
    pub(crate) fn abandon(self) {
        if !self.layout.request().exists() {
            // It holds the lock's file and nothing else; if not, it stays.
            let _ = fs::remove_file(self.layout.lock());
            let _ = fs::remove_dir(self.layout.work_dir());
        }
    }
}

/// Whether the file is the one that lies at the lock's path.
#[cfg(unix)]
fn is_still(file: &File, layout: &Layout) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), fs::metadata(layout.lock())) {
        (Ok(ours), Ok(there)) => (ours.dev(), ours.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

/// Whether there is a file at the lock's path. An open file cannot be removed here.
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
                matches!(&refused, Error::Temporary(TemporaryError::InUse { by: Work::Exporting, .. })),
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
