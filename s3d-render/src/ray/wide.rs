//! Many rays at once, through a tree whose nodes have eight children.
//!
//! The tree decides which faces a ray may hit, in single precision with margins on the safe side, eight boxes
//! and four faces at a time. What may be hit goes through the exact test of a single ray, so the hits are
//! those of [`cast_ray`], to the bit.

use super::caster::{Hit, Nearest, cast_ray, is_ray};
use super::cone::Cone;
use crate::scene::Scene;
use crate::scene::wide::{BLOCK, Block, IS_BLOCK, NONE, WIDE, WideNode, WideTree};
use glam::DVec3;
use rayon::prelude::*;
use s3d_simd::{dispatch, level};

/// What distances to boxes in single precision may be off by, relatively.
const SLACK: f32 = 2e-6;
/// What coordinates in single precision may be off by, as a share of the largest.
const PADDING: f32 = 4e-7;
/// Rays of a task.
const CHUNK: usize = 1024;

/// Returns the first hit of each ray, as [`cast_ray`] does. Rays start at `origins`, one for all or one for
/// each, and go along `directions`. Up to 1,024 rays are cast on the calling thread, and more on the threads
/// of the current rayon pool. The first call for a scene builds a tree.
///
/// ```
/// use s3d_geom::{TriMesh, glam::{DVec3, vec3}};
/// use s3d_render::{Scene, cast_rays};
///
/// let wall = vec![vec3(-1.0, 2.0, 0.0), vec3(1.0, 2.0, 0.0), vec3(0.0, 2.0, 3.0)];
/// let wall = TriMesh::from_faces(wall, vec![[0, 1, 2]])?;
/// let scene = Scene::new(&wall);
/// let hits = cast_rays(&scene, &[DVec3::Z], &[DVec3::Y, DVec3::X]);
/// assert!(hits[0].is_some_and(|hit| (hit.face, hit.t) == (0, 2.0)) && hits[1].is_none());
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
///
/// # Panics
/// If there is neither one origin nor one for each direction.
pub fn cast_rays(scene: &Scene<'_>, origins: &[DVec3], directions: &[DVec3]) -> Vec<Option<Hit>> {
    each_ray(scene, origins, directions, FirstHit)
}

/// Returns whether each ray hits a face at t < `before`, where the point that is hit is origin + t ·
/// direction. Infinity asks for any hit. Rays are those of [`cast_rays`], and take less time here: the search
/// ends at any face.
///
/// # Panics
/// If there is neither one origin nor one for each direction.
pub fn are_rays_blocked(
    scene: &Scene<'_>,
    origins: &[DVec3],
    directions: &[DVec3],
    before: f64,
) -> Vec<bool> {
    each_ray(scene, origins, directions, IsBlocked { before })
}

/// Returns how many faces each ray hits. Rays are those of [`cast_rays`]. A ray through an edge or a corner
/// hits all faces that share it.
///
/// # Panics
/// If there is neither one origin nor one for each direction.
pub fn count_hits(scene: &Scene<'_>, origins: &[DVec3], directions: &[DVec3]) -> Vec<u32> {
    each_ray(scene, origins, directions, HitCount)
}

/// Asks `query` for each ray.
fn each_ray<Q: Query>(scene: &Scene<'_>, origins: &[DVec3], directions: &[DVec3], query: Q) -> Vec<Q::Found> {
    assert!(
        origins.len() == 1 || origins.len() == directions.len(),
        "{} origins for {} directions",
        origins.len(),
        directions.len()
    );
    let tree = scene.wide();
    let ask_chunk = |(chunk, found): (usize, &mut [Q::Found])| {
        let mut search = Search { scene, tree, nearest: Nearest::default(), stack: Vec::with_capacity(64) };
        dispatch!(level(), _simd => {
            for (i, found) in (chunk * CHUNK..).zip(found) {
                let origin = origins[if origins.len() == 1 { 0 } else { i }];
                *found = query.ask(&mut search, origin, directions[i]);
            }
        });
    };
    let mut found = vec![Q::Found::default(); directions.len()];
    if found.len() <= CHUNK {
        ask_chunk((0, &mut found));
    } else {
        found.par_chunks_mut(CHUNK).enumerate().for_each(ask_chunk);
    }
    found
}

/// What is asked for a ray.
trait Query: Copy + Send + Sync {
    type Found: Clone + Default + Send;

    fn ask(self, search: &mut Search<'_, '_>, origin: DVec3, direction: DVec3) -> Self::Found;
}

