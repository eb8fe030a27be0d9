//! The label table as a file, so that no annotation has to be opened to know it.

use crate::error::Result;
use crate::store::checked::{read_checked, write_checked};
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::create_dir;
use s3d_label::LabelTable;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The names of a label table, in order, without padding.
#[derive(Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct LabelList {
    names: Vec<String>,
}

impl LabelList {
    pub(crate) fn of(table: &LabelTable) -> Self {
        Self { names: table.names() }
    }

    /// Where an unfinished export keeps it.
    pub(crate) fn path(layout: &Layout) -> PathBuf {
        layout.work_dir().join("labels.jsonl")
    }

    /// Writes it; its folder is made.
    pub(crate) fn write(&self, path: &Path) -> Result<()> {
        path.parent().map_or(Ok(()), create_dir)?;
        write_checked(path, self)
    }

    pub(crate) fn read(path: &Path) -> Result<Self> {
        read_checked(path)
    }

    /// How many there are, the null label included.
    pub(crate) fn len(&self) -> usize {
        self.names.len()
    }

    /// The names, the null label first.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// The table.
    ///
    /// # Errors
    /// If the file at `path` holds names that make no table.
    pub(crate) fn table(&self, path: &Path) -> Result<LabelTable> {
        LabelTable::from_names(&self.names).map_err(|e| FileError::format(path, e.to_string()).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_comes_back() {
        let labels = ["chair_1_office_1_1", "wall_2_WC_3_5", "chair_10_office_1_1"];
        let table = LabelTable::from_labels(labels.map(|l| l.parse().unwrap())).unwrap();
        let dir = tempfile::tempdir().unwrap();
        let path = LabelList::path(&Layout::new(dir.path()));
        LabelList::of(&table).write(&path).unwrap();
        let list = LabelList::read(&path).unwrap();
        assert_eq!((list.len(), list.names()[0].as_str()), (4, s3d_label::NULL_NAME));
        assert_eq!(list.table(&path).unwrap(), table);
        write_checked(&path, &["floor_1_office_1_1"]).unwrap();
        assert!(LabelList::read(&path).unwrap().table(&path).is_err());
    }
}
