//! The parts of [`Eight`](crate::simd::shade_avx2::Eight) that need registers of 32 or 64 bytes.
//!
//! The 2 × 2 texels of a place fill 128 bits: the two neighbours of the upper row in the first half, and the
//! neighbours of the lower row in the second. One instruction multiplies neighbours by their weights and adds
//! the two products, for all channels.
//!
//! Every unsafe block uses instructions whose proof is `self`, or loads from and stores to references that
//! are large enough, or loads from places that were compared with the end of an image.
#![allow(unsafe_code)]

use crate::simd::shade_lanes::{EightRays, LANES};
use s3d_simd::{Avx2, Avx512};
use std::arch::x86_64::*;

/// The widest registers for texels, as the proof that the processor has them.
pub(crate) trait Width: Copy {
    /// The weights of the 2 × 2 texels of eight places.
    type Corners: Copy;
    /// The 2 × 2 texels of eight places.
    type Quads: Copy;
    /// Weighted sums.
    type ColorSum: Copy;

    /// Combines the weights of neighbours. `low` has the weights of pixels 0 to 3, for the upper and then for
    /// the lower row; `high` has the weights of pixels 4 to 7.
    fn corners(self, low: __m256i, high: __m256i) -> Self::Corners;
    /// Loads the 2 × 2 texels of eight places.
    ///
    /// # Safety
    /// Eight bytes must be readable at every place, and eight more `stride` bytes after it.
    unsafe fn quads(self, bytes: *const u8, at: __m256i, stride: usize) -> Self::Quads;
    /// Combines texels that were read one by one: see [`crate::simd::shade_lanes::ShadeLanes::quads_from`].
    fn quads_from(self, upper: &[u64; LANES], lower: &[u64; LANES]) -> Self::Quads;
    /// Returns sums of 0.
    fn none(self) -> Self::ColorSum;
    /// Adds weighted texels to the sums.
    fn add(self, sum: Self::ColorSum, quads: Self::Quads, corners: Self::Corners) -> Self::ColorSum;
    /// See [`crate::simd::shade_lanes::ShadeLanes::channels`].
    fn channels(self, sum: Self::ColorSum) -> [__m256; 3];
    /// Returns R, G, B and 0, rounded to bytes.
    fn bytes(self, sum: Self::ColorSum) -> __m256i;
    /// See [`crate::simd::shade_lanes::ShadeLanes::changes`].
    fn changes(self, values: &[u32; 2 * LANES + 1], from: u32, to: &mut [u32; 2 * LANES]) -> usize;
    /// Returns the points of [`crate::simd::shade_lanes::ShadeLanes::points`].
    fn points<const PANORAMA: bool>(self, rays: &EightRays<'_>) -> [__m256; 3];
}

/// The upper neighbours' R G B R G B as the 16-bit numbers R R, G G, B B; then the same for the lower
/// neighbours.
const NEIGHBORS: [[i8; 16]; 2] = [
    [0, -1, 3, -1, 1, -1, 4, -1, 2, -1, 5, -1, -1, -1, -1, -1],
    [8, -1, 11, -1, 9, -1, 12, -1, 10, -1, 13, -1, -1, -1, -1, -1],
];

/// Loads the 2 × 2 texels of each place.
///
/// # Safety
/// The processor has AVX2. Eight bytes are readable at every place, and eight more `stride` bytes after it.
#[inline(always)]
unsafe fn pairs(bytes: *const u8, at: __m256i, stride: usize) -> [__m128i; LANES] {
    // SAFETY: the caller vouches for the places; eight values are stored in an array of eight.
    unsafe {
        let (mut each, below) = ([0u32; LANES], bytes.add(stride));
        _mm256_storeu_si256(each.as_mut_ptr().cast(), at);
        let mut pairs = [_mm_setzero_si128(); LANES];
        for k in 0..LANES {
            // The load is volatile, since compilers would otherwise take `at` apart instead of loading it
            // from where it was stored: twice the work.
            let at = std::ptr::read_volatile(&each[k]) as usize;
            let (upper, lower) = (bytes.add(at).cast::<f64>(), below.add(at).cast::<f64>());
            pairs[k] = _mm_castpd_si128(_mm_loadh_pd(_mm_load_sd(upper), lower));
        }
        pairs
    }
}

/// 32 bytes: pixels k and k + 4 share a register.
impl Width for Avx2 {
    /// The upper neighbours' weights, as pixels in a register, then the lower neighbours' weights.
    type Corners = [__m256i; 2];
    type Quads = [__m256i; 4];
    type ColorSum = [__m256i; 4];

