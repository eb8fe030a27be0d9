//! Writes a table of the objects of images as one Parquet file.

use super::columns::{Column, Named, text};
use super::table::TableWriter;
use crate::dataset::{BoxAngles, Corner, ImageObject};
use crate::error::Result;
use crate::fs::atomic::AtomicFile;
use std::path::Path;

/// An object of an image, which is a row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectRow {
    /// The number of its area.
    pub area: u32,
    /// The UUID of the scan location of the image.
    pub camera_uuid: String,
    /// The room that the image was taken in, such as "office_3".
    pub room: String,
    /// The number of a view; `None` for a panorama.
    pub frame_num: Option<u32>,
    /// The path of the image's file of objects below the root of the data set.
    pub file: String,
    /// The object.
    pub object: ImageObject,
}

/// A Parquet file that is being written: a row for each object of an image.
///
/// The columns are `area`, `camera_uuid`, `room`, `kind` ("view" or "panorama"), `frame_num` (null for
/// panoramas) and `objects` (the path of the file) of the image, and of the object those of [`ImageObject`]:
/// `label`, `label_index`, `class`, `object_room`, `visible_pixels`, `visible_box`, `amodal_pixels`,
/// `amodal_box`, `amodal_mask` (COCO's compressed run lengths, for the height and the width in `size`),
/// `occlusion`, `hidden_by` (label indices) with `hidden_pixels`, `nearest_m`, `median_m`, `beyond_box`,
/// `truncation`, `azimuth_deg`, `elevation_deg`, and `corners_axis_aligned`, `corners_upright`,
/// `corners_oriented`: x, y and depth of eight corners, NaN for a corner behind the camera. What an object
/// does not have is null.
pub struct ObjectTable {
    table: TableWriter<AtomicFile>,
}

impl ObjectTable {
    /// Begins a file.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn create(path: &Path) -> Result<Self> {
        let about = [("description", "A row an object of an image. Pixels, metres, degrees.".to_owned())];
        let table = TableWriter::begin(AtomicFile::create(path)?, path, &columns(&[]), &about)?;
        Ok(Self { table })
    }

    /// Writes some rows as a row group, which readers read as a whole: some ten thousand are good.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn push(&mut self, rows: &[ObjectRow]) -> Result<()> {
        self.table.group(columns(rows))
    }

    /// Completes the file. Returns its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn finish(self) -> Result<u64> {
        self.table.finish()?.commit()
    }
}

fn columns(rows: &[ObjectRow]) -> Vec<Named> {
    let mut all = Vec::new();
    macro_rules! column {
        ($name:expr, $required:expr, $kind:ident, $value:expr) => {
            all.push(Named {
                name: $name.to_owned(),
                required: $required,
                values: Column::$kind(rows.iter().map($value).collect()),
            })
        };
    }
    // Lists of the writer may be null.
    let list = |values: &[u32]| values.iter().copied().map(f64::from).collect::<Vec<_>>();

    column!("area", true, Int, |r| Some(r.area as i32));
    column!("camera_uuid", true, Text, |r| Some(text(&r.camera_uuid)));
    column!("room", true, Text, |r| Some(text(&r.room)));
    column!("kind", true, Text, |r| { Some(text(if r.frame_num.is_some() { "view" } else { "panorama" })) });
    column!("frame_num", false, Int, |r| r.frame_num.map(|number| number as i32));
    column!("objects", true, Text, |r| Some(text(&r.file)));

    column!("label", true, Text, |r| Some(text(&r.object.label)));
    column!("label_index", true, Int, |r| Some(r.object.label_index as i32));
    column!("class", true, Text, |r| Some(text(&r.object.class)));
    column!("object_room", true, Text, |r| Some(text(&r.object.room)));
    column!("visible_pixels", true, Int, |r| Some(r.object.visible_pixels as i32));
    column!("visible_box", false, List, |r| Some(list(&r.object.visible_box)));
    column!("amodal_pixels", true, Int, |r| Some(r.object.amodal_pixels as i32));
    column!("amodal_box", false, List, |r| Some(list(&r.object.amodal_box)));
    column!("amodal_mask", true, Text, |r| Some(text(&r.object.amodal_mask.counts)));
    column!("size", false, List, |r| Some(list(&r.object.amodal_mask.size)));
    column!("occlusion", true, Float, |r| Some(r.object.occlusion));
    column!("hidden_by", false, List, |r| {
        Some(r.object.hidden_by.iter().map(|of| f64::from(of.label_index)).collect())
    });
    column!("hidden_pixels", false, List, |r| {
        Some(r.object.hidden_by.iter().map(|of| of.pixels as f64).collect())
    });
    column!("nearest_m", true, Float, |r| Some(f64::from(r.object.nearest_m)));
    column!("median_m", true, Float, |r| Some(f64::from(r.object.median_m)));

    column!("beyond_box", false, List, |r| r.object.beyond?.bounds.map(|bounds| bounds.to_vec()));
    column!("truncation", false, Float, |r| r.object.beyond.map(|beyond| beyond.truncation));
    let angles = |of: fn(BoxAngles) -> [f64; 2]| {
        move |r: &ObjectRow| r.object.angles.map(|angles| of(angles).to_vec())
    };
    column!("azimuth_deg", false, List, angles(|angles| angles.azimuth_deg));
    column!("elevation_deg", false, List, angles(|angles| angles.elevation_deg));

    let numbers = |corners: &[Corner; 8]| {
        let corners = corners.iter().map(|corner| corner.unwrap_or([f64::NAN; 3]));
        Some(corners.flatten().collect::<Vec<f64>>())
    };
    column!("corners_axis_aligned", false, List, |r| numbers(&r.object.corners.axis_aligned));
    column!("corners_upright", false, List, |r| numbers(&r.object.corners.upright));
    column!("corners_oriented", false, List, |r| numbers(&r.object.corners.oriented));
    all
}
