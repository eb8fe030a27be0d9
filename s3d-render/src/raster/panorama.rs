//! Panoramas in the visibility pass: [`PanoramaGrid`] explains the functions.

use crate::raster::batch::DrawKind;
use crate::raster::canvas::{Canvas, Cover, TILE, half_of_tile, part_of_tile};
use crate::raster::chunk::{Linear, MAX_ROWS, TRUSTED};
use crate::raster::panorama_batch::{PanoramaBatch, PanoramaCorners};
use crate::raster::panorama_grid::{
    ANGLE_ERROR, PanoramaBounds, PanoramaGrid, PanoramaPlanes, angle_of, angles_of,
};
use crate::raster::window::{Pixels, ProjectionRaster, Window};
use crate::raster::{high, low, max, min};
use crate::ray::cone::{Cone, Plane};
use crate::scene::clusters::{Cluster, PACKET};
use crate::scene::tree::Node;
use crate::simd::raster_lanes::{DrawnFace, LANES, RasterLanes};
use crate::simd::{Kernel, Simd, dispatch};
use glam::{DVec3, Vec3};
use s3d_geom::TriMesh;
use std::f64::consts::TAU;

/// A face around a pole, or across the azimuth opposite to the window's middle, spans a greater azimuth than
/// this, in radians: its corners are at least half a turn apart.
const WIDEST: f32 = 3.0;

/// The window of a panorama.
pub(crate) struct Panorama<'a> {
    mesh: &'a TriMesh,
    origin: DVec3,
    pixels: Pixels<'a>,
    grid: PanoramaGrid,
    projected: Box<PanoramaCorners>,
    batch: Box<PanoramaBatch>,
}

impl<'a> Panorama<'a> {
    /// The widest step between columns, in radians. The sixteen columns of a chunk must lie within half a
    /// radian, so panoramas of fewer than 190 columns are cast ray by ray.
    pub(crate) const WIDEST_STEP_RAD: f64 = 0.5 / (LANES - 1) as f64;

    /// Sets up a window whose columns are no farther apart than that.
    pub(crate) fn new(mesh: &'a TriMesh, window: &Window<'a>) -> Self {
        Self {
            mesh,
            origin: window.camera.pose.location,
            pixels: Pixels::new(window),
            grid: PanoramaGrid::new(window),
            projected: Box::new(PanoramaCorners::new()),
            batch: Box::new(PanoramaBatch::new()),
        }
    }

    /// Computes the directions of the corners of a cluster.
    #[inline(always)]
    fn project(&mut self, corners: &[[[f32; PACKET]; 3]]) {
        let o = self.origin;
        let (sin, cos) = self.grid.middle_sin_cos;
        let projected = &mut *self.projected;
        for (k, [x, y, z]) in corners.iter().enumerate() {
            // Each result has an array of its own, so that the compiler handles all corners of the packet at
            // once.
            let (mut xs, mut ys, mut zs) = ([0.0; PACKET], [0.0; PACKET], [0.0; PACKET]);
            let (mut azimuths, mut latitudes) = ([0.0; PACKET], [0.0; PACKET]);
            for i in 0..PACKET {
                let x = f64::from(x[i]) - o.x;
                let y = f64::from(y[i]) - o.y;
                let z = f64::from(z[i]) - o.z;
                (xs[i], ys[i], zs[i]) = (x, y, z);
                let x = x as f32;
                let y = y as f32;
                let z = z as f32;
                // Turned so that the window's middle is straight ahead, and azimuths grow to the right.
                azimuths[i] = angle_of(x * sin - y * cos, x * cos + y * sin);
                latitudes[i] = angle_of(z, (x * x + y * y).sqrt());
            }
            let packet = k * PACKET..(k + 1) * PACKET;
            projected.x[packet.clone()].copy_from_slice(&xs);
            projected.y[packet.clone()].copy_from_slice(&ys);
            projected.z[packet.clone()].copy_from_slice(&zs);
            projected.azimuth[packet.clone()].copy_from_slice(&azimuths);
            projected.latitude[packet].copy_from_slice(&latitudes);
        }
    }