#[derive(Clone, Copy)]
struct FirstHit;

impl Query for FirstHit {
    type Found = Option<Hit>;

    #[inline(always)]
    fn ask(self, search: &mut Search<'_, '_>, origin: DVec3, direction: DVec3) -> Option<Hit> {
        if !is_usual(origin, direction) {
            return cast_ray(search.scene, origin, direction);
        }
        let Search { scene, tree, nearest, stack } = search;
        nearest.clear();
        walk(scene, tree, stack, nearest, origin, direction);
        nearest.hit()
    }
}

#[derive(Clone, Copy)]
struct IsBlocked {
    before: f64,
}

impl Query for IsBlocked {
    type Found = bool;

    #[inline(always)]
    fn ask(self, search: &mut Search<'_, '_>, origin: DVec3, direction: DVec3) -> bool {
        if !is_usual(origin, direction) {
            return cast_ray(search.scene, origin, direction).is_some_and(|hit| hit.t < self.before);
        }
        let mut blocker = Blocker { before: self.before, is_hit: false };
        let Search { scene, tree, stack, .. } = search;
        walk(scene, tree, stack, &mut blocker, origin, direction);
        blocker.is_hit
    }
}

#[derive(Clone, Copy)]
struct HitCount;

impl Query for HitCount {
    type Found = u32;

    #[inline(always)]
    fn ask(self, search: &mut Search<'_, '_>, origin: DVec3, direction: DVec3) -> u32 {
        let mut counter = Counter(0);
        let Search { scene, tree, stack, .. } = search;
        if is_usual(origin, direction) {
            walk(scene, tree, stack, &mut counter, origin, direction);
        } else if is_ray(origin, direction) {
            let mesh = scene.mesh();
            for face in 0..mesh.faces().len() as u32 {
                counter.meet(face, mesh.triangle(face).map(|p| p.as_dvec3()), origin, direction);
            }
        }
        counter.0
    }
}

/// What becomes of the faces that a ray may hit.
trait Meet {
    /// Meets a face with these corners in the world.
    fn meet(&mut self, face: u32, corners: [DVec3; 3], origin: DVec3, direction: DVec3);

    /// Returns the `t` beyond which faces are of no use.
    fn reach(&self) -> f64;
}

impl Meet for Nearest {
    #[inline(always)]
    fn meet(&mut self, face: u32, corners: [DVec3; 3], origin: DVec3, direction: DVec3) {
        self.meet_corners(face, corners, origin, direction);
    }

    #[inline(always)]
    fn reach(&self) -> f64 {
        Self::reach(self)
    }
}

/// Tells whether a face is hit at t < `before`.
struct Blocker {
    before: f64,
    is_hit: bool,
}

impl Meet for Blocker {
    #[inline(always)]
    fn meet(&mut self, _face: u32, corners: [DVec3; 3], origin: DVec3, direction: DVec3) {
        let cone = Cone::of_corners(corners, origin).filter(|cone| cone.contains(direction));
        self.is_hit |= cone.is_some_and(|cone| cone.distance(direction) < self.before);
    }

    #[inline(always)]
    fn reach(&self) -> f64 {
        if self.is_hit { f64::NEG_INFINITY } else { self.before }
    }
}

/// Counts the faces that are hit.
struct Counter(u32);

impl Meet for Counter {
    #[inline(always)]
    fn meet(&mut self, _face: u32, corners: [DVec3; 3], origin: DVec3, direction: DVec3) {
        let cone = Cone::of_corners(corners, origin);
        self.0 += u32::from(cone.is_some_and(|cone| cone.contains(direction)));
    }

    #[inline(always)]
    fn reach(&self) -> f64 {
        f64::INFINITY
    }
}

/// A ray in single precision, with margins on the safe side.
struct Bounds {
    /// The origin, moved forwards for the sides where the ray enters a box, so that it enters earlier, and
    /// backwards for those where it leaves.
    enter_from: [f32; 3],
    leave_from: [f32; 3],
    inverse: [f32; 3],
    is_back: [bool; 3],
}

/// A search that keeps its memory between rays.
struct Search<'s, 'm> {
    scene: &'s Scene<'m>,
    tree: &'s WideTree,
    nearest: Nearest,
    stack: Vec<(f32, u32)>,
}

/// Returns whether single precision has room for the numbers of a ray.
#[inline(always)]
fn is_usual(origin: DVec3, direction: DVec3) -> bool {
    let longest = direction.abs().max_element();
    let has_room = origin.abs().max_element() < 1e15 && (1e-100..1e100).contains(&longest);
    has_room && origin.is_finite() && direction.is_finite()
}

