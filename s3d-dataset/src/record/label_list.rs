//! The label table as a file, so that nobody has to open annotations to know it.

use crate::error::Result;
use crate::record::checked::{read_checked, write_checked};
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::create_dir;
use s3d_label::{LabelTable, Taxonomy, TaxonomyDefinition};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The names of a label table in their order, without padding, and their taxonomy.
#[derive(Serialize, Deserialize)]
pub(crate) struct LabelList {
    names: Vec<String>,
    /// The taxonomy of the names. Absent if it is S3DIS's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    taxonomy: Option<TaxonomyDefinition>,
}

impl LabelList {
    pub(crate) fn of(table: &LabelTable) -> Self {
        let taxonomy = table.taxonomy();
        let taxonomy = (!taxonomy.is_s3dis()).then(|| taxonomy.definition().clone());
        Self { names: table.names(), taxonomy }
    }

    /// Returns where an unfinished export keeps the list.
    pub(crate) fn path(layout: &Layout) -> PathBuf {
        layout.work_dir().join("labels.jsonl")
    }

    /// Writes the list, and makes its folder.
    pub(crate) fn write(&self, path: &Path) -> Result<()> {
        path.parent().map_or(Ok(()), create_dir)?;
        write_checked(path, self)
    }

    pub(crate) fn read(path: &Path) -> Result<Self> {
        read_checked(path)
    }

    /// Returns the taxonomy of the labels.
    ///
    /// # Errors
    /// Fails if the file at `path` holds no valid taxonomy.
    pub(crate) fn taxonomy(&self, path: &Path) -> Result<Taxonomy> {
        let Some(definition) = self.taxonomy.clone() else { return Ok(Taxonomy::s3dis()) };
        Taxonomy::new(definition).map_err(|e| FileError::format(path, e.to_string()).into())
    }

    /// Returns the label table.
    ///
    /// # Errors
    /// Fails if the file at `path` holds names that make no table.
    pub(crate) fn table(&self, path: &Path) -> Result<LabelTable> {
        let table = self.taxonomy(path)?.table_from_names(&self.names);
        table.map_err(|e| FileError::format(path, e.to_string()).into())
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
        assert_eq!((list.names.len(), list.names[0].as_str()), (4, s3d_label::NULL_NAME));
        assert_eq!(list.table(&path).unwrap(), table);

        let nyu40 = Taxonomy::built_in("nyu40").unwrap();
        let table = nyu40.table([nyu40.label("bed_1_bedroom_1_1").unwrap()]).unwrap();
        LabelList::of(&table).write(&path).unwrap();
        assert_eq!(LabelList::read(&path).unwrap().table(&path).unwrap(), table);

        let names = vec!["floor_1_office_1_1".to_owned()];
        LabelList { names, taxonomy: None }.write(&path).unwrap();
        assert!(LabelList::read(&path).unwrap().table(&path).is_err());
    }
}
