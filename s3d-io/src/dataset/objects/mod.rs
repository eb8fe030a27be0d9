//! The objects of an image: `area_N/data/objects/*.json`, `area_N/pano/objects/*.json`.

mod rle;

pub use rle::RunLengths;

use crate::error::Result;
use crate::fs::json::read_json;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The objects of an image, as its file holds them: those with a visible pixel, by label index.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectsFile {
    /// The width of the image, pixels.
    pub width: u32,
    /// The height of the image, pixels.
    pub height: u32,
    /// The objects.
    pub objects: Vec<ImageObject>,
}

/// An instance in an image.
///
/// Boxes are `[x, y, width, height]` in pixels, and hold whole pixels. In a panorama a box may go on beyond
/// the right border: then column x stands for column x − width of the image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageObject {
    /// The label: "chair_3_office_5_1".
    pub label: String,
    /// The index of the label in `semantic_labels.json`: the value of the instance's pixels in the semantic
    /// image.
    pub label_index: u32,
    /// The class: "chair".
    pub class: String,
    /// Type and number of the room: "office_5".
    pub room: String,
    /// The number of pixels in which the instance is seen, at least 1. Their mask is in the semantic image.
    pub visible_pixels: u64,
    /// The smallest box of those pixels.
    pub visible_box: [u32; 4],
    /// The number of pixels that the instance would have if it stood alone in this image.
    pub amodal_pixels: u64,
    /// The smallest box of those pixels.
    pub amodal_box: [u32; 4],
    /// The mask of those pixels.
    pub amodal_mask: RunLengths,
    /// The share of the amodal pixels that others hide: 1 − visible / amodal.
    pub occlusion: f64,
    /// What is in front of the instance, by the number of its pixels that it hides, the most first.
    pub hidden_by: Vec<Hider>,
    /// The distance between the camera and the nearest visible pixel, metres.
    pub nearest_m: f32,
    /// The median distance of the visible pixels, metres: the lower one of two.
    pub median_m: f32,
    /// What the border of a view cuts off; `None`, and no key in the file, for a panorama.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beyond: Option<BeyondFrame>,
    /// The amodal box of a panorama by angles; `None`, and no key in the file, for a view.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angles: Option<BoxAngles>,
    /// Where the corners of the instance's boxes in `instances.json` are in this image.
    pub corners: BoxCorners,
}

/// What hides a part of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hider {
    /// The index of its label in `semantic_labels.json`; 0 for surfaces without a label.
    pub label_index: u32,
    /// The number of amodal pixels of the instance that it hides.
    pub pixels: u64,
}

/// What the border of a view cuts off an instance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BeyondFrame {
    /// `[left, top, right, bottom]` of the whole instance in pixels, within the image or not. `None` if it
    /// reaches to the side of the camera or behind it.
    #[serde(rename = "box")]
    pub bounds: Option<[f64; 4]>,
    /// The share of the instance's image that lies outside of the view, of the image within a view's width
    /// and height around the view. It is measured on a grid of at most 65,536 samples.
    pub truncation: f64,
}

/// The box of an instance in a panorama, by angles at the camera, degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoxAngles {
    /// The azimuths of the left and of the right side, counter-clockwise from +X. The right one is the
    /// smaller one; the left one is in (−180, 180].
    pub azimuth_deg: [f64; 2],
    /// The elevations of the lower and of the upper side above the horizon.
    pub elevation_deg: [f64; 2],
}

/// A corner in an image: x and y in pixels, and its depth in metres as in the depth image. `None` if it is
/// behind the camera.
pub type Corner = Option<[f64; 3]>;

/// Where the corners of an instance's boxes are in an image. Corner k of a box is at the upper end of axis 0
/// if bit 0 of k is set, of axis 1 for bit 1, of axis 2 for bit 2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoxCorners {
    /// The box along the axes of the world, `surface.bbox` in `instances.json`.
    pub axis_aligned: [Corner; 8],
    /// The smallest upright box, `surface.upright`.
    pub upright: [Corner; 8],
    /// The smallest box, `surface.oriented`.
    pub oriented: [Corner; 8],
}

impl ObjectsFile {
    /// Returns the file's bytes: JSON, an object a line. Numbers can be read back exactly.
    #[expect(
        clippy::expect_used,
        reason = "only maps with other keys than strings, and own serializers, can fail"
    )]
    pub fn to_json(&self) -> Vec<u8> {
        let mut json =
            format!("{{\"width\":{},\"height\":{},\"objects\":[", self.width, self.height).into_bytes();
        for (place, object) in self.objects.iter().enumerate() {
            json.extend_from_slice(if place == 0 { b"\n" } else { b",\n" });
            serde_json::to_writer(&mut json, object).expect("numbers and strings can be written as JSON");
        }
        json.extend_from_slice(b"\n]}\n");
        json
    }
}

/// Reads the objects of an image.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io); [`Error::Format`](crate::Error::Format) if the file is something else.
pub fn read_objects(path: &Path) -> Result<ObjectsFile> {
    read_json(path)
}