/// Lets `found` meet the faces that a usual ray may hit, those of near boxes first.
#[inline(always)]
fn walk(
    scene: &Scene<'_>,
    tree: &WideTree,
    stack: &mut Vec<(f32, u32)>,
    found: &mut impl Meet,
    origin: DVec3,
    direction: DVec3,
) {
    // Lengths are multiples of a direction whose largest component is 1.
    let longest = direction.abs().max_element();
    let bounds = Bounds::new(origin, direction / longest, scene.magnitude(origin));
    let reach_of = |found: &_| (Meet::reach(found) * longest) as f32 * (1.0 + SLACK);
    let mut reach = reach_of(found);
    stack.clear();
    stack.push((0.0, 0));

    while let Some((enter, child)) = stack.pop() {
        if enter > reach {
            continue;
        }
        if child & IS_BLOCK == 0 {
            open(tree, stack, child, &bounds, reach);
            continue;
        }

        let block = &tree.blocks[(child & !IS_BLOCK) as usize];
        let may_hit = block.may_hit(origin, direction);
        for (lane, face) in block.faces.into_iter().enumerate() {
            if may_hit[lane] && face != NONE {
                found.meet(face, block.triangle(lane), origin, direction);
            }
        }
        reach = reach_of(found);
    }
}

/// Puts the children of a node that the ray enters before `reach` on the stack, the nearest last.
#[inline(always)]
fn open(tree: &WideTree, stack: &mut Vec<(f32, u32)>, node: u32, bounds: &Bounds, reach: f32) {
    let node = &tree.nodes[node as usize];
    let enters = node.enters(bounds, reach);
    let first = stack.len();
    for (enter, child) in enters.into_iter().zip(node.children) {
        if enter < f32::INFINITY {
            tree.prefetch(child);
            // The farthest comes first.
            let mut at = stack.len();
            stack.push((enter, child));
            while at > first && stack[at - 1].0 < enter {
                stack.swap(at - 1, at);
                at -= 1;
            }
        }
    }
}

impl Bounds {
    #[inline(always)]
    fn new(origin: DVec3, direction: DVec3, magnitude: f64) -> Self {
        let padding = PADDING * magnitude as f32;
        let (mut enter_from, mut leave_from) = ([0.0; 3], [0.0; 3]);
        let (mut inverse, mut is_back) = ([0.0; 3], [false; 3]);
        for (axis, (o, d)) in origin.to_array().into_iter().zip(direction.to_array()).enumerate() {
            let (o, d) = (o as f32, d as f32);
            // Finite where a component is 0, so that no 0 · ∞ arises.
            inverse[axis] = if d.abs() < 1e-18 {
                1e18_f32.copysign(d)
            } else {
                d.recip()
            };
            is_back[axis] = inverse[axis] < 0.0;
            let forward = if is_back[axis] { -padding } else { padding };
            (enter_from[axis], leave_from[axis]) = (o + forward, o - forward);
        }
        Self { enter_from, leave_from, inverse, is_back }
    }
}

impl WideNode {
    /// Returns where the ray enters the box of each child at the earliest; infinity if it misses the box, or
    /// enters it behind `reach`.
    #[inline(always)]
    fn enters(&self, bounds: &Bounds, reach: f32) -> [f32; WIDE] {
        let (mut enter, mut leave) = ([0.0_f32; WIDE], [reach; WIDE]);
        for axis in 0..3 {
            let (near, far) = if bounds.is_back[axis] {
                (&self.max[axis], &self.min[axis])
            } else {
                (&self.min[axis], &self.max[axis])
            };
            let inverse = bounds.inverse[axis];
            for lane in 0..WIDE {
                let in_at = (near[lane] - bounds.enter_from[axis]) * inverse;
                let out_at = (far[lane] - bounds.leave_from[axis]) * inverse;
                enter[lane] = if in_at > enter[lane] { in_at } else { enter[lane] };
                leave[lane] = if out_at < leave[lane] { out_at } else { leave[lane] };
            }
        }
        for lane in 0..WIDE {
            let earliest = enter[lane] * (1.0 - SLACK);
            enter[lane] = if earliest <= leave[lane] * (1.0 + SLACK) {
                earliest
            } else {
                f32::INFINITY
            };
        }
        enter
    }
}

