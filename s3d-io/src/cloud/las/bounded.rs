//! Wrappers of a LAS file, for a decoder that is not ours: it allocates whatever a damaged file claims, and
//! stops at header counts that nobody needs.
//!
//! The crate laz allocates every layer of a chunk before it reads one: up to 4 GiB each, for a file of a few
//! hundred bytes. `tests/findings.rs` feeds it such files again.

use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A file with a bound on lengths: its decoder allocates as many bytes as a four-byte number says, and only
/// then reads them.
#[derive(Debug)]
pub(crate) struct BoundedClaims<R> {
    file: R,
    most: Arc<AtomicU32>,
}

impl<R> BoundedClaims<R> {
    /// Returns the file, and the largest four-byte number that it passes on. At first this is any number.
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

/// A file that reads other numbers at a few places.
#[derive(Debug)]
pub(crate) struct Mended<R> {
    file: R,
    at: u64,
    /// Where each number stands, and its bytes.
    mends: Vec<(u64, [u8; 4])>,
}

impl<R> Mended<R> {
    /// Wraps `file`, which must be at its first byte, with these numbers at these places.
    pub(crate) fn new(file: R, mends: &[(u64, u32)]) -> Self {
        Self { file, at: 0, mends: mends.iter().map(|(at, n)| (*at, n.to_le_bytes())).collect() }
    }
}

impl<R: Read> Read for Mended<R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let n = self.file.read(buffer)?;
        let read = buffer.get_mut(..n).unwrap_or_default();
        for (place, bytes) in &self.mends {
            for (place, byte) in (*place..).zip(bytes) {
                let here = place
                    .checked_sub(self.at)
                    .and_then(|i| read.get_mut(usize::try_from(i).ok()?));
                here.into_iter().for_each(|here| *here = *byte);
            }
        }
        self.at = self.at.saturating_add(n as u64);
        Ok(n)
    }
}

impl<R: Seek> Seek for Mended<R> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        self.at = self.file.seek(to)?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn numbers_are_replaced_however_they_are_read() {
        let bytes: Vec<u8> = (0..20).collect();
        let expected = [&bytes[..3], &[9, 8, 7, 6], &bytes[7..12], &[5, 0, 0, 0], &bytes[16..]].concat();
        for at_once in 1..20 {
            let mut file = Mended::new(Cursor::new(&bytes), &[(3, 0x0607_0809), (12, 5)]);
            for start in [0, 5] {
                let mut all = Vec::new();
                let mut piece = vec![0; at_once];
                file.seek(SeekFrom::Start(start)).unwrap();
                loop {
                    let n = file.read(&mut piece).unwrap();
                    all.extend_from_slice(&piece[..n]);
                    if n == 0 {
                        break;
                    }
                }
                assert_eq!(all, expected[start as usize..], "{at_once}");
            }
        }
    }

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
