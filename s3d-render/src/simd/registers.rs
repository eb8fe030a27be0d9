//! Sixteen pixels at a time: the few operations that the visibility pass needs, on the widest registers there are.
//!
//! Which set of instructions a processor has is asked when the program runs ([`run`]). All sets give the same bits:
//! products and sums are rounded one by one, never fused. Where time counts, no closure with instructions goes to `map` of
//! an array: that is compiled for any processor, and would be called.
#![expect(
    clippy::expect_used,
    reason = "slices are cut to the length of the array: there is nothing left of the check"
)]
#![allow(unsafe_code)]

use crate::raster::canvas::{CLOSE_ULPS, Chunk, ChunkGrid, DrawnFace, Linear, MAX_ROWS};
use std::slice::from_raw_parts_mut;

/// Pixels in a register (or in as many registers as it takes).
pub(crate) const LANES: usize = 16;

/// A set of instructions, as the proof that the processor has it, and registers of [`Registers::N`] pixels.
pub(crate) trait Registers: Copy {
    /// Pixels at a time; at most [`LANES`].
    const N: usize;
    /// `N` times `f32`.
    type F: Copy;
    /// `N` times yes or no.
    type M: Copy;
    /// Registers of 8 pixels, for what is narrow.
    type Half: Registers;

    fn half(self) -> Self::Half;
    fn splat(self, x: f32) -> Self::F;
    /// The first `N` of a slice. Panics if it is shorter; so do the others.
    fn load(self, from: &[f32]) -> Self::F;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// a > b; no for what is not a number.
    fn greater(self, a: Self::F, b: Self::F) -> Self::M;
    /// The bits of `a`, as an integer, are above those of `b` plus `ulps`: for numbers from 0 on, `a` is greater by
    /// more than so many times the last place.
    fn greater_by_ulps(self, a: Self::F, b: Self::F, ulps: i32) -> Self::M;
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    /// One bit a lane, the first lane's the lowest.
    fn bits(self, m: Self::M) -> u16;
    /// Overwrites the lanes in `m`.
    fn store_masked_f32(self, to: &mut [f32], m: Self::M, x: Self::F);
    /// Overwrites the lanes in `m`.
    fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32);

    /// Overwrites the first `N`.
    fn store(self, to: &mut [f32], x: Self::F);

    /// Draws a chunk: see [`Canvas::draw`](crate::raster::canvas::Canvas::draw). `best` and `slots` begin at its anchor, `pitch`
    /// is from row to row. Notes doubtful pixels by row, and says whether there are any: a call from row to row would
    /// take the registers.
    #[inline(always)]
    fn draw<const PANORAMA: bool, const CARE: bool>(
        self,
        (best, slots, pitch): (&mut [f32], &mut [u32], usize),
        grid: &ChunkGrid<'_>,
        chunk: &Chunk,
        doubts: &mut [u16; MAX_ROWS],
    ) -> bool {
        let l = self;
        let rows = grid.count;
        assert!(0 < rows && rows <= MAX_ROWS && (!PANORAMA || rows <= grid.scale.len()));
        let cells = pitch.saturating_mul(rows - 1).saturating_add(Self::N);
        assert!(cells <= best.len() && cells <= slots.len());
        let (u, v) = (l.load(grid.u), l.load(grid.v));
        let along = |f: &Linear| {
            let sum = l.add(l.mul(l.splat(f.across), u), l.splat(f.at));
            if PANORAMA { l.add(l.mul(l.splat(f.bend), v), sum) } else { sum }
        };
        let [e0, e1, e2] = chunk.edges;
        let (a0, a1, a2, aq) = (along(&e0), along(&e1), along(&e2), along(&chunk.inverse_t));
        // What each row adds: from here the processor spreads a number over a register without a step of its own.
        let mut down = [[0.0; MAX_ROWS]; 4];
        for (down, f) in down.iter_mut().zip([&e0, &e1, &e2, &chunk.inverse_t]) {
            let step = l.splat(f.down);
            let mut k = 0;
            while k < rows {
                l.store(&mut down[k..], l.mul(step, l.load(&grid.rows[k..])));
                k += Self::N;
            }
        }
        let (error, minus_error) = (l.splat(chunk.edge_error), l.splat(-chunk.edge_error));
        let (trusted, off) = (l.splat(chunk.trusted), l.splat(chunk.inverse_t_error));
        let mut any = 0;
        for k in 0..rows {
            // SAFETY: k is below `rows`; that so many rows are within both was asserted.
            let (best, slots) = unsafe {
                let (best, slots) = (best.as_mut_ptr().add(k * pitch), slots.as_mut_ptr().add(k * pitch));
                (from_raw_parts_mut(best, Self::N), from_raw_parts_mut(slots, Self::N))
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

    /// Depths and faces of [`LANES`] pixels that see the faces drawn in their slots. Every set of instructions gives the
    /// same bits. Panics if there is no such slot.
    #[inline(always)]
    fn resolve<const PANORAMA: bool>(
        self,
        slots: &[u32; LANES],
        line: &RowGroup<'_>,
        drawn: &[DrawnFace],
        faces: &mut [u32; LANES],
        depths: &mut [f32; LANES],
    ) {
        let mut values = [0.0; LANES];
        for k in 0..LANES {
            let DrawnFace { inverse_t, face, .. } = drawn[slots[k] as usize];
            faces[k] = face;
            let [at, across, bend] = along::<PANORAMA>(inverse_t, line);
            values[k] = at + across * line.u[k];
            if PANORAMA {
                values[k] += bend * line.v[k];
            }
        }
        for k in 0..LANES {
            depths[k] = (1.0 / values[k]).abs() as f32;
        }
    }
}

/// [`LANES`] pixels of a row, as the functions of [`DrawnFace`] take them.
#[derive(Clone, Copy)]
pub(crate) struct RowGroup<'a> {
    pub(crate) u: &'a [f64; LANES],
    pub(crate) v: &'a [f64; LANES],
    /// See [`DrawnFace`].
    pub(crate) level: f64,
    pub(crate) rise: f64,
}

/// The function of a [`DrawnFace`] in a row: at + across·u + bend·v.
#[inline(always)]
fn along<const PANORAMA: bool>([a, b, c]: [f64; 3], line: &RowGroup<'_>) -> [f64; 3] {
    if PANORAMA { [c * line.rise, a * line.level, b * line.level] } else { [a + c * line.rise, b, 0.0] }
}

/// Work that is compiled for every set of instructions. `run` and what it calls in its loops are `#[inline(always)]`.
pub(crate) trait Work {
    type Output;
    fn run<L: Registers>(self, lanes: L) -> Self::Output;
}

/// Spans `work` with the widest registers of the processor.
pub(crate) fn run<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        if has!("avx512f")
            && has!("avx512vl")
            && has!("avx512dq")
            && has!("avx512bw")
            && has!("bmi2")
            && has!("lzcnt")
        {
            // SAFETY: the processor has what the function is compiled for, which was just asked.
            return unsafe { x86::run_avx512(work) };
        }
        if has!("avx2") && has!("fma") && has!("bmi1") {
            // SAFETY: likewise.
            return unsafe { x86::run_avx2(work) };
        }
    }
    work.run(Portable::<LANES>)
}