    #[inline(always)]
    fn corners(self, low: __m256i, high: __m256i) -> Self::Corners {
        // SAFETY: `self` is the proof of AVX2.
        unsafe {
            [_mm256_permute2x128_si256::<0x20>(low, high), _mm256_permute2x128_si256::<0x31>(low, high)]
        }
    }
    #[inline(always)]
    unsafe fn quads(self, bytes: *const u8, at: __m256i, stride: usize) -> Self::Quads {
        // SAFETY: `self` is the proof of AVX2. The caller vouches for the places.
        unsafe {
            let pairs = pairs(bytes, at, stride);
            let mut quads = [_mm256_setzero_si256(); 4];
            for k in 0..4 {
                quads[k] = _mm256_set_m128i(pairs[k + 4], pairs[k]);
            }
            quads
        }
    }
    #[inline(always)]
    fn quads_from(self, upper: &[u64; LANES], lower: &[u64; LANES]) -> Self::Quads {
        // SAFETY: `self` is the proof of AVX2.
        unsafe {
            let mut quads = [_mm256_setzero_si256(); 4];
            for k in 0..4 {
                let [a, b, c, d] = [upper[k], lower[k], upper[k + 4], lower[k + 4]].map(|v| v as i64);
                quads[k] = _mm256_setr_epi64x(a, b, c, d);
            }
            quads
        }
    }
    #[inline(always)]
    fn none(self) -> Self::ColorSum {
        // SAFETY: `self` is the proof of AVX2.
        unsafe { [_mm256_setzero_si256(); 4] }
    }
    #[inline(always)]
    fn add(self, sum: Self::ColorSum, quads: Self::Quads, corners: Self::Corners) -> Self::ColorSum {
        // SAFETY: `self` is the proof of AVX2. All sixteen bytes are loaded.
        unsafe {
            let mut sum = sum;
            for (neighbors, corners) in NEIGHBORS.iter().zip(corners) {
                let neighbors = _mm256_broadcastsi128_si256(_mm_loadu_si128(neighbors.as_ptr().cast()));
                let weights = [
                    _mm256_shuffle_epi32::<0b00_00_00_00>(corners),
                    _mm256_shuffle_epi32::<0b01_01_01_01>(corners),
                    _mm256_shuffle_epi32::<0b10_10_10_10>(corners),
                    _mm256_shuffle_epi32::<0b11_11_11_11>(corners),
                ];
                for k in 0..4 {
                    let colors = _mm256_shuffle_epi8(quads[k], neighbors);
                    sum[k] = _mm256_add_epi32(sum[k], _mm256_madd_epi16(colors, weights[k]));
                }
            }
            sum
        }
    }
    #[inline(always)]
    fn channels(self, [a, b, c, d]: Self::ColorSum) -> [__m256; 3] {
        // SAFETY: `self` is the proof of AVX2.
        unsafe {
            // Red and green, then blue.
            let (ab, cd) = (_mm256_unpacklo_epi32(a, b), _mm256_unpacklo_epi32(c, d));
            let blue = _mm256_unpacklo_epi64(_mm256_unpackhi_epi32(a, b), _mm256_unpackhi_epi32(c, d));
            let mut channels = [_mm256_setzero_ps(); 3];
            let sums = [_mm256_unpacklo_epi64(ab, cd), _mm256_unpackhi_epi64(ab, cd), blue];
            for (channel, sum) in channels.iter_mut().zip(sums) {
                *channel = _mm256_mul_ps(_mm256_cvtepi32_ps(sum), _mm256_set1_ps(-1.0 / 32768.0));
            }
            channels
        }
    }
    #[inline(always)]
    fn bytes(self, sum: Self::ColorSum) -> __m256i {
        // SAFETY: `self` is the proof of AVX2.
        unsafe {
            let half = _mm256_set1_epi32(0x4000);
            let mut whole = sum;
            for whole in &mut whole {
                *whole = _mm256_srai_epi32::<15>(_mm256_sub_epi32(half, *whole));
            }
            let [a, b, c, d] = whole;
            _mm256_packus_epi16(_mm256_packs_epi32(a, b), _mm256_packs_epi32(c, d))
        }
    }
    #[inline(always)]
    fn changes(self, values: &[u32; 2 * LANES + 1], from: u32, to: &mut [u32; 2 * LANES]) -> usize {
        // SAFETY: `self` is the proof of AVX2.
        unsafe { changes_by_eights(values, from, to) }
    }
    #[inline(always)]
    fn points<const PANORAMA: bool>(self, rays: &EightRays<'_>) -> [__m256; 3] {
        // SAFETY: `self` is the proof of AVX2.
        unsafe { points_by_fours::<PANORAMA>(rays) }
    }
}

/// 64 bytes: pixels 0 to 3 are in one register, 4 to 7 in another.
impl Width for Avx512 {
    /// By register: the upper neighbours' weights, then the lower neighbours' weights.
    type Corners = [[__m512i; 2]; 2];
    type Quads = [__m512i; 2];
    type ColorSum = [__m512i; 2];

