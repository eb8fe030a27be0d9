//! How large faces are in an image.

use super::plane::Plane;
use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::channels::{assert_size, fit};
use crate::shade::patch::FaceCache;
use s3d_geom::{Camera, Raster};
use std::f64::consts::TAU;

/// Writes the size of each pixel's face into an existing image: the root of the area that the whole face
/// would take in the image, in pixels, rounded, 1 to 255. 0 where nothing is seen. What hides a part of the
/// face does not count, nor does the border of the image. The size is that of the face's plane at the pixel,
/// so it changes a little over a large face. A panorama's pixels count as at its horizon.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn face_size_image_into(scene: &Scene<'_>, hits: &Hits, camera: &Camera, out: &mut Raster<u8>) {
    assert_size(hits, camera);
    fit(out, &hits.face, 0);
    let mesh = scene.mesh();
    let eye = camera.pose.location;
    let square_px = if camera.is_panorama() {
        (f64::from(camera.width) / TAU).powi(2)
    } else {
        let focal = camera.focal_px();
        focal.x * focal.y
    };

    // A face of this area A at the depth z takes A · d / z³ of the image at z = 1, where d is the distance
    // of its plane from the eye.
    let mut scale_of_face = FaceCache::new();
    let mut last = (NO_FACE, 0.0);
    let pixels = hits.face.pixels().iter().zip(hits.depth.pixels());
    for ((face, depth), out) in pixels.zip(out.pixels_mut()) {
        if *face == NO_FACE {
            *out = 0;
            continue;
        }
        if *face != last.0 {
            let scale = scale_of_face
                .get(*face, || square_px * mesh.area(*face) * Plane::new(mesh, *face, eye).offset.abs());
            last = (*face, *scale);
        }
        let depth = f64::from(*depth);
        *out = ((last.1 / (depth * depth * depth)).sqrt() + 0.5).clamp(1.0, 255.0) as u8;
    }
}
