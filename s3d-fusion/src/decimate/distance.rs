//! Distances of points to segments and triangles.
//!
//! Triangles are as long as a wall and as thin as a thousandth of it. Single precision is wrong there by
//! centimetres, so the work is in double precision.

use s3d_geom::glam::{DVec3, Vec3};

/// The squared distance of `p` to a triangle, and the weights of the corners at the nearest place.
///
/// Source: C. Ericson, "Real-Time Collision Detection", 2005, 5.1.5.
pub(super) fn to_triangle(p: Vec3, corners: [Vec3; 3]) -> (f32, [f32; 3]) {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let p = p.as_dvec3();
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let (bp, cp) = (p - b, p - c);
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    let (wa, wb, wc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);

    let weights = if d1 <= 0.0 && d2 <= 0.0 {
        [1.0, 0.0, 0.0]
    } else if d3 >= 0.0 && d4 <= d3 {
        [0.0, 1.0, 0.0]
    } else if d6 >= 0.0 && d5 <= d6 {
        [0.0, 0.0, 1.0]
    } else if wc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = share(d1, -d3);
        [1.0 - t, t, 0.0]
    } else if wb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = share(d2, -d6);
        [1.0 - t, 0.0, t]
    } else if wa <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = share(d4 - d3, d5 - d6);
        [0.0, 1.0 - t, t]
    } else {
        let sum = wa + wb + wc;
        let (v, w) = (wb / sum, wc / sum);
        [1.0 - v - w, v, w]
    };
    let squared = (ap - weights[1] * ab - weights[2] * ac).length_squared();
    (squared as f32, weights.map(|weight| weight as f32))
}

/// What tells quickly whether a place is above or below a triangle, and how far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// The first corner.
    origin: DVec3,
    /// What the weights of the second and third corner grow by with a step from the first corner.
    weights: [DVec3; 2],
    normal: DVec3,
}

impl Frame {
    /// The frame of a triangle that has an area.
    pub(super) fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let across = (b - a).cross(c - a);
        let inverse = across.length_squared().recip();
        let weights = [(c - a).cross(across) * inverse, across.cross(b - a) * inverse];
        Self { origin: a, weights, normal: across * inverse.sqrt() }
    }

    /// The squared distance of a place from the triangle, and the weights of the corners at the nearest
    /// place. `None` if the nearest place is on the rim.
    pub(super) fn above(&self, p: Vec3) -> Option<(f32, [f32; 3])> {
        let off = p.as_dvec3() - self.origin;
        let [v, w] = self.weights.map(|gradient| gradient.dot(off));
        let distance = self.normal.dot(off);
        let is_above = v > 0.0 && w > 0.0 && v + w < 1.0;
        is_above.then(|| ((distance * distance) as f32, [1.0 - v - w, v, w].map(|weight| weight as f32)))
    }
}

/// The squared distance of `p` to a segment.
pub(super) fn to_segment(p: Vec3, ends: [Vec3; 2]) -> f32 {
    let [a, b] = ends.map(Vec3::as_dvec3);
    let (ab, ap) = (b - a, p.as_dvec3() - a);
    let t = share(ab.dot(ap), ab.length_squared() - ab.dot(ap)).clamp(0.0, 1.0);
    (ap - t * ab).length_squared() as f32
}

/// `part` of `part + rest`; 0 if both are.
fn share(part: f64, rest: f64) -> f64 {
    let sum = part + rest;
    if sum > 0.0 { part / sum } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::vec3;
    use s3d_geom::{TriMesh, nearest_brute_force};

    #[test]
    fn distances_are_those_of_nearest_faces() {
        let corners = [vec3(0.1, 0.2, 0.0), vec3(1.3, -0.1, 0.4), vec3(0.5, 1.1, -0.2)];
        let mesh = TriMesh::from_faces(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
        for i in 0..1000u32 {
            let at = |n: u32| ((i * n) % 101) as f32 / 101.0 * 4.0 - 2.0;
            let p = vec3(at(17), at(29), at(53));
            let (squared, weights) = to_triangle(p, corners);
            let truth = nearest_brute_force(&mesh, p);
            assert!((squared.sqrt() - truth.distance_m).abs() < 1e-5, "{p}");
            match Frame::new(corners).above(p) {
                Some(above) => {
                    assert!((above.0 - squared).abs() < 1e-6, "{p}");
                    assert!(above.1.iter().zip(weights).all(|(a, b)| (a - b).abs() < 1e-6), "{p}");
                }
                None => assert!(weights.iter().any(|weight| *weight < 1e-6), "{p}"),
            }
            let place: Vec3 = corners.iter().zip(weights).map(|(c, w)| *c * w).sum();
            assert!(place.distance(truth.point) < 1e-4, "{p}");
        }

        // A sliver across a wall, and places 1 mm above it.
        let sliver = [vec3(0.01, 2.0, 0.0), vec3(4.97, 2.003, 2.61), vec3(2.4, 2.0045, 1.2566)];
        let normal = (sliver[1] - sliver[0]).cross(sliver[2] - sliver[0]).normalize();
        for i in 1..100 {
            let along = i as f32 / 100.0;
            let place = sliver[0].lerp(sliver[1], along).lerp(sliver[2], 0.3) + 0.001 * normal;
            for (squared, _) in [Some(to_triangle(place, sliver)), Frame::new(sliver).above(place)]
                .into_iter()
                .flatten()
            {
                assert!((squared.sqrt() - 0.001).abs() < 1e-5, "{along}: {}", squared.sqrt());
            }
        }
        assert_eq!(to_segment(vec3(2.0, 1.0, 0.0), [Vec3::ZERO, Vec3::X]), 2.0);
        assert_eq!(to_segment(vec3(0.5, 1.0, 0.0), [Vec3::ZERO, Vec3::X]), 1.0);
        assert_eq!(to_segment(Vec3::Y, [Vec3::ZERO, Vec3::ZERO]), 1.0);
    }
}
