//! Eigenvalues and eigenvectors of symmetric matrices, as those of covariances.

use glam::{DMat3, DVec3};

/// Sweeps of rotations. Five of them are enough for full precision.
const SWEEPS: usize = 12;

/// Returns the eigenvalues of a symmetric matrix, ascending, and their unit eigenvectors as columns. Of the
/// matrix, the upper triangle and the diagonal are read; all numbers must be finite.
///
/// The same matrix gives the same bits on every machine. Source: Golub and Van Loan, "Matrix Computations",
/// 2013, 8.5 (Jacobi's rotations).
///
/// ```
/// use s3d_geom::{glam::{DMat3, DVec3}, symmetric_eigen};
///
/// // The covariance of points on a slanted plane: the first eigenvector is its normal.
/// let (normal, along) = (DVec3::new(0.6, 0.0, 0.8), DVec3::Y);
/// let across = normal.cross(along);
/// let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
/// let (values, axes) = symmetric_eigen(&(outer(along) * 4.0 + outer(across)));
/// assert!((values - DVec3::new(0.0, 1.0, 4.0)).length() < 1e-12);
/// assert!(axes.x_axis.dot(normal).abs() > 1.0 - 1e-12);
/// ```
pub fn symmetric_eigen(matrix: &DMat3) -> (DVec3, DMat3) {
    let [[xx, ..], [xy, yy, _], [xz, yz, zz]] = matrix.to_cols_array_2d();
    let mut m = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let size = xx.abs() + yy.abs() + zz.abs() + xy.abs() + xz.abs() + yz.abs();

    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q].abs() <= 1e-16 * size {
                continue;
            }
            // The turn in the plane of p and q that makes their product zero.
            let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
            let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
            let sine = tangent * cosine;
            let turned = |a: f64, b: f64| (cosine * a - sine * b, sine * a + cosine * b);
            for row in &mut m {
                (row[p], row[q]) = turned(row[p], row[q]);
            }
            let rows = [m[p], m[q]];
            for (k, (a, b)) in rows[0].into_iter().zip(rows[1]).enumerate() {
                (m[p][k], m[q][k]) = turned(a, b);
            }
            (axes[p], axes[q]) = (cosine * axes[p] - sine * axes[q], sine * axes[p] + cosine * axes[q]);
        }
    }

    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| m[a][a].total_cmp(&m[b][b]));
    let [a, b, c] = order;
    let vectors = DMat3::from_cols(axes[a].normalize(), axes[b].normalize(), axes[c].normalize());
    (DVec3::new(m[a][a], m[b][b], m[c][c]), vectors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn values_and_vectors_belong_together(
            numbers in prop::array::uniform6(-1e3..1e3f64),
            scale in -9..9,
        ) {
            let [xx, xy, xz, yy, yz, zz] = numbers.map(|n| n * 10f64.powi(scale));
            let matrix = DMat3::from_cols_array_2d(&[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
            let (values, axes) = symmetric_eigen(&matrix);
            let size = matrix.to_cols_array().map(f64::abs).iter().sum::<f64>();
            prop_assert!(values.x <= values.y && values.y <= values.z);
            for k in 0..3 {
                prop_assert!((matrix * axes.col(k) - axes.col(k) * values[k]).length() <= 1e-13 * size);
            }
            prop_assert!((axes.transpose() * axes).abs_diff_eq(DMat3::IDENTITY, 1e-13));
        }
    }

    #[test]
    fn equal_values_have_axes_all_the_same() {
        for diagonal in [DVec3::ZERO, DVec3::ONE, DVec3::new(2.0, 1.0, 2.0)] {
            let (values, axes) = symmetric_eigen(&DMat3::from_diagonal(diagonal));
            assert_eq!(values.to_array().iter().sum::<f64>(), diagonal.element_sum());
            assert_eq!(axes.determinant().abs(), 1.0);
        }
    }
}
