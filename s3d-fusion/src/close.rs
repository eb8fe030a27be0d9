//! Closes small holes in floors, walls and other flat surfaces, along their plane.
//!
//! A hole is a loop of border edges. It is closed only if all around it is flat and nothing is in it, so that
//! the plane goes on where the scanner saw nothing. No other hole is closed: what lies behind it is unknown.

use crate::columns::{ColumnsError, MeshColumns};
use s3d_geom::glam::{DMat3, DVec2, DVec3, Vec3};
use s3d_geom::triangulate_face;
use thiserror::Error;

/// Which holes are closed.
#[derive(Clone, Debug, PartialEq)]
pub struct CloseOptions {
    /// The largest distance between two corners of a hole, metres.
    pub max_m: f32,
    /// The largest distance of a vertex around a hole from the plane, metres. Around a hole is what two rings
    /// of faces have.
    pub max_residual_m: f32,
    /// Nine tenths of the area around a hole must look along the plane's normal up to this angle, radians.
    pub max_angle_rad: f32,
}

impl Default for CloseOptions {
    fn default() -> Self {
        Self { max_m: 0.3, max_residual_m: 0.01, max_angle_rad: 0.4 }
    }
}

/// The loops of border edges that stay open, by the first reason found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OpenLoops {
    /// Larger than asked for.
    pub too_large: usize,
    /// The surroundings are not flat: corners, edges of things, open boxes.
    pub not_flat: usize,
    /// The outer border of a surface: it runs around the surface, not around a hole.
    pub outer: usize,
    /// Something lies in the hole.
    pub occupied: usize,
    /// The loop touches or crosses itself or another one, or a new edge would join more than two faces.
    pub tangled: usize,
}

/// A mesh with its flat holes closed, made by [`close_holes`]. The vertices stay as they are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClosedHoles {
    /// The old faces, then the new ones. The new ones join vertices of the border, and so have its colours.
    pub faces: Vec<[u32; 3]>,
    /// For each face, whether it closes a hole.
    pub is_closing: Vec<bool>,
    /// The number of holes that were closed.
    pub closed: usize,
    /// The area of the new faces, m².
    pub area_m2: f64,
    /// The loops that stay open.
    pub open: OpenLoops,
}

/// The reason why no hole is closed.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CloseError {
    /// The columns are not a mesh.
    #[error(transparent)]
    Columns(#[from] ColumnsError),
    /// An option is negative or not a number.
    #[error("{what} is {value}: give a number that is not negative")]
    Option {
        /// What the option is.
        what: &'static str,
        /// Its value.
        value: f32,
    },
}

/// A loop with more corners is not closed, since [`triangulate_face`] takes no more.
const MOST_CORNERS: usize = 1 << 14;

/// The share of the area around a hole that must look along the normal.
const FLAT_SHARE: f64 = 0.9;

/// Closes holes of at most [`CloseOptions::max_m`] whose surroundings lie in a plane.
///
/// The outer border of a surface stays, such as the edge of a table. So does a hole over a corner, the open
/// side of a box, and a hole with a vertex of the mesh in it, near its plane. A doorway in a bare wall is a
/// hole like any other: only its size tells it from a gap.
///
/// ```
/// use s3d_fusion::{CloseOptions, MeshColumns, close_holes};
/// use s3d_geom::{glam::Vec3, primitives::grid};
///
/// // A floor of 5 m in cells of 10 cm lacks one of them.
/// let mut floor = grid(Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0, [50, 50]);
/// floor.faces.drain(2450..2452);
/// let columns = MeshColumns { positions: &floor.positions, faces: &floor.faces, colors: &[] };
/// let closed = close_holes(&columns, &CloseOptions::default())?;
/// assert_eq!((closed.closed, closed.faces.len()), (1, 5000));
/// assert_eq!((closed.area_m2 * 1e4).round(), 100.0);
/// assert_eq!(closed.open.too_large, 1, "the border of the floor");
/// # Ok::<(), s3d_fusion::CloseError>(())
/// ```
///
/// # Errors
/// [`CloseError`] for columns that are not a mesh, and options that are negative or not a number.
pub fn close_holes(mesh: &MeshColumns<'_>, options: &CloseOptions) -> Result<ClosedHoles, CloseError> {
    mesh.check()?;
    let numbers = [
        ("the largest hole", options.max_m),
        ("the largest distance from the plane", options.max_residual_m),
        ("the largest angle", options.max_angle_rad),
    ];
    if let Some((what, value)) = numbers.into_iter().find(|(_, v)| !v.is_finite() || *v < 0.0) {
        return Err(CloseError::Option { what, value });
    }

    let mut closed = ClosedHoles { faces: mesh.faces.to_vec(), ..ClosedHoles::default() };
    let surface = Surface::new(mesh);
    let (loops, tangled) = surface.loops();
    closed.open.tangled = tangled;
    let mut new_edges = Vec::new();
    for corners in loops {
        match surface.closing(&corners, options, &mut new_edges) {
            Ok(faces) => {
                closed.closed += 1;
                closed.area_m2 += faces.iter().map(|f| 0.5 * surface.cross(f).length()).sum::<f64>();
                closed.faces.extend(faces);
            }
            Err(Reason::TooLarge) => closed.open.too_large += 1,
            Err(Reason::NotFlat) => closed.open.not_flat += 1,
            Err(Reason::Outer) => closed.open.outer += 1,
            Err(Reason::Occupied) => closed.open.occupied += 1,
            Err(Reason::Tangled) => closed.open.tangled += 1,
        }
    }
    closed.is_closing = (0..closed.faces.len()).map(|face| face >= mesh.faces.len()).collect();
    Ok(closed)
}

