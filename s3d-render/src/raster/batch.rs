//! Sets up the faces of a cluster in a perspective view, eight at a time.
//!
//! Setting up one face after another is a chain of divisions and of unpredictable branches: whether the face
//! is in the window, whether it is small, and how wide it is. So all faces of a cluster are set up first, in
//! arrays and without branches. They are then sorted by how they are drawn, and drawn kind by kind.

#![expect(
    clippy::unwrap_used,
    reason = "slices are cut to the length of the array: there is nothing left of the check"
)]

use crate::raster::chunk::{Chunk, EDGE_ERROR, INVERSE_T_ROUNDING, Linear, MAX_ROWS, TRUSTED};
use crate::raster::pinhole::{PinholeBounds, PinholeCorners, PinholePlanes};
use crate::raster::{high, low, max, min};
use crate::scene::clusters::MAX_FACES;
use crate::simd::raster_lanes::LANES;

/// An edge shorter than this, in pixels, has no reliable direction: see the module `pinhole`.
const SHORT: f64 = 1e-3;

/// The distance in pixels around a face's corners that the face may still cover, given rounding.
const MARGIN: f64 = 1e-4;

/// The number of faces that are set up together.
pub(crate) const GROUP: usize = 8;

/// How a face is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DrawKind {
    /// The face covers no centre of a pixel.
    Nothing = 0,
    /// The face fits in one chunk of at most 8 columns.
    Narrow,
    /// The face fits in one chunk.
    Small,
    /// The face fits in one chunk that is drawn with care.
    Careful,
    /// The face fits in two chunks side by side.
    Wide,
    /// The face is drawn tile by tile.
    Large,
    /// The face is drawn from its planes in space: it is behind the camera, too far out, or has almost no
    /// area.
    InSpace,
}

pub(crate) type Values<T> = [T; MAX_FACES];

/// The faces of a cluster by kind.
pub(crate) struct FacesByKind {
    lists: [Values<u8>; KINDS],
    counts: [usize; KINDS],
}

const KINDS: usize = 7;

impl FacesByKind {
    pub(crate) fn new() -> Self {
        Self { lists: [[0; MAX_FACES]; KINDS], counts: [0; KINDS] }
    }

    /// Sorts faces by their kinds.
    #[inline(always)]
    pub(crate) fn sort(&mut self, kinds: &[u32]) {
        self.counts = [0; KINDS];
        for (i, &kind) in kinds.iter().enumerate() {
            let list = &mut self.lists[kind as usize];
            let count = &mut self.counts[kind as usize];
            list[*count % MAX_FACES] = i as u8;
            *count += 1;
        }
    }

    /// Iterates over the places of the faces of a kind.
    #[inline(always)]
    pub(crate) fn faces(&self, kind: DrawKind) -> impl Iterator<Item = usize> {
        let list = &self.lists[kind as usize][..self.counts[kind as usize]];
        list.iter().map(|&i| usize::from(i) % MAX_FACES)
    }
}

/// The set-up of each face of a cluster.
pub(crate) struct FaceBatch {
    /// 1/z of the corners.
    q: [Values<f64>; 3],
    /// The first and last column and row of pixels, clipped to the window.
    left: Values<u32>,
    right: Values<u32>,
    top: Values<u32>,
    bottom: Values<u32>,
    /// See [`PinholePlanes`].
    at: [Values<f64>; 4],
    across: [Values<f64>; 4],
    down: [Values<f64>; 4],
    /// The functions at the first column and row.
    chunk_at: [Values<f32>; 4],
    /// A bound on the error of 1/t in the one or two chunks of a face.
    error: Values<f32>,
    kind: Values<u32>,
    by_kind: FacesByKind,
}

impl FaceBatch {
    pub(crate) fn new() -> Self {
        Self {
            q: [[0.0; MAX_FACES]; 3],
            left: [0; MAX_FACES],
            right: [0; MAX_FACES],
            top: [0; MAX_FACES],
            bottom: [0; MAX_FACES],
            at: [[0.0; MAX_FACES]; 4],
            across: [[0.0; MAX_FACES]; 4],
            down: [[0.0; MAX_FACES]; 4],
            chunk_at: [[0.0; MAX_FACES]; 4],
            error: [0.0; MAX_FACES],
            kind: [0; MAX_FACES],
            by_kind: FacesByKind::new(),
        }
    }

