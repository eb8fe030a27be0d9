//! A face as seen from the origin of a ray: the cone of directions that hit it, with exact signs.
//!
//! Put the origin of a ray at zero. Let det(a, b, c) > 0 for the corners of a triangle. The direction d hits
//! the triangle exactly if it lies in the cone that a, b and c span: det(d, b, c) ≥ 0, det(d, c, a) ≥ 0
//! and det(d, a, b) ≥ 0. The corners relative to the origin are rounded once, in `f64`, in the same way for
//! every face that shares them. The signs of the determinants are exact (Shewchuk's adaptive predicates). So
//! the test works on true cones, and these leave no gap between faces that share an edge or a corner.

use glam::DVec3;
use robust::{Coord3D, orient3d};
use s3d_geom::TriMesh;

/// A face in front of an origin. It is wound so that det(a, b, c) > 0 for its corners a, b, c relative to the
/// origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    pub(crate) corners: [DVec3; 3],
    pub(crate) plane: Plane,
}

/// The plane of the points x with normal · x = offset, relative to the origin; offset > 0 up to rounding.
/// The length of `normal` is twice the area of the face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub(crate) normal: DVec3,
    pub(crate) offset: f64,
}

impl Cone {
    /// Returns the cone of a face. Returns `None` if the origin lies exactly in the plane of the face: the
    /// face has no width from there, and a ray at its rim hits its neighbours.
    pub(crate) fn new(mesh: &TriMesh, face: u32, origin: DVec3) -> Option<Self> {
        Self::of_corners(mesh.triangle(face).map(|p| p.as_dvec3()), origin)
    }

    /// Returns the cone of a face with these corners in the world, as [`Cone::new`] does.
    pub(crate) fn of_corners(world: [DVec3; 3], origin: DVec3) -> Option<Self> {
        let [a, b, c] = world.map(|p| p - origin);
        // Differences of `f32` positions are almost exact in `f64`, so the normal of a sliver is as good as
        // any.
        let normal = (world[1] - world[0]).cross(world[2] - world[0]);

        let turn = side(a, b, c);
        if turn > 0.0 {
            Some(Self { corners: [a, b, c], plane: Plane { normal, offset: normal.dot(a) } })
        } else if turn < 0.0 {
            Some(Self { corners: [a, c, b], plane: Plane { normal: -normal, offset: -normal.dot(a) } })
        } else {
            None
        }
    }

    /// Tells whether a ray along `d` hits the face. The rim belongs to the face.
    pub(crate) fn contains(&self, d: DVec3) -> bool {
        let [a, b, c] = self.corners;
        side(d, b, c) >= 0.0 && side(d, c, a) >= 0.0 && side(d, a, b) >= 0.0
    }

    /// Returns the multiple of `d` that lies on the face; it is above 0. The cone must contain `d`.
    pub(crate) fn distance(&self, d: DVec3) -> f64 {
        self.plane
            .distance(d)
            .unwrap_or_else(|| self.distance_between_corners(d))
    }

    /// Returns the distance along `d` of a face that is seen edge-on. The plane is of little use there, so
    /// the corners' distances are weighted.
    fn distance_between_corners(&self, d: DVec3) -> f64 {
        let [a, b, c] = self.corners;
        let weights = [side(d, b, c), side(d, c, a), side(d, a, b)].map(|w| w.max(0.0));
        let sum: f64 = weights.iter().sum();
        let along = weights[0] * a.dot(d) + weights[1] * b.dot(d) + weights[2] * c.dot(d);
        let t = along / sum / d.length_squared();
        if t > 0.0 { t } else { f64::MIN_POSITIVE }
    }
}

impl Plane {
    /// Returns the multiple of `d` that lies in the plane, to 1e-8 of itself. Returns `None` if the plane is
    /// seen too close to edge-on.
    #[inline(always)]
    pub(crate) fn distance(&self, d: DVec3) -> Option<f64> {
        let slope = self.normal.dot(d);
        let t = self.offset / slope;
        let clear = slope * slope > 1e-16 * self.normal.length_squared() * d.length_squared();
        (clear && t > 0.0).then_some(t)
    }
}

