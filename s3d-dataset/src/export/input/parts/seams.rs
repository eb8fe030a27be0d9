//! Where parts overlap, the earlier one stays: two surfaces a few millimetres apart would take turns in
//! images, and get twice the points.

use rayon::prelude::*;
use s3d_geom::{NearestFaces, TriMesh};

/// A face whose corners and middle are all within this distance of earlier parts lies on them, metres.
const NEAR_M: f32 = 0.03;
/// The surfaces look the same way there: the least cosine.
const SAME_WAY: f32 = 0.5;

/// Returns the faces of a part that do not lie on the parts before it, ascending; `None` if these are all.
pub(super) fn faces_beside(part: &TriMesh, earlier: &TriMesh) -> Option<Vec<u32>> {
    let room = earlier.aabb();
    let nearest_faces = NearestFaces::new(earlier);
    let lies_on = |face: u32| {
        let corners = part.triangle(face);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let normal = part.normal(face);
        [corners[0], corners[1], corners[2], middle].into_iter().all(|point| {
            let is_near = (room.min - point).max(point - room.max).max_element() < NEAR_M;
            is_near && {
                let nearest = nearest_faces.nearest(point);
                nearest.distance_m < NEAR_M && earlier.normal(nearest.face).dot(normal) > SAME_WAY
            }
        })
    };
    let count = part.faces().len() as u32;
    let beside: Vec<u32> = (0..count).into_par_iter().filter(|face| !lies_on(*face)).collect();
    (beside.len() < count as usize).then_some(beside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, vec3};
    use s3d_geom::MeshParts;
    use s3d_geom::primitives::grid;

    /// A floor of 2 m × 1 m, whose faces are 50 cm wide, from `x` at height `z`.
    fn floor(x: f32, z: f32) -> MeshParts {
        grid(vec3(x, 0.0, z), 2.0 * Vec3::X, Vec3::Y, [4, 2])
    }

    #[test]
    fn what_earlier_parts_show_is_left_out() {
        let earlier = TriMesh::new(floor(0.0, 0.0)).unwrap();
        // Half of it lies on the earlier floor, 5 mm above.
        let part = TriMesh::new(floor(1.0, 0.005)).unwrap();
        let beside = faces_beside(&part, &earlier).unwrap();
        assert_eq!(beside.len(), part.faces().len() / 2);
        assert!(beside.iter().all(|f| part.triangle(*f).iter().any(|p| p.x > 2.1)));

        // A ceiling below it looks the other way, and what is 10 cm above is another surface.
        let mut ceiling = floor(0.0, -0.01);
        ceiling.flip();
        for other in [ceiling, floor(0.0, 0.1), floor(5.0, 0.0)] {
            assert_eq!(faces_beside(&TriMesh::new(other).unwrap(), &earlier), None);
        }
        assert_eq!(faces_beside(&earlier.clone(), &earlier), Some(Vec::new()));
        assert!(earlier.normal(0).abs_diff_eq(Vec3::Z, 1e-6));
    }
}
