//! Scores of panoramas in which each pixel counts by its solid angle. Their rows near the poles show little.

use crate::tables::{Rows, Scores, Unit, only_tables};
use crate::task::Task;
use std::f64::consts::PI;
use std::iter::repeat_n;

/// The sentence of definitions on the tables of [`tables_by_latitude`].
pub(super) const BY_LATITUDE: &str = "Tables weighted by latitude are of the same pixels, and each counts \
     the cosine of the latitude of its row's middle, at the size of the evaluation.";

/// Returns what a pixel of each row of a panorama counts, from the uppermost row on: the cosine of the
/// latitude of the row's middle.
pub fn latitude_weights(height: u32) -> Vec<f64> {
    let row = PI / f64::from(height);
    (0..height).map(|y| libm::sin((f64::from(y) + 0.5) * row)).collect()
}

/// Returns [`latitude_weights`] of the pixels of a panorama of this width and height, row by row.
pub(super) fn weights_of_pixels([width, height]: [u32; 2]) -> impl Iterator<Item = f64> {
    latitude_weights(height)
        .into_iter()
        .flat_map(move |weight| repeat_n(weight, width as usize))
}

/// Makes the tables of scores that are weighted by latitude, which are called so.
pub(super) fn tables_by_latitude<T: Sync>(
    task: &Task<'_>,
    columns: &[&str],
    units: &[Unit<T>],
    score: impl Fn(&[&T]) -> Rows + Sync,
) -> Scores {
    let mut made = only_tables(task, columns, units, score);
    made.tables
        .iter_mut()
        .for_each(|table| table.title.push_str(", weighted by latitude"));
    made
}

/// Sums of terms over pixels, each multiplied by what its pixel counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums<const N: usize> {
    weight: f64,
    terms: [f64; N],
}

impl<const N: usize> Sums<N> {
    pub(super) const EMPTY: Self = Self { weight: 0.0, terms: [0.0; N] };

    /// Adds the terms of a pixel that counts `weight`.
    pub(super) fn add(&mut self, weight: f64, terms: &[f64; N]) {
        self.weight += weight;
        self.terms
            .iter_mut()
            .zip(terms)
            .for_each(|(sum, term)| *sum += weight * term);
    }

    /// Adds the sums of other pixels.
    pub(super) fn add_sums(&mut self, other: &Self) {
        self.weight += other.weight;
        self.terms
            .iter_mut()
            .zip(other.terms)
            .for_each(|(sum, more)| *sum += more);
    }

    /// Returns the mean of each term. NaN without a pixel.
    pub(super) fn means(&self) -> [f64; N] {
        self.terms.map(|sum| sum / self.weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_solid_angles() {
        let weights = latitude_weights(512);
        assert_eq!(weights.len(), 512);
        assert!((weights[255] - 1.0).abs() < 1e-5 && (weights[0] - 0.003_068).abs() < 1e-6);
        // All pixels together see the whole sphere.
        let sphere: f64 = weights_of_pixels([1024, 512]).sum::<f64>() * (2.0 * PI / 1024.0) * (PI / 512.0);
        assert!((sphere / (4.0 * PI) - 1.0).abs() < 1e-5, "{sphere}");
    }
}
