//! Loops over bytes in wide registers.
//!
//! Wide registers make the files of a view in a third of the time of the portable form
//! (the book's page on encoding). Every form gives the same bytes; tests compare each with the portable
//! form.

use s3d_simd::{ProvenLevel, Scalar, level};

/// The number of bytes in a register, and of places that one comparison covers.
pub(crate) const WIDTH: usize = 32;
/// The number of successive bytes that are compared at once.
pub(crate) const ROW: usize = 16;

/// A comparison of bytes, with the instructions of a level.
pub(crate) trait Compare: Copy {
    /// Returns which bytes of `window` equal `byte`: a bit for each, the first lowest.
    fn equal(self, window: &[u8; WIDTH], byte: u8) -> u32;

    /// Compares each byte of a row with two windows. The windows of the first byte begin at the first byte of
    /// `upper` and `lower`; the windows of each next byte begin one byte later. The result of the upper
    /// window is in the upper half of the bits.
    #[inline(always)]
    fn equal_in_two(
        self,
        upper: &[u8; WIDTH + ROW],
        lower: &[u8; WIDTH + ROW],
        bytes: &[u8; ROW],
        equal: &mut [u64; ROW],
    ) {
        let windows = upper.array_windows().zip(lower.array_windows());
        for ((equal, (upper, lower)), &byte) in equal.iter_mut().zip(windows).zip(bytes) {
            *equal = u64::from(self.equal(upper, byte)) << WIDTH | u64::from(self.equal(lower, byte));
        }
    }

    /// Compares each byte of a row like [`equal_in_two`](Self::equal_in_two), with windows of half the size.
    #[inline(always)]
    fn equal_in_halves(
        self,
        upper: &[u8; WIDTH],
        lower: &[u8; WIDTH],
        bytes: &[u8; ROW],
        equal: &mut [u32; ROW],
    ) {
        let windows = upper.array_windows().zip(lower.array_windows());
        for ((equal, (upper, lower)), &byte) in equal.iter_mut().zip(windows).zip(bytes) {
            *equal = self.equal(&joined(upper, lower), byte);
        }
    }
}

/// Joins two windows of half the size.
#[inline(always)]
pub(crate) fn joined(upper: &[u8; WIDTH / 2], lower: &[u8; WIDTH / 2]) -> [u8; WIDTH] {
    let mut window = [0; WIDTH];
    window[..WIDTH / 2].copy_from_slice(lower);
    window[WIDTH / 2..].copy_from_slice(upper);
    window
}

impl Compare for Scalar {
    #[inline(always)]
    fn equal(self, window: &[u8; WIDTH], byte: u8) -> u32 {
        const LOW: u64 = 0x7f7f_7f7f_7f7f_7f7f;
        let expected = u64::from(byte) * 0x0101_0101_0101_0101;
        let mut equal = 0;
        for (i, eight) in window.as_chunks::<8>().0.iter().enumerate() {
            let differ = u64::from_le_bytes(*eight) ^ expected;
            // The highest bit of each byte that is 0. The multiplication then moves them side by side.
            let zeros = !(((differ & LOW) + LOW) | differ | LOW);
            equal |= ((zeros >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * i);
        }
        equal as u32
    }
}

/// Work that loops over bytes. `run` is `#[inline(always)]`, so [`dispatch`] compiles it once for each kind
/// of registers.
pub(crate) trait Kernel {
    type Output;
    /// True if AVX-512 is faster than AVX2.
    const GAINS_FROM_AVX512: bool;
    fn run<C: Compare>(self, compare: C) -> Self::Output;
}

/// Runs `kernel` in the widest registers that are in use and make it faster.
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    dispatch_on(
        if K::GAINS_FROM_AVX512 {
            level()
        } else {
            level().without_avx512()
        },
        kernel,
    )
}

