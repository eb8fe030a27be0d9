//! Files that are named by numbers.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Files, each with the number that it is named by.
pub(crate) type NumberedFiles = Vec<(u64, PathBuf)>;

/// Returns the files in `folder` whose name is a number and the extension, sorted by number.
pub(crate) fn numbered_files(folder: &Path, extension: &str) -> Result<NumberedFiles> {
    numbered_between(folder, "", &format!(".{extension}"))
}

/// Returns the files in `folder` whose name is a number between `before` and `after`, sorted by number.
pub(crate) fn numbered_between(folder: &Path, before: &str, after: &str) -> Result<NumberedFiles> {
    let failed = |e| Error::io(folder, "read the folder", e);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let number = name
            .strip_prefix(before)
            .and_then(|rest| rest.strip_suffix(after)?.parse::<u64>().ok());
        if let Some(number) = number {
            files.push((number, path));
        }
    }
    files.sort();
    Ok(files)
}