impl Block {
    fn triangle(&self, lane: usize) -> [DVec3; 3] {
        let corner =
            |[x, y, z]: &[[f32; BLOCK]; 3]| DVec3::new(x[lane].into(), y[lane].into(), z[lane].into());
        [corner(&self.corners[0]), corner(&self.corners[1]), corner(&self.corners[2])]
    }

    /// Tells which faces the ray may hit: a face is left out only if an edge certainly passes the ray on the
    /// wrong side. Signs are those of [`Cone::contains`](super::cone::Cone::contains).
    #[inline(always)]
    fn may_hit(&self, origin: DVec3, d: DVec3) -> [bool; BLOCK] {
        let (origin, d) = (origin.to_array(), d.to_array());
        let relative = |corner: usize| {
            let [x, y, z] = &self.corners[corner];
            [minus(x, origin[0]), minus(y, origin[1]), minus(z, origin[2])]
        };
        let p = [relative(0), relative(1), relative(2)];
        let largest = [largest(&p[0]), largest(&p[1]), largest(&p[2])];
        let size = d[0].abs().max(d[1].abs()).max(d[2].abs());
        let [a, b, c] = &p;
        let whole = dot(a, &cross(b, c));
        let sides = [(b, c, 1, 2), (c, a, 2, 0), (a, b, 0, 1)];
        let mut may = [true; BLOCK];
        for (from, to, i, j) in sides {
            let normal = cross(from, to);
            for lane in 0..BLOCK {
                let side = d[0] * normal[0][lane] + d[1] * normal[1][lane] + d[2] * normal[2][lane];
                // Far above the rounding of both determinants.
                let unsure = 1e-14 * size * largest[i][lane] * largest[j][lane];
                let flat = 1e-14 * largest[0][lane] * largest[1][lane] * largest[2][lane];
                let is_wrong =
                    (side * whole[lane] < 0.0) & (side.abs() > unsure) & (whole[lane].abs() > flat);
                may[lane] &= !is_wrong;
            }
        }
        may
    }
}

type Lanes = [[f64; BLOCK]; 3];

#[inline(always)]
fn minus(k: &[f32; BLOCK], origin: f64) -> [f64; BLOCK] {
    k.map(|k| f64::from(k) - origin)
}

#[inline(always)]
fn largest(p: &Lanes) -> [f64; BLOCK] {
    let mut found = [0.0; BLOCK];
    for lane in 0..BLOCK {
        let (x, y, z) = (p[0][lane].abs(), p[1][lane].abs(), p[2][lane].abs());
        let most = if x > y { x } else { y };
        found[lane] = if most > z { most } else { z };
    }
    found
}

#[inline(always)]
fn cross(a: &Lanes, b: &Lanes) -> Lanes {
    let mut found = [[0.0; BLOCK]; 3];
    for lane in 0..BLOCK {
        found[0][lane] = a[1][lane] * b[2][lane] - a[2][lane] * b[1][lane];
        found[1][lane] = a[2][lane] * b[0][lane] - a[0][lane] * b[2][lane];
        found[2][lane] = a[0][lane] * b[1][lane] - a[1][lane] * b[0][lane];
    }
    found
}

