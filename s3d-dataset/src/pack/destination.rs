//! The folder of a package, which appears whole or not at all.

use crate::context::Context;
use crate::error::Result;
use crate::store::new_folder::{FolderKind, NewFolder};
use s3d_io::fs::write_json;
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

/// The file in a package's folder that describes it.
const ABOUT: &str = "pack.json";

const GENERATOR: &str = "s3d pack";

/// The content of `pack.json`. It has no paths and no times, so the same data set gives the same bytes.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct About {
    generator: String,
    version: String,
    /// `webdataset`, `colmap`, …
    pub(crate) package: String,
    pub(crate) areas: Vec<u32>,
    pub(crate) images: usize,
    /// How to use the package, a sentence each.
    pub(crate) notes: Vec<String>,
}

impl About {
    pub(crate) fn new(package: String, areas: &[u32], images: usize, notes: Vec<String>) -> Self {
        Self {
            generator: GENERATOR.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            package,
            areas: areas.to_vec(),
            images,
            notes,
        }
    }
}

const KIND: FolderKind =
    FolderKind { about: ABOUT, generator: GENERATOR, noun: "package", action: "use as the package's folder" };

/// The folder of a package. It appears whole or not at all.
pub(crate) struct Destination(NewFolder);

impl Destination {
    /// Begins the package that will be the folder `place`.
    ///
    /// # Errors
    /// The errors of [`NewFolder::begin`].
    pub(crate) fn begin(ctx: &Context, place: &Path, root: &Path, overwrite: bool) -> Result<Self> {
        NewFolder::begin(ctx, place, root, KIND, overwrite).map(Self)
    }

    /// Begins the package of scenes that will be the folder `place`.
    ///
    /// # Errors
    /// The errors of [`NewFolder::begin_anywhere`].
    pub(crate) fn begin_of_scenes(ctx: &Context, place: &Path, overwrite: bool) -> Result<Self> {
        NewFolder::begin_anywhere(ctx, place, KIND, overwrite).map(Self)
    }

    /// The folder for work that the same call goes on with after a kill.
    pub(crate) fn kept(&self) -> PathBuf {
        self.0.kept()
    }

    /// The folder to write to.
    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    /// The final folder of the package.
    pub(crate) fn place(&self) -> &Path {
        self.0.place()
    }

    /// Writes the package's description.
    pub(crate) fn describe(&self, about: &About) -> Result<()> {
        write_json(&self.path().join(ABOUT), about)?;
        Ok(())
    }

    /// Moves the described package to its place. An earlier package there is replaced.
    pub(crate) fn finish(self) -> Result<()> {
        self.0.finish()
    }
}

/// The relative path from the folder `from` to `target`, with `/`. The path is absolute if none leads there
/// (another drive). Both must be absolute and without links.
pub(crate) fn relative_path(from: &Path, target: &Path) -> String {
    let mut a = from.components().peekable();
    let mut b = target.components().peekable();
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
    use std::fs;

    fn about() -> About {
        About::new("colmap".into(), &[1], 3, Vec::new())
    }

    fn names(dir: &Path) -> Vec<OsString> {
        let mut names: Vec<_> = fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        names
    }

    /// Returns why a package of `dataset` cannot be written to `place`.
    fn refusal(place: &Path, dataset: &Path) -> String {
        let begun = Destination::begin(&Context::default(), place, dataset, true);
        begun.err().unwrap().to_string()
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
            begun.describe(&about())?;
            begun.finish()
        };
        fs::create_dir(&place).unwrap();
        write("first", false).unwrap();
        assert_eq!(names(&place), ["file", ABOUT]);
        let e = write("second", false).unwrap_err().to_string();
        assert!(e.contains("`overwrite`"), "{e}");
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
        assert!(refusal(&place, &root).contains("holds chapter_1.tex, and was not written by s3d pack"));
        assert!(refusal(&place.join("chapter_1.tex"), &root).contains("cannot use as the package's folder"));
        fs::create_dir(&root).unwrap();
        for apart in [&root, &root.join("a/b"), dir.path(), &root.join("../data/x")] {
            assert!(refusal(apart, &root).contains("in one another"), "{}", apart.display());
        }
    }

    #[test]
    fn relative_paths_lead_there() {
        for (from, to, expected) in
            [("/a/b/c", "/a/x/y.png", "../../x/y.png"), ("/a/b", "/a/b/c", "c"), ("/a", "/b", "../b")]
        {
            assert_eq!(relative_path(Path::new(from), Path::new(to)), expected);
        }
    }
}
