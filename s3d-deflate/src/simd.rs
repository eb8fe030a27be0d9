//! Wide registers, and the one place where they are chosen.
//!
//! AVX-512 against the portable form makes a view's files in about a third of the time
//! (`docs/performance.md`, "Encoding"). Every form gives the same bytes: tests hold each to the portable one.

/// Bytes in a register, and places that one comparison asks.
pub(crate) const WIDTH: usize = 32;

/// Compares bytes. A value of a type that implements it shows that the processor has what it needs.
pub(crate) trait Compare: Copy {
    /// Which bytes of `window` are `byte`: a bit for each, the first lowest.
    fn equal(self, window: &[u8; WIDTH], byte: u8) -> u32;

    /// The same of two windows, those of the first in the upper half.
    #[inline(always)]
    fn equal_in_two(self, upper: &[u8; WIDTH], lower: &[u8; WIDTH], byte: u8) -> u64 {
        u64::from(self.equal(upper, byte)) << WIDTH | u64::from(self.equal(lower, byte))
    }
}

/// For any processor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

impl Compare for Portable {
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

/// Runs `kernel` in the widest registers that the processor has and the kernel gains from.
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if K::GAINS_FROM_AVX512
            && let Some(avx512) = x86_64::Avx512::detect()
        {
            // SAFETY: an `Avx512` is made only where the processor has every feature that `run_avx512` is
            // compiled for.
            #[allow(unsafe_code)]
            return unsafe { x86_64::run_avx512(kernel, avx512) };
        }
        if let Some(avx2) = x86_64::Avx2::detect() {
            // SAFETY: an `Avx2` is made only where the processor has every feature that `run_avx2` is
            // compiled for.
            #[allow(unsafe_code)]
            return unsafe { x86_64::run_avx2(kernel, avx2) };
        }
    }
    kernel.run(Portable)
}

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use super::{Compare, Kernel, WIDTH};
    use std::arch::is_x86_feature_detected as has;
    use std::arch::x86_64::{
        _mm256_cmpeq_epi8, _mm256_cmpeq_epi8_mask, _mm256_loadu_si256, _mm256_movemask_epi8, _mm256_set1_epi8,
    };

    /// The processor has AVX2, and counts zeros and shifts in one instruction.
    #[derive(Clone, Copy, Debug)]
    pub(super) struct Avx2(());

    impl Avx2 {
        pub(super) fn detect() -> Option<Self> {
            (has!("avx2") && has!("bmi1") && has!("bmi2") && has!("lzcnt")).then_some(Self(()))
        }
    }

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

    /// The processor has AVX-512's comparisons that answer with bits, for registers of 32 bytes, and all of
    /// [`Avx2`].
    #[derive(Clone, Copy, Debug)]
    pub(super) struct Avx512(());

    impl Avx512 {
        pub(super) fn detect() -> Option<Self> {
            (Avx2::detect().is_some() && has!("avx512bw") && has!("avx512vl")).then_some(Self(()))
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

    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt")]
    pub(super) fn run_avx2<K: Kernel>(kernel: K, avx2: Avx2) -> K::Output {
        kernel.run(avx2)
    }

    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,avx512bw,avx512vl")]
    pub(super) fn run_avx512<K: Kernel>(kernel: K, avx512: Avx512) -> K::Output {
        kernel.run(avx512)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn equal_bytes_are_found_in_a_window(window in proptest::array::uniform32(0u8..4), low in 0u8..4) {
            for (window, byte) in [(window, low), (window.map(|b| b.wrapping_sub(2)), low.wrapping_sub(2))] {
                let expected = (0..WIDTH).fold(0, |bits, i| bits | u32::from(window[i] == byte) << i);
                prop_assert_eq!(Portable.equal(&window, byte), expected);
            }
        }

        #[cfg(target_arch = "x86_64")]
        #[test]
        fn all_processors_compare_alike(
            upper in proptest::array::uniform32(0u8..4),
            lower in proptest::array::uniform32(0u8..4),
            byte in 0u8..4,
        ) {
            let expected = Portable.equal_in_two(&upper, &lower, byte);
            prop_assert_eq!(expected >> WIDTH, u64::from(Portable.equal(&upper, byte)));
            if let Some(avx2) = x86_64::Avx2::detect() {
                prop_assert_eq!(avx2.equal_in_two(&upper, &lower, byte), expected);
            }
            if let Some(avx512) = x86_64::Avx512::detect() {
                prop_assert_eq!(avx512.equal_in_two(&upper, &lower, byte), expected);
            }
        }
    }
}
