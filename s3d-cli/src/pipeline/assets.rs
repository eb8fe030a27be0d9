//! What a data set tells of itself: conventions, schemas, and a Python module that reads it.

use crate::failure::Outcome;
use s3d_io::{Conventions, Layout, create_dir, write_bytes};

/// Reads every kind of file of a data set, in Python.
const UTILS_PY: &str = include_str!("../../assets/utils.py");
const POSE_SCHEMA: &str = include_str!("../../assets/pose.schema.json");
const MANIFEST_SCHEMA: &str = include_str!("../../assets/manifest.schema.json");

/// Writes `conventions.json`, `assets/utils.py` and `assets/schema`.
pub(crate) fn write(layout: &Layout, conventions: Conventions) -> Outcome<()> {
    conventions.write(&layout.conventions())?;
    create_dir(&layout.schema_dir())?;
    write_bytes(&layout.utils_py(), UTILS_PY.as_bytes())?;
    write_bytes(&layout.pose_schema(), POSE_SCHEMA.as_bytes())?;
    write_bytes(&layout.manifest_schema(), MANIFEST_SCHEMA.as_bytes())?;
    Ok(())
}
