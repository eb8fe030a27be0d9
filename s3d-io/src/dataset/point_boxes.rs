//! The boxes of the sampled points of each instance: `pointcloud_boxes.json`.

use crate::error::{Error, Result};
use crate::fs::json::{read_json, write_json};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The points of one file of the S3DIS tree, as `pointcloud_boxes.json` lists them.
///
/// Detectors are given these points. `instances.json` has the boxes of the annotated points, from which the
/// labels of the mesh came. The two differ where faces reach beyond the annotated points, or where few points
/// were drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointBox {
    /// The label: "chair_3_office_5_1".
    pub label: String,
    /// The class: "chair".
    pub class: String,
    /// Type and number of the room: "office_5".
    pub room: String,
    /// The number of points, at least 1.
    pub points: u64,
    /// The tightest box of the points as the tree has them, in whole millimetres: `[xmin, ymin, zmin, xmax,
    /// ymax, zmax]`, world metres.
    pub bbox: [f64; 6],
}

impl PointBox {
    /// Returns the least coordinates of the boxes of one room, infinite without boxes. Loaders move a room so
    /// that they become 0.
    pub fn corner<'a>(boxes: impl IntoIterator<Item = &'a Self>) -> [f64; 3] {
        boxes.into_iter().fold([f64::INFINITY; 3], |least, each| {
            let [x, y, z, ..] = each.bbox;
            [least[0].min(x), least[1].min(y), least[2].min(z)]
        })
    }
}

/// Writes the list, in the order of the tree's rooms and labels. Returns the size of the file in bytes.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] for a number that is not finite.
pub fn write_point_boxes(path: &Path, boxes: &[PointBox]) -> Result<u64> {
    write_json(path, boxes)
}

/// Reads a list that [`write_point_boxes`] wrote.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file holds something else, an instance without points, or a box
/// that ends before it begins.
pub fn read_point_boxes(path: &Path) -> Result<Vec<PointBox>> {
    let boxes: Vec<PointBox> = read_json(path)?;
    for PointBox { label, points, bbox: [x0, y0, z0, x1, y1, z1], .. } in &boxes {
        if *points == 0 {
            return Err(Error::format(path, format!("{label} has no points")));
        }
        if x0 > x1 || y0 > y1 || z0 > z1 {
            return Err(Error::format(path, format!("the box of {label} ends before it begins")));
        }
    }
    Ok(boxes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chair() -> PointBox {
        PointBox {
            label: "chair_1_office_2_1".into(),
            class: "chair".into(),
            room: "office_2".into(),
            points: 7,
            bbox: [0.1, -0.2, 0.0, 0.1, 0.3, 0.95],
        }
    }

    #[test]
    fn boxes_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("pointcloud_boxes.json");
        let table = PointBox { bbox: [-1.0, 0.5, 0.2, 1.0, 1.0, 1.0], ..chair() };
        let boxes = [chair(), table];
        write_point_boxes(&path, &boxes).unwrap();
        assert_eq!(read_point_boxes(&path).unwrap(), boxes);
        assert_eq!(PointBox::corner(&boxes), [-1.0, -0.2, 0.0]);
        assert_eq!(PointBox::corner([]), [f64::INFINITY; 3]);
    }

    #[test]
    fn boxes_that_cannot_be_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("pointcloud_boxes.json");
        let turned = PointBox { bbox: [0.2, 0.0, 0.0, 0.1, 1.0, 1.0], ..chair() };
        for (wrong, message) in [
            (PointBox { points: 0, ..chair() }, "chair_1_office_2_1 has no points"),
            (turned, "the box of chair_1_office_2_1 ends before it begins"),
        ] {
            write_point_boxes(&path, &[chair(), wrong]).unwrap();
            let error = read_point_boxes(&path).unwrap_err().to_string();
            assert!(error.contains("pointcloud_boxes.json") && error.contains(message), "{error}");
        }
    }
}
