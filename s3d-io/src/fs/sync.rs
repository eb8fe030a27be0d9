//! Syncs written files to the disk.

use crate::error::{Error, Result};
use crate::fs::open::must_be_regular;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// The pause of [`SyncAhead`] between two syncs.
const REST: Duration = Duration::from_secs(1);

/// Waits until everything that was written below the folder `root` is on the disk, so that a later power loss
/// takes nothing away. `files` are the files that matter.
///
/// Files are renamed to their final names without being synced one by one, because an export of hundreds of
/// thousands of small files would wait for the disk at each. On Linux one call (`syncfs`) writes out the
/// whole file system at the end. Elsewhere, and on file systems that do not know the call, every file is
/// synced in turn, and then the folders.
///
/// # Errors
/// [`Error::Io`] if the disk does not take the data.
pub fn sync_data_set(root: &Path, files: &[PathBuf]) -> Result<()> {
    if sync_file_system(root).map_err(|e| Error::io(root, "bring to the disk", e))? {
        return Ok(());
    }
    sync_one_by_one(root, files)
}

/// Syncs the files below a folder while more are written, so that [`sync_data_set`] has little left to wait
/// for. It does nothing on systems without a call that syncs a file system.
#[derive(Debug)]
pub struct SyncAhead {
    root: PathBuf,
    /// Dropped to end the thread.
    open: Sender<()>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

impl SyncAhead {
    /// Starts a thread that waits for the disk nearly all the time. It ends soon after the value is dropped.
    pub fn start(root: &Path) -> Self {
        let (open, is_open) = mpsc::channel();
        let folder = root.to_owned();
        // Without a thread, everything is left for the final sync.
        let thread = Builder::new()
            .name("sync".to_owned())
            .spawn(move || sync_until_closed(&folder, &is_open))
            .ok();
        Self { root: root.to_owned(), open, thread }
    }

    /// Starts a sync now, or after the current one, and does not wait for it.
    pub fn sync_now(&self) {
        // A thread that is gone has failed; `end` returns its error.
        let _ = self.open.send(());
    }

    /// Ends the thread after its current sync.
    ///
    /// # Errors
    /// [`Error::Io`] if the disk did not take something. The system reports that once only, so a later sync
    /// would not.
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

/// Syncs the file system of `folder` again and again, until the channel is closed.
fn sync_until_closed(folder: &Path, is_open: &Receiver<()>) -> io::Result<()> {
    while is_open.recv_timeout(REST) != Err(RecvTimeoutError::Disconnected) {
        if !sync_file_system(folder)? {
            break;
        }
    }
    Ok(())
}

/// Syncs one file and its name to the disk.
///
/// # Errors
/// [`Error::Io`] if it does not exist, or the disk does not take it.
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

    // Windows syncs only through handles that may write.
    let opened = if cfg!(windows) {
        File::options().write(true).open(path)
    } else {
        File::open(path)
    };

    let synced = opened.and_then(|file| file.sync_all());
    synced.map_err(|e| Error::io(path, "bring to the disk", e))
}

/// Syncs the names in a folder, if the system lets folders be opened. Windows does not; names are as safe
/// there as the system makes them.
fn sync_folder(path: &Path) {
    if let Ok(folder) = File::open(path) {
        let _ = folder.sync_all();
    }
}

/// Syncs the whole file system with one call. Returns `false` if it does not know the call.
#[cfg(target_os = "linux")]
fn sync_file_system(root: &Path) -> io::Result<bool> {
    use rustix::io::Errno;
    match rustix::fs::syncfs(File::open(root)?) {
        Ok(()) => Ok(true),
        Err(Errno::NOSYS | Errno::OPNOTSUPP | Errno::INVAL) => Ok(false),
        Err(e) => Err(e.into()),
    }
}

/// Returns `false`: there is no such call. A folder that does not exist is an error here too.
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

    /// The way of other systems is tested here too.
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
