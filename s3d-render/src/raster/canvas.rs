//! What the rays of a window see so far: the heart of the visibility pass.
//!
//! # The special case
//!
//! All rays of an image start at one point. Put it at zero: a face (a, b, c) is hit along the direction d
//! exactly if d lies inside the three planes through the origin and an edge, N₁ = b × c, N₂ = c × a,
//! N₃ = a × b (turned so that they look inwards), and 1/t = n · d / n · a, where n is the face's normal.
//! So four dot products with d decide everything, and each is a simple function of the pixel: linear in a
//! perspective view; in a row of a panorama, divided by the cosine of the latitude,
//! x cos θ + y sin θ + z tan φ. Faces are drawn one after another, as a rasteriser does, the nearest first
//! where that is known; what lies behind a tile of pixels that all see something nearer is not looked at.
//!
//! # Why it is exact
//!
//! The four functions are set up in `f64`, moved to a pixel at the face (the *anchor* of a chunk of 16 × up
//! to [`MAX_ROWS`] pixels), rounded to `f32` there, and evaluated with one multiplication and one addition a
//! row. Take an edge function e(i, j) = c + a·i + b·j with |a| + |b| = 1, so that e is about a distance in
//! pixels, and |i| ≤ 15, |j| ≤ 31. Near its zero |c| ≤ 46, so the roundings of a, b, c, two products
//! and two sums are at most 2⁻²⁴·(46 + 46 + 46 + 92) < 1.4e-5; `f64` before it adds less than 1e-8
//! (`pinhole` and `panorama` say why). [`EDGE_ERROR`] is twice that. A pixel where the smallest of the three
//! exceeds its error is *certainly* in the face; where it is below minus the error, certainly not.
//!
//! 1/t is off by at most 2⁻²²·(|c| + |a|·15 + |b|·31), which is held against what it is worth: where
//! that is more than [`TRUSTED`] of the value, the pixel is not certain. Values that differ by more than
//! [`CLOSE_ULPS`] steps of the last place (2.5e-5 of themselves at least: two errors, and some) are in order.
//!
//! Whatever is not certain — a pixel too near an edge, two faces almost equally far — goes to a list of
//! *doubts*: this face may be what this pixel sees. In the end each pixel on the list is decided among its
//! candidates by the exact [`Cone`](crate::ray::cone::Cone), as single rays are: the face that was certain of
//! it, and all doubts that are not clearly behind. A face that is in neither place is certainly missed, or
//! certainly behind a face that is certainly hit. So the face of every pixel is that of the exact ray, and no
//! seam, sliver or duplicate is lost.
//!
//! Depth is computed at the end from the `f64` functions of the face that is seen, and rounded once: within
//! one step of the last place of `f32` of what a single ray gives.
//!
//! [`EDGE_ERROR`]: crate::raster::chunk::EDGE_ERROR
//! [`TRUSTED`]: crate::raster::chunk::TRUSTED

#![expect(
    clippy::unwrap_used,
    reason = "slices are cut to the length of the array: there is nothing left of the check"
)]

use crate::hits::NO_FACE;
use crate::raster::chunk::{CLOSE_ULPS, Chunk, ChunkGrid, RowScratch, draw};
use crate::simd::raster_lanes::{DrawnFace, LANES, RasterLanes, RowGroup};

/// What is behind a tile must be so by this factor: ten times [`CLOSE_ULPS`].
const BEHIND: f32 = 1.0 + 5e-4;

/// Tiles of so many pixels, both ways, know the farthest that they see.
pub(crate) const TILE: usize = LANES;

/// What of a row of tiles lies between two rows: its first row, and how many there are.
#[inline(always)]
pub(crate) fn part_of_tile(tile_row: usize, top: usize, bottom: usize) -> (usize, usize) {
    let first = top.max(tile_row * TILE);
    (first, bottom.min(tile_row * TILE + TILE - 1) + 1 - first)
}

/// From where a tile is drawn to hold what of it lies between two columns, and whether half a register does.
#[inline(always)]
pub(crate) fn half_of_tile(tile_column: usize, left: usize, right: usize) -> (usize, bool) {
    let (first, middle) = (tile_column * TILE, tile_column * TILE + TILE / 2);
    if left >= middle {
        (middle, true)
    } else {
        (first, right < middle)
    }
}

/// A pixel that may see a face.
#[derive(Clone, Copy, Debug)]
struct Doubt {
    pixel: u32,
    slot: u32,
    /// A bound on 1/t from above.
    inverse_t: f32,
}

