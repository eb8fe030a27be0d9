//! What is written is on the disk.

use crate::error::{Error, Result};
use crate::fs::open::must_be_regular;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// How long [`SyncAhead`] rests.
const REST: Duration = Duration::from_secs(1);

/// Returns when all that was written below the folder `root` is on the disk, so that a power loss later takes
/// nothing of it away. `files` are the files that count.
///
/// Files are renamed to their names without being synced one by one, which would make an export of hundreds
/// of thousands of small files wait for the disk at each. On Linux one call (`syncfs`) brings the whole file
/// system's data out at the end; elsewhere, and where the file system does not know that call, every file is
/// synced in turn, and then the folders.
///
/// # Errors
/// [`Error::Io`]: the disk did not take the data after all.
pub fn sync_data_set(root: &Path, files: &[PathBuf]) -> Result<()> {
    if sync_file_system(root).map_err(|e| Error::io(root, "bring to the disk", e))? {
        return Ok(());
    }
    sync_one_by_one(root, files)
}

/// Brings what is written below a folder to the disk while more is written, so that little is left for
/// [`sync_data_set`] to wait for. Where the system has no call for that it does nothing.
#[derive(Debug)]
pub struct SyncAhead {
    root: PathBuf,
    /// Closed when it should end.
    open: Sender<()>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

impl SyncAhead {
    /// Begins, on a thread of its own that waits for the disk nearly all the time. Dropped, it ends soon.
    pub fn start(root: &Path) -> Self {
        let (open, is_open) = mpsc::channel();
        let folder = root.to_owned();
        let work = move || {
            while is_open.recv_timeout(REST) != Err(RecvTimeoutError::Disconnected) {
                if !sync_file_system(&folder)? {
                    break;
                }
            }
            Ok(())
        };
        // Without a thread all is left for the end.
        let thread = Builder::new().name("sync".to_owned()).spawn(work).ok();
        Self { root: root.to_owned(), open, thread }
    }

    /// Begins a sync at once, or when that under way is done, and does not wait for it.
    pub fn sync_now(&self) {
        // A thread that is gone has failed, which the end tells.
        let _ = self.open.send(());
    }

    /// Ends, when what is under way is done.
    ///
    /// # Errors
    /// [`Error::Io`]: the disk did not take something. The system tells that once, so that no sync after this
    /// would.
    pub fn end(self) -> Result<()> {
        let Self { root, open, thread } = self;
        drop(open);
        let Some(thread) = thread else { return Ok(()) };
        let ended = thread
            .join()
            .unwrap_or_else(|_| Err(io::Error::other("the thread that syncs panicked")));
        ended.map_err(|e| Error::io(&root, "bring to the disk", e))
    }
}

/// Brings one file to the disk, and its name.
///
/// # Errors
/// [`Error::Io`]: it is not there, or the disk did not take it after all.
pub fn sync_file(path: &Path) -> Result<()> {
    sync_content(path)?;
    if let Some(folder) = path.parent() {
        sync_folder(folder);
    }
    Ok(())
}

fn sync_one_by_one(root: &Path, files: &[PathBuf]) -> Result<()> {
    files.iter().try_for_each(|path| sync_content(path))?;
    let mut folders: Vec<&Path> = files.iter().filter_map(|path| path.parent()).collect();
    folders.sort();
    folders.dedup();
    folders.into_iter().chain([root]).for_each(sync_folder);
    Ok(())
}

fn sync_content(path: &Path) -> Result<()> {
    must_be_regular(path).map_err(|e| match e {
        Error::Io { source, .. } => Error::io(path, "bring to the disk", source),
        no_file => no_file,
    })?;
    // Windows syncs through handles that may write alone.
    let opened = if cfg!(windows) {
        File::options().write(true).open(path)
    } else {
        File::open(path)
    };
    let synced = opened.and_then(|file| file.sync_all());
    synced.map_err(|e| Error::io(path, "bring to the disk", e))
}

/// Not every system lets folders be opened (Windows does not); where it does not, names are as safe as it
/// makes them.
fn sync_folder(path: &Path) {
    if let Ok(folder) = File::open(path) {
        let _ = folder.sync_all();
    }
}

/// Whether the file system took all that was written in one call.
#[cfg(target_os = "linux")]
fn sync_file_system(root: &Path) -> io::Result<bool> {
    use rustix::io::Errno;
    match rustix::fs::syncfs(File::open(root)?) {
        Ok(()) => Ok(true),
        Err(Errno::NOSYS | Errno::OPNOTSUPP | Errno::INVAL) => Ok(false),
        Err(e) => Err(e.into()),
    }
}

/// There is no such call; a folder that is not there is told of all the same.
#[cfg(not(target_os = "linux"))]
fn sync_file_system(root: &Path) -> io::Result<bool> {
    std::fs::metadata(root).map(|_| false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fs::atomic::write_bytes;

    #[test]
    fn a_folder_that_is_there_is_synced_and_another_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_bytes(&path, b"a").unwrap();
        sync_data_set(dir.path(), std::slice::from_ref(&path)).unwrap();
        let message = sync_data_set(&dir.path().join("gone"), &[path])
            .unwrap_err()
            .to_string();
        assert!(message.contains("gone: cannot bring to the disk"), "{message}");
    }

    #[test]
    fn syncing_ahead_ends_and_tells_of_a_folder_that_is_gone() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        let ahead = SyncAhead::start(dir.path());
        write_bytes(&path, b"a").unwrap();
        ahead.sync_now();
        ahead.end().unwrap();
        let ahead = SyncAhead::start(&dir.path().join("gone"));
        ahead.sync_now();
        let message = ahead.end().unwrap_err().to_string();
        assert!(message.contains("gone: cannot bring to the disk"), "{message}");
    }

    /// What other systems do runs here too.
    #[test]
    fn files_are_synced_one_by_one_and_one_that_is_gone_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let paths = ["a.txt", "b.txt"].map(|name| dir.path().join(name));
        for path in &paths {
            write_bytes(path, b"a").unwrap();
        }
        sync_one_by_one(dir.path(), &paths).unwrap();
        paths.iter().for_each(|path| sync_file(path).unwrap());
        std::fs::remove_file(&paths[1]).unwrap();
        for failed in [sync_one_by_one(dir.path(), &paths), sync_file(&paths[1])] {
            let message = failed.unwrap_err().to_string();
            assert!(message.contains("b.txt: cannot bring to the disk"), "{message}");
        }
    }
}
