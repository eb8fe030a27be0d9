//! Numbers of pixels or voxels side by side, as the compiler makes vectors of them.
//!
//! Choices are made between numbers that are there anyway, by a factor of 1 or 0, or by [`pick`]. Of another
//! choice between computed numbers the compiler makes a branch for each lane.

use s3d_geom::ARCTANGENT;
use std::f32::consts::{FRAC_PI_2, PI};

/// As many as a vector register of AVX-512 holds: two rows of a block. With AVX2 they are faster than half as
/// many, too.
pub(crate) const LANES: usize = 16;

/// Numbers side by side.
pub(crate) type Lanes = [f32; LANES];

/// Returns the largest whole number that is not above a number from −2²² to 2²². The language's own
/// conversion, which saturates, is done lane by lane.
#[inline(always)]
pub(crate) fn floor(number: f32) -> i32 {
    // Around here, floating-point numbers are whole, and their last bits count them.
    const WHOLE: f32 = 1.5 * (1 << 23) as f32;
    let nearest = number + WHOLE;
    let count = nearest.to_bits().wrapping_sub(WHOLE.to_bits()) as i32;
    count.wrapping_sub(i32::from(nearest - WHOLE > number))
}

/// Returns one of two numbers, without a branch.
#[inline(always)]
pub(crate) fn pick(is_first: bool, first: f32, second: f32) -> f32 {
    let mask = u32::from(is_first).wrapping_neg();
    f32::from_bits(first.to_bits() & mask | second.to_bits() & !mask)
}

/// Returns the angles of (x, y) from the first axis, −π to π, with an error below 1e-6; 0 for (0, 0).
#[inline(always)]
pub(crate) fn atan2(y: &Lanes, x: &Lanes) -> Lanes {
    let mut angles = [0.0; LANES];
    for lane in 0..LANES {
        let (wide, high) = (x[lane].abs(), y[lane].abs());
        let share = wide.min(high) / wide.max(high).max(f32::MIN_POSITIVE);
        let square = share * share;
        let angle = share
            * ARCTANGENT
                .iter()
                .fold(0.0, |sum, coefficient| sum * square + coefficient);
        let angle = angle + f32::from(high > wide) * (FRAC_PI_2 - 2.0 * angle);
        let angle = angle + f32::from(x[lane] < 0.0) * (PI - 2.0 * angle);
        angles[lane] = angle.copysign(y[lane]);
    }
    angles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_library() {
        let at = |i: i32| [0.0, 1e-30, 0.3 * i as f32, 1e12][i as usize % 4];
        for (i, j) in (0..200).flat_map(|i| (0..200).map(move |j| (i, j))) {
            let (y, x) = (at(i), at(j));
            for (y, x) in [(y, x), (-y, x), (y, -x), (-y, -x)] {
                let [angle, ..] = atan2(&[y; LANES], &[x; LANES]);
                let expected = if x == 0.0 && y == 0.0 { 0.0 } else { y.atan2(x) };
                assert!((angle - expected).abs() < 1e-6, "{y} {x}: {angle} {expected}");
            }
        }
    }

    #[test]
    fn floors_are_those_of_the_language() {
        let halves = (0..200_000).map(|i| i as f32 * 0.5);
        let below = (1..100_000).map(|i| (i as f32).next_down());
        for number in halves.chain(below).chain([0.0, f32::MIN_POSITIVE, 4_194_303.5]) {
            assert_eq!(floor(number), number.floor() as i32, "{number}");
            assert_eq!(floor(-number), (-number).floor() as i32, "{number}");
        }
    }
}
