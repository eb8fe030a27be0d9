//! Checksums of files: XXH3 of 128 bits, written as `xxhsum -H2` prints it.
//!
//! They detect accidental changes: half a file, a flipped bit, zeros after a power loss. They do not protect
//! against somebody who changes files on purpose.

use crate::error::{Error, Result};
use crate::fs::open::open_file;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::str::FromStr;
use thiserror::Error;
use xxhash_rust::xxh3::{Xxh3Default, xxh3_128};

/// The size of the read buffer, bytes.
const BUFFER: usize = 1 << 18;

/// The 128-bit XXH3 hash of a file's content, with seed 0. As text it is 32 lower-case hexadecimal digits,
/// the most significant first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Checksum(pub u128);

/// The error for text that is not a checksum.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{text:?} is no checksum of 32 lower-case hexadecimal digits")]
pub struct BadChecksum {
    /// The text.
    pub text: String,
}

impl Checksum {
    /// Returns the checksum of `bytes`.
    pub fn of(bytes: &[u8]) -> Self {
        Self(xxh3_128(bytes))
    }
}

/// Computes the checksum of bytes that arrive in pieces, and counts them.
#[derive(Clone)]
pub struct ChecksumOfParts {
    state: Box<Xxh3Default>,
    bytes: u64,
}

impl fmt::Debug for ChecksumOfParts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ChecksumOfParts")
            .field("bytes", &self.bytes)
            .finish_non_exhaustive()
    }
}

impl Default for ChecksumOfParts {
    fn default() -> Self {
        Self { state: Box::new(Xxh3Default::new()), bytes: 0 }
    }
}

impl ChecksumOfParts {
    /// Adds the next bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        self.state.update(bytes);
        self.bytes += bytes.len() as u64;
    }

    /// Returns the number of bytes so far, and their checksum.
    pub fn finish(&self) -> (u64, Checksum) {
        (self.bytes, Checksum(self.state.digest128()))
    }
}

/// Returns a file's size in bytes and its checksum. The file is read in small blocks.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is not a regular file.
pub fn checksum_of_file(path: &Path) -> Result<(u64, Checksum)> {
    let mut file = open_file(path)?;
    let mut buffer = vec![0; BUFFER];
    let mut parts = ChecksumOfParts::default();

    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(parts.finish()),
            Ok(n) => parts.add(buffer.get(..n).unwrap_or_default()),
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => return Err(Error::io(path, "read", e)),
        }
    }
}

impl fmt::Display for Checksum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl FromStr for Checksum {
    type Err = BadChecksum;

    fn from_str(text: &str) -> std::result::Result<Self, BadChecksum> {
        let digits = text.len() == 32 && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
        let value = if digits {
            u128::from_str_radix(text, 16).ok()
        } else {
            None
        };
        value.map(Self).ok_or_else(|| BadChecksum { text: text.to_owned() })
    }
}

impl Serialize for Checksum {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Checksum {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fs::atomic::write_bytes;

    /// The contents of files, and the checksums that `xxhsum -H2` prints for them.
    const PUBLISHED: [(&[u8], &str); 2] =
        [(b"", "99aa06d3014798d86001c324468d497f"), (b"a", "a96faf705af16834e6c632b61e964e1f")];

    #[test]
    fn it_is_what_xxhsum_prints() {
        let dir = tempfile::tempdir().unwrap();
        for (bytes, text) in PUBLISHED {
            assert_eq!(Checksum::of(bytes).to_string(), text);
            let path = dir.path().join("file");
            write_bytes(&path, bytes).unwrap();
            assert_eq!(checksum_of_file(&path).unwrap(), (bytes.len() as u64, text.parse().unwrap()));
        }
    }

    #[test]
    fn pieces_and_files_have_the_checksum_of_the_whole() {
        let bytes: Vec<u8> = (0..3 * BUFFER as u32 + 17)
            .map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8)
            .collect();

        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("file");
        write_bytes(&path, &bytes).unwrap();
        let whole = (bytes.len() as u64, Checksum::of(&bytes));
        assert_eq!(checksum_of_file(&path).unwrap(), whole);

        let mut parts = ChecksumOfParts::default();
        bytes.chunks(1001).for_each(|chunk| parts.add(chunk));
        assert_eq!(parts.finish(), whole);

        let message = checksum_of_file(&dir.path().join("gone")).unwrap_err().to_string();
        assert!(message.contains("gone: cannot read"), "{message}");
    }

    #[test]
    fn texts_come_back_and_others_are_refused() {
        for value in [0, 1, u128::MAX] {
            let sum = Checksum(value);
            assert_eq!(sum.to_string().parse(), Ok(sum));
            let json = serde_json::to_string(&sum).unwrap();
            assert_eq!(serde_json::from_str::<Checksum>(&json).unwrap(), sum);
        }
        let long = "0".repeat(33);
        for text in
            ["", "99aa", &long, "99AA06D3014798D86001C324468D497F", "+9aa06d3014798d86001c324468d497f"]
        {
            assert!(text.parse::<Checksum>().is_err(), "{text}");
        }
        let e = serde_json::from_str::<Checksum>("\"zz\"").unwrap_err().to_string();
        assert!(e.contains("\"zz\" is no checksum"), "{e}");
    }
}
