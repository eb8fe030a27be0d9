//! Small JSON files that show whether they are whole: the value on one line, its checksum on the next.

use crate::error::Result;
use s3d_io::Error as FileError;
use s3d_io::fs::{Checksum, read_file, write_bytes};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The second line.
#[derive(Serialize, Deserialize)]
struct Seal {
    /// The checksum of the first line, with its line feed.
    xxh3_128: Checksum,
}

/// Writes `value` as a line of JSON and its checksum as another, whole or not at all. Numbers come back bit
/// by bit.
pub(crate) fn write_checked<T: Serialize>(path: &Path, value: &T) -> Result<()> {
    let mut lines = json_line(path, value)?;
    let seal = Seal { xxh3_128: Checksum::of(&lines) };
    lines.extend(json_line(path, &seal)?);
    write_bytes(path, &lines)?;
    Ok(())
}

/// Returns `value` as a line of JSON for the file at `path`.
fn json_line<T: Serialize>(path: &Path, value: &T) -> Result<Vec<u8>> {
    let mut line = serde_json::to_vec(value).map_err(|e| FileError::format(path, e.to_string()))?;
    line.push(b'\n');
    Ok(line)
}

/// Reads a file that [`write_checked`] wrote.
///
/// # Errors
/// Fails if the file is missing, was cut off, or was changed by as much as a bit.
pub(crate) fn read_checked<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bytes = read_file(path)?;
    let damaged =
        || FileError::format(path, "is damaged: its checksum differs; remove it, and it is made again");

    let end = bytes.iter().position(|b| *b == b'\n').ok_or_else(damaged)? + 1;
    let (line, seal) = bytes.split_at(end);
    let seal: Seal = serde_json::from_slice(seal).map_err(|_| damaged())?;
    if seal.xxh3_128 != Checksum::of(line) {
        return Err(damaged().into());
    }
    serde_json::from_slice(line).map_err(|e| {
        FileError::format(
            path,
            format!("is not of this version of s3d ({e}): remove it, and it is made again"),
        )
        .into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_to_the_bit() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.jsonl");
        let numbers = [0.1 + 0.2, 1e-308, -0.0, f64::MAX, 1.0 / 3.0];
        write_checked(&path, &numbers).unwrap();
        let back: [f64; 5] = read_checked(&path).unwrap();
        assert_eq!(back.map(f64::to_bits), numbers.map(f64::to_bits));
    }

    #[test]
    fn every_cut_and_every_flipped_bit_is_found() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.jsonl");
        write_checked(&path, &("floor", 17)).unwrap();
        let whole = std::fs::read(&path).unwrap();
        assert!(read_checked::<(String, u32)>(&path).is_ok());
        // Only the last line feed may be missing.
        for length in 0..whole.len() - 1 {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(read_checked::<(String, u32)>(&path).is_err(), "{length} bytes");
        }
        for bit in 0..8 * (whole.len() - 1) {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            // A checksum in capitals is the same checksum.
            let same = bytes.to_ascii_lowercase() == whole;
            std::fs::write(&path, bytes).unwrap();
            assert!(same || read_checked::<(String, u32)>(&path).is_err(), "bit {bit}");
        }
        let other = read_checked::<Vec<u8>>(&path).unwrap_err().to_string();
        assert!(other.contains("a.jsonl"), "{other}");
    }
}
