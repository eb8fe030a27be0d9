//! Which points a closed surface encloses.

use super::wide::count_hits;
use crate::scene::Scene;
use glam::DVec3;

/// Directions that no wall, floor or diagonal of a building runs along.
const DIRECTIONS: [DVec3; 3] = [
    DVec3::new(0.357_214, 0.812_907, 0.459_913),
    DVec3::new(-0.763_519, 0.318_664, -0.561_741),
    DVec3::new(0.481_937, -0.567_153, 0.667_879),
];

/// Returns whether each point is enclosed by the mesh: whether a ray from it meets an odd number of faces.
/// Three rays decide by majority, since a ray through an edge meets both of its faces. Faces may be turned
/// either way. Uses the threads of the current rayon pool.
///
/// The answer means something only if the mesh [is closed](s3d_geom::TriMesh::is_closed). A point that is not
/// finite is not enclosed.
///
/// ```
/// use s3d_geom::{TriMesh, glam::{DVec3, Vec3}};
/// use s3d_render::{Scene, are_inside};
///
/// let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
/// let tetrahedron = TriMesh::from_faces(corners, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
/// let scene = Scene::new(&tetrahedron);
/// assert_eq!(are_inside(&scene, &[DVec3::splat(0.1), DVec3::splat(0.5)]), [true, false]);
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub fn are_inside(scene: &Scene<'_>, points: &[DVec3]) -> Vec<bool> {
    let mut odd = vec![0; points.len()];
    for direction in DIRECTIONS {
        let counts = count_hits(scene, points, &vec![direction; points.len()]);
        odd.iter_mut().zip(counts).for_each(|(odd, count)| *odd += count % 2);
    }
    odd.into_iter().map(|odd| odd >= 2).collect()
}
