//! The normal equations of small motions of scans, and what they leave open.
//!
//! A motion of a scan has seven numbers: a translation, a rotation about the middle of the scan, and how much
//! the scan grows about it. A system is told which of them are unknown ([`RIGID`]). A pair of points p and q,
//! with the normal n at q, has the residual n · (p − q).
//!
//! Sources: Y. Chen and G. Medioni, "Object modelling by registration of multiple range images", 1992 (point
//! to plane); J. Zhang, M. Kaess and S. Singh, "On degeneracy of optimization-based state estimation
//! problems", 2016 (steps only where the equations decide).

use s3d_geom::glam::DVec3;

/// All motions that keep lengths, among the seven numbers: three of the translation, three of the rotation.
pub(crate) const RIGID: &[usize] = &[0, 1, 2, 3, 4, 5];

/// A square matrix, symmetric, by rows.
#[derive(Clone, Debug)]
pub(super) struct Matrix {
    size: usize,
    rows: Vec<f64>,
}

impl Matrix {
    fn zero(size: usize) -> Self {
        Self { size, rows: vec![0.0; size * size] }
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.rows[row * self.size + column]
    }

    fn at_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.rows[row * self.size + column]
    }
}

/// The equations for the scans that may move.
pub(crate) struct System {
    /// Which of the seven numbers of a motion are unknown.
    unknown: &'static [usize],
    /// The sums of weighted squares of the motions along the normals.
    along: Matrix,
    /// The sums of weighted squares of the motions between the two points of each pair.
    total: Matrix,
    right: Vec<f64>,
}

/// How one point of a pair moves with its scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arm {
    /// The place of the scan among those that may move; `None` if it stays.
    pub(crate) place: Option<usize>,
    /// From the middle of the scan to the point, metres.
    pub(crate) arm: DVec3,
}

/// A direction that the equations do not decide: the unknown numbers of each scan that may move.
pub(crate) struct Open {
    /// The mean squared share of the motion along the normals, 0 to 1.
    pub(crate) share: f64,
    pub(crate) motion: Vec<f64>,
}

impl System {
    /// The equations of so many scans that may move by the `unknown` ones of the seven numbers.
    pub(crate) fn new(scans: usize, unknown: &'static [usize]) -> Self {
        let size = unknown.len() * scans;
        Self { unknown, along: Matrix::zero(size), total: Matrix::zero(size), right: vec![0.0; size] }
    }

    /// Adds a pair of points. The first one moves with `arms[0]`, the second one and its normal with
    /// `arms[1]`.
    pub(crate) fn add(&mut self, arms: [Arm; 2], normal: DVec3, residual: f64, weight: f64) {
        let signs = [1.0, -1.0];
        // The motion of a point, one row per axis, and its part along the normal.
        let rows = arms.map(|Arm { arm, .. }| {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z, normal];
            axes.map(|axis| {
                let turn = arm.cross(axis);
                [axis.x, axis.y, axis.z, turn.x, turn.y, turn.z, arm.dot(axis)]
            })
        });
        let count = self.unknown.len();

        for i in 0..2 {
            let Some(first) = arms[i].place else { continue };
            let right = &mut self.right[count * first..count * (first + 1)];
            for (sum, &a) in right.iter_mut().zip(self.unknown) {
                *sum -= weight * signs[i] * rows[i][3][a] * residual;
            }
            for j in 0..2 {
                let Some(second) = arms[j].place else { continue };
                let factor = weight * signs[i] * signs[j];
                for (at, &a) in self.unknown.iter().enumerate() {
                    for (to, &b) in self.unknown.iter().enumerate() {
                        let (row, column) = (count * first + at, count * second + to);
                        *self.along.at_mut(row, column) += factor * rows[i][3][a] * rows[j][3][b];
                        let total = (0..3).map(|axis| rows[i][axis][a] * rows[j][axis][b]).sum::<f64>();
                        *self.total.at_mut(row, column) += factor * total;
                    }
                }
            }
        }
    }

    /// The step with the least residuals, and the directions in which it does nothing, since less than
    /// `least_share` of their motion is along normals.
    pub(crate) fn solve(&self, least_share: f64) -> (Vec<f64>, Vec<Open>) {
        let size = self.right.len();
        let mut step = vec![0.0; size];
        let Some(lower) = cholesky(&self.total) else {
            return (step, Vec::new());
        };

        // In coordinates in which all motions are equally large, eigenvalues are shares.
        let mut scaled = Matrix::zero(size);
        for column in 0..size {
            let mut values: Vec<f64> = (0..size).map(|row| self.along.at(row, column)).collect();
            forward(&lower, &mut values);
            (0..size).for_each(|row| *scaled.at_mut(row, column) = values[row]);
        }
        for row in 0..size {
            let mut values = scaled.rows[row * size..(row + 1) * size].to_vec();
            forward(&lower, &mut values);
            scaled.rows[row * size..(row + 1) * size].copy_from_slice(&values);
        }

        let mut open = Vec::new();
        for (share, mut motion) in eigen(scaled) {
            backward(&lower, &mut motion);
            if share < least_share {
                open.push(Open { share: share.max(0.0), motion });
                continue;
            }
            let amount = motion.iter().zip(&self.right).map(|(m, r)| m * r).sum::<f64>() / share;
            step.iter_mut().zip(&motion).for_each(|(s, m)| *s += amount * m);
        }
        (step, open)
    }
}

