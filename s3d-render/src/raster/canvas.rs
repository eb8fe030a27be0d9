//! The visibility buffer of a window: the faces that its rays see so far. It is the heart of the visibility
//! pass.
//!
//! # The special case
//!
//! All rays of an image start at one point. Put it at zero. Let N₁ = b × c, N₂ = c × a and N₃ = a ×
//! b be the normals of the planes through the origin and an edge of the face (a, b, c), turned inwards. The
//! direction d hits the face exactly if it lies inside all three planes. With the face's normal n, 1/t = n ·
//! d / n · a. So four dot products with d decide everything, and each is a simple function of the pixel. In
//! a perspective view it is linear. In a row of a panorama, divided by the cosine of the latitude, it is x
//! cos θ + y sin θ + z tan φ. Faces are drawn one after another, as a rasteriser does, the nearest first
//! as far as that is known. A face behind a tile of pixels that all see something nearer is skipped.
//!
//! # Why it is exact
//!
//! The four functions are set up in `f64` and moved to a pixel at the face: the *anchor* of a chunk of 16 ×
//! up to [`MAX_ROWS`] pixels. There they are rounded to `f32`, and evaluated with one multiplication and one
//! addition a row. Take an edge function e(i, j) = c + a·i + b·j with |a| + |b| = 1, so that e is about a
//! distance in pixels, and |i| ≤ 15, |j| ≤ 31. Near its zero |c| ≤ 46, so the roundings of a, b, c, two
//! products and two sums are at most 2⁻²⁴·(46 + 46 + 46 + 92) < 1.4e-5. The error of `f64` adds less
//! than 1e-8 (`pinhole` and `panorama` prove it). [`EDGE_ERROR`] is twice that. If the smallest of the three
//! functions exceeds the error, the pixel is *certainly* in the face; if it is below minus the error, the
//! pixel is certainly outside.
//!
//! The error of 1/t is at most 2⁻²²·(|c| + |a|·15 + |b|·31). If that is more than [`TRUSTED`] of the
//! value, the pixel is not certain. Two values that differ by more than [`CLOSE_ULPS`] steps of the last
//! place are in order: that is at least 2.5e-5 of themselves, more than two errors.
//!
//! An uncertain pixel is too close to an edge, or two of its faces are almost equally far. It goes to a list
//! of *doubts*: this face may be what this pixel sees. In the end, the exact [`Cone`](crate::ray::cone::Cone)
//! decides each pixel on the list among its candidates, as for single rays. The candidates are the face that
//! was certain, and all doubts that are not clearly behind it. Any other face is certainly missed, or
//! certainly behind a face that is certainly hit. So every pixel gets the face of the exact ray, and no seam,
//! sliver or duplicate is lost.
//!
//! The depth is computed at the end from the `f64` functions of the visible face, and rounded once. It is
//! within one step of the last place of `f32` of the depth of a single ray.
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

/// A face is behind a tile only if it is farther by this factor: ten times [`CLOSE_ULPS`].
const BEHIND: f32 = 1.0 + 5e-4;

/// The width and height of a tile in pixels. Each tile stores a bound on the farthest depth that it sees.
pub(crate) const TILE: usize = LANES;

/// Returns the rows of a row of tiles that lie between `top` and `bottom`: the first row and their number.
#[inline(always)]
pub(crate) fn part_of_tile(tile_row: usize, top: usize, bottom: usize) -> (usize, usize) {
    let first = top.max(tile_row * TILE);
    (first, bottom.min(tile_row * TILE + TILE - 1) + 1 - first)
}

/// Returns the column at which a tile is drawn, and whether half a register covers its columns between `left`
/// and `right`.
#[inline(always)]
pub(crate) fn half_of_tile(tile_column: usize, left: usize, right: usize) -> (usize, bool) {
    let first = tile_column * TILE;
    let middle = tile_column * TILE + TILE / 2;
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
    /// An upper bound on 1/t.
    inverse_t: f32,
}

/// The part of a window that a box may cover.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cover {
    /// The first and last column and row of pixels.
    pub(crate) columns: (u16, u16),
    pub(crate) rows: (u16, u16),
    /// An upper bound on 1/t; infinite if none is known.
    pub(crate) inverse_t: f32,
}

impl Cover {
    /// Returns the centres of pixels (at whole numbers) between two columns and two rows, in a window of
    /// `width` × `height`. Returns `None` if there are none.
    #[inline(always)]
    pub(crate) fn new(
        (left, right): (f32, f32),
        (top, bottom): (f32, f32),
        (width, height): (usize, usize),
        inverse_t: f32,
    ) -> Option<Self> {
        let left = left.ceil().max(0.0);
        let right = right.floor().min((width - 1) as f32);
        let top = top.ceil().max(0.0);
        let bottom = bottom.floor().min((height - 1) as f32);
        (left <= right && top <= bottom).then_some(Self {
            columns: (left as u16, right as u16),
            rows: (top as u16, bottom as u16),
            inverse_t,
        })
    }
}

/// The visibility buffer of a window of an image. Its memory is reused from window to window.
#[derive(Default)]
pub(crate) struct Canvas {
    width: usize,
    height: usize,
    /// The number of pixels from row to row. It exceeds the width, so that chunks may reach over the edge.
    pitch: usize,
    /// 1/t of the nearest face that is certainly hit; 0 if there is none. Infinite beyond the edges.
    inverse_t: Vec<f32>,
    /// The slot of that face; 0 if there is none.
    slots: Vec<u32>,
    /// A lower bound on `inverse_t` by tile.
    farthest: Vec<f32>,
    /// Whether the bound of a tile may have grown.
    stale: Vec<bool>,
    tile_columns: usize,
    /// The drawn faces by slot. Slot 0 stands for no face.
    drawn: Vec<DrawnFace>,
    rows: RowScratch,
    doubts: Vec<Doubt>,
    /// The pixels that see a face whose function is too poor. Only doubtful pixels can.
    poor: Vec<u32>,
}

