//! Sets up the faces of a cluster in a panorama, eight at a time, like [`crate::raster::batch`] for
//! perspective views.

use crate::raster::batch::{DrawKind, FacesByKind, GROUP, Values, group, put};
use crate::raster::chunk::{Chunk, Linear, MAX_ROWS, TRUSTED};
use crate::raster::panorama_grid::{
    ANGLE_ERROR, ChunkAnchor, PanoramaBounds, PanoramaGrid, PanoramaPlanes, Reach,
};
use crate::raster::{high, low, max, min};
use crate::scene::clusters::{MAX_CORNERS, MAX_FACES};
use crate::simd::raster_lanes::LANES;
use glam::{DVec3, dvec3};

/// Faces that span a greater azimuth than this, in radians, have no bounds in the image.
const WIDE: f32 = 0.3;

/// If the rounding error of an edge's plane exceeds this many times 1e-15, single rays decide.
const FIRM: f64 = 1e6;

/// The corners of a cluster, as seen from the camera.
pub(crate) struct PanoramaCorners {
    /// The position relative to the camera.
    pub(crate) x: [f64; MAX_CORNERS],
    pub(crate) y: [f64; MAX_CORNERS],
    pub(crate) z: [f64; MAX_CORNERS],
    /// The azimuth from the window's middle, positive to the right, and the latitude. The error is below
    /// [`ANGLE_ERROR`].
    pub(crate) azimuth: [f32; MAX_CORNERS],
    pub(crate) latitude: [f32; MAX_CORNERS],
}

impl PanoramaCorners {
    pub(crate) fn new() -> Self {
        let (none, no_angle) = ([0.0; MAX_CORNERS], [0.0; MAX_CORNERS]);
        Self { x: none, y: none, z: none, azimuth: no_angle, latitude: no_angle }
    }
}

/// Which part of the window a face of a cluster may show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Nothing = 0,
    /// The pixels in its bounds.
    InBounds,
    /// Unknown: the face is too wide.
    Wide,
}

/// The set-up of each face of a cluster.
pub(crate) struct PanoramaBatch {
    azimuth: [Values<f32>; 3],
    latitude: [Values<f32>; 3],
    /// The first and last column and row of pixels, clipped to the window.
    left: Values<f32>,
    right: Values<f32>,
    top: Values<f32>,
    bottom: Values<f32>,
    shown: Values<u32>,
    /// The places in the cluster of the faces that may be visible. All following arrays are by position in
    /// this list.
    places: Values<u8>,
    x: [Values<f64>; 3],
    y: [Values<f64>; 3],
    z: [Values<f64>; 3],
    /// The chunk at the first column and row.
    anchor_cos: Values<f64>,
    anchor_sin: Values<f64>,
    anchor_tan: Values<f64>,
    reach_tan: Values<f32>,
    first_cos: Values<f32>,
    last_cos: Values<f32>,
    columns: Values<f32>,
    rows: Values<f32>,
    wide: Values<u32>,
    /// See [`PanoramaPlanes`]: three edges and 1/t.
    planes: [[Values<f64>; 3]; 4],
    edge_off: Values<f64>,
    /// See [`Linear`]: three edges and 1/t.
    at: [Values<f32>; 4],
    across: [Values<f32>; 4],
    bend: [Values<f32>; 4],
    down: [Values<f32>; 4],
    edge_error: Values<f32>,
    inverse_t_error: Values<f32>,
    kind: Values<u32>,
    by_kind: FacesByKind,
}

impl PanoramaBatch {
    pub(crate) fn new() -> Self {
        let (angles, numbers) = ([0.0; MAX_FACES], [0.0; MAX_FACES]);
        Self {
            azimuth: [angles; 3],
            latitude: [angles; 3],
            left: angles,
            right: angles,
            top: angles,
            bottom: angles,
            shown: [0; MAX_FACES],
            places: [0; MAX_FACES],
            x: [numbers; 3],
            y: [numbers; 3],
            z: [numbers; 3],
            anchor_cos: numbers,
            anchor_sin: numbers,
            anchor_tan: numbers,
            reach_tan: angles,
            first_cos: angles,
            last_cos: angles,
            columns: angles,
            rows: angles,
            wide: [0; MAX_FACES],
            planes: [[numbers; 3]; 4],
            edge_off: numbers,
            at: [angles; 4],
            across: [angles; 4],
            bend: [angles; 4],
            down: [angles; 4],
            edge_error: angles,
            inverse_t_error: angles,
            kind: [0; MAX_FACES],
            by_kind: FacesByKind::new(),
        }
    }

