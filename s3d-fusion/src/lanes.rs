//! Numbers of pixels or voxels side by side, as the compiler makes vectors of them.
//!
//! Choices are made between numbers that are there anyway, or by a factor of 1 or 0. Of a choice between
//! computed numbers the compiler makes a branch for each lane.

/// As many as a vector register of AVX2 holds.
pub(crate) const LANES: usize = 8;

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

#[cfg(test)]
mod tests {
    use super::floor;

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