/// Why a loop stays open.
enum Reason {
    TooLarge,
    NotFlat,
    Outer,
    Occupied,
    Tangled,
}

/// A mesh with who is next to whom.
struct Surface<'a> {
    positions: &'a [Vec3],
    faces: &'a [[u32; 3]],
    /// All edges as their faces run along them, ascending.
    edges: Vec<[u32; 2]>,
    /// Pairs of a vertex and a face around it, ascending.
    fans: Vec<(u32, u32)>,
    /// The vertices that faces use, by x.
    by_x: Vec<u32>,
}

impl<'a> Surface<'a> {
    fn new(mesh: &MeshColumns<'a>) -> Self {
        let (positions, faces) = (mesh.positions, mesh.faces);
        let mut edges: Vec<[u32; 2]> = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        edges.sort_unstable();
        let all = (0..).zip(faces);
        let mut fans: Vec<(u32, u32)> = all.flat_map(|(face, f)| f.map(|v| (v, face))).collect();
        fans.sort_unstable();

        let mut by_x: Vec<u32> = fans.chunk_by(|a, b| a.0 == b.0).map(|fan| fan[0].0).collect();
        by_x.sort_by(|&a, &b| positions[a as usize].x.total_cmp(&positions[b as usize].x));
        Self { positions, faces, edges, fans, by_x }
    }

    fn at(&self, vertex: u32) -> DVec3 {
        self.positions[vertex as usize].as_dvec3()
    }

    /// Twice the area of a face, along its normal.
    fn cross(&self, face: &[u32; 3]) -> DVec3 {
        let [a, b, c] = face.map(|v| self.at(v));
        (b - a).cross(c - a)
    }

    fn fan(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        let begin = self.fans.partition_point(|f| f.0 < vertex);
        self.fans[begin..]
            .iter()
            .take_while(move |f| f.0 == vertex)
            .map(|f| f.1)
    }

    /// The loops of edges without a second face, each by its corners in the order of its faces, and the
    /// number of starts from which no loop returns: where borders touch.
    fn loops(&self) -> (Vec<Vec<u32>>, usize) {
        let is_border = |&[a, b]: &[u32; 2]| self.edges.binary_search(&[b, a]).is_err();
        let border: Vec<[u32; 2]> = self.edges.iter().filter(|e| is_border(e)).copied().collect();
        let mut is_seen = vec![false; border.len()];
        let (mut loops, mut tangled) = (Vec::new(), 0);

        for start in 0..border.len() {
            let (mut at, mut corners, mut is_clean) = (start, Vec::new(), true);
            while !std::mem::replace(&mut is_seen[at], true) {
                let [from, to] = border[at];
                corners.push(from);
                let next = border.partition_point(|e| e[0] < to);
                let ways = border[next..].iter().take_while(|e| e[0] == to).count();
                is_clean &= ways == 1;
                if ways == 0 {
                    break;
                }
                at = next;
            }
            match corners.is_empty() {
                true => {}
                false if is_clean && at == start => loops.push(corners),
                false => tangled += 1,
            }
        }
        (loops, tangled)
    }

