//! What every format's reader of a table of points is.

use crate::cloud::table::rows::{Reading, Tag};
use crate::error::Result;
use s3d_label::{Class, Room, Taxonomy};
use std::path::Path;

/// What a format's colours are taken for. Where a format leaves it open, the narrow range is tried first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ColorRange {
    /// 16-bit numbers up to 255, or floats from 0 to 1.
    #[default]
    Narrow,
    /// 16-bit numbers up to 65,535, or floats from 0 to 255.
    Wide,
}

/// A file of rows that can be read several times.
pub(crate) trait Cloud {
    fn path(&self) -> &Path;

    /// The room that the file itself names, by its own name for instance.
    fn room(&self, taxonomy: &Taxonomy) -> Option<Room> {
        room_of_name(self.path(), taxonomy)
    }

    /// The class of S3DIS that a tag means in this kind of file, where the user says nothing.
    fn class_of(&self, _tag: &Tag) -> Option<Class> {
        None
    }

    /// Whether its points are the vertices of a mesh; known once it is read.
    fn are_vertices(&self) -> bool {
        false
    }

    /// Reads all rows. `false`: colours go beyond the narrow range, and the rows must be read again with the
    /// wide one.
    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool>;
}

/// The room that a file is named after: `office_3.ply`, `Area_1_office_3.npy`.
fn room_of_name(path: &Path, taxonomy: &Taxonomy) -> Option<Room> {
    let stem = path.file_stem()?.to_str()?;
    let name = match stem.strip_prefix("Area_").and_then(|rest| rest.split_once('_')) {
        Some((area, name)) if area.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => stem,
    };
    taxonomy.room(name).ok()
}
