//! Depth against depth, as HoHoNet's and UniFuse's scripts.

/// Scores of one image. All are of metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthScores {
    /// How many pixels were evaluated; without any, all others are NaN.
    pub pixels: u64,
    /// How many of them were held against 10 m instead of their truth, by [`unifuse_depth`].
    pub replaced: u64,
    /// In this order: mean absolute error (m); absolute and squared error relative to the truth (AbsRel;
    /// SqRel, m); root mean square error (m), and of decimal logarithms; mean absolute error of decimal
    /// logarithms; shares of pixels whose ratio to the truth, or the truth's to them, is below 1.25, 1.25²
    /// and 1.25³.
    pub values: [f64; 9],
}

/// What [`DepthScores::values`] are called.
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

/// The farthest that is told apart, metres.
const FARTHEST: f64 = 10.0;

/// As HoHoNet: pixels whose truth is above 0 (metres; 0 is missing); truth and prediction are brought between
/// 0.01 and 10 m first. Its script has no SqRel: that is UniFuse's formula. Source: HoHoNet, `test_depth.py`,
/// `eval_metric`, which computes in 32 bits.
///
/// A prediction that is NaN makes scores NaN.
///
/// # Panics
/// If the slices are not of one length.
pub fn hohonet_depth(truth: &[f64], prediction: &[f64]) -> DepthScores {
    assert_eq!(truth.len(), prediction.len(), "a prediction a pixel");
    let pairs = truth.iter().zip(prediction).filter(|(truth, _)| **truth > 0.0);
    scores(pairs.map(|(truth, prediction)| [truth, prediction].map(|v| v.clamp(0.01, FARTHEST))))
}

/// As UniFuse: pixels whose truth is above 0 and at most 10 m (0 is missing); truth and prediction are at
/// least 0.1 m. Where a prediction is beyond 10 m the script sets the truth to 10 m, not the prediction, by
/// what must be an oversight: such pixels are counted in [`DepthScores::replaced`]. With `median_scale`
/// predictions are then scaled so that both medians are the same, the lower of two middle values being the
/// median. Source: UniFuse, `metrics.py`, `compute_depth_metrics`; the mask is that of
/// `datasets/stanford2d3d.py`.
///
/// # Panics
/// If the slices are not of one length.
pub fn unifuse_depth(truth: &[f64], prediction: &[f64], median_scale: bool) -> DepthScores {
    assert_eq!(truth.len(), prediction.len(), "a prediction a pixel");
    let valid = truth
        .iter()
        .zip(prediction)
        .filter(|(truth, _)| **truth > 0.0 && **truth <= FARTHEST);
    let mut pairs: Vec<[f64; 2]> = valid
        .map(|(t, p)| [t.max(0.1), if *p < 0.1 { 0.1 } else { *p }])
        .collect();
    let mut replaced = 0;
    for [truth, prediction] in &mut pairs {
        if *prediction > FARTHEST {
            *truth = FARTHEST;
            replaced += 1;
        }
    }
    if median_scale && !pairs.is_empty() {
        let [truth, prediction] = [0, 1].map(|i| lower_median(pairs.iter().map(|pair| pair[i]).collect()));
        let scale = truth / prediction;
        pairs.iter_mut().for_each(|[_, prediction]| *prediction *= scale);
    }
    DepthScores { replaced, ..scores(pairs.into_iter()) }
}

fn lower_median(mut values: Vec<f64>) -> f64 {
    let middle = values.len().saturating_sub(1) / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn scores(pairs: impl Iterator<Item = [f64; 2]>) -> DepthScores {
    let mut pixels = 0;
    let (mut sums, mut within) = ([0.0; 6], [0u64; 3]);
    for [truth, prediction] in pairs {
        let error = (truth - prediction).abs();
        let square = error * error;
        // The larger of both quotients, as division rounds monotonically, or NaN.
        let ratio = if truth > prediction {
            truth / prediction
        } else {
            prediction / truth
        };
        let (relative, of_logs) = (error / truth, libm::log10(ratio));
        let terms = [error, relative, square / truth, square, of_logs * of_logs, of_logs];
        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        let below = [1.25, 1.5625, 1.953125].map(|most| u64::from(ratio < most));
        within.iter_mut().zip(below).for_each(|(count, is)| *count += is);
        pixels += 1;
    }
    let [mae, abs_rel, sq_rel, square, square_of_logs, of_logs] = sums.map(|sum| sum / pixels as f64);
    let [d1, d2, d3] = within.map(|count| count as f64 / pixels as f64);
    let values = [mae, abs_rel, sq_rel, square.sqrt(), square_of_logs.sqrt(), of_logs, d1, d2, d3];
    DepthScores { pixels, replaced: 0, values }
}
