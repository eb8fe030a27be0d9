//! Lists folders of predictions.

use s3d_io::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// Returns the files and folders in a folder, sorted by name, without hidden ones.
pub(crate) fn entries(dir: &Path) -> Result<Vec<PathBuf>, Error> {
    let failed = |e| Error::io(dir, "read the folder", e);
    let mut paths = Vec::new();
    for entry in fs::read_dir(dir).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        if !entry.file_name().to_string_lossy().starts_with('.') {
            paths.push(entry.path());
        }
    }
    paths.sort();
    Ok(paths)
}
