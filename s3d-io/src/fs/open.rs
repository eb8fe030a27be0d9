//! Files to read. Devices and pipes are refused before they are opened: even that may never end.

use crate::error::{Error, Result};
use std::fs;
use std::path::Path;

/// The content of a regular file.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>> {
    refuse_what_is_no_file(path)?;
    fs::read(path).map_err(|e| Error::io(path, "read", e))
}

/// Opens a regular file.
pub(crate) fn open_file(path: &Path) -> Result<fs::File> {
    refuse_what_is_no_file(path)?;
    fs::File::open(path).map_err(|e| Error::io(path, "read", e))
}

fn refuse_what_is_no_file(path: &Path) -> Result<()> {
    let what = fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
    if what.is_file() {
        return Ok(());
    }
    Err(Error::format(path, if what.is_dir() { "is a folder, not a file" } else { "is no file" }))
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
        assert!(read_file(Path::new(device)).unwrap_err().to_string().contains("is no file"));
        assert!(matches!(open_file(&dir.path().join("gone")), Err(Error::Io { .. })));
    }
}
