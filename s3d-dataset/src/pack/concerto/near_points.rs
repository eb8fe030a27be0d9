//! Which point of a cloud is nearest to a place, within a small distance.

use s3d_geom::glam::{DVec3, IVec3, Vec3};
use std::collections::HashMap;

/// Points by cells that are twice the distance wide, so that eight cells hold all that is near.
pub(super) struct NearPoints<'a> {
    points: &'a [Vec3],
    distance_m: f64,
    /// The points, cell by cell.
    order: Vec<u32>,
    /// Where the points of a cell are in `order`.
    cells: HashMap<IVec3, (u32, u32)>,
}

impl<'a> NearPoints<'a> {
    /// Takes at most 2³² points.
    pub(super) fn new(points: &'a [Vec3], distance_m: f64) -> Self {
        let cell = |point: &Vec3| cell(point.as_dvec3(), distance_m).to_array();
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        order.sort_by_cached_key(|i| cell(&points[*i as usize]));

        let mut cells = HashMap::new();
        let mut begin = 0;
        for of_cell in order.chunk_by(|a, b| cell(&points[*a as usize]) == cell(&points[*b as usize])) {
            let end = begin + of_cell.len() as u32;
            let key = of_cell.first().map(|i| cell(&points[*i as usize]));
            cells.insert(IVec3::from_array(key.unwrap_or_default()), (begin, end));
            begin = end;
        }
        Self { points, distance_m, order, cells }
    }

    /// Returns the nearest point that is nearer than the distance; of several, the first.
    pub(super) fn nearest(&self, place: DVec3) -> Option<u32> {
        let low = cell(place - self.distance_m, self.distance_m);
        let high = cell(place + self.distance_m, self.distance_m);
        let mut best: Option<(f64, u32)> = None;
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let Some((begin, end)) = self.cells.get(&IVec3::new(x, y, z)) else { continue };
                    for i in &self.order[*begin as usize..*end as usize] {
                        let found = (self.points[*i as usize].as_dvec3().distance_squared(place), *i);
                        if best.is_none_or(|best| found < best) {
                            best = Some(found);
                        }
                    }
                }
            }
        }
        best.filter(|(squared, _)| *squared < self.distance_m * self.distance_m)
            .map(|(_, i)| i)
    }
}

fn cell(place: DVec3, distance_m: f64) -> IVec3 {
    (place / (2.0 * distance_m)).floor().as_ivec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_is_that_of_all() {
        let number = |n: u32| {
            let mixed = (u64::from(n) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (mixed >> 40) as f32 / (1 << 24) as f32
        };
        let points: Vec<Vec3> = (0..4000)
            .map(|i| Vec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2)) - 0.5)
            .collect();
        for distance_m in [0.001, 0.05, 0.4] {
            let near = NearPoints::new(&points, distance_m);
            let mut found = 0;
            for i in 0..300 {
                let place = DVec3::new(number(90_000 + i).into(), number(91_000 + i).into(), 0.1) - 0.5;
                let all = (0..).zip(&points).map(|(i, p)| (p.as_dvec3().distance(place), i));
                let best = all
                    .min_by(|a, b| a.0.total_cmp(&b.0))
                    .filter(|best| best.0 < distance_m);
                assert_eq!(near.nearest(place), best.map(|(_, i)| i));
                found += u32::from(best.is_some());
            }
            assert!(distance_m < 0.01 || found > 100, "{found}");
        }
        assert_eq!(NearPoints::new(&[], 1.0).nearest(DVec3::ZERO), None);
        // Of two in one place, the first.
        assert_eq!(NearPoints::new(&[Vec3::X, Vec3::X], 1.0).nearest(DVec3::X), Some(0));
    }
}
