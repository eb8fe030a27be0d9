//! Implements [`ShadeLanes`] with AVX2, and with AVX-512 where registers of 64 bytes are faster.
//!
//! Every unsafe block uses instructions whose proof `self` holds, or loads from and stores to references that
//! are large enough.
#![allow(unsafe_code)]

use crate::simd::shade_lanes::{COLOR_BLOCK, EightRays, LANES, ShadeLanes, Texels};
use crate::simd::shade_width::Width;
use half::f16;
use std::arch::x86_64::*;

/// The proof of AVX2, and the width of the registers that blend texels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eight<W>(pub(crate) W);

/// Operations on registers that touch no memory.
macro_rules! registers {
    ($(fn $name:ident($($arg:ident: $type:ty),*) -> $out:ty = $body:expr;)*) => {$(
        #[inline(always)]
        fn $name(self, $($arg: $type),*) -> $out {
            // SAFETY: `self` holds the proof that the processor has AVX2.
            unsafe { $body }
        }
    )*};
}

impl<W: Width> ShadeLanes for Eight<W> {
    type F = __m256;
    type I = __m256i;
    /// The parts to the right, then the parts downwards.
    type Parts = __m256i;
    type Weights = __m128i;
    type Corners = W::Corners;
    type Quads = W::Quads;
    type ColorSum = W::ColorSum;

