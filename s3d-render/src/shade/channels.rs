//! Makes the images of the data set from hits. Source: `s3d_io::formats`, "What is written".
//!
//! Every image has the size of the hits. A function whose image depends on the rays' directions takes the
//! camera of the hits, which must have one ray a pixel.

use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::flat_painter::FlatPainter;
use crate::shade::patch::{FaceCache, Patch};
use crate::shade::spans::{Spans, band_rows};
use crate::simd::shade_lanes::{LANES, ShadeLanes};
use crate::simd::{Kernel, Simd, dispatch};
use glam::{DMat3, DVec3, Vec3};
use s3d_geom::{Camera, NormalAxes, Raster, TriMesh};

/// The depth of a pixel that sees nothing, or sees too far to be written.
pub const MISSING_DEPTH: u16 = 65_535;
/// The normal of a pixel that sees nothing.
pub const MISSING_NORMAL: [u8; 3] = [128; 3];
/// The index of a pixel that sees nothing.
pub const MISSING_INDEX: [u8; 3] = [13; 3];

/// The normals of a face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Normals {
    /// The normal of the face itself, the same all over it.
    #[default]
    Flat,
    /// Interpolated between the normals at the corners; the face's own if the mesh has none there.
    Smooth,
}

/// Returns depth in 512ths of a metre, rounded half up: z-depth in a perspective view, distance in a
/// panorama. [`MISSING_DEPTH`] where nothing is seen and beyond 65,534 units (128 m).
pub fn depth_image(hits: &Hits) -> Raster<u16> {
    let mut out = Raster::filled(hits.depth.width(), hits.depth.height(), 0);
    depth_image_into(hits, &mut out);
    out
}

/// Writes the image of [`depth_image`] into an existing image.
pub fn depth_image_into(hits: &Hits, out: &mut Raster<u16>) {
    fit(out, &hits.depth, 0);
    dispatch(DepthKernel { depths: hits.depth.pixels(), out: out.pixels_mut() });
}

/// Writes depth in millimetres, rounded half up, into an existing image: [`MISSING_DEPTH`] where nothing is
/// seen and beyond 65.534 m.
pub fn depth_image_mm_into(hits: &Hits, out: &mut Raster<u16>) {
    fit(out, &hits.depth, 0);
    for (depth, out) in hits.depth.pixels().iter().zip(out.pixels_mut()) {
        // The product is exact. The cast rounds down and saturates, also at infinity.
        *out = (f64::from(*depth) * 1000.0 + 0.5) as u16;
    }
}

struct DepthKernel<'a> {
    depths: &'a [f32],
    out: &'a mut [u16],
}

impl Kernel for DepthKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let lanes = simd.shade();
        depths(lanes, self.depths, self.out);
    }
}

/// Converts depths in metres to 512ths of a metre.
#[inline(always)]
pub(crate) fn depths(lanes: impl ShadeLanes, depths: &[f32], out: &mut [u16]) {
    let (eights, rest) = depths.as_chunks::<LANES>();
    let (out, last) = out.as_chunks_mut::<LANES>();
    for (depths, out) in eights.iter().zip(out) {
        lanes.depths(depths, out);
    }
    let (mut depths, mut rounded) = ([0.0; LANES], [0; LANES]);
    depths[..rest.len()].copy_from_slice(rest);
    lanes.depths(&depths, &mut rounded);
    last.copy_from_slice(&rounded[..rest.len()]);
}

/// Gives `out` the size of `like`.
pub(crate) fn fit<T: Copy, U>(out: &mut Raster<T>, like: &Raster<U>, value: T) {
    if (out.width(), out.height()) != (like.width(), like.height()) {
        *out = Raster::filled(like.width(), like.height(), value);
    }
}

/// Returns surface normals in the paper's axes: see [`Camera::normal_image_from_world`]. A channel is
/// ⌊127.5 + 127.5 n + ½⌋. A normal never points away from the camera: its dot product with the ray is at
/// most 0. [`MISSING_NORMAL`] where nothing is seen.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn normal_image(scene: &Scene<'_>, hits: &Hits, camera: &Camera, normals: Normals) -> Raster<[u8; 3]> {
    let mut out = Raster::filled(hits.face.width(), hits.face.height(), [0; 3]);
    normal_image_into(scene, hits, camera, normals, NormalAxes::Paper, &mut out);
    out
}

