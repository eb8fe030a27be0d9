//! `semantic_labels.json`: an array of label names; the place of a name is its index.

use crate::error::Result;
use crate::fs::json::{read_json, write_json};
use s3d_label::NULL_NAME;
use std::path::Path;

/// The number of entries that a table needs for loaders that look a pixel up as `table[G * 256 + B]` before
/// they see that R is not 0. The colour of missing pixels, (13, 13, 13), is such an index too.
pub const PADDED_LABELS: usize = 13 * 256 + 13 + 1;

/// The largest number of instance labels in a table for such loaders: they see 16 bits of an index.
pub const MAX_LABELS_OF_LOADERS: usize = 65_535;

/// Appends null labels until there are `entries` names. Readers of a table take null labels at its end for
/// padding.
pub fn pad_labels(names: &mut Vec<String>, entries: usize) {
    names.resize(names.len().max(entries), NULL_NAME.to_owned());
}

/// Writes the names of labels, the null label first, and returns the file's size in bytes. Source:
/// [`crate::formats`], "What is written".
///
/// # Errors
/// [`crate::Error::Io`].
pub fn write_labels(path: &Path, names: &[String]) -> Result<u64> {
    write_json(path, names)
}

/// Reads the names of labels.
///
/// # Errors
/// [`crate::Error::Io`]; [`crate::Error::Format`] if the file is not a JSON array of strings.
pub fn read_labels(path: &Path) -> Result<Vec<String>> {
    read_json(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fs::atomic::write_bytes;

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
    fn padded_tables_are_the_same_table() {
        let mut names = vec![NULL_NAME.to_owned(), "beam_10_hallway_6_1".to_owned()];
        let table = s3d_label::LabelTable::from_names(&names).unwrap();
        pad_labels(&mut names, PADDED_LABELS);
        assert_eq!((names.len(), names[0x0d0d].as_str()), (3342, NULL_NAME));
        assert_eq!(s3d_label::LabelTable::from_names(&names).unwrap(), table);
        pad_labels(&mut names, 7);
        assert_eq!(names.len(), 3342, "nothing is cut off");
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