    /// The faces that close a loop. Their new edges are added to `new_edges`.
    fn closing(
        &self,
        corners: &[u32],
        options: &CloseOptions,
        new_edges: &mut Vec<[u32; 2]>,
    ) -> Result<Vec<[u32; 3]>, Reason> {
        let places: Vec<Vec3> = corners.iter().map(|&v| self.positions[v as usize]).collect();
        if corners.len() > MOST_CORNERS || is_larger(&places, options.max_m) {
            return Err(Reason::TooLarge);
        }
        let plane = self.plane_around(corners, options).ok_or(Reason::NotFlat)?;

        // A surface lies to the left of its border, so a hole lies to the right.
        let ring: Vec<DVec2> = places.iter().map(|p| plane.flat(p.as_dvec3())).collect();
        let next = ring.iter().cycle().skip(1);
        if ring.iter().zip(next).map(|(p, q)| p.perp_dot(*q)).sum::<f64>() >= 0.0 {
            return Err(Reason::Outer);
        }
        if self.is_occupied(corners, &plane, &ring, options) {
            return Err(Reason::Occupied);
        }

        let backwards: Vec<Vec3> = places.iter().rev().copied().collect();
        let triangles = triangulate_face(&backwards).map_err(|_| Reason::Tangled)?;
        let vertex = |i: u32| corners[corners.len() - 1 - i as usize];
        let faces: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(vertex)).collect();

        // The edges within the hole must be nobody else's.
        let mut border: Vec<[u32; 2]> = corners
            .iter()
            .zip(corners.iter().cycle().skip(1))
            .map(|(&a, &b)| [b, a])
            .collect();
        border.sort_unstable();
        let edges = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let inner: Vec<[u32; 2]> = edges.filter(|e| border.binary_search(e).is_err()).collect();
        let is_taken = |e: &[u32; 2]| self.edges.binary_search(e).is_ok() || new_edges.contains(e);
        let looks_along = faces.iter().all(|f| self.cross(f).dot(plane.normal) > 0.0);
        if !looks_along || inner.iter().any(is_taken) {
            return Err(Reason::Tangled);
        }
        new_edges.extend(inner);
        Ok(faces)
    }

    /// The plane of the two rings of faces around a loop, if they are flat.
    fn plane_around(&self, corners: &[u32], options: &CloseOptions) -> Option<Plane> {
        let mut vertices = corners.to_vec();
        let mut faces = Vec::new();
        for _ in 0..2 {
            faces = vertices.iter().flat_map(|&v| self.fan(v)).collect();
            faces.sort_unstable();
            faces.dedup();
            vertices = faces.iter().flat_map(|&f| self.faces[f as usize]).collect();
            vertices.sort_unstable();
            vertices.dedup();
        }

        // The mean normal is oriented, and the plane of the least squares is exact.
        let crosses: Vec<DVec3> = faces.iter().map(|&f| self.cross(&self.faces[f as usize])).collect();
        let normal = crosses.iter().sum::<DVec3>().try_normalize()?;
        let middle = vertices.iter().map(|&v| self.at(v)).sum::<DVec3>() / vertices.len() as f64;
        let plane = Plane::new(middle, normal).fitted(vertices.iter().map(|&v| self.at(v)))?;

        let farthest = vertices
            .iter()
            .map(|&v| plane.height(self.at(v)).abs())
            .fold(0.0, f64::max);
        let cosine = libm::cos(f64::from(options.max_angle_rad));
        let along = crosses.iter().filter(|c| c.dot(plane.normal) >= cosine * c.length());
        let (along, all) =
            (along.map(|c| c.length()).sum::<f64>(), crosses.iter().map(|c| c.length()).sum::<f64>());
        let is_flat = farthest <= f64::from(options.max_residual_m) && along >= FLAT_SHARE * all;
        is_flat.then_some(plane)
    }

    /// Whether a vertex that is not of the loop lies in it, as near to the plane as what is flat may be.
    fn is_occupied(&self, corners: &[u32], plane: &Plane, ring: &[DVec2], options: &CloseOptions) -> bool {
        let xs = || corners.iter().map(|&v| self.positions[v as usize].x);
        let (least, most) = (xs().fold(f32::INFINITY, f32::min), xs().fold(f32::NEG_INFINITY, f32::max));
        let begin = self.by_x.partition_point(|&v| self.positions[v as usize].x < least);
        let near = self.by_x[begin..]
            .iter()
            .take_while(|&&v| self.positions[v as usize].x <= most);
        let mut own = corners.to_vec();
        own.sort_unstable();
        near.filter(|&&v| plane.height(self.at(v)).abs() <= f64::from(options.max_residual_m))
            .any(|&v| is_inside(ring, plane.flat(self.at(v))) && own.binary_search(&v).is_err())
    }
}