    registers! {
        fn splat(value: f32) -> __m256 = _mm256_set1_ps(value);
        fn add(a: __m256, b: __m256) -> __m256 = _mm256_add_ps(a, b);
        fn sub(a: __m256, b: __m256) -> __m256 = _mm256_sub_ps(a, b);
        fn mul(a: __m256, b: __m256) -> __m256 = _mm256_mul_ps(a, b);
        fn div(a: __m256, b: __m256) -> __m256 = _mm256_div_ps(a, b);
        fn sqrt(a: __m256) -> __m256 = _mm256_sqrt_ps(a);
        fn min(a: __m256, b: __m256) -> __m256 = _mm256_min_ps(a, b);
        fn max(a: __m256, b: __m256) -> __m256 = _mm256_max_ps(a, b);
        fn select_by_sign(of: __m256, negative: __m256, positive: __m256) -> __m256 =
            _mm256_blendv_ps(positive, negative, of);
        fn select(these: u32, yes: __m256, no: __m256) -> __m256 =
            _mm256_blendv_ps(no, yes, _mm256_castsi256_ps(lanes_of(these)));
        fn truncate(values: __m256) -> __m256 = _mm256_cvtepi32_ps(_mm256_cvttps_epi32(values));
        fn greater(a: __m256, b: __m256) -> u32 =
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(a, b)) as u32;
        fn log2(values: __m256) -> (__m256, __m256) = {
            let bits = _mm256_castps_si256(values);
            let whole = _mm256_sub_epi32(_mm256_srli_epi32::<23>(bits), _mm256_set1_epi32(127));
            let digits = _mm256_and_si256(bits, _mm256_set1_epi32(0x007F_FFFF));
            let mantissa = _mm256_castsi256_ps(_mm256_or_si256(digits, _mm256_set1_epi32(0x3F80_0000)));
            let third = _mm256_mul_ps(mantissa, _mm256_set1_ps(1.0 / 3.0));
            let parabola = _mm256_mul_ps(_mm256_sub_ps(_mm256_set1_ps(2.0), third), mantissa);
            let fraction = _mm256_sub_ps(parabola, _mm256_set1_ps(5.0 / 3.0));
            (_mm256_cvtepi32_ps(whole), _mm256_max_ps(fraction, _mm256_setzero_ps()))
        };
        fn fixed(values: __m256) -> __m256i =
            _mm256_cvttps_epi32(_mm256_mul_ps(values, _mm256_set1_ps(32768.0)));
        fn add_fixed(a: __m256i, b: __m256i) -> __m256i = _mm256_add_epi32(a, b);
        fn within(values: __m256i, end: u32) -> u32 = {
            // A negative number is large as an unsigned one.
            let most = _mm256_max_epu32(values, _mm256_set1_epi32(end as i32));
            let beyond = _mm256_cmpeq_epi32(most, values);
            !(_mm256_movemask_ps(_mm256_castsi256_ps(beyond)) as u32) & 0xFF
        };
        fn place(x: __m256i, y: __m256i, stride: i32, these: u32) -> (__m256i, __m256i) = {
            let rest = _mm256_set1_epi32(0x7FFF);
            // x of pixels 0 to 3, y of pixels 0 to 3, then the same of pixels 4 to 7.
            let parts = _mm256_packus_epi32(_mm256_and_si256(x, rest), _mm256_and_si256(y, rest));
            let columns = _mm256_srai_epi32::<15>(x);
            let columns = _mm256_add_epi32(columns, _mm256_add_epi32(columns, columns));
            let rows = _mm256_mullo_epi32(_mm256_srai_epi32::<15>(y), _mm256_set1_epi32(stride));
            let at = _mm256_and_si256(_mm256_add_epi32(rows, columns), lanes_of(these));
            (at, _mm256_permute4x64_epi64::<0b11_01_10_00>(parts))
        };
        fn weights(weights: __m256) -> __m128i = {
            let whole = _mm256_cvttps_epi32(weights);
            _mm_packs_epi32(_mm256_castsi256_si128(whole), _mm256_extracti128_si256::<1>(whole))
        };
        fn masked(these: u32, weights: __m128i) -> __m128i = {
            let bits = _mm_setr_epi16(1, 2, 4, 8, 16, 32, 64, 128);
            let all = _mm_and_si128(_mm_set1_epi16(these as i16), bits);
            _mm_and_si128(weights, _mm_cmpeq_epi16(all, bits))
        };
        fn full_weights() -> __m128i = _mm_set1_epi16(i16::MIN);
    }

    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> __m256 {
        // SAFETY: `self` holds the proof of AVX2; the array has eight values.
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, values: __m256, to: &mut [f32; LANES]) {
        // SAFETY: as in `load`, for arrays of eight values.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), values) }
    }
    #[inline(always)]
    fn store_int(self, values: __m256, to: &mut [i32; LANES]) {
        // SAFETY: as in `load`, for arrays of eight values.
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm256_cvttps_epi32(values)) }
    }
    #[inline(always)]
    fn store_fixed(self, values: __m256i, to: &mut [i32; LANES]) {
        // SAFETY: as in `load`, for arrays of eight values.
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), values) }
    }
    #[inline(always)]
    fn parts(self, x: &[i16; LANES], y: &[i16; LANES]) -> __m256i {
        // SAFETY: as in `load`, for arrays of eight values.
        unsafe { _mm256_set_m128i(_mm_loadu_si128(y.as_ptr().cast()), _mm_loadu_si128(x.as_ptr().cast())) }
    }
    #[inline(always)]
    fn store_parts(self, parts: __m256i, x: &mut [i16; LANES], y: &mut [i16; LANES]) {
        // SAFETY: as in `load`, for arrays of eight values.
        unsafe {
            _mm_storeu_si128(x.as_mut_ptr().cast(), _mm256_castsi256_si128(parts));
            _mm_storeu_si128(y.as_mut_ptr().cast(), _mm256_extracti128_si256::<1>(parts));
        }
    }
    #[inline(always)]
    fn quads(self, image: &Texels<'_>, at: __m256i) -> Option<Self::Quads> {
        if self.within(at, image.end()) != 0xFF {
            return None;
        }
        // SAFETY: all places are below `end`. `Texels` promises eight bytes at every place below it, and
        // eight more a row later.
        Some(unsafe { self.0.quads(image.bytes().as_ptr(), at, image.stride() as usize) })
    }
    #[inline(always)]
    fn quads_from(self, upper: &[u64; LANES], lower: &[u64; LANES]) -> Self::Quads {
        self.0.quads_from(upper, lower)
    }
    #[inline(always)]
    fn corners(self, parts: __m256i, weights: __m128i) -> Self::Corners {
        // SAFETY: `self` holds the proof of AVX2.
        unsafe {
            let lower = _mm_mulhrs_epi16(weights, _mm256_extracti128_si256::<1>(parts));
            let rows = _mm256_set_m128i(lower, _mm_sub_epi16(weights, lower));
            let x = _mm256_broadcastsi128_si256(_mm256_castsi256_si128(parts));
            let right = _mm256_mulhrs_epi16(rows, x);
            let left = _mm256_sub_epi16(rows, right);
            self.0
                .corners(_mm256_unpacklo_epi16(left, right), _mm256_unpackhi_epi16(left, right))
        }
    }
    #[inline(always)]
    fn zero_sum(self) -> Self::ColorSum {
        self.0.none()
    }
    #[inline(always)]
    fn add_weighted(self, sum: Self::ColorSum, quads: Self::Quads, corners: Self::Corners) -> Self::ColorSum {
        self.0.add(sum, quads, corners)
    }
    #[inline(always)]
    fn channels(self, sum: Self::ColorSum) -> [__m256; 3] {
        self.0.channels(sum)
    }
    #[inline(always)]
    fn pixels(self, sum: Self::ColorSum) -> [u32; LANES] {
        // SAFETY: `self` holds the proof of AVX2; the array has eight values.
        unsafe {
            let colors = self.0.bytes(sum);
            let black = _mm256_cmpeq_epi32(colors, _mm256_setzero_si256());
            let colors = _mm256_or_si256(colors, _mm256_and_si256(black, _mm256_set1_epi32(0x01_01_01)));
            let mut pixels = [0; LANES];
            _mm256_storeu_si256(pixels.as_mut_ptr().cast(), colors);
            pixels
        }
    }
    #[inline(always)]
    fn store_pixels(self, packed: &[u32; LANES], to: &mut [u8; 3 * LANES]) {
        // SAFETY: `self` holds the proof of AVX2; all 32 bytes are loaded, and all 24 are stored, as 16 + 8.
        unsafe {
            let packed = _mm256_loadu_si256(packed.as_ptr().cast());
            let three = _mm_setr_epi8(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1);
            let close = _mm256_shuffle_epi8(packed, _mm256_broadcastsi128_si256(three));
            let close = _mm256_permutevar8x32_epi32(close, _mm256_setr_epi32(0, 1, 2, 4, 5, 6, 3, 7));
            _mm_storeu_si128(to.as_mut_ptr().cast(), _mm256_castsi256_si128(close));
            _mm_storel_epi64(to.as_mut_ptr().add(16).cast(), _mm256_extracti128_si256::<1>(close));
        }
    }
    #[inline(always)]
    fn store_repeated(self, packed: u32, to: &mut [u8; COLOR_BLOCK]) {
        // SAFETY: `self` holds the proof of AVX2; all 32 bytes are stored.
        unsafe {
            let three = _mm256_setr_epi8(
                0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, //
                1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1,
            );
            let bytes = _mm256_shuffle_epi8(_mm256_set1_epi32(packed as i32), three);
            _mm256_storeu_si256(to.as_mut_ptr().cast(), bytes);
        }
    }
    #[inline(always)]
    fn prefetch<T>(self, thing: &T) {
        s3d_simd::prefetch(thing);
    }
    #[inline(always)]
    fn equal(self, values: &[u32; LANES], value: u32) -> u32 {
        // SAFETY: as in `load`, for arrays of eight values.
        unsafe {
            let values = _mm256_loadu_si256(values.as_ptr().cast());
            let same = _mm256_cmpeq_epi32(values, _mm256_set1_epi32(value as i32));
            _mm256_movemask_ps(_mm256_castsi256_ps(same)) as u32
        }
    }
    #[inline(always)]
    fn changes(self, values: &[u32; 2 * LANES + 1], from: u32, to: &mut [u32; 2 * LANES]) -> usize {
        self.0.changes(values, from, to)
    }
    #[inline(always)]
    fn depths(self, depths: &[f32; LANES], to: &mut [u16; LANES]) {
        // SAFETY: as in `load`, for arrays of eight values.
        unsafe {
            let twice = _mm256_mul_ps(_mm256_loadu_ps(depths.as_ptr()), _mm256_set1_ps(1024.0));
            // `max` returns its second value if the first is NaN.
            let twice = _mm256_max_ps(twice, _mm256_setzero_ps());
            let twice = _mm256_cvttps_epi32(_mm256_min_ps(twice, _mm256_set1_ps(131_070.0)));
            let rounded = _mm256_srli_epi32::<1>(_mm256_add_epi32(twice, _mm256_set1_epi32(1)));
            let (low, high) = (_mm256_castsi256_si128(rounded), _mm256_extracti128_si256::<1>(rounded));
            _mm_storeu_si128(to.as_mut_ptr().cast(), _mm_packus_epi32(low, high));
        }
    }
    #[inline(always)]
    fn points<const PANORAMA: bool>(self, rays: &EightRays<'_>, to: &mut [f32; 3 * LANES]) {
        // SAFETY: `self` holds the proof of AVX2; all 24 numbers are stored, as three times eight.
        unsafe {
            let points = self.0.points::<PANORAMA>(rays);
            for (k, eight) in points.iter().enumerate() {
                _mm256_storeu_ps(to.as_mut_ptr().add(8 * k), *eight);
            }
        }
    }
    #[inline(always)]
    fn half_points<const PANORAMA: bool>(self, rays: &EightRays<'_>, to: &mut [f16; 3 * LANES]) {
        // SAFETY: `self` holds the proof of F16C; all 24 numbers are stored, as three times eight.
        unsafe {
            let points = self.0.points::<PANORAMA>(rays);
            for (k, eight) in points.iter().enumerate() {
                let eight = _mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(*eight);
                _mm_storeu_si128(to.as_mut_ptr().add(8 * k).cast(), eight);
            }
        }
    }
}

