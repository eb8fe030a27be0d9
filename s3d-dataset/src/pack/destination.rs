//! Where a package goes: whole, or not at all.

use crate::context::Context;
use crate::error::{Error, Result};
use crate::store::parent_of;
use crate::store::staging::Staging;
use s3d_io::Error as FileError;
use s3d_io::fs::{create_dir, read_json, write_json};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

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
    staging: Staging,
}

impl Destination {
    /// Begins the package that will be the folder `place`.
    ///
    /// # Errors
    /// [`Error::Usage`] if it lies in the data set `root` or holds it, or if there is something in it that is
    /// not to be, or may not be, replaced; as [`Staging::begin`].
    pub(crate) fn begin(ctx: &Context, place: &Path, root: &Path, overwrite: bool) -> Result<Self> {
        check_apart(place, root)?;
        let (parent, name) = (parent_of(place), Path::new(place.file_name().unwrap_or_default()));
        // What a killed process left may be about to come back.
        if !Staging::is_left(&parent, name) {
            check_free(place, overwrite)?;
        }
        create_dir(&parent)?;
        let staging = Staging::begin(ctx, &parent, name)?;
        check_free(place, overwrite || staging.was_placing())?;
        Ok(Self { place: place.to_owned(), staging })
    }

    /// The folder to write to.
    pub(crate) fn path(&self) -> &Path {
        self.staging.path()
    }

    /// The folder that it will be.
    pub(crate) fn place(&self) -> &Path {
        &self.place
    }

    /// Moves the package to its place, instead of an earlier one.
    pub(crate) fn finish(self, about: &About) -> Result<()> {
        write_json(&self.path().join(ABOUT), about)?;
        self.staging.place_folder(&self.place, is_package(&self.place))
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
        let begun = Destination::begin(&Context::default(), &place, &root, false).unwrap();
        fs::write(begun.path().join("half"), "").unwrap();
        drop(begun);
        assert!(names(&dir.path().join("new")).is_empty());

        let write = |text: &str, overwrite| {
            let begun = Destination::begin(&Context::default(), &place, &root, overwrite)?;
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
        let fails = |place: &Path| {
            Destination::begin(&Context::default(), place, &root, true).err().unwrap().to_string()
        };
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
