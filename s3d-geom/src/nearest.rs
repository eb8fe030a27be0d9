//! The face of a mesh that is nearest to a point.
//!
//! Source: formats.md, "Labels": an annotated point votes for its nearest face, and a point equally near to several
//! faces for the smallest face index.
//!
//! All arithmetic that decides is `f64`, on corners in the order of their coordinates. So faces that share an edge or a
//! corner get bit by bit the same distance there, whatever their winding and the indices of their vertices.

use crate::triangle::SortedTriangle;
use crate::{NO_INDEX, TriMesh};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris, node::Bvh2Node};
use obvhs::{BvhBuildParams, triangle::Triangle};
use rayon::prelude::*;
use std::time::Duration;

/// The face of a mesh nearest to a point, and the point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The face; the smallest index among equally near ones. [`NO_INDEX`] for a point that is not finite.
    pub face: u32,
    /// How far it is, in metres. Infinite for a point that is not finite.
    pub distance_m: f32,
    /// The face's nearest point. The point itself if that is not finite.
    pub point: Vec3,
}

impl Nearest {
    fn none(point: Vec3) -> Self {
        Self { face: NO_INDEX, distance_m: f32::INFINITY, point }
    }

    fn on(triangle: &SortedTriangle, face: u32, point: Vec3) -> Self {
        let (distance_squared, nearest) = triangle.closest(point.as_dvec3());
        Self { face, distance_m: distance_squared.sqrt() as f32, point: nearest.as_vec3() }
    }
}

/// Finds the nearest face by looking at all of them: the reference for [`NearestFaces`], which gives the same.
pub fn nearest_brute_force(mesh: &TriMesh, point: Vec3) -> Nearest {
    if !point.is_finite() {
        return Nearest::none(point);
    }
    let query = point.as_dvec3();
    let (mut best, mut nearest) = (f64::INFINITY, 0);
    for face in 0..mesh.faces().len() as u32 {
        let distance_squared = SortedTriangle::new(mesh.triangle(face)).closest(query).0;
        if distance_squared < best {
            (best, nearest) = (distance_squared, face);
        }
    }
    Nearest::on(&SortedTriangle::new(mesh.triangle(nearest)), nearest, point)
}

/// A bounding volume hierarchy over the faces of a mesh, to find the nearest of them to any number of points, from any
/// number of threads.
///
/// ```
/// use s3d_geom::{NearestFaces, TriMesh, glam::{Vec3, vec3}};
///
/// let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// let nearest = NearestFaces::new(&mesh).nearest(vec3(0.25, 0.25, 2.0));
/// assert_eq!((nearest.face, nearest.distance_m, nearest.point), (0, 2.0, vec3(0.25, 0.25, 0.0)));
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub struct NearestFaces<'m> {
    mesh: &'m TriMesh,
    nodes: Vec<Bvh2Node>,
    /// The triangles in the order of the hierarchy's leaves, and their faces.
    triangles: Vec<SortedTriangle>,
    faces: Vec<u32>,
}

impl<'m> NearestFaces<'m> {
    /// Builds the hierarchy.
    pub fn new(mesh: &'m TriMesh) -> Self {
        let bvh = build_bvh(mesh);
        let triangles =
            bvh.primitive_indices.iter().map(|&face| SortedTriangle::new(mesh.triangle(face))).collect();
        Self { mesh, nodes: bvh.nodes, triangles, faces: bvh.primitive_indices }
    }

