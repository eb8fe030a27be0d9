//! Where the images are that a mesh names.

use std::path::{Path, PathBuf};

/// `name` as a path below `folder`, with either slash.
pub(crate) fn resolve(folder: &Path, name: &str) -> PathBuf {
    let as_written = folder.join(name);
    if as_written.is_file() {
        as_written
    } else {
        folder.join(name.replace('\\', "/"))
    }
}

/// Where the image `name` is: below the library's folder, below the OBJ file's, or, as other machines' paths
/// are worth nothing here, by its last part beside either. `true` if it is where `name` says.
pub(crate) fn find_image(name: &str, library: &Path, folder: &Path) -> Option<(PathBuf, bool)> {
    let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
    [(name, library, true), (name, folder, true), (last, library, false), (last, folder, false)]
        .into_iter()
        .map(|(name, folder, exact)| (resolve(folder, name), exact))
        .find(|(path, _)| path.is_file())
}
