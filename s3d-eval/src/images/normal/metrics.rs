//! The metrics of surface normals of DSINE's and Omnidata's scripts.

use crate::images::latitude::Sums;
use std::f64::consts::PI;

/// Returns the angle between two vectors by DSINE, in degrees. Each vector is divided by its length, at least
/// 1e-8, so that the angle to a vector of no length is 90°.
///
/// Source: DSINE, `utils/utils.py`, `compute_normal_error`, and PyTorch's `cosine_similarity` since 1.13. The
/// script computes in 32 bits, where angles below 0.03° may become 0° by chance.
pub fn dsine_angle(truth: [f64; 3], prediction: [f64; 3]) -> f64 {
    degrees(dsine_cosine(truth, prediction))
}

/// Returns the cosine of [`dsine_angle`].
pub(crate) fn dsine_cosine(truth: [f64; 3], prediction: [f64; 3]) -> f64 {
    dot(unit(prediction), unit(truth))
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt().max(1e-8);
    v.map(|c| c / length)
}

/// Returns the angle between two vectors by Omnidata, in degrees. The dot product is divided by the product
/// of the lengths, at least 1e-8. Source: Omnidata, `paper_code/evaluation_metrics.py`, `get_metrics`, which
/// computes in 64 bits.
pub fn omnidata_angle(truth: [f64; 3], prediction: [f64; 3]) -> f64 {
    degrees(omnidata_cosine(truth, prediction))
}

/// Returns the cosine of [`omnidata_angle`].
pub(crate) fn omnidata_cosine(truth: [f64; 3], prediction: [f64; 3]) -> f64 {
    let lengths = dot(prediction, prediction).sqrt() * dot(truth, truth).sqrt();
    dot(prediction, truth) / lengths.max(1e-8)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the angle of a cosine, in degrees. Rounding may have brought the cosine beyond 1.
pub(crate) fn degrees(cosine: f64) -> f64 {
    libm::acos(cosine.clamp(-1.0, 1.0)) * 180.0 / PI
}

/// The limits of [`AngleSums::below`], in degrees.
pub const DSINE_LIMITS: [f64; 5] = [5.0, 7.5, 11.25, 22.5, 30.0];

/// The sums over the angles of any number of images that DSINE's scores need. Only the median needs the
/// angles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AngleSums {
    /// The number of angles.
    pub pixels: u64,
    /// The sum of the angles, in degrees.
    pub sum: f64,
    /// The sum of their squares.
    pub squares: f64,
    /// The number of angles below each of [`DSINE_LIMITS`].
    pub below: [u64; 5],
}

impl AngleSums {
    /// Sums angles in degrees.
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

    /// Adds the sums of other images.
    pub fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.sum += other.sum;
        self.squares += other.squares;
        self.below.iter_mut().zip(other.below).for_each(|(n, more)| *n += more);
    }

    /// Returns the mean and the root mean square in degrees, and the shares below each limit in per cent. NaN
    /// without angles. Source: DSINE, `utils/utils.py`, `compute_normal_metrics`.
    pub fn mean_rmse_below(&self) -> ([f64; 2], [f64; 5]) {
        let n = self.pixels as f64;
        ([self.sum / n, (self.squares / n).sqrt()], self.below.map(|below| 100.0 * (below as f64 / n)))
    }
}

/// Returns Omnidata's scores of one image: the mean and the median of its angles in degrees, and the shares
/// (0 to 1) of angles of at most 11.25°, 22.5° and 30°. `None` without an angle. Changes the order of the
/// angles. Source: Omnidata, `paper_code/evaluation_metrics.py`, `get_metrics`.
pub fn omnidata_scores(angles: &mut [f64]) -> Option<[f64; 5]> {
    let n = angles.len() as f64;
    let mean = angles.iter().sum::<f64>() / n;
    let [a, b, c] =
        [11.25, 22.5, 30.0].map(|limit| angles.iter().filter(|angle| **angle <= limit).count() as f64 / n);
    Some([mean, median_of_angles(angles)?, a, b, c])
}

/// Returns the middle angle, or the mean of both middle angles; `None` without angles. Changes their order.
pub fn median_of_angles(values: &mut [f64]) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    let (below, &mut high, _) = values.select_nth_unstable_by(values.len() / 2, f64::total_cmp);
    Some(if last % 2 == 0 {
        high
    } else {
        (below.iter().copied().fold(f64::MIN, f64::max) + high) / 2.0
    })
}

/// Returns the scores of [`omnidata_scores`] where each angle counts its weight. The median is the least
/// angle up to which half of the weight lies. Changes the order.
pub(crate) fn weighted_omnidata_scores(angles: &mut [(f64, f64)]) -> Option<[f64; 5]> {
    let mut sums = Sums::EMPTY;
    for &(angle, weight) in &*angles {
        let [a, b, c] = [11.25, 22.5, 30.0].map(|limit| f64::from(u8::from(angle <= limit)));
        sums.add(weight, &[angle, a, b, c]);
    }
    let [mean, a, b, c] = sums.means();
    Some([mean, weighted_median(angles)?, a, b, c])
}

/// Returns the least value up to which half of the weight lies; `None` without values. Changes the order of
/// the pairs of value and weight.
fn weighted_median(mut pairs: &mut [(f64, f64)]) -> Option<f64> {
    let weigh = |pairs: &[(f64, f64)]| pairs.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut missing = weigh(pairs) / 2.0;
    while pairs.len() > 1 {
        let middle = pairs.len() / 2;
        pairs.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0));
        let (below, above) = pairs.split_at_mut(middle);
        let weight = weigh(below);
        if weight >= missing {
            pairs = below;
        } else {
            missing -= weight;
            pairs = above;
        }
    }
    pairs.first().map(|(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_have_half_of_the_weight_below() {
        let median = |pairs: &[(f64, f64)]| weighted_median(&mut pairs.to_vec());
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[(3.0, 0.1)]), Some(3.0));
        assert_eq!(median(&[(3.0, 1.0), (1.0, 1.0), (2.0, 1.0)]), Some(2.0));
        assert_eq!(median(&[(3.0, 1.0), (1.0, 1.0)]), Some(1.0));
        assert_eq!(median(&[(5.0, 4.0), (1.0, 1.0), (2.0, 1.0), (3.0, 1.0)]), Some(5.0));
        assert_eq!(median(&[(1.0, 5.0), (5.0, 1.0), (2.0, 1.0), (3.0, 1.0), (4.0, 1.0)]), Some(1.0));
        let scores = weighted_omnidata_scores(&mut [(10.0, 3.0), (20.0, 1.0)]);
        assert_eq!(scores, Some([12.5, 10.0, 0.75, 1.0, 1.0]));
    }
}
