//! Matches the exposures of captures.

use super::capture::{CubeRay, PreparedCapture, SceneDepths};
use crate::picture::cube_map::CubeMap;
use glam::DMat3;
/// The standard deviation of a factor from 1, and the standard deviation of one point's colour between two
/// captures, 0 to 255.
const GAIN_DEVIATION: f64 = 1.0;
const COLOR_DEVIATION: f64 = 10.0;

/// The colours that tell anything about exposure: not too dark and not too bright.
const TELLING: std::ops::RangeInclusive<f32> = 8.0..=247.0;

/// Returns a factor for each capture and channel that matches their exposures. The factors minimise the sum,
/// over the pairs of captures that overlap, of (gᵢ·meanᵢ − gⱼ·meanⱼ)² and of (1 − g)². Each
/// term is weighted by its deviation and the number of pixels.
pub(super) fn gains(
    views: &[PreparedCapture],
    size: u32,
    rays: &SceneDepths,
    world_from_frame: DMat3,
) -> Vec<[f32; 3]> {
    let n = views.len();
    let sums = shared_colors(views, size, rays, world_from_frame);

    let mut gains = vec![[1.0f32; 3]; n];
    for k in 0..3 {
        let mut matrix = vec![0.0; n * n];
        let mut right = vec![0.0; n];
        // One equation a capture.
        for i in 0..n {
            // A capture that overlaps no other keeps its exposure.
            matrix[i * n + i] += 1e-6;
            right[i] += 1e-6;
            for j in (0..n).filter(|&j| j != i) {
                let (count, sum) = sums[i * n + j];
                if count == 0.0 {
                    continue;
                }
                let own = sum[k] / count;
                let other = sums[j * n + i].1[k] / count;
                let weight = count / (COLOR_DEVIATION * COLOR_DEVIATION);
                let prior = count / (GAIN_DEVIATION * GAIN_DEVIATION);
                matrix[i * n + i] += 2.0 * weight * own * own + prior;
                matrix[i * n + j] -= 2.0 * weight * own * other;
                right[i] += prior;
            }
        }

        for (gain, solved) in gains.iter_mut().zip(solve(matrix, right)) {
            gain[k] = solved.clamp(0.25, 4.0) as f32;
        }
    }
    gains
}

/// The number of pixels that a pair of captures shares, and the sum of the first capture's colours there.
type SharedColors = (f64, [f64; 3]);

/// Returns the shared colours of each pair of captures, row by row.
fn shared_colors(
    views: &[PreparedCapture],
    size: u32,
    rays: &SceneDepths,
    world_from_frame: DMat3,
) -> Vec<SharedColors> {
    let n = views.len();
    let mut sums = vec![(0.0f64, [0.0f64; 3]); n * n];
    let colors = CubeMap::directions(size).map(|(face, x, y, d)| {
        let ray =
            CubeRay { direction: world_from_frame * d, depth: rays.depth(face, x, y), size, whole: true };
        views.iter().map(|v| v.sees(&ray).map(|(c, _)| c)).collect::<Vec<_>>()
    });

    for seen in colors {
        let seen: Vec<(usize, [f32; 3])> = seen
            .into_iter()
            .enumerate()
            .filter_map(|(i, c)| Some((i, c.filter(is_telling)?)))
            .collect();
        for &(i, color) in &seen {
            for &(j, _) in seen.iter().filter(|(j, _)| *j != i) {
                let (count, sum) = &mut sums[i * n + j];
                *count += 1.0;
                (0..3).for_each(|k| sum[k] += f64::from(color[k]));
            }
        }
    }
    sums
}

/// Tells whether a colour tells anything about exposure.
fn is_telling(color: &[f32; 3]) -> bool {
    color.iter().all(|v| TELLING.contains(v))
}

/// Solves a system with a symmetric, positive definite matrix, given row by row.
fn solve(mut matrix: Vec<f64>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();

    for i in 0..n {
        for row in i + 1..n {
            let factor = matrix[row * n + i] / matrix[i * n + i];
            for column in i..n {
                matrix[row * n + column] -= factor * matrix[i * n + column];
            }
            right[row] -= factor * right[i];
        }
    }

    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| matrix[i * n + j] * right[j]).sum();
        right[i] = (right[i] - known) / matrix[i * n + i];
    }

    right
}

#[cfg(test)]
mod tests {
    use super::solve;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn systems_are_solved(values in prop::collection::vec(-1.0..1.0f64, 20)) {
            // AᵀA + 1 is positive definite.
            let (a, x) = values.split_at(16);
            let matrix: Vec<f64> = (0..16)
                .map(|k| (k / 4, k % 4))
                .map(|(i, j)| {
                    let product: f64 = (0..4).map(|r| a[4 * r + i] * a[4 * r + j]).sum();
                    product + f64::from(u8::from(i == j))
                })
                .collect();
            let right = (0..4).map(|i| (0..4).map(|j| matrix[4 * i + j] * x[j]).sum()).collect();
            for (solved, x) in solve(matrix, right).iter().zip(x) {
                prop_assert!((solved - x).abs() < 1e-9);
            }
        }
    }
}
