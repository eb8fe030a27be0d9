//! Chooses the sizes of windows: clusters of the sizes of training boxes.

use glam::Vec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Lengths below this, in metres, count as equal, since windows have a step of 0.1 m.
const THIN_M: f32 = 0.05;
/// The least and the greatest number of sizes of a class (Armeni et al.).
const SIZES: [usize; 2] = [3, 8];
/// The number of sizes is the least that covers this share of what the best number covers.
const ENOUGH: f64 = 0.97;
/// The number of rounds of k-means.
const ROUNDS: usize = 30;

fn log_size(size: Vec3) -> Vec3 {
    Vec3::from(size.max(Vec3::splat(THIN_M)).to_array().map(libm::logf))
}

/// Returns how well a size covers another: the IoU of both about one centre. Thin sides count as [`THIN_M`].
fn cover(a: Vec3, b: Vec3) -> f64 {
    let [a, b] = [a, b].map(|size| size.max(Vec3::splat(THIN_M)).as_dvec3());
    let shared = a.min(b).element_product();
    shared / (a.element_product() + b.element_product() - shared)
}

/// Clusters sizes by k-means on their logarithms, with the start of k-means++ (Arthur and Vassilvitskii,
/// 2007). Returns the medians of 3 to 8 clusters, or fewer if there are fewer boxes, and the cluster of each
/// box.
pub fn cluster_sizes(sizes: &[Vec3], seed: u64) -> (Vec<Vec3>, Vec<usize>) {
    let all: Vec<_> = (SIZES[0]..=SIZES[1]).map(|k| k_means(sizes, k, seed)).collect();
    let covered = |(centers, of): &(Vec<Vec3>, Vec<usize>)| {
        sizes.iter().zip(of).map(|(s, &c)| cover(*s, centers[c])).sum::<f64>()
    };

    let most = all.iter().map(covered).fold(0.0, f64::max);
    all.into_iter()
        .find(|clusters| covered(clusters) >= ENOUGH * most)
        .unwrap_or_default()
}

fn k_means(sizes: &[Vec3], k: usize, seed: u64) -> (Vec<Vec3>, Vec<usize>) {
    let points: Vec<Vec3> = sizes.iter().map(|s| log_size(*s)).collect();
    let mut centers = first_centers(&points, k, seed);

    let mut of = vec![0; points.len()];
    for _ in 0..ROUNDS {
        for (p, of) in points.iter().zip(&mut of) {
            *of = nearest(&centers, *p);
        }
        for (c, center) in centers.iter_mut().enumerate() {
            let members = members_of(c, &points, &of);
            if !members.is_empty() {
                *center = members.iter().sum::<Vec3>() / members.len() as f32;
            }
        }
    }

    let medians = (0..centers.len()).map(|c| {
        let members = members_of(c, sizes, &of);
        let median = |axis: usize| {
            let mut values: Vec<f32> = members.iter().map(|s| s[axis]).collect();
            values.sort_by(f32::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(THIN_M)
        };
        Vec3::new(median(0), median(1), median(2))
    });
    (medians.collect(), of)
}

/// Draws the first centres among the points, each with a probability that grows with its distance to the
/// others.
fn first_centers(points: &[Vec3], k: usize, seed: u64) -> Vec<Vec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut centers: Vec<Vec3> = Vec::new();
    while centers.len() < k.min(points.len()) {
        let weights: Vec<f64> = points
            .iter()
            .map(|p| {
                centers
                    .iter()
                    .map(|c| f64::from(c.distance_squared(*p)))
                    .fold(1e9, f64::min)
            })
            .collect();
        let total: f64 = weights.iter().sum();
        if total <= 0.0 {
            break;
        }

        let mut rest = rng.random::<f64>() * total;
        let next = weights.iter().position(|w| {
            rest -= w;
            rest < 0.0
        });
        centers.push(points[next.unwrap_or(points.len() - 1)]);
    }
    centers
}

/// Returns the points of a cluster; `of` has the cluster of each point.
fn members_of(cluster: usize, points: &[Vec3], of: &[usize]) -> Vec<Vec3> {
    let members = points.iter().zip(of).filter(|(_, o)| **o == cluster);
    members.map(|(p, _)| *p).collect()
}

/// Returns the index of the centre nearest to a point; the first wins a tie.
fn nearest(centers: &[Vec3], p: Vec3) -> usize {
    let distance = |c: usize| centers[c].distance_squared(p);
    (1..centers.len()).fold(0, |best, c| if distance(c) < distance(best) { c } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn groups_of_sizes_are_found() {
        let kinds = [vec3(0.5, 0.5, 0.9), vec3(3.0, 0.01, 2.8), vec3(0.01, 3.0, 2.8), vec3(1.6, 0.8, 0.7)];
        let sizes: Vec<Vec3> = (0..80).map(|i| kinds[i % 4] * (0.95 + 0.01 * (i / 8) as f32)).collect();
        let (centers, of) = cluster_sizes(&sizes, 7);
        assert!((4..=8).contains(&centers.len()));
        for (i, size) in sizes.iter().enumerate() {
            assert!(cover(*size, centers[of[i]]) > 0.7, "{size}: {}", centers[of[i]]);
        }
        assert_eq!(cluster_sizes(&sizes, 7).0, centers);
        assert_eq!(cluster_sizes(&[], 1).0.len(), 0);
        assert_eq!(cluster_sizes(&[vec3(1.0, 1.0, 1.0); 5], 1).0, [vec3(1.0, 1.0, 1.0)]);
    }
}
