//! Writes Python's pickle format, as far as a list of texts, numbers and one kind of array needs it.
//!
//! The protocol is 4 (Python 3.4 and later), and Python's `pickletools` describes its opcodes. An array is
//! written as `numpy.reshape(numpy.frombuffer(bytes, "<f8"), (rows, columns))`. These are public functions,
//! the same in numpy 1 and 2, while numpy's own pickles name internal ones. Such an array is read-only, like
//! any array that views bytes.

use crate::error::Result as DatasetResult;
use s3d_io::Result;
use s3d_io::fs::AtomicFile;
use std::path::Path;

/// A pickle of one object, written piece by piece.
pub(super) struct Pickle {
    file: AtomicFile,
    /// The rows and columns of the current array.
    array: (u64, u64),
    /// The bytes that the current array still lacks.
    missing: u64,
}

impl Pickle {
    pub(super) fn create(path: &Path) -> Result<Self> {
        let mut file = AtomicFile::create(path)?;
        file.put(b"\x80\x04")?;
        Ok(Self { file, array: (0, 0), missing: 0 })
    }

    /// Writes a list of the items that `items` writes.
    pub(super) fn list(&mut self, items: impl FnOnce(&mut Self) -> DatasetResult<()>) -> DatasetResult<()> {
        // EMPTY_LIST MARK … APPENDS
        self.file.put(b"](")?;
        items(self)?;
        Ok(self.file.put(b"e")?)
    }

    /// Writes a text of less than 256 bytes.
    pub(super) fn text(&mut self, text: &str) -> Result<()> {
        // SHORT_BINUNICODE
        let length = u8::try_from(text.len()).expect("a short text");
        self.file.put(&[0x8c, length])?;
        self.file.put(text.as_bytes())
    }

    pub(super) fn float(&mut self, number: f64) -> Result<()> {
        // BINFLOAT, highest byte first
        self.file.put(b"G")?;
        self.file.put(&number.to_be_bytes())
    }

    fn integer(&mut self, number: u64) -> Result<()> {
        // LONG1: a signed number, lowest byte first; a ninth byte keeps it positive.
        self.file.put(&[0x8a, 9])?;
        self.file.put(&number.to_le_bytes())?;
        self.file.put(&[0])
    }

    /// Begins an array of `f64`. Its numbers follow through [`put`](Self::put), lowest byte first and row by
    /// row.
    pub(super) fn begin_array(&mut self, rows: u64, columns: u64) -> Result<()> {
        self.array = (rows, columns);
        self.missing = 8 * rows * columns;
        // GLOBAL reshape, GLOBAL frombuffer, BINBYTES8
        self.file.put(b"cnumpy\nreshape\ncnumpy\nfrombuffer\n\x8e")?;
        self.file.put(&self.missing.to_le_bytes())
    }

    pub(super) fn put(&mut self, bytes: &[u8]) -> Result<()> {
        assert!(bytes.len() as u64 <= self.missing, "more numbers than the array has places");
        self.missing -= bytes.len() as u64;
        self.file.put(bytes)
    }

    pub(super) fn end_array(&mut self) -> Result<()> {
        assert_eq!(self.missing, 0, "fewer numbers than the array has places");
        self.text("<f8")?;
        // TUPLE2 REDUCE: frombuffer(bytes, "<f8"); then reshape(that, (rows, columns)).
        self.file.put(b"\x86R")?;
        let (rows, columns) = self.array;
        self.integer(rows)?;
        self.integer(columns)?;
        self.file.put(b"\x86\x86R")
    }

    pub(super) fn finish(mut self) -> Result<u64> {
        self.file.put(b".")?;
        self.file.commit()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The opcodes are named above, as Python's `pickletools.dis` shows them. The Python tests check that
    /// numpy reads the file, together with the other loaders.
    #[test]
    fn opcodes() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.pkl");
        let mut pickle = Pickle::create(&path).unwrap();
        pickle
            .list(|p| {
                p.begin_array(1, 2)?;
                p.put(&[1.0f64, 2.0].map(f64::to_le_bytes).concat())?;
                p.end_array()?;
                p.text("wall")?;
                Ok(p.float(1.0)?)
            })
            .unwrap();
        pickle.finish().unwrap();
        let mut expected = b"\x80\x04](cnumpy\nreshape\ncnumpy\nfrombuffer\n\x8e\x10\0\0\0\0\0\0\0".to_vec();
        expected.extend([1.0f64, 2.0].map(f64::to_le_bytes).concat());
        expected.extend(b"\x8c\x03<f8\x86R\x8a\x09\x01\0\0\0\0\0\0\0\0\x8a\x09\x02\0\0\0\0\0\0\0\0\x86\x86R");
        expected.extend(b"\x8c\x04wallG\x3f\xf0\0\0\0\0\0\0e.");
        assert_eq!(std::fs::read(&path).unwrap(), expected);
    }
}