    /// Sets up the faces of a cluster, given by the places of their corners, in a window.
    #[inline(always)]
    pub(crate) fn set_up(&mut self, faces: &[[u8; 4]], corners: &PanoramaCorners, grid: &PanoramaGrid) {
        for (i, places) in faces.iter().enumerate() {
            for (k, &place) in places[..3].iter().enumerate() {
                self.azimuth[k][i] = corners.azimuth[usize::from(place)];
                self.latitude[k][i] = corners.latitude[usize::from(place)];
            }
        }

        // The last groups are filled up with stale entries, which are never read.
        for first in (0..faces.len()).step_by(GROUP) {
            self.bound_group(first, grid);
        }

        let mut count = 0;
        for (i, &shown) in self.shown[..faces.len()].iter().enumerate() {
            self.places[count % MAX_FACES] = i as u8;
            count += usize::from(shown != Shown::Nothing as u32);
        }

        for j in 0..count {
            self.place(j, faces, corners, grid);
        }
        for first in (0..count).step_by(GROUP) {
            self.set_up_group(first, grid);
        }
        self.by_kind.sort(&self.kind[..count]);
    }

    /// Bounds the faces of a group, and notes which of them may be visible.
    #[inline(always)]
    fn bound_group(&mut self, first: usize, grid: &PanoramaGrid) {
        let azimuths =
            [group(&self.azimuth[0], first), group(&self.azimuth[1], first), group(&self.azimuth[2], first)];
        let latitudes = [
            group(&self.latitude[0], first),
            group(&self.latitude[1], first),
            group(&self.latitude[2], first),
        ];
        let last_column = grid.width as f32 - 1.0;
        let last_row = grid.height as f32 - 1.0;

        // Each result has an array of its own, so that the compiler bounds all faces of the group at once.
        let (mut lefts, mut rights) = ([0.0; GROUP], [0.0; GROUP]);
        let (mut tops, mut bottoms) = ([0.0; GROUP], [0.0; GROUP]);
        let mut shown = [0; GROUP];
        for i in 0..GROUP {
            let azimuth = [azimuths[0][i], azimuths[1][i], azimuths[2][i]];
            let latitude = [latitudes[0][i], latitudes[1][i], latitudes[2][i]];
            let first = low(azimuth);
            let last = high(azimuth);
            let wide = last - first;
            // An arc bends towards the pole by at most the square of its width over 16; 15 leaves a margin.
            let bend = wide * wide * (1.0 / 15.0) + ANGLE_ERROR;
            let rows = grid.rows_between(low(latitude) - bend, high(latitude) + bend);
            let columns = grid.columns_between(first, last);
            let left = max(columns.0, 0.0);
            let right = min(columns.1, last_column);
            let top = max((rows.0 - 0.01).ceil(), 0.0);
            let bottom = min((rows.1 + 0.01).floor(), last_row);

            let seen = if left <= right {
                Shown::InBounds as u32
            } else {
                Shown::Nothing as u32
            };
            let seen = if top <= bottom { seen } else { Shown::Nothing as u32 };
            shown[i] = if wide < WIDE { seen } else { Shown::Wide as u32 };
            (lefts[i], rights[i], tops[i], bottoms[i]) = (left, right, top, bottom);
        }

        put(&mut self.left, first, &lefts);
        put(&mut self.right, first, &rights);
        put(&mut self.top, first, &tops);
        put(&mut self.bottom, first, &bottoms);
        put(&mut self.shown, first, &shown);
    }

    /// Looks up the values that the set-up of a visible face needs.
    #[inline(always)]
    fn place(&mut self, j: usize, faces: &[[u8; 4]], corners: &PanoramaCorners, grid: &PanoramaGrid) {
        let i = usize::from(self.places[j]) % MAX_FACES;
        for (k, &place) in faces[i][..3].iter().enumerate() {
            let place = usize::from(place);
            self.x[k][j] = corners.x[place];
            self.y[k][j] = corners.y[place];
            self.z[k][j] = corners.z[place];
        }

        let bounds = self.bounds_in_cluster(i);
        // The bounds of a wide face mean nothing and may be anywhere.
        let column = bounds.left.min(grid.width - 1);
        let row = bounds.top.min(grid.height - 1);
        let anchor = grid.anchor(column, row);
        let reach = grid.reach(row, (bounds.bottom.max(row) - row).min(grid.height - row - 1) + 1);
        self.anchor_cos[j] = anchor.cos;
        self.anchor_sin[j] = anchor.sin;
        self.anchor_tan[j] = anchor.tan;
        self.reach_tan[j] = reach.tan;
        self.first_cos[j] = reach.cos[0];
        self.last_cos[j] = reach.cos[1];
        self.columns[j] = self.right[i] - self.left[i] + 1.0;
        self.rows[j] = self.bottom[i] - self.top[i] + 1.0;
        self.wide[j] = u32::from(self.shown[i] == Shown::Wide as u32);
    }

