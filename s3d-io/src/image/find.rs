//! Finds the images and libraries that a mesh names.
//!
//! A name is often the path of another machine: `C:\scans\Textures\Wall.JPG`, `/textures/wall.jpg`. So every
//! end of it is tried, from the longest to the last part alone, as it is written and then in any case.

use std::path::{Path, PathBuf};

/// Returns `name` as a path below `folder`, or else the file that it is likely to mean. Returns the plain
/// path if there is no such file.
pub(crate) fn resolve(folder: &Path, name: &str) -> PathBuf {
    find_image(name, folder, folder).map_or_else(|| folder.join(name), |(path, _)| path)
}

/// Finds the image `name`: below the folder of the library, or below the folder of the mesh. If it is in
/// neither, the ends of its path are searched in both. Also returns whether the image is where `name` says:
/// backslashes, and capitals on a disk that has others, make no difference.
pub(crate) fn find_image(name: &str, library: &Path, folder: &Path) -> Option<(PathBuf, bool)> {
    for folder in [library, folder] {
        let as_written = folder.join(name);
        if as_written.is_file() {
            return Some((as_written, true));
        }
    }

    let parts: Vec<&str> = name
        .split(['/', '\\'])
        .filter(|part| !part.is_empty() && *part != ".")
        .collect();
    for first in 0..parts.len() {
        let end = parts.get(first..)?;
        // A drive is no folder.
        if end.first().is_some_and(|part| part.ends_with(':')) {
            continue;
        }
        for folder in [library, folder] {
            let path: PathBuf = end.iter().fold(folder.to_owned(), |path, part| path.join(part));
            let found = if path.is_file() {
                Some(path)
            } else {
                in_any_case(folder, end)
            };
            if let Some(found) = found {
                return Some((found, first == 0));
            }
        }
    }
    None
}

/// Finds a file below a folder by the parts of its path, in capitals or not.
fn in_any_case(folder: &Path, parts: &[&str]) -> Option<PathBuf> {
    let mut at = folder.to_owned();
    for part in parts {
        let exact = at.join(part);
        at = if *part == ".." || exact.exists() {
            exact
        } else {
            let wanted = part.to_lowercase();
            let mut alike: Vec<PathBuf> =
                std::fs::read_dir(if at.as_os_str().is_empty() { Path::new(".") } else { &at })
                    .ok()?
                    .filter_map(|entry| Some(entry.ok()?.file_name()))
                    .filter(|name| name.to_string_lossy().to_lowercase() == wanted)
                    .map(|name| at.join(name))
                    .collect();
            // Of several files whose names differ by case alone, the first by name is taken.
            alike.sort();
            alike.into_iter().next()?
        };
    }
    at.is_file().then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn every_end_of_a_path_is_tried_in_any_case() {
        let dir = tempfile::tempdir().unwrap();
        let at = |path: &str| dir.path().join(path);
        fs::create_dir_all(at("textures/walls")).unwrap();
        fs::create_dir_all(at("lib")).unwrap();
        for file in ["textures/a.png", "textures/walls/b.JPG.png", "lib/c.png", "a.png"] {
            fs::write(at(file), "").unwrap();
        }
        let found = |name: &str| find_image(name, &at("lib"), dir.path());
        for (name, file, is_there) in [
            ("a.png", "a.png", true),
            ("c.png", "lib/c.png", true),
            ("textures/a.png", "textures/a.png", true),
            (r"textures\A.PNG", "textures/a.png", true),
            (r".\Textures\Walls\B.jpg.PNG", "textures/walls/b.JPG.png", true),
            ("/textures/a.png", "textures/a.png", true),
            (r"C:\scans\Textures\walls\b.JPG.png", "textures/walls/b.JPG.png", false),
            ("/data/scans/a.png", "a.png", false),
            ("../elsewhere/c.png", "lib/c.png", false),
        ] {
            assert_eq!(found(name), Some((at(file), is_there)), "{name}");
        }
        for name in ["d.png", "textures", "", "C:"] {
            assert_eq!(found(name), None, "{name}");
        }
        assert_eq!(resolve(dir.path(), "gone.mtl"), at("gone.mtl"));
    }
}
