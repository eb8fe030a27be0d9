//! Pairs of images that see the same surface.

mod candidates;
mod correspondences;

use crate::hits::NO_FACE;
use crate::raster::visibility::Caster;
use crate::ray::caster::Sight;
use crate::scene::Scene;
use candidates::Places;
pub use correspondences::{Correspondence, correspondences};
use glam::{DVec2, DVec3, dvec2};
use rayon::prelude::*;
use s3d_geom::Camera;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// How pairs of images are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairOptions {
    /// The pixels of an image that are asked for: about as many, on a grid.
    pub samples: u32,
    /// A pair is left out if less than this share of either image is seen by the other.
    pub min_overlap: f64,
}

impl Default for PairOptions {
    fn default() -> Self {
        Self { samples: 400, min_overlap: 0.05 }
    }
}

/// What two images have in common, as one of them sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewPair {
    /// The place of the other image in the list.
    pub other: u32,
    /// The share of this image's pixels that show a surface whose point the other image sees, too: from the
    /// same side, in its frame, and with nothing in between.
    pub overlap: f32,
    /// The median angle at those points between the directions to both cameras, degrees. NaN without such a
    /// point.
    pub angle_deg: f32,
    /// The median ratio of the size of a pixel there in this image to its size in the other one. Above 1, the
    /// other image is finer. NaN without such a point.
    pub scale: f32,
    /// The distance between both cameras, metres.
    pub distance_m: f32,
    /// The angle of the rotation from one camera to the other, degrees.
    pub turn_deg: f32,
}

/// How far faces may be in front of a point and not hide it, metres.
const SLACK_M: f64 = 1e-3;

/// A pixel of an image, and the point that it sees.
struct Sample {
    point: DVec3,
    /// The normal of its face, on the side of the camera.
    normal: DVec3,
    /// The size of the pixel there, metres.
    pixel_m: f64,
}

/// Returns the pairs of each image, sorted by the other image. Both images of a pair have it. Runs on the
/// threads of the current rayon pool; the result does not depend on them. [`PairFinder`] does it image by
/// image.
pub fn view_pairs(scene: &Scene<'_>, cameras: &[Camera], options: &PairOptions) -> Vec<Vec<ViewPair>> {
    let finder = PairFinder::new(scene, cameras, options);
    let seen = (0..cameras.len())
        .into_par_iter()
        .map(|image| finder.seen_by_others(image))
        .collect();
    finder.pairs(seen)
}

/// Finds pairs image by image, so that the caller can tell of progress, or end.
///
/// An image's points are those of a grid of its pixels. A point is seen from another camera if an exact ray
/// to it is free. Images of one place share these rays, and only places that see surface near to the points
/// are asked, so time grows with the images that see the same rooms, and not with the square of all.
pub struct PairFinder<'s, 'm> {
    scene: &'s Scene<'m>,
    cameras: &'s [Camera],
    min_overlap: f64,
    samples: Vec<Vec<Sample>>,
    places: Places,
}

impl<'s, 'm> PairFinder<'s, 'm> {
    /// Looks where each image sees surface, on the threads of the current rayon pool.
    pub fn new(scene: &'s Scene<'m>, cameras: &'s [Camera], options: &PairOptions) -> Self {
        let samples = cameras
            .par_iter()
            .map_init(|| Caster::new(scene), |caster, camera| sample(caster, camera, options.samples))
            .collect();
        let places = Places::new(scene, cameras);
        Self { scene, cameras, min_overlap: options.min_overlap, samples, places }
    }

    /// Returns the other images that see a point of an image, sorted. Runs on the calling thread.
    ///
    /// # Panics
    /// If there is no such image.
    pub fn seen_by_others(&self, image: usize) -> Vec<ViewPair> {
        pairs_of(self.scene, self.cameras, &self.places, image, &self.samples[image])
    }

    /// Returns the pairs of each image, given what [`PairFinder::seen_by_others`] returns for each.
    pub fn pairs(&self, mut seen: Vec<Vec<ViewPair>>) -> Vec<Vec<ViewPair>> {
        add_missing(&mut seen, self.cameras);
        (0..seen.len())
            .into_par_iter()
            .map(|image| kept(&seen, image, self.min_overlap))
            .collect()
    }
}

/// Adds the pairs of which only the other image sees points of this one.
fn add_missing(seen: &mut [Vec<ViewPair>], cameras: &[Camera]) {
    let mut missing = Vec::new();
    for (image, row) in seen.iter().enumerate() {
        for pair in row {
            if find(&seen[pair.other as usize], image).is_none() {
                missing.push((pair.other as usize, image));
            }
        }
    }
    for (image, other) in missing {
        seen[image].push(apart(&cameras[image], &cameras[other], other as u32));
    }
    seen.iter_mut().for_each(|row| row.sort_by_key(|pair| pair.other));
}

/// Returns the pair with another image among the sorted pairs of one.
fn find(row: &[ViewPair], other: usize) -> Option<&ViewPair> {
    let place = row.binary_search_by_key(&(other as u32), |pair| pair.other).ok()?;
    row.get(place)
}

