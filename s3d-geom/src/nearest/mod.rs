//! The face of a mesh that is nearest to a point.
//!
//! Source: `s3d_io::formats`, "What is written": an annotated point votes for its nearest face. If several
//! faces are equally near, it votes for the smallest face index.
//!
//! All arithmetic that decides is in `f64`, on corners sorted by their coordinates. Faces that share an edge
//! or a corner therefore get the same distance there to the bit, whatever their winding and vertex indices.
//!
//! A lookup costs about the same for any point. For a very far point ([`surroundings`]), the nearest face of
//! a nearer point in the same direction is returned.

mod curve;
mod face_tree;
mod surroundings;
mod triangle;
mod triangle8;

use crate::wide::{self, Kernel};
use crate::{Aabb, NO_INDEX, TriMesh};
use curve::{MOST_POINTS, along_a_curve};
use face_tree::{FaceTree, Search, Starts};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use surroundings::Surroundings;
use triangle::SortedTriangle;

/// The face of a mesh nearest to a point, and its nearest place.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Nearest {
    /// The index of the face; the smallest index wins a tie. [`NO_INDEX`] if the point is not finite.
    pub face: u32,
    /// The distance in metres. Infinite if the point is not finite.
    pub distance_m: f32,
    /// The nearest place on the face. The point itself if it is not finite.
    pub point: Vec3,
}

impl Nearest {
    fn none(point: Vec3) -> Self {
        Self { face: NO_INDEX, distance_m: f32::INFINITY, point }
    }

    /// The result for `point` of a search that started from `query`.
    fn found(point: Vec3, query: DVec3, face: u32, distance_squared: f64, nearest: DVec3) -> Self {
        let distance_m = match point.as_dvec3() {
            exact if exact == query => distance_squared.sqrt(),
            exact => exact.distance(nearest),
        };
        Self { face, distance_m: distance_m as f32, point: nearest.as_vec3() }
    }
}

/// Finds the nearest face by measuring all faces. This is the reference for [`NearestFaces`], which returns
/// the same.
pub fn nearest_brute_force(mesh: &TriMesh, point: Vec3) -> Nearest {
    if !point.is_finite() {
        return Nearest::none(point);
    }
    let query = Surroundings::new(mesh.aabb()).looked_up_from(point);
    let mut face = 0;
    let mut least_squared = f64::INFINITY;
    let mut nearest = query;
    for candidate in 0..mesh.faces().len() as u32 {
        let (distance_squared, place) = SortedTriangle::new(mesh.triangle(candidate)).closest(query);
        if distance_squared < least_squared {
            face = candidate;
            least_squared = distance_squared;
            nearest = place;
        }
    }
    Nearest::found(point, query, face, least_squared, nearest)
}

/// A bounding volume hierarchy over the faces of a mesh. It finds the faces nearest to any number of points,
/// from any number of threads.
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
    tree: FaceTree,
}

impl<'m> NearestFaces<'m> {
    /// Builds the hierarchy.
    pub fn new(mesh: &'m TriMesh) -> Self {
        Self { mesh, tree: FaceTree::new(mesh) }
    }

    /// Returns the mesh.
    pub fn mesh(&self) -> &'m TriMesh {
        self.mesh
    }

    /// Returns the face nearest to `point` (world metres), exactly as [`nearest_brute_force`] does.
    pub fn nearest(&self, point: Vec3) -> Nearest {
        let mut nearest = [Nearest::none(point)];
        wide::run(Lookup { tree: &self.tree, points: &[point], order: &[0], out: &mut nearest });
        nearest[0]
    }

    /// Writes the nearest faces of many points into `out`, in the order of the points. The old content of
    /// `out` is replaced.
    ///
    /// Runs on all threads of the current rayon pool, and takes at most 28 MB besides `out`. The points may
    /// be in any order: up to a million at a time are sorted so that neighbours follow each other, which is
    /// faster.
    pub fn nearest_many(&self, points: &[Vec3], out: &mut Vec<Nearest>) {
        out.resize(points.len(), Nearest::none(Vec3::ZERO));
        let mut order = Vec::new();
        let mut found = vec![Nearest::none(Vec3::ZERO); points.len().min(MOST_POINTS)];

        for (points, out) in points.chunks(MOST_POINTS).zip(out.chunks_mut(MOST_POINTS)) {
            along_a_curve(points, &mut order);
            order
                .par_chunks(CHUNK)
                .zip(found.par_chunks_mut(CHUNK))
                .for_each(|(order, out)| {
                    wide::run(Lookup { tree: &self.tree, points, order, out });
                });
            for (&at, nearest) in order.iter().zip(&found) {
                out[at as usize] = *nearest;
            }
        }
    }
}

/// The number of points that one task looks up.
const CHUNK: usize = 1024;