/// Writes the image of [`normal_image`] with a choice of [axes](Camera::normal_axes_from_world) into an
/// existing image.
///
/// # Panics
/// As for [`normal_image`].
pub fn normal_image_into(
    scene: &Scene<'_>,
    hits: &Hits,
    camera: &Camera,
    normals: Normals,
    axes: NormalAxes,
    out: &mut Raster<[u8; 3]>,
) {
    assert_size(hits, camera);
    let image_from_world = camera.normal_axes_from_world(axes);
    match normals {
        Normals::Flat => flat_normals(scene, hits, camera, image_from_world, out),
        Normals::Smooth => {
            *out = smooth_normals(scene, hits, camera, MISSING_NORMAL, |normal| {
                quantized(image_from_world * normal)
            });
        }
    }
}

fn flat_normals(
    scene: &Scene<'_>,
    hits: &Hits,
    camera: &Camera,
    image_from_world: DMat3,
    out: &mut Raster<[u8; 3]>,
) {
    let view = (camera.pose.location, image_from_world);
    by_face(Some(scene), hits, MISSING_NORMAL, out, |faces| flat_normals_of(scene.mesh(), faces, view));
}

/// Returns the colours of faces' normals on the side that `origin` sees. All rays start there and see the
/// same side.
#[inline(always)]
pub(crate) fn flat_normals_of(
    mesh: &TriMesh,
    faces: &[u32; LANES],
    (origin, image_from_world): (DVec3, DMat3),
) -> [[u8; 3]; LANES] {
    // By corner, axis and face.
    let mut corners = [[[0.0f64; LANES]; 3]; 3];
    for (k, &face) in faces.iter().enumerate() {
        for (corner, p) in corners.iter_mut().zip(mesh.triangle(face)) {
            (corner[0][k], corner[1][k], corner[2][k]) = (f64::from(p.x), f64::from(p.y), f64::from(p.z));
        }
    }
    let mut channels = [[0.0f64; LANES]; 3];
    // The arithmetic of one face, written so that the compiler vectorises it over faces.
    for k in 0..LANES {
        let [a, b, c] = [0, 1, 2].map(|n| DVec3::new(corners[n][0][k], corners[n][1][k], corners[n][2][k]));
        let normal = (b - a).cross(c - a).normalize();
        let side = if normal.dot(a - origin) > 0.0 { -1.0 } else { 1.0 };
        let color = shifted(image_from_world * (normal * side));
        (channels[0][k], channels[1][k], channels[2][k]) = (color.x, color.y, color.z);
    }
    std::array::from_fn(|k| channels.map(|channel| channel[k] as u8))
}

/// Returns surface normals as unit vectors, before [`normal_image`] turns them into bytes; NaN where nothing
/// is seen.
///
/// # Panics
/// As for [`normal_image`].
pub fn normal_vectors(
    scene: &Scene<'_>,
    hits: &Hits,
    camera: &Camera,
    normals: Normals,
    axes: NormalAxes,
) -> Raster<[f32; 3]> {
    assert_size(hits, camera);
    let image_from_world = camera.normal_axes_from_world(axes);
    let vector = |normal: DVec3| (image_from_world * normal).as_vec3().to_array();
    if normals == Normals::Smooth {
        return smooth_normals(scene, hits, camera, [f32::NAN; 3], vector);
    }

    let mut vectors = FaceCache::new();
    hits.face.map(|face| {
        if face == NO_FACE {
            return [f32::NAN; 3];
        }
        *vectors.get(face, || {
            // The side and the arithmetic are the same as in the image of bytes.
            let [a, b, c] = scene.mesh().triangle(face).map(|p| p.as_dvec3());
            let normal = (b - a).cross(c - a).normalize();
            vector(if normal.dot(a - camera.pose.location) > 0.0 {
                -normal
            } else {
                normal
            })
        })
    })
}