    /// The mesh.
    pub fn mesh(&self) -> &'m TriMesh {
        self.mesh
    }

    /// The face nearest to `point` (world metres), exactly as [`nearest_brute_force`] has it.
    pub fn nearest(&self, point: Vec3) -> Nearest {
        self.search(point, 0, &mut Vec::with_capacity(64)).1
    }

    /// The nearest faces of many points, in their order, into `out`, whose content they replace. Works on all threads of
    /// the current rayon pool, and is fastest if points that follow each other are near each other; the result is the
    /// same in any case.
    pub fn nearest_many(&self, points: &[Vec3], out: &mut Vec<Nearest>) {
        out.resize(points.len(), Nearest::none(Vec3::ZERO));
        out.par_chunks_mut(CHUNK).zip(points.par_chunks(CHUNK)).for_each(|(out, points)| {
            let mut stack = Vec::with_capacity(64);
            let mut slot = 0;
            for (nearest, &point) in out.iter_mut().zip(points) {
                (slot, *nearest) = self.search(point, slot, &mut stack);
            }
        });
    }

    /// Finds the nearest triangle, starting with a guess, both as indices of `triangles`. The guess costs or saves time
    /// and changes nothing else: what is pruned is farther than the best, not as far.
    fn search(&self, point: Vec3, guess: usize, stack: &mut Vec<(f32, u32)>) -> (usize, Nearest) {
        if !point.is_finite() {
            return (guess, Nearest::none(point));
        }
        let query = Query { near: Vec3A::from(point), exact: point.as_dvec3() };
        let mut best = Best::new(guess, self.triangles[guess].closest(query.exact).0);
        stack.clear();
        let mut node = &self.nodes[0];
        loop {
            if node.is_leaf() {
                let first = node.first_index as usize;
                for slot in first..first + node.prim_count as usize {
                    let triangle = &self.triangles[slot];
                    if slot != guess && triangle.box_distance_squared(query.near) <= best.prune_beyond {
                        let distance_squared = triangle.closest(query.exact).0;
                        if distance_squared < best.distance_squared
                            || distance_squared == best.distance_squared
                                && self.faces[slot] < self.faces[best.slot]
                        {
                            best = Best::new(slot, distance_squared);
                        }
                    }
                }
            } else {
                let (left, right) = (node.first_index, node.first_index + 1);
                let to_left = box_distance_squared(&self.nodes[left as usize], query.near);
                let to_right = box_distance_squared(&self.nodes[right as usize], query.near);
                let (near, far) = if to_left <= to_right {
                    ((to_left, left), (to_right, right))
                } else {
                    ((to_right, right), (to_left, left))
                };
                if far.0 <= best.prune_beyond {
                    stack.push(far);
                }
                if near.0 <= best.prune_beyond {
                    node = &self.nodes[near.1 as usize];
                    continue;
                }
            }
            loop {
                match stack.pop() {
                    None => {
                        return (
                            best.slot,
                            Nearest::on(&self.triangles[best.slot], self.faces[best.slot], point),
                        );
                    }
                    Some((bound, next)) if bound <= best.prune_beyond => {
                        node = &self.nodes[next as usize];
                        break;
                    }
                    Some(_) => {}
                }
            }
        }
    }
}

/// Points that one task looks up.
const CHUNK: usize = 512;

struct Query {
    near: Vec3A,
    exact: DVec3,
}

/// The nearest triangle so far.
struct Best {
    slot: usize,
    distance_squared: f64,
    /// Boxes farther than this (squared, in `f32`) hold nothing as near: the distance and some for the rounding of the
    /// boxes' distances, which is below 4e-7 of them, or 1e-44 where numbers get that small.
    prune_beyond: f32,
}

impl Best {
    fn new(slot: usize, distance_squared: f64) -> Self {
        Self { slot, distance_squared, prune_beyond: (distance_squared * (1.0 + 2e-6) + 1e-37) as f32 }
    }
}

/// The squared distance from `point` to the box of a node.
#[inline]
fn box_distance_squared(node: &Bvh2Node, point: Vec3A) -> f32 {
    let aabb = node.aabb();
    (aabb.min - point).max(point - aabb.max).max(Vec3A::ZERO).length_squared()
}

/// Beyond this the builder's surface areas would overflow.
const LARGEST_COORDINATE: f32 = 1e15;