    /// Sets up the faces of a cluster, given by the places of their corners, in a window of `width` ×
    /// `height`.
    #[inline(always)]
    pub(crate) fn set_up(&mut self, faces: &[[u8; 4]], corners: &PinholeCorners, width: f64, height: f64) {
        for first in (0..faces.len()).step_by(GROUP) {
            self.set_up_group(first, faces, corners, (width - 1.0, height - 1.0));
        }
        self.by_kind.sort(&self.kind[..faces.len()]);
    }

    #[inline(always)]
    fn set_up_group(
        &mut self,
        first: usize,
        faces: &[[u8; 4]],
        corners: &PinholeCorners,
        (last_column, last_row): (f64, f64),
    ) {
        let (mut xs, mut ys, mut qs) = ([[0.0; GROUP]; 3], [[0.0; GROUP]; 3], [[0.0; GROUP]; 3]);
        for i in 0..GROUP {
            // The last group is filled up with the last face; these entries are never read.
            let places = faces[(first + i).min(faces.len() - 1)];
            for k in 0..3 {
                let place = usize::from(places[k]);
                xs[k][i] = corners.x[place];
                ys[k][i] = corners.y[place];
                qs[k][i] = corners.inverse_z[place];
            }
        }

        // Each result has an array of its own, so that the compiler sets up all faces of the group at once.
        let (mut lefts, mut rights) = ([0.0; GROUP], [0.0; GROUP]);
        let (mut tops, mut bottoms) = ([0.0; GROUP], [0.0; GROUP]);
        let (mut ats, mut acrosses, mut downs) = ([[0.0; GROUP]; 4], [[0.0; GROUP]; 4], [[0.0; GROUP]; 4]);
        let mut chunk_ats = [[0.0; GROUP]; 4];
        let mut errors = [0.0; GROUP];
        let mut kinds = [DrawKind::Nothing as u32; GROUP];
        let mut any = 0;

        // The pixels around each face.
        for i in 0..GROUP {
            let x = [xs[0][i], xs[1][i], xs[2][i]];
            let y = [ys[0][i], ys[1][i], ys[2][i]];
            let left = max((low(x) - MARGIN).ceil(), 0.0);
            let right = min((high(x) + MARGIN).floor(), last_column);
            let top = max((low(y) - MARGIN).ceil(), 0.0);
            let bottom = min((high(y) + MARGIN).floor(), last_row);
            let covers = (left <= right) & (top <= bottom);
            let in_front = low([qs[0][i], qs[1][i], qs[2][i]]) > 0.0;
            any |= u32::from(covers | !in_front);
            (lefts[i], rights[i], tops[i], bottoms[i]) = (left, right, top, bottom);
        }

        // If faces are smaller than pixels, many groups have nothing to draw.
        if any == 0 {
            return put(&mut self.kind, first, &kinds);
        }

        // Edge functions, 1/t and the kind of each face.
        for i in 0..GROUP {
            let x = [xs[0][i], xs[1][i], xs[2][i]];
            let y = [ys[0][i], ys[1][i], ys[2][i]];
            let q = [qs[0][i], qs[1][i], qs[2][i]];
            let left = lefts[i];
            let right = rights[i];
            let top = tops[i];
            let bottom = bottoms[i];

            // Edge k is opposite to corner k: it runs from corner k + 1 to corner k + 2.
            let across = [y[1] - y[2], y[2] - y[0], y[0] - y[1]];
            let down = [x[2] - x[1], x[0] - x[2], x[1] - x[0]];
            let at = [
                -(across[0] * x[1] + down[0] * y[1]),
                -(across[1] * x[2] + down[1] * y[2]),
                -(across[2] * x[0] + down[2] * y[0]),
            ];
            let length = [
                across[0].abs() + down[0].abs(),
                across[1].abs() + down[1].abs(),
                across[2].abs() + down[2].abs(),
            ];

            // Twice the area: the sum of the edge functions, anywhere.
            let area = across[0] * (x[0] - x[1]) + down[0] * (y[0] - y[1]);
            let scale = 1.0 / area;
            let sign = if area > 0.0 { 1.0 } else { -1.0 };
            let factor = [sign / length[0], sign / length[1], sign / length[2]];
            let sum = |f: [f64; 3]| (q[0] * f[0] + q[1] * f[1] + q[2] * f[2]) * scale;
            let at = [at[0] * factor[0], at[1] * factor[1], at[2] * factor[2], sum(at)];
            let across = [across[0] * factor[0], across[1] * factor[1], across[2] * factor[2], sum(across)];
            let down = [down[0] * factor[0], down[1] * factor[1], down[2] * factor[2], sum(down)];

            // The functions at the first column and row.
            let chunk_at = [
                (at[0] + across[0] * left + down[0] * top) as f32,
                (at[1] + across[1] * left + down[1] * top) as f32,
                (at[2] + across[2] * left + down[2] * top) as f32,
                (at[3] + across[3] * left + down[3] * top) as f32,
            ];

            // A second chunk begins sixteen columns on. The bounds of a chunk that is twice as wide cover its
            // terms.
            let small = right - left < LANES as f64;
            let bounds = if small { 15.0 } else { 31.0 };
            let spread = (across[3] as f32).abs() * bounds
                + (down[3] as f32).abs() * (bottom - top) as f32
                + chunk_at[3].abs();
            let error = INVERSE_T_ROUNDING * spread;

            // The kind, without branches: each line overrides the ones before it.
            let trusted = error < TRUSTED * low(q) as f32;
            let kind = if right - left < (LANES / 2) as f64 {
                DrawKind::Narrow as u32
            } else {
                DrawKind::Small as u32
            };
            let kind = if trusted { kind } else { DrawKind::Careful as u32 };
            let kind = if small { kind } else { DrawKind::Large as u32 };
            let wide = if trusted { DrawKind::Wide as u32 } else { kind };
            let wide = if right - left < (2 * LANES) as f64 { wide } else { kind };
            let kind = if small { kind } else { wide };
            let kind = if bottom - top < MAX_ROWS as f64 {
                kind
            } else {
                DrawKind::Large as u32
            };
            let kind = if low(length) > SHORT {
                kind
            } else {
                DrawKind::InSpace as u32
            };
            let kind = if area.abs() > 1e-4 {
                kind
            } else {
                DrawKind::InSpace as u32
            };
            let kind = if left <= right { kind } else { DrawKind::Nothing as u32 };
            let kind = if top <= bottom { kind } else { DrawKind::Nothing as u32 };
            kinds[i] = if low(q) > 0.0 { kind } else { DrawKind::InSpace as u32 };

            errors[i] = error;
            for k in 0..4 {
                (ats[k][i], acrosses[k][i], downs[k][i]) = (at[k], across[k], down[k]);
                chunk_ats[k][i] = chunk_at[k];
            }
        }

        put(&mut self.left, first, &pixels(&lefts));
        put(&mut self.right, first, &pixels(&rights));
        put(&mut self.top, first, &pixels(&tops));
        put(&mut self.bottom, first, &pixels(&bottoms));
        put(&mut self.error, first, &errors);
        put(&mut self.kind, first, &kinds);
        put(&mut self.q[0], first, &qs[0]);
        put(&mut self.q[1], first, &qs[1]);
        put(&mut self.q[2], first, &qs[2]);
        for k in 0..4 {
            put(&mut self.at[k], first, &ats[k]);
            put(&mut self.across[k], first, &acrosses[k]);
            put(&mut self.down[k], first, &downs[k]);
            put(&mut self.chunk_at[k], first, &chunk_ats[k]);
        }
    }