const NOTHING: DrawnFace = DrawnFace::new([0.0; 3], NO_FACE, false);

impl Canvas {
    /// Prepares an empty window of `width` × `height`.
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

    /// Registers a face and returns its slot.
    #[inline(always)]
    pub(crate) fn enter(&mut self, drawn: DrawnFace) -> u32 {
        self.drawn.push(drawn);
        self.drawn.len() as u32 - 1
    }

    /// Tells whether everything in `cover` is behind what is already visible.
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

                // Some pixel of the tile sees farther; it counts only if it is in the cover.
                let x = column * TILE;
                let y = row * TILE;
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

    /// Tells whether all pixels of a tile are known to be nearer than `inverse_t`.
    #[inline(always)]
    pub(crate) fn tile_hides(&mut self, column: usize, row: usize, inverse_t: f32) -> bool {
        self.farthest[row * self.tile_columns + column] >= inverse_t * BEHIND
    }

    /// Recomputes the bound of a tile.
    #[inline(always)]
    fn look_again(&mut self, tile: usize) -> f32 {
        self.stale[tile] = false;
        let x = tile % self.tile_columns * TILE;
        let y = tile / self.tile_columns * TILE;
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

    /// Notes that the tiles of the cover were drawn on.
    #[inline(always)]
    pub(crate) fn touch(&mut self, cover: &Cover) {
        for row in tile_of(cover.rows.0)..=tile_of(cover.rows.1) {
            let first = row * self.tile_columns;
            self.stale[first + tile_of(cover.columns.0)..=first + tile_of(cover.columns.1)].fill(true);
        }
    }

    /// Notes that a tile was drawn on.
    #[inline(always)]
    pub(crate) fn touch_tile(&mut self, column: usize, row: usize) {
        self.stale[row * self.tile_columns + column] = true;
    }

    /// Draws a chunk. `CARE` is for chunks in which 1/t is not trusted everywhere, `PANORAMA` for panoramas.
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

    /// Draws a chunk on half a register if it is `narrow`, and with care unless 1/t is `trusted` everywhere.
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

    /// Notes the pixels of the last chunk that may see its face.
    #[cold]
    #[inline(never)]
    fn doubt(&mut self, grid: &ChunkGrid<'_>, chunk: &Chunk, panorama: bool, care: bool) {
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
                if panorama {
                    bound += f.bend * grid.v[lane];
                }
                bound += f.down * row;
                if panorama {
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

    /// Decides the doubtful pixels. `decide` gets a column, a row and the candidate faces there. It returns
    /// the place of the visible one in that list, and whether its function is too poor to give a depth.
    #[inline(always)]
    pub(crate) fn settle(
        &mut self,
        mut decide: impl FnMut(usize, usize, &[DrawnFace]) -> Option<(usize, bool)>,
    ) {
        let mut doubts = std::mem::take(&mut self.doubts);
        doubts.sort_unstable_by_key(|d| (d.pixel, d.slot));
        let mut slots = Vec::new();
        let mut candidates = Vec::new();

        for group in doubts.chunk_by(|a, b| a.pixel == b.pixel) {
            let pixel = group[0].pixel as usize;
            let best = self.inverse_t[pixel];
            let reach = best.to_bits() as i32 - CLOSE_ULPS;

            // Doubts that are not clearly behind, and the face that was certain.
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

    /// Writes faces and depths into `out` and empties the window. `out` begins at the window's first pixel;
    /// its rows are `out_pitch` apart.
    ///
    /// `u` and `v` of the columns come in groups, and `line` gives the level and the rise of a row: see
    /// [`DrawnFace`]. `single` casts the ray of a pixel (column, row) to a face whose function is too poor.
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

            // The last group, if it is not full.
            if let Some((slots, (u, v))) = groups.next() {
                let (mut faces, mut depths) = ([NO_FACE; LANES], [0.0; LANES]);
                l.resolve::<PANORAMA>(slots, &RowGroup { u, v, level, rise }, drawn, &mut faces, &mut depths);
                last_faces.copy_from_slice(&faces[..last_faces.len()]);
                last_depths.copy_from_slice(&depths[..last_depths.len()]);
                *slots = [0; LANES];
                inverse_t.1.fill(0.0);
            }
        }

        // Exact depths where a function is too poor.
        for &pixel in &self.poor {
            let column = pixel as usize % self.pitch;
            let row = pixel as usize / self.pitch;
            let at = row * out_pitch + column;
            out.1[at] = single(out.0[at], column, row) as f32;
        }
    }
}

fn tile_of(pixel: u16) -> usize {
    usize::from(pixel) / TILE
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels_of(columns: (f32, f32), rows: (f32, f32)) -> Option<((u16, u16), (u16, u16))> {
        Cover::new(columns, rows, (10, 6), 1.0).map(|c| (c.columns, c.rows))
    }

    #[test]
    fn a_cover_holds_the_centres_of_pixels_between_its_bounds() {
        assert_eq!(pixels_of((0.2, 3.9), (1.0, 2.0)), Some(((1, 3), (1, 2))));
        assert_eq!(pixels_of((-7.5, 99.0), (-0.3, f32::INFINITY)), Some(((0, 9), (0, 5))));
        for between in [(0.2, 0.8), (-3.0, -0.1), (9.1, 20.0)] {
            assert_eq!(pixels_of(between, (0.0, 5.0)), None);
            assert_eq!(pixels_of((0.0, 9.0), (between.0 - 4.0, between.1 - 4.0)), None);
        }
    }
}
