//! Which face each pixel of a camera sees, and how far away.

use crate::{Scene, ray::RayCaster, tiles};
use s3d_geom::{Camera, Raster};

/// In place of a face: the pixel's ray hits nothing.
pub const NO_FACE: u32 = u32::MAX;

/// What the pixels of an image see. All modalities of a view are made from it, so they agree pixel for pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Hits {
    /// The face that each pixel's ray hits first, [`NO_FACE`] where it hits nothing.
    pub face: Raster<u32>,
    /// How far away it is in metres, as the multiple of the ray's direction that [`Camera::rays`] gives: z along the
    /// optical axis in a perspective view, the distance in a panorama. Infinite where nothing is hit.
    pub depth: Raster<f32>,
}

/// Casts the ray through the centre of every pixel; see [`crate::cast_ray`] for what counts as a hit. Runs on the
/// calling thread alone.
pub fn cast(scene: &Scene<'_>, camera: &Camera) -> Hits {
    cast_strided(scene, camera, 1)
}

/// Casts the rays of every `stride`th pixel of every `stride`th row, from pixel (stride / 2, stride / 2) on: enough to
/// score a view. Along an axis of n pixels there are (n − 1 − stride / 2) / stride + 1 of them (rounding down), none if
/// stride / 2 ≥ n. A stride of 1 is [`cast`].
///
/// # Panics
/// If `stride` is 0.
pub fn cast_strided(scene: &Scene<'_>, camera: &Camera, stride: u32) -> Hits {
    tiles::cast(scene, camera, &strided(camera.width, stride), &strided(camera.height, stride))
}

/// As [`cast_strided`], one exact ray at a time: the reference that tests and benches hold the fast one against.
///
/// # Panics
/// If `stride` is 0.
pub fn cast_ray_by_ray(scene: &Scene<'_>, camera: &Camera, stride: u32) -> Hits {
    let (columns, rows) = (strided(camera.width, stride), strided(camera.height, stride));
    let mut caster = RayCaster::new(scene, camera.pose.location);
    let rays = camera.rays();
    let (mut faces, mut depths) = (Vec::new(), Vec::new());
    for &j in &rows {
        for &i in &columns {
            let hit = caster.cast(rays.at(i, j));
            faces.push(hit.map_or(NO_FACE, |h| h.face));
            depths.push(hit.map_or(f32::INFINITY, |h| h.t as f32));
        }
    }
    let (width, height) = (columns.len() as u32, rows.len() as u32);
    Hits { face: Raster::from_vec(width, height, faces), depth: Raster::from_vec(width, height, depths) }
}

fn strided(size: u32, stride: u32) -> Vec<u32> {
    assert!(stride > 0, "a stride of 0 pixels");
    (stride / 2..size).step_by(stride as usize).collect()
}
