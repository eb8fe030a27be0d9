//! The floor outline of a room, from its points.
//!
//! The outline is an alpha shape (Edelsbrunner, Kirkpatrick and Seidel, "On the shape of a set of points in
//! the plane", 1983): the triangles of a Delaunay triangulation whose circumscribed circle is small. It
//! follows corners and pillars but closes the gaps under furniture.

use super::polygon::Polygon;
use super::triangulation::{edges, signed_area};
use glam::{DVec2, Vec2, Vec3, dvec2};
use spade::handles::{DirectedEdgeHandle, FaceHandle, InnerTag};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// The parameters of a footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FootprintOptions {
    /// The width of the cells of a square grid, in metres. Each cell keeps a few of its points.
    pub cell_m: f64,
    /// The largest radius of the circumscribed circle of a triangle of the floor, in metres. Gaps up to twice
    /// as wide are closed. A corner that juts into the room is cut off where the circle touches its sides; a
    /// right angle loses half the square of the radius.
    pub alpha_m: f64,
}

impl Default for FootprintOptions {
    /// Cells of 5 cm and a radius of half a metre.
    fn default() -> Self {
        Self { cell_m: 0.05, alpha_m: 0.5 }
    }
}

/// Collects any number of points of a room, and draws the footprint of the room.
///
/// Memory grows with the area of the floor, not with the number of points. The order of the points does not
/// matter.
///
/// ```
/// use s3d_geom::{FootprintBuilder, FootprintOptions, glam::vec3};
///
/// let mut builder = FootprintBuilder::new(FootprintOptions::default());
/// for i in 0..=40 {
///     for j in 0..=50 {
///         builder.add(vec3(i as f32 * 0.1, j as f32 * 0.1, 0.0));
///     }
/// }
/// let footprint = builder.finish();
/// assert!((footprint.area_m2 - 20.0).abs() < 1e-3);
/// assert!(footprint.contains(1.0, 1.0) && !footprint.contains(5.0, 1.0));
/// ```
#[derive(Clone, Debug)]
pub struct FootprintBuilder {
    options: FootprintOptions,
    /// For each grid cell with a point, its place in `cells`.
    index: HashMap<[i64; 2], usize, BuildHasherDefault<CellHasher>>,
    cells: Vec<Cell>,
    /// The cell of the last point. The next point is often in the same cell.
    last: Option<([i64; 2], usize)>,
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    /// The outermost points: left, right, down and up.
    outermost: [Vec2; 4],
    /// The lowest and the highest z.
    heights: [f32; 2],
}

impl Cell {
    fn add(&mut self, p: Vec2, z: f32) {
        self.heights = [self.heights[0].min(z), self.heights[1].max(z)];
        // The other coordinate breaks ties, so that the order of points does not matter.
        let by_x = (p.x, p.y);
        let by_y = (p.y, p.x);
        let [left, right, down, up] = &mut self.outermost;
        if by_x < (left.x, left.y) {
            *left = p;
        }
        if by_x > (right.x, right.y) {
            *right = p;
        }
        if by_y < (down.y, down.x) {
            *down = p;
        }
        if by_y > (up.y, up.x) {
            *up = p;
        }
    }
}

/// Hashes a grid cell with one multiplication per coordinate. It is fast, for clouds of hundreds of millions
/// of points. It need not resist attacks, since nobody gains from colliding cells.
#[derive(Clone, Copy, Debug, Default)]
struct CellHasher(u64);

impl Hasher for CellHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks::<8>();
        let words = words.iter().map(|w| u64::from_ne_bytes(*w));
        for word in words.chain(rest.iter().map(|b| u64::from(*b))) {
            let product = u128::from(self.0.rotate_left(32) ^ word) * u128::from(0x9e37_79b9_7f4a_7c15_u64);
            self.0 = product as u64 ^ (product >> 64) as u64;
        }
    }

    // Ignores the length of a key, which is the same for all.
    fn write_usize(&mut self, _length: usize) {}
}

impl FootprintBuilder {
    /// Starts without points.
    ///
    /// # Panics
    /// If an option is not a positive, finite length.
    pub fn new(options: FootprintOptions) -> Self {
        for length in [options.cell_m, options.alpha_m] {
            assert!(length > 0.0 && length.is_finite(), "a length of {length} m");
        }
        Self { options, index: HashMap::default(), cells: Vec::new(), last: None }
    }

