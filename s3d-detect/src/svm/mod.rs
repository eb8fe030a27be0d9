//! Linear support vector machines.
//!
//! They are trained by dual coordinate descent: algorithm 1 of Hsieh, Chang, Lin, Keerthi and Sundararajan,
//! "A dual coordinate descent method for large-scale linear SVM" (ICML 2008), in random order, without
//! shrinking. The code is our own because the crates that were tried are 4 to 1,000 times slower, or bind
//! C++.

pub mod sparse;

use crate::svm::sparse::{SparseRow, SparseRows, dot};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// The cost of a margin below 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// max(0, 1 − margin), also called L1-loss.
    Hinge,
    /// The square of the hinge, also called L2-loss.
    SquaredHinge,
}

/// How a machine is trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SvmOptions {
    /// The cost of a margin below 1.
    pub loss: Loss,
    /// Training ends when the projected gradients of a pass differ by less than this.
    pub tolerance: f64,
    /// Training ends after this number of passes over the examples at the latest.
    pub max_passes: u32,
    /// Decides the order of the examples.
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
    /// A weight for each column.
    pub weights: Vec<f64>,
    /// Added to the product.
    pub bias: f64,
}

impl Linear {
    /// Returns its value for a row.
    pub fn score(&self, row: SparseRow<'_>) -> f64 {
        dot(row, &self.weights) + self.bias
    }
}

/// Minimises ½(|w|² + b²) + Σ cᵢ·loss(yᵢ(w·xᵢ + b)). The bias is the weight of a column of ones,
/// as in scikit-learn's `LinearSVC`. `positive` holds yᵢ and `costs` holds cᵢ, an entry for each row.
///
/// The same arguments give the same bits on every computer.
///
/// # Panics
/// If `positive` or `costs` has not an entry for each row.
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
        let mut most = f64::NEG_INFINITY;
        let mut least = f64::INFINITY;
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
            most = most.max(projected);
            least = least.min(projected);

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

/// Returns the value that [`train`] minimises, for a machine.
pub fn objective(machine: &Linear, rows: &SparseRows, positive: &[bool], costs: &[f64], loss: Loss) -> f64 {
    let square: f64 = machine.weights.iter().map(|w| w * w).sum::<f64>() + machine.bias * machine.bias;
    let lost = (0..rows.len()).map(|i| {
        let margin = machine.score(rows.row(i)) * if positive[i] { 1.0 } else { -1.0 };
        let short = (1.0 - margin).max(0.0);
        costs[i] * if loss == Loss::Hinge { short } else { short * short }
    });
    0.5 * square + lost.sum::<f64>()
}
