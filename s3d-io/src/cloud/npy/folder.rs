//! Annotated points in Pointcept's folders: an NPY array a column. Source: Pointcept's
//! `pointcept/datasets/defaults.py`, and its preprocessing of S3DIS and ScanNet.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::npy::header::NpyHeader;
use crate::cloud::npy::read::read_columns;
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::rows::{Reading, Tag};
use crate::error::{Error, Result};
use crate::fs::open::open_file;
use s3d_label::Class;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// The most arrays of a folder.
const MOST_ARRAYS: usize = 64;
/// The array of coordinates.
const COORDINATES: &str = "coord";

/// A folder with `coord.npy` and other arrays beside it.
pub(crate) struct NpyFolder<'a> {
    dir: PathBuf,
    /// Whether it says what the class numbers are taken for.
    says_numbers: bool,
    options: &'a AnnotationOptions,
}

impl<'a> NpyFolder<'a> {
    pub(crate) fn new(dir: PathBuf, says_numbers: bool, options: &'a AnnotationOptions) -> Self {
        Self { dir, says_numbers, options }
    }

    /// The arrays, by name.
    fn files(&self) -> Result<Vec<PathBuf>> {
        let io = |e| Error::io(&self.dir, "read", e);
        let mut files = Vec::new();
        for entry in std::fs::read_dir(&self.dir).map_err(io)? {
            let path = entry.map_err(io)?.path();
            if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy")) && path.is_file() {
                files.push(path);
            }
        }
        if files.len() > MOST_ARRAYS {
            let message = format!("holds {} arrays: points are in 1 to {MOST_ARRAYS} of them", files.len());
            return Err(Error::format(&self.dir, message));
        }
        files.sort();
        Ok(files)
    }

    /// Checks that the arrays of points have a row for each of them.
    fn check_rows<R>(&self, arrays: &[(String, NpyHeader, R)]) -> Result<()> {
        let of_points =
            |stem: &str| [COORDINATES, "color", "instance"].contains(&stem) || stem.starts_with("segment");
        let points = arrays
            .iter()
            .find(|(stem, ..)| stem == COORDINATES)
            .map(|(_, h, _)| h.rows);
        let other = arrays
            .iter()
            .find(|(stem, header, _)| of_points(stem) && Some(header.rows) != points);
        match (points, other) {
            (Some(points), Some((stem, header, _))) => {
                let message = format!(
                    "{stem}.npy has {} rows, and {COORDINATES}.npy {points}: they are of two clouds",
                    header.rows
                );
                Err(Error::format(&self.dir, message))
            }
            _ => Ok(()),
        }
    }

    /// Whether an array has the labels of another taxonomy of ScanNet than the scene's.
    fn is_of_others(&self, stem: &str) -> bool {
        stem == "segment20" && self.options.taxonomy.name() == "scannet200"
    }
}

impl Cloud for NpyFolder<'_> {
    fn path(&self) -> &Path {
        &self.dir
    }

    /// The numbers are places in the list of the data set's classes; -1 is no label.
    fn own_meaning(&self, tag: &Tag) -> Option<Option<Class>> {
        match tag {
            Tag::Number(-1) => Some(None),
            Tag::Number(n) if self.options.classes.is_empty() => {
                let classes = self.options.taxonomy.classes();
                usize::try_from(*n)
                    .ok()
                    .and_then(|n| classes.get(n))
                    .map(|class| Some(*class))
            }
            _ => None,
        }
    }

    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let mut arrays = Vec::new();
        for path in self.files()? {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let mut file = BufReader::with_capacity(1 << 18, open_file(&path)?);
            match NpyHeader::read(&path, &mut file) {
                Ok(_) if self.is_of_others(&stem) => {}
                Ok(header) => arrays.push((stem, header, file)),
                // Beside the arrays of points there may be arrays of any kind.
                Err(Error::Unsupported { .. }) if stem != COORDINATES => {}
                Err(e) => return Err(e),
            }
        }
        self.check_rows(&arrays)?;

        if self.says_numbers && self.options.classes.is_empty() {
            let taxonomy = self.options.taxonomy.name();
            reading.notes.push(format!(
                "{}: class numbers are taken for places in the list of {taxonomy}'s classes, from 0",
                self.dir.display()
            ));
        }
        read_columns(&self.dir, arrays, self.options.into(), colors, reading)
    }
}