/// What a box may cover of a window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cover {
    /// First and last column and row of pixels.
    pub(crate) columns: (u16, u16),
    pub(crate) rows: (u16, u16),
    /// 1/t is nowhere greater; infinite if that is not known.
    pub(crate) inverse_t: f32,
}

impl Cover {
    /// The centres of pixels, at whole numbers, between columns and between rows of a window of
    /// `width` × `height`; `None` if there are none.
    #[inline(always)]
    pub(crate) fn new(
        (left, right): (f32, f32),
        (top, bottom): (f32, f32),
        (width, height): (usize, usize),
        inverse_t: f32,
    ) -> Option<Self> {
        let (left, right) = (left.ceil().max(0.0), right.floor().min((width - 1) as f32));
        let (top, bottom) = (top.ceil().max(0.0), bottom.floor().min((height - 1) as f32));
        (left <= right && top <= bottom).then_some(Self {
            columns: (left as u16, right as u16),
            rows: (top as u16, bottom as u16),
            inverse_t,
        })
    }
}

/// The visibility buffer of a window of an image; its memory serves one window after another.
#[derive(Default)]
pub(crate) struct Canvas {
    width: usize,
    height: usize,
    /// Pixels from row to row: some more than the width, so that chunks may reach over the edge.
    pitch: usize,
    /// 1/t of the nearest face that is certainly hit; 0 for none. Infinite beyond the edges.
    inverse_t: Vec<f32>,
    /// That face's slot; 0 for none.
    slots: Vec<u32>,
    /// By tile: a bound from below on `inverse_t`.
    farthest: Vec<f32>,
    /// By tile: whether that may have grown.
    stale: Vec<bool>,
    tile_columns: usize,
    /// By slot; the first stands for no face.
    drawn: Vec<DrawnFace>,
    rows: RowScratch,
    doubts: Vec<Doubt>,
    /// The pixels that see a face whose function is too poor: none but doubtful ones do.
    poor: Vec<u32>,
}

const NOTHING: DrawnFace = DrawnFace::new([0.0; 3], NO_FACE, false);

impl Canvas {
    /// Makes an empty window of a size.
    pub(crate) fn begin(&mut self, width: usize, height: usize) {
        if (self.width, self.height) != (width, height) {
            (self.width, self.height) = (width, height);
            self.pitch = (width + LANES).next_multiple_of(LANES);
            let rows = height.next_multiple_of(TILE);
            self.inverse_t.clear();
            self.inverse_t.resize(self.pitch * rows, f32::INFINITY);
            for row in self.inverse_t.chunks_exact_mut(self.pitch).take(height) {
                row[..width].fill(0.0);
            }
            self.slots.clear();
            self.slots.resize(self.pitch * rows, 0);
            self.tile_columns = width.div_ceil(TILE);
        }
        self.farthest.clear();
        self.farthest.resize(self.tile_columns * height.div_ceil(TILE), 0.0);
        self.stale.clear();
        self.stale.resize(self.farthest.len(), false);
        self.drawn.clear();
        self.drawn.push(NOTHING);
        self.doubts.clear();
        self.poor.clear();
    }

    /// Enters a face and says under which number.
    #[inline(always)]
    pub(crate) fn enter(&mut self, drawn: DrawnFace) -> u32 {
        self.drawn.push(drawn);
        self.drawn.len() as u32 - 1
    }