    /// Draws a face that spans a good part of the sky, or crosses the azimuth opposite to the window's
    /// middle. `azimuths` belong to its corners.
    #[inline(never)]
    fn draw_wide(&self, canvas: &mut Canvas, face: u32, azimuths: [f32; 3]) {
        let corners = self.mesh.triangle(face).map(|p| p.as_dvec3() - self.origin);
        let latitude = corners.map(|p| libm::atan2(p.z, p.truncate().length()));
        let (south, north) =
            (latitude[0].min(latitude[1]).min(latitude[2]), latitude[0].max(latitude[1]).max(latitude[2]));

        let grid = &self.grid;
        let wide = high(azimuths) - low(azimuths);
        let (columns, bend) = if wide < WIDEST {
            // The face is between its corners: a face around a pole, or across the opposite azimuth, is
            // wider.
            (
                grid.columns_between(low(azimuths), high(azimuths)),
                libm::cos(0.5 * f64::from(wide + 4.0 * ANGLE_ERROR)),
            )
        } else {
            ((0.0, (grid.width - 1) as f32), 0.0)
        };

        let north = if north > 0.0 { towards_pole(north, bend) } else { north };
        let south = if south < 0.0 { towards_pole(south, bend) } else { south };

        let rows = grid.rows_between(south as f32 - ANGLE_ERROR, north as f32 + ANGLE_ERROR);
        let top = (rows.0 - 1.0).max(0.0);
        let bottom = (rows.1 + 1.0).min(grid.height as f32 - 1.0);
        let left = columns.0.max(0.0);
        let right = columns.1.min(grid.width as f32 - 1.0);

        if top <= bottom && left <= right {
            let [left, right, top, bottom] = [left, right, top, bottom].map(|pixel| pixel as usize);
            self.draw_in_space(canvas, face, PanoramaBounds { left, right, top, bottom });
        }
    }

    /// Draws a face from its planes in space, on the pixels of some bounds.
    #[inline(never)]
    fn draw_in_space(&self, canvas: &mut Canvas, face: u32, bounds: PanoramaBounds) {
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
        // Near the plane of the face, only single rays can tell.
        let known = offset > 1e-7 * normal.length() * a.length();
        let inverse_t = if known { normal / offset } else { DVec3::ZERO };
        let slot = canvas.enter(DrawnFace::new(inverse_t.to_array(), face, !known));

        let planes = PanoramaPlanes { edges, inverse_t, edge_off };
        dispatch(PanoramaTiles {
            grid: &self.grid,
            canvas,
            planes: &planes,
            bounds: &bounds,
            slot,
            poor: !known,
        });
    }
}

/// Returns the latitude nearest to the pole of an arc that ends at `latitude`. Arcs bend towards the poles:
/// along an arc, the latitude's tangent is a cosine of the azimuth. Its greatest value is at most half of the
/// width away from the nearer end, and `bend` is the cosine of this half.
fn towards_pole(latitude: f64, bend: f64) -> f64 {
    libm::atan2(libm::sin(latitude), libm::cos(latitude) * bend)
}

/// A face on all tiles that it may cover.
struct PanoramaTiles<'a> {
    grid: &'a PanoramaGrid,
    canvas: &'a mut Canvas,
    planes: &'a PanoramaPlanes,
    bounds: &'a PanoramaBounds,
    slot: u32,
    poor: bool,
}

impl Kernel for PanoramaTiles<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.draw(simd.raster());
    }
}