/// A lookup of some points, given by their indices.
struct Lookup<'a> {
    tree: &'a FaceTree,
    points: &'a [Vec3],
    order: &'a [u64],
    out: &'a mut [Nearest],
}

impl Kernel for Lookup<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let mut search = Search::new(self.tree);
        let mut starts = Starts::default();
        let mut guess = 0;
        let mut farthest_m = f32::INFINITY;

        for (group, out) in self.order.chunks(GROUP).zip(self.out.chunks_mut(GROUP)) {
            let points = group.iter().map(|&at| self.points[at as usize]);
            let around = Aabb::from_points(points.clone().filter(|p| p.is_finite()));

            // Far points are searched with bounds in `f64`.
            let surroundings = &self.tree.surroundings;
            if !surroundings.are_near(around) {
                for (point, out) in points.zip(out) {
                    *out = Nearest::none(point);
                    if point.is_finite() {
                        let query = surroundings.looked_up_from(point);
                        let best = search.nearest_far(query, guess);
                        guess = best.leaf;
                        *out = Nearest::found(point, query, best.face, best.distance_squared, best.point);
                    }
                }
                continue;
            }

            // The reach is a guess: most points are as far from the mesh as the points before.
            let reach_m = 1.25 * farthest_m + 0.1 * around.size().max_element();
            let reach_squared = reach_m * reach_m;
            if reach_squared < f32::INFINITY {
                self.tree.starts_near(around, reach_squared, &mut starts);
            }

            farthest_m = 0.0;
            for (point, out) in points.zip(out) {
                if !point.is_finite() {
                    *out = Nearest::none(point);
                    continue;
                }

                let near = if reach_squared < f32::INFINITY {
                    search.nearest_from(&starts, reach_squared, point, guess)
                } else {
                    None
                };
                let best = near.unwrap_or_else(|| search.nearest(point, guess));
                guess = best.leaf;

                let distance_m = best.distance_squared.sqrt() as f32;
                farthest_m = farthest_m.max(distance_m);
                *out = Nearest { face: best.face, distance_m, point: best.point.as_vec3() };
            }
        }
    }
}