    /// Iterates over the places of the faces of a kind in the cluster.
    #[inline(always)]
    pub(crate) fn faces(&self, kind: DrawKind) -> impl Iterator<Item = usize> {
        self.by_kind.faces(kind)
    }

    /// Returns 1/t as a function of the pixel: see [`DrawnFace`](crate::simd::raster_lanes::DrawnFace).
    #[inline(always)]
    pub(crate) fn inverse_t(&self, i: usize) -> [f64; 3] {
        [self.at[3][i], self.across[3][i], self.down[3][i]]
    }

    /// Returns the only or the first chunk of a face, and its number of rows. `trusted` is 0: a caller that
    /// draws with care sets it.
    #[inline(always)]
    pub(crate) fn chunk(&self, i: usize, slot: u32) -> (Chunk, usize) {
        let f = |k: usize| Linear {
            at: self.chunk_at[k][i],
            across: self.across[k][i] as f32,
            bend: 0.0,
            down: self.down[k][i] as f32,
        };
        let column = self.left[i] as usize;
        let row = self.top[i] as usize;
        let chunk = Chunk {
            column,
            row,
            edges: [f(0), f(1), f(2)],
            edge_error: EDGE_ERROR,
            inverse_t: f(3),
            inverse_t_error: self.error[i],
            trusted: 0.0,
            slot,
        };
        (chunk, self.bottom[i] as usize - row + 1)
    }

