//! Panoramas, for the visibility pass.
//!
//! The direction in column i and row j is (cos θ cos φ, sin θ cos φ, sin φ), with the azimuth θ falling by
//! the same step from column to column. Divided by cos φ > 0, a plane's value is x cos θ + y sin θ + z tan φ.
//! From an anchor in column a the columns go by the angle kδ, and with h = x cos θₐ + y sin θₐ and h′ = x sin
//! θₐ − y cos θₐ
//!
//! > x cos θ + y sin θ = h + h·(cos kδ − 1) + h′·sin kδ.
//!
//! So the functions u = cos kδ − 1 and v = sin kδ of a chunk's columns are the same for all, and those of its
//! rows are differences of tangents. Near a plane's zero all terms are as small as the chunk, so the error of
//! `f32` is as in a perspective view: a few parts in 10⁵ of a pixel.

#![expect(
    clippy::unwrap_used,
    clippy::unreachable,
    reason = "slices are cut to the length of the array; a camera has rays of its own kind"
)]

use crate::raster::canvas::{Canvas, Cover, TILE, half_of_tile, part_of_tile};
use crate::raster::chunk::{Chunk, ChunkGrid, INVERSE_T_ROUNDING, Linear, MAX_ROWS, TRUSTED};
use crate::raster::clusters::{Cluster, MAX_CORNERS, Node, PACKET};
use crate::raster::window::{Pixels, ProjectionRaster, Window, groups};
use crate::ray::cone::{Cone, Plane};
use crate::simd::raster_lanes::{DrawnFace, LANES, RasterLanes};
use crate::simd::{Kernel, Simd, dispatch};
use glam::DVec3;
use s3d_geom::{Rays, TriMesh};
use std::f64::consts::{PI, TAU};

/// Faces that bounds over a greater azimuth, in radians, are bounded by their latitude alone.
const WIDE: f32 = 0.3;

/// By how much [`turn_of`] may be off, in radians, and then some.
const ANGLE_ERROR: f32 = 3e-5;

/// Rounding in a chunk, as a part of the sizes of an edge function's terms.
const EDGE_ROUNDING: f64 = 1e-6;

/// A panorama's window.
pub(crate) struct Panorama<'m> {
    mesh: &'m TriMesh,
    origin: DVec3,
    pixels: Pixels,
    width: usize,
    height: usize,
    /// Radians from column to column, and from row to row.
    step: f64,
    /// Sine and cosine of the azimuth of the window's middle, and the column there.
    middle_sin_cos: (f32, f32),
    middle_column: f64,
    /// Latitude of row 0.
    top: f64,
    cos: Vec<[f64; LANES]>,
    sin: Vec<[f64; LANES]>,
    /// cos φ, sin φ and tan φ of the rows.
    row_cos: Vec<f64>,
    row_sin: Vec<f64>,
    tan: Vec<f64>,
    scale: Vec<f32>,
    u: [f32; LANES],
    v: [f32; LANES],
    projected: Box<PanoramaCorners>,
}

/// The corners of a cluster.
struct PanoramaCorners {
    /// Relative to the camera.
    x: [f64; MAX_CORNERS],
    y: [f64; MAX_CORNERS],
    z: [f64; MAX_CORNERS],
    /// Azimuth from the window's middle, to the right, and latitude: to [`ANGLE_ERROR`].
    turn: [f32; MAX_CORNERS],
    latitude: [f32; MAX_CORNERS],
}

impl<'m> Panorama<'m> {
    /// The sixteen columns of a chunk are taken to lie within half a radian: panoramas of fewer than 190
    /// columns are for single rays.
    pub(crate) const WIDEST_STEP_RAD: f64 = 0.5 / (LANES - 1) as f64;