/// Plain arrays of `N`, for any processor: the compiler uses the registers that every processor of the target has.
#[derive(Clone, Copy)]
pub(crate) struct Portable<const N: usize>;

impl<const N: usize> Registers for Portable<N> {
    const N: usize = N;
    type F = [f32; N];
    type M = [u32; N];
    type Half = Portable<8>;

    #[inline(always)]
    fn half(self) -> Self::Half {
        Portable
    }

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        [x; N]
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        *from.first_chunk().expect(SHORT)
    }

    #[inline(always)]
    fn store(self, to: &mut [f32], x: Self::F) {
        *to.first_chunk_mut().expect(SHORT) = x;
    }

    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        std::array::from_fn(|k| a[k] + b[k])
    }

    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        std::array::from_fn(|k| a[k] * b[k])
    }

    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        std::array::from_fn(|k| if a[k] < b[k] { a[k] } else { b[k] })
    }

    #[inline(always)]
    fn greater(self, a: Self::F, b: Self::F) -> Self::M {
        std::array::from_fn(|k| if a[k] > b[k] { u32::MAX } else { 0 })
    }

    #[inline(always)]
    fn greater_by_ulps(self, a: Self::F, b: Self::F, ulps: i32) -> Self::M {
        std::array::from_fn(|k| {
            let above = a[k].to_bits() as i32 > (b[k].to_bits() as i32).wrapping_add(ulps);
            if above { u32::MAX } else { 0 }
        })
    }

    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        std::array::from_fn(|k| a[k] & b[k])
    }

    #[inline(always)]
    fn bits(self, m: Self::M) -> u16 {
        (0..N).fold(0, |bits, k| bits | ((m[k] & 1) as u16) << k)
    }

    #[inline(always)]
    fn store_masked_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
        let to: &mut [f32; N] = to.first_chunk_mut().expect(SHORT);
        *to = std::array::from_fn(|k| if m[k] != 0 { x[k] } else { to[k] });
    }

    #[inline(always)]
    fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32) {
        let to: &mut [u32; N] = to.first_chunk_mut().expect(SHORT);
        *to = std::array::from_fn(|k| if m[k] != 0 { x } else { to[k] });
    }
}

