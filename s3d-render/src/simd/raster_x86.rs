//! Implements [`RasterLanes`] with AVX2 and with AVX-512.
//!
//! Every unsafe block uses instructions whose proof `self` holds. Loads and stores go through references to
//! arrays as long as the registers.
#![expect(
    clippy::expect_used,
    reason = "slices are cut to the length of the array: there is nothing left of the check"
)]
#![allow(unsafe_code)]

use crate::simd::raster_lanes::{DrawnFace, LANES, RasterLanes, RowGroup, SHORT, along};
use s3d_simd::{Avx2, Avx512};
use std::arch::{asm, x86_64::*};

/// One register of 512 bits.
#[derive(Clone, Copy)]
pub(crate) struct Wide512(pub(crate) Avx512);

/// Operations on registers that touch no memory.
macro_rules! registers {
    ($(fn $name:ident($($arg:ident: $type:ty),*) -> $out:ty = $body:expr;)*) => {$(
        #[inline(always)]
        fn $name(self, $($arg: $type),*) -> $out {
            // SAFETY: `self` is the proof that the processor has these registers.
            unsafe { $body }
        }
    )*};
}

impl RasterLanes for Wide512 {
    const N: usize = LANES;
    type F = __m512;
    type M = __mmask16;
    type Half = Wide256;

    #[inline(always)]
    fn half(self) -> Self::Half {
        Wide256(self.0.avx2())
    }

