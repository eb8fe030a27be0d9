//! Perspective views in the visibility pass.
//!
//! A corner p (relative to the camera) is in column x = (ρ·p)/(φ·p) and row y = (δ·p)/(φ·p) of the
//! window, with pixel centres at whole numbers, at the depth z = φ·p. If a corner is no farther out than
//! [`GUARD`] pixels, |p|/z is bounded by the angle of the guard band, and x and y are good to
//! 2⁻⁵³·8·GUARD < 2e-11 pixels. An edge function from two corners at least 1e-3 apart is then good to
//! 1e-8 over a chunk. A face with a corner farther out or behind the camera, or with a shorter edge, is drawn
//! from its planes in space instead. [`FaceBatch`] sets up the other faces, a cluster at a time.

#![expect(clippy::unreachable, reason = "a camera has rays of its own kind")]

use crate::raster::batch::{DrawKind, FaceBatch};
use crate::raster::canvas::{Canvas, Cover, TILE, half_of_tile, part_of_tile};
use crate::raster::chunk::{Chunk, ChunkGrid, EDGE_ERROR, INVERSE_T_ROUNDING, Linear, MAX_ROWS, TRUSTED};
use crate::raster::window::{Pixels, ProjectionRaster, Window, groups};
use crate::ray::cone::Cone;
use crate::scene::clusters::{Cluster, MAX_CORNERS, PACKET};
use crate::scene::tree::Node;
use crate::simd::raster_lanes::{DrawnFace, LANES, RasterLanes};
use crate::simd::{Kernel, Simd, dispatch};
use glam::{DVec2, DVec3, Vec3, dvec2};
use s3d_geom::{Projection, Rays, TriMesh};

/// The largest distance of a corner from the window's first pixel, in pixels.
const GUARD: f64 = 16_384.0;

/// 0, 1, 2 …: the columns and rows from the anchor.
const COUNT: [f32; MAX_ROWS] = {
    let mut count = [0.0; MAX_ROWS];
    let mut k = 0;
    while k < MAX_ROWS {
        count[k] = k as f32;
        k += 1;
    }
    count
};

const COLUMNS: [f32; LANES] = {
    let mut count = [0.0; LANES];
    let mut k = 0;
    while k < LANES {
        count[k] = k as f32;
        k += 1;
    }
    count
};

fn grid(rows: usize) -> ChunkGrid<'static> {
    ChunkGrid { u: &COLUMNS, v: &COLUMNS, rows: &COUNT, count: rows, scale: &[] }
}

/// Three edge functions and 1/t: at + across·i + down·j in column i and row j.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PinholePlanes {
    pub(crate) at: [f64; 4],
    pub(crate) across: [f64; 4],
    pub(crate) down: [f64; 4],
}

/// The window of a perspective view.
pub(crate) struct Pinhole<'a> {
    mesh: &'a TriMesh,
    origin: DVec3,
    /// ρ, δ and φ.
    across: DVec3,
    down: DVec3,
    ahead: DVec3,
    /// The largest distance of a corner from the first pixel, in pixels; at most [`GUARD`].
    guard: f64,
    /// The direction of the ray in column 0 and row 0, and its change from column to column and from row to
    /// row.
    first: DVec3,
    step_x: DVec3,
    step_y: DVec3,
    pixels: Pixels<'a>,
    width: usize,
    height: usize,
    columns: Vec<[f64; LANES]>,
    projected: Box<PinholeCorners>,
    batch: Box<FaceBatch>,
}

/// A byte can name this many places, which saves bounds checks.
const PLACES: usize = 1 << u8::BITS;

const _: () = assert!(MAX_CORNERS <= PLACES);

/// The projected corners of a cluster.
pub(crate) struct PinholeCorners {
    pub(crate) x: [f64; PLACES],
    pub(crate) y: [f64; PLACES],
    /// 1/z; 0 for a corner behind the camera or too far out.
    pub(crate) inverse_z: [f64; PLACES],
}

impl PinholeCorners {
    pub(crate) fn new() -> Self {
        let none = [0.0; PLACES];
        Self { x: none, y: none, inverse_z: none }
    }
}