    /// Adds a point of the room, in world metres, at any height. A point that is not finite is left out.
    pub fn add(&mut self, point: Vec3) {
        if !point.is_finite() {
            return;
        }
        // Adding 0 turns −0 into 0.
        let p = point.truncate() + Vec2::ZERO;
        let key = [p.x, p.y].map(|c| (f64::from(c) / self.options.cell_m).floor() as i64);
        let cell = match self.last {
            Some((last, cell)) if last == key => cell,
            _ => *self.index.entry(key).or_insert_with(|| {
                self.cells.push(Cell { outermost: [p; 4], heights: [point.z; 2] });
                self.cells.len() - 1
            }),
        };
        self.last = Some((key, cell));
        self.cells[cell].add(p, point.z);
    }

    /// Returns the grid cells with a point, in no particular order: the cell's number along x and y, and the
    /// lowest and highest z of its points, metres. Cell (i, j) begins at (i, j) times
    /// [`cell_m`](FootprintOptions::cell_m).
    pub fn columns(&self) -> impl Iterator<Item = ([i64; 2], [f32; 2])> {
        self.index.iter().map(|(key, cell)| (*key, self.cells[*cell].heights))
    }

    /// Draws the footprint of the points so far.
    pub fn finish(&self) -> Footprint {
        let mut points: Vec<Vec2> = Vec::with_capacity(2 * self.cells.len());
        for (&[i, j], &cell) in &self.index {
            let outermost = self.cells[cell].outermost;
            // The outline runs through cells with an empty neighbour. For the others one point is enough.
            let is_surrounded = (-1..=1)
                .flat_map(|di| (-1..=1).map(move |dj| [i.saturating_add(di), j.saturating_add(dj)]))
                .all(|neighbor| self.index.contains_key(&neighbor));
            points.extend(&outermost[..if is_surrounded { 1 } else { 4 }]);
        }
        points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        points.dedup();
        alpha_shape(&points, self.options.alpha_m)
    }
}

/// The floor of a room, seen from above.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Footprint {
    /// The connected parts, in world x and y, metres. Outer rings run counter-clockwise, holes clockwise.
    /// Each ring starts with its smallest corner by (x, y). Parts and holes are sorted by that corner.
    pub polygons: Vec<Polygon>,
    /// The area in m².
    pub area_m2: f64,
}

impl Footprint {
    /// Returns true if the place (x, y) is on the floor.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        self.polygons.iter().any(|p| p.contains(dvec2(x, y)))
    }

    /// Returns the distance of the place (x, y) from the floor, in metres: 0 on the floor, infinite if there
    /// is no floor.
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        self.polygons
            .iter()
            .map(|p| p.distance(dvec2(x, y)))
            .fold(f64::INFINITY, f64::min)
    }
}

/// A point of the triangulation that keeps its exact place.
#[derive(Clone, Copy, Debug)]
struct Site(DVec2);

impl HasPosition for Site {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        spade::mitigate_underflow(Point2::new(self.0.x, self.0.y))
    }
}

type Edge<'a> = DirectedEdgeHandle<'a, Site, (), (), ()>;
type Face<'a> = FaceHandle<'a, InnerTag, Site, (), (), ()>;