impl PanoramaTiles<'_> {
    #[inline(always)]
    fn draw<L: RasterLanes>(self, l: L) {
        let Self { grid, canvas, planes, bounds, slot, poor } = self;
        let mut tangents = [0.0; MAX_ROWS];
        for tile_row in bounds.top / TILE..=bounds.bottom / TILE {
            let (first, count) = part_of_tile(tile_row, bounds.top, bounds.bottom);
            let mut row = first;
            while row < first + count {
                let rows = grid.steady_rows(row, first + count - row);
                let reach = grid.reach(row, rows);
                let lines = grid.chunk_grid(row, rows, &mut tangents);
                for tile_column in bounds.left / TILE..=bounds.right / TILE {
                    let (column, narrow) = half_of_tile(tile_column, bounds.left, bounds.right);
                    let mut chunk = grid.chunk(planes, (column, row), &reach, slot);

                    if chunk
                        .edges
                        .iter()
                        .any(|e| reach.range(e).1 < -2.0 * chunk.edge_error - 1e-6)
                    {
                        continue;
                    }

                    if poor {
                        chunk.inverse_t = Linear { at: f32::MAX, ..Linear::default() };
                        (chunk.inverse_t_error, chunk.trusted) = (f32::INFINITY, f32::INFINITY);
                        canvas.draw::<L, true, true>(l, &lines, &chunk);
                        continue;
                    }

                    let high = reach.range(&chunk.inverse_t).1;
                    let (low, error) = reach.trust(&chunk.inverse_t);
                    if high + error <= 0.0 || canvas.tile_hides(tile_column, tile_row, high + error) {
                        continue;
                    }

                    canvas.touch_tile(tile_column, tile_row);
                    let trusted = error < TRUSTED * low;
                    (chunk.inverse_t_error, chunk.trusted) = (error, error / TRUSTED);
                    canvas.draw_part::<L, true>(l, &lines, &chunk, narrow, trusted);
                }
                row += rows;
            }
        }
    }
}

