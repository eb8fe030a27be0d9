//! Whether input files stay the same while they are read. Checksums and data come from separate passes over
//! a file, and a data set must not have the data of one version under the checksum of another.

use crate::error::Result;
use s3d_io::Error as FileError;
use std::collections::BTreeMap;
use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// What changes when a file is written to or replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    bytes: u64,
    modified: Option<SystemTime>,
    /// The file's number on its disk, which differs if another file took the name; 0 where systems have none.
    number: u64,
}

impl Stamp {
    fn of(path: &Path) -> Result<Self> {
        let found = fs::metadata(path).map_err(|e| FileError::io(path, "read", e))?;
        Ok(Self { bytes: found.len(), modified: found.modified().ok(), number: number_of(&found) })
    }
}

#[cfg(unix)]
fn number_of(found: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(found)
}

#[cfg(not(unix))]
fn number_of(_: &Metadata) -> u64 {
    0
}

/// The state of input files when they were looked at first.
#[derive(Debug, Default)]
pub(crate) struct Stamps(BTreeMap<PathBuf, Stamp>);

impl Stamps {
    /// Looks at files. Folders, and what does not exist, are passed over.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if one has changed since it was looked at first.
    pub(crate) fn look<'a>(&mut self, files: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
        for path in files.into_iter().filter(|path| path.is_file()) {
            let now = Stamp::of(path)?;
            if *self.0.entry(path.clone()).or_insert(now) != now {
                return Err(changed(path));
            }
        }
        Ok(())
    }

    /// Looks at all files again.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if one has changed.
    pub(crate) fn check(&self) -> Result<()> {
        for (path, stamp) in &self.0 {
            if Stamp::of(path)? != *stamp {
                return Err(changed(path));
            }
        }
        Ok(())
    }
}

fn changed(path: &Path) -> crate::Error {
    let message = "changed while it was read, so the data set would mix two versions: wait until nothing \
                   writes to it, and export again into an empty folder";
    FileError::format(path, message).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_changes_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let paths = ["a.txt", "b.txt", "gone.txt"].map(|name| dir.path().join(name));
        paths[..2].iter().for_each(|path| fs::write(path, "1 2 3").unwrap());
        let mut stamps = Stamps::default();
        stamps.look(&paths).unwrap();
        stamps.look(&paths[..1]).unwrap();
        stamps.check().unwrap();

        // As many bytes, and as old: another file took the name.
        let modified = fs::metadata(&paths[1]).unwrap().modified().unwrap();
        let other = dir.path().join("other.txt");
        fs::write(&other, "4 5 6").unwrap();
        fs::File::options()
            .write(true)
            .open(&other)
            .unwrap()
            .set_modified(modified)
            .unwrap();
        fs::rename(&other, &paths[1]).unwrap();
        #[cfg(unix)]
        {
            let message = stamps.check().unwrap_err().to_string();
            assert!(message.contains("b.txt: changed while it was read"), "{message}");
            assert!(stamps.look(&paths).is_err());
        }

        fs::write(&paths[0], "1 2 3 4").unwrap();
        let message = stamps.check().unwrap_err().to_string();
        assert!(message.contains("a.txt: changed while it was read"), "{message}");
        fs::remove_file(&paths[0]).unwrap();
        assert!(stamps.check().is_err());
    }
}
