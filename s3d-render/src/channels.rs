//! From hits to the images of the data set. Source: formats.md, "Images".
//!
//! Every image has the size of the hits. Those that depend on the rays' directions take the camera that the hits were
//! cast with, one ray a pixel.

use crate::{
    Hits, NO_FACE, Scene,
    patch::{FaceCache, Patch},
};
use glam::{DVec3, Vec3};
use half::{f16, slice::HalfFloatSliceExt};
use s3d_geom::{Camera, Raster};

/// Depth that is missing, or too far to be written.
pub const MISSING_DEPTH: u16 = 65_535;
/// A normal that is missing.
pub const MISSING_NORMAL: [u8; 3] = [128; 3];
/// An index that is missing: the ray hits nothing.
pub const MISSING_INDEX: [u8; 3] = [13; 3];

/// Which normals a face has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Normals {
    /// The face's own, the same all over it.
    #[default]
    Flat,
    /// Interpolated between the normals at its corners; the face's own if the mesh has none there.
    Smooth,
}

/// Depth in 512ths of a metre, rounded half up: z-depth in a perspective view, distance in a panorama.
/// [`MISSING_DEPTH`] where nothing is seen and beyond 65,534 units (128 m).
pub fn depth_image(hits: &Hits) -> Raster<u16> {
    hits.depth.map(|depth| {
        // In f64 the sum is exact. What does not fit (infinity too) is the missing value; the cast saturates there.
        (f64::from(depth) * 512.0 + 0.5) as u16
    })
}

/// Surface normals in the axes of [`Camera::normal_image_from_world`], a channel = ⌊127.5 + 127.5 n + ½⌋; a normal never
/// points away from the camera (its dot product with the ray is at most 0). [`MISSING_NORMAL`] where nothing is seen.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn normal_image(scene: &Scene<'_>, hits: &Hits, camera: &Camera, normals: Normals) -> Raster<[u8; 3]> {
    match normals {
        Normals::Flat => flat_normals(scene, hits, camera),
        Normals::Smooth => smooth_normals(scene, hits, camera),
    }
}

fn flat_normals(scene: &Scene<'_>, hits: &Hits, camera: &Camera) -> Raster<[u8; 3]> {
    assert_size(hits, camera);
    let image_from_world = camera.normal_image_from_world();
    let mesh = scene.mesh();
    // All rays start at one point, which sees one side of a face.
    by_face(hits, MISSING_NORMAL, |face| {
        let [a, b, c] = mesh.triangle(face).map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize();
        let away = normal.dot(a - camera.pose.location) > 0.0;
        quantized(image_from_world * if away { -normal } else { normal })
    })
}

fn smooth_normals(scene: &Scene<'_>, hits: &Hits, camera: &Camera) -> Raster<[u8; 3]> {
    assert_size(hits, camera);
    let image_from_world = camera.normal_image_from_world();
    let mesh = scene.mesh();
    let mut patches = FaceCache::new();
    let rays = camera.rays();
    let mut out = Vec::with_capacity(hits.face.len());
    for (j, faces) in hits.face.rows().enumerate() {
        for (i, &face) in faces.iter().enumerate() {
            if face == NO_FACE {
                out.push(MISSING_NORMAL);
                continue;
            }
            let patch = patches.get(face, || Patch::new(mesh, face, camera.pose.location));
            let normal = smooth_normal(patch, mesh.corner_normals(face), rays.at(i as u32, j as u32));
            out.push(quantized(image_from_world * normal));
        }
    }
    Raster::from_vec(hits.face.width(), hits.face.height(), out)
}

/// The normal where the ray along `d` arrives, on the side that it sees.
fn smooth_normal(patch: &Patch, corners: Option<[Vec3; 3]>, d: DVec3) -> DVec3 {
    let (flat, away) = patch.normal_towards(d);
    let Some(corners) = corners else { return flat };
    let sum: DVec3 = corners.iter().zip(patch.weights(d)).map(|(n, w)| n.as_dvec3() * w).sum();
    // Corner normals follow the winding, which the flat normal shows.
    let sum = if away { -sum } else { sum };
    // One that points away is bent until it is edge-on.
    let beyond = sum.dot(d).max(0.0);
    (sum - d * (beyond / d.length_squared())).try_normalize().unwrap_or(flat)
}