    /// Returns the second chunk of a face that has two, and the number of the face's columns in it.
    #[inline(always)]
    pub(crate) fn second_chunk(&self, i: usize, first: &Chunk) -> (Chunk, usize) {
        let left = f64::from(self.left[i]) + LANES as f64;
        let top = f64::from(self.top[i]);
        let at = |k: usize| (self.at[k][i] + self.across[k][i] * left + self.down[k][i] * top) as f32;
        let mut chunk = *first;
        chunk.column += LANES;
        chunk.edges[0].at = at(0);
        chunk.edges[1].at = at(1);
        chunk.edges[2].at = at(2);
        chunk.inverse_t.at = at(3);
        (chunk, self.right[i] as usize - chunk.column + 1)
    }

    #[inline(always)]
    pub(crate) fn planes(&self, i: usize) -> PinholePlanes {
        let four = |f: &[Values<f64>; 4]| [f[0][i], f[1][i], f[2][i], f[3][i]];
        PinholePlanes { at: four(&self.at), across: four(&self.across), down: four(&self.down) }
    }

    #[inline(always)]
    pub(crate) fn bounds(&self, i: usize) -> PinholeBounds {
        let q = [self.q[0][i], self.q[1][i], self.q[2][i]];
        PinholeBounds {
            left: self.left[i] as usize,
            right: self.right[i] as usize,
            top: self.top[i] as usize,
            bottom: self.bottom[i] as usize,
            inverse_t: (low(q), high(q)),
        }
    }
}

/// Converts a group of whole numbers, at least 0, at once. The `as` operator would convert them one by one.
#[inline(always)]
fn pixels(whole: &[f64; GROUP]) -> [u32; GROUP] {
    let mut pixels = [0; GROUP];
    for i in 0..GROUP {
        // From 2⁵² on, the low bits of an `f64` are the whole number itself.
        pixels[i] = (whole[i] + (1u64 << 52) as f64).to_bits() as u32;
    }
    pixels
}

#[inline(always)]
pub(crate) fn group<T: Copy>(values: &Values<T>, first: usize) -> [T; GROUP] {
    values[first..first + GROUP].try_into().unwrap()
}