/// Returns the pairs of an image in which one of both sees at least `min_overlap` of its points.
fn kept(seen: &[Vec<ViewPair>], image: usize, min_overlap: f64) -> Vec<ViewPair> {
    let is_enough = |pair: &ViewPair| f64::from(pair.overlap) >= min_overlap;
    let back = |pair: &ViewPair| find(&seen[pair.other as usize], image);
    let pairs = seen[image].iter();
    pairs
        .filter(|pair| is_enough(pair) || back(pair).is_some_and(is_enough))
        .copied()
        .collect()
}

/// Returns points of an image on a grid of pixels.
fn sample(caster: &mut Caster<'_, '_>, camera: &Camera, count: u32) -> Vec<Sample> {
    let pixels = f64::from(camera.width) * f64::from(camera.height);
    let stride = (pixels / f64::from(count.max(1))).sqrt().floor().max(1.0) as u32;
    let stride = stride.min(camera.width).min(camera.height);
    let hits = caster.cast_strided(camera, stride);
    let mesh = caster.scene().mesh();

    let rays = camera.rays();
    let mut samples = Vec::new();
    for row in 0..hits.face.height() {
        for column in 0..hits.face.width() {
            let face = hits.face.at(column, row);
            if face == NO_FACE {
                continue;
            }
            let depth = f64::from(hits.depth.at(column, row));
            let ray = rays.at(stride / 2 + stride * column, stride / 2 + stride * row);
            let normal = mesh.normal(face).as_dvec3();
            samples.push(Sample {
                point: camera.pose.location + ray * depth,
                normal: if normal.dot(ray) > 0.0 { -normal } else { normal },
                pixel_m: pixel_m(camera, depth),
            });
        }
    }
    samples
}

/// Returns the size of a pixel at a depth, in the middle of an image.
fn pixel_m(camera: &Camera, depth: f64) -> f64 {
    if camera.is_panorama() {
        depth * TAU / f64::from(camera.width)
    } else {
        depth / camera.focal_px().x
    }
}

/// What another image sees of an image's points.
#[derive(Default)]
struct Shared {
    points: u32,
    angles_deg: Vec<f32>,
    scales: Vec<f32>,
}

/// Returns the other images that see a point of an image.
fn pairs_of(
    scene: &Scene<'_>,
    cameras: &[Camera],
    places: &Places,
    image: usize,
    samples: &[Sample],
) -> Vec<ViewPair> {
    let here = &cameras[image];
    let mut shared: BTreeMap<u32, Shared> = BTreeMap::new();
    for place in places.near(samples.iter().map(|sample| sample.point)) {
        let eye = place.location;
        let mut sight = Sight::from(scene, eye);
        for sample in samples {
            let to_eye = eye - sample.point;
            if sample.normal.dot(to_eye) <= 0.0 {
                continue;
            }
            let is_in_frame =
                |other: &&u32| **other as usize != image && shows(&cameras[**other as usize], sample.point);
            let mut others = place.images.iter().filter(is_in_frame).peekable();
            // A camera sees its own points.
            let is_seen =
                |sight: &mut Sight<'_, '_>| eye == here.pose.location || sight.is_free(sample.point, SLACK_M);
            if others.peek().is_none() || !is_seen(&mut sight) {
                continue;
            }

            let from_here = here.pose.location - sample.point;
            let angle_rad = libm::atan2(from_here.cross(to_eye).length(), from_here.dot(to_eye));
            let angle_deg = angle_rad.to_degrees() as f32;
            for other in others {
                let camera = &cameras[*other as usize];
                let depth = if camera.is_panorama() {
                    to_eye.length()
                } else {
                    -to_eye.dot(camera.pose.forward())
                };
                let shared = shared.entry(*other).or_default();
                shared.points += 1;
                shared.angles_deg.push(angle_deg);
                shared.scales.push((sample.pixel_m / pixel_m(camera, depth)) as f32);
            }
        }
    }

    let pair = |(other, shared): (u32, Shared)| {
        let there = &cameras[other as usize];
        ViewPair {
            overlap: shared.points as f32 / samples.len() as f32,
            angle_deg: median(shared.angles_deg),
            scale: median(shared.scales),
            ..apart(here, there, other)
        }
    };
    shared.into_iter().map(pair).collect()
}

/// Returns whether a point lies in the frame of a camera.
fn shows(camera: &Camera, point: DVec3) -> bool {
    let size = dvec2(f64::from(camera.width), f64::from(camera.height));
    let projected = camera.project(point);
    projected.is_some_and(|(pixel, _)| pixel.cmpge(DVec2::ZERO).all() && pixel.cmplt(size).all())
}

/// Returns a pair of cameras that have no point in common.
fn apart(here: &Camera, there: &Camera, other: u32) -> ViewPair {
    let turn = there.pose.world_from_camera.transpose() * here.pose.world_from_camera;
    let cos = (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0) / 2.0;
    ViewPair {
        other,
        overlap: 0.0,
        angle_deg: f32::NAN,
        scale: f32::NAN,
        distance_m: here.pose.location.distance(there.pose.location) as f32,
        turn_deg: libm::acos(cos.clamp(-1.0, 1.0)).to_degrees() as f32,
    }
}

/// Returns the lower median; NaN of none.
fn median(mut values: Vec<f32>) -> f32 {
    let middle = values.len().saturating_sub(1) / 2;
    match values.get(middle) {
        Some(_) => *values.select_nth_unstable_by(middle, f32::total_cmp).1,
        None => f32::NAN,
    }
}
