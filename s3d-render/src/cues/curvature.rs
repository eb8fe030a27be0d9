//! Principal curvatures of a mesh.

use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::channels::{assert_size, by_face};
use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;
use s3d_geom::{Camera, Raster, TriMesh};

/// The radius over which curvatures are averaged, metres.
pub const CURVATURE_RADIUS_M: f64 = 0.05;
/// The radius of the smallest sphere whose curvature an image shows, metres.
pub const SMALLEST_RADIUS_M: f64 = 0.03;
/// The curvature of a pixel that sees nothing.
pub const MISSING_CURVATURE: [u8; 3] = [255; 3];

/// The longest piece of an edge, metres.
const PIECE_M: f32 = 0.025;
/// The side of a cell of the grid of pieces, metres: no point of a piece that counts is further away from a
/// face's middle.
const CELL_M: f32 = 0.05;
/// The smallest angle between two faces that counts, radians.
const SMALLEST_TURN: f64 = 1e-5;

/// Returns the principal curvatures at the middle of each face, the larger first, in 1/m. Positive is convex,
/// seen from the side from which the corners of a face go counterclockwise.
///
/// The tensor is the sum of β · l · w · e eᵀ over the pieces of the edges near a face. β is the signed
/// angle between the normals of the two faces of an edge, e its unit vector, l the length of a piece of at
/// most 2.5 cm, and w = 1 − d²/r² for a piece whose middle is at a distance d < r = 5 cm from the middle
/// of the face. It is divided by the integral of w over a plane, π r² / 2. In the plane of the face, its
/// eigenvalues are the principal curvatures. Edges count if they belong to two faces that are wound alike,
/// and if their normal is on the side of the face's: so the back of a thin board has no part in its front.
/// Corners with equal coordinates are one.
///
/// It is the normal cycle of Cohen-Steiner and Morvan ("Restricted Delaunay Triangulations and Normal Cycle",
/// SoCG 2003) with a smooth weight in place of a ball.
pub fn face_curvatures(mesh: &TriMesh) -> Vec<[f32; 2]> {
    let pieces = Pieces::new(mesh);
    (0..mesh.faces().len() as u32)
        .into_par_iter()
        .map(|face| pieces.curvatures(mesh.triangle(face)))
        .collect()
}

/// Writes principal curvatures into an existing image: R is the larger, G the smaller, each as 127 · (1 +
/// 0.03 m · k), rounded and limited to 0 to 254; B is 0. So 127 is flat, and 254 is a sphere of 3 cm or
/// less, convex towards the camera. [`MISSING_CURVATURE`] where nothing is seen. `curvature_of_face` is what
/// [`face_curvatures`] returns for the mesh.
///
/// # Panics
/// If the hits are not of the camera's size, or a visible face has no curvature.
pub fn curvature_image_into(
    scene: &Scene<'_>,
    hits: &Hits,
    camera: &Camera,
    curvature_of_face: &[[f32; 2]],
    out: &mut Raster<[u8; 3]>,
) {
    assert_size(hits, camera);
    let eye = camera.pose.location;
    let color = |face: u32| {
        if face == NO_FACE {
            return MISSING_CURVATURE;
        }
        let [a, b, c] = scene.mesh().triangle(face).map(|corner| corner.as_dvec3());
        let is_behind = (b - a).cross(c - a).dot(a - eye) > 0.0;
        let [larger, smaller] = curvature_of_face[face as usize];
        let [larger, smaller] = if is_behind {
            [-smaller, -larger]
        } else {
            [larger, smaller]
        };
        let byte = |k: f32| (127.5 + 127.0 * SMALLEST_RADIUS_M * f64::from(k)).clamp(0.0, 254.0) as u8;
        [byte(larger), byte(smaller), 0]
    };
    by_face(Some(scene), hits, MISSING_CURVATURE, out, |faces| faces.map(color));
}

/// A piece of an edge.
#[derive(Clone, Copy)]
struct Piece {
    middle: Vec3,
    /// The direction of the edge, as long as the root of |β| l.
    along: Vec3,
    /// The mean normal of the edge's faces.
    normal: Vec3,
    /// The sign of β.
    sign: f32,
}

/// The pieces of all edges of a mesh that are not flat, by cells of a grid.
struct Pieces {
    pieces: Vec<Piece>,
    /// Where the pieces of each bucket start.
    starts: Vec<u32>,
}

impl Pieces {
    fn new(mesh: &TriMesh) -> Self {
        let mut all = Vec::new();
        for_each_edge(mesh, |ends, faces| add_edge(mesh, ends, faces, &mut all));

        // A hash table of cells, in the memory of a counting sort.
        let buckets = (all.len() / 2).next_power_of_two().max(1);
        let bucket = |piece: &Piece| bucket_of(cell_of(piece.middle), buckets);
        let mut starts = vec![0u32; buckets + 1];
        all.iter().for_each(|piece| starts[bucket(piece) + 1] += 1);
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut next = starts.clone();
        let mut pieces = all.clone();
        for piece in &all {
            let place = &mut next[bucket(piece)];
            pieces[*place as usize] = *piece;
            *place += 1;
        }
        Self { pieces, starts }
    }

