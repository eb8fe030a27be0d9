//! Linear support vector machines.
//!
//! Dual coordinate descent: Hsieh, Chang, Lin, Keerthi and Sundararajan, "A dual coordinate descent method
//! for large-scale linear SVM" (ICML 2008), algorithm 1 with random order, without shrinking. Own code:
//! crates that were tried are slower by 4 to 1,000 times, or bind C++.

pub mod sparse;

use crate::svm::sparse::{SparseRows, dot};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// What a margin below 1 costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// max(0, 1 − margin), called L1-loss.
    Hinge,
    /// Its square, called L2-loss.
    SquaredHinge,
}

/// How a machine is trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SvmOptions {
    /// What a margin below 1 costs.
    pub loss: Loss,
    /// Ends when projected gradients of a pass differ by less.
    pub tolerance: f64,
    /// Ends after so many passes over the examples at the latest.
    pub max_passes: u32,
    /// From which the order of the examples comes.
    pub seed: u64,
}

impl Default for SvmOptions {
    fn default() -> Self {
        Self { loss: Loss::SquaredHinge, tolerance: 0.05, max_passes: 100, seed: 0 }
    }
}

/// A linear function of a row.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Linear {
    /// A number a column.
    pub weights: Vec<f64>,
    /// Added to the product.
    pub bias: f64,
}

impl Linear {
    /// Its value.
    pub fn score(&self, row: crate::svm::sparse::SparseRow<'_>) -> f64 {
        dot(row, &self.weights) + self.bias
    }
}

/// Minimises ½(|w|² + b²) + Σ cᵢ·loss(yᵢ(w·xᵢ + b)): the bias is a weight of a column of ones, as
/// scikit-learn's `LinearSVC` has it. `positive` has yᵢ, `costs` has cᵢ, an entry a row each.
///
/// The same arguments give the same bits on every machine.
///
/// # Panics
/// If `positive` or `costs` have another length than there are rows.
pub fn train(rows: &SparseRows, positive: &[bool], costs: &[f64], options: &SvmOptions) -> Linear {
    assert!(positive.len() == rows.len() && costs.len() == rows.len(), "an entry a row");
    let mut machine = Linear { weights: vec![0.0; rows.width()], bias: 0.0 };
    let squares = |i: usize| rows.row(i).1.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>() + 1.0;
    let squares: Vec<f64> = (0..rows.len()).map(squares).collect();
    let mut alphas = vec![0.0f64; rows.len()];
    let mut order: Vec<usize> = (0..rows.len()).filter(|&i| costs[i] > 0.0).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    for _ in 0..options.max_passes {
        order.shuffle(&mut rng);
        let (mut most, mut least) = (f64::NEG_INFINITY, f64::INFINITY);
        for &i in &order {
            let (bound, diagonal) = match options.loss {
                Loss::Hinge => (costs[i], 0.0),
                Loss::SquaredHinge => (f64::INFINITY, 0.5 / costs[i]),
            };
            let sign = if positive[i] { 1.0 } else { -1.0 };
            let alpha = alphas[i];
            let gradient = sign * machine.score(rows.row(i)) - 1.0 + diagonal * alpha;
            let projected = if alpha <= 0.0 {
                gradient.min(0.0)
            } else if alpha >= bound {
                gradient.max(0.0)
            } else {
                gradient
            };
            (most, least) = (most.max(projected), least.min(projected));
            if projected != 0.0 {
                alphas[i] = (alpha - gradient / (squares[i] + diagonal)).clamp(0.0, bound);
                let step = sign * (alphas[i] - alpha);
                let (columns, values) = rows.row(i);
                for (&column, &value) in columns.iter().zip(values) {
                    machine.weights[usize::from(column)] += step * f64::from(value);
                }
                machine.bias += step;
            }
        }
        if most - least <= options.tolerance {
            break;
        }
    }
    machine
}

/// What [`train`] minimises, for a machine.
pub fn objective(machine: &Linear, rows: &SparseRows, positive: &[bool], costs: &[f64], loss: Loss) -> f64 {
    let square: f64 = machine.weights.iter().map(|w| w * w).sum::<f64>() + machine.bias * machine.bias;
    let lost = (0..rows.len()).map(|i| {
        let margin = machine.score(rows.row(i)) * if positive[i] { 1.0 } else { -1.0 };
        let short = (1.0 - margin).max(0.0);
        costs[i] * if loss == Loss::Hinge { short } else { short * short }
    });
    0.5 * square + lost.sum::<f64>()
}
