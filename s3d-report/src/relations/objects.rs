//! The objects of a view: how much of each is seen, what hides it, and its outline.

use super::outline::{Kind, Part, outline};
use crate::index::rounded;
use s3d_geom::Raster;
use s3d_io::dataset::{ImageObject, ObjectsFile};
use serde::Serialize;

/// An outline of a wider image is simplified more: the page does not show it any larger.
const WIDTH_SHOWN: f64 = 1024.0;

/// What removes the stairs of slanted lines, in pixels: the corners of pixels are up to one pixel off such
/// a line.
const STAIRS: f64 = 1.01;

/// An object of a view.
#[derive(Serialize)]
pub(crate) struct ObjectEntry {
    /// The index of its label.
    label: u32,
    /// The number of its visible pixels.
    seen: u64,
    /// The number of pixels that it would have without others.
    alone: u64,
    /// The share of them that others hide.
    hidden: f64,
    /// The share of the whole object that the frame cuts off.
    cut: Option<f64>,
    /// Labels of what is in front of it, 0 for a surface without a label, and the pixels that each hides.
    by: Vec<(u32, u64)>,
    nearest_m: f64,
    /// Rings of parts. A part has its kind (0 seen, 1 hidden, 2 cut off), and x and y of its corners.
    outline: Vec<Vec<Vec<u32>>>,
}

/// Returns the objects in the file of a view with this width and height, the one with the most visible pixels
/// first. `labels` is the number of labels, and `label` the view's image of labels, if it could be read.
///
/// # Errors
/// A sentence, if the file does not fit the view.
pub(crate) fn objects(
    file: &ObjectsFile,
    size: [u32; 2],
    labels: usize,
    label: Option<&Raster<[u8; 3]>>,
) -> Result<Vec<ObjectEntry>, String> {
    if [file.width, file.height] != size {
        let [w, h] = size;
        return Err(format!("it is of an image of {} × {} pixels, not {w} × {h}", file.width, file.height));
    }
    let entries = file.objects.iter().map(|object| entry(object, size, labels, label));
    let mut entries = entries.collect::<Result<Vec<_>, _>>()?;
    entries.sort_by_key(|object| (u64::MAX - object.seen, object.label));
    Ok(entries)
}

fn entry(
    object: &ImageObject,
    size: [u32; 2],
    labels: usize,
    label: Option<&Raster<[u8; 3]>>,
) -> Result<ObjectEntry, String> {
    let ImageObject { label_index, amodal_mask, hidden_by, .. } = object;
    let known = |index: u32| (index as usize) < labels;
    if *label_index == 0 || !known(*label_index) || !hidden_by.iter().all(|hider| known(hider.label_index)) {
        return Err(format!("{}: it has an index of no label", object.label));
    }
    let [width, height] = size;
    let stretches = (amodal_mask.size == [height, width])
        .then(|| amodal_mask.decode())
        .flatten();
    let Some(stretches) = stretches else {
        return Err(format!("{}: its mask is not of this image", object.label));
    };

    let tolerance = STAIRS * (f64::from(width.max(height)) / WIDTH_SHOWN).max(1.0);
    let [_, r, g, b] = label_index.to_be_bytes();
    // What hides a part is in the image of labels. Without one all counts as seen.
    let is_seen = |x: u32, y: u32| label.is_none_or(|label| label.at(x, y) == [r, g, b]);
    let rings = outline(size, &stretches, tolerance, is_seen);

    Ok(ObjectEntry {
        label: *label_index,
        seen: object.visible_pixels,
        alone: object.amodal_pixels,
        hidden: rounded(object.occlusion, 4),
        cut: object.beyond.map(|beyond| rounded(beyond.truncation, 4)),
        by: hidden_by
            .iter()
            .map(|hider| (hider.label_index, hider.pixels))
            .collect(),
        nearest_m: rounded(object.nearest_m.into(), 3),
        outline: rings.iter().map(|ring| ring.iter().map(numbers).collect()).collect(),
    })
}

/// Returns a part as it is written.
fn numbers(part: &Part) -> Vec<u32> {
    let kind = match part.kind {
        Kind::Seen => 0,
        Kind::Hidden => 1,
        Kind::Cut => 2,
    };
    std::iter::once(kind)
        .chain(part.corners.as_flattened().iter().copied())
        .collect()
}
