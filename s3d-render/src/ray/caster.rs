//! Casts single rays exactly, one at a time.

use crate::ray::cone::Cone;
use crate::scene::Scene;
use crate::scene::tree::Content;
use glam::DVec3;
use s3d_geom::TriMesh;

/// Distances are equal if they agree to this relative difference; the ray hits the face with the lowest index
/// among them. The tolerance covers the rounding of `f64` at edges that faces share. Real scans hold
/// overlapping faces less than a micrometre apart: a wider tolerance would hide such a face behind one that
/// is truly farther away.
pub(crate) const TIE: f64 = 1e-12;

/// A box that is farther than the nearest hit by this relative difference is skipped. It exceeds the error of
/// a face's distance.
const SLACK: f64 = 2e-6;

/// The face that a ray hits first, and the distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The index of the face.
    pub face: u32,
    /// The point that is hit is origin + t · direction; `t` is above 0.
    pub t: f64,
}

/// Returns the first face that the ray from `origin` along `direction` hits, from either side.
///
/// - The mesh is watertight: a ray through an edge or a corner hits a face there, since the rim belongs to
///   the face.
/// - A face whose plane contains the origin is not hit: it has no width as seen from there. No face at t ≤
///   0 is hit.
/// - Faces whose t agree with the nearest to 1e-12 of it are tied, and the lowest index wins: the order in
///   which coplanar duplicates are met does not matter.
///
/// `t` is accurate to 1e-7 of itself (or 1e-12 m). If a face is seen within 1e-8 rad of edge-on, `t` gives a
/// point between its corners. Returns `None` if the origin or the direction is not finite, or if the
/// direction is zero.
pub fn cast_ray(scene: &Scene<'_>, origin: DVec3, direction: DVec3) -> Option<Hit> {
    RayCaster::new(scene, origin).cast(direction)
}

/// Casts like [`cast_ray`], but tries every face. Tests compare the tree with this reference.
pub fn cast_ray_brute_force(mesh: &TriMesh, origin: DVec3, direction: DVec3) -> Option<Hit> {
    if !is_ray(origin, direction) {
        return None;
    }
    let mut nearest = Nearest::default();
    for face in 0..mesh.faces().len() as u32 {
        nearest.meet(mesh, face, origin, direction);
    }
    nearest.hit()
}

pub(super) fn is_ray(origin: DVec3, direction: DVec3) -> bool {
    origin.is_finite() && direction.is_finite() && direction != DVec3::ZERO
}

/// Inverts a direction. The result is finite even where a component is 0, so that no 0 · ∞ arises.
fn inverse(direction: DVec3) -> DVec3 {
    direction.map(|d| {
        if d.abs() < 1e-290 {
            1e290f64.copysign(d)
        } else {
            d.recip()
        }
    })
}

/// The hits that may still be the nearest one.
#[derive(Default)]
pub(crate) struct Nearest {
    t_min: Option<f64>,
    candidates: Vec<Hit>,
}

impl Nearest {
    pub(super) fn clear(&mut self) {
        self.t_min = None;
        self.candidates.clear();
    }

    pub(crate) fn meet(&mut self, mesh: &TriMesh, face: u32, origin: DVec3, direction: DVec3) {
        let corners = mesh.triangle(face).map(|p| p.as_dvec3());
        self.meet_corners(face, corners, origin, direction);
    }

    /// Meets a face whose corners in the world are at hand.
    pub(super) fn meet_corners(&mut self, face: u32, corners: [DVec3; 3], origin: DVec3, direction: DVec3) {
        let cone = Cone::of_corners(corners, origin).filter(|cone| cone.contains(direction));
        let Some(cone) = cone else { return };
        let t = cone.distance(direction);
        if t <= self.reach() {
            self.t_min = Some(self.t_min.map_or(t, |t_min| t_min.min(t)));
            self.candidates.push(Hit { face, t });
        }
    }

