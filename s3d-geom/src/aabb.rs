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
    /// The corner with the smallest coordinates.
    pub min: Vec3,
    /// The corner with the largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The box without any point. Adding a point to it gives the box of that point.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Returns the smallest box around `points`, or [`Aabb::EMPTY`] if there are none.
    pub fn from_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// Returns the smallest box around this one and `point`.
    #[must_use]
    pub fn with(self, point: Vec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// Returns the smallest box around this one and `other`.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns true if the box contains no point.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Returns true if `point` is inside or on the surface.
    pub fn contains(&self, point: Vec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// Returns the extent along x, y and z, in metres; zero on each axis if the box is empty.
    pub fn size(&self) -> Vec3 {
        if self.is_empty() {
            Vec3::ZERO
        } else {
            self.max - self.min
        }
    }

    /// Returns the centre. It is NaN if the box is empty.
    pub fn center(&self) -> Vec3 {
        self.min + (self.max - self.min) * 0.5
    }

    /// Returns `[xmin, ymin, zmin, xmax, ymax, zmax]`, as the data set writes a box.
    pub fn to_array(&self) -> [f32; 6] {
        [self.min.x, self.min.y, self.min.z, self.max.x, self.max.y, self.max.z]
    }
}

/// The serialized form: the two corners, or nothing if the box is empty, since JSON has no infinite numbers.
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
