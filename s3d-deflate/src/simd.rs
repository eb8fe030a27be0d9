//! Loops over bytes in wide registers.
//!
//! AVX-512 against the portable form makes a view's files in about a third of the time
//! (`docs/performance/encoding.md`). Every form gives the same bytes: tests hold each to the portable one.

use s3d_simd::{Scalar, dispatch, level};

/// Bytes in a register, and places that one comparison asks.
pub(crate) const WIDTH: usize = 32;

/// Compares bytes. Levels of instructions do, with their own.
pub(crate) trait Compare: Copy {
    /// Which bytes of `window` are `byte`: a bit for each, the first lowest.
    fn equal(self, window: &[u8; WIDTH], byte: u8) -> u32;

    /// The same of two windows, those of the first in the upper half.
    #[inline(always)]
    fn equal_in_two(self, upper: &[u8; WIDTH], lower: &[u8; WIDTH], byte: u8) -> u64 {
        u64::from(self.equal(upper, byte)) << WIDTH | u64::from(self.equal(lower, byte))
    }
}

impl Compare for Scalar {
    #[inline(always)]
    fn equal(self, window: &[u8; WIDTH], byte: u8) -> u32 {
        const LOW: u64 = 0x7f7f_7f7f_7f7f_7f7f;
        let expected = u64::from(byte) * 0x0101_0101_0101_0101;
        let mut equal = 0;
        for (i, eight) in window.as_chunks::<8>().0.iter().enumerate() {
            let differ = u64::from_le_bytes(*eight) ^ expected;
            // The highest bit of each byte that is 0, then all of them side by side.
            let zeros = !(((differ & LOW) + LOW) | differ | LOW);
            equal |= ((zeros >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * i);
        }
        equal as u32
    }
}

/// Loops over bytes. `run` is `#[inline(always)]`, so that [`dispatch`] compiles it once for each kind of
/// registers.
pub(crate) trait Kernel {
    type Output;
    /// Whether AVX-512 makes it faster than AVX2.
    const GAINS_FROM_AVX512: bool;
    fn run<C: Compare>(self, compare: C) -> Self::Output;
}

/// Runs `kernel` in the widest registers that are in use and that it gains from.
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    let level = if K::GAINS_FROM_AVX512 { level() } else { level().without_avx512() };
    dispatch!(level, simd => kernel.run(simd))
}

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use super::{Compare, WIDTH};
    use s3d_simd::{Avx2, Avx512};
    use std::arch::x86_64::{
        _mm256_cmpeq_epi8, _mm256_cmpeq_epi8_mask, _mm256_loadu_si256, _mm256_movemask_epi8, _mm256_set1_epi8,
    };

    impl Compare for Avx2 {
        #[inline(always)]
        fn equal(self, window: &[u8; WIDTH], byte: u8) -> u32 {
            // SAFETY: the load reads the window's 32 bytes, from any address; an `Avx2` is made only where
            // the processor has AVX2.
            #[allow(unsafe_code)]
            unsafe {
                let window = _mm256_loadu_si256(window.as_ptr().cast());
                _mm256_movemask_epi8(_mm256_cmpeq_epi8(window, _mm256_set1_epi8(byte as i8))) as u32
            }
        }
    }

    impl Compare for Avx512 {
        #[inline(always)]
        fn equal(self, window: &[u8; WIDTH], byte: u8) -> u32 {
            // SAFETY: the load reads the window's 32 bytes, from any address; an `Avx512` is made only where
            // the processor has AVX-512BW and AVX-512VL.
            #[allow(unsafe_code)]
            unsafe {
                let window = _mm256_loadu_si256(window.as_ptr().cast());
                _mm256_cmpeq_epi8_mask(window, _mm256_set1_epi8(byte as i8))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use s3d_simd::Level;

    proptest! {
        #[test]
        fn equal_bytes_are_found_in_a_window(window in proptest::array::uniform32(0u8..4), low in 0u8..4) {
            for (window, byte) in [(window, low), (window.map(|b| b.wrapping_sub(2)), low.wrapping_sub(2))] {
                let expected = (0..WIDTH).fold(0, |bits, i| bits | u32::from(window[i] == byte) << i);
                prop_assert_eq!(Scalar.equal(&window, byte), expected);
            }
        }

        #[test]
        fn all_processors_compare_alike(
            upper in proptest::array::uniform32(0u8..4),
            lower in proptest::array::uniform32(0u8..4),
            byte in 0u8..4,
        ) {
            let expected = Scalar.equal_in_two(&upper, &lower, byte);
            prop_assert_eq!(expected >> WIDTH, u64::from(Scalar.equal(&upper, byte)));
            for level in Level::all() {
                prop_assert_eq!(dispatch!(level, simd => simd.equal_in_two(&upper, &lower, byte)), expected);
            }
        }
    }
}
