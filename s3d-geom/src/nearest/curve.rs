//! Points in the order of a space-filling curve.

use crate::Aabb;
use glam::Vec3;
use rayon::prelude::*;

/// The largest number of points that [`along_a_curve`] sorts.
pub(crate) const MOST_POINTS: usize = 1 << 20;

/// The last cell along a side of the cube around the points.
const LAST_CELL: f32 = 16_383.0;

/// Writes the indices of points into `order`, sorted so that neighbours in the order are near each other: in
/// Z-order of the cells of a cube around the points. Points that are not finite may be anywhere in the order.
/// Runs on all threads of the current rayon pool.
///
/// # Panics
/// If there are more than [`MOST_POINTS`] points.
pub(crate) fn along_a_curve(points: &[Vec3], order: &mut Vec<u64>) {
    assert!(points.len() <= MOST_POINTS, "{} points", points.len());
    let bounds = Aabb::from_points(points.iter().copied().filter(|p| p.is_finite()));
    let size = bounds.size().max_element();
    let scale = if size.is_finite() && size > 0.0 {
        LAST_CELL / size
    } else {
        0.0
    };

    order.clear();
    order.extend(points.iter().zip(0..).map(|(&point, at)| {
        // The conversion gives a number in range for any `f32`.
        let [x, y, z] = ((point - bounds.min) * scale)
            .to_array()
            .map(|c| spread(c.clamp(0.0, LAST_CELL) as u16));
        (x | y << 1 | z << 2) << 20 | at
    }));

    order.par_sort_unstable();
    order.par_iter_mut().for_each(|key| *key &= MOST_POINTS as u64 - 1);
}

/// Returns the bits of `x`, with two zeros between neighbours.
#[inline]
fn spread(x: u16) -> u64 {
    let mut x = u64::from(x);
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    fn order_of(points: &[Vec3]) -> Vec<u64> {
        let mut order = vec![9; 3];
        along_a_curve(points, &mut order);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..points.len() as u64).collect::<Vec<_>>());
        order
    }

    #[test]
    fn neighbours_follow_each_other() {
        // A floor of 64 × 64 points, 1 m apart, shuffled.
        let points: Vec<Vec3> = (0..4096)
            .map(|i| i * 1657 % 4096)
            .map(|i| vec3((i % 64) as f32, (i / 64) as f32, 3.0))
            .collect();
        let length = |order: &mut dyn Iterator<Item = usize>| -> f32 {
            let way: Vec<Vec3> = order.map(|at| points[at]).collect();
            way.windows(2).map(|w| w[0].distance(w[1])).sum()
        };
        let shuffled = length(&mut (0..4096));
        let sorted = length(&mut order_of(&points).into_iter().map(|at| at as usize));
        assert!(sorted < 1.7 * 4096.0 && shuffled > 20.0 * 4096.0, "{sorted} {shuffled}");
    }

    #[test]
    fn any_points_have_an_order() {
        order_of(&[]);
        order_of(&[Vec3::ONE; 5]);
        order_of(&[Vec3::NAN, Vec3::ZERO, Vec3::INFINITY, Vec3::X, Vec3::NEG_INFINITY]);
        order_of(&[Vec3::NAN; 2]);
        order_of(&[Vec3::splat(f32::MAX), Vec3::splat(f32::MIN), Vec3::ZERO]);
        order_of(&[Vec3::splat(1e-45), Vec3::ZERO]);
    }
}