    /// Returns the largest `t` that may still win: beyond it, no index helps.
    pub(super) fn reach(&self) -> f64 {
        self.t_min.map_or(f64::INFINITY, |t| t * (1.0 + TIE))
    }

    pub(crate) fn hit(&self) -> Option<Hit> {
        self.candidates
            .iter()
            .filter(|h| h.t <= self.reach())
            .min_by_key(|h| h.face)
            .copied()
    }
}

/// Tells which points are in sight of one place. Many queries cost less than as many rays: the search ends at
/// the first face in the way, and the face that hid one point is tried first for the next.
///
/// ```
/// use s3d_geom::{TriMesh, glam::{DVec3, vec3}};
/// use s3d_render::{Scene, Sight};
///
/// let wall = vec![vec3(-1.0, 2.0, 0.0), vec3(1.0, 2.0, 0.0), vec3(0.0, 2.0, 3.0)];
/// let wall = TriMesh::from_faces(wall, vec![[0, 1, 2]])?;
/// let scene = Scene::new(&wall);
/// let mut sight = Sight::from(&scene, DVec3::Z);
/// assert!(!sight.is_free(DVec3::new(0.0, 4.0, 1.0), 0.0));
/// assert!(sight.is_free(DVec3::new(0.0, 1.9, 1.0), 0.0));
/// // A point on the wall is free if faces within 1 cm in front of it do not count.
/// assert!(sight.is_free(DVec3::new(0.0, 2.0, 1.0), 0.01));
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub struct Sight<'s, 'm> {
    caster: RayCaster<'s, 'm>,
    /// The face that was in the way last.
    hider: Option<u32>,
}

impl<'s, 'm> Sight<'s, 'm> {
    /// Returns a sight from `origin`.
    pub fn from(scene: &'s Scene<'m>, origin: DVec3) -> Self {
        Self { caster: RayCaster::new(scene, origin), hider: None }
    }

    /// Tells whether `point` is in sight: no face that [`cast_ray`] hits towards it is nearer to the origin
    /// than `point` by more than `slack_m` metres. A point that is not finite, or that is the origin itself,
    /// is always in sight.
    pub fn is_free(&mut self, point: DVec3, slack_m: f64) -> bool {
        let direction = point - self.caster.origin;
        let before = 1.0 - slack_m / direction.length();
        self.hider = self.hider.filter(|&face| self.caster.is_hit(face, direction, before));
        if self.hider.is_none() {
            self.hider = self.caster.any_hit(direction, before);
        }
        self.hider.is_none()
    }
}

/// Casts rays from one origin and keeps its memory between them.
pub(crate) struct RayCaster<'s, 'm> {
    scene: &'s Scene<'m>,
    origin: DVec3,
    /// The growth of boxes in metres: far more than the rounding of `f64`, and far less than any detail of a
    /// scan.
    padding: DVec3,
    stack: Vec<(f64, u32)>,
    nearest: Nearest,
}

impl<'s, 'm> RayCaster<'s, 'm> {
    pub(crate) fn new(scene: &'s Scene<'m>, origin: DVec3) -> Self {
        let padding = DVec3::splat(1e-12 * scene.magnitude(origin));
        Self { scene, origin, padding, stack: Vec::with_capacity(64), nearest: Nearest::default() }
    }

