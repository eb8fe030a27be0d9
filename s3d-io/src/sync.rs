//! What is written is on the disk.

use crate::{Error, Result};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Returns when all that was written below the folder `root` is on the disk, so that a power loss later takes nothing of
/// it away. `files` are the files that count.
///
/// Files are renamed to their names without being synced one by one, which would make an export of hundreds of thousands
/// of small files wait for the disk at each. On Linux one call (`syncfs`) brings the whole file system's data out at the
/// end; elsewhere, and where the file system does not know that call, every file is synced in turn, and then the folders.
///
/// # Errors
/// [`Error::Io`]: the disk did not take the data after all.
pub fn sync_data_set(root: &Path, files: &[PathBuf]) -> Result<()> {
    let failed = |e| Error::io(root, "bring to the disk", e);
    let folder = File::open(root).map_err(failed)?;
    if sync_file_system(&folder).map_err(failed)? {
        return Ok(());
    }
    for path in files {
        let synced = File::open(path).and_then(|file| file.sync_all());
        synced.map_err(|e| Error::io(path, "bring to the disk", e))?;
    }
    let mut folders: Vec<&Path> = files.iter().filter_map(|path| path.parent()).collect();
    folders.sort();
    folders.dedup();
    for path in folders.into_iter().chain([root]) {
        // Not every system lets folders be opened; where it does not, names are as safe as it makes them.
        if let Ok(folder) = File::open(path) {
            let _ = folder.sync_all();
        }
    }
    Ok(())
}

/// Whether the file system took all that was written in one call.
#[cfg(target_os = "linux")]
fn sync_file_system(folder: &File) -> std::io::Result<bool> {
    use rustix::io::Errno;
    match rustix::fs::syncfs(folder) {
        Ok(()) => Ok(true),
        Err(Errno::NOSYS | Errno::OPNOTSUPP | Errno::INVAL) => Ok(false),
        Err(e) => Err(e.into()),
    }
}

#[cfg(not(target_os = "linux"))]
fn sync_file_system(_: &File) -> std::io::Result<bool> {
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::write_bytes;

    #[test]
    fn a_folder_that_is_there_is_synced_and_another_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_bytes(&path, b"a").unwrap();
        sync_data_set(dir.path(), std::slice::from_ref(&path)).unwrap();
        let message = sync_data_set(&dir.path().join("gone"), &[path]).unwrap_err().to_string();
        assert!(message.contains("gone: cannot bring to the disk"), "{message}");
    }
}
