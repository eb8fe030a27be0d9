//! Files that are opened to be read. All readers open them here. Pipes and devices are refused before they
//! are opened, because even opening one may wait for ever.

use crate::error::{Error, Result};
use std::fs;
use std::path::{Path, PathBuf};

/// Returns the content of a regular file. Links are followed.
///
/// # Errors
/// [`Error::Io`] if it does not exist or may not be read; [`Error::Format`] if it is a folder, a pipe, a
/// socket or a device. Opening one of these may wait for ever, and reading one may never end.
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    must_be_regular(path)?;
    fs::read(path).map_err(|e| Error::io(path, "read", e))
}

/// Opens a regular file to read it.
///
/// ```
/// use s3d_io::fs::open_file;
/// use std::path::Path;
///
/// let message = open_file(Path::new(".")).unwrap_err().to_string();
/// assert_eq!(message, ".: is a folder, not a file");
/// ```
///
/// # Errors
/// Like [`read_file`].
pub fn open_file(path: &Path) -> Result<fs::File> {
    must_be_regular(path)?;
    fs::File::open(path).map_err(|e| Error::io(path, "read", e))
}

/// Returns the files and folders in a folder, sorted by name.
///
/// # Errors
/// [`Error::Io`] if it cannot be read.
pub(crate) fn list_folder(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |e| Error::io(folder, "read the folder", e);
    let entries = fs::read_dir(folder).map_err(failed)?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path()).map_err(failed));
    let mut paths = paths.collect::<Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}

/// Refuses a path that exists and is not a regular file, without opening it.
///
/// # Errors
/// Like [`read_file`].
pub(crate) fn must_be_regular(path: &Path) -> Result<()> {
    let what = fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
    if what.is_file() {
        return Ok(());
    }
    Err(Error::format(
        path,
        if what.is_dir() {
            "is a folder, not a file"
        } else {
            "is a pipe or a device, and only files are read: put its content into a file"
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_file_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        for error in [read_file(dir.path()).unwrap_err(), open_file(dir.path()).unwrap_err()] {
            assert!(error.to_string().contains("is a folder, not a file"), "{error}");
        }
        let device = if cfg!(unix) { "/dev/null" } else { "nul" };
        assert!(
            read_file(Path::new(device))
                .unwrap_err()
                .to_string()
                .contains("is a pipe or a device")
        );
        assert!(matches!(open_file(&dir.path().join("gone")), Err(Error::Io { .. })));
    }

    /// Each of these readers would wait for somebody to write into the pipe.
    #[cfg(unix)]
    #[test]
    fn a_pipe_is_refused_at_once() {
        let dir = tempfile::tempdir().unwrap();
        let pipe = dir.path().join("pipe");
        assert!(
            std::process::Command::new("mkfifo")
                .arg(&pipe)
                .status()
                .unwrap()
                .success()
        );
        let readers: [fn(&Path) -> Result<()>; 2] =
            [|path| read_file(path).map(drop), |path| open_file(path).map(drop)];
        for read in readers {
            let message = read(&pipe).unwrap_err().to_string();
            assert!(message.contains("pipe: is a pipe or a device, and only files are read"), "{message}");
        }
        #[cfg(feature = "dataset")]
        assert!(crate::fs::checksum_of_file(&pipe).is_err());
        #[cfg(feature = "write")]
        assert!(crate::fs::sync_file(&pipe).is_err());
        #[cfg(feature = "camera")]
        assert!(crate::camera::read_picture_size(&pipe).is_err());
    }
}