    /// The window of `window`, whose columns are no farther apart than that.
    pub(crate) fn new(mesh: &'m TriMesh, window: &Window<'_>) -> Self {
        let pixels = Pixels::new(window);
        let Rays::Equirectangular { columns, rows } = &pixels.rays else {
            unreachable!("a panorama has a panorama's rays")
        };
        let pixel = |sample: usize| (window.stride / 2 + window.stride * sample as u32) as usize;
        let columns: Vec<_> = (0..window.width).map(|i| columns[pixel(window.column + i)]).collect();
        let rows: Vec<_> = (0..window.height).map(|j| rows[pixel(window.row + j)]).collect();
        let step = TAU / f64::from(window.camera.width) * f64::from(window.stride);
        let middle_column = 0.5 * (window.width - 1) as f64;
        let middle = libm::atan2(columns[0].y, columns[0].x) - step * middle_column;
        let angle = |k: usize| libm::sincos(k as f64 * step);
        Self {
            mesh,
            origin: window.camera.pose.location,
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
            tan: rows.iter().map(|r| r.y / r.x).collect(),
            scale: rows.iter().map(|r| r.x as f32).collect(),
            u: std::array::from_fn(|k| (angle(k).1 - 1.0) as f32),
            v: std::array::from_fn(|k| angle(k).0 as f32),
            pixels,
            projected: Box::new(PanoramaCorners {
                x: [0.0; MAX_CORNERS],
                y: [0.0; MAX_CORNERS],
                z: [0.0; MAX_CORNERS],
                turn: [0.0; MAX_CORNERS],
                latitude: [0.0; MAX_CORNERS],
            }),
        }
    }

    #[inline(always)]
    fn project(&mut self, corners: &[[[f32; PACKET]; 3]]) {
        let o = self.origin;
        let (sin, cos) = self.middle_sin_cos;
        for (k, [x, y, z]) in corners.iter().enumerate() {
            let at = k * PACKET;
            let p = &mut *self.projected;
            let xs: &mut [f64; PACKET] = (&mut p.x[at..at + PACKET]).try_into().unwrap();
            let ys: &mut [f64; PACKET] = (&mut p.y[at..at + PACKET]).try_into().unwrap();
            let zs: &mut [f64; PACKET] = (&mut p.z[at..at + PACKET]).try_into().unwrap();
            let turns: &mut [f32; PACKET] = (&mut p.turn[at..at + PACKET]).try_into().unwrap();
            let latitudes: &mut [f32; PACKET] = (&mut p.latitude[at..at + PACKET]).try_into().unwrap();
            for i in 0..PACKET {
                let (x, y, z) = (f64::from(x[i]) - o.x, f64::from(y[i]) - o.y, f64::from(z[i]) - o.z);
                (xs[i], ys[i], zs[i]) = (x, y, z);
                let (x, y, z) = (x as f32, y as f32, z as f32);
                // Turned so that the window's middle is straight ahead, and to the right counts up.
                turns[i] = turn_of(x * sin - y * cos, x * cos + y * sin);
                latitudes[i] = turn_of(z, (x * x + y * y).sqrt());
            }
        }
    }

    /// Rows between two latitudes.
    #[inline(always)]
    fn rows_between(&self, low: f32, high: f32) -> (f32, f32) {
        let (top, per_rad) = (self.top as f32, 1.0 / self.step as f32);
        ((top - high) * per_rad, (top - low) * per_rad)
    }

