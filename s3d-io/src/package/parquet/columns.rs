//! The columns of a table of images.

use super::ImageRow;
use parquet::data_type::ByteArray;
use s3d_label::Class;

/// A column of some rows.
pub(crate) struct Named {
    pub(crate) name: String,
    /// Whether it is never null.
    pub(crate) required: bool,
    pub(crate) values: Column,
}

/// The values of a column for some rows.
pub(crate) enum Column {
    Int(Vec<Option<i32>>),
    Float(Vec<Option<f64>>),
    Text(Vec<Option<ByteArray>>),
    List(Vec<Option<Vec<f64>>>),
    /// The files of images, and the name of each.
    #[cfg_attr(not(feature = "huggingface"), expect(dead_code, reason = "tables of paths have none"))]
    Image(Vec<Option<[ByteArray; 2]>>),
}

/// Returns the columns of some rows, with the columns `modalities` where the modalities belong.
pub(crate) fn columns(
    classes: &[Class],
    rows: &[&ImageRow],
    with_photographs: bool,
    modalities: Vec<Named>,
) -> Vec<Named> {
    let mut all = Vec::new();
    macro_rules! column {
        ($name:expr, $required:expr, $kind:ident, $value:expr) => {
            all.push(Named {
                name: $name,
                required: $required,
                values: Column::$kind(rows.iter().map($value).collect()),
            })
        };
    }

    column!("area".to_owned(), true, Int, |r| Some(int(r.area)));
    column!("camera_uuid".to_owned(), true, Text, |r| Some(text(&r.camera_uuid)));
    column!("room".to_owned(), true, Text, |r| Some(text(&r.room)));
    column!("room_type".to_owned(), true, Text, |r| Some(text(&r.room_type)));
    column!("room_number".to_owned(), true, Int, |r| Some(int(r.room_number)));
    column!("kind".to_owned(), true, Text, |r| {
        Some(text(if r.frame_num.is_some() { "view" } else { "panorama" }))
    });
    column!("frame_num".to_owned(), false, Int, |r| r.frame_num.map(int));

    all.extend(modalities);
    for (i, name) in ["width", "height"].into_iter().enumerate() {
        column!(name.to_owned(), false, Int, |r| r.size.map(|s| int(s[i])));
    }

    column!("fov_rad".to_owned(), false, Float, |r| r.fov_rad);
    for (i, name) in ["yaw_rad", "pitch_rad"].into_iter().enumerate() {
        column!(name.to_owned(), false, Float, |r| r.yaw_pitch_rad.map(|v| v[i]));
    }
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        column!(name.to_owned(), false, Float, |r| r.location.map(|v| v[i]));
    }
    column!("k".to_owned(), false, List, |r| r.k.map(|m| m.to_vec()));
    column!("rt".to_owned(), false, List, |r| r.rt.map(|m| m.to_vec()));
    column!("selection_entropy".to_owned(), false, Float, |r| r.selection_entropy);
    column!("entropy".to_owned(), false, Float, |r| r.semantic.as_ref().map(|s| s.entropy));
    column!("coverage".to_owned(), false, Float, |r| r.coverage);

    for class in classes {
        column!(format!("share_{class}"), false, Float, |r| {
            r.semantic.as_ref().and_then(|s| s.shares.get(class.index()).copied())
        });
    }
    column!("share_unlabelled".to_owned(), false, Float, |r| r.semantic.as_ref().map(|s| s.unlabelled));
    column!("instances".to_owned(), false, Int, |r| r.semantic.as_ref().map(|s| int(s.instances)));
    for (i, name) in ["depth_min_m", "depth_mean_m", "depth_max_m"].into_iter().enumerate() {
        column!(name.to_owned(), false, Float, |r| r.depth_m.map(|v| v[i]));
    }
    if with_photographs {
        column!("photograph".to_owned(), false, Text, |r| r.photograph.as_deref().map(text));
    }
    all
}

pub(crate) fn text(text: &str) -> ByteArray {
    ByteArray::from(text.as_bytes().to_vec())
}

fn int(value: u32) -> i32 {
    value as i32
}
