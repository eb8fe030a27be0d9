//! Where a package goes: whole, or not at all.

use crate::error::{Error, Result};
use s3d_io::Error as FileError;
use s3d_io::fs::{create_dir, read_json, write_json};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};
use tempfile::TempDir;

/// The file in a package's folder that says what it is.
const ABOUT: &str = "pack.json";

const GENERATOR: &str = "s3d pack";

/// What `pack.json` says. No paths and no times: the same data set gives the same bytes.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct About {
    generator: String,
    version: String,
    /// `webdataset`, `colmap`, …
    pub(crate) package: String,
    pub(crate) areas: Vec<u32>,
    pub(crate) images: usize,
    /// How to use it, a sentence each.
    pub(crate) notes: Vec<String>,
}

impl About {
    pub(crate) fn new(package: String, areas: &[u32], images: usize, notes: Vec<String>) -> Self {
        let (generator, version) = (GENERATOR.to_owned(), env!("CARGO_PKG_VERSION").to_owned());
        Self { generator, version, package, areas: areas.to_vec(), images, notes }
    }
}

/// A folder that is made beside its place and moved there when it is complete. Dropped before, it leaves
/// nothing behind.
pub(crate) struct Destination {
    place: PathBuf,
    begun: TempDir,
}

impl Destination {
    /// Begins the package that will be the folder `place`.
    ///
    /// # Errors
    /// [`Error::Usage`] if it lies in the data set `root` or holds it, or if there is something in it that is
    /// not to be, or may not be, replaced.
    pub(crate) fn begin(place: &Path, root: &Path, overwrite: bool) -> Result<Self> {
        check_apart(place, root)?;
        check_free(place, overwrite)?;
        let parent = parent_of(place);
        create_dir(&parent)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(".s3d-pack-").suffix(".part");
        // Temporary folders are made for their owner alone; this one becomes an ordinary one.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o777));
        }
        let begun = builder.tempdir_in(&parent).map_err(|e| FileError::io(place, "create the folder", e))?;
        Ok(Self { place: place.to_owned(), begun })
    }

    /// The folder to write to.
    pub(crate) fn path(&self) -> &Path {
        self.begun.path()
    }

    /// The folder that it will be.
    pub(crate) fn place(&self) -> &Path {
        &self.place
    }

    /// Moves the package to its place, instead of an earlier one.
    pub(crate) fn finish(self, about: &About) -> Result<()> {
        write_json(&self.begun.path().join(ABOUT), about)?;
        let place = &self.place;
        let failed = |e| FileError::io(place, "move the finished package to this name", e);
        // An earlier package goes aside by one rename; an empty folder goes.
        let aside = if is_package(place) {
            let aside = self.begun.path().with_extension("old");
            fs::rename(place, &aside).map_err(failed)?;
            Some(aside)
        } else {
            match fs::remove_dir(place) {
                Err(e) if e.kind() != ErrorKind::NotFound => return Err(failed(e).into()),
                _ => None,
            }
        };
        if let Err(e) = fs::rename(self.begun.path(), place) {
            if let Some(aside) = aside {
                fs::rename(aside, place).map_err(failed)?;
            }
            return Err(failed(e).into());
        }
        // It is not there any more under its first name.
        let _ = self.begun.keep();
        aside.map_or(Ok(()), |a| fs::remove_dir_all(&a).map_err(|e| FileError::io(&a, "remove", e).into()))
    }
}

/// Refuses a place in the data set, or one that holds it.
pub(crate) fn check_apart(place: &Path, root: &Path) -> Result<()> {
    let (Ok(place_at), Ok(root_at)) = (resolved(place), resolved(root)) else { return Ok(()) };
    if place_at.starts_with(&root_at) || root_at.starts_with(&place_at) {
        return Err(Error::Usage(format!(
            "{} and the data set {} would lie in one another: choose another folder with -o",
            place.display(),
            root.display()
        )));
    }
    Ok(())
}

