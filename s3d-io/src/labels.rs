//! `semantic_labels.json`: an array of label names; the place of a name is its index.

use crate::{Result, read_json, write_json};
use std::path::Path;

/// Writes the names of labels, the null label first, and returns the file's size in bytes. Source: formats.md, "Labels".
///
/// # Errors
/// [`crate::Error::Io`].
pub fn write_labels(path: &Path, names: &[String]) -> Result<u64> {
    write_json(path, names)
}

/// Reads the names of labels.
///
/// # Errors
/// [`crate::Error::Io`]; [`crate::Error::Format`] if the file is no JSON array of strings.
pub fn read_labels(path: &Path) -> Result<Vec<String>> {
    read_json(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::write_bytes;

    #[test]
    fn names_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("semantic_labels.json");
        let names = ["<UNK>_0_<UNK>_0_0", "beam_10_hallway_6_1", "a \"quoted\"\\ name"].map(String::from);
        write_labels(&path, &names).unwrap();
        assert_eq!(read_labels(&path).unwrap(), names);
        write_labels(&path, &[]).unwrap();
        assert!(read_labels(&path).unwrap().is_empty());
    }

    #[test]
    fn the_line_of_a_mistake_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("semantic_labels.json");
        write_bytes(&path, b"[\n\"a\",\n3]").unwrap();
        let e = read_labels(&path).unwrap_err().to_string();
        assert!(e.contains("semantic_labels.json, line 3: invalid type: integer `3`"), "{e}");
    }

    #[test]
    #[expect(clippy::print_stderr, reason = "a skipped test says so")]
    fn the_published_file_comes_back() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/spec/semantic_labels.json");
        if !path.exists() {
            eprintln!("skipped: {} is not there", path.display());
            return;
        }
        let names = read_labels(&path).unwrap();
        assert_eq!((names.len(), names[257].as_str()), (9816, "board_3_hallway_4_6"));
        let dir = tempfile::tempdir().unwrap();
        let copy = dir.path().join("copy.json");
        write_labels(&copy, &names).unwrap();
        assert_eq!(read_labels(&copy).unwrap(), names);
    }
}
