//! Finds the images that a mesh names.

use std::path::{Path, PathBuf};

/// Returns `name` as a path below `folder`. Backslashes count as slashes if there is no such file.
pub(crate) fn resolve(folder: &Path, name: &str) -> PathBuf {
    let as_written = folder.join(name);
    if as_written.is_file() {
        as_written
    } else {
        folder.join(name.replace('\\', "/"))
    }
}

/// Finds the image `name`: below the folder of the library, or below the folder of the mesh. If it is in
/// neither, the last part of the name is searched in both, since paths of other machines mean nothing here.
/// Also returns whether the image is where `name` says.
pub(crate) fn find_image(name: &str, library: &Path, folder: &Path) -> Option<(PathBuf, bool)> {
    let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
    [(name, library, true), (name, folder, true), (last, library, false), (last, folder, false)]
        .into_iter()
        .map(|(name, folder, exact)| (resolve(folder, name), exact))
        .find(|(path, _)| path.is_file())
}
