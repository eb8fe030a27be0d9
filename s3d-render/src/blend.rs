//! What [`Avx2`] does with textures, in registers of 32 and of 64 bytes.
//!
//! Of each pixel a register holds the two neighbours of the upper row in 128 bits and those of the lower row in the next
//! 128: one instruction multiplies neighbours by their weights and adds the two, for all channels.
//!
//! All that is unsafe here is, as in `avx2.rs`, to use these instructions, which [`Blend::detect`] asks for, and to load
//! from places of an image that were compared with its end.
#![allow(unsafe_code)]

use crate::avx2::Avx2;
use crate::lanes::{LANES, LaneWork};
use std::arch::x86_64::*;

/// The widest registers that hold texels. Its values are proof that the processor has what they take.
pub(crate) trait Blend: Copy {
    /// The weights of the 2 × 2 pixels of eight places.
    type Corners: Copy;
    /// The 2 × 2 pixels.
    type Quads: Copy;
    /// Weighted sums.
    type Mix: Copy;

    fn detect() -> Option<Self>;
    /// Does `work`, compiled for these instructions throughout.
    fn run<W: LaneWork>(self, work: W) -> W::Output;
    /// Of the weights of neighbours in a row: those of pixels 0 to 3 in the upper and then in the lower row, and those of
    /// pixels 4 to 7.
    fn corners(self, low: __m256i, high: __m256i) -> Self::Corners;
    /// # Safety
    /// At every place, and `stride` bytes after it, are eight bytes.
    unsafe fn quads(self, bytes: *const u8, at: &[i32; LANES], stride: usize) -> Self::Quads;
    fn quads_from(self, upper: &[u64; LANES], lower: &[u64; LANES]) -> Self::Quads;
    fn none(self) -> Self::Mix;
    fn add(self, sum: Self::Mix, quads: Self::Quads, corners: Self::Corners) -> Self::Mix;
    /// R, G, B and 0, rounded to bytes.
    fn bytes(self, mix: Self::Mix) -> __m256i;
}

/// Two neighbours' R G B R G B as 16-bit numbers R R, G G, B B.
const NEIGHBORS: [i8; 16] = [0, -1, 3, -1, 1, -1, 4, -1, 2, -1, 5, -1, -1, -1, -1, -1];

/// 32 bytes: a pixel a register.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Half(());

// SAFETY of all blocks below: a `Half` exists only where the processor has AVX2, a `Full` only where it has AVX-512 too.
impl Blend for Half {
    type Corners = [__m256i; 2];
    type Quads = [__m256i; LANES];
    /// The sums of the upper and of the lower neighbours.
    type Mix = [__m256i; LANES];

    fn detect() -> Option<Self> {
        (is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("f16c")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("popcnt"))
        .then_some(Self(()))
    }
    fn run<W: LaneWork>(self, work: W) -> W::Output {
        #[target_feature(enable = "avx2,f16c,bmi1,bmi2,popcnt")]
        fn with_avx2<W: LaneWork>(work: W, lanes: Avx2<Half>) -> W::Output {
            work.run(lanes)
        }
        // SAFETY: the processor has these instructions, or there were no `self`.
        unsafe { with_avx2(work, Avx2(self)) }
    }
    #[inline(always)]
    fn corners(self, low: __m256i, high: __m256i) -> Self::Corners {
        [low, high]
    }
    #[inline(always)]
    unsafe fn quads(self, bytes: *const u8, at: &[i32; LANES], stride: usize) -> Self::Quads {
        unsafe {
            let mut quads = [_mm256_setzero_si256(); LANES];
            for k in 0..LANES {
                let upper = bytes.add(at[k] as usize);
                let (upper, lower) = (upper.cast::<i64>(), upper.add(stride).cast::<i64>());
                let upper = _mm256_set1_epi64x(upper.read_unaligned());
                quads[k] = _mm256_blend_epi32::<0xF0>(upper, _mm256_set1_epi64x(lower.read_unaligned()));
            }
            quads
        }
    }
    #[inline(always)]
    fn quads_from(self, upper: &[u64; LANES], lower: &[u64; LANES]) -> Self::Quads {
        unsafe {
            let mut quads = [_mm256_setzero_si256(); LANES];
            for k in 0..LANES {
                quads[k] = _mm256_setr_epi64x(upper[k] as i64, 0, lower[k] as i64, 0);
            }
            quads
        }
    }
    #[inline(always)]
    fn none(self) -> Self::Mix {
        unsafe { [_mm256_setzero_si256(); LANES] }
    }
    #[inline(always)]
    fn add(self, sum: Self::Mix, quads: Self::Quads, [low, high]: Self::Corners) -> Self::Mix {
        unsafe {
            let neighbors = _mm256_broadcastsi128_si256(_mm_loadu_si128(NEIGHBORS.as_ptr().cast()));
            let of = |k: usize, weights: __m256i| {
                _mm256_add_epi32(sum[k], _mm256_madd_epi16(_mm256_shuffle_epi8(quads[k], neighbors), weights))
            };
            [
                of(0, _mm256_shuffle_epi32::<0b00_00_00_00>(low)),
                of(1, _mm256_shuffle_epi32::<0b01_01_01_01>(low)),
                of(2, _mm256_shuffle_epi32::<0b10_10_10_10>(low)),
                of(3, _mm256_shuffle_epi32::<0b11_11_11_11>(low)),
                of(4, _mm256_shuffle_epi32::<0b00_00_00_00>(high)),
                of(5, _mm256_shuffle_epi32::<0b01_01_01_01>(high)),
                of(6, _mm256_shuffle_epi32::<0b10_10_10_10>(high)),
                of(7, _mm256_shuffle_epi32::<0b11_11_11_11>(high)),
            ]
        }
    }
    #[inline(always)]
    fn bytes(self, mix: Self::Mix) -> __m256i {
        unsafe {
            let half = _mm256_set1_epi32(0x4000);
            // Pixels k and k + 4.
            let whole = |k: usize| {
                let upper = _mm256_permute2x128_si256::<0x20>(mix[k], mix[k + 4]);
                let lower = _mm256_permute2x128_si256::<0x31>(mix[k], mix[k + 4]);
                _mm256_srai_epi32::<15>(_mm256_sub_epi32(half, _mm256_add_epi32(upper, lower)))
            };
            _mm256_packus_epi16(
                _mm256_packs_epi32(whole(0), whole(1)),
                _mm256_packs_epi32(whole(2), whole(3)),
            )
        }
    }
}

