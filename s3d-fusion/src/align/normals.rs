//! Planes through the points around a place.

use crate::register::cell;
use rayon::prelude::*;
use s3d_geom::glam::{DMat3, DVec3, Vec3};
use s3d_geom::symmetric_eigen;

/// Points with the directions that they look in, if those are known, found by cubes.
pub(super) struct Neighbours<'a> {
    positions: &'a [Vec3],
    /// One direction a point, or none at all.
    sides: &'a [Vec3],
    radius_m: f64,
    /// The cube of each point, ascending, with the point.
    cubes: Vec<([i32; 3], u32)>,
}

/// The fewest points that make a plane.
const LEAST_POINTS: usize = 6;
/// How often the points off the plane lose weight.
const ROUNDS: usize = 3;
/// The least width of the weights, metres.
const LEAST_WIDTH_M: f64 = 0.003;
/// Points are on a surface if they spread less than this across it, as a share of the second largest spread.
const FLAT: f64 = 0.1;
/// They are a line if the second largest spread is less than this share of the largest.
const NARROW: f64 = 0.02;
/// The share of the weight that must be left near the plane.
const LEAST_NEAR: f64 = 0.35;

impl<'a> Neighbours<'a> {
    /// `positions` are finite. `sides` is empty, or has one unit vector a point.
    pub(super) fn new(positions: &'a [Vec3], sides: &'a [Vec3], radius_m: f64) -> Self {
        let all = positions.par_iter().enumerate();
        let mut cubes: Vec<([i32; 3], u32)> = all.map(|(i, p)| (cell(*p, radius_m), i as u32)).collect();
        cubes.par_sort_unstable();
        Self { positions, sides, radius_m, cubes }
    }

    /// The place of the surface nearest to `p`, and its unit normal. If the points look somewhere, only those
    /// count that look to the same side as `side`, and so does the normal. `None` if there is no surface.
    pub(super) fn surface(&self, p: DVec3, side: Option<DVec3>) -> Option<(DVec3, DVec3)> {
        let near = self.within(p, side);
        if near.len() < LEAST_POINTS {
            return None;
        }
        // Beside an edge, what is near is mostly on the same side of it.
        let closeness: Vec<f64> = near
            .iter()
            .map(|q| {
                let share = 1.0 - p.distance_squared(*q) / (self.radius_m * self.radius_m);
                share * share
            })
            .collect();
        let mut weights = closeness.clone();
        let mut found = (p, DVec3::Z);
        for round in 0..=ROUNDS {
            let (middle, normal, spreads) = plane(&near, &weights)?;
            found = (p - normal * normal.dot(p - middle), normal);
            if round == ROUNDS {
                let share = weights.iter().sum::<f64>() / closeness.iter().sum::<f64>();
                let is_flat = spreads[0] < FLAT * spreads[1] && spreads[1] > NARROW * spreads[2];
                if !is_flat || share < LEAST_NEAR {
                    return None;
                }
                break;
            }

            let distances: Vec<f64> = near.iter().map(|q| normal.dot(*q - middle)).collect();
            let mut sizes: Vec<f64> = distances.iter().map(|d| d.abs()).collect();
            let half = sizes.len() / 2;
            let (_, median, _) = sizes.select_nth_unstable_by(half, f64::total_cmp);
            let width = (3.0 * *median).max(LEAST_WIDTH_M);
            for ((weight, close), distance) in weights.iter_mut().zip(&closeness).zip(&distances) {
                let spread = 1.0 + (distance / width) * (distance / width);
                *weight = close / (spread * spread);
            }
        }

        let (place, normal) = found;
        let turned = side.is_some_and(|side| side.dot(normal) < 0.0);
        Some((place, if turned { -normal } else { normal }))
    }

    /// The points within the radius that look to the same side, in a fixed order.
    fn within(&self, p: DVec3, side: Option<DVec3>) -> Vec<DVec3> {
        let [x, y, z] = cell(p.as_vec3(), self.radius_m);
        let mut near = Vec::new();
        for x in x.saturating_sub(1)..=x.saturating_add(1) {
            for y in y.saturating_sub(1)..=y.saturating_add(1) {
                let begin = self.cubes.partition_point(|c| c.0 < [x, y, z.saturating_sub(1)]);
                let last = [x, y, z.saturating_add(1)];
                for &(_, i) in self.cubes[begin..].iter().take_while(|c| c.0 <= last) {
                    let q = self.positions[i as usize].as_dvec3();
                    let looks = side
                        .zip(self.sides.get(i as usize))
                        .is_none_or(|(side, of)| side.dot(of.as_dvec3()) > 0.3);
                    if looks && p.distance_squared(q) <= self.radius_m * self.radius_m {
                        near.push(q);
                    }
                }
            }
        }
        near
    }
}

/// The middle of weighted points, the direction in which they spread least, and their three spreads (mean
/// squares), ascending. `None` without weight.
fn plane(points: &[DVec3], weights: &[f64]) -> Option<(DVec3, DVec3, [f64; 3])> {
    let total: f64 = weights.iter().sum();
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let middle = points.iter().zip(weights).map(|(p, w)| *p * *w).sum::<DVec3>() / total;
    let mut squares = DMat3::ZERO;
    for (p, weight) in points.iter().zip(weights) {
        let d = *p - middle;
        let weighted = d * (weight / total);
        squares += DMat3::from_cols(weighted * d.x, weighted * d.y, weighted * d.z);
    }
    let (spreads, axes) = symmetric_eigen(&squares);
    Some((middle, axes.x_axis, spreads.to_array()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::vec3;

    #[test]
    fn a_plane_is_found_beside_an_edge() {
        // A floor, and a wall at its edge.
        let mut points = Vec::new();
        for i in 0..40 {
            for j in 0..40 {
                let (u, v) = (i as f32 * 0.02, j as f32 * 0.02);
                points.extend([vec3(u, v, 0.0), vec3(0.0, u, v)]);
            }
        }
        let near = Neighbours::new(&points, &[], 0.12);
        let (place, normal) = near.surface(DVec3::new(0.05, 0.4, 0.001), None).unwrap();
        assert!(normal.z.abs() > 0.9999 && place.z.abs() < 1e-3, "{place} {normal}");
        assert!(near.surface(DVec3::splat(5.0), None).is_none());
        let line: Vec<Vec3> = (0..50).map(|i| vec3(i as f32 * 0.004, 0.0, 0.0)).collect();
        let found = Neighbours::new(&line, &[], 0.12).surface(DVec3::new(0.1, 0.0, 0.0), None);
        assert!(found.is_none(), "a line is no surface");
    }
}
