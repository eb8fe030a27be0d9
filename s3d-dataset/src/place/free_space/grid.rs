//! A grid of vertical lines, and the points where they meet surfaces.

use crate::error::{InputError, Result};
use glam::{DVec3, Vec3, dvec3};
use rayon::prelude::*;
use s3d_geom::TriMesh;
use std::ops::RangeInclusive;

/// The distance between the grid's lines, metres. It is larger if there is very much floor.
pub(super) const STEP_M: f64 = 0.1;

/// The largest distance between lines, metres. The balls of free space of diagonal neighbours, of radius 0.2
/// m, then just touch.
pub(super) const MOST_STEP_M: f64 = 0.28;

/// The number of feet above which the grid is made coarser.
const MANY_FEET: f64 = 400_000.0;

/// The number of feet on the coarsest grid above which nothing is placed. It means 300,000 m² of floors.
const MOST_FEET: f64 = 4_000_000.0;

/// The length of a mesh above which nothing is placed, metres.
const MOST_EXTENT_M: f64 = 20_000.0;

/// Layers of one floor, such as a rug on it, are one foot if they are nearer than this, metres.
const LAYER_M: f64 = 0.08;

/// A direction in the grid.
pub(super) type Side = (i32, i32);

/// A foot: the point where a grid line meets a surface that faces up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    pub(super) column: u64,
    pub(super) z: f64,
    pub(super) has_headroom: bool,
    /// Whether a person fits: free at the hips and above.
    pub(super) walkable: bool,
    /// The free space around, metres, up to the largest distance that is measured.
    pub(super) clearance_m: f32,
}

/// Returns all sides of a foot up to a distance of `lines`, and at least its neighbours.
pub(super) fn sides_within(lines: f64) -> Vec<Side> {
    let most = lines.floor().max(1.0) as i32;
    let all = (-most..=most).flat_map(|i| (-most..=most).map(move |j| (i, j)));
    all.filter(|side| *side != (0, 0))
        .filter(|(i, j)| f64::from(i * i + j * j) <= (lines * lines).max(2.0))
        .collect()
}

/// Vertical lines at equal distances. They are shifted off the round numbers on which modellers put edges.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    pub(super) origin: DVec3,
    pub(super) step: f64,
    columns: [u64; 2],
}

impl Grid {
    /// Builds a grid for `m2` of surface that faces up.
    ///
    /// # Errors
    /// Fails if the mesh is too large for locations to be placed.
    pub(super) fn new(mesh: &TriMesh, m2: f64) -> Result<Self> {
        let step = (m2 / MANY_FEET).sqrt().clamp(STEP_M, MOST_STEP_M);
        let size = mesh.aabb().size().as_dvec3();
        if m2 / (step * step) > MOST_FEET || size.x.max(size.y) > MOST_EXTENT_M {
            return Err(InputError::Unfit {
                path: "the mesh".into(),
                why: format!(
                    "is {:.0} × {:.0} m large, and {m2:.0} m² of it face up: that is too much to place \
                 scan locations on; is `units` right? If it is, list scan locations or split the scan",
                    size.x, size.y
                ),
            }
            .into());
        }

        let aabb = mesh.aabb();
        let min = aabb.min.as_dvec3();
        let columns = [size.x, size.y].map(|length| (length / step).ceil() as u64 + 1);
        Ok(Self { origin: min - dvec3(0.618, 0.382, 0.0) * step, step, columns })
    }

    /// Returns the length of the longer side, metres.
    pub(super) fn extent_m(&self) -> f64 {
        self.columns[0].max(self.columns[1]) as f64 * self.step
    }

    pub(super) fn at(&self, foot: &Foot) -> DVec3 {
        let [i, j] = self.indices(foot.column);
        dvec3(self.origin.x + i as f64 * self.step, self.origin.y + j as f64 * self.step, foot.z)
    }

