//! The columns and rows of a panorama's window, and the functions of a face on them.
//!
//! The direction in column i and row j is (cos θ cos φ, sin θ cos φ, sin φ). The azimuth θ falls by the
//! same step from column to column. Divided by cos φ > 0, the value of a plane is x cos θ + y sin θ + z
//! tan φ. Column k from the anchor's column a is turned by the angle kδ. With h = x cos θₐ + y sin θₐ
//! and h′ = x sin θₐ − y cos θₐ,
//!
//! > x cos θ + y sin θ = h + h·(cos kδ − 1) + h′·sin kδ.
//!
//! So the functions u = cos kδ − 1 and v = sin kδ of a chunk's columns are the same for all chunks. The
//! function of its rows is a difference of tangents. Near the zero of a plane all terms are as small as the
//! chunk, so the error of `f32` is the same as in a perspective view: a few parts in 10⁵ of a pixel.

#![expect(clippy::unreachable, reason = "a camera has rays of its own kind")]

use crate::raster::batch::GROUP;
use crate::raster::chunk::{Chunk, ChunkGrid, INVERSE_T_ROUNDING, Linear, MAX_ROWS};
use crate::raster::window::{Window, groups};
use crate::raster::{high, max, min};
use crate::simd::raster_lanes::LANES;
use glam::DVec3;
use s3d_geom::Rays;
use std::f64::consts::TAU;

/// A bound on the error of [`angle_of`], in radians.
pub(crate) const ANGLE_ERROR: f32 = 3e-5;

/// The rounding error in a chunk, as a part of the sizes of an edge function's terms.
const EDGE_ROUNDING: f64 = 1e-6;

/// Rows whose latitude has at most this tangent are steady: they are more than 7° away from the poles.
const STEEP_TAN: f64 = 8.0;

/// The columns and rows of a window, by angle.
pub(crate) struct PanoramaGrid {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// The angle from column to column and from row to row, in radians.
    pub(crate) step: f64,
    /// The sine and the cosine of the azimuth at the middle of the window, and the column there.
    pub(crate) middle_sin_cos: (f32, f32),
    pub(crate) middle_column: f64,
    /// The latitude of row 0.
    top: f64,
    /// cos θ and sin θ of the columns.
    pub(crate) cos: Vec<[f64; LANES]>,
    pub(crate) sin: Vec<[f64; LANES]>,
    /// cos φ, sin φ and tan φ of the rows. Zeros follow the tangents, so that each row begins a whole
    /// group of them.
    pub(crate) row_cos: Vec<f64>,
    pub(crate) row_sin: Vec<f64>,
    tan: Vec<f64>,
    /// cos φ of the rows.
    scale: Vec<f32>,
    /// The functions of a chunk's columns.
    u: [f32; LANES],
    v: [f32; LANES],
}

/// The position of a chunk's anchor: cos θ and sin θ of its column, tan φ of its row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChunkAnchor {
    pub(crate) cos: f64,
    pub(crate) sin: f64,
    pub(crate) tan: f64,
}

/// The ranges of the functions of a chunk's columns and rows, relative to its anchor, and cos φ at both
/// ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    pub(crate) u: f32,
    pub(crate) v: f32,
    pub(crate) tan: f32,
    pub(crate) cos: [f32; 2],
}

/// The planes of three edges, pointing inwards, and 1/t = `inverse_t` · d.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PanoramaPlanes {
    pub(crate) edges: [DVec3; 3],
    pub(crate) inverse_t: DVec3,
    /// A bound on the error of the edges' values, for a direction of length 1.
    pub(crate) edge_off: f64,
}

/// The pixels that a face may cover.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PanoramaBounds {
    pub(crate) left: usize,
    pub(crate) right: usize,
    pub(crate) top: usize,
    pub(crate) bottom: usize,
}

impl PanoramaGrid {
    /// Computes the columns and rows of `window`.
    pub(crate) fn new(window: &Window<'_>) -> Self {
        let Rays::Equirectangular { columns, rows } = window.rays else {
            unreachable!("a panorama has a panorama's rays")
        };

        let columns: Vec<_> = (0..window.width)
            .map(|i| columns[window.pixel_of(window.column + i) as usize])
            .collect();
        let rows: Vec<_> = (0..window.height)
            .map(|j| rows[window.pixel_of(window.row + j) as usize])
            .collect();

        let step = TAU / f64::from(window.camera.width) * f64::from(window.stride);
        let middle_column = 0.5 * (window.width - 1) as f64;
        let middle = libm::atan2(columns[0].y, columns[0].x) - step * middle_column;
        let angle = |k: usize| libm::sincos(k as f64 * step);
        Self {
            width: window.width,
            height: window.height,
            step,
            middle_sin_cos: (libm::sin(middle) as f32, libm::cos(middle) as f32),
            middle_column,
            top: libm::atan2(rows[0].y, rows[0].x),
            cos: groups(&columns.iter().map(|c| c.x).collect::<Vec<_>>()),
            sin: groups(&columns.iter().map(|c| c.y).collect::<Vec<_>>()),
            row_cos: rows.iter().map(|r| r.x).collect(),
            row_sin: rows.iter().map(|r| r.y).collect(),
            tan: rows.iter().map(|r| r.y / r.x).chain([0.0; GROUP - 1]).collect(),
            scale: rows.iter().map(|r| r.x as f32).collect(),
            u: std::array::from_fn(|k| (angle(k).1 - 1.0) as f32),
            v: std::array::from_fn(|k| angle(k).0 as f32),
        }
    }