/// The number of points whose searches share their starts.
const GROUP: usize = 16;

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    fn mesh(positions: Vec<Vec3>, faces: Vec<[u32; 3]>) -> TriMesh {
        TriMesh::from_faces(positions, faces).unwrap()
    }

    /// Compares the hierarchy with the reference, one by one and in bulk.
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

    /// Returns an n × n grid of squares, two triangles each, over z = `height(x, y)`. Its vertices are
    /// `step` apart.
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

    /// Makes triangles anywhere. On a coarse lattice, many share corners, edges and planes, or coincide.
    fn soup(n: usize, lattice: Option<f32>) -> impl Strategy<Value = TriMesh> {
        prop::collection::vec([point(2.0), point(2.0), point(2.0)], 1..n).prop_filter_map(
            "no area",
            move |t| {
                let positions: Vec<Vec3> = t
                    .into_iter()
                    .flatten()
                    .map(|p| lattice.map_or(p, |step| (p / step).round() * step))
                    .collect();
                let faces = (0..positions.len() as u32 / 3)
                    .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
                    .collect();
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

    fn fraction_from(i: u32, k: u32) -> f32 {
        ((i * k) % 101) as f32 / 50.0 - 1.0
    }

    /// Returns points around `from`, up to `spread` away on each axis.
    fn points_at(from: Vec3, spread: f32, n: u32) -> Vec<Vec3> {
        (0..n)
            .map(|i| from + spread * vec3(fraction_from(i, 7), fraction_from(i, 31), fraction_from(i, 57)))
            .collect()
    }

    #[test]
    fn far_points_find_the_same_as_by_looking_at_all_faces() {
        let bumpy = grid(20, 0.2, |x, y| 0.3 * libm::sinf(9.0 * x) * libm::cosf(7.0 * y));
        let flat = grid(20, 0.2, |_, _| 0.0);
        for mesh in [bumpy, flat] {
            for from in [
                vec3(0.0, 0.0, 150.0),
                vec3(-2000.0, 1.0, 0.0),
                vec3(500_000.0, 5_400_000.0, 300.0),
                vec3(2.0, 2.0, 5e6),
                vec3(1e9, -1e9, 1e7),
                vec3(3e38, 0.0, 0.0),
            ] {
                check(&mesh, &points_at(from, 3.0, 40));
                // Some near, some far.
                check(&mesh, &points_at(from * 0.5, from.abs().max_element() * 0.5, 40));
            }
        }
    }

    #[test]
    fn a_mesh_far_from_the_origin_finds_the_same() {
        let mut parts = grid(20, 2.0, |x, y| x * y * 0.01).into_parts();
        parts
            .positions
            .iter_mut()
            .for_each(|p| *p += vec3(500_000.0, 5_400_000.0, 300.0));
        let mesh = TriMesh::new(parts).unwrap();
        check(&mesh, &points_at(Vec3::ZERO, 10.0, 40));
        check(&mesh, &points_at(mesh.aabb().center(), 30.0, 40));
    }

    fn boxes_measured(distance: f32, tree: &FaceTree) -> usize {
        let mut search = Search::new(tree);
        let points = points_at(Vec3::ZERO, 6.0, 200);
        for (i, p) in points.into_iter().enumerate() {
            let to = [Vec3::X, Vec3::Y, Vec3::Z, vec3(0.1, 0.99, 0.0), Vec3::ONE][i % 5].normalize();
            search.nearest_far(tree.surroundings.looked_up_from(p + to * distance), 0);
        }
        search.measured
    }

    #[test]
    fn a_lookup_costs_the_same_at_any_distance() {
        let mesh = grid(120, 0.1, |x, y| 0.3 * libm::sinf(9.0 * x) * libm::cosf(7.0 * y));
        let tree = FaceTree::new(&mesh);
        let near = boxes_measured(300.0, &tree);
        for distance in [1e4, 1e5, 5.4e6, 1e9, 1e20, 1e38] {
            let far = boxes_measured(distance, &tree);
            assert!(far < 2 * near + 200, "{far} triangles at {distance} m, {near} at 300 m");
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
                        let u = p.x - b.min.x;
                        let v = p.y - b.min.y;
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
        let a = vec3(0.3, 0.1, 0.7);
        let b = vec3(2.1, 0.2, 1.1);
        let c = vec3(0.9, 1.7, 0.4);
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

    fn on_threads(threads: usize, faces: &NearestFaces<'_>, points: &[Vec3]) -> Vec<Nearest> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut out = Vec::new();
        pool.install(|| faces.nearest_many(points, &mut out));
        out
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let m = grid(30, 0.1, |x, y| x * y);
        let faces = NearestFaces::new(&m);
        let points: Vec<Vec3> = (0..5000)
            .map(|i| vec3((i % 71) as f32, (i % 97) as f32, 2.0) * 0.04)
            .collect();
        assert_eq!(on_threads(1, &faces, &points), on_threads(2, &faces, &points));
    }

    /// Returns points on the faces of a mesh, moved off by up to twice `off` metres. Every 37th is far off,
    /// and every 101st is NaN.
    fn around(mesh: &TriMesh, points: u64, off: f32) -> Vec<Vec3> {
        let mut cloud = crate::PointCloud::default();
        crate::SurfaceSampler::new(mesh, crate::Density::Total(points), 3).sample(0..points, &mut cloud);
        let moved = cloud
            .positions
            .iter()
            .zip(&cloud.faces)
            .enumerate()
            .map(|(i, (&p, &face))| {
                let p = p + mesh.normal(face) * (off * ((i % 5) as f32 - 2.0));
                match i {
                    _ if i % 101 == 100 => Vec3::NAN,
                    _ if i % 37 == 36 => p * 3.0 - 5.0,
                    _ => p,
                }
            });
        moved.collect()
    }

    #[test]
    fn more_points_than_are_looked_up_at_once() {
        let m = grid(3, 0.5, |x, y| 0.1 * x * y);
        let faces = NearestFaces::new(&m);
        let points: Vec<Vec3> = (0..MOST_POINTS + 5000)
            .map(|i| vec3((i % 1009) as f32, (i % 997) as f32, 9.0) * 1.6e-3)
            .collect();
        let mut out = Vec::new();
        faces.nearest_many(&points, &mut out);
        assert_eq!(out.len(), points.len());
        for i in (0..points.len()).step_by(1777).chain(MOST_POINTS - 2..MOST_POINTS + 2) {
            assert_eq!(out[i], nearest_brute_force(&m, points[i]));
        }
    }

    #[test]
    fn every_processor_finds_the_same() {
        let m = grid(45, 0.1, |x, y| 0.3 * libm::sinf(9.0 * x) * libm::cosf(7.0 * y));
        let tree = FaceTree::new(&m);
        let points = around(&m, 2000, 0.0025);
        let order: Vec<u64> = (0..2000).collect();
        let mut wide = vec![Nearest::none(Vec3::ZERO); 2000];
        let mut narrow = wide.clone();
        wide::run(Lookup { tree: &tree, points: &points, order: &order, out: &mut wide });
        Lookup { tree: &tree, points: &points, order: &order, out: &mut narrow }.run();
        for (wide, narrow) in wide.iter().zip(&narrow) {
            assert_eq!((wide.face, wide.distance_m.to_bits()), (narrow.face, narrow.distance_m.to_bits()));
            assert_eq!(wide.point.to_array().map(f32::to_bits), narrow.point.to_array().map(f32::to_bits));
        }
    }
}
