//! Files that explain a data set: conventions, schemas, and a Python module that reads it.

use crate::error::Result;
use crate::record::legend;
use s3d_io::dataset::{Conventions, Domain, Layout, WorldOffsets};
use s3d_io::fs::{create_dir, write_bytes};
use s3d_label::LabelTable;
use std::path::PathBuf;

/// The Python module that reads every kind of file of a data set.
const UTILS_PY: &str = include_str!("../../assets/utils.py");
const POSE_SCHEMA: &str = include_str!("../../assets/pose.schema.json");
const MANIFEST_SCHEMA: &str = include_str!("../../assets/manifest.schema.json");

/// Writes `conventions.json`, `assets/utils.py` and `assets/schema`. For a table with more than the null
/// label, also writes its names, padded to at least `pad_labels`; its taxonomy if that is not S3DIS's; and
/// the legend of class images if there are any.
pub(crate) fn write(
    layout: &Layout,
    table: &LabelTable,
    modalities: &[Domain],
    pad_labels: usize,
    conventions: Conventions,
    offsets: &WorldOffsets,
) -> Result<()> {
    create_dir(&layout.assets_dir())?;

    if table.len() > 1 {
        let mut names = table.names();
        s3d_io::dataset::pad_labels(&mut names, pad_labels);
        s3d_io::dataset::write_labels(&layout.labels_json(), &names)?;
        if !table.taxonomy().is_s3dis() {
            s3d_io::dataset::write_taxonomy_json(&layout.taxonomy_json(), table.taxonomy())?;
        }
    }
    if table.len() > 1 && modalities.contains(&Domain::SemanticClass) {
        legend::write(layout, table.taxonomy())?;
    }

    conventions.write(&layout.conventions(), offsets)?;
    create_dir(&layout.schema_dir())?;
    for (path, text) in texts(layout) {
        write_bytes(&path, text.as_bytes())?;
    }
    Ok(())
}

/// Returns the assets that are the same in every data set: their paths and contents.
pub(crate) fn texts(layout: &Layout) -> [(PathBuf, &'static str); 3] {
    [
        (layout.utils_py(), UTILS_PY),
        (layout.pose_schema(), POSE_SCHEMA),
        (layout.manifest_schema(), MANIFEST_SCHEMA),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::ExportOptions;
    use crate::profile::Profile;

    /// Options that the manifest stores beside `options`.
    const STORED_ELSEWHERE: [&str; 3] = ["seed", "place_cameras", "see"];

    /// Returns the words that the schema of an option allows in its list.
    fn words_of(option: &serde_json::Value) -> Vec<serde_json::Value> {
        option["items"]["enum"].as_array().unwrap().clone()
    }

    #[test]
    fn the_schema_of_manifests_knows_all_options_modalities_and_profiles() {
        let schema: serde_json::Value = serde_json::from_str(MANIFEST_SCHEMA).unwrap();
        let options = &schema["properties"]["options"]["properties"];
        let stored: Vec<&str> = ExportOptions::names()
            .iter()
            .filter(|name| !STORED_ELSEWHERE.contains(name))
            .copied()
            .collect();
        let mut known: Vec<&str> = options.as_object().unwrap().keys().map(String::as_str).collect();
        known.sort_unstable_by_key(|name| stored.iter().position(|other| other == name));
        assert_eq!(known, stored);
        assert_eq!(words_of(&options["modalities"]), Domain::ALL.map(Domain::folder));
        assert_eq!(words_of(&options["profiles"]), Profile::ALL.map(Profile::name));
    }
}
