//! Files that are there whole or not at all.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::TempPath;

/// The size of the write buffer, bytes.
const BUFFER: usize = 1 << 18;

/// A file that takes its name only when it is complete.
///
/// It is written under a temporary name (a dot and random letters) in the folder of the final file.
/// [`AtomicFile::commit`] renames it, over an older file if there is one. A file that is dropped before that
/// leaves nothing behind. The final name never shows half a file, even if the process is killed. A crash of
/// the whole machine is not guarded against, because nothing is synced to the disk.
#[derive(Debug)]
pub struct AtomicFile {
    path: PathBuf,
    // Its writer is no `NamedTempFile`, which hides the numbers of the system's errors.
    writer: BufWriter<File>,
    temporary: TempPath,
}

impl AtomicFile {
    /// Starts the file that will be `path`. Its folder must exist.
    ///
    /// # Errors
    /// [`Error::Io`] with `path` if no file can be made in its folder, or `path` is a device or a pipe.
    pub fn create(path: impl Into<PathBuf>) -> Result<Self> {
        let path = path.into();
        if std::fs::metadata(&path).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
            let source = io::Error::new(io::ErrorKind::InvalidInput, "it is a device or a pipe, no file");
            return Err(Error::io(&path, "replace", source));
        }

        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };

        // With `tempfile_in`, the error would lack the system's number, and the file be private to its owner.
        let made = tempfile::Builder::new()
            .prefix(".s3d-")
            .suffix(".part")
            .make_in(folder, |path| File::options().read(true).write(true).create_new(true).open(path));
        let (file, temporary) = made.map_err(|e| Error::io(&path, "write", e))?.into_parts();
        Ok(Self { path, writer: BufWriter::with_capacity(BUFFER, file), temporary })
    }

    /// Returns the final name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its final name, and returns its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`] if the rest cannot be written or the file cannot be renamed; the file is removed then.
    pub fn commit(self) -> Result<u64> {
        let Self { path, writer, temporary } = self;
        let io = |e| Error::io(&path, "write", e);
        let file = writer.into_inner().map_err(|e| io(e.into_error()))?;
        let bytes = file.metadata().map_err(io)?.len();
        temporary
            .persist(&path)
            .map_err(|e| Error::io(&path, "rename the finished file to this name", e.error))?;
        Ok(bytes)
    }

    /// Writes all of `bytes`, like [`Write::write_all`]. The error names the file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.writer
            .write_all(bytes)
            .map_err(|e| Error::io(&self.path, "write", e))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.writer.seek(to)
    }
}

/// Writes a file through `write`, whole or not at all, and returns its size in bytes.
///
/// # Errors
/// [`Error::Io`] with `path`; an error of `write` is wrapped in one too.
pub fn write_whole(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<u64> {
    let mut file = AtomicFile::create(path)?;
    write(&mut file).map_err(|e| Error::io(path, "write", e))?;
    file.commit()
}

/// Writes `bytes` as the file `path`, whole or not at all, and returns their number.
///
/// # Errors
/// [`Error::Io`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<u64> {
    write_whole(path, |w| w.write_all(bytes))
}

/// Makes the folder `path` and its parents, if they do not exist yet.
///
/// # Errors
/// [`Error::Io`].
pub fn create_dir(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path).map_err(|e| Error::io(path, "create the folder", e))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<_> = std::fs::read_dir(dir)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_appears_whole_and_replaces_an_older_one() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        assert_eq!(write_bytes(&path, b"old").unwrap(), 3);

        let mut file = AtomicFile::create(&path).unwrap();
        file.put(b"____new").unwrap();
        file.seek(SeekFrom::Start(0)).unwrap();
        file.put(b"very").unwrap();

        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(file.commit().unwrap(), 7);
        assert_eq!(std::fs::read(&path).unwrap(), b"verynew");
        assert_eq!(names(dir.path()), ["a.txt"]);
    }

    #[test]
    fn a_failure_leaves_nothing_behind_and_names_the_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        let e = write_whole(&path, |w| {
            w.write_all(&[7; 1 << 20])?;
            Err(io::Error::other("the disk is on fire"))
        })
        .unwrap_err();
        assert_eq!(e.path(), path);
        assert!(e.to_string().ends_with("a.txt: cannot write: the disk is on fire"), "{e}");
        assert!(names(dir.path()).is_empty());

        drop(AtomicFile::create(&path).unwrap());
        assert!(names(dir.path()).is_empty());

        let e = write_bytes(&dir.path().join("none/a.txt"), b"").unwrap_err();
        assert!(matches!(&e, Error::Io { path, .. } if path.ends_with("none/a.txt")), "{e}");
        // The number of the system's error is kept: it tells whether another try may help.
        assert!(matches!(&e, Error::Io { source, .. } if source.raw_os_error().is_some()), "{e:?}");
        create_dir(&dir.path().join("x/y")).unwrap();
        create_dir(&dir.path().join("x/y")).unwrap();
        // A folder cannot be replaced by a file.
        assert!(write_bytes(&dir.path().join("x"), b"").is_err());
        assert_eq!(names(dir.path()), ["x"]);
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_any_other_file() {
        use std::os::unix::fs::PermissionsExt;

        let dir = tempfile::tempdir().unwrap();
        let ours = dir.path().join("ours");
        let plain = dir.path().join("plain");
        write_bytes(&ours, b"").unwrap();
        std::fs::write(&plain, b"").unwrap();

        let mode = |path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
