//! Boxes in the frames of files.

use s3d_geom::Aabb;
use s3d_geom::glam::DVec3;

/// A box in `f64`, which keeps the digits of any frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) min: DVec3,
    pub(crate) max: DVec3,
}

impl Bounds {
    pub(crate) const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    pub(crate) fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    #[inline]
    pub(crate) fn with(self, p: DVec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    pub(crate) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns whether the box has finite numbers, and is not [`EMPTY`](Self::EMPTY).
    pub(crate) fn is_some(&self) -> bool {
        self.min.is_finite() && self.max.is_finite() && self.min.cmple(self.max).all()
    }

    pub(crate) fn size(&self) -> DVec3 {
        self.max - self.min
    }

    pub(crate) fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    pub(crate) fn minus(self, offset: DVec3) -> Self {
        Self { min: self.min - offset, max: self.max - offset }
    }

    /// Returns the largest distance of a coordinate from 0.
    pub(crate) fn farthest_m(&self) -> f64 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    /// Returns the distance between two boxes; 0 if they touch.
    pub(crate) fn distance_m(&self, other: &Self) -> f64 {
        (self.min - other.max)
            .max(other.min - self.max)
            .max(DVec3::ZERO)
            .length()
    }
}

impl From<Aabb> for Bounds {
    fn from(b: Aabb) -> Self {
        Self { min: b.min.as_dvec3(), max: b.max.as_dvec3() }
    }
}
