//! The selection of views by score, within one pool.

use crate::stream::{stream, uniform_above_zero};
use thiserror::Error;

/// The shares of a pool that stay and go. Source: `s3d_io::formats`, "Views".
///
/// ```
/// use s3d_sample::Selection;
///
/// let paper = Selection::default();
/// assert!((paper.share() - 0.725).abs() < 1e-12);
/// assert_eq!((paper.discarded(20), paper.certain(20)), (3, 12));
/// assert!(Selection { discard: 0.6, ..paper }.check().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Selection {
    /// The share of the views that goes for having the lowest scores.
    pub discard: f64,
    /// The share of the views that stays for having the highest scores.
    pub keep: f64,
    /// The share of the remaining views that stays. They are drawn at random; higher scores are more likely.
    pub half_of_rest: f64,
}

impl Default for Selection {
    /// The shares of the paper: 15 % go, 60 % stay, and half of the remaining 25 % stay too, which makes
    /// 72.5 %. In the published data 69.3 % of the views stayed (the book's page on the paper, "Which
    /// views").
    fn default() -> Self {
        Self { discard: 0.15, keep: 0.60, half_of_rest: 0.5 }
    }
}

/// Shares that are not valid in a [`Selection`].
#[derive(Clone, Debug, Error, PartialEq)]
#[error(
    "shares {discard} to discard, {keep} to keep and {half_of_rest} of the rest: each is 0 to 1, the first \
     two at most 1 together"
)]
pub struct SelectionError {
    /// `discard`.
    pub discard: f64,
    /// `keep`.
    pub keep: f64,
    /// `half_of_rest`.
    pub half_of_rest: f64,
}

/// The numbers of views that go, stay, and are drawn from the rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Counts {
    discard: usize,
    keep: usize,
    draw: usize,
}

impl Selection {
    /// Checks the shares.
    ///
    /// # Errors
    /// [`SelectionError`] if a share is not 0 to 1, or if `discard` and `keep` are more than 1 together.
    pub fn check(&self) -> Result<(), SelectionError> {
        let &Self { discard, keep, half_of_rest } = self;
        let shares = [discard, keep, half_of_rest, discard + keep];

        // The sum of shares such as 0.15 and 0.85 may round to a little more than 1.
        let ok = shares.iter().all(|share| (0.0..=1.0 + SLACK).contains(share));
        if ok {
            Ok(())
        } else {
            Err(SelectionError { discard, keep, half_of_rest })
        }
    }

    /// Returns the whole share of a pool that stays: 0.725 by default.
    pub fn share(&self) -> f64 {
        self.keep + self.half_of_rest * (1.0 - self.discard - self.keep).max(0.0)
    }

    /// Returns how many views of a pool of `n` go for having the lowest scores. The draw from the rest leaves
    /// out more.
    pub fn discarded(&self, n: usize) -> usize {
        self.counts(n).discard
    }

    /// Returns how many views of a pool of `n` stay for having the highest scores. The draw from the rest
    /// adds more.
    pub fn certain(&self, n: usize) -> usize {
        self.counts(n).keep
    }

    fn counts(&self, n: usize) -> Counts {
        let discard = (share_of(n, self.discard).floor() as usize).min(n);
        let keep = ((share_of(n, self.keep) + 0.5).floor() as usize).min(n - discard);
        let stay = ((share_of(n, self.share()) + 0.5).floor() as usize).clamp(keep, n - discard);
        Counts { discard, keep, draw: stay - keep }
    }
}

/// The rounding error allowed in a share of a count: 0.15 · 20 counts as 3.
const SLACK: f64 = 1e-9;

fn share_of(n: usize, share: f64) -> f64 {
    share * n as f64 + SLACK
}

/// The deviation of the half-normal weight of the middle scores.
const WEIGHT_SIGMA: f64 = 0.5;

