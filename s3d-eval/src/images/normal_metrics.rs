//! Angles between surface normals, as DSINE's and Omnidata's scripts.

use std::f64::consts::PI;

/// The angle between two vectors, degrees, as DSINE: each is divided by its length, at least 1e-8, so that
/// the angle to a vector of no length is 90°. Source: DSINE, `utils/utils.py`, `compute_normal_error`, and
/// PyTorch's `cosine_similarity` since 1.13; the script computes in 32 bits, in which angles below 0.03°
/// are told apart from 0° by chance.
pub fn dsine_angle(truth: [f64; 3], prediction: [f64; 3]) -> f64 {
    degrees(dsine_cosine(truth, prediction))
}

/// The cosine of [`dsine_angle`].
pub(crate) fn dsine_cosine(truth: [f64; 3], prediction: [f64; 3]) -> f64 {
    let unit = |v: [f64; 3]| {
        let length = dot(v, v).sqrt().max(1e-8);
        v.map(|c| c / length)
    };
    dot(unit(prediction), unit(truth))
}

/// The same as Omnidata: the product is divided by that of the lengths, at least 1e-8. Source: Omnidata,
/// `paper_code/evaluation_metrics.py`, `get_metrics`, which computes in 64 bits.
pub fn omnidata_angle(truth: [f64; 3], prediction: [f64; 3]) -> f64 {
    degrees(omnidata_cosine(truth, prediction))
}

/// The cosine of [`omnidata_angle`].
pub(crate) fn omnidata_cosine(truth: [f64; 3], prediction: [f64; 3]) -> f64 {
    let lengths = dot(prediction, prediction).sqrt() * dot(truth, truth).sqrt();
    dot(prediction, truth) / lengths.max(1e-8)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The angle of a cosine, which rounding may have brought beyond 1.
pub(crate) fn degrees(cosine: f64) -> f64 {
    libm::acos(cosine.clamp(-1.0, 1.0)) * 180.0 / PI
}

/// The limits of [`AngleSums::below`], degrees.
pub const DSINE_LIMITS: [f64; 5] = [5.0, 7.5, 11.25, 22.5, 30.0];

/// What is summed over angles of any number of images for DSINE's scores; the median needs the angles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AngleSums {
    /// How many there are.
    pub pixels: u64,
    /// Their sum, degrees.
    pub sum: f64,
    /// The sum of their squares.
    pub squares: f64,
    /// How many are below each of [`DSINE_LIMITS`].
    pub below: [u64; 5],
}

impl AngleSums {
    /// Counts angles, degrees.
    pub fn of(angles: &[f64]) -> Self {
        let mut sums = Self { pixels: angles.len() as u64, ..Self::default() };
        for &angle in angles {
            sums.sum += angle;
            sums.squares += angle * angle;
            sums.below
                .iter_mut()
                .zip(DSINE_LIMITS)
                .for_each(|(n, limit)| *n += u64::from(angle < limit));
        }
        sums
    }

    /// Adds those of other images.
    pub fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.sum += other.sum;
        self.squares += other.squares;
        self.below.iter_mut().zip(other.below).for_each(|(n, more)| *n += more);
    }

    /// Mean and root mean square, degrees, and the shares below each limit, percent; NaN of nothing. Source:
    /// DSINE, `utils/utils.py`, `compute_normal_metrics`.
    pub fn mean_rmse_below(&self) -> ([f64; 2], [f64; 5]) {
        let n = self.pixels as f64;
        ([self.sum / n, (self.squares / n).sqrt()], self.below.map(|below| 100.0 * (below as f64 / n)))
    }
}

/// Omnidata's scores of the angles of one image, degrees: their mean and median, and the shares (0 to 1) of
/// those that are at most 11.25°, 22.5° and 30°; `None` without an angle. Source: Omnidata,
/// `paper_code/evaluation_metrics.py`, `get_metrics`. The order of angles is lost.
pub fn omnidata_scores(angles: &mut [f64]) -> Option<[f64; 5]> {
    let n = angles.len() as f64;
    let mean = angles.iter().sum::<f64>() / n;
    let [a, b, c] =
        [11.25, 22.5, 30.0].map(|limit| angles.iter().filter(|angle| **angle <= limit).count() as f64 / n);
    Some([mean, median_of_angles(angles)?, a, b, c])
}

/// The middle one of angles, or the mean of both; `None` of nothing. Their order is lost.
pub fn median_of_angles(values: &mut [f64]) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    let (below, &mut high, _) = values.select_nth_unstable_by(values.len() / 2, f64::total_cmp);
    Some(if last % 2 == 0 {
        high
    } else {
        (below.iter().copied().fold(f64::MIN, f64::max) + high) / 2.0
    })
}
