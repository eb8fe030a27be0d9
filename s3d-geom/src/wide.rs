//! Wider registers, if the processor has them.

use s3d_simd::{dispatch, level};

/// A calculation whose loops the compiler may vectorise. `run` and the functions that it calls in loops are
/// `#[inline(always)]`, so they are compiled twice: for any processor of the target, and for AVX2.
pub(crate) trait Kernel {
    type Output;
    fn run(self) -> Self::Output;
}

/// Runs `kernel`, compiled for AVX2 if that is in use. The result is the same at every width, because
/// products and sums are not fused.
pub(crate) fn run<K: Kernel>(kernel: K) -> K::Output {
    dispatch!(level().without_avx512(), _simd => kernel.run())
}

/// Returns the larger number, or `b` if one is NaN. Unlike [`f32::max`], this is a single instruction.
#[cfg(feature = "nearest")]
#[inline(always)]
pub(crate) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Returns the smaller number, or `b` if one is NaN.
#[cfg(feature = "nearest")]
#[inline(always)]
pub(crate) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Returns the lanes whose value is at most `bound`, as bits.
#[cfg(feature = "nearest")]
#[inline(always)]
pub(crate) fn at_most(values: &[f32; 8], bound: f32) -> u32 {
    let mut bits = [0; 8];
    for lane in 0..8 {
        bits[lane] = if values[lane] <= bound { 1 << lane } else { 0 };
    }
    bits.iter().sum()
}

/// Returns the smallest value. None may be NaN.
#[cfg(feature = "nearest")]
#[inline(always)]
pub(crate) fn least(values: &[f32; 8]) -> f32 {
    let mut four = [0.0; 4];
    for lane in 0..4 {
        four[lane] = min(values[lane], values[lane + 4]);
    }
    min(min(four[0], four[2]), min(four[1], four[3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_and_the_least() {
        let values = [3.0, 1.0, f32::INFINITY, 2.0, 8.0, 0.5, f32::NAN, 2.0];
        assert_eq!(at_most(&values, 2.0), 0b1010_1010);
        assert_eq!(at_most(&values, f32::INFINITY), 0b1011_1111);
        for at in 0..8 {
            let mut values = [7.0; 8];
            values[at] = -1.0;
            assert_eq!(least(&values), -1.0);
        }
    }
}
