//! Intervals of scores: how much they would differ if other rooms had been scanned.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Returns the 95 % interval of each score by the percentile bootstrap (Efron and Tibshirani 1993, chapter
/// 13).
///
/// Each round draws as many units (rooms, images) as there are, with replacement. `score` returns the scores
/// of the drawn units, always in the same order. A round in which a score is NaN does not count for it; a
/// score that is NaN in all rounds has the interval NaN to NaN. The result is the same for any number of
/// threads.
pub fn bootstrap<T: Sync>(
    units: &[T],
    rounds: u32,
    seed: u64,
    score: impl Fn(&[&T]) -> Vec<f64> + Sync,
) -> Vec<[f64; 2]> {
    intervals(&draw(units, rounds, seed, score))
}

/// Returns the scores of each round of [`bootstrap`]. The same seed and number of units draw the same units.
pub(crate) fn draw<T: Sync>(
    units: &[T],
    rounds: u32,
    seed: u64,
    score: impl Fn(&[&T]) -> Vec<f64> + Sync,
) -> Vec<Vec<f64>> {
    if units.is_empty() {
        return Vec::new();
    }
    (0..rounds)
        .into_par_iter()
        .map(|round| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(round.into());
            let drawn: Vec<&T> = units.iter().map(|_| &units[rng.random_range(0..units.len())]).collect();
            score(&drawn)
        })
        .collect()
}

/// Returns the 95 % interval of each score over rounds.
pub(crate) fn intervals(rounds: &[Vec<f64>]) -> Vec<[f64; 2]> {
    let count = rounds.iter().map(Vec::len).min().unwrap_or(0);
    (0..count)
        .map(|at| {
            let mut values: Vec<f64> = rounds
                .iter()
                .map(|scores| scores[at])
                .filter(|value| !value.is_nan())
                .collect();
            values.sort_unstable_by(f64::total_cmp);
            [0.025, 0.975].map(|share| quantile(&values, share))
        })
        .collect()
}

/// Interpolates linearly between the two nearest of sorted values, like numpy by default. NaN if there are
/// none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = share * last as f64;
    let below = place.floor();
    let [low, high] = [below as usize, (below as usize + 1).min(last)].map(|at| sorted[at]);
    low + place.fract() * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(units: &[&f64]) -> Vec<f64> {
        vec![units.iter().copied().sum::<f64>() / units.len() as f64, f64::NAN]
    }

    #[test]
    fn the_interval_of_a_mean_agrees_with_theory() {
        let units: Vec<f64> = (0..400).map(|i| f64::from(i % 20)).collect();
        let intervals = bootstrap(&units, 4000, 7, mean);
        // The deviation of the mean of 400 numbers, each uniform in 0 to 19.
        let expected = 1.96 * ((400.0 - 1.0) / 12.0f64).sqrt() / 20.0;
        let [low, high] = intervals[0];
        assert!((9.5 - low - expected).abs() < 0.04 && (high - 9.5 - expected).abs() < 0.04, "{intervals:?}");
        assert!(intervals[1].iter().all(|v| v.is_nan()));
        assert_eq!(intervals[0], bootstrap(&units, 4000, 7, mean)[0]);
        assert_ne!(intervals[0], bootstrap(&units, 4000, 8, mean)[0]);
        assert!(bootstrap(&[], 10, 0, mean).is_empty());
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.5), 2.0);
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.75), 3.0);
        assert_eq!(quantile(&[5.0], 0.025), 5.0);
    }
}
