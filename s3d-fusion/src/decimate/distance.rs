//! Distances of points to segments and triangles.

use s3d_geom::glam::Vec3;

/// The squared distance of `p` to a triangle, and the weights of the corners at the nearest place.
///
/// Source: C. Ericson, "Real-Time Collision Detection", 2005, 5.1.5.
pub(super) fn to_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> (f32, [f32; 3]) {
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
    ((ap - weights[1] * ab - weights[2] * ac).length_squared(), weights)
}

/// The squared distance of `p` to a segment.
pub(super) fn to_segment(p: Vec3, [a, b]: [Vec3; 2]) -> f32 {
    let (ab, ap) = (b - a, p - a);
    let t = share(ab.dot(ap), ab.length_squared() - ab.dot(ap)).clamp(0.0, 1.0);
    (ap - t * ab).length_squared()
}

/// `part` of `part + rest`; 0 if both are.
fn share(part: f32, rest: f32) -> f32 {
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
            let place: Vec3 = corners.iter().zip(weights).map(|(c, w)| *c * w).sum();
            assert!(place.distance(truth.point) < 1e-4, "{p}");
        }
        assert_eq!(to_segment(vec3(2.0, 1.0, 0.0), [Vec3::ZERO, Vec3::X]), 2.0);
        assert_eq!(to_segment(vec3(0.5, 1.0, 0.0), [Vec3::ZERO, Vec3::X]), 1.0);
        assert_eq!(to_segment(Vec3::Y, [Vec3::ZERO, Vec3::ZERO]), 1.0);
    }
}