/// Returns how far out corners may be, in pixels, so that x and y are as good as the module says. The window
/// has these focal lengths and the principal point `center`. The result is below [`GUARD`] if pixels are far
/// from square, or if the window is far from the optical axis.
fn guard(focal: DVec2, center: DVec2) -> f64 {
    // The error of x is 2⁻⁵³·(fx + |cx|)·|p|/z, and |p|/z < 1 + (guard + |cx|)/fx + (guard + |cy|)/fy.
    // The same holds for y.
    let center = center.abs();
    let farthest = 8.0 * GUARD / (focal + center).max_element() - 1.0 - (center / focal).element_sum();
    (farthest / focal.recip().element_sum()).min(GUARD)
}

impl<'a> Pinhole<'a> {
    /// Sets up a window of a perspective view.
    pub(crate) fn new(mesh: &'a TriMesh, window: &Window<'a>) -> Self {
        let camera = window.camera;
        let pixels = Pixels::new(window);
        let Rays::Perspective { x_step, y_step, origin } = *pixels.rays else {
            unreachable!("a perspective camera has perspective rays")
        };

        let pose = &camera.pose;
        let stride = f64::from(window.stride);
        let focal = camera.focal_px() / stride;
        let center = camera.center_px();

        // Sample i of the window is at the pixel centre offset + stride · i.
        let offset = |start: usize| f64::from(window.stride / 2) + stride * start as f64 + 0.5;
        let x = offset(window.column);
        let y = offset(window.row);
        let cx = (center.x - x) / stride;
        let cy = (center.y - y) / stride;

        let forward = pose.forward();
        Self {
            mesh,
            origin: pose.location,
            across: pose.right() * focal.x + forward * cx,
            down: -pose.up() * focal.y + forward * cy,
            ahead: forward,
            guard: match camera.projection {
                Projection::Pinhole { .. } => guard(focal, dvec2(cx, cy)),
                _ => GUARD,
            },
            first: origin + x_step * x + y_step * y,
            step_x: x_step * stride,
            step_y: y_step * stride,
            pixels,
            width: window.width,
            height: window.height,
            columns: groups(&(0..window.width).map(|i| i as f64).collect::<Vec<_>>()),
            projected: Box::new(PinholeCorners::new()),
            batch: Box::new(FaceBatch::new()),
        }
    }

    /// Projects the corners of a cluster.
    #[inline(always)]
    fn project(&mut self, corners: &[[[f32; PACKET]; 3]]) {
        let o = self.origin;
        let r = self.across;
        let d = self.down;
        let f = self.ahead;
        let guard = self.guard;
        for (k, [x, y, z]) in corners.iter().enumerate() {
            // Each result has an array of its own, so that the compiler projects all eight corners at once.
            let (mut xs, mut ys, mut qs) = ([0.0; PACKET], [0.0; PACKET], [0.0; PACKET]);
            for i in 0..PACKET {
                let x = f64::from(x[i]) - o.x;
                let y = f64::from(y[i]) - o.y;
                let z = f64::from(z[i]) - o.z;
                let depth = f.x * x + f.y * y + f.z * z;
                let q = 1.0 / depth;
                let px = (r.x * x + r.y * y + r.z * z) * q;
                let py = (d.x * x + d.y * y + d.z * z) * q;
                xs[i] = px;
                ys[i] = py;
                let q = if depth > 0.0 { q } else { 0.0 };
                let q = if px.abs() < guard { q } else { 0.0 };
                qs[i] = if py.abs() < guard { q } else { 0.0 };
            }
            let at = k * PACKET;
            self.projected.x[at..at + PACKET].copy_from_slice(&xs);
            self.projected.y[at..at + PACKET].copy_from_slice(&ys);
            self.projected.inverse_z[at..at + PACKET].copy_from_slice(&qs);
        }
    }