/// Returns the alpha shape of finite points without duplicates.
fn alpha_shape(points: &[Vec2], alpha: f64) -> Footprint {
    let sites = points.iter().map(|p| Site(p.as_dvec2())).collect();
    // This cannot fail: coordinates are finite `f32`, and none lies between 0 and the smallest that spade
    // takes.
    let Ok(delaunay) = DelaunayTriangulation::<Site>::bulk_load(sites) else {
        return Footprint::default();
    };
    let is_floor: Vec<bool> = delaunay
        .all_faces()
        .map(|f| f.as_inner().is_some_and(|f| circumradius(f) <= alpha))
        .collect();
    let (part_of, parts) = connected_parts(&delaunay, &is_floor);

    let mut polygons = vec![Polygon::default(); parts];
    let mut is_traced = vec![false; delaunay.num_directed_edges()];
    for start in delaunay.directed_edges().filter(|&edge| is_border(edge, &is_floor)) {
        let Some(part) = part_of[start.face().index()].filter(|_| !is_traced[start.fix().index()]) else {
            continue;
        };
        for ring in simple_rings(border_walk(start, &is_floor, &mut is_traced)) {
            // A connected part has one ring around it. Its other rings are holes.
            if signed_area(&ring) > 0.0 {
                polygons[part].outer = ring;
            } else {
                polygons[part].holes.push(ring);
            }
        }
    }

    for polygon in &mut polygons {
        polygon.holes.sort_unstable_by(|a, b| by_place(a[0], b[0]));
    }
    polygons.sort_unstable_by(|a, b| by_place(a.outer[0], b.outer[0]));

    // The sum starts from 0, since `sum` of nothing is −0.
    let area_m2 = polygons.iter().map(Polygon::area).fold(0.0, |sum, area| sum + area);
    Footprint { polygons, area_m2 }
}

/// Finds the connected parts of the floor. Returns the part of each face, and the number of parts.
fn connected_parts(delaunay: &DelaunayTriangulation<Site>, is_floor: &[bool]) -> (Vec<Option<usize>>, usize) {
    let mut part_of: Vec<Option<usize>> = vec![None; delaunay.num_all_faces()];
    let mut parts = 0;
    for start in delaunay.inner_faces() {
        if !is_floor[start.index()] || part_of[start.index()].is_some() {
            continue;
        }

        let mut todo = vec![start];
        while let Some(face) = todo.pop() {
            if part_of[face.index()].replace(parts).is_none() {
                let neighbors = face.adjacent_edges().map(|edge| edge.rev().face());
                let on_floor = neighbors.into_iter().filter(|f| is_floor[f.index()]);
                todo.extend(
                    on_floor
                        .filter_map(|f| f.as_inner())
                        .filter(|f| part_of[f.index()].is_none()),
                );
            }
        }
        parts += 1;
    }
    (part_of, parts)
}

/// Returns true if the floor is on the left of the edge and not on its right.
fn is_border(edge: Edge<'_>, is_floor: &[bool]) -> bool {
    is_floor[edge.face().index()] && !is_floor[edge.rev().face().index()]
}

/// Follows the border of the floor from the edge `start` until it closes. Marks its edges in `is_traced`.
fn border_walk(start: Edge<'_>, is_floor: &[bool], is_traced: &mut [bool]) -> Vec<DVec2> {
    let mut walk = Vec::new();
    let mut edge = start;
    while !std::mem::replace(&mut is_traced[edge.fix().index()], true) {
        walk.push(edge.from().data().0);

        // Turn around the end of the edge, across the floor on its left, to the next border.
        edge = edge.next();
        while !is_border(edge, is_floor) {
            edge = edge.rev().next();
        }
    }
    walk
}

/// Cuts a closed walk into rings that pass no place twice. Each ring starts with its smallest corner.
fn simple_rings(walk: Vec<DVec2>) -> Vec<Vec<DVec2>> {
    let mut rings = Vec::new();
    let mut open: Vec<DVec2> = Vec::with_capacity(walk.len());
    let mut place_of: HashMap<[u64; 2], usize> = HashMap::with_capacity(walk.len());

    for p in walk {
        if let Some(&place) = place_of.get(&bits(p)) {
            let ring = open.split_off(place);
            for &q in &ring {
                place_of.remove(&bits(q));
            }
            rings.push(ring);
        }
        place_of.insert(bits(p), open.len());
        open.push(p);
    }
    rings.push(open);

    for ring in &mut rings {
        let smallest = (0..ring.len()).min_by(|&i, &j| by_place(ring[i], ring[j])).unwrap_or(0);
        ring.rotate_left(smallest);
    }
    rings
}

fn bits(p: DVec2) -> [u64; 2] {
    [p.x.to_bits(), p.y.to_bits()]
}

fn by_place(a: DVec2, b: DVec2) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
}