    /// Returns the range of rows between two latitudes.
    #[inline(always)]
    pub(crate) fn rows_between(&self, low: f32, high: f32) -> (f32, f32) {
        let top = self.top as f32;
        let per_rad = 1.0 / self.step as f32;
        ((top - high) * per_rad, (top - low) * per_rad)
    }

    /// Returns the range of columns between two azimuths, counted to the right from the window's middle, plus
    /// the error of [`angle_of`].
    #[inline(always)]
    pub(crate) fn columns_between(&self, first: f32, last: f32) -> (f32, f32) {
        let middle = self.middle_column as f32;
        let per_rad = 1.0 / self.step as f32;
        let pad = 0.01 + ANGLE_ERROR * per_rad;
        ((middle + first * per_rad - pad).ceil(), (middle + last * per_rad + pad).floor())
    }

    /// Returns the anchor at a column and a row.
    #[inline(always)]
    pub(crate) fn anchor(&self, column: usize, row: usize) -> ChunkAnchor {
        let cos = self.cos.as_flattened()[column];
        let sin = self.sin.as_flattened()[column];
        ChunkAnchor { cos, sin, tan: self.tan[row] }
    }

    /// Returns how many rows from `row` on, at most `most`, make a chunk in which 1/t can be trusted. Next to
    /// a pole tan φ changes by up to three times from row to row, so the rounding in one row is too large
    /// for a later one.
    #[inline(always)]
    pub(crate) fn steady_rows(&self, row: usize, most: usize) -> usize {
        let tan = |row: usize| self.tan[row].abs();
        let first = tan(row);
        if max(first, tan(row + most - 1)) <= STEEP_TAN {
            return most;
        }
        1 + (1..most)
            .take_while(|&rows| {
                let last = tan(row + rows);
                max(first, last) <= 3.0 * min(first, last)
            })
            .count()
    }

    /// Returns the reach of a chunk of `rows` rows from `row` on.
    #[inline(always)]
    pub(crate) fn reach(&self, row: usize, rows: usize) -> Reach {
        let last = row + rows - 1;
        Reach {
            u: self.u[LANES - 1],
            v: self.v[LANES - 1],
            tan: (self.tan[last] - self.tan[row]) as f32,
            cos: [self.scale[row], self.scale[last]],
        }
    }

    /// Returns the columns and rows of a chunk from `row` on.
    #[inline(always)]
    pub(crate) fn chunk_grid<'a>(
        &'a self,
        row: usize,
        rows: usize,
        tangents: &'a mut [f32; MAX_ROWS],
    ) -> ChunkGrid<'a> {
        let tan = self.tan[row];
        let (to, _) = tangents.as_chunks_mut::<GROUP>();
        let (from, _) = self.tan[row..].as_chunks::<GROUP>();
        for (to, from) in to.iter_mut().zip(from).take(rows.div_ceil(GROUP)) {
            for k in 0..GROUP {
                to[k] = (from[k] - tan) as f32;
            }
        }
        let scale = &self.scale[row..row + rows];
        ChunkGrid { u: &self.u, v: &self.v, rows: tangents, count: rows, scale }
    }

    /// Returns a part of a face, from a column and a row on. The error of 1/t is not set yet.
    #[inline(always)]
    pub(crate) fn chunk(
        &self,
        planes: &PanoramaPlanes,
        (column, row): (usize, usize),
        reach: &Reach,
        slot: u32,
    ) -> Chunk {
        let anchor = self.anchor(column, row);
        let [e0, e1, e2] = &planes.edges;
        let edges = [anchor.linear(e0), anchor.linear(e1), anchor.linear(e2)];
        let edge_error = anchor.edge_error(&edges, reach, planes.edge_off);
        let inverse_t = anchor.linear(&planes.inverse_t);
        Chunk { column, row, edges, edge_error, inverse_t, slot, ..Chunk::default() }
    }
}

