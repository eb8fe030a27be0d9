//! Edges where a surface ends in front of another.

use super::plane::Plane;
use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::channels::{assert_size, fit};
use crate::shade::patch::FaceCache;
use s3d_geom::{Camera, Raster, Rays};
use s3d_simd::{dispatch, level};

/// The smallest step of depth that is an edge, metres.
const STEP_M: f64 = 0.01;
/// The same as a share of the depth.
const STEP_SHARE: f64 = 0.005;
/// A little less than [`STEP_M`]: a step that 32 bits show as no more is no edge, whatever their rounding.
const LEAST_STEP_M: f32 = 0.009_99;
/// The cosine between ray and normal below which a plane leaves the image too steeply to tell where its
/// surface goes on.
const STEEP: f64 = 0.1;

/// Writes 255 where a pixel sees a surface that ends in front of what one of its four neighbours sees, and 0
/// elsewhere, into an existing image. The pixel in front is 255, and the one behind it is not.
///
/// Two neighbours are on one surface if their faces are the same or share a corner. Otherwise the step of
/// depth from one to the other is compared with the steps that the planes of both faces make from one ray to
/// the other. It is an edge if it is larger than the sum of 1 cm (or 0.5 % of the depth) and twice the larger
/// of the two: two surfaces that touch between the rays make no larger step. The plane in front does not
/// count if it is seen at an angle of less than 5.7°, unless the other is too. A neighbour that sees nothing
/// makes no edge, since nobody knows what lies behind a hole of a scan.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn occlusion_edge_image_into(scene: &Scene<'_>, hits: &Hits, camera: &Camera, out: &mut Raster<u8>) {
    assert_size(hits, camera);
    fit(out, &hits.face, 0);
    out.pixels_mut().fill(0);
    let width = hits.face.width() as usize;
    let wraps = camera.is_panorama();
    let mut steps = Steps { scene, camera, rays: camera.rays(), planes: FaceCache::new() };

    let faces = hits.face.pixels();
    let depths = hits.depth.pixels();
    let out = out.pixels_mut();
    let mut compare = |a: usize, b: usize| {
        if faces[a] == faces[b] || faces[a] == NO_FACE || faces[b] == NO_FACE {
            return;
        }
        let (near, far) = if depths[a] <= depths[b] { (a, b) } else { (b, a) };
        let [from, to] = [near, far].map(|at| f64::from(depths[at]));
        if to - from > STEP_M.max(STEP_SHARE * from) {
            let [near, far] = [near, far].map(|at| ((at % width) as u32, (at / width) as u32, faces[at]));
            if steps.is_edge(near, from, far, to) {
                out[near.1 as usize * width + near.0 as usize] = 255;
            }
        }
    };

    // Few neighbours have a step between them, and wide registers find those.
    let mut has_step = vec![0u8; width];
    for start in (0..faces.len()).step_by(width.max(1)) {
        let row = start..start + width;
        let (row_faces, row_depths) = (&faces[row.clone()], &depths[row.clone()]);
        let last = width - 1;
        let right = (&faces[start + 1..start + width], &depths[start + 1..start + width]);
        find_steps((&row_faces[..last], &row_depths[..last]), right, &mut has_step);
        for_each_step(&has_step[..last], |x| compare(start + x, start + x + 1));
        if wraps {
            compare(start + last, start);
        }
        if row.end < faces.len() {
            let below = row.end..row.end + width;
            find_steps((row_faces, row_depths), (&faces[below.clone()], &depths[below]), &mut has_step);
            for_each_step(&has_step, |x| compare(start + x, start + width + x));
        }
    }
}

/// The faces and depths of some pixels.
type Pixels<'a> = (&'a [u32], &'a [f32]);

/// Writes 1 where two pixels see different faces, and a step of depth that may be an edge.
fn find_steps(a: Pixels<'_>, b: Pixels<'_>, out: &mut [u8]) {
    dispatch!(level(), _simd => {
        let pixels = a.0.iter().zip(a.1).zip(b.0.iter().zip(b.1));
        for (((face, depth), (other, other_depth)), out) in pixels.zip(out) {
            let is_step = (depth - other_depth).abs() > LEAST_STEP_M;
            *out = u8::from(is_step & (face != other) & (*face != NO_FACE) & (*other != NO_FACE));
        }
    });
}

/// Calls `then` with the place of each pixel that has a step.
fn for_each_step(has_step: &[u8], mut then: impl FnMut(usize)) {
    for (group, steps) in has_step.chunks(32).enumerate() {
        if steps.iter().fold(0, |any, step| any | step) != 0 {
            let places = steps.iter().enumerate().filter(|(_, step)| **step != 0);
            places.for_each(|(place, _)| then(32 * group + place));
        }
    }
}

/// Compares steps of depth with planes.
struct Steps<'a> {
    scene: &'a Scene<'a>,
    camera: &'a Camera,
    rays: Rays,
    planes: FaceCache<Plane>,
}

/// A pixel's column, row and face.
type Pixel = (u32, u32, u32);

impl Steps<'_> {
    fn is_edge(&mut self, near: Pixel, near_depth: f64, far: Pixel, far_depth: f64) -> bool {
        let mesh = self.scene.mesh();
        let corners = mesh.faces()[far.2 as usize];
        if mesh.faces()[near.2 as usize]
            .iter()
            .any(|corner| corners.contains(corner))
        {
            return false;
        }

        let eye = self.camera.pose.location;
        let [near_ray, far_ray] = [near, far].map(|(x, y, _)| self.rays.at(x, y));
        let [near_plane, far_plane] =
            [near, far].map(|(_, _, face)| *self.planes.get(face, || Plane::new(mesh, face, eye)));
        // How far each plane goes back from one ray to the other.
        let step = |plane: Plane, ray, from: f64| {
            plane.depth(ray).map_or(f64::INFINITY, |depth| (depth - from).abs())
        };
        let of_far = step(far_plane, near_ray, far_depth);
        let is_steep = near_plane.cosine(near_ray) < STEEP && far_plane.cosine(far_ray) >= STEEP;
        let of_near = if is_steep {
            0.0
        } else {
            step(near_plane, far_ray, near_depth)
        };
        let smallest = STEP_M.max(STEP_SHARE * near_depth) + 2.0 * of_near.max(of_far);
        far_depth - near_depth > smallest
    }
}
