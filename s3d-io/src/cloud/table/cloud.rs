//! The interface of every format's reader of a table of points.

use crate::cloud::table::rows::{Reading, Tag};
use crate::error::Result;
use s3d_label::{Class, Room, Taxonomy};
use std::path::{Path, PathBuf};

/// How a format's colours are scaled. If the format leaves it open, the narrowest range is tried first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ColorRange {
    /// 16-bit numbers up to 255, or floats from 0 to 1.
    #[default]
    Narrow,
    /// 16-bit numbers up to 65,535, or floats from 0 to 255.
    Wide,
    /// 16-bit numbers that are written as floats.
    Widest,
}

impl ColorRange {
    /// Returns the range to try after this one.
    pub(crate) fn wider(self) -> Self {
        match self {
            Self::Narrow => Self::Wide,
            Self::Wide | Self::Widest => Self::Widest,
        }
    }
}

/// A file of rows that can be read several times.
pub(crate) trait Cloud {
    fn path(&self) -> &Path;

    /// The room that the file itself states, for instance by its own name.
    fn room(&self, taxonomy: &Taxonomy) -> Option<Room> {
        room_of_name(self.path(), taxonomy)
    }

    /// The S3DIS class that this kind of file gives a tag, if the user gives it none.
    fn class_of(&self, _tag: &Tag) -> Option<Class> {
        None
    }

    /// What this kind of file means by a tag, whatever the taxonomy says: a class, or unlabelled points. The
    /// user's table comes first.
    fn own_meaning(&self, _tag: &Tag) -> Option<Option<Class>> {
        None
    }

    /// Whether its points are the vertices of a mesh. This is known once the file is read.
    fn are_vertices(&self) -> bool {
        false
    }

    /// The files that it reads beside its own.
    fn companions(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// Reads all rows. Returns `false` if a colour is beyond the narrow range; the rows must then be read
    /// again with the wide one.
    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool>;
}

/// The room that a file or a folder is named after: `office_3.ply`, `Area_1_office_3.npy`,
/// `Area_1-office_3`.
fn room_of_name(path: &Path, taxonomy: &Taxonomy) -> Option<Room> {
    let stem = path.file_stem()?.to_str()?;
    let name = match stem.strip_prefix("Area_").and_then(|rest| rest.split_once(['_', '-'])) {
        Some((area, name)) if area.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => stem,
    };
    taxonomy.room(name).ok()
}
