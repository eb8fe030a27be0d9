//! Files for decoders that are not ours and allocate what a damaged file claims.
//!
//! laz allocates every layer of a chunk before it reads one: up to 4 GiB each for a file of a few hundred
//! bytes (`tests/findings.rs` feeds those again that were found).

use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A file whose decoder allocates as much as a number of four bytes says, before it reads that many.
#[derive(Debug)]
pub(crate) struct BoundedClaims<R> {
    file: R,
    most: Arc<AtomicU32>,
}

impl<R> BoundedClaims<R> {
    /// Beside the file the largest number of four bytes that it hands on. At first that is any.
    pub(crate) fn new(file: R) -> (Self, Arc<AtomicU32>) {
        let most = Arc::new(AtomicU32::new(u32::MAX));
        (Self { file, most: most.clone() }, most)
    }
}

impl<R: Read> Read for BoundedClaims<R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        self.file.read(buffer)
    }

    fn read_exact(&mut self, buffer: &mut [u8]) -> Result<()> {
        self.file.read_exact(buffer)?;
        match <[u8; 4]>::try_from(&*buffer) {
            Ok(number) if u32::from_le_bytes(number) > self.most.load(Relaxed) => {
                let message = format!("claims {} bytes", u32::from_le_bytes(number));
                Err(Error::new(ErrorKind::InvalidData, message))
            }
            _ => Ok(()),
        }
    }
}

impl<R: Seek> Seek for BoundedClaims<R> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        self.file.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn claims_beyond_the_bound_are_errors() {
        let bytes: Vec<u8> = [7u32, 8, 9].iter().flat_map(|n| n.to_le_bytes()).collect();
        let (mut file, most) = BoundedClaims::new(Cursor::new(bytes));
        let mut four = [0; 4];
        most.store(8, Relaxed);
        file.read_exact(&mut four).unwrap();
        file.read_exact(&mut four).unwrap();
        assert_eq!(four, 8u32.to_le_bytes());
        assert_eq!(file.read_exact(&mut four).unwrap_err().kind(), ErrorKind::InvalidData);
        file.seek(SeekFrom::Start(0)).unwrap();
        // Other lengths are data.
        file.read_exact(&mut [0; 12]).unwrap();
    }
}