    #[inline(always)]
    fn draw_face<L: RasterLanes>(&self, l: L, canvas: &mut Canvas, corners: [u8; 4], face: u32) {
        let p = &self.projected;
        let c = [corners[0], corners[1], corners[2]].map(usize::from);
        let (turn, latitude) = (c.map(|k| p.turn[k]), c.map(|k| p.latitude[k]));
        let low = |v: [f32; 3]| min(min(v[0], v[1]), v[2]);
        let high = |v: [f32; 3]| max(max(v[0], v[1]), v[2]);
        let (first, last) = (low(turn), high(turn));
        let wide = last - first;
        let narrow = wide < WIDE;
        if !narrow {
            return self.draw_wide(canvas, face);
        }
        // An arc bends towards the pole, by no more than the square of its width over 16.
        let bend = wide * wide * (1.0 / 15.0) + ANGLE_ERROR;
        let rows = self.rows_between(low(latitude) - bend, high(latitude) + bend);
        let (middle, per_rad) = (self.middle_column as f32, 1.0 / self.step as f32);
        let pad = 0.01 + ANGLE_ERROR * per_rad;
        let left = (middle + first * per_rad - pad).ceil().max(0.0);
        let right = (middle + last * per_rad + pad).floor().min(self.width as f32 - 1.0);
        let top = (rows.0 - 0.01).ceil().max(0.0);
        let bottom = (rows.1 + 0.01).floor().min(self.height as f32 - 1.0);
        if !(left <= right && top <= bottom) {
            return;
        }
        let (left, right, top, bottom) = (left as usize, right as usize, top as usize, bottom as usize);
        let small = right - left < LANES && bottom - top < MAX_ROWS;

        let at = |k: usize| DVec3::new(p.x[k], p.y[k], p.z[k]);
        let [a, b, c] = c.map(at);
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let offset = normal.dot(a);
        let size = a.abs().element_sum() * normal.abs().element_sum();
        let off_plane = offset.abs() > 1e-6 * size;
        if !off_plane {
            return self.draw_in_space(canvas, face, (top, bottom));
        }
        let sign = if offset > 0.0 { 1.0 } else { -1.0 };
        let mut planes = [DVec3::ZERO; 3];
        let mut off = 0.0;
        for (k, (p, q)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
            let n = p.cross(q);
            let length = n.abs().element_sum();
            off = max64(off, p.abs().element_sum() * q.abs().element_sum() / length);
            planes[k] = n * (sign / length);
        }
        let firm = off < 1e6;
        if !firm {
            return self.draw_in_space(canvas, face, (top, bottom));
        }
        let planes = PanoramaPlanes { edges: planes, inverse_t: normal / offset, edge_off: 1e-15 * off };
        let slot = canvas.enter(DrawnFace::new(planes.inverse_t.to_array(), face, false));
        let bounds = PanoramaBounds { left, right, top, bottom };
        if small {
            let rows = bottom - top + 1;
            let mut tangents = [0.0; MAX_ROWS];
            let (grid, mut chunk) = self.chunk(&planes, left, top, rows, slot, &mut tangents);
            let (low, error) = self.trust(&chunk, &grid);
            let trusted = error < TRUSTED * low;
            (chunk.inverse_t_error, chunk.trusted) = (error, error / TRUSTED);
            match (right - left < 8, trusted) {
                (true, true) => canvas.draw::<L::Half, true, false>(l.half(), &grid, &chunk),
                (true, false) => canvas.draw::<L::Half, true, true>(l.half(), &grid, &chunk),
                (false, true) => canvas.draw::<L, true, false>(l, &grid, &chunk),
                (false, false) => canvas.draw::<L, true, true>(l, &grid, &chunk),
            }
        } else {
            PanoramaTiles { raster: self, canvas, planes: &planes, bounds: &bounds, slot, poor: false }
                .draw(l);
        }
    }

    /// Draws a face that goes around a good part of the sky, or across the place opposite to the window's
    /// middle.
    #[inline(never)]
    fn draw_wide(&self, canvas: &mut Canvas, face: u32) {
        let corners = self.mesh.triangle(face).map(|p| p.as_dvec3() - self.origin);
        let latitude = corners.map(|p| libm::atan2(p.z, p.truncate().length()));
        let (low, high) =
            (latitude[0].min(latitude[1]).min(latitude[2]), latitude[0].max(latitude[1]).max(latitude[2]));
        // Arcs bend towards the poles: from the equator's side corners bound them.
        let high = if high > 0.0 { 0.5 * PI } else { high };
        let low = if low < 0.0 { -0.5 * PI } else { low };
        let (top, bottom) = self.rows_between(low as f32 - ANGLE_ERROR, high as f32 + ANGLE_ERROR);
        let (top, bottom) = ((top - 1.0).max(0.0), (bottom + 1.0).min(self.height as f32 - 1.0));
        if top <= bottom {
            self.draw_in_space(canvas, face, (top as usize, bottom as usize));
        }
    }