/// Returns the image of `pixel` for the normal that each pixel sees.
fn smooth_normals<T: Copy>(
    scene: &Scene<'_>,
    hits: &Hits,
    camera: &Camera,
    missing: T,
    pixel: impl Fn(DVec3) -> T,
) -> Raster<T> {
    let mesh = scene.mesh();
    let mut patches = FaceCache::new();
    let rays = camera.rays();
    let mut out = Vec::with_capacity(hits.face.len());
    for (j, faces) in hits.face.rows().enumerate() {
        for (i, &face) in faces.iter().enumerate() {
            if face == NO_FACE {
                out.push(missing);
                continue;
            }
            let patch = patches.get(face, || Patch::new(mesh, face, camera.pose.location));
            let normal = smooth_normal(patch, mesh.corner_normals(face), rays.at(i as u32, j as u32));
            out.push(pixel(normal));
        }
    }
    Raster::from_vec(hits.face.width(), hits.face.height(), out)
}

/// Returns the normal where the ray along `d` arrives, on the side that the ray sees.
fn smooth_normal(patch: &Patch, corners: Option<[Vec3; 3]>, d: DVec3) -> DVec3 {
    let (flat, away) = patch.normal_towards(d);
    let Some(corners) = corners else { return flat };
    let sum: DVec3 = corners
        .iter()
        .zip(patch.weights(d))
        .map(|(n, w)| n.as_dvec3() * w)
        .sum();
    // Corner normals follow the winding, which the flat normal shows.
    let sum = if away { -sum } else { sum };
    // A normal that points away is bent until it is edge-on.
    let beyond = sum.dot(d).max(0.0);
    (sum - d * (beyond / d.length_squared()))
        .try_normalize()
        .unwrap_or(flat)
}

/// Returns ⌊127.5 + 127.5 n + ½⌋ for each channel.
fn quantized(n: DVec3) -> [u8; 3] {
    // The cast rounds down and saturates.
    shifted(n).to_array().map(|channel| channel as u8)
}

/// Returns 127.5 + 127.5 n + ½ for each channel, plus a tiny bias. A wall along an axis has a 0 that
/// rounding may put on either side of the tie; it must become 128.
#[inline(always)]
fn shifted(n: DVec3) -> DVec3 {
    n * 127.5 + (128.0 + 1e-9)
}

/// Returns an index a face as the colour R·65536 + G·256 + B = index; [`MISSING_INDEX`] where nothing is
/// seen. With the label table's index of each face, it is the semantic image.
///
/// # Panics
/// If a visible face has no index, or an index does not fit into 24 bits.
pub fn index_image(hits: &Hits, index_of_face: &[u32]) -> Raster<[u8; 3]> {
    let mut out = Raster::filled(hits.face.width(), hits.face.height(), [0; 3]);
    index_image_into(hits, index_of_face, &mut out);
    out
}

/// Writes the image of [`index_image`] into an existing image.
///
/// # Panics
/// As for [`index_image`].
pub fn index_image_into(hits: &Hits, index_of_face: &[u32], out: &mut Raster<[u8; 3]>) {
    by_face(None, hits, MISSING_INDEX, out, |faces| faces.map(|face| index_color(index_of_face, face)));
}

/// Returns the index of a face as a colour.
#[inline(always)]
pub(crate) fn index_color(index_of_face: &[u32], face: u32) -> [u8; 3] {
    let index = index_of_face[face as usize];
    let [high, r, g, b] = index.to_be_bytes();
    assert!(high == 0, "the index {index} of face {face} does not fit into 24 bits");
    [r, g, b]
}

/// Returns a colour a face; black where nothing is seen.
///
/// # Panics
/// If a visible face has no colour.
pub fn color_per_face_image(hits: &Hits, color_of_face: &[[u8; 3]]) -> Raster<[u8; 3]> {
    let mut out = Raster::filled(hits.face.width(), hits.face.height(), [0; 3]);
    color_per_face_image_into(hits, color_of_face, &mut out);
    out
}

/// Writes the image of [`color_per_face_image`] into an existing image.
///
/// # Panics
/// As for [`color_per_face_image`].
pub fn color_per_face_image_into(hits: &Hits, color_of_face: &[[u8; 3]], out: &mut Raster<[u8; 3]>) {
    by_face(None, hits, [0; 3], out, |faces| faces.map(|face| color_of_face[face as usize]));
}

