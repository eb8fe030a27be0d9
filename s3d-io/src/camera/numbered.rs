//! Files that are named by numbers.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Files, each with the number that it is named by.
pub(crate) type NumberedFiles = Vec<(u64, PathBuf)>;

/// Returns the files in `folder` whose name is a number and the extension, sorted by number.
pub(crate) fn numbered_files(folder: &Path, extension: &str) -> Result<NumberedFiles> {
    let failed = |e| Error::io(folder, "read the folder", e);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_some_and(|e| e == extension)
            && let Some(number) = path.file_stem().and_then(|stem| stem.to_str()?.parse::<u64>().ok())
        {
            files.push((number, path));
        }
    }
    files.sort();
    Ok(files)
}
