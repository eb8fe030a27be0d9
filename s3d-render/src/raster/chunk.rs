//! Draws a part of a face on sixteen columns and some rows of a window.
//!
//! [`crate::raster::canvas`] explains what is drawn, and why it is exact.

use crate::simd::raster_lanes::{LANES, RasterLanes};
use std::slice::from_raw_parts_mut;

/// The most rows of a chunk.
pub(crate) const MAX_ROWS: usize = 32;

/// A pixel is uncertain if an edge function, about a distance in pixels, is nearer to zero than this.
pub(crate) const EDGE_ERROR: f32 = 3e-5;

/// A pixel trusts 1/t only if its relative error is below this.
pub(crate) const TRUSTED: f32 = 1e-5;

/// The rounding error of 1/t in a chunk, as a part of the sum of the sizes of its terms.
pub(crate) const INVERSE_T_ROUNDING: f32 = 3e-7;

/// Two values of 1/t that differ by no more steps of the last place than this are ordered by exact
/// arithmetic.
pub(crate) const CLOSE_ULPS: i32 = 424;

/// A linear function of the pixel in a chunk.
///
/// Its value in column i and row j from the anchor is at + across·u(i) + bend·v(i) + down·r(j): see
/// [`ChunkGrid`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Linear {
    pub(crate) at: f32,
    pub(crate) across: f32,
    /// 0 in perspective views.
    pub(crate) bend: f32,
    pub(crate) down: f32,
}

/// A part of a face that is about to be drawn on 16 columns and some rows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Chunk {
    /// The column and the row of the anchor.
    pub(crate) column: usize,
    pub(crate) row: usize,
    pub(crate) edges: [Linear; 3],
    /// A bound on the error of the edge functions.
    pub(crate) edge_error: f32,
    pub(crate) inverse_t: Linear,
    /// A bound on the error of `inverse_t`. It is needed only if the chunk is drawn with care.
    pub(crate) inverse_t_error: f32,
    /// The error of `inverse_t` is below [`TRUSTED`] from this value on. It is needed only if the chunk is
    /// drawn with care.
    pub(crate) trusted: f32,
    /// The number of the face: see [`enter`](crate::raster::canvas::Canvas::enter).
    pub(crate) slot: u32,
}

/// The functions u, v and r of a chunk's columns and rows, and the factors of 1/t by row.
#[derive(Clone, Copy)]
pub(crate) struct ChunkGrid<'a> {
    pub(crate) u: &'a [f32; LANES],
    pub(crate) v: &'a [f32; LANES],
    pub(crate) rows: &'a [f32; MAX_ROWS],
    /// The number of rows, at least one.
    pub(crate) count: usize,
    /// One factor a row; empty in perspective views.
    pub(crate) scale: &'a [f32],
}

/// The memory by row that drawing a chunk needs. It is reused for one chunk after another without clearing:
/// with clearing, views took 1.06 to 1.15 times as long.
#[derive(Default)]
#[repr(align(64))]
pub(crate) struct RowScratch {
    /// The terms of the edge functions and of 1/t by row. The processor can spread a number from memory over
    /// a register without an extra instruction.
    down: [[f32; MAX_ROWS]; 4],
    /// The doubtful pixels of the rows of the last chunk; entries beyond its rows are stale.
    pub(crate) doubts: [u16; MAX_ROWS],
}

/// Draws a chunk: see [`Canvas::draw`](crate::raster::canvas::Canvas::draw). `best` and `slots` begin at its
/// anchor, and their rows are `pitch` apart. Notes the doubtful pixels by row, and returns whether there are
/// any. The caller handles them: a call between rows would spill registers.
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
        // SAFETY: `k` is below `rows`, and both slices were asserted to hold that many rows.
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

/// Evaluates a function in the first row of a chunk. It is no closure: see [`crate::simd`].
#[inline(always)]
fn along<L: RasterLanes, const PANORAMA: bool>(l: L, f: &Linear, (u, v): (L::F, L::F)) -> L::F {
    let sum = l.add(l.mul(l.splat(f.across), u), l.splat(f.at));
    if PANORAMA {
        l.add(l.mul(l.splat(f.bend), v), sum)
    } else {
        sum
    }
}