    /// Returns the curvatures at the middle of a triangle.
    fn curvatures(&self, [a, b, c]: [Vec3; 3]) -> [f32; 2] {
        let middle = (a + b + c) / 3.0;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let across = normal.any_orthonormal_vector();
        let other = normal.cross(across);
        let square = (CURVATURE_RADIUS_M * CURVATURE_RADIUS_M) as f32;
        let buckets = self.starts.len() - 1;
        let home = cell_of(middle);

        let mut tensor = [0f32; 3];
        for n in 0..27 {
            let cell = home + IVec3::new(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
            let bucket = bucket_of(cell, buckets);
            let range = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
            for piece in &self.pieces[range] {
                let distance = (piece.middle - middle).length_squared();
                if distance >= square || piece.normal.dot(normal) <= 0.0 || cell_of(piece.middle) != cell {
                    continue;
                }
                let weight = piece.sign * (1.0 - distance / square);
                let (u, v) = (piece.along.dot(across), piece.along.dot(other));
                tensor[0] += weight * u * u;
                tensor[1] += weight * u * v;
                tensor[2] += weight * v * v;
            }
        }

        let area = std::f32::consts::PI * square / 2.0;
        let [uu, uv, vv] = tensor.map(|sum| sum / area);
        let mean = (uu + vv) / 2.0;
        let half = (((uu - vv) / 2.0).powi(2) + uv * uv).sqrt();
        [mean + half, mean - half]
    }
}

/// Returns the cell of a point.
fn cell_of(point: Vec3) -> IVec3 {
    (point / CELL_M).floor().as_ivec3()
}

/// Returns the bucket of a cell. The multipliers are those of Teschner et al., "Optimized Spatial Hashing for
/// Collision Detection of Deformable Objects", VMV 2003.
fn bucket_of(cell: IVec3, buckets: usize) -> usize {
    let hash = (cell.x as u32).wrapping_mul(73_856_093)
        ^ (cell.y as u32).wrapping_mul(19_349_663)
        ^ (cell.z as u32).wrapping_mul(83_492_791);
    hash as usize & (buckets - 1)
}

/// Cuts the edge of two faces into pieces, unless they are in one plane.
fn add_edge(mesh: &TriMesh, [from, to]: [Vec3; 2], faces: [u32; 2], pieces: &mut Vec<Piece>) {
    let normal = |face: u32| {
        let [a, b, c] = mesh.triangle(face).map(|corner| corner.as_dvec3());
        (b - a).cross(c - a).normalize_or_zero()
    };
    let [left, right] = faces.map(normal);
    let edge: DVec3 = to.as_dvec3() - from.as_dvec3();
    let length = edge.length();
    let direction = edge / length;
    // Convex edges turn the normal about the edge, as the first face goes along it.
    let sine = left.cross(right).dot(direction);
    let turn = libm::atan2(sine, left.dot(right));
    if turn.is_nan() || turn.abs() <= SMALLEST_TURN {
        return;
    }

    let count = (length as f32 / PIECE_M).ceil().max(1.0);
    let piece_length = length / f64::from(count);
    let along = (direction * (turn.abs() * piece_length).sqrt()).as_vec3();
    let normal = (left + right).normalize_or_zero().as_vec3();
    let sign = turn.signum() as f32;
    for n in 0..count as u32 {
        let middle = from.lerp(to, (n as f32 + 0.5) / count);
        pieces.push(Piece { middle, along, normal, sign });
    }
}

/// Calls `each` with the ends and the two faces of every edge that belongs to two faces wound alike, in an
/// order that the mesh decides. The first face goes from the first end to the second.
fn for_each_edge(mesh: &TriMesh, mut each: impl FnMut([Vec3; 2], [u32; 2])) {
    let corner_of = welded(mesh.positions());
    let ends = |half: u32| {
        let face = mesh.faces()[half as usize / 3];
        let at = half as usize % 3;
        [face[at], face[(at + 1) % 3]].map(|corner| corner_of[corner as usize])
    };

    // The half-edges of each corner with the smaller number.
    let halves = 3 * mesh.faces().len() as u32;
    let mut starts = vec![0u32; mesh.positions().len() + 1];
    let smaller = |half: u32| ends(half).into_iter().min().unwrap_or_default() as usize;
    (0..halves).for_each(|half| starts[smaller(half) + 1] += 1);
    for k in 1..starts.len() {
        starts[k] += starts[k - 1];
    }
    let mut next = starts.clone();
    let mut by_corner = vec![0u32; halves as usize];
    for half in 0..halves {
        let place = &mut next[smaller(half)];
        by_corner[*place as usize] = half;
        *place += 1;
    }

    for bounds in starts.windows(2) {
        let here = &mut by_corner[bounds[0] as usize..bounds[1] as usize];
        let larger = |half: u32| ends(half).into_iter().max().unwrap_or_default();
        here.sort_unstable_by_key(|half| (larger(*half), *half));
        for edge in here.chunk_by(|a, b| larger(*a) == larger(*b)) {
            let &[a, b] = edge else { continue };
            let [from, to] = ends(a);
            if from != to && ends(b) == [to, from] {
                let ends = [from, to].map(|corner| mesh.positions()[corner as usize]);
                each(ends, [a / 3, b / 3]);
            }
        }
    }
}

/// Returns the first corner at the coordinates of each corner.
fn welded(positions: &[Vec3]) -> Vec<u32> {
    // Adding 0 turns −0 into 0.
    let key = |corner: &u32| (positions[*corner as usize] + 0.0).to_array().map(f32::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.par_sort_unstable_by_key(|corner| (key(corner), *corner));
    let mut first = vec![0; positions.len()];
    for equal in order.chunk_by(|a, b| key(a) == key(b)) {
        equal.iter().for_each(|corner| first[*corner as usize] = equal[0]);
    }
    first
}