#[inline(always)]
fn dot(a: &Lanes, b: &Lanes) -> [f64; BLOCK] {
    let mut found = [0.0; BLOCK];
    for lane in 0..BLOCK {
        found[lane] = a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane] + a[2][lane] * b[2][lane];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::caster::cast_ray_brute_force;
    use glam::Vec3;
    use s3d_geom::TriMesh;
    use s3d_synth::scenes::scan_like;

    /// A number from −1 to 1 that looks random.
    fn number(n: u64) -> f64 {
        let mixed = (n + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(n: u64) -> DVec3 {
        DVec3::new(number(3 * n), number(3 * n + 1), number(3 * n + 2))
    }

    fn check(mesh: &TriMesh, origins: &[DVec3], directions: &[DVec3]) -> usize {
        let scene = Scene::new(mesh);
        let found = cast_rays(&scene, origins, directions);
        for (i, hit) in found.iter().enumerate() {
            let origin = origins[if origins.len() == 1 { 0 } else { i }];
            assert_eq!(*hit, cast_ray(&scene, origin, directions[i]), "{origin} {}", directions[i]);
        }

        // Any hit, and hits before a face that is hit, agree with the first hits.
        let is_hit: Vec<bool> = found.iter().map(Option::is_some).collect();
        assert_eq!(are_rays_blocked(&scene, origins, directions, f64::INFINITY), is_hit);
        let median = found
            .iter()
            .flatten()
            .map(|hit| hit.t)
            .nth(found.len() / 3)
            .unwrap_or(1.0);
        let before: Vec<bool> = found.iter().map(|hit| hit.is_some_and(|hit| hit.t < median)).collect();
        assert_eq!(are_rays_blocked(&scene, origins, directions, median), before);
        let counts = count_hits(&scene, origins, directions);
        assert!(
            counts
                .iter()
                .zip(&is_hit)
                .all(|(count, is_hit)| (*count > 0) == *is_hit)
        );
        found.iter().flatten().count()
    }

    #[test]
    fn hits_are_counted_like_single_faces() {
        let mesh = scan_like(2000, 9);
        let scene = Scene::new(&mesh);
        let directions: Vec<DVec3> = (0..300).map(vector).collect();
        let counts = count_hits(&scene, &[DVec3::new(0.1, 0.2, 1.0)], &directions);
        let single = |direction: &DVec3| {
            let faces = 0..mesh.faces().len() as u32;
            let hit = faces.filter(|face| {
                let corners = mesh.triangle(*face).map(|p| p.as_dvec3());
                let one = TriMesh::from_faces(corners.map(|p| p.as_vec3()).to_vec(), vec![[0, 1, 2]]);
                cast_ray_brute_force(&one.unwrap(), DVec3::new(0.1, 0.2, 1.0), *direction).is_some()
            });
            hit.count() as u32
        };
        assert_eq!(counts, directions.iter().map(single).collect::<Vec<_>>());
        assert!(counts.iter().any(|count| *count > 1));
    }

    #[test]
    fn hits_are_those_of_single_rays_to_the_bit() {
        let mesh = scan_like(40_000, 3);
        let bounds = mesh.aabb();
        let middle = (0.5 * (bounds.min + bounds.max)).as_dvec3();
        let half = (0.5 * (bounds.max - bounds.min)).as_dvec3();
        let n = 3000;
        let directions: Vec<DVec3> = (0..n).map(vector).collect();
        let inside: Vec<DVec3> = (0..n).map(|i| middle + 0.9 * half * vector(n + i)).collect();
        assert!(check(&mesh, &inside, &directions) > 1000);
        assert!(check(&mesh, &[middle], &directions) > 1000);
        // Far outside, towards the mesh, and with lengths of all sizes.
        let far: Vec<DVec3> = (0..n).map(|i| middle + 400.0 * vector(2 * n + i)).collect();
        let back: Vec<DVec3> = far
            .iter()
            .zip(&inside)
            .map(|(from, to)| (*to - *from) * 10f64.powi((from.x * 7.0) as i32 % 90))
            .collect();
        assert!(check(&mesh, &far, &back) > 1000);
    }

    #[test]
    fn corners_edges_and_axes_are_hit_as_by_single_rays() {
        let mesh = scan_like(3000, 5);
        let origin = DVec3::new(0.3, -0.2, 1.1);
        let mut directions = vec![DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
        for face in 0..mesh.faces().len() as u32 {
            let [a, b, c] = mesh.triangle(face).map(|p| p.as_dvec3() - origin);
            directions.extend([a, b, 0.5 * (a + b), a + b + c, a.map(|x| x * (1.0 + 1e-16))]);
        }
        assert!(check(&mesh, &[origin], &directions) > 1000);
        // Rays along the faces of a wall, and from corners.
        let corners: Vec<DVec3> = mesh.positions().iter().map(|p| p.as_dvec3()).collect();
        let along: Vec<DVec3> = (0..corners.len() as u64).map(vector).collect();
        check(&mesh, &corners, &along);
    }

    #[test]
    fn odd_rays_hit_what_single_rays_hit() {
        let floor = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = TriMesh::from_faces(floor.to_vec(), vec![[0, 1, 2]]).unwrap();
        let odd = [0.0, f64::NAN, f64::INFINITY, -1e200, 1e-200, 1e-320, 0.25];
        for x in odd {
            for y in odd {
                check(
                    &mesh,
                    &[DVec3::new(0.25, 0.25, 1.0)],
                    &[DVec3::new(0.0, x, y), DVec3::new(x, y, -1.0)],
                );
                check(&mesh, &[DVec3::new(x, 0.25, y)], &[DVec3::new(0.0, 0.0, -1.0)]);
            }
        }
        assert!(cast_rays(&Scene::new(&mesh), &[DVec3::ZERO], &[]).is_empty());
    }
}
