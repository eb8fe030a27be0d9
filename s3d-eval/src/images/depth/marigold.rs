//! The depth metrics of Marigold's script, for predictions that are metric or known up to scale and shift.

use crate::images::depth::metrics::{ratio, within};
use crate::images::latitude::Sums;
use std::f64::consts::LN_10;
use std::iter::repeat;

/// The depths that count, in metres: Marigold's limits of NYUv2 and ScanNet, its data sets of rooms.
const NEAREST: f64 = 1e-3;
const FARTHEST: f64 = 10.0;
/// The least disparity, per metre.
const LEAST_DISPARITY: f64 = 1e-3;

/// How predictions are brought to the truth's scale and shift before they are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alignment {
    /// They are metres, and are compared as they are.
    Metric,
    /// They are depths up to scale and shift.
    Depth,
    /// They are disparities (1 / depth) up to scale and shift.
    Disparity,
}

/// The scores of one image by Marigold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarigoldScores {
    /// The number of pixels that were evaluated. If it is 0, all values are NaN.
    pub pixels: u64,
    /// Whether there were two different predictions to align. If all are equal, they become the mean of the
    /// truth. Without any (no disparity is above 0), all depths become 10 m.
    pub is_aligned: bool,
    /// In the order of [`MARIGOLD_COLUMNS`].
    pub values: [f64; 10],
}

/// The names of [`MarigoldScores::values`]: absolute and squared error relative to the truth; root mean
/// square error, and the same for natural logarithms; mean absolute error of decimal logarithms; shares of
/// pixels with δ below each limit; root mean square error of inverse depth; 100 times the standard deviation
/// of errors of natural logarithms.
pub const MARIGOLD_COLUMNS: [&str; 10] = [
    "AbsRel",
    "SqRel (m)",
    "RMSE (m)",
    "RMSE ln",
    "log10",
    "δ < 1.25",
    "δ < 1.25²",
    "δ < 1.25³",
    "iRMSE (1/m)",
    "SILog × 100",
];

/// Whether Marigold evaluates a pixel with this true depth in metres.
pub(super) fn is_evaluated(truth: f64) -> bool {
    truth > NEAREST && truth < FARTHEST
}

/// Returns the scores of Marigold. `truth` is in metres; a missing truth is 0. `prediction` is what
/// `alignment` says.
///
/// Pixels with a truth between 0.001 and 10 m count. Predictions are aligned with the truth of these pixels
/// by least squares, disparities with 1 / truth, and only where they are above 0. An aligned disparity is at
/// least 0.001, and becomes a depth. All depths are clamped to 0.001 to 10 m.
///
/// Source: Marigold, `src/util/alignment.py`, `src/util/metric.py`, `script/depth/eval.py`, with the limits
/// of `src/dataset/nyu_dataset.py`. The script computes in 32 bits.
///
/// # Panics
/// If the slices have different lengths.
pub fn marigold_depth(truth: &[f64], prediction: &[f64], alignment: Alignment) -> MarigoldScores {
    marigold_depth_twice(truth, prediction, alignment, repeat(1.0))[0]
}

/// Returns the scores of [`marigold_depth`], and the same where each pixel counts its weight, except for the
/// alignment.
pub(super) fn marigold_depth_twice(
    truth: &[f64],
    prediction: &[f64],
    alignment: Alignment,
    weights: impl Iterator<Item = f64>,
) -> [MarigoldScores; 2] {
    assert_eq!(truth.len(), prediction.len(), "a prediction a pixel");
    let pairs = || {
        let pairs = truth.iter().copied().zip(prediction.iter().copied());
        pairs.filter(|(truth, _)| is_evaluated(*truth))
    };
    let fit = match alignment {
        Alignment::Metric => None,
        Alignment::Depth => Some(Fit::of(|| pairs().map(|(t, p)| [p, t]))),
        Alignment::Disparity => {
            Some(Fit::of(|| pairs().filter(|(_, p)| *p > 0.0).map(|(t, p)| [p, 1.0 / t])))
        }
    };
    let depth = |prediction: f64| {
        let aligned = fit.as_ref().map_or(prediction, |fit| fit.apply(prediction));
        let depth = if alignment == Alignment::Disparity {
            1.0 / aligned.max(LEAST_DISPARITY)
        } else {
            aligned
        };
        depth.clamp(NEAREST, FARTHEST)
    };

    let pixels = truth.iter().zip(prediction).zip(weights);
    let valid = pixels.filter(|((truth, _), _)| is_evaluated(**truth));
    let is_aligned = fit.as_ref().is_none_or(|fit| fit.reach > 0.0);
    scores(valid.map(|((truth, prediction), weight)| ([*truth, depth(*prediction)], weight)))
        .map(|(pixels, values)| MarigoldScores { pixels, is_aligned, values })
}

