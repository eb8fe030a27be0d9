//! JSON files: pretty-printed, keys in the order of the struct, a line feed at the end.

use crate::error::{Error, Result};
use crate::fs::encoding::utf8;
use crate::fs::open::read_file;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Writes `value` as a JSON file and returns the file's size in bytes.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if JSON cannot express `value`.
#[cfg(feature = "write")]
pub fn write_json<T: serde::Serialize + ?Sized>(path: &Path, value: &T) -> Result<u64> {
    let mut json = serde_json::to_vec_pretty(value).map_err(|e| Error::format(path, e.to_string()))?;
    json.push(b'\n');
    crate::fs::atomic::write_bytes(path, &json)
}

/// Reads a JSON file as a `T`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the line if the file is not JSON, or does not fit `T`.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    parse_json(path, &read_file(path)?)
}

/// Reads the content of the JSON file `path` as a `T`.
///
/// # Errors
/// [`Error::Format`] like [`read_json`].
pub fn parse_json<T: DeserializeOwned>(path: &Path, content: &[u8]) -> Result<T> {
    serde_json::from_slice(&utf8(content)).map_err(|e| Error::line(path, e.line() as u64, e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_exactly_and_errors_name_the_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("numbers.json");
        let numbers = vec![0.1, 1e-300, -7.000000000000001];
        write_json(&path, &numbers).unwrap();
        assert_eq!(read_json::<Vec<f64>>(&path).unwrap(), numbers);
        for bytes in crate::fs::encoding::tests::encoded("[0.1, 1e-300, -7.000000000000001]") {
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(read_json::<Vec<f64>>(&path).unwrap(), numbers);
        }
        write_json(&path, &numbers).unwrap();
        let wrong = read_json::<Vec<String>>(&path).unwrap_err().to_string();
        assert!(wrong.contains("numbers.json, line 2"), "{wrong}");
    }
}