    #[inline(always)]
    fn corners(self, low: __m256i, high: __m256i) -> Self::Corners {
        // SAFETY: `self` is the proof of AVX-512.
        unsafe {
            let upper = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
            let lower = _mm512_setr_epi32(4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7);
            let (low, high) = (_mm512_castsi256_si512(low), _mm512_castsi256_si512(high));
            [
                [_mm512_permutexvar_epi32(upper, low), _mm512_permutexvar_epi32(lower, low)],
                [_mm512_permutexvar_epi32(upper, high), _mm512_permutexvar_epi32(lower, high)],
            ]
        }
    }
    #[inline(always)]
    unsafe fn quads(self, bytes: *const u8, at: __m256i, stride: usize) -> Self::Quads {
        // SAFETY: `self` is the proof of AVX-512. The caller vouches for the places.
        unsafe {
            let [a, b, c, d, e, f, g, h] = pairs(bytes, at, stride);
            let (ab, cd) = (_mm256_set_m128i(b, a), _mm256_set_m128i(d, c));
            let (ef, gh) = (_mm256_set_m128i(f, e), _mm256_set_m128i(h, g));
            [
                _mm512_inserti64x4::<1>(_mm512_castsi256_si512(ab), cd),
                _mm512_inserti64x4::<1>(_mm512_castsi256_si512(ef), gh),
            ]
        }
    }
    #[inline(always)]
    fn quads_from(self, upper: &[u64; LANES], lower: &[u64; LANES]) -> Self::Quads {
        // SAFETY: `self` is the proof of AVX-512.
        unsafe {
            let mut quads = [_mm512_setzero_si512(); 2];
            for (quad, k) in quads.iter_mut().zip([0, 4]) {
                let [a, b, c, d] = [upper[k], lower[k], upper[k + 1], lower[k + 1]].map(|v| v as i64);
                let [e, f, g, h] = [upper[k + 2], lower[k + 2], upper[k + 3], lower[k + 3]].map(|v| v as i64);
                *quad = _mm512_setr_epi64(a, b, c, d, e, f, g, h);
            }
            quads
        }
    }
    #[inline(always)]
    fn none(self) -> Self::ColorSum {
        // SAFETY: `self` is the proof of AVX-512.
        unsafe { [_mm512_setzero_si512(); 2] }
    }
    #[inline(always)]
    fn add(self, sum: Self::ColorSum, quads: Self::Quads, corners: Self::Corners) -> Self::ColorSum {
        // SAFETY: `self` is the proof of AVX-512. All sixteen bytes are loaded.
        unsafe {
            let mut sum = sum;
            for k in 0..2 {
                for (neighbors, weights) in NEIGHBORS.iter().zip(corners[k]) {
                    let neighbors = _mm512_broadcast_i32x4(_mm_loadu_si128(neighbors.as_ptr().cast()));
                    sum[k] = _mm512_dpwssd_epi32(sum[k], _mm512_shuffle_epi8(quads[k], neighbors), weights);
                }
            }
            sum
        }
    }
    #[inline(always)]
    fn channels(self, [low, high]: Self::ColorSum) -> [__m256; 3] {
        // SAFETY: `self` is the proof of AVX-512.
        let pairs = unsafe {
            [
                _mm256_set_m128i(_mm512_extracti32x4_epi32::<0>(high), _mm512_extracti32x4_epi32::<0>(low)),
                _mm256_set_m128i(_mm512_extracti32x4_epi32::<1>(high), _mm512_extracti32x4_epi32::<1>(low)),
                _mm256_set_m128i(_mm512_extracti32x4_epi32::<2>(high), _mm512_extracti32x4_epi32::<2>(low)),
                _mm256_set_m128i(_mm512_extracti32x4_epi32::<3>(high), _mm512_extracti32x4_epi32::<3>(low)),
            ]
        };
        self.avx2().channels(pairs)
    }
    #[inline(always)]
    fn bytes(self, sum: Self::ColorSum) -> __m256i {
        // SAFETY: `self` is the proof of AVX-512.
        unsafe {
            let half = _mm512_set1_epi32(0x4000);
            let mut whole = sum;
            for whole in &mut whole {
                *whole = _mm512_srai_epi32::<15>(_mm512_sub_epi32(half, *whole));
            }
            // 0 4 | 1 5 | 2 6 | 3 7.
            let words = _mm512_packs_epi32(whole[0], whole[1]);
            let (first, last) = (_mm512_castsi512_si256(words), _mm512_extracti64x4_epi64::<1>(words));
            // 0 4 2 6 | 1 5 3 7.
            let bytes = _mm256_packus_epi16(first, last);
            _mm256_permutevar8x32_epi32(bytes, _mm256_setr_epi32(0, 4, 2, 6, 1, 5, 3, 7))
        }
    }
    #[inline(always)]
    fn changes(self, values: &[u32; 2 * LANES + 1], from: u32, to: &mut [u32; 2 * LANES]) -> usize {
        // SAFETY: `self` is the proof of AVX-512. Sixteen of seventeen values are loaded, and sixteen of
        // sixteen stored.
        unsafe {
            let before = _mm512_loadu_si512(values.as_ptr().cast());
            let after = _mm512_loadu_si512(values.as_ptr().add(1).cast());
            let changes = _mm512_cmpneq_epi32_mask(before, after);
            let numbers = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let places = _mm512_add_epi32(numbers, _mm512_set1_epi32(from as i32));
            _mm512_storeu_si512(to.as_mut_ptr().cast(), _mm512_maskz_compress_epi32(changes, places));
            changes.count_ones() as usize
        }
    }
    #[inline(always)]
    fn points<const PANORAMA: bool>(self, rays: &EightRays<'_>) -> [__m256; 3] {
        // For the numbers 8k to 8k + 7: the pixel of each depth, and the first axis of x y z x y z…
        const DEPTHS: [[i64; 8]; 3] =
            [[0, 0, 0, 1, 1, 1, 2, 2], [2, 3, 3, 3, 4, 4, 4, 5], [5, 5, 6, 6, 6, 7, 7, 7]];
        const AXES: [usize; 3] = [0, 2, 1];
        /// The class of infinities and NaNs.
        const MISSING: i32 = 0b1001_1001;
        let EightRays { column, row, depths, place } = *rays;
        // SAFETY: `self` is the proof of AVX-512. Loads are from slices and arrays of eight.

        unsafe {
            let all = _mm512_cvtps_pd(_mm256_loadu_ps(depths.as_ptr()));
            let load = |from: &[f64], k: usize| _mm512_loadu_pd(from[k..k + 8].as_ptr());
            let mut points = [_mm256_setzero_ps(); 3];
            for k in 0..3 {
                let depths = _mm512_permutexvar_pd(_mm512_loadu_si512(DEPTHS[k].as_ptr().cast()), all);
                let (column, row) = (load(column, 8 * k), load(row, AXES[k]));
                let direction = if PANORAMA {
                    _mm512_mul_pd(column, row)
                } else {
                    _mm512_add_pd(column, row)
                };
                let point = _mm512_add_pd(load(place, AXES[k]), _mm512_mul_pd(direction, depths));
                let seen = !_mm512_fpclass_pd_mask::<MISSING>(depths);
                points[k] = _mm512_maskz_cvtpd_ps(seen, point);
            }
            points
        }
    }
}

/// For each byte: the numbers of its set bits, ascending, then zeros.
static BITS: [[u8; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut count) = (0, 0);
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                table[byte][count] = bit as u8;
                count += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    table
};

/// Implements [`Width::changes`] for AVX2.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn changes_by_eights(values: &[u32; 2 * LANES + 1], from: u32, to: &mut [u32; 2 * LANES]) -> usize {
    let mut count = 0;
    for first in [0, LANES] {
        // SAFETY: loads and stores of eight values, from `first` + 1 ≤ 9 on and from `count` ≤ 8 on.
        unsafe {
            let before = _mm256_loadu_si256(values.as_ptr().add(first).cast());
            let after = _mm256_loadu_si256(values.as_ptr().add(first + 1).cast());
            let same = _mm256_cmpeq_epi32(before, after);
            let changes = !(_mm256_movemask_ps(_mm256_castsi256_ps(same)) as u32) & 0xFF;
            let places = _mm_loadl_epi64(BITS[changes as usize].as_ptr().cast());
            let from = _mm256_set1_epi32((from + first as u32) as i32);
            let places = _mm256_add_epi32(_mm256_cvtepu8_epi32(places), from);
            _mm256_storeu_si256(to.as_mut_ptr().add(count).cast(), places);
            count += changes.count_ones() as usize;
        }
    }
    count
}

