//! Outlines of rooms: few corners, on walls.

use super::planes::Plane;
use super::scan::Scan;
use super::storey::pieces;
use s3d_geom::glam::{DVec2, dvec2};
use std::collections::BTreeMap;

/// Outlines keep within this distance of the cells, in cells.
const TOLERANCE: f64 = 1.8;

/// An edge lies on a wall if both ends are no farther from it than this, metres, …
const REACH_M: f64 = 0.15;

/// … and it is at least this long, metres.
const LEAST_EDGE_M: f64 = 0.2;

/// Parts of a room, and columns in it, are left out below this size, m².
const LEAST_M2: f64 = 0.4;

/// Returns the polygons that cover a set of cells together, without holes. A set with a hole, such as a
/// corridor around a yard, is cut along a line through the hole.
pub(super) fn outlines(scan: &Scan, cells: &[usize], walls: &[Plane]) -> Vec<Vec<[f64; 2]>> {
    let mut outlines = Vec::new();
    let mut open = vec![cells.to_vec()];
    while let Some(cells) = open.pop() {
        let mut is_in = vec![false; scan.grid.cells()];
        cells.iter().for_each(|cell| is_in[*cell] = true);
        for piece in pieces(scan, |cell| is_in[cell], |_, _| true) {
            if (piece.len() as f64) * scan.grid.cell_m2() < LEAST_M2 {
                continue;
            }
            let rings = rings(scan, &piece);
            let is_hole = |ring: &&Vec<DVec2>| area(ring) * scan.grid.cell_m2() <= -LEAST_M2;
            if let Some(hole) = rings.iter().find(is_hole) {
                let low = hole.iter().fold(f64::INFINITY, |low, corner| low.min(corner.x));
                let high = hole.iter().fold(f64::NEG_INFINITY, |high, corner| high.max(corner.x));
                let cut = low.midpoint(high).round() as usize;
                let (left, right) = piece.iter().partition(|cell| scan.grid.place(**cell)[0] < cut);
                open.extend([right, left]);
                continue;
            }
            let outer = rings.into_iter().max_by(|a, b| area(a).total_cmp(&area(b)));
            outlines.extend(outer.map(|outer| straightened(scan, &outer, walls)));
        }
    }
    outlines
}

/// Returns the rings around a connected set of cells, in cells of the plan: counter-clockwise around it, and
/// clockwise around its holes.
fn rings(scan: &Scan, cells: &[usize]) -> Vec<Vec<DVec2>> {
    let mut is_in = vec![false; scan.grid.cells()];
    cells.iter().for_each(|cell| is_in[*cell] = true);
    let holds = |x: isize, y: isize| {
        let (width, height) = (scan.grid.width as isize, scan.grid.height as isize);
        x >= 0 && y >= 0 && x < width && y < height && is_in[(y * width + x) as usize]
    };

    // From each corner, the edges that begin there, with the set on their left.
    let mut edges: BTreeMap<[isize; 2], Vec<[isize; 2]>> = BTreeMap::new();
    for &cell in cells {
        let [x, y] = scan.grid.place(cell).map(|v| v as isize);
        let sides = [
            ([x, y - 1], [x, y], [x + 1, y]),
            ([x + 1, y], [x + 1, y], [x + 1, y + 1]),
            ([x, y + 1], [x + 1, y + 1], [x, y + 1]),
            ([x - 1, y], [x, y + 1], [x, y]),
        ];
        for (next, from, to) in sides {
            if !holds(next[0], next[1]) {
                edges.entry(from).or_default().push(to);
            }
        }
    }

    let mut rings = Vec::new();
    while let Some((&start, _)) = edges.first_key_value() {
        let mut ring: Vec<DVec2> = Vec::new();
        let (mut at, mut came) = (start, [0, 0]);
        while let Some(ends) = edges.get_mut(&at) {
            // Where two cells touch in a corner, the walk turns left, so that they are not joined.
            let left = |to: &[isize; 2]| came[0] * (to[1] - at[1]) - came[1] * (to[0] - at[0]);
            let best = (0..ends.len()).max_by_key(|place| left(&ends[*place])).unwrap_or(0);
            let to = ends.swap_remove(best);
            if ends.is_empty() {
                edges.remove(&at);
            }
            ring.push(dvec2(at[0] as f64, at[1] as f64));
            came = [to[0] - at[0], to[1] - at[1]];
            at = to;
        }
        rings.push(ring);
    }
    rings
}

/// Returns the area of a ring: positive if it runs counter-clockwise.
fn area(ring: &[DVec2]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    0.5 * ring.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>()
}