    fn indices(&self, column: u64) -> [u64; 2] {
        [column / (self.columns[1] + 1), column % (self.columns[1] + 1)]
    }

    fn column(&self, i: u64, j: u64) -> u64 {
        i * (self.columns[1] + 1) + j
    }

    /// Returns the column at one side of another.
    pub(super) fn beside(&self, column: u64, side: Side) -> Option<u64> {
        let [i, j] = self.indices(column);
        let i = i.checked_add_signed(side.0.into()).filter(|&i| i <= self.columns[0])?;
        let j = j.checked_add_signed(side.1.into()).filter(|&j| j <= self.columns[1])?;
        Some(self.column(i, j))
    }

    /// Returns the feet on some faces, none of them upright. Layers of one floor are one foot, at the
    /// highest.
    pub(super) fn feet(&self, mesh: &TriMesh, faces: &[u32]) -> Vec<Foot> {
        let mut all: Vec<(u64, f64)> = faces
            .par_iter()
            .flat_map_iter(|&face| self.meetings(mesh.triangle(face)))
            .collect();
        all.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));

        let mut feet: Vec<Foot> = Vec::new();
        for (column, z) in all {
            match feet.last_mut() {
                Some(last) if last.column == column && z - last.z < LAYER_M => last.z = z,
                _ => feet.push(Foot {
                    column,
                    z,
                    has_headroom: false,
                    walkable: false,
                    clearance_m: f32::INFINITY,
                }),
            }
        }
        feet
    }

    /// Returns the columns and heights at which the lines meet a triangle.
    fn meetings(&self, corners: [Vec3; 3]) -> impl Iterator<Item = (u64, f64)> {
        let grid = *self;
        let [a, b, c] = corners.map(|p| (p.as_dvec3() - grid.origin) / dvec3(grid.step, grid.step, 1.0));
        let area = cross(a, b, c.x, c.y);

        // Go row by row, since a long and narrow triangle meets few of the lines around it.
        let low = a.x.min(b.x).min(c.x);
        let high = a.x.max(b.x).max(c.x);
        let rows = low.ceil().max(0.0) as u64..=high.floor().max(0.0) as u64;
        rows.flat_map(move |i| lines_in_row([a, b, c], i).map(move |j| (i, j)))
            .filter_map(move |(i, j)| {
                let x = i as f64;
                let y = j as f64;
                let [wa, wb, wc] =
                    [cross(b, c, x, y), cross(c, a, x, y), cross(a, b, x, y)].map(|w| w / area);
                let is_in = wa >= 0.0 && wb >= 0.0 && wc >= 0.0;
                is_in.then(|| (grid.column(i, j), grid.origin.z + wa * a.z + wb * b.z + wc * c.z))
            })
    }
}

/// Returns the lines of a row, at x = `i`, that may meet a triangle.
fn lines_in_row([a, b, c]: [DVec3; 3], i: u64) -> RangeInclusive<u64> {
    let x = i as f64;
    let low = a.y.min(b.y).min(c.y);
    let high = a.y.max(b.y).max(c.y);

    let mut from = f64::INFINITY;
    let mut to = f64::NEG_INFINITY;
    for (p, q) in [(a, b), (b, c), (c, a)] {
        if (p.x - x) * (q.x - x) <= 0.0 {
            let t = if p.x == q.x {
                [0.0, 1.0]
            } else {
                [(x - p.x) / (q.x - p.x); 2]
            };
            for y in t.map(|t| p.y + (q.y - p.y) * t) {
                from = from.min(y);
                to = to.max(y);
            }
        }
    }

    // The margin is for rounding; the weights of the corners decide.
    (from.max(low) - 1e-6).ceil().max(0.0) as u64..=(to.min(high) + 1e-6).floor().max(0.0) as u64
}

/// Returns twice the signed area of the triangle `p`, `q`, (x, y), seen from above.
fn cross(p: DVec3, q: DVec3, x: f64, y: f64) -> f64 {
    (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x)
}