/// Implements [`Width::points`] for AVX2.
#[inline]
#[target_feature(enable = "avx2")]
fn points_by_fours<const PANORAMA: bool>(rays: &EightRays<'_>) -> [__m256; 3] {
    let EightRays { column, row, depths, place } = *rays;
    // SAFETY: the slice has four values.
    let load = |from: &[f64], k: usize| unsafe { _mm256_loadu_pd(from[4 * k..4 * k + 4].as_ptr()) };
    // SAFETY: as above.
    let all = unsafe { _mm256_loadu_ps(depths.as_ptr()) };
    let seen = _mm256_cmp_ps::<_CMP_LT_OQ>(
        _mm256_andnot_ps(_mm256_set1_ps(-0.0), all),
        _mm256_set1_ps(f32::INFINITY),
    );

    let mut out = [_mm_setzero_ps(); 6];
    for half in 0..2 {
        let (four, seen) = if half == 0 {
            (_mm256_castps256_ps128(all), _mm256_castps256_ps128(seen))
        } else {
            (_mm256_extractf128_ps::<1>(all), _mm256_extractf128_ps::<1>(seen))
        };

        let depths = _mm256_cvtps_pd(four);
        let times = [
            _mm256_permute4x64_pd::<0b01_00_00_00>(depths),
            _mm256_permute4x64_pd::<0b10_10_01_01>(depths),
            _mm256_permute4x64_pd::<0b11_11_11_10>(depths),
        ];
        let masks = [
            _mm_permute_ps::<0b01_00_00_00>(seen),
            _mm_permute_ps::<0b10_10_01_01>(seen),
            _mm_permute_ps::<0b11_11_11_10>(seen),
        ];

        for k in 0..3 {
            let (column, row) = (load(column, 3 * half + k), load(row, k));
            let direction = if PANORAMA {
                _mm256_mul_pd(column, row)
            } else {
                _mm256_add_pd(column, row)
            };
            let point = _mm256_add_pd(load(place, k), _mm256_mul_pd(direction, times[k]));
            out[3 * half + k] = _mm_and_ps(_mm256_cvtpd_ps(point), masks[k]);
        }
    }
    [_mm256_set_m128(out[1], out[0]), _mm256_set_m128(out[3], out[2]), _mm256_set_m128(out[5], out[4])]
}