    /// Whether all that `cover` may show is behind what is seen already.
    #[inline(always)]
    pub(crate) fn hides(&mut self, cover: &Cover) -> bool {
        let bound = cover.inverse_t * BEHIND;
        let [left, right, top, bottom] =
            [cover.columns.0, cover.columns.1, cover.rows.0, cover.rows.1].map(usize::from);
        for row in top / TILE..=bottom / TILE {
            for column in left / TILE..=right / TILE {
                let tile = row * self.tile_columns + column;
                if self.farthest[tile] >= bound || self.stale[tile] && self.look_again(tile) >= bound {
                    continue;
                }
                // Some pixel of the tile sees farther; one of the cover's?
                let (x, y) = (column * TILE, row * TILE);
                let lanes = left.saturating_sub(x)..=(right - x).min(TILE - 1);
                for row in y.max(top)..=(y + TILE - 1).min(bottom) {
                    let at = row * self.pitch + x;
                    let pixels: &[f32; TILE] = self.inverse_t[at..at + TILE].try_into().unwrap();
                    let mut open = false;
                    for (k, pixel) in pixels.iter().enumerate() {
                        open |= (*pixel < bound) & (k >= *lanes.start()) & (k <= *lanes.end());
                    }
                    if open {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// Whether all of a tile is nearer than `inverse_t`, as far as is known.
    #[inline(always)]
    pub(crate) fn tile_hides(&mut self, column: usize, row: usize, inverse_t: f32) -> bool {
        self.farthest[row * self.tile_columns + column] >= inverse_t * BEHIND
    }

    #[inline(always)]
    fn look_again(&mut self, tile: usize) -> f32 {
        self.stale[tile] = false;
        let (x, y) = (tile % self.tile_columns * TILE, tile / self.tile_columns * TILE);
        let mut lanes = [f32::INFINITY; LANES];
        for row in y..y + TILE {
            let at = row * self.pitch + x;
            let pixels: &[f32; LANES] = self.inverse_t[at..at + LANES].try_into().unwrap();
            for k in 0..LANES {
                lanes[k] = if pixels[k] < lanes[k] { pixels[k] } else { lanes[k] };
            }
        }
        let farthest = lanes.iter().fold(f32::INFINITY, |a, &b| if b < a { b } else { a });
        self.farthest[tile] = farthest;
        farthest
    }

    /// Says that something was drawn in the cover.
    #[inline(always)]
    pub(crate) fn touch(&mut self, cover: &Cover) {
        let tile = |pixel: u16| usize::from(pixel) / TILE;
        for row in tile(cover.rows.0)..=tile(cover.rows.1) {
            let first = row * self.tile_columns;
            self.stale[first + tile(cover.columns.0)..=first + tile(cover.columns.1)].fill(true);
        }
    }

    #[inline(always)]
    pub(crate) fn touch_tile(&mut self, column: usize, row: usize) {
        self.stale[row * self.tile_columns + column] = true;
    }

    /// Draws a chunk; with `CARE` where 1/t is not trusted all over it; `PANORAMA` in panoramas.
    #[inline(always)]
    pub(crate) fn draw<L: RasterLanes, const PANORAMA: bool, const CARE: bool>(
        &mut self,
        l: L,
        grid: &ChunkGrid<'_>,
        chunk: &Chunk,
    ) {
        let at = chunk.row * self.pitch + chunk.column;
        let window = (&mut self.inverse_t[at..], &mut self.slots[at..], self.pitch);
        if draw::<L, PANORAMA, CARE>(l, window, grid, chunk, &mut self.rows) {
            self.doubt(grid, chunk, PANORAMA, CARE);
        }
    }

    /// Draws a chunk, `narrow` or not, with care unless 1/t is `trusted` all over it.
    #[inline(always)]
    pub(crate) fn draw_part<L: RasterLanes, const PANORAMA: bool>(
        &mut self,
        l: L,
        grid: &ChunkGrid<'_>,
        chunk: &Chunk,
        narrow: bool,
        trusted: bool,
    ) {
        match (narrow, trusted) {
            (true, true) => self.draw::<L::Half, PANORAMA, false>(l.half(), grid, chunk),
            (true, false) => self.draw::<L::Half, PANORAMA, true>(l.half(), grid, chunk),
            (false, true) => self.draw::<L, PANORAMA, false>(l, grid, chunk),
            (false, false) => self.draw::<L, PANORAMA, true>(l, grid, chunk),
        }
    }

    /// Notes the pixels of the chunk just drawn that may see its face.
    #[cold]
    #[inline(never)]
    fn doubt(&mut self, grid: &ChunkGrid<'_>, chunk: &Chunk, turn: bool, care: bool) {
        let f = &chunk.inverse_t;
        for (k, (&lanes, &row)) in self.rows.doubts.iter().zip(grid.rows).take(grid.count).enumerate() {
            let mut lanes = lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                if chunk.column + lane >= self.width {
                    continue;
                }
                let mut bound = f.across * grid.u[lane] + f.at;
                if turn {
                    bound += f.bend * grid.v[lane];
                }
                bound += f.down * row;
                if turn {
                    bound *= grid.scale[k];
                }
                if care {
                    bound += chunk.inverse_t_error;
                }
                let pixel = (chunk.row + k) * self.pitch + chunk.column + lane;
                self.doubts
                    .push(Doubt { pixel: pixel as u32, slot: chunk.slot, inverse_t: bound });
            }
        }
    }

    /// Decides the doubtful pixels. `decide` is given a column, a row and what was drawn there and may be
    /// seen, and says which of these it is (its place in the list), and whether its function is too poor to
    /// give a depth there.
    #[inline(always)]
    pub(crate) fn settle(
        &mut self,
        mut decide: impl FnMut(usize, usize, &[DrawnFace]) -> Option<(usize, bool)>,
    ) {
        let mut doubts = std::mem::take(&mut self.doubts);
        doubts.sort_unstable_by_key(|d| (d.pixel, d.slot));
        let (mut slots, mut candidates) = (Vec::new(), Vec::new());
        for group in doubts.chunk_by(|a, b| a.pixel == b.pixel) {
            let pixel = group[0].pixel as usize;
            let best = self.inverse_t[pixel];
            let reach = best.to_bits() as i32 - CLOSE_ULPS;
            slots.clear();
            slots.extend(
                group
                    .iter()
                    .filter(|d| d.inverse_t.to_bits() as i32 > reach)
                    .map(|d| d.slot),
            );
            if slots.is_empty() {
                continue;
            }
            if best > 0.0 {
                slots.push(self.slots[pixel]);
            }
            candidates.clear();
            candidates.extend(slots.iter().map(|&s| self.drawn[s as usize]));
            let decision = decide(pixel % self.pitch, pixel / self.pitch, &candidates);
            self.slots[pixel] = decision.map_or(0, |(which, _)| slots[which]);
            if decision.is_some_and(|(which, poor)| poor || candidates[which].is_poor()) {
                self.poor.push(pixel as u32);
            }
        }
        doubts.clear();
        self.doubts = doubts;
    }

    /// Writes faces and depths into `out`, whose first pixels are the window's and whose rows are `out_pitch`
    /// apart, and empties the window.
    ///
    /// `u` and `v` of the columns come in groups, `line` gives level and rise of a row: see [`DrawnFace`].
    /// `single` casts the ray of a pixel (column, row) to a face whose function is too poor.
    #[inline(always)]
    pub(crate) fn finish<L: RasterLanes, const PANORAMA: bool>(
        &mut self,
        l: L,
        out: (&mut [u32], &mut [f32]),
        out_pitch: usize,
        (u, v): (&[[f64; LANES]], &[[f64; LANES]]),
        line: impl Fn(usize) -> (f64, f64),
        single: impl Fn(u32, usize, usize) -> f64,
    ) {
        let width = self.width;
        for row in 0..self.height {
            let start = row * self.pitch;
            let slots = &mut self.slots[start..start + width.next_multiple_of(LANES)];
            let inverse_t = self.inverse_t[start..start + width].as_chunks_mut::<LANES>();
            let faces = &mut out.0[row * out_pitch..][..width];
            let depths = &mut out.1[row * out_pitch..][..width];
            let (level, rise) = line(row);
            let drawn = &self.drawn[..];
            let (faces, last_faces) = faces.as_chunks_mut::<LANES>();
            let (depths, last_depths) = depths.as_chunks_mut::<LANES>();
            let mut groups = slots.as_chunks_mut::<LANES>().0.iter_mut().zip(u.iter().zip(v));
            let full = faces.iter_mut().zip(depths).zip(inverse_t.0);
            for (((faces, depths), inverse_t), (slots, (u, v))) in full.zip(groups.by_ref()) {
                l.resolve::<PANORAMA>(slots, &RowGroup { u, v, level, rise }, drawn, faces, depths);
                (*slots, *inverse_t) = ([0; LANES], [0.0; LANES]);
            }
            // A last group that is not full.
            if let Some((slots, (u, v))) = groups.next() {
                let (mut faces, mut depths) = ([NO_FACE; LANES], [0.0; LANES]);
                l.resolve::<PANORAMA>(slots, &RowGroup { u, v, level, rise }, drawn, &mut faces, &mut depths);
                last_faces.copy_from_slice(&faces[..last_faces.len()]);
                last_depths.copy_from_slice(&depths[..last_depths.len()]);
                *slots = [0; LANES];
                inverse_t.1.fill(0.0);
            }
        }
        for &pixel in &self.poor {
            let (column, row) = (pixel as usize % self.pitch, pixel as usize / self.pitch);
            let at = row * out_pitch + column;
            out.1[at] = single(out.0[at], column, row) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cover_holds_the_centres_of_pixels_between_its_bounds() {
        let pixels = |columns, rows| Cover::new(columns, rows, (10, 6), 1.0).map(|c| (c.columns, c.rows));
        assert_eq!(pixels((0.2, 3.9), (1.0, 2.0)), Some(((1, 3), (1, 2))));
        assert_eq!(pixels((-7.5, 99.0), (-0.3, f32::INFINITY)), Some(((0, 9), (0, 5))));
        for between in [(0.2, 0.8), (-3.0, -0.1), (9.1, 20.0)] {
            assert_eq!(pixels(between, (0.0, 5.0)), None);
            assert_eq!(pixels((0.0, 9.0), (between.0 - 4.0, between.1 - 4.0)), None);
        }
    }
}