/// ⌊127.5 + 127.5 n + ½⌋ a channel.
fn quantized(n: DVec3) -> [u8; 3] {
    // A wall along an axis has a 0 that rounding may put on either side of the tie: 128 is meant. The cast rounds down
    // and saturates.
    (n * 127.5 + (128.0 + 1e-9)).to_array().map(|channel| channel as u8)
}

/// The points that are seen, in world metres; (0, 0, 0) where nothing is. A point seen exactly at the world's origin
/// cannot be told from a missing one: that is the format's, not ours.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn xyz_image(hits: &Hits, camera: &Camera) -> Raster<[f32; 3]> {
    let mut out = Vec::with_capacity(hits.depth.len());
    xyz_rows(hits, camera, |row| out.extend_from_slice(row));
    Raster::from_vec(hits.depth.width(), hits.depth.height(), out)
}

/// The points that are seen, row by row.
fn xyz_rows(hits: &Hits, camera: &Camera, mut each: impl FnMut(&[[f32; 3]])) {
    assert_size(hits, camera);
    let rays = camera.rays();
    let mut points = Vec::with_capacity(hits.depth.width() as usize);
    for (j, row) in hits.depth.rows().enumerate() {
        points.clear();
        points.extend(row.iter().enumerate().map(|(i, &depth)| {
            let p = camera.pose.location + rays.at(i as u32, j as u32) * f64::from(depth);
            if depth.is_finite() { p.as_vec3().to_array() } else { [0.0; 3] }
        }));
        each(&points);
    }
}

/// As [`xyz_image`], rounded to half floats as the data set has them: steps of 1.6 cm at 20 m from the world's origin, 6.3 cm at
/// 100 m. A point within 3e-8 m of the origin looks like a missing one.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn xyz_image_half(hits: &Hits, camera: &Camera) -> Raster<[f16; 3]> {
    let mut out = Raster::filled(hits.depth.width(), hits.depth.height(), [f16::ZERO; 3]);
    let mut rows = out.pixels_mut().chunks_exact_mut(hits.depth.width().max(1) as usize);
    xyz_rows(hits, camera, |points| {
        if let Some(row) = rows.next() {
            row.as_flattened_mut().convert_from_f32_slice(points.as_flattened());
        }
    });
    out
}

/// An index a face, as the colour R·65536 + G·256 + B = index; [`MISSING_INDEX`] where nothing is seen. With each face's
/// index into the label table it is the semantic image.
///
/// # Panics
/// If there is not an index for each face that is seen, or one does not fit into 24 bits.
pub fn index_image(hits: &Hits, per_face: &[u32]) -> Raster<[u8; 3]> {
    by_face(hits, MISSING_INDEX, |face| {
        let index = per_face[face as usize];
        let [high, r, g, b] = index.to_be_bytes();
        assert!(high == 0, "the index {index} of face {face} does not fit into 24 bits");
        [r, g, b]
    })
}

/// A colour a face, black where nothing is seen.
///
/// # Panics
/// If there is not a colour for each face that is seen.
pub fn color_per_face_image(hits: &Hits, per_face_colors: &[[u8; 3]]) -> Raster<[u8; 3]> {
    by_face(hits, [0; 3], |face| per_face_colors[face as usize])
}

/// The share of pixels that see anything, 0 to 1; 0 for an image without pixels.
pub fn coverage(hits: &Hits) -> f64 {
    let seen = hits.face.pixels().iter().filter(|&&face| face != NO_FACE).count();
    seen as f64 / hits.face.len().max(1) as f64
}

/// An image from a value a face: `value` is asked once a run of pixels.
fn by_face(hits: &Hits, missing: [u8; 3], mut value: impl FnMut(u32) -> [u8; 3]) -> Raster<[u8; 3]> {
    let mut last = (NO_FACE, missing);
    hits.face.map(|face| {
        if face != last.0 {
            last = (face, if face == NO_FACE { missing } else { value(face) });
        }
        last.1
    })
}

pub(crate) fn assert_size(hits: &Hits, camera: &Camera) {
    let (w, h) = (hits.face.width(), hits.face.height());
    assert!(
        (w, h) == (camera.width, camera.height),
        "hits of {w}×{h} pixels for a camera of {}×{}",
        camera.width,
        camera.height
    );
}