    /// See [`cast_ray`].
    pub(crate) fn cast(&mut self, direction: DVec3) -> Option<Hit> {
        if !is_ray(self.origin, direction) {
            return None;
        }

        let mesh = self.scene.mesh();
        let tree = self.scene.tree();
        let inverse = inverse(direction);
        self.nearest.clear();
        self.stack.clear();
        self.stack.extend(self.enter(0, inverse).map(|t| (t, 0)));

        while let Some((t_enter, node)) = self.stack.pop() {
            if self.nearest.t_min.is_some_and(|t| t_enter > t * (1.0 + SLACK)) {
                continue;
            }

            let first = match tree.nodes[node as usize].content {
                Content::Children(first) => first,
                Content::Leaf { first, count } => {
                    for &face in &tree.faces[first as usize..first as usize + count as usize] {
                        self.nearest.meet(mesh, face, self.origin, direction);
                    }
                    continue;
                }
            };

            match (self.enter(first, inverse), self.enter(first + 1, inverse)) {
                (Some(left), Some(right)) if left <= right => {
                    self.stack.push((right, first + 1));
                    self.stack.push((left, first));
                }
                (left, right) => {
                    self.stack.extend(left.map(|t| (t, first)));
                    self.stack.extend(right.map(|t| (t, first + 1)));
                }
            }
        }

        self.nearest.hit()
    }

    /// Returns a face that is hit before `end`, a multiple of the direction.
    fn any_hit(&mut self, direction: DVec3, end: f64) -> Option<u32> {
        // `end` may be NaN.
        if !is_ray(self.origin, direction) || end.is_nan() || end <= 0.0 {
            return None;
        }

        let tree = self.scene.tree();
        let inverse = inverse(direction);
        self.stack.clear();
        self.stack.extend(self.enter(0, inverse).map(|t| (t, 0)));

        while let Some((_, node)) = self.stack.pop() {
            let first = match tree.nodes[node as usize].content {
                Content::Children(first) => first,
                Content::Leaf { first, count } => {
                    let faces = &tree.faces[first as usize..first as usize + count as usize];
                    if let Some(&face) = faces.iter().find(|&&face| self.is_hit(face, direction, end)) {
                        return Some(face);
                    }
                    continue;
                }
            };

            let [left, right] = [first, first + 1].map(|node| {
                self.enter(node, inverse)
                    .filter(|t| *t <= end * (1.0 + SLACK))
                    .map(|t| (t, node))
            });
            // The nearer box is searched first.
            let (near, far) = if right < left && right.is_some() {
                (right, left)
            } else {
                (left, right)
            };
            self.stack.extend(far);
            self.stack.extend(near);
        }

        None
    }

    fn is_hit(&self, face: u32, direction: DVec3, end: f64) -> bool {
        Cone::new(self.scene.mesh(), face, self.origin)
            .is_some_and(|cone| cone.contains(direction) && cone.distance(direction) < end)
    }

    /// Returns where the ray enters the box of a node: 0 if it starts inside, `None` if it misses the box.
    fn enter(&self, node: u32, inverse: DVec3) -> Option<f64> {
        let node = &self.scene.tree().nodes[node as usize];
        let a = (node.min().as_dvec3() - self.origin - self.padding) * inverse;
        let b = (node.max().as_dvec3() - self.origin + self.padding) * inverse;

        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element();
        // The slabs themselves are rounded to a few parts in 10¹⁶.
        (enter <= leave * (1.0 + 1e-14)).then_some(enter * (1.0 - 1e-14))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, dvec3, vec3};
    use proptest::prelude::*;
    use s3d_geom::{Camera, Pose};
    use std::f32::consts::{PI, TAU};

    fn mesh(positions: &[Vec3], faces: &[[u32; 3]]) -> TriMesh {
        TriMesh::from_faces(positions.to_vec(), faces.to_vec()).unwrap()
    }

    fn check(mesh: &TriMesh, origin: DVec3, directions: impl IntoIterator<Item = DVec3>) -> Vec<Option<Hit>> {
        let scene = Scene::new(mesh);
        directions
            .into_iter()
            .map(|d| {
                let hit = cast_ray(&scene, origin, d);
                assert_eq!(hit, cast_ray_brute_force(mesh, origin, d), "from {origin} along {d}");
                hit
            })
            .collect()
    }

