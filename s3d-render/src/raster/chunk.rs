//! Part of a face, drawn on sixteen columns and some rows of a window.
//!
//! [`crate::raster::canvas`] says what is drawn, and why it is exact.

use crate::simd::raster_lanes::{LANES, RasterLanes};
use std::slice::from_raw_parts_mut;

/// Rows of a chunk at most.
pub(crate) const MAX_ROWS: usize = 32;

/// Pixels whose edge function, about a distance in pixels, is nearer to zero are not certain.
pub(crate) const EDGE_ERROR: f32 = 3e-5;

/// A pixel trusts 1/t only if it is known to this part of itself.
pub(crate) const TRUSTED: f32 = 1e-5;

/// The rounding of 1/t in a chunk: this part of the sum of its terms' sizes.
pub(crate) const INVERSE_T_ROUNDING: f32 = 3e-7;

/// Values of 1/t that differ by no more steps of the last place are for exact arithmetic to order.
pub(crate) const CLOSE_ULPS: i32 = 424;

/// A linear function of the pixel in a chunk.
///
/// Its value in column i and row j from the anchor is at + across·u(i) + bend·v(i) + down·r(j): see
/// [`Chunk`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Linear {
    pub(crate) at: f32,
    pub(crate) across: f32,
    /// 0 in perspective views.
    pub(crate) bend: f32,
    pub(crate) down: f32,
}

/// Part of a face, about to be drawn on 16 columns and some rows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Chunk {
    /// Column and row of the anchor.
    pub(crate) column: usize,
    pub(crate) row: usize,
    pub(crate) edges: [Linear; 3],
    /// No edge function is farther off than this.
    pub(crate) edge_error: f32,
    pub(crate) inverse_t: Linear,
    /// No value of `inverse_t` is farther off than this. Only where the chunk is drawn with care.
    pub(crate) inverse_t_error: f32,
    /// From this value on, `inverse_t` is known to [`TRUSTED`]. Likewise.
    pub(crate) trusted: f32,
    /// The face, as [`enter`](crate::raster::canvas::Canvas::enter) says.
    pub(crate) slot: u32,
}

/// The functions u, v and r of a chunk's columns and rows, and by what 1/t is multiplied in a row.
#[derive(Clone, Copy)]
pub(crate) struct ChunkGrid<'a> {
    pub(crate) u: &'a [f32; LANES],
    pub(crate) v: &'a [f32; LANES],
    pub(crate) rows: &'a [f32; MAX_ROWS],
    /// How many rows there are; at least one.
    pub(crate) count: usize,
    /// One a row; nothing in perspective views.
    pub(crate) scale: &'a [f32],
}

/// What the drawing of a chunk keeps by row. Its memory serves one chunk after another: emptied for each,
/// views took 1.06 to 1.15 times as long.
#[derive(Default)]
#[repr(align(64))]
pub(crate) struct RowScratch {
    /// What each row adds to the edge functions and to 1/t: from here the processor spreads a number over a
    /// register without a step of its own.
    down: [[f32; MAX_ROWS]; 4],
    /// The doubtful pixels of the rows of the chunk that was drawn last; behind these, anything.
    pub(crate) doubts: [u16; MAX_ROWS],
}

/// Draws a chunk: see [`Canvas::draw`](crate::raster::canvas::Canvas::draw). `best` and `slots` begin at its
/// anchor, `pitch` is from row to row. Notes doubtful pixels by row, and says whether there are any: a call
/// from row to row would take the registers.
#[inline(always)]
#[allow(unsafe_code)]
pub(crate) fn draw<L: RasterLanes, const PANORAMA: bool, const CARE: bool>(
    l: L,
    (best, slots, pitch): (&mut [f32], &mut [u32], usize),
    grid: &ChunkGrid<'_>,
    chunk: &Chunk,
    RowScratch { down, doubts }: &mut RowScratch,
) -> bool {
    let rows = grid.count;
    assert!(0 < rows && rows <= MAX_ROWS && (!PANORAMA || rows <= grid.scale.len()));
    let cells = pitch.saturating_mul(rows - 1).saturating_add(L::N);
    assert!(cells <= best.len() && cells <= slots.len());
    let uv = (l.load(grid.u), l.load(grid.v));
    let [e0, e1, e2] = chunk.edges;
    let (a0, a1) = (along::<L, PANORAMA>(l, &e0, uv), along::<L, PANORAMA>(l, &e1, uv));
    let (a2, aq) = (along::<L, PANORAMA>(l, &e2, uv), along::<L, PANORAMA>(l, &chunk.inverse_t, uv));
    let (d0, d1) = (l.splat(e0.down), l.splat(e1.down));
    let (d2, dq) = (l.splat(e2.down), l.splat(chunk.inverse_t.down));
    let mut k = 0;
    while k < rows {
        let r = l.load(&grid.rows[k..]);
        l.store(&mut down[0][k..], l.mul(d0, r));
        l.store(&mut down[1][k..], l.mul(d1, r));
        l.store(&mut down[2][k..], l.mul(d2, r));
        l.store(&mut down[3][k..], l.mul(dq, r));
        k += L::N;
    }
    let (error, minus_error) = (l.splat(chunk.edge_error), l.splat(-chunk.edge_error));
    let (trusted, off) = (l.splat(chunk.trusted), l.splat(chunk.inverse_t_error));
    let mut any = 0;
    for k in 0..rows {
        // SAFETY: k is below `rows`; that so many rows are within both was asserted.
        let (best, slots) = unsafe {
            let (best, slots) = (best.as_mut_ptr().add(k * pitch), slots.as_mut_ptr().add(k * pitch));
            (from_raw_parts_mut(best, L::N), from_raw_parts_mut(slots, L::N))
        };
        let (r0, r1, r2) = (l.splat(down[0][k]), l.splat(down[1][k]), l.splat(down[2][k]));
        let inside = l.min(l.add(a0, r0), l.min(l.add(a1, r1), l.add(a2, r2)));
        let mut q = l.add(aq, l.splat(down[3][k]));
        if PANORAMA {
            q = l.mul(q, l.splat(grid.scale[k]));
        }
        let old = l.load(best);
        let mut wins = l.and(l.greater(inside, error), l.greater_by_ulps(q, old, CLOSE_ULPS));
        let mut rivals = l.greater(inside, minus_error);
        if CARE {
            wins = l.and(wins, l.greater(q, trusted));
            rivals = l.and(rivals, l.greater_by_ulps(l.add(q, off), old, -CLOSE_ULPS));
        } else {
            rivals = l.and(rivals, l.greater_by_ulps(q, old, -CLOSE_ULPS));
        }
        l.store_masked_f32(best, wins, q);
        l.store_masked_u32(slots, wins, chunk.slot);
        doubts[k] = l.bits(rivals) & !l.bits(wins);
        any |= doubts[k];
    }
    any != 0
}

/// A function in the first row of a chunk. No closure: see [`crate::simd`].
#[inline(always)]
fn along<L: RasterLanes, const PANORAMA: bool>(l: L, f: &Linear, (u, v): (L::F, L::F)) -> L::F {
    let sum = l.add(l.mul(l.splat(f.across), u), l.splat(f.at));
    if PANORAMA {
        l.add(l.mul(l.splat(f.bend), v), sum)
    } else {
        sum
    }
}