/// Returns a byte a face, and `missing` where nothing is seen: for images with a palette.
///
/// # Panics
/// If a visible face has no byte.
pub fn byte_per_face_image(hits: &Hits, byte_of_face: &[u8], missing: u8) -> Raster<u8> {
    let mut out = Raster::filled(0, 0, 0);
    byte_per_face_image_into(hits, byte_of_face, missing, &mut out);
    out
}

/// Writes the image of [`byte_per_face_image`] into an existing image.
///
/// # Panics
/// As for [`byte_per_face_image`].
pub fn byte_per_face_image_into(hits: &Hits, byte_of_face: &[u8], missing: u8, out: &mut Raster<u8>) {
    fit(out, &hits.face, 0);

    out.pixels_mut()
        .iter_mut()
        .zip(hits.face.pixels())
        .for_each(|(out, face)| {
            *out = if *face == NO_FACE {
                missing
            } else {
                byte_of_face[*face as usize]
            }
        });
}

/// Returns the share of pixels that see anything, 0 to 1; 0 for an image without pixels.
pub fn coverage(hits: &Hits) -> f64 {
    let seen = hits.face.pixels().iter().filter(|&&face| face != NO_FACE).count();
    seen as f64 / hits.face.len().max(1) as f64
}

/// Makes an image with one value a face. `values` is called for eight faces at a time.
pub(crate) fn by_face(
    scene: Option<&Scene<'_>>,
    hits: &Hits,
    missing: [u8; 3],
    out: &mut Raster<[u8; 3]>,
    values: impl Fn(&[u32; LANES]) -> [[u8; 3]; LANES],
) {
    fit(out, &hits.face, [0; 3]);
    dispatch(ByFaceKernel {
        mesh: scene.map(Scene::mesh),
        hits,
        flat: FlatPainter::new([missing], |faces: &[u32; LANES]| values(faces).map(|value| [value])),
        out,
    });
}

struct ByFaceKernel<'a, V> {
    /// The mesh that `values` reads.
    mesh: Option<&'a TriMesh>,
    hits: &'a Hits,
    flat: FlatPainter<V, 1>,
    out: &'a mut Raster<[u8; 3]>,
}

impl<V: Fn(&[u32; LANES]) -> [[[u8; 3]; 1]; LANES]> Kernel for ByFaceKernel<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let lanes = simd.shade();
        let Self { mesh, hits, mut flat, out } = self;
        let width = hits.face.width() as usize;
        let mut spans = Spans::new(width);
        let band = (band_rows(width) * width).max(1);
        for (faces, out) in hits.face.pixels().chunks(band).zip(out.pixels_mut().chunks_mut(band)) {
            if spans.find(lanes, mesh, faces) {
                flat.forget();
            }
            flat.band(lanes, mesh, &spans, [out]);
        }
    }
}

/// Gives the pixels from `start` to `end` a colour, and perhaps some of the pixels after them.
#[inline(always)]
pub(crate) fn paint(out: &mut [[u8; 3]], start: usize, end: usize, color: [u8; 3]) {
    let [r, g, b] = color.map(u64::from);
    let p = r | g << 8 | b << 16;
    // Eight pixels fill three words.
    let words = [p | p << 24 | p << 48, p >> 16 | p << 8 | p << 32 | p << 56, p >> 8 | p << 16 | p << 40];
    let mut at = start;
    while at < end {
        let Some(eight) = out.get_mut(at..at + LANES) else {
            return out[at..end].fill(color);
        };
        for (bytes, word) in eight.as_flattened_mut().as_chunks_mut::<8>().0.iter_mut().zip(words) {
            *bytes = word.to_le_bytes();
        }
        at += LANES;
    }
}

pub(crate) fn assert_size(hits: &Hits, camera: &Camera) {
    let w = hits.face.width();
    let h = hits.face.height();
    assert!(
        (w, h) == (camera.width, camera.height),
        "hits of {w}×{h} pixels for a camera of {}×{}",
        camera.width,
        camera.height
    );
}
