//! Compares the colours of views with the panorama of their location, where both come from pictures.
//!
//! The pictures are not in the data set. But a view and the panorama show the same directions from the same
//! place, so a part of a view has the mean colour that the panorama has there.

use crate::context::Context;
use crate::error::Result;
use crate::parallel::for_each_in_order;
use crate::verify::report::{Report, Topic};
use glam::{DVec2, Vec3, dvec2};
use s3d_geom::{Camera, Raster};
use s3d_io::dataset::{DatasetImage, Domain, Frame, Layout};
use s3d_io::image::read_rgb8;
use std::collections::BTreeMap;

const COLORS: (Topic, &str) = (Topic::Images, "colours of a view and its panorama");

/// The parts of a view along each side.
const PARTS: u32 = 6;

/// The directions in a part, along each side, at which the panorama is read.
const SAMPLES: u32 = 12;

/// The difference of mean colours that rounding and filters may make, in steps of 255.
const ALLOWED: f32 = 5.0;

/// The parts of a view that may differ more: where no picture saw anything, a fill at another resolution may.
const FEW: usize = 3;

/// The mean colours of the parts of a view, row by row.
pub(crate) struct ViewColors {
    /// The index of the view in the list of images.
    image: usize,
    parts: Vec<Vec3>,
}

impl ViewColors {
    /// Returns the colours of the image `image`.
    pub(crate) fn new(image: usize, pixels: &Raster<[u8; 3]>) -> Self {
        let part = |row: u32, column: u32| {
            let ys = bounds(row, pixels.height());
            let xs = bounds(column, pixels.width());
            let mut sum = [0u64; 3];

            for y in ys.clone() {
                let row = &pixels.row(y)[xs.start as usize..xs.end as usize];
                row.iter()
                    .flat_map(|color| color.iter().enumerate())
                    .for_each(|(i, v)| sum[i] += u64::from(*v));
            }
            let count = (ys.len() * xs.len()).max(1) as f32;
            Vec3::from_array(sum.map(|v| v as f32 / count))
        };
        let parts = (0..PARTS * PARTS).map(|i| part(i / PARTS, i % PARTS)).collect();
        Self { image, parts }
    }
}

/// The pixels of a part along one side of an image.
fn bounds(part: u32, of: u32) -> std::ops::Range<u32> {
    part * of / PARTS..(part + 1) * of / PARTS
}

/// Compares the colours of views with the panoramas of their locations.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub(crate) fn check(
    ctx: &Context,
    layout: &Layout,
    images: &[DatasetImage],
    cameras: &[(usize, Camera)],
    views: &[ViewColors],
    report: &Report,
) -> Result<()> {
    let cameras: BTreeMap<usize, &Camera> = cameras.iter().map(|(image, camera)| (*image, camera)).collect();
    let mut of_location: BTreeMap<&str, Vec<&ViewColors>> = BTreeMap::new();
    for view in views {
        of_location.entry(&images[view.image].uuid).or_default().push(view);
    }

    let is_panorama = |image: &DatasetImage| image.frame == Frame::Panorama && image.has(Domain::Rgb);
    let panoramas: Vec<usize> = (0..images.len())
        .filter(|i| is_panorama(&images[*i]) && of_location.contains_key(images[*i].uuid.as_str()))
        .collect();

    for_each_in_order(
        ctx,
        &panoramas,
        || (),
        |(), index| {
            let path = images[*index].path(layout, Domain::Rgb);
            // A file that cannot be read was reported.
            let (Some(camera), Ok(panorama)) = (cameras.get(index), read_rgb8(&path)) else { return Ok(()) };
            let camera = Camera { width: panorama.width(), height: panorama.height(), ..**camera };
            for view in &of_location[images[*index].uuid.as_str()] {
                let Some(view_camera) = cameras.get(&view.image) else { continue };
                let wrong = other_colors(view, view_camera, &camera, &panorama);
                let path = images[view.image].path(layout, Domain::Rgb);
                let panorama = images[*index].relative_path(Domain::Rgb);
                report.check(wrong.len() <= FEW, COLORS, &path, || wrong[0].sentence(wrong.len(), &panorama));
            }
            Ok(())
        },
    )
}

/// A part of a view whose colour is not the panorama's.
struct OtherColor {
    row: u32,
    column: u32,
    of_view: Vec3,
    of_panorama: Vec3,
}

impl OtherColor {
    fn sentence(&self, count: usize, panorama: &str) -> String {
        let Self { row, column, of_view, of_panorama } = self;
        let [of_view, of_panorama] = [of_view, of_panorama].map(|color| color.round().to_array());
        format!(
            "of {PARTS} × {PARTS} parts, {count} have another mean colour than {panorama} there; the first, \
             in row {} and column {}: {of_view:?} for {of_panorama:?}",
            row + 1,
            column + 1
        )
    }
}

/// Returns the parts of a view whose colour is not the panorama's.
fn other_colors(
    view: &ViewColors,
    camera: &Camera,
    panorama_camera: &Camera,
    panorama: &Raster<[u8; 3]>,
) -> Vec<OtherColor> {
    let mut others = Vec::new();
    for (i, of_view) in (0..).zip(&view.parts) {
        let (row, column) = (i / PARTS, i % PARTS);
        let (of_panorama, spread) = expected(row, column, camera, panorama_camera, panorama);
        let off = (*of_view - of_panorama).abs() - spread;
        if off.max_element() > ALLOWED {
            others.push(OtherColor { row, column, of_view: *of_view, of_panorama });
        }
    }
    others
}

/// Returns the mean colour of a panorama in the directions of a part of a view, and how much the mean changes
/// where the panorama is shifted by a pixel: an edge on the border of the part may belong to either side.
fn expected(
    row: u32,
    column: u32,
    camera: &Camera,
    panorama_camera: &Camera,
    panorama: &Raster<[u8; 3]>,
) -> (Vec3, Vec3) {
    let along = |part: u32, sample: u32, size: u32| {
        let samples = f64::from(part * SAMPLES + sample) + 0.5;
        samples / f64::from(PARTS * SAMPLES) * f64::from(size)
    };
    let shifts = [DVec2::ZERO, DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y];
    let mut sums = [Vec3::ZERO; 5];
    for sample in 0..SAMPLES * SAMPLES {
        let x = along(column, sample % SAMPLES, camera.width);
        let y = along(row, sample / SAMPLES, camera.height);
        let direction = camera.direction(x, y);
        let Some((at, _)) = panorama_camera.project(panorama_camera.pose.location + direction) else {
            continue;
        };
        for (sum, shift) in sums.iter_mut().zip(shifts) {
            *sum += color_at(panorama, at + shift);
        }
    }

    let [mean, shifted @ ..] = sums.map(|sum| sum / (SAMPLES * SAMPLES) as f32);
    let spread = shifted
        .map(|other| (other - mean).abs())
        .into_iter()
        .fold(Vec3::ZERO, Vec3::max);
    (mean, spread)
}

/// The colour of a panorama at a point of the image.
fn color_at(panorama: &Raster<[u8; 3]>, at: DVec2) -> Vec3 {
    let at = dvec2(at.x.rem_euclid(f64::from(panorama.width())), at.y.max(0.0));
    let x = (at.x as u32).min(panorama.width() - 1);
    let y = (at.y as u32).min(panorama.height() - 1);
    Vec3::from_array(panorama.at(x, y).map(f32::from))
}