#[inline(always)]
pub(crate) fn put<T: Copy>(values: &mut Values<T>, first: usize, group: &[T; GROUP]) {
    values[first..first + GROUP].copy_from_slice(group);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WIDTH: f64 = 90.0;
    const HEIGHT: f64 = 70.0;

    fn place_near(size: f64) -> impl Strategy<Value = f64> {
        prop_oneof![-0.2 * size..1.2 * size, (0.0..1.0f64).prop_map(move |s| (s * size).round())]
    }

    /// Returns a corner in or near the window with its 1/z, or a corner that the view cannot show.
    fn corner() -> impl Strategy<Value = [f64; 3]> {
        prop_oneof![
            12 => (place_near(WIDTH), place_near(HEIGHT), 0.1..10.0f64).prop_map(|(x, y, q)| [x, y, q]),
            1 => Just([f64::NAN, f64::INFINITY, 0.0]),
        ]
    }

    /// Returns corners that are close together, like the corners of a small face, or anywhere.
    fn face() -> impl Strategy<Value = [[f64; 3]; 3]> {
        (prop::array::uniform3(corner()), prop_oneof![Just(1.0), Just(0.3), Just(0.1)]).prop_map(
            |(c, spread)| {
                c.map(|p| [c[0][0] + (p[0] - c[0][0]) * spread, c[0][1] + (p[1] - c[0][1]) * spread, p[2]])
            },
        )
    }

    fn doubled_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    proptest! {
        #[test]
        fn a_face_reaches_over_the_pixels_in_it(faces in prop::collection::vec(face(), 1..=MAX_FACES)) {
            let mut corners = PinholeCorners::new();
            for (place, [x, y, q]) in faces.as_flattened().iter().enumerate() {
                (corners.x[place], corners.y[place], corners.inverse_z[place]) = (*x, *y, *q);
            }
            let places: Vec<_> = (0..faces.len() as u8).map(|i| [3 * i, 3 * i + 1, 3 * i + 2, 0]).collect();
            let mut batch = FaceBatch::new();
            // Stale entries of a fuller cluster must do no harm.
            batch.set_up(&vec![[0, 1, 2, 0]; MAX_FACES], &corners, WIDTH, HEIGHT);
            batch.set_up(&places, &corners, WIDTH, HEIGHT);

            let kinds = [
                DrawKind::Nothing, DrawKind::Narrow, DrawKind::Small, DrawKind::Careful, DrawKind::Wide,
                DrawKind::Large, DrawKind::InSpace,
            ];
            let mut kind_of = vec![None; faces.len()];
            for kind in kinds {
                for i in batch.faces(kind) {
                    prop_assert!(kind_of[i].replace(kind).is_none());
                }
            }

            for (i, c) in faces.iter().enumerate() {
                let kind = kind_of[i].unwrap();
                if c.iter().any(|p| p[2] == 0.0) {
                    prop_assert_eq!(kind, DrawKind::InSpace);
                    continue;
                }

                let [p, q, r] = c.map(|p| [p[0], p[1]]);
                let whole = doubled_area(p, q, r);
                let bounds = batch.bounds(i);
                let columns = bounds.left..=bounds.right;
                let rows = bounds.top..=bounds.bottom;
                let one = matches!(kind, DrawKind::Narrow | DrawKind::Small | DrawKind::Careful);

                if one || kind == DrawKind::Wide {
                    let most = if kind == DrawKind::Narrow { 8 } else if one { LANES } else { 2 * LANES };
                    prop_assert!(columns.clone().count() <= most && rows.clone().count() <= MAX_ROWS);
                }

                for (x, y) in (0..WIDTH as usize).flat_map(|x| (0..HEIGHT as usize).map(move |y| (x, y))) {
                    let at = [x as f64, y as f64];
                    let weights = [[at, q, r], [p, at, r], [p, q, at]]
                        .map(|[a, b, c]| doubled_area(a, b, c) / whole);
                    if !(weights.iter().all(|&w| w > 1e-6) && whole.abs() > 1e-3) {
                        continue;
                    }
                    prop_assert!(kind != DrawKind::Nothing && columns.contains(&x) && rows.contains(&y));
                    if !(one || kind == DrawKind::Wide) {
                        continue;
                    }

                    let (mut chunk, rows) = batch.chunk(i, 5);
                    if x >= chunk.column + LANES {
                        let (second, columns) = batch.second_chunk(i, &chunk);
                        prop_assert!(kind == DrawKind::Wide && x < second.column + columns);
                        chunk = second;
                    }

                    let u = (x - chunk.column) as f32;
                    let r = (y - chunk.row) as f32;
                    prop_assert!(y < chunk.row + rows && chunk.slot == 5);
                    let value = |f: &Linear| f.at + f.across * u + f.down * r;
                    prop_assert!(chunk.edges.iter().all(|e| value(e) > -EDGE_ERROR));
                    let expected = weights[0] * c[0][2] + weights[1] * c[1][2] + weights[2] * c[2][2];
                    let off = (f64::from(value(&chunk.inverse_t)) - expected).abs();
                    prop_assert!(off <= 1.01 * f64::from(chunk.inverse_t_error) + 1e-9 * expected, "{off}");
                }
            }
        }
    }
}