/// The line that is nearest to pairs of numbers by least squares. It is computed about the middle of the
/// pairs, where rounding does little.
struct Fit {
    /// The first number, and the largest distance of another from it.
    first: f64,
    reach: f64,
    /// The mean distance from the first, as a share of the reach.
    middle: f64,
    slope: f64,
    mean: f64,
}

impl Fit {
    /// Fits a line to pairs of a number and what it should become.
    fn of<I: Iterator<Item = [f64; 2]>>(pairs: impl Fn() -> I) -> Self {
        let first = pairs().next().map_or(0.0, |[from, _]| from);
        let reach = pairs().map(|[from, _]| (from - first).abs()).fold(0.0, f64::max);
        let mut fit = Self { first, reach, middle: 0.0, slope: 0.0, mean: 0.0 };
        let mut sums = Sums::EMPTY;
        pairs().for_each(|[from, to]| sums.add(1.0, &[fit.share(from), to]));
        let [middle, mean] = sums.means();
        if mean.is_nan() {
            return fit;
        }

        let [mut both, mut squares] = [0.0; 2];
        for [from, to] in pairs() {
            let distance = fit.share(from) - middle;
            both += distance * (to - mean);
            squares += distance * distance;
        }
        fit.middle = middle;
        fit.mean = mean;
        fit.slope = if reach > 0.0 { both / squares } else { 0.0 };
        fit
    }

    fn share(&self, from: f64) -> f64 {
        if self.reach > 0.0 {
            (from - self.first) / self.reach
        } else {
            0.0
        }
    }

    fn apply(&self, from: f64) -> f64 {
        if self.reach > 0.0 {
            self.mean + self.slope * (self.share(from) - self.middle)
        } else {
            // Of all lines through a single number, numpy's is the one with the least scale and shift.
            self.mean * ((from * self.first + 1.0) / (self.first * self.first + 1.0))
        }
    }
}

/// Returns the number of pairs of truth and prediction and their scores, and the same where each pair counts
/// its weight.
fn scores(pairs: impl Iterator<Item = ([f64; 2], f64)>) -> [(u64, [f64; 10]); 2] {
    let mut pixels = 0;
    let mut sums = [Sums::EMPTY; 2];
    for ([truth, prediction], weight) in pairs {
        let error = prediction - truth;
        let square = error * error;
        let of_logs = libm::log(prediction / truth);
        let of_inverses = 1.0 / prediction - 1.0 / truth;
        let [d1, d2, d3] = within(ratio(truth, prediction));
        let terms = [
            error.abs() / truth,
            square / truth,
            square,
            of_logs * of_logs,
            of_logs.abs() / LN_10,
            d1,
            d2,
            d3,
            of_inverses * of_inverses,
            of_logs,
        ];
        sums[0].add(1.0, &terms);
        sums[1].add(weight, &terms);
        pixels += 1;
    }
    sums.map(|sums| {
        let mut values = sums.means();
        // Rounding may bring the variance of equal errors below 0.
        values[9] = 100.0 * (values[3] - values[9] * values[9]).max(0.0).sqrt();
        for at in [2, 3, 8] {
            values[at] = values[at].sqrt();
        }
        (pixels, values)
    })
}
