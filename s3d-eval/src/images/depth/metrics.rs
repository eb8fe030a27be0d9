//! The depth metrics of HoHoNet's and UniFuse's scripts.

use crate::images::latitude::Sums;
use std::iter::repeat;

/// The scores of one image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthScores {
    /// The number of pixels that were evaluated. If it is 0, all values are NaN.
    pub pixels: u64,
    /// The number of pixels that [`unifuse_depth`] compared with 10 m instead of their truth.
    pub replaced: u64,
    /// In this order: mean absolute error (m); absolute and squared error relative to the truth (AbsRel;
    /// SqRel, m); root mean square error (m), and the same for decimal logarithms; mean absolute error of
    /// decimal logarithms; shares of pixels with δ below 1.25, 1.25² and 1.25³, where δ is the larger of
    /// both quotients of prediction and truth.
    pub values: [f64; 9],
}

/// The names of [`DepthScores::values`].
pub const DEPTH_COLUMNS: [&str; 9] = [
    "MAE (m)",
    "AbsRel",
    "SqRel (m)",
    "RMSE (m)",
    "RMSE log10",
    "log10",
    "δ < 1.25",
    "δ < 1.25²",
    "δ < 1.25³",
];

/// The greatest distance that counts, in metres.
const FARTHEST: f64 = 10.0;

/// Returns the scores of HoHoNet. `truth` and `prediction` are in metres; a missing truth is 0.
///
/// Pixels with a truth above 0 count. Truth and prediction are clamped to 0.01 to 10 m first. A prediction
/// that is NaN makes scores NaN. HoHoNet has no SqRel: the formula is UniFuse's. Source: HoHoNet,
/// `test_depth.py`, `eval_metric`, which computes in 32 bits.
///
/// # Panics
/// If the slices have different lengths.
pub fn hohonet_depth(truth: &[f64], prediction: &[f64]) -> DepthScores {
    hohonet_depth_twice(truth, prediction, repeat(1.0))[0]
}

/// Returns the scores of [`hohonet_depth`], and the same where each pixel counts its weight.
pub(super) fn hohonet_depth_twice(
    truth: &[f64],
    prediction: &[f64],
    weights: impl Iterator<Item = f64>,
) -> [DepthScores; 2] {
    assert_eq!(truth.len(), prediction.len(), "a prediction a pixel");
    let pixels = truth.iter().zip(prediction).zip(weights);
    let valid = pixels.filter(|((truth, _), _)| **truth > 0.0);
    scores(
        valid.map(|((truth, prediction), weight)| {
            ([truth, prediction].map(|v| v.clamp(0.01, FARTHEST)), weight)
        }),
    )
}

/// Returns the scores of UniFuse. `truth` and `prediction` are in metres; a missing truth is 0.
///
/// Pixels with a truth above 0 and at most 10 m count. Truth and prediction are raised to 0.1 m first. Where
/// a prediction is beyond 10 m, the script sets the truth to 10 m instead of the prediction, which must be an
/// oversight: [`DepthScores::replaced`] counts these pixels. With `median_scale`, predictions are then scaled
/// so that both medians are the same. The lower of two middle values is the median.
///
/// Source: UniFuse, `metrics.py`, `compute_depth_metrics`; the mask is in `datasets/stanford2d3d.py`.
///
/// # Panics
/// If the slices have different lengths.
pub fn unifuse_depth(truth: &[f64], prediction: &[f64], median_scale: bool) -> DepthScores {
    unifuse_depth_twice(truth, prediction, median_scale, repeat(1.0))[0]
}

/// Returns the scores of [`unifuse_depth`], and the same where each pixel counts its weight, except for the
/// medians.
pub(super) fn unifuse_depth_twice(
    truth: &[f64],
    prediction: &[f64],
    median_scale: bool,
    weights: impl Iterator<Item = f64>,
) -> [DepthScores; 2] {
    assert_eq!(truth.len(), prediction.len(), "a prediction a pixel");
    let pixels = truth.iter().zip(prediction).zip(weights);
    let valid = pixels.filter(|((truth, _), _)| **truth > 0.0 && **truth <= FARTHEST);
    let mut pairs: Vec<([f64; 2], f64)> = valid
        .map(|((t, p), weight)| ([t.max(0.1), if *p < 0.1 { 0.1 } else { *p }], weight))
        .collect();

    let mut replaced = 0;
    for ([truth, prediction], _) in &mut pairs {
        if *prediction > FARTHEST {
            *truth = FARTHEST;
            replaced += 1;
        }
    }

    if median_scale && !pairs.is_empty() {
        let [truth, prediction] =
            [0, 1].map(|i| lower_median(pairs.iter().map(|(pair, _)| pair[i]).collect()));
        let scale = truth / prediction;
        pairs.iter_mut().for_each(|([_, prediction], _)| *prediction *= scale);
    }
    scores(pairs.into_iter()).map(|scores| DepthScores { replaced, ..scores })
}

fn lower_median(mut values: Vec<f64>) -> f64 {
    let middle = values.len().saturating_sub(1) / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Returns the scores of pairs of truth and prediction, and the same where each pair counts its weight.
fn scores(pairs: impl Iterator<Item = ([f64; 2], f64)>) -> [DepthScores; 2] {
    let mut pixels = 0;
    let mut sums = [Sums::EMPTY; 2];
    for ([truth, prediction], weight) in pairs {
        let error = (truth - prediction).abs();
        let square = error * error;
        let ratio = ratio(truth, prediction);
        let of_logs = libm::log10(ratio);
        let [d1, d2, d3] = within(ratio);
        let terms = [error, error / truth, square / truth, square, of_logs * of_logs, of_logs, d1, d2, d3];
        sums[0].add(1.0, &terms);
        sums[1].add(weight, &terms);
        pixels += 1;
    }
    sums.map(|sums| {
        let mut values = sums.means();
        values[3..5].iter_mut().for_each(|mean| *mean = mean.sqrt());
        DepthScores { pixels, replaced: 0, values }
    })
}

/// Returns the larger of both quotients, since division rounds monotonically, or NaN.
pub(super) fn ratio(truth: f64, prediction: f64) -> f64 {
    if truth > prediction {
        truth / prediction
    } else {
        prediction / truth
    }
}

/// Returns 1 for each limit of δ above the ratio.
pub(super) fn within(ratio: f64) -> [f64; 3] {
    [1.25, 1.5625, 1.953125].map(|most| f64::from(u8::from(ratio < most)))
}