    registers! {
        fn splat(x: f32) -> Self::F = _mm512_set1_ps(x);
        fn add(a: Self::F, b: Self::F) -> Self::F = _mm512_add_ps(a, b);
        fn mul(a: Self::F, b: Self::F) -> Self::F = _mm512_mul_ps(a, b);
        fn min(a: Self::F, b: Self::F) -> Self::F = _mm512_min_ps(a, b);
        fn greater(a: Self::F, b: Self::F) -> Self::M = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(a, b);
        fn greater_by_ulps(a: Self::F, b: Self::F, ulps: i32) -> Self::M = {
            let b = _mm512_add_epi32(_mm512_castps_si512(b), _mm512_set1_epi32(ulps));
            _mm512_cmpgt_epi32_mask(_mm512_castps_si512(a), b)
        };
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        let from: &[f32; LANES] = from.first_chunk().expect(SHORT);
        // SAFETY: `self` is the proof of AVX-512; the array has sixteen values.
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    fn store(self, to: &mut [f32], x: Self::F) {
        let to: &mut [f32; LANES] = to.first_chunk_mut().expect(SHORT);
        // SAFETY: as in `load`.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), x) }
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
        // SAFETY: as in `load`.
        unsafe { _mm512_mask_storeu_ps(to.as_mut_ptr(), m, x) }
    }

    #[inline(always)]
    fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32) {
        let to: &mut [u32; LANES] = to.first_chunk_mut().expect(SHORT);
        // SAFETY: as in `load`.
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
        // SAFETY: `self` is the proof of AVX-512 and so of AVX2. The arrays have sixteen values. Eight values
        // are loaded from `u` and `v` and stored to `depths`, from place 0 and from place 8 on.
        unsafe {
            let all = _mm512_loadu_epi32(slots.as_ptr().cast());

            // There is mostly one face; in a panorama one or two. (Perspective views with small faces are
            // faster if two faces count as a mixture.)
            let these = _mm512_cmpeq_epi32_mask(all, _mm512_set1_epi32(slots[0] as i32));
            let other = if PANORAMA {
                slots[these.trailing_ones() as usize % LANES]
            } else {
                slots[0]
            };
            if these | _mm512_cmpeq_epi32_mask(all, _mm512_set1_epi32(other as i32)) != u16::MAX {
                return resolve_by_fours::<PANORAMA>(slots, line, drawn, faces, depths);
            }

            let (one, other) = (&drawn[slots[0] as usize], &drawn[other as usize]);
            let seen = _mm512_set1_epi32(other.face as i32);
            let seen = _mm512_mask_set1_epi32(seen, these, one.face as i32);
            _mm512_storeu_epi32(faces.as_mut_ptr().cast(), seen);
            let (one, other) =
                (along::<PANORAMA>(one.inverse_t, line), along::<PANORAMA>(other.inverse_t, line));

            for (k, these) in [(0, these as u8), (8, (these >> 8) as u8)] {
                let either =
                    |n: usize| _mm512_mask_blend_pd(these, _mm512_set1_pd(other[n]), _mm512_set1_pd(one[n]));
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

/// Loads a half of each of two faces: two numbers (`AT` = 0), or a number and the face (`AT` = 2).
#[inline]
#[target_feature(enable = "avx2")]
fn halves<const AT: usize>(p: &DrawnFace, r: &DrawnFace) -> __m256d {
    const { assert!(AT + 2 <= size_of::<DrawnFace>() / size_of::<f64>()) };
    let [p, r] = [p, r].map(|face| std::ptr::from_ref(face).cast::<f64>());
    // SAFETY: two numbers from `AT` on are within a `DrawnFace`, which has no padding.
    unsafe {
        _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(_mm_loadu_pd(p.add(AT))), _mm_loadu_pd(r.add(AT)))
    }
}

/// Returns the depths of the four pixels from `k` on; `k` is at most twelve.
#[inline]
#[target_feature(enable = "avx2")]
fn four_depths<const PANORAMA: bool>([a, b, c]: [__m256d; 3], line: &RowGroup<'_>, k: usize) -> __m128 {
    let four = |of: &[f64; LANES]| {
        let of: &[f64] = &of[k..k + 4];
        // SAFETY: the slice has four values; the closure is within a function that enables AVX2.
        unsafe { _mm256_loadu_pd(of.as_ptr()) }
    };
    let (level, rise) = (_mm256_set1_pd(line.level), _mm256_set1_pd(line.rise));
    let u = four(line.u);
    let value = if PANORAMA {
        let v = four(line.v);
        let along = _mm256_mul_pd(_mm256_mul_pd(a, level), u);
        let bend = _mm256_mul_pd(_mm256_mul_pd(b, level), v);
        _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(c, rise), along), bend)
    } else {
        _mm256_add_pd(_mm256_add_pd(a, _mm256_mul_pd(c, rise)), _mm256_mul_pd(b, u))
    };
    _mm256_cvtpd_ps(_mm256_andnot_pd(_mm256_set1_pd(-0.0), _mm256_div_pd(_mm256_set1_pd(1.0), value)))
}

/// Implements [`RasterLanes::resolve`], four pixels at a time.
#[inline]
#[target_feature(enable = "avx2")]
fn resolve_by_fours<const PANORAMA: bool>(
    slots: &[u32; LANES],
    line: &RowGroup<'_>,
    drawn: &[DrawnFace],
    faces: &mut [u32; LANES],
    depths: &mut [f32; LANES],
) {
    for k in [0, 4, 8, 12] {
        let (p, q) = (&drawn[slots[k] as usize], &drawn[slots[k + 1] as usize]);
        let (r, s) = (&drawn[slots[k + 2] as usize], &drawn[slots[k + 3] as usize]);
        let (pr, qs) = (halves::<0>(p, r), halves::<0>(q, s));
        let (a, b) = (_mm256_unpacklo_pd(pr, qs), _mm256_unpackhi_pd(pr, qs));
        let (pr, qs) = (halves::<2>(p, r), halves::<2>(q, s));
        let c = _mm256_unpacklo_pd(pr, qs);
        let four = four_depths::<PANORAMA>([a, b, c], line, k);
        let low = _mm256_shuffle_ps::<0b10_00_10_00>(
            _mm256_castpd_ps(_mm256_unpackhi_pd(pr, qs)),
            _mm256_setzero_ps(),
        );
        let seen = _mm256_permute4x64_pd::<0b11_01_10_00>(_mm256_castps_pd(low));
        // SAFETY: k is at most twelve: four values from there on are within the arrays of sixteen.
        unsafe {
            _mm_storeu_ps(depths.as_mut_ptr().add(k), four);
            _mm_storeu_pd(faces.as_mut_ptr().add(k).cast(), _mm256_castpd256_pd128(seen));
        }
    }
}

/// One register of 256 bits.
#[derive(Clone, Copy)]
pub(crate) struct Wide256(pub(crate) Avx2);

/// The number of values in a register of 256 bits.
const WIDTH: usize = 8;

/// Returns the same register, but hides its origin from the compiler.
///
/// If the compiler sees a load, a blend and a store to the same place, it makes one masked store of them.
/// That is so slow on Zen 3 that views took 1.6 times as long.
#[inline]
#[target_feature(enable = "avx2")]
fn opaque(mut x: __m256) -> __m256 {
    // SAFETY: there is no instruction; the register comes out as it went in.
    unsafe { asm!("/* {0} */", inout(ymm_reg) x, options(pure, nomem, nostack, preserves_flags)) };
    x
}

impl RasterLanes for Wide256 {
    const N: usize = WIDTH;
    type F = __m256;
    type M = __m256;
    type Half = Self;

