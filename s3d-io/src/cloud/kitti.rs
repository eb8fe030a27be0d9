//! Annotated points of SemanticKITTI: `NAME.bin` with x, y, z and intensity as `f32`, and `NAME.label` with a
//! `u32` a point, whose lower half is the class and upper half the instance (0: none). Source: "Data format",
//! semantic-kitti.org.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::meaning::{plain_numbers, s3dis_number};
use crate::cloud::table::records::{Field, Kind, Part, Table};
use crate::cloud::table::rows::{Reading, Tag};
use crate::error::{Error, Result};
use crate::fs::source::Source;
use s3d_label::Class;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// The bytes of a point and of its label.
const POINT: usize = 16;
const LABEL: usize = 4;

/// A `.label` file and its `.bin` file.
pub(crate) struct KittiCloud<'a> {
    /// The file that the user named.
    path: PathBuf,
    points: PathBuf,
    labels: PathBuf,
    options: &'a AnnotationOptions,
}

impl<'a> KittiCloud<'a> {
    /// Finds the other file: beside this one, or in the other of the folders `labels` and `velodyne`.
    ///
    /// # Errors
    /// [`Error::Format`], which names both files, if the other is not there; [`Error::Unsupported`] if the
    /// source is no file, so that nothing can be beside it.
    pub(crate) fn open(source: &Source, options: &'a AnnotationOptions) -> Result<Self> {
        let path = source.name();
        if !source.is_file() {
            let message = "is one of two files, .bin and .label: open them by their path";
            return Err(Error::unsupported(path, message));
        }
        let is_label = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("label"));
        let (ending, folder) = if is_label {
            ("bin", "velodyne")
        } else {
            ("label", "labels")
        };

        let beside = path.with_extension(ending);
        let across = path
            .parent()
            .and_then(Path::parent)
            .zip(beside.file_name())
            .map(|(sequence, name)| sequence.join(folder).join(name));
        let other = [Some(&beside), across.as_ref()]
            .into_iter()
            .flatten()
            .find(|other| other.is_file())
            .cloned()
            .ok_or_else(|| {
                let needs = if is_label { "points" } else { "labels" };
                let message = format!(
                    "its {needs} are missing: neither {} is there, nor a file of this name in a folder \
                     {folder} beside its own",
                    beside.display()
                );
                Error::format(path, message)
            })?;

        let path = path.to_owned();
        let [points, labels] = if is_label {
            [other, path.clone()]
        } else {
            [path.clone(), other]
        };
        Ok(Self { path, points, labels, options })
    }

    /// The table of points with their labels.
    fn table(&self) -> Result<Table> {
        let fields = [
            ("x", 0, Kind::F32),
            ("y", 4, Kind::F32),
            ("z", 8, Kind::F32),
            ("intensity", 12, Kind::F32),
            ("class", 16, Kind::U16),
            ("instance", 18, Kind::U16),
        ];
        let fields =
            fields.map(|(name, at, kind)| Field { name: name.to_owned(), at, kind, big_endian: false });
        let mut table =
            Table::new(&self.path, fields.to_vec(), POINT.saturating_add(LABEL), self.options.into())?;
        table.no_instance = Some(0);
        Ok(table)
    }

    fn check_sizes(&self, points_bytes: u64, labels_bytes: u64) -> Result<u64> {
        let points = points_bytes.checked_div(POINT as u64).unwrap_or(0);
        let is_whole = points_bytes.is_multiple_of(POINT as u64);
        if is_whole && points.saturating_mul(LABEL as u64) == labels_bytes {
            return Ok(points);
        }
        let message = format!(
            "holds {points_bytes} bytes of points, {POINT} each, and {} {labels_bytes} bytes of labels, \
             {LABEL} each: their numbers differ, or one is cut short",
            self.labels.display()
        );
        Err(Error::format(&self.points, message))
    }
}

impl Cloud for KittiCloud<'_> {
    fn path(&self) -> &Path {
        &self.path
    }

    fn class_of(&self, tag: &Tag) -> Option<Class> {
        s3dis_number(tag).filter(|_| self.options.classes.is_empty())
    }

    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let table = self.table()?;
        let (points, points_bytes) = Source::file(&self.points).open()?;
        let (labels, labels_bytes) = Source::file(&self.labels).open()?;
        let count = self.check_sizes(points_bytes, labels_bytes)?;
        if self.options.classes.is_empty() {
            let numbers = plain_numbers(&self.options.taxonomy);
            reading
                .notes
                .push(format!("{}: class numbers are taken for {numbers}", self.path.display()));
        }

        let parts = [(&self.points, points, 0, POINT), (&self.labels, labels, POINT, LABEL)];
        let mut parts = parts.map(|(path, file, at, stride)| Part {
            path: path.clone(),
            source: BufReader::with_capacity(1 << 18, file),
            at,
            stride,
        });
        table.read_parts(&self.path, &mut parts, count, colors, reading)
    }
}