fn circumradius(face: Face<'_>) -> f64 {
    let corners = face.vertices().map(|v| v.data().0);
    let lengths: f64 = edges(&corners).map(|(a, b)| a.distance(b)).product();
    lengths / (4.0 * signed_area(&corners).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    /// Returns pseudo-random numbers in [0, 1).
    fn random(seed: u64) -> impl Iterator<Item = f64> {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        std::iter::repeat_with(move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        })
    }

    /// Returns random points over [0, size]² for which `keep` is true, as dense as a scan (2,500 per square
    /// metre).
    fn scan(size: f64, keep: impl Fn(f64, f64) -> bool) -> Vec<Vec3> {
        let n = (size * size * 2500.0) as usize;
        let mut numbers = random(7);
        let mut number = || numbers.next().unwrap();
        (0..n)
            .map(|_| (number() * size, number() * size, number() * 3.0))
            .filter(|&(x, y, _)| keep(x, y))
            .map(|(x, y, z)| vec3(x as f32, y as f32, z as f32))
            .collect()
    }

    fn footprint(points: &[Vec3]) -> Footprint {
        let mut builder = FootprintBuilder::new(FootprintOptions::default());
        points.iter().for_each(|&p| builder.add(p));
        builder.finish()
    }

    /// Checks the properties of every footprint.
    fn check_form(f: &Footprint) {
        assert!((f.polygons.iter().map(Polygon::area).sum::<f64>() - f.area_m2).abs() < 1e-12);
        for polygon in &f.polygons {
            assert!(signed_area(&polygon.outer) > 0.0);
            assert!(polygon.holes.iter().all(|hole| signed_area(hole) < 0.0));
            for ring in std::iter::once(&polygon.outer).chain(&polygon.holes) {
                assert!(ring.iter().all(|&p| by_place(ring[0], p).is_le()));
                assert!(f.distance(ring[0].x, ring[0].y) == 0.0);
            }
            assert!(polygon.holes.is_sorted_by(|a, b| by_place(a[0], b[0]).is_le()));
            let covered = polygon.triangulate().expect("rings that are simple and nested");
            assert!(covered.len() >= polygon.outer.len() - 2);
        }
        assert!(f.polygons.is_sorted_by(|a, b| by_place(a.outer[0], b.outer[0]).is_le()));
    }

    #[test]
    fn a_rectangle_of_20_square_metres() {
        let f = footprint(&scan(5.0, |x, _| x <= 4.0));
        check_form(&f);
        assert_eq!((f.polygons.len(), f.polygons[0].holes.len()), (1, 0));
        assert!((f.area_m2 - 20.0).abs() < 0.2, "{}", f.area_m2);
        assert!(f.contains(2.0, 2.5) && !f.contains(4.2, 2.5));
        assert!((f.distance(4.5, 2.5) - 0.5).abs() < 0.03);
    }

    #[test]
    fn a_turned_rectangle_far_from_the_origin() {
        let (s, c) = libm::sincosf(0.6);
        let turned: Vec<Vec3> = scan(5.0, |x, _| x <= 4.0)
            .iter()
            .map(|p| vec3(c * p.x - s * p.y - 80.0, s * p.x + c * p.y + 120.0, p.z))
            .collect();
        let f = footprint(&turned);
        check_form(&f);
        assert!((f.area_m2 - 20.0).abs() < 0.2, "{}", f.area_m2);
    }

    #[test]
    fn an_l_keeps_its_inner_corner() {
        let f = footprint(&scan(6.0, |x, y| x <= 2.0 || y <= 2.0));
        check_form(&f);
        // The inner corner loses α²/2 = 0.125 m².
        assert!((f.area_m2 - 20.0).abs() < 0.2, "{}", f.area_m2);
        assert!(!f.contains(2.5, 2.5) && f.contains(1.9, 5.0));
    }

    #[test]
    fn a_corridor_around_a_block_has_a_hole() {
        let f = footprint(&scan(6.0, |x, y| !(2.0..4.0).contains(&x) || !(1.5..4.5).contains(&y)));
        check_form(&f);
        assert_eq!((f.polygons.len(), f.polygons[0].holes.len()), (1, 1));
        // Four corners of the block are cut off.
        assert!((f.area_m2 - 30.5).abs() < 0.15, "{}", f.area_m2);
        assert!(!f.contains(3.0, 3.0) && (f.distance(3.0, 3.0) - 1.0).abs() < 0.03);
    }

    #[test]
    fn gaps_narrower_than_the_circle_are_closed() {
        let f = footprint(&scan(4.0, |x, y| (x - 2.0).abs() > 0.3 || (y - 2.0).abs() > 0.3));
        assert_eq!(f.polygons[0].holes.len(), 0);
        assert!((f.area_m2 - 16.0).abs() < 0.16, "{}", f.area_m2);
    }

    #[test]
    fn two_patches() {
        let f = footprint(&scan(6.0, |x, y| y < 3.0 && !(2.0..4.0).contains(&x)));
        check_form(&f);
        assert_eq!(f.polygons.len(), 2);
        assert!(f.polygons[0].outer[0].x < 0.1 && f.polygons[1].outer[0].x > 3.9);
        assert!((f.area_m2 - 12.0).abs() < 0.12, "{}", f.area_m2);
        assert!((f.distance(3.0, 1.0) - 1.0).abs() < 0.03);
    }

    #[test]
    fn too_little_for_an_area() {
        let line: Vec<Vec3> = (0..100).map(|i| vec3(i as f32 * 0.1, i as f32 * 0.1, 1.0)).collect();
        for points in [&[][..], &[Vec3::ONE], &[Vec3::ONE; 9], &[Vec3::ZERO, Vec3::X * 0.2], &line] {
            let f = footprint(points);
            assert_eq!(f, Footprint::default());
            assert!(!f.contains(1.0, 1.0) && f.distance(1.0, 1.0) == f64::INFINITY);
        }
        let odd = [vec3(f32::NAN, 0.0, 0.0), vec3(0.0, f32::INFINITY, 0.0)];
        assert_eq!(footprint(&odd), Footprint::default());
    }

    #[test]
    fn coordinates_as_large_and_small_as_they_go() {
        let far = [vec3(3e38, 3e38, 0.0), vec3(-3e38, 3e38, 0.0), vec3(0.0, -3e38, 0.0)];
        assert_eq!(footprint(&far), Footprint::default());
        let tiny =
            [vec3(1e-45, 1e-42, 0.0), vec3(-1e-44, 1e-45, 0.0), vec3(0.2, 0.0, 0.0), vec3(0.0, 0.2, 0.0)];
        assert!((footprint(&tiny).area_m2 - 0.02).abs() < 1e-6);
    }

    fn places(points: &[[f64; 2]]) -> Vec<DVec2> {
        points.iter().map(|&[x, y]| dvec2(x, y)).collect::<Vec<_>>()
    }

    #[test]
    fn rings_that_touch_are_parted() {
        // One walk around a square and around a hole that touches its corner (1, 1).
        let walk =
            places(&[[1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.6, 0.2], [0.2, 0.6]]);
        assert_eq!(
            simple_rings(walk),
            [
                places(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
                places(&[[0.2, 0.6], [1.0, 1.0], [0.6, 0.2]]),
            ]
        );
    }

    #[test]
    #[should_panic(expected = "a length of 0 m")]
    fn cells_without_width_are_a_callers_mistake() {
        let _ = FootprintBuilder::new(FootprintOptions { cell_m: 0.0, ..FootprintOptions::default() });
    }

    proptest! {
        /// The points are on a coarse lattice, where shapes touch in corners and circles pass through many
        /// points.
        #[test]
        fn any_points_make_sound_polygons(places in prop::collection::vec((0..14u8, 0..14u8), 0..120)) {
            let points: Vec<Vec3> =
                places.iter().map(|&(x, y)| vec3(f32::from(x) * 0.25, f32::from(y) * 0.25, 0.0)).collect();
            let mut builder = FootprintBuilder::new(FootprintOptions { cell_m: 0.05, alpha_m: 0.2 });
            points.iter().for_each(|&p| builder.add(p));
            check_form(&builder.finish());
        }

        #[test]
        fn the_order_of_points_does_not_matter(
            points in Just(scan(1.5, |x, y| x + y < 2.0)).prop_shuffle(),
        ) {
            prop_assert_eq!(footprint(&points), footprint(&scan(1.5, |x, y| x + y < 2.0)));
        }
    }
}
