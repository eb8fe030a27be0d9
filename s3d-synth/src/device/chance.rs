//! Random numbers that depend on a seed and a place alone, so that threads change nothing.

/// The random numbers of a picture or scan.
#[derive(Clone, Copy)]
pub(super) struct Chance(u64);

/// The increment and the factors of SplitMix64 (Steele, Lea and Flood 2014, "Fast splittable pseudorandom
/// number generators").
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
const FACTORS: [u64; 2] = [0xbf58_476d_1ce4_e5b9, 0x94d0_49bb_1331_11eb];

fn mixed(mut word: u64) -> u64 {
    for (factor, shift) in FACTORS.into_iter().zip([30, 27]) {
        word = (word ^ (word >> shift)).wrapping_mul(factor);
    }
    word ^ (word >> 31)
}

impl Chance {
    /// The numbers of the picture `number` of a device.
    pub(super) fn new(seed: u64, number: u64) -> Self {
        Self(mixed(mixed(seed.wrapping_add(STEP)).wrapping_add(number.wrapping_mul(STEP))))
    }

    /// Returns 64 random bits for the purpose `what` at a place.
    fn bits(self, x: u32, y: u32, what: u32) -> u64 {
        let place = (u64::from(y) << 32) | u64::from(x);
        let word = mixed(self.0 ^ place.wrapping_mul(STEP));
        mixed(word.wrapping_add(u64::from(what).wrapping_add(1).wrapping_mul(STEP)))
    }

    /// Returns a number in [0, 1).
    pub(super) fn unit(self, x: u32, y: u32, what: u32) -> f32 {
        (self.bits(x, y, what) >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Returns a number of mean 0 and deviation 1: the sum of four uniform ones, which ends at ±3.46.
    pub(super) fn normal(self, x: u32, y: u32, what: u32) -> f32 {
        let bits = self.bits(x, y, what);
        let sum: f32 = (0..4).map(|k| ((bits >> (16 * k)) & 0xffff) as f32 + 0.5).sum();
        // Four uniform numbers have the variance 4/12.
        (sum / 65_536.0 - 2.0) * 1.732_050_8
    }

    /// Returns a number of mean 0 and deviation 1 that neighbours share: normal numbers on a lattice of
    /// `spacing` pixels, bilinear between them.
    pub(super) fn smooth(self, x: u32, y: u32, spacing: f32, what: u32) -> f32 {
        if spacing <= 1.0 {
            return self.normal(x, y, what);
        }

        let at = [x, y].map(|v| v as f32 / spacing);
        let [left, top] = at.map(|v| v.floor() as u32);
        let [u, v] = at.map(|v| v - v.floor());
        let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];

        let mut sum = 0.0;
        let mut squares = 0.0;
        for (weight, (right, down)) in weights.into_iter().zip(corners) {
            sum += weight * self.normal(left + right, top + down, what);
            squares += weight * weight;
        }
        sum / squares.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean_and_deviation(values: impl Iterator<Item = f32> + Clone) -> (f64, f64) {
        let n = values.clone().count() as f64;
        let mean = values.clone().map(f64::from).sum::<f64>() / n;
        let square = values.map(|v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n;
        (mean, square.sqrt())
    }

    #[test]
    fn numbers_have_their_mean_and_deviation() {
        let chance = Chance::new(3, 8);
        let places = || (0..300).flat_map(|y| (0..300).map(move |x| (x, y)));

        let (mean, deviation) = mean_and_deviation(places().map(|(x, y)| chance.unit(x, y, 0)));
        assert!((mean - 0.5).abs() < 0.005 && (deviation - 12f64.sqrt().recip()).abs() < 0.005);
        for spacing in [1.0, 2.5, 4.0] {
            let values = places().map(|(x, y)| chance.smooth(x, y, spacing, 1));
            let (mean, deviation) = mean_and_deviation(values);
            assert!(mean.abs() < 0.04 && (deviation - 1.0).abs() < 0.03, "{spacing}: {mean} {deviation}");
        }
    }

    #[test]
    fn neighbours_share_smooth_noise_alone() {
        let chance = Chance::new(3, 8);
        let product = |spacing| {
            let at = |x, y| f64::from(chance.smooth(x, y, spacing, 1));
            let places = (0..200).flat_map(|y| (0..200).map(move |x| (x, y)));
            places.map(|(x, y)| at(x, y) * at(x + 1, y)).sum::<f64>() / 40_000.0
        };
        assert!(product(1.0).abs() < 0.03 && product(4.0) > 0.6, "{} {}", product(1.0), product(4.0));
    }

    #[test]
    fn seeds_and_pictures_differ() {
        let of = |seed, number| {
            (0..9)
                .map(|x| Chance::new(seed, number).bits(x, 0, 0))
                .collect::<Vec<_>>()
        };
        assert!(of(1, 0) == of(1, 0) && of(1, 0) != of(2, 0) && of(1, 0) != of(1, 1));
    }
}
