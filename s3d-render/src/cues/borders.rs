//! Borders between instances.

use crate::hits::{Hits, NO_FACE};
use crate::shade::channels::fit;
use s3d_geom::Raster;

/// Writes 255 where a pixel and one of its four neighbours see different objects, and 0 elsewhere, into an
/// existing image. `object_of_face` has a number for each face, such as its label. Pixels on both sides of a
/// border are 255. A pixel that sees nothing makes no border. `wraps` says that the first column is a
/// neighbour of the last.
///
/// # Panics
/// If a visible face has no number.
pub fn border_image_into(hits: &Hits, object_of_face: &[u32], wraps: bool, out: &mut Raster<u8>) {
    fit(out, &hits.face, 0);
    out.pixels_mut().fill(0);
    let width = hits.face.width() as usize;
    let faces = hits.face.pixels();
    let out = out.pixels_mut();
    let differs = |a: u32, b: u32| {
        a != b && a != NO_FACE && b != NO_FACE && object_of_face[a as usize] != object_of_face[b as usize]
    };

    for row in 0..hits.face.height() as usize {
        let start = row * width;
        for at in start..start + width {
            let face = faces[at];
            let right = if at + 1 < start + width { at + 1 } else { start };
            if (right > at || wraps) && differs(face, faces[right]) {
                (out[at], out[right]) = (255, 255);
            }
            let below = at + width;
            if below < faces.len() && differs(face, faces[below]) {
                (out[at], out[below]) = (255, 255);
            }
        }
    }
}