    /// A box of 12 faces, seen from inside or outside.
    fn cube(center: Vec3, half: Vec3) -> TriMesh {
        let corners: Vec<Vec3> = (0..8)
            .map(|k| {
                center
                    + half * vec3((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32).map(|b| 2.0 * b - 1.0)
            })
            .collect();
        let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let faces: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        mesh(&corners, &faces)
    }

    /// A closed ball of rings and sectors with irrational corners.
    fn ball(center: Vec3, radius: f32, rings: u32, sectors: u32) -> TriMesh {
        let mut corners = vec![center - Vec3::Z * radius];
        for ring in 1..rings {
            for sector in 0..sectors {
                let (lat, lon) =
                    (ring as f32 / rings as f32 * PI, (sector as f32 + 0.3) / sectors as f32 * TAU);
                corners
                    .push(center + radius * vec3(lat.sin() * lon.cos(), lat.sin() * lon.sin(), -lat.cos()));
            }
        }

        corners.push(center + Vec3::Z * radius);
        let last = corners.len() as u32 - 1;

        let at = |ring: u32, sector: u32| match ring {
            0 => 0,
            r if r == rings => last,
            r => 1 + (r - 1) * sectors + sector % sectors,
        };

        let mut faces = Vec::new();
        for ring in 0..rings {
            for sector in 0..sectors {
                let [a, b] = [at(ring, sector), at(ring, sector + 1)];
                let [c, d] = [at(ring + 1, sector), at(ring + 1, sector + 1)];
                faces.extend(
                    [[a, b, d], [a, d, c]]
                        .into_iter()
                        .filter(|[a, b, c]| a != b && b != c && a != c),
                );
            }
        }

        mesh(&corners, &faces)
    }

    /// Returns directions that hit corners and middles of edges exactly (if they are representable), and
    /// directions close to them.
    fn awkward(mesh: &TriMesh, origin: DVec3) -> Vec<DVec3> {
        let mut directions = Vec::new();
        for face in 0..mesh.faces().len() as u32 {
            let [a, b, c] = mesh.triangle(face).map(|p| p.as_dvec3() - origin);
            directions.extend([a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.3 * c + 0.7 * a, a + b + c]);
            directions.extend([a * 3.7, b * 1e-3, a.map(|x| x * (1.0 + 1e-16)), b + DVec3::splat(1e-15)]);
        }
        directions
    }

    #[test]
    fn closed_surfaces_have_no_pinholes() {
        for (center, scale) in
            [(Vec3::ZERO, 1.0), (vec3(1000.3, -999.7, 12.1), 1.0), (vec3(3.3, 7.7, 1.1), 0.01)]
        {
            for mesh in [cube(center, vec3(3.0, 2.0, 1.5) * scale), ball(center, 2.0 * scale, 12, 17)] {
                for off in [DVec3::ZERO, dvec3(0.21, -0.37, 0.11)] {
                    let origin = center.as_dvec3() + off * f64::from(scale);
                    let mut directions = awkward(&mesh, origin);
                    let camera = Camera::equirectangular(Pose::level(origin, 0.3), 48);
                    let rays = camera.rays();
                    directions.extend((0..48 * 24).map(|k| rays.at(k % 48, k / 48)));
                    for hit in check(&mesh, origin, directions) {
                        let hit = hit.expect("a closed surface is hit from inside");
                        assert!(hit.t > 0.0);
                    }
                }
            }
        }
    }

    #[test]
    fn nothing_leaks_through_a_wall_of_slivers() {
        // A fan of 4,000 slivers from one corner covers a wall in front of another wall, which is never seen.

        let mut corners = vec![vec3(-1.0, 2.0, -1.0)];
        let rim: Vec<Vec3> = (0..=4000).map(|k| vec3(1.0, 2.0, -1.0 + k as f32 * 5e-4)).collect();
        corners.extend(&rim);
        let mut faces: Vec<[u32; 3]> = (1..=4000).map(|k| [0, k, k + 1]).collect();
        let n = corners.len() as u32;
        corners.extend([vec3(-9.0, 3.0, -9.0), vec3(9.0, 3.0, -9.0), vec3(0.0, 3.0, 20.0)]);
        faces.push([n, n + 1, n + 2]);

        let mesh = mesh(&corners, &faces);
        let origin = dvec3(0.1, 0.0, -0.2);
        let towards = |p: Vec3| p.as_dvec3() - origin;

        // Inside the fan, along its edges.
        let directions = rim[1..4000]
            .iter()
            .step_by(13)
            .flat_map(|&p| [0.1, 0.5, 0.9, 0.999].map(|s| towards(corners[0]) * (1.0 - s) + towards(p) * s));

        for hit in check(&mesh, origin, directions.collect::<Vec<_>>()) {
            assert!(hit.is_some_and(|h| h.face < 4000), "{hit:?}");
        }
    }

    #[test]
    fn the_lowest_of_coplanar_faces_is_hit() {
        let wall = [vec3(-1.0, 2.0, -1.0), vec3(1.0, 2.0, -1.0), vec3(0.1, 2.0, 1.0)];
        let near: Vec<Vec3> = wall.iter().map(|p| *p * vec3(1.0, 1.0 + 4e-7, 1.0)).collect();
        let nearer: Vec<Vec3> = wall.iter().map(|p| *p - Vec3::Y * 1e-3).collect();
        let corners = [&wall[..], &near, &wall].concat();
        let three = mesh(&corners, &[[3, 4, 5], [0, 1, 2], [8, 7, 6]]);
        for hit in check(&three, DVec3::ZERO, [DVec3::Y, dvec3(0.1, 1.0, -0.1)]) {
            assert_eq!(hit.unwrap().face, 1, "the lowest of the nearest two, not the one 4e-7 farther");
        }
        let corners = [corners, nearer].concat();
        let four = mesh(&corners, &[[3, 4, 5], [0, 1, 2], [8, 7, 6], [9, 10, 11]]);
        assert_eq!(check(&four, DVec3::ZERO, [DVec3::Y])[0].unwrap().face, 3);
    }

    #[test]
    fn a_face_in_the_origins_plane_is_not_hit() {
        let floor = mesh(&[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 2]]);
        let all = [DVec3::X, -DVec3::X, DVec3::Z, -DVec3::Z, dvec3(1.0, 1.0, -1e-9)];
        for origin in [dvec3(0.25, 0.25, 0.0), dvec3(-1.0, 0.25, 0.0), DVec3::ZERO] {
            assert!(check(&floor, origin, all).iter().all(Option::is_none));
        }
        let above = check(&floor, dvec3(0.25, 0.25, 1e-12), all);
        assert_eq!(above.iter().map(Option::is_some).collect::<Vec<_>>(), [false, false, false, true, true]);
        assert!((above[3].unwrap().t - 1e-12).abs() < 1e-24);
    }