    #[inline(always)]
    fn set_up_group(&mut self, first: usize, grid: &PanoramaGrid) {
        let three = |from: &[Values<f64>; 3]| {
            [group(&from[0], first), group(&from[1], first), group(&from[2], first)]
        };
        let (xs, ys, zs) = (three(&self.x), three(&self.y), three(&self.z));
        let coses = group(&self.anchor_cos, first);
        let sines = group(&self.anchor_sin, first);
        let tangents = group(&self.anchor_tan, first);
        let reaches = group(&self.reach_tan, first);
        let first_coses = group(&self.first_cos, first);
        let last_coses = group(&self.last_cos, first);
        let columns = group(&self.columns, first);
        let rows = group(&self.rows, first);
        let wides = group(&self.wide, first);
        let columns_reach = grid.reach(0, 1);

        let mut planes = [[[0.0; GROUP]; 3]; 4];
        let mut offs = [0.0; GROUP];
        let (mut ats, mut acrosses) = ([[0.0; GROUP]; 4], [[0.0; GROUP]; 4]);
        let (mut bends, mut downs) = ([[0.0; GROUP]; 4], [[0.0; GROUP]; 4]);
        let (mut edge_errors, mut inverse_t_errors) = ([0.0; GROUP], [0.0; GROUP]);
        let mut kinds = [0; GROUP];
        for i in 0..GROUP {
            let a = dvec3(xs[0][i], ys[0][i], zs[0][i]);
            let b = dvec3(xs[1][i], ys[1][i], zs[1][i]);
            let c = dvec3(xs[2][i], ys[2][i], zs[2][i]);
            let normal = cross(b - a, c - a);
            let offset = dot(normal, a);
            let size = size_of(a) * size_of(normal);

            let sign = if offset > 0.0 { 1.0 } else { -1.0 };
            // Edge k is opposite to corner k: it runs from corner k + 1 to corner k + 2.
            let across = [cross(b, c), cross(c, a), cross(a, b)];
            let shorter = [1.0 / size_of(across[0]), 1.0 / size_of(across[1]), 1.0 / size_of(across[2])];
            let off = high([
                size_of(b) * size_of(c) * shorter[0],
                size_of(c) * size_of(a) * shorter[1],
                size_of(a) * size_of(b) * shorter[2],
            ]);
            let edges = [
                across[0] * (sign * shorter[0]),
                across[1] * (sign * shorter[1]),
                across[2] * (sign * shorter[2]),
            ];
            let inverse_t = normal * (1.0 / offset);
            let edge_off = 1e-15 * off;

            let anchor = ChunkAnchor { cos: coses[i], sin: sines[i], tan: tangents[i] };
            let cos = [first_coses[i], last_coses[i]];
            let reach = Reach { tan: reaches[i], cos, ..columns_reach };
            let f = [
                anchor.linear(&edges[0]),
                anchor.linear(&edges[1]),
                anchor.linear(&edges[2]),
                anchor.linear(&inverse_t),
            ];
            let edge_error = anchor.edge_error(&[f[0], f[1], f[2]], &reach, edge_off);
            let (lowest, error) = reach.trust(&f[3]);

            // The kind, without branches: each line overrides the ones before it.
            let trusted = error < TRUSTED * lowest;
            let half = columns[i] <= (LANES / 2) as f32;
            let kind = if half {
                DrawKind::Narrow as u32
            } else {
                DrawKind::Small as u32
            };
            let wide = columns[i] <= (2 * LANES) as f32;
            let wide = if wide {
                DrawKind::Wide as u32
            } else {
                DrawKind::Large as u32
            };
            let kind = if columns[i] <= LANES as f32 { kind } else { wide };
            let careful = columns[i] <= LANES as f32;
            let careful = if careful {
                DrawKind::Careful as u32
            } else {
                DrawKind::Large as u32
            };
            let kind = if trusted { kind } else { careful };
            let kind = if rows[i] <= MAX_ROWS as f32 {
                kind
            } else {
                DrawKind::Large as u32
            };
            let kind = if off < FIRM { kind } else { DrawKind::InSpace as u32 };
            let kind = if offset.abs() > 1e-6 * size {
                kind
            } else {
                DrawKind::InSpace as u32
            };
            kinds[i] = if wides[i] == 0 { kind } else { DrawKind::InSpace as u32 };

            (offs[i], edge_errors[i], inverse_t_errors[i]) = (edge_off, edge_error, error);
            for (k, n) in [edges[0], edges[1], edges[2], inverse_t].into_iter().enumerate() {
                (planes[k][0][i], planes[k][1][i], planes[k][2][i]) = (n.x, n.y, n.z);
            }
            for k in 0..4 {
                (ats[k][i], acrosses[k][i]) = (f[k].at, f[k].across);
                (bends[k][i], downs[k][i]) = (f[k].bend, f[k].down);
            }
        }

        for k in 0..4 {
            put(&mut self.planes[k][0], first, &planes[k][0]);
            put(&mut self.planes[k][1], first, &planes[k][1]);
            put(&mut self.planes[k][2], first, &planes[k][2]);
            put(&mut self.at[k], first, &ats[k]);
            put(&mut self.across[k], first, &acrosses[k]);
            put(&mut self.bend[k], first, &bends[k]);
            put(&mut self.down[k], first, &downs[k]);
        }
        put(&mut self.edge_off, first, &offs);
        put(&mut self.edge_error, first, &edge_errors);
        put(&mut self.inverse_t_error, first, &inverse_t_errors);
        put(&mut self.kind, first, &kinds);
    }

