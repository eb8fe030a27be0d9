//! Bytes that can be read several times, from a file or from a caller's reader.

use crate::error::{Error, Result};
use crate::fs::open::open_file;
use std::fmt;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A reader that a [`Source`] can be made from.
pub(crate) trait ReadSeek: Read + Seek + Send {}

impl<R: Read + Seek + Send> ReadSeek for R {}

type Shared = Arc<Mutex<Box<dyn ReadSeek>>>;

/// The source of a file's bytes, and the name that errors give it.
#[derive(Clone)]
pub(crate) struct Source {
    name: PathBuf,
    /// The caller's reader. If `None`, the file `name` is read.
    reader: Option<Shared>,
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Source").field(&self.name).finish()
    }
}

impl Source {
    pub(crate) fn file(path: &Path) -> Self {
        Self { name: path.to_owned(), reader: None }
    }

    pub(crate) fn reader(name: &Path, reader: impl ReadSeek + 'static) -> Self {
        Self { name: name.to_owned(), reader: Some(Arc::new(Mutex::new(Box::new(reader)))) }
    }

    pub(crate) fn name(&self) -> &Path {
        &self.name
    }

    /// Returns whether it is the file of its name, so that others may lie beside it.
    #[cfg(feature = "kitti")]
    pub(crate) fn is_file(&self) -> bool {
        self.reader.is_none()
    }

    /// Returns a new reader that starts at the first byte, and the number of bytes. Every reader has its own
    /// position.
    pub(crate) fn open(&self) -> Result<(Bytes, u64)> {
        let io = |e| Error::io(&self.name, "read", e);
        match &self.reader {
            None => {
                let file = open_file(&self.name)?;
                let size = file.metadata().map_err(io)?.len();
                Ok((Bytes::File(file), size))
            }
            Some(reader) => {
                let mut bytes = Bytes::Shared { reader: Arc::clone(reader), at: 0 };
                let size = bytes
                    .seek(SeekFrom::End(0))
                    .and_then(|n| bytes.rewind().map(|()| n))
                    .map_err(io)?;
                Ok((bytes, size))
            }
        }
    }
}

/// Reads the bytes of a [`Source`]. Small reads are slow.
pub(crate) enum Bytes {
    File(File),
    Shared { reader: Shared, at: u64 },
}

impl fmt::Debug for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Bytes")
    }
}

impl Read for Bytes {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::File(file) => file.read(out),
            Self::Shared { reader, at } => {
                let mut reader = reader.lock().unwrap_or_else(PoisonError::into_inner);
                reader.seek(SeekFrom::Start(*at))?;
                let n = reader.read(out)?;
                *at = at.saturating_add(n as u64);
                Ok(n)
            }
        }
    }
}

impl Seek for Bytes {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Self::File(file) => file.seek(to),
            Self::Shared { reader, at } => {
                let to = match to {
                    SeekFrom::Current(by) => at
                        .checked_add_signed(by)
                        .map(SeekFrom::Start)
                        .ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?,
                    other => other,
                };
                *at = reader.lock().unwrap_or_else(PoisonError::into_inner).seek(to)?;
                Ok(*at)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Cursor, Write};

    #[test]
    fn readers_of_one_source_do_not_disturb_each_other() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(b"0123456789").unwrap();
        let value = Source::reader(Path::new("digits"), Cursor::new(b"0123456789".to_vec()));
        for source in [Source::file(file.path()), value] {
            let (mut a, size) = source.open().unwrap();
            let (mut b, _) = source.open().unwrap();
            let mut two = [0; 2];
            assert_eq!((size, a.seek(SeekFrom::Start(3)).unwrap()), (10, 3));
            b.read_exact(&mut two).unwrap();
            assert_eq!(two, *b"01");
            a.read_exact(&mut two).unwrap();
            assert_eq!((two, a.seek(SeekFrom::Current(-1)).unwrap()), (*b"34", 4));
            assert_eq!((b.seek(SeekFrom::End(-1)).unwrap(), b.read(&mut two).unwrap()), (9, 1));
            assert_eq!((two[0], b.read(&mut two).unwrap()), (b'9', 0));
            assert!(a.seek(SeekFrom::Current(-9)).is_err());
        }
    }
}