    /// Draws a face on all of some rows.
    #[inline(never)]
    fn draw_in_space(&self, canvas: &mut Canvas, face: u32, (top, bottom): (usize, usize)) {
        let Some(cone) = Cone::new(self.mesh, face, self.origin) else { return };
        let [a, b, c] = cone.corners;
        let mut edges = [DVec3::ZERO; 3];
        let mut edge_off = 0.0;
        for (k, (p, q)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
            let n = p.cross(q);
            let length = n.length();
            if length > 0.0 {
                edges[k] = n / length;
                edge_off = f64::max(edge_off, 1e-15 + 8e-16 * p.length() * q.length() / length);
            }
        }
        let Plane { normal, offset } = cone.plane;
        // Near the plane of the face nothing but single rays can tell.
        let known = offset > 1e-7 * normal.length() * a.length();
        let inverse_t = if known { normal / offset } else { DVec3::ZERO };
        let slot = canvas.enter(DrawnFace::new(inverse_t.to_array(), face, !known));
        let planes = PanoramaPlanes { edges, inverse_t, edge_off };
        let bounds = PanoramaBounds { left: 0, right: self.width - 1, top, bottom };
        dispatch(PanoramaTiles {
            raster: self,
            canvas,
            planes: &planes,
            bounds: &bounds,
            slot,
            poor: !known,
        });
    }

    #[inline(always)]
    fn chunk<'a>(
        &'a self,
        planes: &PanoramaPlanes,
        column: usize,
        row: usize,
        rows: usize,
        slot: u32,
        tangents: &'a mut [f32; MAX_ROWS],
    ) -> (ChunkGrid<'a>, Chunk) {
        let (cos, sin) = (self.cos.as_flattened()[column], self.sin.as_flattened()[column]);
        let tan = self.tan[row];
        for (to, from) in tangents.iter_mut().zip(&self.tan[row..row + rows]) {
            *to = (from - tan) as f32;
        }
        let reach_v = f64::from(self.v[LANES - 1]);
        let reach_u = -f64::from(self.u[LANES - 1]);
        let reach_t = f64::from(-tangents[rows - 1]);
        let linear = |n: &DVec3| {
            let h = n.x * cos + n.y * sin;
            let turned = n.x * sin - n.y * cos;
            Linear { at: (h + n.z * tan) as f32, across: h as f32, bend: turned as f32, down: n.z as f32 }
        };
        let edges = [linear(&planes.edges[0]), linear(&planes.edges[1]), linear(&planes.edges[2])];
        let inverse_t = linear(&planes.inverse_t);
        // A direction is as long as 1 / cos φ where its planes are evaluated: 1 + |tan φ| at most.
        let away = 1.0 + tan.abs() + reach_t.abs();
        let mut size = 0.0;
        for e in &edges {
            let terms = f64::from(e.across.abs()) * reach_u
                + f64::from(e.bend.abs()) * reach_v
                + f64::from(e.down.abs()) * reach_t;
            size = max64(size, terms);
        }
        let edge_error = (EDGE_ROUNDING * size + planes.edge_off * away + 1e-12) as f32;
        let scale = &self.scale[row..row + rows];
        let grid = ChunkGrid { u: &self.u, v: &self.v, rows: tangents, count: rows, scale };
        (grid, Chunk { column, row, edges, edge_error, inverse_t, slot, ..Chunk::default() })
    }

    /// The least 1/t of a chunk, as far as is known, and by how much any may be off.
    #[inline(always)]
    fn trust(&self, chunk: &Chunk, grid: &ChunkGrid<'_>) -> (f32, f32) {
        let (low, _, size) = self.range(&chunk.inverse_t, grid);
        let (first, last) = (grid.scale[0], grid.scale[grid.scale.len() - 1]);
        // cos φ is least at one of the ends.
        let (min_cos, max_cos) = if first < last { (first, last) } else { (last, first) };
        let max_cos = if grid.count > 1 { 1.0f32.min(max_cos * 1.5) } else { max_cos };
        let low = if low > 0.0 { low * min_cos } else { low };
        (low, INVERSE_T_ROUNDING * size * max_cos)
    }

    /// Bounds of a function on a chunk, before it is multiplied by cos φ, and the sizes of its terms.
    #[inline(always)]
    fn range(&self, f: &Linear, grid: &ChunkGrid<'_>) -> (f32, f32, f32) {
        let last = LANES - 1;
        let down = f.down * grid.rows[grid.count - 1];
        let (u, v) = (f.across * self.u[last], f.bend * self.v[last]);
        let along = u + v;
        // Between its ends the function along a row bulges by the square of the angle over 8.
        let bulge =
            (f.across.abs() + f.bend.abs()) * (self.v[last] * self.v[last] - 2.0 * self.u[last]) * 0.125;
        let low = f.at + min(along, 0.0) + min(down, 0.0) - bulge;
        let high = f.at + max(along, 0.0) + max(down, 0.0) + bulge;
        (low, high, f.at.abs() + u.abs() + v.abs() + down.abs())
    }
}