/// Selects from one pool of views. Returns for each of `scores` whether its view stays.
///
/// In a pool of n views, the `discard`·n views with the lowest scores go (rounded down), and the `keep`·n
/// views with the highest scores stay (rounded to the nearest, halves up). A draw from the rest fills up to
/// [`Selection::share`]·n views (rounded likewise), so 72.5 % of any pool stay, to half a view. If two
/// scores are equal, the smaller index counts as the higher score.
///
/// The draw is without replacement. The paper says "half-normal with mean 1 and deviation ½ on the entropy
/// scaled to \[0, 1\]". We take the lower half of that normal distribution: a view of score e has the weight
/// exp(−(s − 1)² / (2·½²)), where s is e divided by the highest score of the pool. The weight is 1 at
/// s = 1 and e⁻² = 0.135 at s = 0. If all scores are 0, all weights are equal.
///
/// By the method of Efraimidis and Spirakis (2006), view i gets the key ln(uᵢ) / weightᵢ, and the views
/// with the largest keys stay. The number uᵢ, in (0, 1], comes from the i-th 64 bits of a ChaCha8 stream
/// keyed by `seed`. The result therefore does not depend on the order in which keys are computed, but it
/// depends on the index of a view. [`select_pooled`](crate::select_pooled) selects views by name instead.
///
/// # Panics
/// If a score is negative or not finite, or [`Selection::check`] fails.
///
/// ```
/// use s3d_sample::{Selection, select};
///
/// // Of ten views, the lowest score goes and the six highest stay, as does one of the three between.
/// let scores: Vec<f64> = (0..10).map(|i| 0.2 * f64::from(i)).collect();
/// let stays = select(&scores, &Selection::default(), 42);
/// assert!(!stays[0] && stays[4..].iter().all(|stays| *stays));
/// assert_eq!(stays[1..4].iter().filter(|stays| **stays).count(), 1);
/// ```
#[expect(clippy::panic, reason = "a caller's mistake: see Panics")]
pub fn select(scores: &[f64], options: &Selection, seed: u64) -> Vec<bool> {
    if let Err(error) = options.check() {
        panic!("{error}");
    }
    if let Some(i) = scores.iter().position(|s| !(s.is_finite() && *s >= 0.0)) {
        panic!("score {i} is {}: scores are finite and not negative", scores[i]);
    }

    let counts = options.counts(scores.len());
    let mut ranked: Vec<usize> = (0..scores.len()).collect();
    ranked.sort_unstable_by(|&a, &b| scores[b].total_cmp(&scores[a]).then(a.cmp(&b)));

    let mut stays = vec![false; scores.len()];
    let (top, rest) = ranked.split_at(counts.keep);
    let middle = &rest[..rest.len() - counts.discard];
    top.iter().for_each(|&i| stays[i] = true);

    // The draw from the middle.
    let highest = ranked.first().map_or(0.0, |&i| scores[i]);
    let mut rng = stream(*b"pick", seed, "", 0);
    let uniforms: Vec<f64> = scores.iter().map(|_| uniform_above_zero(&mut rng)).collect();
    let mut drawn: Vec<(f64, usize)> = middle
        .iter()
        .map(|&i| (libm::log(uniforms[i]) / weight(scores[i], highest), i))
        .collect();
    drawn.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    drawn[..counts.draw].iter().for_each(|&(_, i)| stays[i] = true);

    stays
}