    /// Draws a face from its planes in space: it reaches behind the camera, or has almost no area.
    #[inline(never)]
    fn draw_in_space(&self, canvas: &mut Canvas, face: u32) {
        let Some(cone) = Cone::new(self.mesh, face, self.origin) else { return };
        let Some(bounds) = self.bounds_of(&cone) else { return };
        let [a, b, c] = cone.corners;

        let mut at = [0.0; 4];
        let mut across = [0.0; 4];
        let mut down = [0.0; 4];
        let farthest = self.first.length()
            + self.step_x.length() * self.width as f64
            + self.step_y.length() * self.height as f64;

        let mut edge_error = 0.0;
        for (k, (p, q)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
            let n = p.cross(q);
            let length = n.length();
            let x = n.dot(self.step_x);
            let y = n.dot(self.step_y);
            let slope = x.abs() + y.abs();
            if !(length > 0.0 && slope > 0.0) {
                // The edge has no plane, or its function is the same everywhere: it never decides.
                at[k] = 1.0;
                continue;
            }
            let off = 1e-15 + 8e-16 * p.length() * q.length() / length;
            edge_error = f64::max(edge_error, off * farthest * length / slope);
            at[k] = n.dot(self.first) / slope;
            across[k] = x / slope;
            down[k] = y / slope;
        }

        let plane = cone.plane;
        // Near the plane of the face, only single rays can tell.
        let known = plane.offset > 1e-7 * plane.normal.length() * a.length();
        if known {
            let n = plane.normal / plane.offset;
            (at[3], across[3], down[3]) = (n.dot(self.first), n.dot(self.step_x), n.dot(self.step_y));
        }

        let planes = PinholePlanes { at, across, down };
        let inverse_t = [at[3], across[3], down[3]];
        let slot = canvas.enter(DrawnFace::new(inverse_t, face, !known));
        let edge_error = EDGE_ERROR + edge_error as f32;
        let planes = &planes;
        let bounds = &bounds;
        dispatch(PinholeTiles { canvas, planes, bounds, edge_error, slot, poor: !known });
    }

    /// Returns the pixels that a face may cover; `None` if it is behind the camera or beside the window.
    fn bounds_of(&self, cone: &Cone) -> Option<PinholeBounds> {
        let infinite = f64::INFINITY;
        let mut x = (infinite, -infinite);
        let mut y = (infinite, -infinite);
        let mut q = (infinite, 0.0f64);

        for (k, &p) in cone.corners.iter().enumerate() {
            let z = self.ahead.dot(p);
            // If rounding may have put a depth on the wrong side, it counts for both sides.
            let size = p.abs().element_sum();
            if z > 1e-12 * size {
                widen(&mut x, self.across.dot(p) / z);
                widen(&mut y, self.down.dot(p) / z);
                q = (q.0.min(1.0 / z), q.1.max(1.0 / z));
            }
            if z <= 1e-12 * size {
                q.0 = 0.0;
                q.1 = infinite;
            }

            // An edge that crosses the camera's plane goes off to infinity, on the side of the crossing.
            let next = cone.corners[(k + 1) % 3];
            let z_next = self.ahead.dot(next);
            if (z > 0.0) != (z_next > 0.0) || is_near_zero(z, p) || is_near_zero(z_next, next) {
                let s = if z == z_next {
                    0.5
                } else {
                    (z / (z - z_next)).clamp(0.0, 1.0)
                };
                let at = p + (next - p) * s;
                let slack = 1e-9 * (size + next.abs().element_sum());
                for (range, axis) in [(&mut x, self.across), (&mut y, self.down)] {
                    let v = axis.dot(at);
                    let slack = slack * axis.abs().element_sum();
                    if v > -slack || is_near_zero(z, p) || is_near_zero(z_next, next) {
                        range.1 = infinite;
                    }
                    if v < slack || is_near_zero(z, p) || is_near_zero(z_next, next) {
                        range.0 = -infinite;
                    }
                }
            }
        }

        let left = (x.0 - 0.01).ceil().max(0.0);
        let right = (x.1 + 0.01).floor().min(self.width as f64 - 1.0);
        let top = (y.0 - 0.01).ceil().max(0.0);
        let bottom = (y.1 + 0.01).floor().min(self.height as f64 - 1.0);
        (left <= right && top <= bottom).then_some(PinholeBounds {
            left: left as usize,
            right: right as usize,
            top: top as usize,
            bottom: bottom as usize,
            inverse_t: q,
        })
    }
}

fn widen(range: &mut (f64, f64), v: f64) {
    *range = (range.0.min(v), range.1.max(v))
}

fn is_near_zero(z: f64, p: DVec3) -> bool {
    z.abs() <= 1e-12 * p.abs().element_sum()
}

/// The pixels that a face may cover, and the least and greatest 1/t of the face there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PinholeBounds {
    pub(crate) left: usize,
    pub(crate) right: usize,
    pub(crate) top: usize,
    pub(crate) bottom: usize,
    pub(crate) inverse_t: (f64, f64),
}