fn build_bvh(mesh: &TriMesh) -> Bvh2 {
    let bounds = mesh.aabb();
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    let scale = if largest > LARGEST_COORDINATE { LARGEST_COORDINATE / largest } else { 1.0 };
    let triangles: Vec<Triangle> = (0..mesh.faces().len() as u32)
        .map(|face| {
            let [v0, v1, v2] = mesh.triangle(face).map(|p| Vec3A::from(p * scale));
            Triangle { v0, v1, v2 }
        })
        .collect();
    let mut bvh = build_bvh2_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
    if scale != 1.0 {
        for node in bvh.nodes.iter_mut().filter(|node| node.is_leaf()) {
            let members = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            let corners = bvh.primitive_indices[members].iter().flat_map(|&face| mesh.triangle(face));
            let bounds = crate::Aabb::from_points(corners);
            node.set_aabb(obvhs::aabb::Aabb::new(bounds.min.into(), bounds.max.into()));
        }
        bvh.refit_all();
    }
    bvh
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    fn mesh(positions: Vec<Vec3>, faces: Vec<[u32; 3]>) -> TriMesh {
        TriMesh::from_faces(positions, faces).unwrap()
    }

    /// Holds the hierarchy against the reference, one by one and in bulk.
    fn check(mesh: &TriMesh, points: &[Vec3]) {
        let faces = NearestFaces::new(mesh);
        let mut many = Vec::new();
        faces.nearest_many(points, &mut many);
        for (&point, bulk) in points.iter().zip(&many) {
            let expected = nearest_brute_force(mesh, point);
            assert_eq!(faces.nearest(point), expected, "at {point}");
            assert_eq!(*bulk, expected, "at {point}");
        }
    }

    /// An n × n grid of squares, two triangles each, over z = `height(x, y)`, its vertices `step` apart.
    fn grid(n: u32, step: f32, height: impl Fn(f32, f32) -> f32) -> TriMesh {
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let positions = (0..=n).flat_map(|i| (0..=n).map(move |j| (i as f32 * step, j as f32 * step)));
        let faces = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        });
        mesh(positions.map(|(x, y)| vec3(x, y, height(x, y))).collect(), faces.collect())
    }

    fn point(scale: f32) -> impl Strategy<Value = Vec3> {
        (-scale..scale, -scale..scale, -scale..scale).prop_map(|(x, y, z)| vec3(x, y, z))
    }

    fn points(scale: f32, n: usize) -> impl Strategy<Value = Vec<Vec3>> {
        prop::collection::vec(point(scale), 1..n)
    }

    /// Triangles anywhere; with a coarse lattice, many share corners, edges and planes, or coincide.
    fn soup(n: usize, lattice: Option<f32>) -> impl Strategy<Value = TriMesh> {
        prop::collection::vec([point(2.0), point(2.0), point(2.0)], 1..n).prop_filter_map(
            "no area",
            move |t| {
                let snap = |p: Vec3| lattice.map_or(p, |step| (p / step).round() * step);
                let positions: Vec<Vec3> = t.into_iter().flatten().map(snap).collect();
                let faces = (0..positions.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
                TriMesh::from_faces(positions, faces).ok()
            },
        )
    }

    proptest! {
        #[test]
        fn soups(mesh in soup(60, None), points in points(3.0, 30)) {
            check(&mesh, &points);
        }

        #[test]
        fn soups_on_a_lattice(mesh in soup(60, Some(1.0)), points in points(3.0, 30)) {
            let on_lattice: Vec<Vec3> = points.iter().map(|p| (p * 2.0).round() / 2.0).collect();
            check(&mesh, &points);
            check(&mesh, &on_lattice);
        }

        #[test]
        fn points_on_corners_edges_and_faces(mesh in soup(40, None), w in [0.0..1.0f32, 0.0..1.0f32]) {
            let points: Vec<Vec3> = (0..mesh.faces().len() as u32)
                .flat_map(|f| {
                    let [a, b, c] = mesh.triangle(f);
                    [a, b, c, a.lerp(b, w[0]), c.lerp(a, w[1]), a.lerp(b, w[0]).lerp(c, w[1])]
                })
                .collect();
            check(&mesh, &points);
            for p in points {
                prop_assert!(nearest_brute_force(&mesh, p).distance_m < 1e-6);
            }
        }

        #[test]
        fn slivers(
            ends in prop::collection::vec((point(2.0), point(2.0), -3e-7..3e-7f32), 1..30),
            points in points(3.0, 20),
        ) {
            let positions: Vec<Vec3> =
                ends.iter().flat_map(|&(a, b, off)| [a, b, a.lerp(b, 0.3) + Vec3::splat(off)]).collect();
            let faces = (0..ends.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
            if let Ok(mesh) = TriMesh::from_faces(positions, faces) {
                check(&mesh, &points);
                check(&mesh, mesh.positions());
            }
        }

        #[test]
        fn points_far_away(mesh in soup(40, None), points in points(1.0, 10), exponent in 0..38i32) {
            let far: Vec<Vec3> = points.iter().map(|p| p * libm::powf(10.0, exponent as f32)).collect();
            check(&mesh, &far);
        }

        #[test]
        fn meshes_of_any_size(mesh in soup(40, None), points in points(3.0, 10), exponent in -30..38i32) {
            let scale = libm::powf(10.0, exponent as f32);
            let mut parts = mesh.into_parts();
            parts.positions.iter_mut().for_each(|p| *p *= scale);
            let points: Vec<Vec3> = points.iter().map(|&p| p * scale).collect();
            prop_assume!(parts.positions.iter().chain(&points).all(|p| p.is_finite()));
            check(&TriMesh::new(parts).unwrap(), &points);
        }
    }

    #[test]
    fn a_point_above_a_shared_edge_or_corner_takes_the_smallest_face() {
        let bumpy = grid(8, 0.1, |x, y| 0.05 * libm::sinf(9.0 * x) * libm::cosf(7.0 * y));
        for (f, &[a, b, _]) in bumpy.faces().iter().enumerate() {
            for (p, on) in [
                (bumpy.positions()[a as usize], vec![a]),
                (bumpy.positions()[a as usize].midpoint(bumpy.positions()[b as usize]), vec![a, b]),
            ] {
                let nearest = NearestFaces::new(&bumpy).nearest(p);
                assert_eq!(nearest, nearest_brute_force(&bumpy, p));
                assert!(nearest.face as usize <= f);
                if on.len() == 1 {
                    let first = bumpy.faces().iter().position(|c| c.contains(&a)).unwrap();
                    assert_eq!((nearest.face as usize, nearest.distance_m), (first, 0.0));
                }
            }
        }
    }

    #[test]
    fn flat_ground_is_exact_on_edges_and_corners() {
        // Steps of ⅛ are exact, and so is every tie.
        let flat = grid(8, 0.125, |_, _| 0.5);
        let faces = NearestFaces::new(&flat);
        for i in 0..=32u8 {
            for j in 0..=32u8 {
                for z in [0.5, 0.505, 0.2] {
                    let p = vec3(f32::from(i) / 32.0, f32::from(j) / 32.0, z);
                    let touching = |t: [Vec3; 3]| {
                        let b = crate::Aabb::from_points(t);
                        let (u, v) = (p.x - b.min.x, p.y - b.min.y);
                        let lower = t.iter().any(|c| *c == vec3(b.max.x, b.min.y, 0.5));
                        p.x >= b.min.x
                            && p.x <= b.max.x
                            && p.y >= b.min.y
                            && p.y <= b.max.y
                            && if lower { v <= u } else { v >= u }
                    };
                    let first = (0..flat.faces().len() as u32).find(|&f| touching(flat.triangle(f)));
                    assert_eq!(Some(faces.nearest(p).face), first, "at {p}");
                }
            }
        }
    }

    #[test]
    fn the_outside_of_a_roof_ties_along_its_ridge() {
        let positions =
            vec![vec3(0.1, 0.3, 2.0), vec3(7.3, 0.9, 2.0), vec3(3.0, -4.0, 0.7), vec3(2.2, 5.1, 0.3)];
        let ridge = positions.clone();
        let roof = mesh(positions, vec![[0, 2, 1], [0, 1, 3]]);
        let other = mesh(ridge.clone(), vec![[1, 3, 0], [1, 0, 2]]);
        for i in 0..200 {
            let p = ridge[0].lerp(ridge[1], i as f32 / 100.0 - 0.5) + vec3(0.0, 0.01 * (i % 5) as f32, 1.0);
            assert_eq!(NearestFaces::new(&roof).nearest(p).face, 0);
            assert_eq!(NearestFaces::new(&other).nearest(p).face, 0);
        }
    }

    #[test]
    fn coinciding_faces_give_the_first() {
        let (a, b, c) = (vec3(0.3, 0.1, 0.7), vec3(2.1, 0.2, 1.1), vec3(0.9, 1.7, 0.4));
        let doubled = mesh(
            vec![c, a, b, Vec3::ONE * 9.0, b, a, c, vec3(9.0, 9.0, 8.0), vec3(9.0, 8.0, 9.0)],
            vec![[3, 7, 8], [2, 0, 1], [1, 0, 2], [4, 5, 6], [6, 4, 5]],
        );
        let inside = (a + b + c) / 3.0;
        for height in [0.0, 0.005, 0.3] {
            let p = inside + doubled.normal(1) * height;
            assert_eq!(NearestFaces::new(&doubled).nearest(p).face, 1);
        }
        check(&doubled, &[inside, a, b, c, a.midpoint(c)]);
    }

    #[test]
    fn a_thousand_times_the_same_face() {
        let same = mesh(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]; 1000]);
        let nearest = NearestFaces::new(&same).nearest(vec3(0.2, 0.2, 1.0));
        assert_eq!((nearest.face, nearest.distance_m), (0, 1.0));
    }

    #[test]
    fn a_point_that_is_not_finite_is_near_nothing() {
        let m = grid(2, 1.0, |_, _| 0.0);
        let faces = NearestFaces::new(&m);
        let points = [vec3(f32::NAN, 0.0, 0.0), vec3(0.0, f32::NEG_INFINITY, 0.0), vec3(0.5, 0.4, 1.0)];
        let mut many = Vec::new();
        faces.nearest_many(&points, &mut many);
        for (p, n) in points.into_iter().zip(&many).take(2) {
            for n in [*n, faces.nearest(p), nearest_brute_force(&m, p)] {
                assert_eq!((n.face, n.distance_m), (NO_INDEX, f32::INFINITY));
            }
        }
        assert_eq!(many[2], nearest_brute_force(&m, points[2]));
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let m = grid(30, 0.1, |x, y| x * y);
        let faces = NearestFaces::new(&m);
        let points: Vec<Vec3> =
            (0..5000).map(|i| vec3((i % 71) as f32, (i % 97) as f32, 2.0) * 0.04).collect();
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut out = Vec::new();
            pool.install(|| faces.nearest_many(&points, &mut out));
            out
        };
        assert_eq!(with(1), with(2));
    }
}