impl ChunkAnchor {
    /// Returns the function n · d / cos φ.
    #[inline(always)]
    pub(crate) fn linear(&self, n: &DVec3) -> Linear {
        let h = n.x * self.cos + n.y * self.sin;
        let turned = n.x * self.sin - n.y * self.cos;
        Linear { at: (h + n.z * self.tan) as f32, across: h as f32, bend: turned as f32, down: n.z as f32 }
    }

    /// Returns a bound on the error of edge functions in a chunk, for planes with the error `edge_off`.
    #[inline(always)]
    pub(crate) fn edge_error(&self, edges: &[Linear; 3], reach: &Reach, edge_off: f64) -> f32 {
        let reach_u = f64::from(-reach.u);
        let reach_v = f64::from(reach.v);
        let reach_t = f64::from(-reach.tan);
        // Planes are evaluated for directions of the length 1 / cos φ ≤ 1 + |tan φ|.
        let away = 1.0 + self.tan.abs() + reach_t.abs();
        let terms = |e: &Linear| {
            f64::from(e.across.abs()) * reach_u
                + f64::from(e.bend.abs()) * reach_v
                + f64::from(e.down.abs()) * reach_t
        };
        let size = high([terms(&edges[0]), terms(&edges[1]), terms(&edges[2])]);
        (EDGE_ROUNDING * size + edge_off * away + 1e-12) as f32
    }
}

impl Reach {
    /// Returns the bounds of a function on a chunk before it is multiplied by cos φ, and the sum of its
    /// terms' sizes.
    #[inline(always)]
    pub(crate) fn range(&self, f: &Linear) -> (f32, f32, f32) {
        let down = f.down * self.tan;
        let u = f.across * self.u;
        let v = f.bend * self.v;
        let along = u + v;
        // Between its ends, the function along a row bulges by the square of the angle over 8.
        let bulge = (f.across.abs() + f.bend.abs()) * (self.v * self.v - 2.0 * self.u) * 0.125;
        let low = f.at + min(along, 0.0) + min(down, 0.0) - bulge;
        let high = f.at + max(along, 0.0) + max(down, 0.0) + bulge;
        (low, high, f.at.abs() + u.abs() + v.abs() + down.abs())
    }

    /// Returns a lower bound on 1/t in a chunk, and a bound on its error.
    #[inline(always)]
    pub(crate) fn trust(&self, inverse_t: &Linear) -> (f32, f32) {
        let (low, _, size) = self.range(inverse_t);
        // cos φ is least at one of the ends; between them it may be greater than at both.
        let min_cos = min(self.cos[0], self.cos[1]);
        let max_cos = max(self.cos[0], self.cos[1]);
        let max_cos = min(1.0, max_cos * 1.5);
        let low = if low > 0.0 { low * min_cos } else { low };
        (low, INVERSE_T_ROUNDING * size * max_cos)
    }
}

/// Returns the angle of (x, y) from the x axis, with an error below 1.2e-5.
#[inline(always)]
pub(crate) fn angle_of(y: f32, x: f32) -> f32 {
    let wide = x.abs();
    let high = y.abs();
    let (small, large) = if wide < high { (wide, high) } else { (high, wide) };
    let t = small / if large > 0.0 { large } else { 1.0 };
    let s = t * t;
    let angle = t * (0.999_866 + s * (-0.330_299_5 + s * (0.180_141 + s * (-0.085_133 + s * 0.020_835_1))));
    let angle = if wide < high {
        std::f32::consts::FRAC_PI_2 - angle
    } else {
        angle
    };
    let angle = if x < 0.0 { std::f32::consts::PI - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

/// Calls [`angle_of`] eight times. It must not be inlined: if LLVM sees how the arrays are made, it
/// computes one angle after another.
#[inline(never)]
pub(crate) fn angles_of(y: &[f32; 8], x: &[f32; 8]) -> [f32; 8] {
    std::array::from_fn(|k| angle_of(y[k], x[k]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::{Camera, Pose};

    #[test]
    fn rows_are_drawn_together_but_next_to_a_pole() {
        let camera = Camera::equirectangular(Pose::level(DVec3::ZERO, 0.0), 1024);
        let rays = &camera.rays();
        let window = Window { camera: &camera, rays, stride: 1, column: 0, row: 0, width: 1024, height: 512 };
        let grid = PanoramaGrid::new(&window);
        let grid = &grid;
        let chunks = |mut row: usize, end: usize| {
            std::iter::from_fn(move || {
                let rows = (row < end).then(|| grid.steady_rows(row, end - row))?;
                row += rows;
                Some(rows)
            })
        };
        // Tangents fall as 1, 1/3, 1/5, …, and a little faster. They rise again towards the other pole.
        assert_eq!(Vec::from_iter(chunks(0, 16)), [1, 3, 9, 3]);
        assert_eq!(Vec::from_iter(chunks(496, 512)), [11, 3, 1, 1]);
        assert_eq!(Vec::from_iter(chunks(248, 264)), [16]);
    }
}