    #[test]
    fn what_is_no_ray_hits_nothing() {
        let floor = mesh(&[-Vec3::ONE, Vec3::X * 9.0, Vec3::Y * 9.0], &[[0, 1, 2]]);
        for d in [DVec3::ZERO, DVec3::NAN, dvec3(f64::INFINITY, 0.0, 0.0)] {
            assert_eq!(check(&floor, DVec3::Z, [d]), [None]);
        }
        assert_eq!(check(&floor, DVec3::NAN, [DVec3::Z]), [None]);
    }

    /// Returns the textbook's distance to the plane of a face, and the barycentric coordinates there.
    fn textbook(mesh: &TriMesh, face: u32, origin: DVec3, d: DVec3) -> (f64, [f64; 3]) {
        let [a, b, c] = mesh.triangle(face).map(|p| p.as_dvec3());
        let e1 = b - a;
        let e2 = c - a;
        let p = d.cross(e2);
        let q = (origin - a).cross(e1);
        let det = e1.dot(p);
        let u = (origin - a).dot(p) / det;
        let v = d.dot(q) / det;
        (e2.dot(q) / det, [1.0 - u - v, u, v])
    }

    fn corner(range: f32) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-range..range).prop_map(Vec3::from)
    }

    fn direction() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from)
    }

    fn are_above(w: [f64; 3], by: f64) -> bool {
        w.iter().all(|&w| w > by)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        #[test]
        fn soups_give_what_the_textbook_says(
            corners in prop::collection::vec(corner(3.0), 3..60), d in prop::collection::vec(direction(), 20),
            far in prop::sample::select(vec![Vec3::ZERO, vec3(1000.0, -1000.0, 50.0)]),
        ) {
            let corners: Vec<Vec3> = corners.iter().map(|p| *p + far).collect();
            let faces = (0..corners.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
            let Ok(soup) = TriMesh::from_faces(corners, faces.collect()) else { return Ok(()) };

            let origin = far.as_dvec3() + dvec3(0.1, 0.2, 0.3);
            let scene = Scene::new(&soup);
            let mut sight = Sight::from(&scene, origin);

            for (hit, d) in check(&soup, origin, d.clone()).into_iter().zip(d) {
                for (to, slack_m) in [(0.5, 0.0), (3.0, 0.0), (3.0, 0.4)] {
                    let hidden = hit.is_some_and(|hit| hit.t < to - slack_m / d.length());
                    let point = origin + to * d;
                    let margin = hit.is_some_and(|hit| (hit.t - to + slack_m / d.length()).abs() < 1e-9);
                    prop_assert!(margin || sight.is_free(point, slack_m) != hidden, "{hit:?} {to} {slack_m}");
                }

                let all = (0..soup.faces().len() as u32).map(|f| textbook(&soup, f, origin, d));
                let hits = all.filter(|(t, w)| *t > 0.0 && are_above(*w, 1e-9));
                let nearest = hits.map(|(t, _)| t).fold(f64::MAX, f64::min);
                match hit {
                    Some(hit) => {
                        let (t, w) = textbook(&soup, hit.face, origin, d);
                        let is_near = (hit.t - t).abs() <= 1e-6 * t;
                        prop_assert!(is_near && are_above(w, -1e-9), "{hit:?} {t} {w:?}");
                        prop_assert!(hit.t <= nearest * (1.0 + 2e-6));
                    }
                    None => prop_assert_eq!(nearest, f64::MAX),
                }
            }
        }

        #[test]
        fn rays_at_corners_and_edges_of_a_soup_are_the_same_by_any_way(
            corners in prop::collection::vec(corner(1.0), 12), picks in prop::collection::vec(0u32..12, 30),
        ) {
            // Ten random faces share twelve corners: many shared edges and corners, slivers and overlaps.
            let faces: Vec<[u32; 3]> = picks.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect();
            let Ok(soup) = TriMesh::from_faces(corners.clone(), faces) else { return Ok(()) };
            let middle = corners[1].lerp(corners[2], 0.5);
            for origin in [dvec3(0.1, -0.2, 3.0), corners[0].as_dvec3(), middle.as_dvec3()] {
                check(&soup, origin, awkward(&soup, origin));
            }
        }

        #[test]
        fn slivers_do_not_throw_the_distance(
            a in corner(3.0), b in corner(3.0), s in 0.0..1.0f32, w in -1e-6..1e-6f32, t in 0.1..0.9f64,
        ) {
            let c = a.lerp(b, s) + vec3(w, -w, 2.0 * w);
            let Ok(sliver) = TriMesh::from_faces(vec![a, b, c], vec![[0, 1, 2]]) else { return Ok(()) };
            let origin = dvec3(0.3, 0.1, 9.0);
            let at = a.as_dvec3().lerp(b.as_dvec3(), t).lerp(c.as_dvec3(), 0.4);
            for hit in check(&sliver, origin, [at - origin]).into_iter().flatten() {
                prop_assert!((hit.t - 1.0).abs() < 1e-5, "{hit:?}");
            }
        }
    }
}