/// Three edges' planes, inwards, and 1/t = `inverse_t` · d.
struct PanoramaPlanes {
    edges: [DVec3; 3],
    inverse_t: DVec3,
    /// By how much the edges' values are off, for a direction of length 1.
    edge_off: f64,
}

/// The pixels that a face may cover.
struct PanoramaBounds {
    left: usize,
    right: usize,
    top: usize,
    bottom: usize,
}

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn max64(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The angle of (x, y), from the x axis, to 1.2e-5.
#[inline(always)]
fn turn_of(y: f32, x: f32) -> f32 {
    let (wide, high) = (x.abs(), y.abs());
    let (small, large) = if wide < high { (wide, high) } else { (high, wide) };
    let t = small / if large > 0.0 { large } else { 1.0 };
    let s = t * t;
    let angle = t * (0.999_866 + s * (-0.330_299_5 + s * (0.180_141 + s * (-0.085_133 + s * 0.020_835_1))));
    let angle = if wide < high { std::f32::consts::FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { std::f32::consts::PI - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

/// A face on all the tiles that it may cover.
struct PanoramaTiles<'a, 'm> {
    raster: &'a Panorama<'m>,
    canvas: &'a mut Canvas,
    planes: &'a PanoramaPlanes,
    bounds: &'a PanoramaBounds,
    slot: u32,
    poor: bool,
}

impl Kernel for PanoramaTiles<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.draw(simd.raster());
    }
}

impl PanoramaTiles<'_, '_> {
    #[inline(always)]
    fn draw<L: RasterLanes>(self, l: L) {
        let Self { raster, canvas, planes, bounds, slot, poor } = self;
        let mut tangents = [0.0; MAX_ROWS];
        for tile_row in bounds.top / TILE..=bounds.bottom / TILE {
            let (row, rows) = part_of_tile(tile_row, bounds.top, bounds.bottom);
            for tile_column in bounds.left / TILE..=bounds.right / TILE {
                let (column, narrow) = half_of_tile(tile_column, bounds.left, bounds.right);
                let (grid, mut chunk) = raster.chunk(planes, column, row, rows, slot, &mut tangents);
                if chunk.edges.iter().any(|e| raster.range(e, &grid).1 < -2.0 * chunk.edge_error - 1e-6) {
                    continue;
                }
                if poor {
                    chunk.inverse_t = Linear { at: f32::MAX, ..Linear::default() };
                    (chunk.inverse_t_error, chunk.trusted) = (f32::INFINITY, f32::INFINITY);
                    canvas.draw::<L, true, true>(l, &grid, &chunk);
                    continue;
                }
                let high = raster.range(&chunk.inverse_t, &grid).1;
                let (low, error) = raster.trust(&chunk, &grid);
                if high + error <= 0.0 || canvas.tile_hides(tile_column, tile_row, high + error) {
                    continue;
                }
                canvas.touch_tile(tile_column, tile_row);
                let trusted = error < TRUSTED * low;
                (chunk.inverse_t_error, chunk.trusted) = (error, error / TRUSTED);
                match (narrow, trusted) {
                    (true, true) => canvas.draw::<L::Half, true, false>(l.half(), &grid, &chunk),
                    (true, false) => canvas.draw::<L::Half, true, true>(l.half(), &grid, &chunk),
                    (false, true) => canvas.draw::<L, true, false>(l, &grid, &chunk),
                    (false, false) => canvas.draw::<L, true, true>(l, &grid, &chunk),
                }
            }
        }
    }
}

impl ProjectionRaster for Panorama<'_> {
    fn origin(&self) -> DVec3 {
        self.origin
    }

    fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    #[inline(always)]
    fn cover(&self, node: &Node) -> Option<Cover> {
        let o = self.origin.to_array();
        let lo = [0, 1, 2].map(|k| (f64::from(node.min[k]) - o[k]) as f32);
        let hi = [0, 1, 2].map(|k| (f64::from(node.max[k]) - o[k]) as f32);
        // What rounding may have moved.
        let off = [0, 1, 2].map(|k| 1e-6 * max(lo[k].abs(), hi[k].abs()) + 1e-30);
        let (lo, hi) = ([0, 1, 2].map(|k| lo[k] - off[k]), [0, 1, 2].map(|k| hi[k] + off[k]));
        let near = [0, 1, 2].map(|k| max(max(lo[k], -hi[k]), 0.0));
        let far = [0, 1, 2].map(|k| max(lo[k].abs(), hi[k].abs()));
        let flat = (near[0] * near[0] + near[1] * near[1]).sqrt();
        let flat_far = (far[0] * far[0] + far[1] * far[1]).sqrt();
        let distance = (flat * flat + near[2] * near[2]).sqrt() * (1.0 - 1e-6);
        let high = turn_of(hi[2], if hi[2] > 0.0 { flat } else { flat_far }) + ANGLE_ERROR;
        let low = turn_of(lo[2], if lo[2] < 0.0 { flat } else { flat_far }) - ANGLE_ERROR;
        let (top, bottom) = self.rows_between(low, high);
        let rows = (top - 0.01, bottom + 0.01);
        let (mut left, mut right) = (0.0, self.width as f32 - 1.0);
        if flat > 0.0 {
            let (sin, cos) = self.middle_sin_cos;
            // Against the direction of the box's middle corners are less than half a turn apart.
            let (x, y) = (0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1]));
            let middle = turn_of(x * sin - y * cos, x * cos + y * sin);
            let mut range = (0.0f32, 0.0f32);
            for (cx, cy) in [(lo[0], lo[1]), (hi[0], lo[1]), (lo[0], hi[1]), (hi[0], hi[1])] {
                let turn = turn_of(cx * y - cy * x, cx * x + cy * y);
                range = (min(range.0, turn), max(range.1, turn));
            }
            let (middle_column, per_rad) = (self.middle_column as f32, 1.0 / self.step as f32);
            let pad = 0.01 + 2.0 * ANGLE_ERROR * per_rad;
            let around = TAU as f32 * per_rad;
            let mut first = middle_column + (middle + range.0) * per_rad - pad;
            let mut last = middle_column + (middle + range.1) * per_rad + pad;
            // A turn more or less may bring it into the window, from one side or from both.
            let inside = |first: f32, last: f32| last >= 0.0 && first <= self.width as f32 - 1.0;
            let shown = [-around, 0.0, around].map(|by| inside(first + by, last + by));
            match shown {
                [false, false, false] => return None,
                [true, false, false] => (first, last) = (first - around, last - around),
                [false, false, true] => (first, last) = (first + around, last + around),
                [false, true, false] => {}
                _ => (first, last) = (left, right),
            }
            (left, right) = (max(first, left), min(last, right));
        }
        Cover::new((left, right), rows, (self.width, self.height), 1.0 / distance)
    }

    #[inline(always)]
    fn draw<L: RasterLanes>(&mut self, l: L, canvas: &mut Canvas, cluster: &Cluster<'_>) {
        self.project(cluster.corners);
        for (&corners, &face) in cluster.faces.iter().zip(cluster.ids) {
            self.draw_face(l, canvas, corners, face);
        }
    }

    #[inline(always)]
    fn finish<L: RasterLanes>(
        &self,
        l: L,
        canvas: &mut Canvas,
        out: (&mut [u32], &mut [f32]),
        out_pitch: usize,
        single: impl Fn(u32, usize, usize) -> f64,
    ) {
        let line = |row: usize| (self.row_cos[row], self.row_sin[row]);
        canvas.finish::<L, true>(l, out, out_pitch, (&self.cos, &self.sin), line, single);
    }

    fn inverse_t(&self, drawn: &DrawnFace, column: usize, row: usize) -> f64 {
        self.direction(column, row).dot(DVec3::from(drawn.inverse_t))
    }

    fn direction(&self, column: usize, row: usize) -> DVec3 {
        self.pixels.direction(column, row)
    }
}
