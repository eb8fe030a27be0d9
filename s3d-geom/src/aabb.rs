//! Axis-aligned boxes.

use glam::Vec3;

/// An axis-aligned box in world metres; `min` ≤ `max` on each axis unless it is [`Aabb::EMPTY`].
///
/// ```
/// use s3d_geom::{Aabb, glam::vec3};
///
/// let bbox = Aabb::from_points([vec3(0.0, 2.0, 1.0), vec3(3.0, 0.0, 1.5)]);
/// assert_eq!((bbox.min, bbox.size()), (vec3(0.0, 0.0, 1.0), vec3(3.0, 2.0, 0.5)));
/// assert!(bbox.contains(vec3(1.0, 1.0, 1.0)) && Aabb::EMPTY.is_empty());
/// assert_eq!(Aabb::EMPTY.union(bbox), bbox);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The corner of the smallest coordinates.
    pub min: Vec3,
    /// The corner of the largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The box of no point: it contains nothing, and adding a point to it gives that point's box.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around `points`, [`Aabb::EMPTY`] if there are none.
    pub fn from_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// The smallest box around this one and `point`.
    #[must_use]
    pub fn with(self, point: Vec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// The smallest box around this one and `other`.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether no point is inside.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Whether `point` is inside or on the surface.
    pub fn contains(&self, point: Vec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// Length, width and height; zero on each axis if empty.
    pub fn size(&self) -> Vec3 {
        if self.is_empty() {
            Vec3::ZERO
        } else {
            self.max - self.min
        }
    }

    /// The point in the middle. Not a number if empty.
    pub fn center(&self) -> Vec3 {
        self.min + (self.max - self.min) * 0.5
    }

    /// `[xmin, ymin, zmin, xmax, ymax, zmax]`, as the data set writes a box.
    pub fn to_array(&self) -> [f32; 6] {
        [self.min.x, self.min.y, self.min.z, self.max.x, self.max.y, self.max.z]
    }
}

/// As data: its corners, or nothing if it is empty, since JSON has no infinite numbers.
#[cfg(feature = "serde")]
mod as_data {
    use super::Aabb;
    use glam::Vec3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

    #[derive(Serialize, Deserialize)]
    #[serde(rename = "Aabb")]
    struct Corners {
        min: Vec3,
        max: Vec3,
    }

    impl Serialize for Aabb {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let corners = (!self.is_empty()).then_some(Corners { min: self.min, max: self.max });
            corners.serialize(serializer)
        }
    }

    impl<'de> Deserialize<'de> for Aabb {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            match Option::<Corners>::deserialize(deserializer)?.map(|c| Aabb { min: c.min, max: c.max }) {
                Some(bbox) if bbox.is_empty() => Err(de::Error::custom("min of a box is above its max")),
                bbox => Ok(bbox.unwrap_or(Aabb::EMPTY)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn box_of_points() {
        let b = Aabb::from_points([vec3(1.0, 5.0, -1.0), vec3(0.0, 7.0, 2.0)]);
        assert_eq!(b.to_array(), [0.0, 5.0, -1.0, 1.0, 7.0, 2.0]);
        assert!(b.contains(vec3(1.0, 7.0, 2.0)) && !b.contains(vec3(1.1, 6.0, 0.0)));
        assert_eq!(b.size(), vec3(1.0, 2.0, 3.0));
        assert!(Aabb::EMPTY.is_empty() && !b.is_empty());
        assert_eq!(Aabb::EMPTY.union(b), b);
        assert_eq!(Aabb::EMPTY.size(), Vec3::ZERO);
    }
}
