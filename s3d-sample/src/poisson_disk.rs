//! Poisson-disk patterns: points that keep a distance from each other and leave no room for another point.

use crate::stream::stream;
use rand::Rng;
use std::collections::HashMap;

/// Chooses some of `points` (metres) that are at least `distance_m` apart. Returns their indices, in the
/// order in which they were chosen.
///
/// Every point that is not chosen is nearer than `distance_m` to a chosen one. The points are tried in a
/// random order, which depends on `seed` and `name` alone. Dense points give the pattern of dart throwing
/// (Cook 1986) over the region that they cover. Time and memory are proportional to the number of points.
///
/// # Panics
/// If `distance_m` is not above 0, or a point is not finite.
///
/// ```
/// let line: Vec<[f64; 3]> = (0..100).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
/// let chosen = s3d_sample::poisson_disk(&line, 2.0, 7, "line");
/// assert!((3..=5).contains(&chosen.len()));
/// ```
pub fn poisson_disk(points: &[[f64; 3]], distance_m: f64, seed: u64, name: &str) -> Vec<usize> {
    poisson_disk_where(points, distance_m, seed, name, |_, _| true)
}

/// Works like [`poisson_disk`], but two points only have to keep apart if `is_near` returns true for their
/// indices. It is called for pairs that are nearer than `distance_m`. Points on two sides of a wall, for
/// instance, may then be close together.
///
/// # Panics
/// If `distance_m` is not above 0, or a point is not finite.
///
/// ```
/// // Two rooms on a line; the wall is at 1.
/// let line: Vec<[f64; 3]> = (0..20).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
/// let is_same_room = |a: usize, b: usize| (a < 10) == (b < 10);
/// let chosen = s3d_sample::poisson_disk_where(&line, 5.0, 7, "line", is_same_room);
/// assert_eq!(chosen.len(), 2);
/// ```
pub fn poisson_disk_where(
    points: &[[f64; 3]],
    distance_m: f64,
    seed: u64,
    name: &str,
    is_near: impl Fn(usize, usize) -> bool,
) -> Vec<usize> {
    assert!(distance_m > 0.0, "a distance of {distance_m} m");
    assert!(points.iter().flatten().all(|c| c.is_finite()), "a point that is not finite");

    // The shuffle of Fisher and Yates, from the end. The bias of the remainder is 2⁻³² at most.
    let mut order: Vec<usize> = (0..points.len()).collect();
    let mut rng = stream(*b"disk", seed, name, 0);
    for last in (1..order.len()).rev() {
        order.swap(last, (rng.next_u64() % (last as u64 + 1)) as usize);
    }

    // A cell is as wide as the distance, so points that are too near lie in the 27 cells around a point.
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    let mut chosen = Vec::new();
    for index in order {
        let point = &points[index];
        let at = point.map(|c| (c / distance_m).floor() as i64);

        let near = (-1..=1).any(|x| {
            (-1..=1).any(|y| {
                (-1..=1).any(|z| {
                    let neighbour =
                        [at[0].saturating_add(x), at[1].saturating_add(y), at[2].saturating_add(z)];
                    cells.get(&neighbour).is_some_and(|c| {
                        c.iter().any(|other| {
                            let d2: f64 = (0..3).map(|k| (points[*other][k] - point[k]).powi(2)).sum();
                            d2 < distance_m * distance_m && is_near(*other, index)
                        })
                    })
                })
            })
        });

        if !near {
            cells.entry(at).or_default().push(index);
            chosen.push(index);
        }
    }

    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
    }

    proptest! {
        #[test]
        fn chosen_points_keep_apart_and_leave_no_place(
            points in prop::collection::vec(prop::array::uniform3(-5.0..5.0f64), 0..200),
            distance_m in 0.05..4.0f64,
            seed in 0u64..5,
        ) {
            let chosen = poisson_disk(&points, distance_m, seed, "room");
            for (i, a) in chosen.iter().enumerate() {
                for b in &chosen[..i] {
                    prop_assert!(distance(&points[*a], &points[*b]) >= distance_m);
                }
            }
            for p in &points {
                prop_assert!(chosen.iter().any(|c| distance(&points[*c], p) < distance_m));
            }
            prop_assert_eq!(&chosen, &poisson_disk(&points, distance_m, seed, "room"));
        }
    }

    #[test]
    fn seed_and_name_decide() {
        let points: Vec<[f64; 3]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
        let a = poisson_disk(&points, 3.0, 1, "a");
        assert_ne!(a, poisson_disk(&points, 3.0, 2, "a"));
        assert_ne!(a, poisson_disk(&points, 3.0, 1, "b"));
    }

    #[test]
    fn equal_points_are_chosen_once_and_far_ones_do_not_overflow() {
        assert_eq!(poisson_disk(&[[1.0; 3]; 9], 0.1, 0, "").len(), 1);
        assert_eq!(poisson_disk(&[[1e300; 3], [-1e300; 3]], 1.0, 0, "").len(), 2);
    }
}
