//! Euclidean depth, and the mask of pixels that see something.

use super::plane::{RayLengths, rounded_down};
use crate::hits::{Hits, NO_FACE};
use crate::shade::channels::{assert_size, fit};
use s3d_geom::{Camera, Raster};
use s3d_simd::{dispatch, level};

/// Writes the distance of each pixel's point from the camera into an existing image, in units of which
/// `units_per_m` make a metre, rounded half up. [`MISSING_DEPTH`](crate::MISSING_DEPTH) where nothing is seen
/// and beyond 65,534 units.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn euclidean_depth_image_into(hits: &Hits, camera: &Camera, units_per_m: f64, out: &mut Raster<u16>) {
    assert_size(hits, camera);
    fit(out, &hits.depth, 0);
    let width = (hits.depth.width() as usize).max(1);
    let lengths = RayLengths::new(camera);
    let mut row_lengths = vec![0.0; width];
    let rows = hits.depth.rows().zip(out.pixels_mut().chunks_exact_mut(width));
    for (row, (depths, out)) in rows.enumerate() {
        dispatch!(level(), _simd => {
            lengths.row(row, &mut row_lengths);
            for ((depth, length), out) in depths.iter().zip(&row_lengths).zip(out) {
                // Infinity becomes the largest number.
                *out = rounded_down(f64::from(*depth) * length * units_per_m + 0.5, 65_535.0) as u16;
            }
        });
    }
}

/// Writes 255 where a pixel sees the mesh, and 0 elsewhere, into an existing image.
pub fn mask_image_into(hits: &Hits, out: &mut Raster<u8>) {
    fit(out, &hits.face, 0);
    for (face, out) in hits.face.pixels().iter().zip(out.pixels_mut()) {
        *out = if *face == NO_FACE { 0 } else { 255 };
    }
}