fn check_free(place: &Path, overwrite: bool) -> Result<()> {
    let mut entries = match fs::read_dir(place) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(FileError::io(place, "use as the package's folder", e).into()),
        Ok(entries) => entries,
    };
    let Some(first) = entries.next() else { return Ok(()) };
    let first = first.map_err(|e| FileError::io(place, "read", e))?.file_name();
    let what = format!("{} already holds {}", place.display(), first.display());
    match (is_package(place), overwrite) {
        (true, true) => Ok(()),
        (true, false) => Err(Error::Usage(format!(
            "{what}: choose another folder, or replace the package in it with --overwrite"
        ))),
        (false, _) => {
            Err(Error::Usage(format!("{what}, and was not written by s3d pack: choose another folder")))
        }
    }
}

fn is_package(folder: &Path) -> bool {
    read_json::<About>(&folder.join(ABOUT)).is_ok_and(|about| about.generator == GENERATOR)
}

/// The folder that a path lies in.
pub(crate) fn parent_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// An absolute path without links, also if its end is not there yet.
pub(crate) fn resolved(path: &Path) -> std::io::Result<PathBuf> {
    match fs::canonicalize(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => {
            let absolute = std::path::absolute(path)?;
            match (absolute.parent(), absolute.file_name()) {
                (Some(parent), Some(name)) => Ok(resolved(parent)?.join(name)),
                _ => Err(e),
            }
        }
        other => other,
    }
}

/// The path by which `target` is found from the folder `from`, with `/`; absolute where there is none
/// (another drive). Both are absolute and without links.
pub(crate) fn relative_path(from: &Path, target: &Path) -> String {
    let (mut a, mut b) = (from.components().peekable(), target.components().peekable());
    let mut common = 0;
    while let (Some(x), Some(y)) = (a.peek(), b.peek()) {
        if x != y {
            break;
        }
        common += 1;
        a.next();
        b.next();
    }
    if common == 0 {
        return target.to_string_lossy().into_owned();
    }
    let up = a.map(|_| OsString::from(".."));
    let down = b.map(|c: Component<'_>| c.as_os_str().to_owned());
    let parts: Vec<String> = up.chain(down).map(|p| p.to_string_lossy().into_owned()).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about() -> About {
        About::new("colmap".into(), &[1], 3, Vec::new())
    }

    fn names(dir: &Path) -> Vec<OsString> {
        let mut names: Vec<_> = fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_package_is_there_whole_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let (root, place) = (dir.path().join("data"), dir.path().join("new/package"));
        fs::create_dir(&root).unwrap();
        let begun = Destination::begin(&place, &root, false).unwrap();
        fs::write(begun.path().join("half"), "").unwrap();
        drop(begun);
        assert!(names(&dir.path().join("new")).is_empty());

        let write = |text: &str, overwrite| {
            let begun = Destination::begin(&place, &root, overwrite)?;
            fs::write(begun.path().join("file"), text).unwrap();
            begun.finish(&about())
        };
        fs::create_dir(&place).unwrap();
        write("first", false).unwrap();
        assert_eq!(names(&place), ["file", ABOUT]);
        let e = write("second", false).unwrap_err().to_string();
        assert!(e.contains("--overwrite"), "{e}");
        assert_eq!(fs::read_to_string(place.join("file")).unwrap(), "first");
        write("third", true).unwrap();
        assert_eq!(fs::read_to_string(place.join("file")).unwrap(), "third");
        assert_eq!(names(&dir.path().join("new")), ["package"]);
    }

    #[test]
    fn what_is_not_ours_is_never_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let (root, place) = (dir.path().join("data"), dir.path().join("thesis"));
        fs::create_dir_all(&place).unwrap();
        fs::write(place.join("chapter_1.tex"), "").unwrap();
        let fails = |place: &Path| Destination::begin(place, &root, true).err().unwrap().to_string();
        assert!(fails(&place).contains("holds chapter_1.tex, and was not written by s3d pack"));
        assert!(fails(&place.join("chapter_1.tex")).contains("cannot use as the package's folder"));
        fs::create_dir(&root).unwrap();
        for apart in [&root, &root.join("a/b"), dir.path(), &root.join("../data/x")] {
            assert!(fails(apart).contains("in one another"), "{}", apart.display());
        }
    }

    #[test]
    fn relative_paths_lead_there() {
        let path = |from: &str, to: &str| relative_path(Path::new(from), Path::new(to));
        assert_eq!(path("/a/b/c", "/a/x/y.png"), "../../x/y.png");
        assert_eq!(path("/a/b", "/a/b/c"), "c");
        assert_eq!(path("/a", "/b"), "../b");
    }
}
