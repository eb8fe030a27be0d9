//! Shading without colours: a lamp at the camera lights a white scene.

use super::plane::{Plane, RayLengths, rounded_down};
use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::channels::{assert_size, fit};
use crate::shade::patch::FaceCache;
use s3d_geom::{Camera, Raster};
use s3d_simd::{dispatch, level};

/// The energy of the lamp.
const ENERGY: f64 = 2.5;
/// The constant of the lamp's falloff, metres.
const HALF_LIFE: f64 = 8.0;

/// Writes what a lamp at the camera shows of white Lambertian surfaces into an existing image: 255 · min(1,
/// 2.5 · cos θ · 8 / (8 + d²)), rounded, and at least 1. θ is the angle between the normal of the face
/// and the ray, and d the distance in metres. 0 where nothing is seen.
///
/// The lamp is the one of the annotator of Omnidata: energy 2.5, half-life distance 8, falloff
/// `INVERSE_SQUARE`, which in the renderer it uses, Blender 2.7, is 8 / (8 + d²).
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn reshading_image_into(scene: &Scene<'_>, hits: &Hits, camera: &Camera, out: &mut Raster<u8>) {
    assert_size(hits, camera);
    fit(out, &hits.face, 0);
    let eye = camera.pose.location;
    let width = (hits.face.width() as usize).max(1);
    let lengths = RayLengths::new(camera);
    let mut row_lengths = vec![0.0; width];
    // How far the plane of each pixel's face is.
    let mut row_offsets = vec![0.0; width];
    let mut distance_of_plane = FaceCache::new();

    let rows = hits.face.rows().zip(hits.depth.rows());
    for (row, ((faces, depths), out)) in rows.zip(out.pixels_mut().chunks_exact_mut(width)).enumerate() {
        let mut last = (NO_FACE, 0.0);
        for (face, offset) in faces.iter().zip(&mut row_offsets) {
            if *face != last.0 && *face != NO_FACE {
                let offset =
                    distance_of_plane.get(*face, || Plane::new(scene.mesh(), *face, eye).offset.abs());
                last = (*face, *offset);
            }
            *offset = last.1;
        }

        dispatch!(level(), _simd => {
            lengths.row(row, &mut row_lengths);
            let planes = row_lengths.iter().zip(&row_offsets);
            for (((face, depth), (length, offset)), out) in faces.iter().zip(depths).zip(planes).zip(out) {
                // The cosine is the plane's distance over the point's.
                let distance = f64::from(*depth) * length;
                let falloff = distance * (HALF_LIFE + distance * distance);
                let light = 255.0 * ENERGY * HALF_LIFE * offset / falloff;
                let level = rounded_down(light + 0.5, 255.0).max(1) as u8;
                *out = if *face == NO_FACE { 0 } else { level };
            }
        });
    }
}