/// 64 bytes: pixels k and k + 4 a register.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Full(());

impl Blend for Full {
    type Corners = __m512i;
    type Quads = [__m512i; 4];
    type Mix = [__m512i; 4];

    fn detect() -> Option<Self> {
        (Half::detect().is_some()
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512vnni"))
        .then_some(Self(()))
    }
    fn run<W: LaneWork>(self, work: W) -> W::Output {
        #[target_feature(enable = "avx2,f16c,bmi1,bmi2,popcnt,avx512f,avx512bw,avx512dq,avx512vl,avx512vnni")]
        fn with_avx512<W: LaneWork>(work: W, lanes: Avx2<Full>) -> W::Output {
            work.run(lanes)
        }
        // SAFETY: the processor has these instructions, or there were no `self`.
        unsafe { with_avx512(work, Avx2(self)) }
    }
    #[inline(always)]
    fn corners(self, low: __m256i, high: __m256i) -> Self::Corners {
        unsafe { _mm512_inserti64x4::<1>(_mm512_castsi256_si512(low), high) }
    }
    #[inline(always)]
    unsafe fn quads(self, bytes: *const u8, at: &[i32; LANES], stride: usize) -> Self::Quads {
        unsafe {
            let mut quads = [_mm512_setzero_si512(); 4];
            for k in 0..4 {
                let (a, b) = (bytes.add(at[k] as usize), bytes.add(at[k + 4] as usize));
                let read = |from: *const u8| from.cast::<i64>().read_unaligned();
                let quad = _mm512_set1_epi64(read(a));
                let quad = _mm512_mask_set1_epi64(quad, 1 << 2, read(a.add(stride)));
                let quad = _mm512_mask_set1_epi64(quad, 1 << 4, read(b));
                quads[k] = _mm512_mask_set1_epi64(quad, 1 << 6, read(b.add(stride)));
            }
            quads
        }
    }
    #[inline(always)]
    fn quads_from(self, upper: &[u64; LANES], lower: &[u64; LANES]) -> Self::Quads {
        unsafe {
            let mut quads = [_mm512_setzero_si512(); 4];
            for k in 0..4 {
                let [a, b, c, d] = [upper[k], lower[k], upper[k + 4], lower[k + 4]].map(|v| v as i64);
                quads[k] = _mm512_setr_epi64(a, 0, b, 0, c, 0, d, 0);
            }
            quads
        }
    }
    #[inline(always)]
    fn none(self) -> Self::Mix {
        unsafe { [_mm512_setzero_si512(); 4] }
    }
    #[inline(always)]
    fn add(self, sum: Self::Mix, quads: Self::Quads, corners: Self::Corners) -> Self::Mix {
        unsafe {
            let neighbors = _mm512_broadcast_i32x4(_mm_loadu_si128(NEIGHBORS.as_ptr().cast()));
            let of = |k: usize, weights: __m512i| {
                _mm512_dpwssd_epi32(sum[k], _mm512_shuffle_epi8(quads[k], neighbors), weights)
            };
            [
                of(0, _mm512_shuffle_epi32::<0b00_00_00_00>(corners)),
                of(1, _mm512_shuffle_epi32::<0b01_01_01_01>(corners)),
                of(2, _mm512_shuffle_epi32::<0b10_10_10_10>(corners)),
                of(3, _mm512_shuffle_epi32::<0b11_11_11_11>(corners)),
            ]
        }
    }
    #[inline(always)]
    fn bytes(self, mix: Self::Mix) -> __m256i {
        unsafe {
            let half = _mm512_set1_epi32(0x4000);
            // Pixels k, k + 4, k + 1 and k + 5.
            let whole = |k: usize| {
                let upper = _mm512_shuffle_i32x4::<0b10_00_10_00>(mix[k], mix[k + 1]);
                let lower = _mm512_shuffle_i32x4::<0b11_01_11_01>(mix[k], mix[k + 1]);
                _mm512_srai_epi32::<15>(_mm512_sub_epi32(half, _mm512_add_epi32(upper, lower)))
            };
            // 0 2 | 4 6 | 1 3 | 5 7.
            let words = _mm512_packs_epi32(whole(0), whole(2));
            let (even, odd) = (_mm512_castsi512_si256(words), _mm512_extracti64x4_epi64::<1>(words));
            _mm256_shuffle_epi32::<0b11_01_10_00>(_mm256_packus_epi16(even, odd))
        }
    }
}