/// The lower factor L of `matrix` = L Lᵀ, after a little was added to the diagonal. `None` if it has no
/// weight.
fn cholesky(matrix: &Matrix) -> Option<Matrix> {
    let size = matrix.size;
    let trace: f64 = (0..size).map(|i| matrix.at(i, i)).sum();
    if trace.is_nan() || trace <= 0.0 {
        return None;
    }
    let mut lower = Matrix::zero(size);
    for row in 0..size {
        for column in 0..=row {
            let products = (0..column).map(|k| lower.at(row, k) * lower.at(column, k)).sum::<f64>();
            let rest = matrix.at(row, column) - products;
            *lower.at_mut(row, column) = match row == column {
                true => (rest.max(0.0) + 1e-12 * trace).sqrt(),
                false => rest / lower.at(column, column),
            };
        }
    }
    Some(lower)
}

/// Solves L x = `values` in place.
fn forward(lower: &Matrix, values: &mut [f64]) {
    for row in 0..values.len() {
        let known = (0..row).map(|k| lower.at(row, k) * values[k]).sum::<f64>();
        values[row] = (values[row] - known) / lower.at(row, row);
    }
}

/// Solves Lᵀ x = `values` in place.
fn backward(lower: &Matrix, values: &mut [f64]) {
    for row in (0..values.len()).rev() {
        let known = (row + 1..values.len())
            .map(|k| lower.at(k, row) * values[k])
            .sum::<f64>();
        values[row] = (values[row] - known) / lower.at(row, row);
    }
}

/// The eigenvalues of a symmetric matrix with their unit vectors, by Jacobi's rotations.
fn eigen(mut matrix: Matrix) -> Vec<(f64, Vec<f64>)> {
    let size = matrix.size;
    // The rows are the vectors.
    let mut vectors = Matrix::zero(size);
    (0..size).for_each(|i| *vectors.at_mut(i, i) = 1.0);

    for _ in 0..50 {
        let pairs = || (0..size).flat_map(|p| (p + 1..size).map(move |q| (p, q)));
        let off: f64 = pairs().map(|(p, q)| matrix.at(p, q) * matrix.at(p, q)).sum();
        let diagonal: f64 = (0..size).map(|i| matrix.at(i, i) * matrix.at(i, i)).sum();
        if off <= 1e-24 * diagonal {
            break;
        }
        for (p, q) in pairs() {
            let apq = matrix.at(p, q);
            if apq.abs() < 1e-300 {
                continue;
            }
            let theta = (matrix.at(q, q) - matrix.at(p, p)) / (2.0 * apq);
            let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
            let turn = [cosine, tangent * cosine];
            for k in 0..size {
                let (x, y) = (matrix.at(k, p), matrix.at(k, q));
                *matrix.at_mut(k, p) = turn[0] * x - turn[1] * y;
                *matrix.at_mut(k, q) = turn[1] * x + turn[0] * y;
            }
            for rows in [&mut matrix, &mut vectors] {
                for k in 0..size {
                    let (x, y) = (rows.at(p, k), rows.at(q, k));
                    *rows.at_mut(p, k) = turn[0] * x - turn[1] * y;
                    *rows.at_mut(q, k) = turn[1] * x + turn[0] * y;
                }
            }
        }
    }
    let value = |i: usize| (matrix.at(i, i), vectors.rows[i * size..(i + 1) * size].to_vec());
    (0..size).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_and_vectors_belong_together() {
        let size = 12;
        let mut matrix = Matrix::zero(size);
        for i in 0..size {
            for j in 0..=i {
                let value = ((i * 7 + j * 13) % 11) as f64 - 4.0;
                *matrix.at_mut(i, j) = value;
                *matrix.at_mut(j, i) = value;
            }
        }
        for (value, vector) in eigen(matrix.clone()) {
            assert!((vector.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-12);
            for row in 0..size {
                let product: f64 = (0..size).map(|k| matrix.at(row, k) * vector[k]).sum();
                assert!((product - value * vector[row]).abs() < 1e-9);
            }
        }
    }
}