impl ProjectionRaster for Panorama<'_> {
    fn origin(&self) -> DVec3 {
        self.origin
    }

    fn size(&self) -> (usize, usize) {
        (self.grid.width, self.grid.height)
    }

    #[inline(always)]
    fn cover(&self, node: &Node) -> Option<Cover> {
        let lo = (Vec3::from(node.min).as_dvec3() - self.origin).as_vec3();
        let hi = (Vec3::from(node.max).as_dvec3() - self.origin).as_vec3();
        // A bound on the rounding error.
        let off = 1e-6 * lo.abs().max(hi.abs()) + 1e-30;
        let lo = lo - off;
        let hi = hi + off;

        let near = lo.max(-hi).max(Vec3::ZERO);
        let far = lo.abs().max(hi.abs());
        let flat = (near.x * near.x + near.y * near.y).sqrt();
        let flat_far = (far.x * far.x + far.y * far.y).sqrt();
        let distance = (flat * flat + near.z * near.z).sqrt() * (1.0 - 1e-6);

        // All angles are computed at once: both latitudes, the azimuth of the middle, and the azimuths of the
        // corners relative to it, which are less than half a turn apart.
        let (sin, cos) = self.grid.middle_sin_cos;
        let x = 0.5 * (lo.x + hi.x);
        let y = 0.5 * (lo.y + hi.y);
        let from_middle = |cx: f32, cy: f32| (cx * y - cy * x, cx * x + cy * y);
        let a = from_middle(lo.x, lo.y);
        let b = from_middle(hi.x, lo.y);
        let c = from_middle(lo.x, hi.y);
        let d = from_middle(hi.x, hi.y);
        let (low_flat, high_flat) =
            (if lo.z < 0.0 { flat } else { flat_far }, if hi.z > 0.0 { flat } else { flat_far });
        let ys = [lo.z, hi.z, x * sin - y * cos, a.0, b.0, c.0, d.0, 0.0];
        let xs = [low_flat, high_flat, x * cos + y * sin, a.1, b.1, c.1, d.1, 1.0];
        let [low, high, middle, corners @ .., _] = angles_of(&ys, &xs);

        let (top, bottom) = self.grid.rows_between(low - ANGLE_ERROR, high + ANGLE_ERROR);
        let rows = (top - 0.01, bottom + 0.01);
        let mut left = 0.0;
        let mut right = self.grid.width as f32 - 1.0;
        if flat > 0.0 {
            let mut range = (0.0f32, 0.0f32);
            for azimuth in corners {
                range = (min(range.0, azimuth), max(range.1, azimuth));
            }
            let middle_column = self.grid.middle_column as f32;
            let per_rad = 1.0 / self.grid.step as f32;
            let pad = 0.01 + 2.0 * ANGLE_ERROR * per_rad;
            let around = TAU as f32 * per_rad;
            let mut first = middle_column + (middle + range.0) * per_rad - pad;
            let mut last = middle_column + (middle + range.1) * per_rad + pad;

            // A turn more or less may bring the range into the window, from one side or from both.
            let inside = |first: f32, last: f32| last >= 0.0 && first <= self.grid.width as f32 - 1.0;
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

        Cover::new((left, right), rows, (self.grid.width, self.grid.height), 1.0 / distance)
    }

    #[inline(always)]
    fn draw<L: RasterLanes>(&mut self, l: L, canvas: &mut Canvas, cluster: &Cluster<'_>) {
        self.project(cluster.corners);
        let batch = &mut *self.batch;
        let grid = &self.grid;
        batch.set_up(cluster.faces, &self.projected, grid);
        let batch = &*self.batch;
        let enter = |canvas: &mut Canvas, j: usize| {
            let inverse_t = batch.planes(j).inverse_t.to_array();
            canvas.enter(DrawnFace::new(inverse_t, cluster.ids[batch.place_in_cluster(j)], false))
        };

        for j in batch.faces(DrawKind::Large) {
            let slot = enter(canvas, j);
            let planes = &batch.planes(j);
            let bounds = &batch.bounds(j);
            PanoramaTiles { grid, canvas, planes, bounds, slot, poor: false }.draw(l);
        }

        let mut tangents = [0.0; MAX_ROWS];
        for j in batch.faces(DrawKind::Narrow) {
            let (chunk, rows) = batch.chunk(j, enter(canvas, j));
            let lines = grid.chunk_grid(chunk.row, rows, &mut tangents);
            canvas.draw::<L::Half, true, false>(l.half(), &lines, &chunk);
        }
        for j in batch.faces(DrawKind::Small) {
            let (chunk, rows) = batch.chunk(j, enter(canvas, j));
            let lines = grid.chunk_grid(chunk.row, rows, &mut tangents);
            canvas.draw::<L, true, false>(l, &lines, &chunk);
        }
        for j in batch.faces(DrawKind::Wide) {
            let (first, rows) = batch.chunk(j, enter(canvas, j));
            let lines = grid.chunk_grid(first.row, rows, &mut tangents);
            canvas.draw::<L, true, false>(l, &lines, &first);
            let reach = grid.reach(first.row, rows);
            let column = first.column + LANES;
            let mut chunk = grid.chunk(&batch.planes(j), (column, first.row), &reach, first.slot);
            let (low, error) = reach.trust(&chunk.inverse_t);
            (chunk.inverse_t_error, chunk.trusted) = (error, error / TRUSTED);
            let narrow = batch.bounds(j).right - column < LANES / 2;
            canvas.draw_part::<L, true>(l, &lines, &chunk, narrow, error < TRUSTED * low);
        }
        for j in batch.faces(DrawKind::Careful) {
            let (chunk, rows) = batch.chunk(j, enter(canvas, j));
            let lines = grid.chunk_grid(chunk.row, rows, &mut tangents);
            canvas.draw::<L, true, true>(l, &lines, &chunk);
        }
        for j in batch.faces(DrawKind::InSpace) {
            let face = cluster.ids[batch.place_in_cluster(j)];
            let bounds = batch.bounds(j);
            match batch.wide_azimuths(j) {
                Some(azimuths) => self.draw_wide(canvas, face, azimuths),
                None => self.draw_in_space(canvas, face, bounds),
            }
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
        canvas.finish::<L, true>(
            l,
            out,
            out_pitch,
            (&self.grid.cos, &self.grid.sin),
            |row| (self.grid.row_cos[row], self.grid.row_sin[row]),
            single,
        );
    }

    fn inverse_t(&self, drawn: &DrawnFace, column: usize, row: usize) -> f64 {
        self.direction(column, row).dot(DVec3::from(drawn.inverse_t))
    }

    fn direction(&self, column: usize, row: usize) -> DVec3 {
        self.pixels.direction(column, row)
    }
}