/// Whether two corners are farther apart than `max_m`.
fn is_larger(places: &[Vec3], max_m: f32) -> bool {
    // A quick answer for long loops, most of which are large.
    if places.iter().any(|p| p.distance(places[0]) > max_m) {
        return true;
    }
    (1..places.len()).any(|i| places[..i].iter().any(|p| p.distance(places[i]) > max_m))
}

/// Whether a ray from `p` along x crosses the ring an odd number of times.
fn is_inside(ring: &[DVec2], p: DVec2) -> bool {
    let edges = ring.iter().zip(ring.iter().cycle().skip(1));
    let crosses = |(a, b): &(&DVec2, &DVec2)| {
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    edges.filter(crosses).count() % 2 == 1
}

/// A plane with a frame in it.
struct Plane {
    middle: DVec3,
    normal: DVec3,
    axes: [DVec3; 2],
}

impl Plane {
    fn new(middle: DVec3, normal: DVec3) -> Self {
        let (u, v) = normal.any_orthonormal_pair();
        // Seen from the tip of the normal, the second axis is to the left of the first.
        let axes = if u.cross(v).dot(normal) > 0.0 { [u, v] } else { [v, u] };
        Self { middle, normal, axes }
    }

    /// The plane with the least squared heights of points; `None` if they are on a line.
    fn fitted(&self, points: impl Iterator<Item = DVec3>) -> Option<Self> {
        let (mut sums, mut right) = (DMat3::ZERO, DVec3::ZERO);
        for p in points {
            let row = self.flat(p).extend(1.0);
            sums += DMat3::from_cols(row * row.x, row * row.y, row);
            right += row * self.height(p);
        }
        let slopes = sums.inverse() * right;
        let normal = self.normal - slopes.x * self.axes[0] - slopes.y * self.axes[1];
        let middle = self.middle + slopes.z * self.normal;
        (slopes.is_finite()).then(|| Self::new(middle, normal.normalize()))
    }

    fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p - self.middle)
    }

    fn flat(&self, p: DVec3) -> DVec2 {
        DVec2::new(self.axes[0].dot(p - self.middle), self.axes[1].dot(p - self.middle))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::MeshParts;
    use s3d_geom::glam::vec3;
    use s3d_geom::primitives::grid;

    fn close(parts: &MeshParts, max_m: f32) -> ClosedHoles {
        let columns = MeshColumns { positions: &parts.positions, faces: &parts.faces, colors: &[] };
        close_holes(&columns, &CloseOptions { max_m, ..CloseOptions::default() }).unwrap()
    }

    /// Removes the faces whose middles pass.
    fn without(mut parts: MeshParts, goes: impl Fn(Vec3) -> bool) -> MeshParts {
        let middle = |f: &[u32; 3]| f.iter().map(|&v| parts.positions[v as usize]).sum::<Vec3>() / 3.0;
        let faces = parts.faces.iter().filter(|f| !goes(middle(f))).copied().collect();
        parts.faces = faces;
        parts
    }

    /// A wall of 2 m × 2 m in cells of 5 cm, with a relief of 2 mm. It looks along −Y.
    fn wall() -> MeshParts {
        let mut wall = grid(Vec3::ZERO, Vec3::X * 2.0, Vec3::Z * 2.0, [40, 40]);
        let heights = (0..wall.positions.len()).map(|i| ((i * 7919) % 13) as f32 / 13.0 * 0.002);
        let moved = heights.collect::<Vec<_>>();
        wall.positions.iter_mut().zip(moved).for_each(|(p, h)| p.y += h);
        wall
    }

    #[test]
    fn a_hole_in_a_wall_is_closed_along_the_wall() {
        let center = vec3(1.0, 0.0, 1.0);
        let holed = without(wall(), |p| p.distance(center) < 0.14 || p.distance(vec3(0.4, 0.0, 0.4)) < 0.1);
        let closed = close(&holed, 0.4);
        assert_eq!((closed.closed, closed.open), (2, OpenLoops { too_large: 1, ..OpenLoops::default() }));
        let first = holed.faces.len();
        assert_eq!(closed.faces[..first], holed.faces);
        assert!((0..).zip(&closed.is_closing).all(|(i, new)| *new == (i >= first)));

        // The surface is whole again: its area, one border, and each edge is run along once each way.
        let surface =
            Surface::new(&MeshColumns { positions: &holed.positions, faces: &closed.faces, colors: &[] });
        assert_eq!((surface.loops().0.len(), surface.loops().1), (1, 0));
        assert!(surface.edges.windows(2).all(|e| e[0] != e[1]));
        let area: f64 = closed.faces.iter().map(|f| -0.5 * surface.cross(f).y).sum();
        assert!((area - 4.0).abs() < 1e-4, "{area}");
        let new_area: f64 = closed.faces[first..]
            .iter()
            .map(|f| 0.5 * surface.cross(f).length())
            .sum();
        assert!((closed.area_m2 - new_area).abs() < 1e-9 && new_area > 0.06);

        // Too small a limit leaves both open.
        assert_eq!(close(&holed, 0.1).open.too_large, 3);
    }

    #[test]
    fn a_hole_over_a_corner_stays() {
        // Two walls that share an edge.
        let mut parts = wall();
        parts
            .positions
            .iter_mut()
            .filter(|p| p.x > 1.0)
            .for_each(|p| *p = vec3(1.0, 1.0 - p.x, p.z));
        let holed = without(parts, |p| p.distance(vec3(1.0, 0.0, 1.0)) < 0.14);
        let closed = close(&holed, 0.4);
        assert_eq!((closed.closed, closed.open.not_flat), (0, 1));
    }

    #[test]
    fn the_edge_of_a_table_and_the_top_of_a_box_stay() {
        let table = grid(Vec3::Z, Vec3::X * 0.2, Vec3::Y * 0.2, [8, 8]);
        let closed = close(&table, 1.0);
        assert_eq!((closed.closed, closed.open.outer), (0, 1));

        // A wall around 20 cm × 20 cm, bent at its corners; its ends meet.
        let mut tube = grid(Vec3::ZERO, Vec3::X * 0.8, Vec3::Z * 0.4, [16, 8]);
        let faces = tube
            .faces
            .iter()
            .map(|f| f.map(|v| if v % 17 == 16 { v - 16 } else { v }))
            .collect();
        tube.faces = faces;
        for p in &mut tube.positions {
            let along = p.x % 0.2;
            let xy = [(along, 0.0), (0.2, along), (0.2 - along, 0.2), (0.0, 0.2 - along)];
            let (x, y) = xy[((p.x + 1e-4) / 0.2) as usize % 4];
            *p = vec3(x, y, p.z);
        }
        let closed = close(&tube, 1.0);
        assert_eq!((closed.closed, closed.open.not_flat), (0, 2));
    }

    #[test]
    fn a_hole_with_something_in_it_stays() {
        let center = vec3(1.0, 0.0, 1.0);
        let holed = without(wall(), |p| (0.08..0.2).contains(&p.distance(center)));
        let closed = close(&holed, 0.5);
        assert_eq!((closed.closed, closed.open.occupied, closed.open.outer), (0, 1, 1), "{:?}", closed.open);
    }

    #[test]
    fn loops_that_touch_stay_and_bad_input_is_refused() {
        // Two holes that share a vertex.
        let holed = without(wall(), |p| {
            let cell = ((p.x / 0.05) as u32, (p.z / 0.05) as u32);
            cell == (10, 10) || cell == (11, 11)
        });
        let closed = close(&holed, 0.4);
        assert!(closed.closed == 0 && closed.open.tangled >= 1, "{:?}", closed.open);

        let columns = MeshColumns { positions: &[Vec3::ZERO], faces: &[[0, 1, 2]], colors: &[] };
        assert!(matches!(close_holes(&columns, &CloseOptions::default()), Err(CloseError::Columns(_))));
        let options = CloseOptions { max_m: f32::NAN, ..CloseOptions::default() };
        assert!(close_holes(&MeshColumns::default(), &options).is_err());
    }
}