    /// Iterates over the positions of the faces of a kind.
    #[inline(always)]
    pub(crate) fn faces(&self, kind: DrawKind) -> impl Iterator<Item = usize> {
        self.by_kind.faces(kind)
    }

    /// Returns the place of a face in its cluster.
    #[inline(always)]
    pub(crate) fn place_in_cluster(&self, j: usize) -> usize {
        usize::from(self.places[j]) % MAX_FACES
    }

    /// Returns the only or the first chunk of a face, and its number of rows.
    #[inline(always)]
    pub(crate) fn chunk(&self, j: usize, slot: u32) -> (Chunk, usize) {
        let f = |k: usize| Linear {
            at: self.at[k][j],
            across: self.across[k][j],
            bend: self.bend[k][j],
            down: self.down[k][j],
        };
        let bounds = self.bounds(j);
        let chunk = Chunk {
            column: bounds.left,
            row: bounds.top,
            edges: [f(0), f(1), f(2)],
            edge_error: self.edge_error[j],
            inverse_t: f(3),
            inverse_t_error: self.inverse_t_error[j],
            trusted: self.inverse_t_error[j] / TRUSTED,
            slot,
        };
        (chunk, bounds.bottom - bounds.top + 1)
    }

    #[inline(always)]
    pub(crate) fn planes(&self, j: usize) -> PanoramaPlanes {
        let plane = |k: usize| {
            let [x, y, z] = &self.planes[k];
            dvec3(x[j], y[j], z[j])
        };
        PanoramaPlanes {
            edges: [plane(0), plane(1), plane(2)],
            inverse_t: plane(3),
            edge_off: self.edge_off[j],
        }
    }

    #[inline(always)]
    pub(crate) fn bounds(&self, j: usize) -> PanoramaBounds {
        self.bounds_in_cluster(self.place_in_cluster(j))
    }

    /// Returns the azimuths of the corners of a face that is too wide for bounds; `None` for other faces.
    pub(crate) fn wide_azimuths(&self, j: usize) -> Option<[f32; 3]> {
        let i = self.place_in_cluster(j);
        (self.wide[j] != 0).then(|| [self.azimuth[0][i], self.azimuth[1][i], self.azimuth[2][i]])
    }

    #[inline(always)]
    fn bounds_in_cluster(&self, i: usize) -> PanoramaBounds {
        PanoramaBounds {
            left: self.left[i] as usize,
            right: self.right[i] as usize,
            top: self.top[i] as usize,
            bottom: self.bottom[i] as usize,
        }
    }
}

#[inline(always)]
fn cross(a: DVec3, b: DVec3) -> DVec3 {
    dvec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

#[inline(always)]
fn dot(a: DVec3, b: DVec3) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// Returns the sum of the absolute values of the coordinates.
#[inline(always)]
fn size_of(v: DVec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}
