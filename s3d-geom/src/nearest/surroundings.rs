//! The distance of a point from a mesh as a whole, which decides how to search.
//!
//! Bounds in `f32` are off by a share of the distance. Far from the mesh, that is more than the size of the
//! mesh: the bounds do not tell faces apart, and the search would measure all of them. There `f64` decides
//! ([`super::face_tree::Search::nearest_far`]). Beyond a million times the size of the mesh, `f64` does not
//! help either. Such a point is moved along its line to the middle of the mesh until it is that near, so a
//! lookup costs the same from any distance.

use crate::Aabb;
use glam::{DVec3, Vec3};

/// The distance, in sizes of the mesh, up to which `f32` tells faces apart. It is off by less than 1e-4 of
/// the size there.
const NEAR: f32 = 16.0;

/// The distance, in sizes of the mesh, up to which `f64` tells faces apart. It is off by less than 1e-9 of
/// the size there.
const FARTHEST: f64 = 1e6;

/// The surroundings of a mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings {
    near: Aabb,
    center: DVec3,
    farthest_m: f64,
}

impl Surroundings {
    /// Returns the surroundings of a mesh with these bounds.
    pub(crate) fn new(bounds: Aabb) -> Self {
        let margin = Vec3::splat(NEAR * bounds.size().length());
        let low = bounds.min.as_dvec3();
        let high = bounds.max.as_dvec3();
        Self {
            near: Aabb { min: bounds.min - margin, max: bounds.max + margin },
            center: (low + high) * 0.5,
            farthest_m: FARTHEST * (high - low).length(),
        }
    }

    /// Returns true if bounds in `f32` are enough for all points of a box.
    #[inline(always)]
    pub(crate) fn are_near(&self, points: Aabb) -> bool {
        points.min.cmpge(self.near.min).all() && points.max.cmple(self.near.max).all()
    }

    /// Returns the place from which a point is looked up: the point itself, unless it is too far.
    pub(crate) fn looked_up_from(&self, point: Vec3) -> DVec3 {
        let away = point.as_dvec3() - self.center;
        let distance_m = away.length();
        if distance_m <= self.farthest_m {
            return point.as_dvec3();
        }
        self.center + away * (self.farthest_m / distance_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn only_points_a_million_sizes_away_are_moved() {
        let mesh = Surroundings::new(Aabb { min: vec3(1.0, 1.0, 1.0), max: vec3(4.0, 5.0, 1.0) });
        for near in [vec3(2.0, 2.0, 1.0), vec3(-4.9e6, 0.0, 0.0), vec3(0.1, 0.2, 4.9e6)] {
            assert_eq!(mesh.looked_up_from(near), near.as_dvec3());
        }
        let moved = mesh.looked_up_from(vec3(2.5, 3.0, 1e38));
        assert!((moved - glam::dvec3(2.5, 3.0, 5e6 + 1.0)).length() < 1e-6, "{moved}");
        let around = |p: Vec3| mesh.are_near(Aabb { min: p, max: p });
        assert!(around(vec3(-78.0, 0.0, 0.0)) && !around(vec3(-80.0, 0.0, 0.0)));
    }
}