/// Returns a mask: all bits of the lanes in `these` are set.
#[inline]
#[target_feature(enable = "avx2")]
fn lanes_of(these: u32) -> __m256i {
    let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(these as i32), bits), bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::shade_lanes::Plain;
    use proptest::prelude::*;
    use s3d_simd::{Avx2, Avx512};

    fn eight() -> impl Strategy<Value = [f32; LANES]> {
        let number = prop_oneof![
            4 => -200.0..200.0f32,
            1 => any::<f32>(),
            1 => prop::sample::select(vec![0.0, -0.0, f32::INFINITY, f32::NAN, 1.0, 127.998, 1.0 / 1024.0]),
        ];
        prop::array::uniform8(number)
    }

    fn bits(a: [f32; LANES]) -> [u32; LANES] {
        // All NaNs count as the same bit pattern.
        a.map(|v| if v.is_nan() { f32::NAN.to_bits() } else { v.to_bits() })
    }

    /// Compares weighted sums of colours, with partial and with full weights.
    fn same_colors<L: ShadeLanes>(
        lanes: L,
        upper: &[u64; LANES],
        lower: &[u64; LANES],
        (x, y): (&[i16; LANES], &[i16; LANES]),
        weights: &[f32; LANES],
        these: u32,
    ) -> Result<(), TestCaseError> {
        let quads = lanes.quads_from(upper, lower);
        let plain_quads = Plain.quads_from(upper, lower);
        let parts = (lanes.parts(x, y), Plain.parts(x, y));
        let all =
            (lanes.corners(parts.0, lanes.full_weights()), Plain.corners(parts.1, Plain.full_weights()));
        let some = (lanes.weights(lanes.load(weights)), Plain.weights(*weights));
        let some = (lanes.masked(these, some.0), Plain.masked(these, some.1));
        let some = (lanes.corners(parts.0, some.0), Plain.corners(parts.1, some.1));
        let mut sum = lanes.zero_sum();
        let mut plain = Plain.zero_sum();
        for (corners, plain_corners) in [some, some, all] {
            sum = lanes.add_weighted(sum, quads, corners);
            plain = Plain.add_weighted(plain, plain_quads, plain_corners);
            prop_assert_eq!(lanes.pixels(sum), Plain.pixels(plain));
            for (channel, plain) in lanes.channels(sum).into_iter().zip(Plain.channels(plain)) {
                let mut got = [0.0; LANES];
                lanes.store(channel, &mut got);
                prop_assert_eq!(got, plain);
            }
        }
        let one = lanes.add_weighted(lanes.zero_sum(), quads, all.0);
        let plain = Plain.add_weighted(Plain.zero_sum(), plain_quads, all.1);
        prop_assert_eq!(lanes.pixels(one), Plain.pixels(plain));
        Ok(())
    }

    /// Compares the texels that are read from an image.
    fn same_quads<L: ShadeLanes>(
        lanes: L,
        image: &Texels<'_>,
        (at, parts): (L::I, L::Parts),
        (plain_at, plain_parts): ([i32; LANES], ([i16; LANES], [i16; LANES])),
    ) -> Result<(), TestCaseError> {
        let (quads, plain) = (lanes.quads(image, at), Plain.quads(image, plain_at));
        prop_assert_eq!(quads.is_some(), plain.is_some());
        if let (Some(quads), Some(plain)) = (quads, plain) {
            let got = lanes.add_weighted(lanes.zero_sum(), quads, lanes.corners(parts, lanes.full_weights()));
            let all = Plain.corners(plain_parts, Plain.full_weights());
            let want = Plain.add_weighted(Plain.zero_sum(), plain, all);
            prop_assert_eq!(lanes.pixels(got), Plain.pixels(want));
        }
        Ok(())
    }

    /// Compares the points, in `f32` and in half floats.
    fn same_points(lanes: impl ShadeLanes, rays: &EightRays<'_>) -> Result<(), TestCaseError> {
        let mut got = [0.0; 24];
        let mut want = [0.0; 24];
        lanes.points::<false>(rays, &mut got);
        Plain.points::<false>(rays, &mut want);
        prop_assert_eq!(got.map(f32::to_bits), want.map(f32::to_bits));
        let mut got = [f16::ZERO; 24];
        let mut want = [f16::ZERO; 24];
        lanes.half_points::<true>(rays, &mut got);
        Plain.half_points::<true>(rays, &mut want);
        prop_assert_eq!(got.map(f16::to_bits), want.map(f16::to_bits));
        Ok(())
    }

    fn repeated(a: [f64; 3]) -> [f64; 12] {
        std::array::from_fn(|k| a[k % 3])
    }

    proptest! {
        #[test]
        fn numbers_are_those_of_plain_rust(a in eight(), b in eight(), c in eight()) {
            let Some(avx2) = Avx2::detect().map(Eight) else { return Ok(()) };
            let x = avx2.load(&a);
            let y = avx2.load(&b);
            let z = avx2.load(&c);
            let mut got = [0.0; LANES];
            macro_rules! same {
                ($op:ident, $($avx2:expr, $plain:expr);*) => {
                    avx2.store(avx2.$op($($avx2),*), &mut got);
                    prop_assert_eq!(bits(got), bits(Plain.$op($($plain),*)), "{}", stringify!($op));
                };
            }
            same!(add, x, a; y, b);
            same!(sub, x, a; y, b);
            same!(mul, x, a; y, b);
            same!(div, x, a; y, b);
            same!(min, x, a; y, b);
            same!(max, x, a; y, b);
            same!(sqrt, x, a);
            same!(select_by_sign, x, a; y, b; z, c);
            for these in [0, 0b1001_0110, 255] {
                same!(select, these, these; x, a; y, b);
            }

            let above_one = a.map(|v| if v.abs() >= 1.0 { v.abs() } else { 1.0 });
            let (whole, rest) = avx2.log2(avx2.load(&above_one));
            let (plain_whole, plain_rest) = Plain.log2(above_one);
            avx2.store(whole, &mut got);
            prop_assert_eq!(bits(got), bits(plain_whole));
            avx2.store(rest, &mut got);
            prop_assert_eq!(bits(got), bits(plain_rest));

            prop_assert_eq!(avx2.greater(avx2.load(&a), avx2.load(&b)), Plain.greater(a, b));
            let mut got = [0; LANES];
            let mut want = [0; LANES];
            avx2.depths(&a, &mut got);
            Plain.depths(&a, &mut want);
            prop_assert_eq!(got, want);
        }

        #[test]
        fn colors_are_those_of_plain_rust(
            upper: [u64; LANES], lower: [u64; LANES],
            x in prop::array::uniform8(0i16..), y in prop::array::uniform8(0i16..),
            weights in prop::array::uniform8(-32768.0..=0.0f32), these in 0u32..256,
        ) {
            let Some(avx2) = Avx2::detect().map(Eight) else { return Ok(()) };
            same_colors(avx2, &upper, &lower, (&x, &y), &weights, these)?;
            if let Some(full) = Avx512::detect().map(Eight) {
                same_colors(full, &upper, &lower, (&x, &y), &weights, these)?;
            }

            let packed = upper.map(|v| v as u32);
            let mut got = [0; 3 * LANES];
            let mut want = [0; 3 * LANES];
            avx2.store_pixels(&packed, &mut got);
            Plain.store_pixels(&packed, &mut want);
            prop_assert_eq!(got, want);
            let mut got = [0; COLOR_BLOCK];
            let mut want = [0; COLOR_BLOCK];
            avx2.store_repeated(packed[0], &mut got);
            Plain.store_repeated(packed[0], &mut want);
            prop_assert_eq!(got, want);
        }

        #[test]
        fn places_and_what_is_there_are_those_of_plain_rust(
            x in prop::array::uniform8(-2.0..12.0f32), y in prop::array::uniform8(-2.0..9.0f32),
            these in 0u32..256, bytes in prop::collection::vec(any::<u8>(), 0..400),
        ) {
            let Some(avx2) = Avx2::detect().map(Eight) else { return Ok(()) };
            let image = Texels::new(&bytes, 36);
            let a = avx2.fixed(avx2.load(&x));
            let b = avx2.fixed(avx2.load(&y));
            let (at, parts) = avx2.place(a, b, 36, these);
            let plain = Plain.place(Plain.fixed(x), Plain.fixed(y), 36, these);
            let mut got = ([0; LANES], ([0; LANES], [0; LANES]));
            avx2.store_fixed(at, &mut got.0);
            avx2.store_parts(parts, &mut got.1.0, &mut got.1.1);
            prop_assert_eq!(got, plain);
            same_quads(avx2, &image, (at, parts), plain)?;
            if let Some(full) = Avx512::detect().map(Eight) {
                same_quads(full, &image, full.place(a, b, 36, these), plain)?;
            }
        }

        #[test]
        fn whole_numbers_are_those_of_plain_rust(a in eight(), b in eight(), end in 0u32..=1 << 31) {
            let Some(avx2) = Avx2::detect().map(Eight) else { return Ok(()) };
            let x = avx2.fixed(avx2.load(&a));
            let y = avx2.fixed(avx2.load(&b));

            let plain_x = Plain.fixed(a);
            let plain_y = Plain.fixed(b);
            let mut got = [0; LANES];
            let sum = Plain.add_fixed(plain_x, plain_y);
            avx2.store_fixed(x, &mut got);
            prop_assert_eq!(got, plain_x);
            avx2.store_fixed(avx2.add_fixed(x, y), &mut got);
            prop_assert_eq!(got, sum);

            for end in [end, sum[0] as u32 & i32::MAX as u32, 0] {
                prop_assert_eq!(avx2.within(avx2.add_fixed(x, y), end), Plain.within(sum, end));
            }
        }

        #[test]
        fn changes_are_those_of_plain_rust(values in prop::collection::vec(0u32..3, 17)) {
            let Some(avx2) = Avx2::detect().map(Eight) else { return Ok(()) };
            let window = std::array::from_fn(|k| values[k]);
            let mut got = [0; 16];
            let mut want = [0; 16];
            let same = Plain.changes(&window, 70_000, &mut want);
            let some = avx2.changes(&window, 70_000, &mut got);
            prop_assert_eq!(&got[..some], &want[..same]);
            if let Some(full) = Avx512::detect().map(Eight) {
                let some = full.changes(&window, 70_000, &mut got);
                prop_assert_eq!(&got[..some], &want[..same]);
            }
            let eight = std::array::from_fn(|k| values[k] << 30);
            prop_assert_eq!(avx2.equal(&eight, 1 << 30), Plain.equal(&eight, 1 << 30));
        }

        #[test]
        fn points_are_those_of_plain_rust(
            column in prop::array::uniform24(-2.0..2.0f64), row in prop::array::uniform3(-2.0..2.0f64),
            place in prop::array::uniform3(-100.0..100.0f64), depths in eight(),
        ) {
            let Some(avx2) = Avx2::detect().map(Eight) else { return Ok(()) };
            let row = repeated(row);
            let place = repeated(place);
            let rays = EightRays { column: &column, row: &row, depths: &depths, place: &place };
            same_points(avx2, &rays)?;
            if let Some(full) = Avx512::detect().map(Eight) {
                same_points(full, &rays)?;
            }
        }
    }
}