impl PinholePlanes {
    #[inline(always)]
    fn chunk(&self, column: usize, row: usize, slot: u32, edge_error: f32) -> Chunk {
        let i = column as f64;
        let j = row as f64;
        let mut f = [Linear::default(); 4];
        for (k, f) in f.iter_mut().enumerate() {
            f.at = (self.at[k] + self.across[k] * i + self.down[k] * j) as f32;
            f.across = self.across[k] as f32;
            f.down = self.down[k] as f32;
        }
        let [e0, e1, e2, inverse_t] = f;
        Chunk { column, row, edges: [e0, e1, e2], edge_error, inverse_t, slot, ..Chunk::default() }
    }
}

/// A face on all tiles that it may cover.
struct PinholeTiles<'a> {
    canvas: &'a mut Canvas,
    planes: &'a PinholePlanes,
    bounds: &'a PinholeBounds,
    edge_error: f32,
    slot: u32,
    poor: bool,
}

impl Kernel for PinholeTiles<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.draw(simd.raster());
    }
}

impl PinholeTiles<'_> {
    #[inline(always)]
    fn draw<L: RasterLanes>(self, l: L) {
        let Self { canvas, planes, bounds, edge_error, slot, poor } = self;
        let nearest = (bounds.inverse_t.1 * (1.0 + 1e-6)) as f32;
        for tile_row in bounds.top / TILE..=bounds.bottom / TILE {
            let (top, rows) = part_of_tile(tile_row, bounds.top, bounds.bottom);
            for tile_column in bounds.left / TILE..=bounds.right / TILE {
                let (column, narrow) = half_of_tile(tile_column, bounds.left, bounds.right);
                let mut chunk = planes.chunk(column, top, slot, edge_error);
                let last = ((if narrow { TILE / 2 } else { TILE }) - 1) as f32;
                let last_row = (rows - 1) as f32;

                // Returns the least and the greatest value of a function on the tile.
                let range = |f: &Linear| {
                    let x = f.across * last;
                    let y = f.down * last_row;
                    (f.at + x.min(0.0) + y.min(0.0), f.at + x.max(0.0) + y.max(0.0))
                };

                if chunk.edges.iter().any(|e| range(e).1 < -2.0 * edge_error) {
                    continue;
                }

                if poor {
                    chunk.inverse_t = Linear { at: f32::MAX, ..Linear::default() };
                    (chunk.inverse_t_error, chunk.trusted) = (f32::INFINITY, f32::INFINITY);
                    canvas.draw::<L, false, true>(l, &grid(rows), &chunk);
                    continue;
                }

                let q = &chunk.inverse_t;
                let error =
                    INVERSE_T_ROUNDING * (q.at.abs() + q.across.abs() * last + q.down.abs() * last_row);
                let (low, high) = range(q);
                if high + error <= 0.0 || canvas.tile_hides(tile_column, tile_row, nearest.min(high + error))
                {
                    continue;
                }

                canvas.touch_tile(tile_column, tile_row);
                let trusted = error < TRUSTED * low;
                (chunk.inverse_t_error, chunk.trusted) = (error, error / TRUSTED);
                canvas.draw_part::<L, false>(l, &grid(rows), &chunk, narrow, trusted);
            }
        }
    }
}