    #[inline(always)]
    fn half(self) -> Self {
        self
    }

    registers! {
        fn splat(x: f32) -> Self::F = _mm256_set1_ps(x);
        fn add(a: Self::F, b: Self::F) -> Self::F = _mm256_add_ps(a, b);
        fn mul(a: Self::F, b: Self::F) -> Self::F = _mm256_mul_ps(a, b);
        fn min(a: Self::F, b: Self::F) -> Self::F = _mm256_min_ps(a, b);
        fn greater(a: Self::F, b: Self::F) -> Self::M = _mm256_cmp_ps::<_CMP_GT_OQ>(a, b);
        fn greater_by_ulps(a: Self::F, b: Self::F, ulps: i32) -> Self::M = {
            let b = _mm256_add_epi32(_mm256_castps_si256(b), _mm256_set1_epi32(ulps));
            _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_castps_si256(a), b))
        };
        fn and(a: Self::M, b: Self::M) -> Self::M = _mm256_and_ps(a, b);
        fn bits(m: Self::M) -> u16 = _mm256_movemask_ps(m) as u16;
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        let from: &[f32; WIDTH] = from.first_chunk().expect(SHORT);
        // SAFETY: `self` is the proof of AVX2; the array has eight values.
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    fn store(self, to: &mut [f32], x: Self::F) {
        let to: &mut [f32; WIDTH] = to.first_chunk_mut().expect(SHORT);
        // SAFETY: as in `load`.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), x) }
    }

    #[inline(always)]
    fn store_masked_f32(self, to: &mut [f32], m: Self::M, x: Self::F) {
        let to: &mut [f32; WIDTH] = to.first_chunk_mut().expect(SHORT);
        // SAFETY: as in `load`.
        unsafe {
            let to = to.as_mut_ptr();
            _mm256_storeu_ps(to, opaque(_mm256_blendv_ps(_mm256_loadu_ps(to), x, m)));
        }
    }

    #[inline(always)]
    fn store_masked_u32(self, to: &mut [u32], m: Self::M, x: u32) {
        let to: &mut [u32; WIDTH] = to.first_chunk_mut().expect(SHORT);
        // SAFETY: as in `load`.
        unsafe {
            let to = to.as_mut_ptr().cast();
            let x = _mm256_castsi256_ps(_mm256_set1_epi32(x as i32));
            _mm256_storeu_ps(to, opaque(_mm256_blendv_ps(_mm256_loadu_ps(to), x, m)));
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
        // SAFETY: `self` is the proof that the processor has AVX2.
        unsafe { resolve_by_fours::<PANORAMA>(slots, line, drawn, faces, depths) }
    }
}