fn dispatch_on<K: Kernel>(level: ProvenLevel, kernel: K) -> K::Output {
    match level {
        ProvenLevel::Scalar(scalar) => kernel.run(scalar),
        #[cfg(target_arch = "x86_64")]
        ProvenLevel::Avx2(avx2) => avx2.vectorize(
            #[inline(always)]
            || kernel.run(avx2),
        ),
        // Comparisons use AVX2, since mask registers are no faster. The code around them gains from AVX-512.
        #[cfg(target_arch = "x86_64")]
        ProvenLevel::Avx512(avx512) => avx512.vectorize(
            #[inline(always)]
            || kernel.run(avx512.avx2()),
        ),
    }
}

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use super::{Compare, ROW, WIDTH};
    use s3d_simd::Avx2;
    use std::arch::x86_64::{
        __m256i, _mm_loadu_si128, _mm256_alignr_epi8, _mm256_cmpeq_epi8, _mm256_loadu_si256,
        _mm256_movemask_epi8, _mm256_set_m128i, _mm256_set1_epi8,
    };

    /// Expands `$body` for each byte of a row. The constant `$j` is the number of the byte.
    macro_rules! for_each_of_row {
        ($j:ident => $body:expr) => {
            for_each_of_row!(@ $j [0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15] => $body)
        };
        (@ $j:ident [$($n:literal)*] => $body:expr) => { $({ const $j: usize = $n; $body; })* };
    }

    /// Loads the bytes of `window` from `at` on.
    #[inline(always)]
    fn load<const N: usize>(window: &[u8; N], at: usize) -> __m256i {
        let bytes: &[u8; WIDTH] = window[at..].first_chunk().expect("a window is longer");
        // SAFETY: the load reads 32 bytes, from any address. The callers are methods of `Avx2`, which proves
        // that the processor has AVX2.
        #[allow(unsafe_code)]
        unsafe {
            _mm256_loadu_si256(bytes.as_ptr().cast())
        }
    }

    /// Views numbers as their halves, the lower half first.
    #[inline(always)]
    fn halves(numbers: &mut [u64; ROW]) -> &mut [[u32; 2]; ROW] {
        // SAFETY: the types have the same size, the target needs less alignment, and both take any bits. The
        // lower half comes first on x86-64.
        #[allow(unsafe_code)]
        unsafe {
            &mut *std::ptr::from_mut(numbers).cast()
        }
    }

    impl Compare for Avx2 {
        #[inline(always)]
        fn equal(self, window: &[u8; WIDTH], byte: u8) -> u32 {
            // SAFETY: an `Avx2` exists only if the processor has AVX2.
            #[allow(unsafe_code)]
            unsafe {
                _mm256_movemask_epi8(_mm256_cmpeq_epi8(load(window, 0), _mm256_set1_epi8(byte as i8))) as u32
            }
        }

        // Windows are shifted in registers, in halves of 16 bytes. Loading each window would take longer.
        #[inline(always)]
        fn equal_in_two(
            self,
            upper: &[u8; WIDTH + ROW],
            lower: &[u8; WIDTH + ROW],
            bytes: &[u8; ROW],
            equal: &mut [u64; ROW],
        ) {
            let after_upper = load(upper, ROW);
            let upper = load(upper, 0);
            let after_lower = load(lower, ROW);
            let lower = load(lower, 0);
            let halves = halves(equal);

            for_each_of_row!(J => {
                // SAFETY: an `Avx2` exists only if the processor has AVX2.
                #[allow(unsafe_code)]
                unsafe {
                    let byte = _mm256_set1_epi8(bytes[J] as i8);
                    let upper = _mm256_alignr_epi8::<{ J as i32 }>(after_upper, upper);
                    let lower = _mm256_alignr_epi8::<{ J as i32 }>(after_lower, lower);
                    halves[J][1] = _mm256_movemask_epi8(_mm256_cmpeq_epi8(upper, byte)) as u32;
                    halves[J][0] = _mm256_movemask_epi8(_mm256_cmpeq_epi8(lower, byte)) as u32;
                }
            });
        }

        #[inline(always)]
        fn equal_in_halves(
            self,
            upper: &[u8; WIDTH],
            lower: &[u8; WIDTH],
            bytes: &[u8; ROW],
            equal: &mut [u32; ROW],
        ) {
            // SAFETY: the loads read 16 of 32 bytes, and an `Avx2` exists only if the processor has AVX2.
            #[allow(unsafe_code)]
            let (both, after) = unsafe {
                let half =
                    |window: &[u8; WIDTH], at: usize| _mm_loadu_si128(window[at..at + ROW].as_ptr().cast());
                (
                    _mm256_set_m128i(half(upper, 0), half(lower, 0)),
                    _mm256_set_m128i(half(upper, ROW), half(lower, ROW)),
                )
            };

            for_each_of_row!(J => {
                // SAFETY: an `Avx2` exists only if the processor has AVX2.
                #[allow(unsafe_code)]
                unsafe {
                    let windows = _mm256_alignr_epi8::<{ J as i32 }>(after, both);
                    let byte = _mm256_set1_epi8(bytes[J] as i8);
                    equal[J] = _mm256_movemask_epi8(_mm256_cmpeq_epi8(windows, byte)) as u32;
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A kernel that makes both comparisons of a row.
    #[derive(Clone, Copy)]
    struct Windows<'a> {
        upper: &'a [u8; WIDTH + ROW],
        lower: &'a [u8; WIDTH + ROW],
        upper_half: &'a [u8; WIDTH],
        lower_half: &'a [u8; WIDTH],
        bytes: &'a [u8; ROW],
    }

    impl Kernel for Windows<'_> {
        type Output = ([u64; ROW], [u32; ROW]);
        const GAINS_FROM_AVX512: bool = true;

        fn run<C: Compare>(self, compare: C) -> Self::Output {
            let mut in_two = [0; ROW];
            let mut in_halves = [0; ROW];
            compare.equal_in_two(self.upper, self.lower, self.bytes, &mut in_two);
            compare.equal_in_halves(self.upper_half, self.lower_half, self.bytes, &mut in_halves);
            (in_two, in_halves)
        }
    }

    proptest! {
        #[test]
        fn equal_bytes_are_found_in_a_window(window in proptest::array::uniform32(0u8..4), low in 0u8..4) {
            for (window, byte) in [(window, low), (window.map(|b| b.wrapping_sub(2)), low.wrapping_sub(2))] {
                let expected = (0..WIDTH).fold(0, |bits, i| bits | u32::from(window[i] == byte) << i);
                prop_assert_eq!(Scalar.equal(&window, byte), expected);
            }
        }

        #[test]
        fn all_processors_compare_rows_alike(data in proptest::collection::vec(0u8..4, 3 * (WIDTH + ROW))) {
            let [upper, lower, bytes] = data.as_chunks::<{ WIDTH + ROW }>().0 else { unreachable!() };
            let bytes: &[u8; ROW] = bytes.first_chunk().unwrap();
            let upper_half = upper.first_chunk().unwrap();
            let lower_half = lower.first_chunk().unwrap();

            // The plain reference: byte by byte.
            let in_window = |window: &[u8], at: usize, width: usize| {
                (0..width).fold(0, |bits, i| bits | u64::from(window[at + i] == bytes[at]) << i)
            };
            let expected = std::array::from_fn(|at| {
                in_window(upper, at, WIDTH) << WIDTH | in_window(lower, at, WIDTH)
            });
            let half = WIDTH / 2;
            let expected_in_halves = std::array::from_fn(|at| {
                (in_window(upper, at, half) << half | in_window(lower, at, half)) as u32
            });

            let windows = Windows { upper, lower, upper_half, lower_half, bytes };
            for level in ProvenLevel::all() {
                prop_assert_eq!(dispatch_on(level, windows), (expected, expected_in_halves));
            }
        }
    }
}
