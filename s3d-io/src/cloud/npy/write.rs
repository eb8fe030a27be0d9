//! Writes `.npy` files, numpy's arrays, piece by piece.
//!
//! Own code, a dozen lines: npyz writes other bytes than numpy (`npyz_writes_other_bytes`).

use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes an array of any size piece by piece, row-major (C order). The file appears whole or not at all.
///
/// ```
/// # let dir = tempfile::tempdir().unwrap();
/// # let path = dir.path().join("points.npy");
/// let mut array = s3d_io::cloud::NpyWriter::create(&path, "<f8", &[2, 3])?;
/// for row in [[1.0f64, 2.0, 3.0], [4.0, 5.0, 6.0]] {
///     array.put(&row.map(f64::to_le_bytes).concat())?;
/// }
/// assert_eq!(array.finish()?, 128 + 6 * 8);
/// # Ok::<(), s3d_io::Error>(())
/// ```
#[derive(Debug)]
pub struct NpyWriter<W = AtomicFile> {
    file: W,
    name: PathBuf,
    promised: u64,
    written: u64,
}

impl NpyWriter {
    /// Creates the file `path`; see [`NpyWriter::new`].
    ///
    /// # Errors
    /// [`Error::Io`].
    ///
    /// # Panics
    /// As [`NpyWriter::new`] does.
    pub fn create(path: &Path, kind: &str, shape: &[u64]) -> Result<Self> {
        Self::new(AtomicFile::create(path)?, path, kind, shape)
    }

    /// Gives the file its name, and returns its size in bytes.
    ///
    /// # Errors
    /// The errors of [`NpyWriter::into_inner`]. After an error there is no file.
    pub fn finish(self) -> Result<u64> {
        self.into_inner()?.commit()
    }
}

impl<W: Write> NpyWriter<W> {
    /// Starts an array in `file`, with elements of the numpy type `kind` (`"<f4"`, `"<f8"`, `"<i8"`,
    /// `"<u4"`…: the digit is the element's bytes) and the sides `shape`. Errors call the file `name`.
    ///
    /// # Errors
    /// [`Error::Io`].
    ///
    /// # Panics
    /// If `kind` does not end with a size of one digit, or the array has more bytes than 64 bits can count.
    #[expect(clippy::expect_used, reason = "a caller's mistake: see Panics")]
    pub fn new(mut file: W, name: &Path, kind: &str, shape: &[u64]) -> Result<Self> {
        let size = kind
            .chars()
            .last()
            .and_then(|c| c.to_digit(10))
            .expect("a type ends with its size in bytes");
        let bytes = shape.iter().try_fold(u64::from(size), |n, side| n.checked_mul(*side));
        let promised = bytes.expect("an array that 64 bits can count");
        file.write_all(&npy_header(kind, shape))
            .map_err(|e| Error::io(name, "write", e))?;
        Ok(Self { file, name: name.to_owned(), promised, written: 0 })
    }

    /// Appends elements as bytes, the lowest byte first.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.written += bytes.len() as u64;
        self.file
            .write_all(bytes)
            .map_err(|e| Error::io(&self.name, "write", e))
    }

    /// Returns the complete file.
    ///
    /// # Errors
    /// [`Error::Format`] if there are not as many bytes as the shape promises.
    pub fn into_inner(self) -> Result<W> {
        if self.written != self.promised {
            let message = format!("{} bytes of an array were promised, {} came", self.promised, self.written);
            return Err(Error::format(&self.name, message));
        }
        Ok(self.file)
    }
}

/// The header of an `.npy` file (version 1.0 of numpy's format): magic, length, and a Python literal padded
/// with spaces so that the numbers begin at a multiple of 64 bytes. npyz writes one more space in it
/// (`npyz_writes_other_bytes`), and its types of elements at run time would make this code longer.
pub(crate) fn npy_header(kind: &str, shape: &[u64]) -> Vec<u8> {
    const FIXED: usize = 10;
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let literal = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", shape.trim_end());
    let length = (FIXED + literal.len() + 1).next_multiple_of(64) - FIXED;
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend(u16::try_from(length).unwrap_or(u16::MAX).to_le_bytes());
    header.extend(format!("{literal:<width$}\n", width = length - 1).bytes());
    header
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npy");
        let mut array = NpyWriter::create(&path, "<f8", &[1000, 7]).unwrap();
        let values: Vec<f64> = (0..7000).map(|i| f64::from(i) * 0.001 - 2.0).collect();
        for piece in values.chunks(999) {
            array
                .put(&piece.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>())
                .unwrap();
        }

        array.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let read = npyz::NpyFile::new(&bytes[..]).unwrap();
        assert_eq!(read.shape(), [1000, 7]);
        assert_eq!(read.into_vec::<f64>().unwrap(), values);

        NpyWriter::create(&path, "<i8", &[0]).unwrap().finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert!(
            npyz::NpyFile::new(&bytes[..])
                .unwrap()
                .into_vec::<i64>()
                .unwrap()
                .is_empty()
        );
    }

    #[test]
    fn npyz_writes_other_bytes() {
        use npyz::WriterBuilder;
        let mut bytes = Vec::new();
        let writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(&[2, 3])
            .writer(&mut bytes);
        let mut writer = writer.begin_nd().unwrap();
        writer.extend([0.0f64; 6]).unwrap();
        writer.finish().unwrap();
        let ours = npy_header("<f8", &[2, 3]);
        assert_eq!(bytes.len(), ours.len() + 48);
        assert_ne!(bytes[..ours.len()], ours);
        assert_eq!(npyz::NpyHeader::from_reader(&ours[..]).unwrap().shape(), [2, 3]);
    }

    #[test]
    fn a_wrong_count_is_an_error_and_leaves_no_file() {
        let dir = tempfile::tempdir().unwrap();
        let mut array = NpyWriter::create(&dir.path().join("a.npy"), "<f4", &[3]).unwrap();
        array.put(&[0; 8]).unwrap();
        let e = array.finish().unwrap_err().to_string();
        assert!(e.ends_with("a.npy: 12 bytes of an array were promised, 8 came"), "{e}");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }

    #[test]
    #[should_panic(expected = "ends with its size")]
    fn a_type_without_a_size_is_a_callers_mistake() {
        let _ = NpyWriter::create(Path::new("never.npy"), "float", &[1]);
    }
}