/// Turns a ring along cells into an outline with few corners, on walls where there are walls.
fn straightened(scan: &Scan, ring: &[DVec2], walls: &[Plane]) -> Vec<[f64; 2]> {
    let grid = &scan.grid;
    let corners: Vec<DVec2> = simplified(ring)
        .into_iter()
        .map(|corner| grid.low + corner * grid.step_m)
        .collect();
    let snapped = snapped(&corners, walls);
    // Walls that cross each other somewhere else would spoil the outline.
    let [before, after] = [area(&corners), area(&snapped)];
    let is_sound = snapped.len() >= 3 && (after / before - 1.0).abs() < 0.15;
    let best = if is_sound { snapped } else { corners };
    best.into_iter().map(|corner| corner.to_array()).collect()
}

/// Leaves out corners of a ring that are near the line between others (Douglas and Peucker, "Algorithms for
/// the reduction of the number of points required to represent a digitized line", 1973).
fn simplified(ring: &[DVec2]) -> Vec<DVec2> {
    let far = |from: usize| {
        (0..ring.len()).max_by(|a, b| {
            let distance = |place: usize| ring[place].distance_squared(ring[from]);
            distance(*a).total_cmp(&distance(*b)).then(b.cmp(a))
        })
    };
    // The ends of a longest line are corners.
    let Some(start) = far(0) else { return Vec::new() };
    let Some(middle) = far(start) else { return Vec::new() };
    let turned: Vec<DVec2> = ring[start..].iter().chain(&ring[..=start]).copied().collect();
    let middle = (middle + ring.len() - start) % ring.len();

    let mut is_kept = vec![false; turned.len()];
    is_kept[0] = true;
    is_kept[middle] = true;
    let mut open = vec![[0, middle], [middle, turned.len() - 1]];
    while let Some([from, to]) = open.pop() {
        let along = (turned[to] - turned[from]).normalize_or_zero();
        let distance = |place: usize| (turned[place] - turned[from]).perp_dot(along).abs();
        let worst = (from + 1..to).max_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        if let Some(worst) = worst.filter(|worst| distance(*worst) > TOLERANCE) {
            is_kept[worst] = true;
            open.extend([[from, worst], [worst, to]]);
        }
    }
    (0..ring.len())
        .filter(|place| is_kept[*place])
        .map(|place| turned[place])
        .collect()
}

/// A line of the plan: a point and the direction.
#[derive(Clone, Copy)]
struct Line {
    point: DVec2,
    along: DVec2,
}

impl Line {
    fn nearest(self, place: DVec2) -> DVec2 {
        self.point + self.along * self.along.dot(place - self.point)
    }

    fn distance(self, place: DVec2) -> f64 {
        (place - self.point).perp_dot(self.along).abs()
    }
}

/// Moves edges onto the walls beside them.
fn snapped(corners: &[DVec2], walls: &[Plane]) -> Vec<DVec2> {
    let count = corners.len();
    let lines: Vec<Option<Line>> = (0..count)
        .map(|place| {
            let (a, b) = (corners[place], corners[(place + 1) % count]);
            let along = (b - a).normalize_or_zero();
            let on = walls.iter().filter_map(|wall| {
                let normal = wall.normal.truncate();
                let line = Line {
                    point: normal * (wall.offset_m / normal.length_squared()),
                    along: normal.perp().normalize_or_zero(),
                };
                let farthest = line.distance(a).max(line.distance(b));
                let is_on = line.along.dot(along).abs() > 0.95 && farthest <= REACH_M;
                (is_on && a.distance(b) >= LEAST_EDGE_M).then_some((farthest, line))
            });
            on.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, line)| line)
        })
        .collect();

    let mut moved: Vec<DVec2> = Vec::with_capacity(count);
    for place in 0..count {
        let corner = corners[place];
        let before = (place + count - 1) % count;
        let own = |edge: usize| Line {
            point: corners[edge],
            along: (corners[(edge + 1) % count] - corners[edge]).normalize_or_zero(),
        };
        let [from, to] = [before, place].map(|edge| lines[edge].unwrap_or_else(|| own(edge)));
        let turn = from.along.perp_dot(to.along);
        let meet = from.point + from.along * ((to.point - from.point).perp_dot(to.along) / turn);
        if turn.abs() > 0.3 && meet.distance(corner) < 0.4 {
            moved.push(meet);
        } else {
            moved.extend([from, to].map(|line| line.nearest(corner)));
        }
    }

    // Corners on a straight line are none.
    let count = moved.len();
    let is_corner = |place: &usize| {
        let [a, b, c] = [count - 1, 0, 1].map(|step| moved[(place + step) % count]);
        let [in_, out] = [(b - a).normalize_or_zero(), (c - b).normalize_or_zero()];
        a.distance(b) > 1e-3 && (in_.perp_dot(out).abs() > 0.02 || in_.dot(out) < 0.0)
    };
    (0..count).filter(is_corner).map(|place| moved[place]).collect()
}