/// Returns det(a, b, c) with the exact sign, 0 included.
pub(crate) fn side(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let quick = a.dot(b.cross(c));
    // There are six products of three factors: the rounding error is below 24 · 2⁻⁵³ times the largest.
    let bound = 3e-15 * a.abs().max_element() * b.abs().max_element() * c.abs().max_element();
    if quick.abs() > bound {
        quick
    } else {
        exact_side(a, b, c)
    }
}

#[cold]
fn exact_side(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let [a, b, c, zero] = [a, b, c, DVec3::ZERO].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    orient3d(a, b, c, zero)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, dvec3, vec3};
    use proptest::prelude::*;

    /// Returns det(a, b, c) of small integers, exactly.
    fn integer_side(a: [i64; 3], b: [i64; 3], c: [i64; 3]) -> i64 {
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    }

    fn point() -> impl Strategy<Value = [i64; 3]> {
        prop::array::uniform3(-20i64..=20)
    }

    fn scaled(q: [i64; 3], s: f64) -> DVec3 {
        dvec3(q[0] as f64, q[1] as f64, q[2] as f64) * s
    }

    proptest! {
        #[test]
        fn signs_are_exact(a in point(), b in point(), c in point(), scale in -1e-3..1e-3f64) {
            // Scaling by a factor that rounds would keep a zero only by chance, so powers of two are used.
            let s = if scale > 0.0 { 1.0 / 1024.0 } else { 4096.0 };
            let expected = integer_side(a, b, c).signum() as f64;
            let got = side(scaled(a, s), scaled(b, s), scaled(c, s));
            prop_assert_eq!(if got == 0.0 { 0.0 } else { got.signum() }, expected);
        }

        #[test]
        fn swapping_negates_even_when_it_is_close(
            a in prop::array::uniform3(-1.0..1.0f64), b in prop::array::uniform3(-1.0..1.0f64),
            s in -1.0..1.0f64, t in -1.0..1.0f64,
        ) {
            let a = DVec3::from(a);
            let b = DVec3::from(b);
            let d = a * s + b * t; // In the plane of a and b, up to rounding.
            let one = side(d, a, b);
            let other = side(d, b, a);
            prop_assert!((one > 0.0) == (other < 0.0) && (one < 0.0) == (other > 0.0), "{one} {other}");
        }
    }

    #[test]
    fn a_face_is_seen_from_both_sides_and_not_from_its_plane() {
        let mesh =
            TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, vec3(0.0, 1.0, 0.0)], vec![[0, 1, 2]]).unwrap();
        let d = dvec3(0.0, 0.0, 1.0);
        for z in [-2.0, 2.0] {
            let cone = Cone::new(&mesh, 0, dvec3(0.25, 0.25, z)).unwrap();
            assert!(cone.contains(-d * z) && !cone.contains(d * z));
            assert_eq!(cone.distance(-d * z), 1.0);
        }
        assert!(Cone::new(&mesh, 0, dvec3(0.25, 0.25, 0.0)).is_none());
        assert!(Cone::new(&mesh, 0, dvec3(9.0, 3.0, 0.0)).is_none());
    }

    #[test]
    fn an_edge_on_face_gives_a_distance_between_its_corners() {
        let mesh = TriMesh::from_faces(
            vec![vec3(1.0, 1.0, 0.0), vec3(5.0, 0.0, 0.0), vec3(1.0, -1.0, 0.0)],
            vec![[0, 1, 2]],
        )
        .unwrap();
        let cone = Cone::new(&mesh, 0, dvec3(0.0, 0.0, 1e-12)).unwrap();
        let d = dvec3(1.0, 0.0, -5e-13);
        assert!(cone.contains(d) && cone.plane.distance(d).is_none());
        assert!((cone.distance(d) - 2.0).abs() < 1e-4, "{}", cone.distance(d));
    }
}
