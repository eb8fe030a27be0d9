//! Detections in 3D beside the true boxes.

use super::areas::{Above, GAP, Legend};
use super::images::pale;
use super::sheet::{Align, INK, Picture, Point, SIZE, Sheet, Stroke, WIDTH};
use super::{Book, Drawn};
use crate::error::Result;
use crate::faults::Faults;
use crate::poster::rooms_of;
use s3d_geom::glam::{DVec3, dvec3};
use s3d_io::fs::read_json;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A detection, as `s3d detect run` writes a list of them. Other keys are passed over.
#[derive(Deserialize)]
pub(super) struct Detection {
    pub(super) area: u32,
    class: String,
    score: f64,
    /// The least and the largest corner, world metres.
    min: [f64; 3],
    max: [f64; 3],
}

/// Reads a list of detections.
pub(super) fn read(path: &Path) -> Result<Vec<Detection>> {
    let detections: Vec<Detection> = read_json(path)?;
    let is_box = |d: &Detection| d.score.is_finite() && d.min.iter().chain(&d.max).all(|k| k.is_finite());
    match detections.iter().position(|d| !is_box(d)) {
        None => Ok(detections),
        Some(i) => Err(s3d_io::Error::format(path, format!("box {i} or its score is not finite")).into()),
    }
}

/// Classes whose boxes hold all others are not drawn.
const AROUND: [&str; 3] = ["ceiling", "floor", "wall"];

/// A box and the colour of its class.
type Colored = ([[f64; 3]; 2], [u8; 3]);

/// Draws the true boxes of an area and the best detections: of each class as many as there are.
pub(super) fn detections(book: &Book<'_>, area: u32, found: &[Detection]) -> Result<Option<Drawn>> {
    let Some(file) = book.data.mesh(area)? else { return Ok(None) };
    let rooms = rooms_of(book.data, area, &mut Faults::default())?;
    let colors: BTreeMap<&str, [u8; 3]> = book.images.classes().into_iter().collect();
    let is_drawn = |d: &&Detection| d.area == area && !AROUND.contains(&d.class.as_str());
    let mut found: Vec<&Detection> = found.iter().filter(is_drawn).collect();
    found.sort_by(|a, b| b.score.total_cmp(&a.score));

    let mut truth: Vec<Colored> = Vec::new();
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for instance in book.data.instances(area)? {
        let is_sought = found.iter().any(|d| d.class == instance.class);
        let Some(color) = colors.get(instance.class.as_str()).filter(|_| is_sought) else { continue };
        let [a, b, c, d, e, f] = instance.bbox.map(f64::from);
        truth.push(([[a, b, c], [d, e, f]], *color));
        *counts.entry(instance.class).or_default() += 1;
    }
    let mut best: Vec<Colored> = Vec::new();
    for Detection { class, min, max, .. } in found {
        let left = counts.get_mut(class).filter(|left| **left > 0);
        if let (Some(left), Some(color)) = (left, colors.get(class.as_str())) {
            *left -= 1;
            best.push(([*min, *max], *color));
        }
    }
    if truth.is_empty() {
        return Ok(None);
    }

    let (above, picture, _) = Above::new(book, &file.mesh, &rooms, None);
    let legend = Legend::of(book, truth.iter().map(|(_, color)| *color));
    let width = 0.5 * (WIDTH - GAP);
    let height = width * above.aspect();
    let mut sheet = Sheet::new(height + 1.6 * SIZE + legend.height());
    let pale = Picture { pixels: picture.pixels.map(pale), is_photo: true };
    let sides = [(truth, "true boxes", pale.clone()), (best, "detections", pale)];
    for (i, (boxes, words, picture)) in sides.into_iter().enumerate() {
        let at = [i as f32 * (width + GAP), 0.0];
        sheet.picture(at, [width, height], picture);
        let project = above.project(at, width);
        for (corners, color) in boxes {
            edges(corners, &project).for_each(|edge| sheet.line(&edge, Stroke::new(color, 0.7)));
        }
        sheet.words([at[0] + 0.5 * width, height + 1.2 * SIZE], Align::Middle, INK, words);
    }
    legend.draw(&mut sheet, height + 1.6 * SIZE);
    let caption = format!(
        "True boxes of area {area}, without ceilings, floors and walls, and the detections of the highest \
         scores: of each class as many as there are."
    );
    Ok(Some(Drawn { name: format!("detections_{area}"), caption, sheet }))
}

/// Returns the twelve edges of a box on a page, without those that are not before the camera.
fn edges(
    corners: [[f64; 3]; 2],
    project: &impl Fn(DVec3) -> Option<Point>,
) -> impl Iterator<Item = [Point; 2]> {
    let [low, high] = corners.map(DVec3::from_array);
    let corner = move |i: u32| {
        let pick = |bit: u32, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
        project(dvec3(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z)))
    };
    let edges = (0..8_u32).flat_map(|i| (0..3).map(move |bit| [i, i | 1 << bit]));
    edges
        .filter(|[a, b]| a != b)
        .filter_map(move |[a, b]| Some([corner(a)?, corner(b)?]))
}