const SHORT: &str = "a slice as long as a register";

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{LANES, Registers, RowGroup, SHORT, Work, along};
    use crate::raster::canvas::DrawnFace;
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) fn run_avx512<W: Work>(work: W) -> W::Output {
        work.run(Avx512(()))
    }

    #[target_feature(enable = "avx2,fma,bmi1")]
    pub(super) fn run_avx2<W: Work>(work: W) -> W::Output {
        work.run(Avx2::<2>(()))
    }

    /// One register of 512 bits. Made only where the processor is known to have AVX-512 (F, VL, DQ, BW), AVX2 and FMA.
    #[derive(Clone, Copy)]
    pub(super) struct Avx512(());

    // SAFETY of all that follows: a value of the type exists only inside `run_avx512`, so the processor has the
    // instructions; loads and stores go through references to arrays of sixteen.
    impl Registers for Avx512 {
        const N: usize = LANES;
        type F = __m512;
        type M = __mmask16;
        type Half = Avx2<1>;

        #[inline(always)]
        fn half(self) -> Self::Half {
            Avx2(())
        }

        #[inline(always)]
        fn splat(self, x: f32) -> Self::F {
            unsafe { _mm512_set1_ps(x) }
        }

        #[inline(always)]
        fn load(self, from: &[f32]) -> Self::F {
            let from: &[f32; LANES] = from.first_chunk().expect(SHORT);
            unsafe { _mm512_loadu_ps(from.as_ptr()) }
        }

        #[inline(always)]
        fn store(self, to: &mut [f32], x: Self::F) {
            let to: &mut [f32; LANES] = to.first_chunk_mut().expect(SHORT);
            unsafe { _mm512_storeu_ps(to.as_mut_ptr(), x) }
        }

        #[inline(always)]
        fn add(self, a: Self::F, b: Self::F) -> Self::F {
            unsafe { _mm512_add_ps(a, b) }
        }

        #[inline(always)]
        fn mul(self, a: Self::F, b: Self::F) -> Self::F {
            unsafe { _mm512_mul_ps(a, b) }
        }

        #[inline(always)]
        fn min(self, a: Self::F, b: Self::F) -> Self::F {
            unsafe { _mm512_min_ps(a, b) }
        }

        #[inline(always)]
        fn greater(self, a: Self::F, b: Self::F) -> Self::M {
            unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(a, b) }
        }

        #[inline(always)]
        fn greater_by_ulps(self, a: Self::F, b: Self::F, ulps: i32) -> Self::M {
            unsafe {
                let b = _mm512_add_epi32(_mm512_castps_si512(b), _mm512_set1_epi32(ulps));
                _mm512_cmpgt_epi32_mask(_mm512_castps_si512(a), b)
            }
        }

        #[inline(always)]
        fn and(self, a: Self::M, b: Self::M) -> Self::M {
            a & b
        }

        #[inline(always)]
        fn bits(self, m: Self::M) -> u16 {
            m
        }

        #[inline(always)]
        fn store_masked_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
            let to: &mut [f32; LANES] = to.first_chunk_mut().expect(SHORT);
            unsafe { _mm512_mask_storeu_ps(to.as_mut_ptr(), m, x) }
        }

        #[inline(always)]
        fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32) {
            let to: &mut [u32; LANES] = to.first_chunk_mut().expect(SHORT);
            unsafe { _mm512_mask_storeu_epi32(to.as_mut_ptr().cast(), m, _mm512_set1_epi32(x as i32)) }
        }

        #[inline(always)]
        fn resolve<const PANORAMA: bool>(
            self,
            slots: &[u32; LANES],
            line: &RowGroup<'_>,
            drawn: &[DrawnFace],
            faces: &mut [u32; LANES],
            depths: &mut [f32; LANES],
        ) {
            // SAFETY: as above, and with AVX-512 there is AVX2.
            unsafe {
                let all = _mm512_loadu_epi32(slots.as_ptr().cast());
                // Mostly there is one face, in a panorama one or two. (Perspective views with small faces are faster if
                // their pairs count as a mixture.)
                let these = _mm512_cmpeq_epi32_mask(all, _mm512_set1_epi32(slots[0] as i32));
                let other = if PANORAMA { slots[these.trailing_ones() as usize % LANES] } else { slots[0] };
                if these | _mm512_cmpeq_epi32_mask(all, _mm512_set1_epi32(other as i32)) != u16::MAX {
                    return resolve::<PANORAMA>(slots, line, drawn, faces, depths);
                }
                let (one, other) = (&drawn[slots[0] as usize], &drawn[other as usize]);
                let seen = _mm512_set1_epi32(other.face as i32);
                let seen = _mm512_mask_set1_epi32(seen, these, one.face as i32);
                _mm512_storeu_epi32(faces.as_mut_ptr().cast(), seen);
                let (one, other) =
                    (along::<PANORAMA>(one.inverse_t, line), along::<PANORAMA>(other.inverse_t, line));
                for (k, these) in [(0, these as u8), (8, (these >> 8) as u8)] {
                    let either = |n: usize| {
                        _mm512_mask_blend_pd(these, _mm512_set1_pd(other[n]), _mm512_set1_pd(one[n]))
                    };
                    let u = _mm512_loadu_pd(line.u.as_ptr().add(k));
                    let mut value = _mm512_add_pd(either(0), _mm512_mul_pd(either(1), u));
                    if PANORAMA {
                        let v = _mm512_loadu_pd(line.v.as_ptr().add(k));
                        value = _mm512_add_pd(value, _mm512_mul_pd(either(2), v));
                    }
                    let depth = _mm512_abs_pd(_mm512_div_pd(_mm512_set1_pd(1.0), value));
                    _mm256_storeu_ps(depths.as_mut_ptr().add(k), _mm512_cvtpd_ps(depth));
                }
            }
        }
    }

    /// A half of each of two `DrawnFace`: two numbers, or one with a face.
    #[inline(always)]
    unsafe fn halves<const AT: usize>(p: &DrawnFace, r: &DrawnFace) -> __m256d {
        // SAFETY: the caller has references to them; the processor has AVX2.
        unsafe {
            let p = std::ptr::from_ref(p).cast::<f64>().add(AT);
            let r = std::ptr::from_ref(r).cast::<f64>().add(AT);
            _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(_mm_loadu_pd(p)), _mm_loadu_pd(r))
        }
    }

    /// Depths of the four pixels from `k` on, which is at most twelve.
    #[inline(always)]
    unsafe fn four_depths<const PANORAMA: bool>(
        [a, b, c]: [__m256d; 3],
        line: &RowGroup<'_>,
        k: usize,
        depths: &mut [f32; LANES],
    ) {
        // SAFETY: all loads and stores are within arrays of sixteen; the processor has AVX2.
        unsafe {
            let (level, rise) = (_mm256_set1_pd(line.level), _mm256_set1_pd(line.rise));
            let u = _mm256_loadu_pd(line.u.as_ptr().add(k));
            let value = if PANORAMA {
                let v = _mm256_loadu_pd(line.v.as_ptr().add(k));
                let along = _mm256_mul_pd(_mm256_mul_pd(a, level), u);
                let bend = _mm256_mul_pd(_mm256_mul_pd(b, level), v);
                _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(c, rise), along), bend)
            } else {
                _mm256_add_pd(_mm256_add_pd(a, _mm256_mul_pd(c, rise)), _mm256_mul_pd(b, u))
            };
            let depth = _mm256_andnot_pd(_mm256_set1_pd(-0.0), _mm256_div_pd(_mm256_set1_pd(1.0), value));
            _mm_storeu_ps(depths.as_mut_ptr().add(k), _mm256_cvtpd_ps(depth));
        }
    }

    /// [`Registers::resolve`], four pixels at a time.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn resolve<const PANORAMA: bool>(
        slots: &[u32; LANES],
        line: &RowGroup<'_>,
        drawn: &[DrawnFace],
        faces: &mut [u32; LANES],
        depths: &mut [f32; LANES],
    ) {
        for k in [0, 4, 8, 12] {
            let (p, q) = (&drawn[slots[k] as usize], &drawn[slots[k + 1] as usize]);
            let (r, s) = (&drawn[slots[k + 2] as usize], &drawn[slots[k + 3] as usize]);
            // SAFETY: references to what was drawn.
            let (pr, qs) = unsafe { (halves::<0>(p, r), halves::<0>(q, s)) };
            let (a, b) = (_mm256_unpacklo_pd(pr, qs), _mm256_unpackhi_pd(pr, qs));
            // SAFETY: as above.
            let (pr, qs) = unsafe { (halves::<2>(p, r), halves::<2>(q, s)) };
            let c = _mm256_unpacklo_pd(pr, qs);
            // SAFETY: k is 0, 4, 8 or 12.
            unsafe { four_depths::<PANORAMA>([a, b, c], line, k, depths) };
            let low = _mm256_shuffle_ps::<0b10_00_10_00>(
                _mm256_castpd_ps(_mm256_unpackhi_pd(pr, qs)),
                _mm256_setzero_ps(),
            );
            let four = _mm256_permute4x64_pd::<0b11_01_10_00>(_mm256_castps_pd(low));
            // SAFETY: as above.
            unsafe { _mm_storeu_pd(faces.as_mut_ptr().add(k).cast(), _mm256_castpd256_pd128(four)) };
        }
    }

    /// One or two registers of 256 bits. Made only where the processor is known to have AVX2 and FMA.
    #[derive(Clone, Copy)]
    pub(super) struct Avx2<const R: usize>(());

    /// Registers of a register.
    const WIDE: usize = 8;

    // SAFETY: as above, with `run_avx2` and `run_avx512`; a reference to an array of eight for each register, or a slice
    // of eight times as many as there are registers.
    impl<const R: usize> Registers for Avx2<R> {
        const N: usize = R * WIDE;
        type F = [__m256; R];
        type M = [__m256; R];
        type Half = Avx2<1>;

        #[inline(always)]
        fn half(self) -> Self::Half {
            Avx2(())
        }

        #[inline(always)]
        fn splat(self, x: f32) -> Self::F {
            unsafe { [_mm256_set1_ps(x); R] }
        }

        #[inline(always)]
        fn load(self, from: &[f32]) -> Self::F {
            let from = &from[..Self::N];
            std::array::from_fn(|k| unsafe { _mm256_loadu_ps(from.as_ptr().add(k * WIDE)) })
        }

        #[inline(always)]
        fn store(self, to: &mut [f32], x: Self::F) {
            let to = &mut to[..Self::N];
            for (k, x) in x.into_iter().enumerate() {
                unsafe { _mm256_storeu_ps(to.as_mut_ptr().add(k * WIDE), x) };
            }
        }

        #[inline(always)]
        fn add(self, a: Self::F, b: Self::F) -> Self::F {
            std::array::from_fn(|k| unsafe { _mm256_add_ps(a[k], b[k]) })
        }

        #[inline(always)]
        fn mul(self, a: Self::F, b: Self::F) -> Self::F {
            std::array::from_fn(|k| unsafe { _mm256_mul_ps(a[k], b[k]) })
        }

        #[inline(always)]
        fn min(self, a: Self::F, b: Self::F) -> Self::F {
            std::array::from_fn(|k| unsafe { _mm256_min_ps(a[k], b[k]) })
        }

        #[inline(always)]
        fn greater(self, a: Self::F, b: Self::F) -> Self::M {
            std::array::from_fn(|k| unsafe { _mm256_cmp_ps::<_CMP_GT_OQ>(a[k], b[k]) })
        }

        #[inline(always)]
        fn greater_by_ulps(self, a: Self::F, b: Self::F, ulps: i32) -> Self::M {
            std::array::from_fn(|k| unsafe {
                let b = _mm256_add_epi32(_mm256_castps_si256(b[k]), _mm256_set1_epi32(ulps));
                _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_castps_si256(a[k]), b))
            })
        }

        #[inline(always)]
        fn and(self, a: Self::M, b: Self::M) -> Self::M {
            std::array::from_fn(|k| unsafe { _mm256_and_ps(a[k], b[k]) })
        }

        #[inline(always)]
        fn bits(self, m: Self::M) -> u16 {
            (0..R).fold(0, |bits, k| bits | (unsafe { _mm256_movemask_ps(m[k]) } as u16) << (k * WIDE))
        }

        #[inline(always)]
        fn store_masked_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
            let to = &mut to[..Self::N];
            for k in 0..R {
                unsafe {
                    let to = to.as_mut_ptr().add(k * WIDE);
                    _mm256_storeu_ps(to, _mm256_blendv_ps(_mm256_loadu_ps(to), x[k], m[k]));
                }
            }
        }

        #[inline(always)]
        fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32) {
            let to = &mut to[..Self::N];
            for (k, m) in m.into_iter().enumerate() {
                unsafe {
                    let to = to.as_mut_ptr().add(k * WIDE).cast();
                    let x = _mm256_castsi256_ps(_mm256_set1_epi32(x as i32));
                    _mm256_storeu_ps(to, _mm256_blendv_ps(_mm256_loadu_ps(to), x, m));
                }
            }
        }

        #[inline(always)]
        fn resolve<const PANORAMA: bool>(
            self,
            slots: &[u32; LANES],
            line: &RowGroup<'_>,
            drawn: &[DrawnFace],
            faces: &mut [u32; LANES],
            depths: &mut [f32; LANES],
        ) {
            // SAFETY: as above.
            unsafe { resolve::<PANORAMA>(slots, line, drawn, faces, depths) }
        }
    }
}