fn weight(score: f64, highest: f64) -> f64 {
    let scaled = if highest > 0.0 { score / highest } else { 0.0 };
    let deviations = (scaled - 1.0) / WEIGHT_SIGMA;
    libm::exp(-0.5 * deviations * deviations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn kept(stays: &[bool]) -> usize {
        stays.iter().filter(|&&s| s).count()
    }

    fn counts_of(n: usize) -> (usize, usize, usize) {
        let c = Selection::default().counts(n);
        (c.discard, c.keep, c.draw)
    }

    #[test]
    fn counts_of_small_and_usual_pools() {
        let small = [(0, 0, 0), (0, 1, 0), (0, 1, 0), (0, 2, 0), (0, 2, 1), (0, 3, 1), (0, 4, 0), (1, 4, 1)];
        assert_eq!((0..8).map(counts_of).collect::<Vec<_>>(), small);
        assert_eq!(counts_of(20), (3, 12, 3));
        assert_eq!(counts_of(72), (10, 43, 9));
        assert_eq!(counts_of(100), (15, 60, 13));
        assert_eq!(counts_of(1413 * 72), (15_260, 61_042, 12_717));
    }

    #[test]
    fn shares_hold_for_every_pool_size() {
        for n in 0..600 {
            let scores: Vec<f64> = (0..n).map(|i| ((i * 7919) % 601) as f64 / 300.0).collect();
            let stays = select(&scores, &Selection::default(), 5);
            assert_eq!(stays.len(), n);
            assert!((kept(&stays) as f64 - 0.725 * n as f64).abs() <= 0.5 + 1e-6, "{n}");
            assert_eq!(Selection::default().discarded(n), (0.15 * n as f64 + 1e-9) as usize);
            let mut ranked: Vec<usize> = (0..n).collect();
            ranked.sort_by(|&a, &b| scores[b].partial_cmp(&scores[a]).unwrap().then(a.cmp(&b)));
            let top = (0.6 * n as f64 + 0.5 + 1e-9) as usize;
            let bottom = n - (0.15 * n as f64 + 1e-9) as usize;
            assert!(ranked[..top].iter().all(|&i| stays[i]), "{n}");
            assert!(!ranked[bottom..].iter().any(|&i| stays[i]), "{n}");
        }
    }

    #[test]
    fn equal_scores_go_by_index() {
        for score in [0.0, 1.5] {
            let stays = select(&[score; 100], &Selection::default(), 1);
            assert!(stays[..60].iter().all(|&s| s) && !stays[85..].iter().any(|&s| s));
            assert_eq!(kept(&stays[60..85]), 13);
        }
        assert_eq!(select(&[], &Selection::default(), 1), []);
        assert_eq!(select(&[0.0], &Selection::default(), 1), [true]);
        assert_eq!(select(&[0.0, 2.0], &Selection::default(), 1), [false, true]);
        assert_eq!(select(&[0.0, 2.0, 1.0], &Selection::default(), 1), [false, true, true]);
    }

    /// The plain reference: the probability of each item to be among `draw` items that are drawn one after
    /// the other, each in proportion to the weights of the items left.
    fn inclusion(weights: &[f64], draw: usize) -> Vec<f64> {
        fn go(weights: &[f64], taken: &mut Vec<usize>, draw: usize, p: f64, out: &mut [f64]) {
            if draw == 0 {
                return taken.iter().for_each(|&i| out[i] += p);
            }
            let left: f64 = (0..weights.len())
                .filter(|i| !taken.contains(i))
                .map(|i| weights[i])
                .sum();
            for i in 0..weights.len() {
                if !taken.contains(&i) {
                    taken.push(i);
                    go(weights, taken, draw - 1, p * weights[i] / left, out);
                    taken.pop();
                }
            }
        }

        let mut out = vec![0.0; weights.len()];
        go(weights, &mut Vec::new(), draw, 1.0, &mut out);
        out
    }

    #[test]
    fn the_middle_is_drawn_as_one_after_the_other() {
        // 20 views. Ranks 12 to 16 are the middle, and 3 of its 5 views stay.
        let mut scores = vec![2.0; 12];
        scores.extend([1.9, 1.4, 0.9, 0.4, 0.1]);
        scores.extend([0.0; 3]);
        let weights: Vec<f64> = scores[12..17]
            .iter()
            .map(|e| f64::exp(-(e / 2.0 - 1.0f64).powi(2) / 0.5))
            .collect();
        let expected = inclusion(&weights, 3);

        let seeds = 20_000;
        let mut counts = [0u32; 5];
        for seed in 0..seeds {
            let stays = select(&scores, &Selection::default(), seed);
            assert_eq!(kept(&stays), 15);
            (0..5).for_each(|i| counts[i] += u32::from(stays[12 + i]));
        }

        for (&count, &p) in counts.iter().zip(&expected) {
            let deviation = (p * (1.0 - p) * seeds as f64).sqrt();
            let off = (f64::from(count) - p * seeds as f64) / deviation;
            assert!(off.abs() < 4.0, "{count} of {seeds}, expected {p}");
        }
        assert!(counts.is_sorted_by(|a, b| a > b), "{counts:?}");
    }

    #[test]
    fn higher_scores_of_the_middle_stay_more_often() {
        let scores: Vec<f64> = (0..1000).map(f64::from).collect();
        let mut lower = 0;
        let mut upper = 0;
        for seed in 0..50 {
            let stays = select(&scores, &Selection::default(), seed);
            lower += kept(&stays[150..275]);
            upper += kept(&stays[275..400]);
        }
        assert_eq!(lower + upper, 50 * 125);
        // With equal weights each would be 3125, with a deviation below 40.
        assert!(upper > 3125 + 160, "{upper}");
    }

    #[test]
    fn other_shares_are_possible() {
        let all = Selection { discard: 0.0, keep: 1.0, half_of_rest: 0.0 };
        assert_eq!(kept(&select(&[1.0; 33], &all, 0)), 33);
        let none = Selection { discard: 1.0, keep: 0.0, half_of_rest: 1.0 };
        assert_eq!(kept(&select(&[1.0; 33], &none, 0)), 0);
        let edge = Selection { discard: 0.15, keep: 0.85, half_of_rest: 0.5 };
        assert_eq!((edge.check(), kept(&select(&[1.0; 40], &edge, 0))), (Ok(()), 34));
        for wrong in [
            Selection { discard: 0.5, keep: 0.6, half_of_rest: 0.5 },
            Selection { discard: -0.1, keep: 0.6, half_of_rest: 0.5 },
            Selection { discard: 0.1, keep: f64::NAN, half_of_rest: 0.5 },
            Selection { discard: 0.1, keep: 0.1, half_of_rest: 1.5 },
        ] {
            let message = wrong.check().unwrap_err().to_string();
            assert!(message.contains(&format!("{} to keep", wrong.keep)), "{message}");
        }
    }

    #[test]
    #[should_panic(expected = "score 1 is NaN")]
    fn a_score_that_is_no_number_is_a_callers_mistake() {
        select(&[1.0, f64::NAN], &Selection::default(), 0);
    }

    #[test]
    fn a_draw_is_the_same_for_ever() {
        let scores: Vec<f64> = (0..72).map(|i| f64::from(i * 29 % 72) / 30.0).collect();
        let stays = select(&scores, &Selection::default(), 42);
        let drawn: Vec<i32> = (0..72).filter(|&i| stays[i as usize] && i * 29 % 72 < 29).collect();
        // Computed by a second program, from the description of `select`.
        assert_eq!(drawn, [8, 13, 28, 53, 55, 58, 63, 68, 70]);
        assert_ne!(select(&scores, &Selection::default(), 43), stays);
    }

    proptest! {
        #[test]
        fn any_pool_keeps_its_shares(
            scores in prop::collection::vec(prop_oneof![Just(0.0), 0f64..2.6], 0..200),
            discard in 0f64..=1.0, keep in 0f64..=1.0, half in 0f64..=1.0, seed: u64,
        ) {
            let options = Selection { discard, keep: keep * (1.0 - discard), half_of_rest: half };
            let stays = select(&scores, &options, seed);
            let counts = options.counts(scores.len());
            prop_assert_eq!(kept(&stays), counts.keep + counts.draw);
            prop_assert_eq!(&select(&scores, &options, seed), &stays);

            // None of the lowest scores stays, and none of the highest goes.
            let mut sorted = scores.clone();
            sorted.sort_by(f64::total_cmp);
            for (score, stays) in scores.iter().zip(&stays) {
                if *stays && counts.discard > 0 {
                    prop_assert!(*score >= sorted[counts.discard - 1]);
                }
                if !*stays && counts.keep > 0 {
                    prop_assert!(*score <= sorted[scores.len() - counts.keep]);
                }
            }
        }
    }
}
