//! `assets/taxonomy.json`: the classes and types of rooms of a data set that does not use S3DIS's.

use crate::error::{Error, Result};
use crate::fs::json::{read_json, write_json};
use s3d_label::{Taxonomy, TaxonomyDefinition};
use std::path::Path;

/// Writes the definition of a taxonomy, and returns the file's size in bytes.
///
/// # Errors
/// [`Error::Io`].
pub fn write_taxonomy_json(path: &Path, taxonomy: &Taxonomy) -> Result<u64> {
    write_json(path, taxonomy.definition())
}

/// Reads a taxonomy in JSON.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`], with the line if the file is not JSON or has other fields, with the
/// entry if it is not a taxonomy.
pub fn read_taxonomy_json(path: &Path) -> Result<Taxonomy> {
    taxonomy(path, read_json(path)?)
}

/// Reads like [`read_taxonomy_json`]. Returns S3DIS's taxonomy if there is no such file.
///
/// # Errors
/// Like [`read_taxonomy_json`].
pub fn read_taxonomy_json_or_s3dis(path: &Path) -> Result<Taxonomy> {
    match path.try_exists() {
        Ok(false) => Ok(Taxonomy::s3dis()),
        _ => read_taxonomy_json(path),
    }
}

/// Returns the taxonomy of a definition in the file `path`.
pub(crate) fn taxonomy(path: &Path, definition: TaxonomyDefinition) -> Result<Taxonomy> {
    Taxonomy::new(definition).map_err(|e| Error::format(path, e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taxonomies_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("taxonomy.json");
        assert_eq!(read_taxonomy_json_or_s3dis(&path).unwrap(), Taxonomy::s3dis());
        for name in ["nyu40", "scannet20", "scannet200", "matterport40"] {
            let taxonomy = Taxonomy::built_in(name).unwrap();
            write_taxonomy_json(&path, &taxonomy).unwrap();
            assert_eq!(read_taxonomy_json_or_s3dis(&path).unwrap(), taxonomy);
        }
        std::fs::write(&path, "{\"name\": \"x\",\n\"classes\": [{\"title\": \"bed\"}]}").unwrap();
        let message = read_taxonomy_json(&path).unwrap_err().to_string();
        assert!(message.contains("taxonomy.json, line 2: unknown field `title`"), "{message}");
        std::fs::write(&path, "{\"name\": \"x\", \"classes\": []}").unwrap();
        let message = read_taxonomy_json_or_s3dis(&path).unwrap_err().to_string();
        assert!(message.contains("taxonomy.json: has no classes"), "{message}");
    }
}