impl ProjectionRaster for Pinhole<'_> {
    fn origin(&self) -> DVec3 {
        self.origin
    }

    fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    #[inline(always)]
    fn cover(&self, node: &Node) -> Option<Cover> {
        let right = self.across.as_vec3();
        let down = self.down.as_vec3();
        let ahead = self.ahead.as_vec3();
        let lo = (Vec3::from(node.min).as_dvec3() - self.origin).as_vec3();
        let hi = (Vec3::from(node.max).as_dvec3() - self.origin).as_vec3();

        // The corners of the box.
        let mut xs = [0.0f32; 8];
        let mut ys = [0.0f32; 8];
        let mut zs = [0.0f32; 8];
        for k in 0..8 {
            let x = if k & 1 == 0 { lo.x } else { hi.x };
            let y = if k & 2 == 0 { lo.y } else { hi.y };
            let z = if k & 4 == 0 { lo.z } else { hi.z };
            xs[k] = right.x * x + right.y * y + right.z * z;
            ys[k] = down.x * x + down.y * y + down.z * z;
            zs[k] = ahead.x * x + ahead.y * y + ahead.z * z;
        }

        let far = lo.abs().max(hi.abs());
        let off = 1e-6 * ahead.abs().dot(far);
        let nearest = zs.iter().fold(f32::INFINITY, |a, &b| if b < a { b } else { a }) - off;
        let farthest = zs.iter().fold(f32::NEG_INFINITY, |a, &b| if b > a { b } else { a }) + off;
        if farthest <= 0.0 {
            return None;
        }
        let off = 1e-6 * (right.abs() + down.abs()).dot(far) + off * (self.width + self.height) as f32;
        let width = self.width as f32;
        let height = self.height as f32;

        // A box around the camera's plane has no bounds in the image: only its sides can tell.
        if nearest <= 1e-4 * farthest {
            let outside = |v: &[f32; 8], size: f32| {
                (0..8).all(|k| v[k] + zs[k] < -off) || (0..8).all(|k| v[k] - size * zs[k] > off)
            };
            if outside(&xs, width) || outside(&ys, height) {
                return None;
            }
            return Cover::new((0.0, width), (0.0, height), (self.width, self.height), f32::INFINITY);
        }

        // The bounds of the projected corners.
        let mut x = (f32::INFINITY, f32::NEG_INFINITY);
        let mut y = x;
        for k in 0..8 {
            let q = 1.0 / zs[k];
            let px = xs[k] * q;
            let py = ys[k] * q;
            x = (if px < x.0 { px } else { x.0 }, if px > x.1 { px } else { x.1 });
            y = (if py < y.0 { py } else { y.0 }, if py > y.1 { py } else { y.1 });
        }

        let pad = 0.01 + off / nearest;
        let columns = (x.0 - pad, x.1 + pad);
        let rows = (y.0 - pad, y.1 + pad);
        Cover::new(columns, rows, (self.width, self.height), 1.0 / nearest)
    }

    #[inline(always)]
    fn draw<L: RasterLanes>(&mut self, l: L, canvas: &mut Canvas, cluster: &Cluster<'_>) {
        self.project(cluster.corners);
        self.batch
            .set_up(cluster.faces, &self.projected, self.width as f64, self.height as f64);

        let batch = &*self.batch;
        let enter = |canvas: &mut Canvas, i: usize| {
            canvas.enter(DrawnFace::new(batch.inverse_t(i), cluster.ids[i], false))
        };

        for i in batch.faces(DrawKind::Large) {
            let slot = enter(canvas, i);
            let planes = &batch.planes(i);
            let bounds = &batch.bounds(i);
            PinholeTiles { canvas, planes, bounds, edge_error: EDGE_ERROR, slot, poor: false }.draw(l);
        }
        for i in batch.faces(DrawKind::Narrow) {
            let (chunk, rows) = batch.chunk(i, enter(canvas, i));
            canvas.draw::<L::Half, false, false>(l.half(), &grid(rows), &chunk);
        }
        for i in batch.faces(DrawKind::Small) {
            let (chunk, rows) = batch.chunk(i, enter(canvas, i));
            canvas.draw::<L, false, false>(l, &grid(rows), &chunk);
        }
        for i in batch.faces(DrawKind::Wide) {
            let (chunk, rows) = batch.chunk(i, enter(canvas, i));
            canvas.draw::<L, false, false>(l, &grid(rows), &chunk);
            let (chunk, columns) = batch.second_chunk(i, &chunk);
            if columns <= LANES / 2 {
                canvas.draw::<L::Half, false, false>(l.half(), &grid(rows), &chunk);
            } else {
                canvas.draw::<L, false, false>(l, &grid(rows), &chunk);
            }
        }
        for i in batch.faces(DrawKind::Careful) {
            let (mut chunk, rows) = batch.chunk(i, enter(canvas, i));
            chunk.trusted = chunk.inverse_t_error / TRUSTED;
            canvas.draw::<L, false, true>(l, &grid(rows), &chunk);
        }
        for i in batch.faces(DrawKind::InSpace) {
            self.draw_in_space(canvas, cluster.ids[i]);
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
        canvas.finish::<L, false>(
            l,
            out,
            out_pitch,
            (&self.columns, &self.columns),
            |row| (0.0, row as f64),
            single,
        );
    }

    fn inverse_t(&self, drawn: &DrawnFace, column: usize, row: usize) -> f64 {
        let [at, across, down] = drawn.inverse_t;
        at + across * column as f64 + down * row as f64
    }

    fn direction(&self, column: usize, row: usize) -> DVec3 {
        self.pixels.direction(column, row)
    }
}
