//! A mesh and the tree over its faces.

use crate::raster::clusters::Clusters;
use glam::DVec3;
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb, bvh2::Bvh2, bvh2::builder::build_bvh2};
use s3d_geom::TriMesh;
use std::time::Duration;

/// A mesh with a bounding volume hierarchy over its faces: built once, shared by any number of threads that
/// render it.
///
/// ```
/// use s3d_geom::{TriMesh, glam::{DVec3, dvec3, vec3}};
/// use s3d_render::{Scene, cast_ray};
///
/// let corners = vec![vec3(-1.0, 2.0, 0.0), vec3(1.0, 2.0, 0.0), vec3(0.0, 2.0, 3.0)];
/// let wall = TriMesh::from_faces(corners, vec![[0, 1, 2]])?;
/// let scene = Scene::new(&wall);
/// let hit = cast_ray(&scene, dvec3(0.0, 0.0, 1.0), DVec3::Y).expect("the wall is ahead");
/// assert_eq!((hit.face, hit.t), (0, 2.0));
/// assert!(cast_ray(&scene, dvec3(0.0, 0.0, 1.0), DVec3::X).is_none());
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub struct Scene<'m> {
    mesh: &'m TriMesh,
    /// Boxes are exact unions of `f32` corners; every test against them allows for its own rounding.
    bvh: Bvh2,
    clusters: Clusters,
    /// The largest absolute coordinate of a corner.
    extent: f64,
}

struct FaceBox(Aabb);

impl Boundable for FaceBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl<'m> Scene<'m> {
    /// Builds the tree over the faces of `mesh`.
    pub fn new(mesh: &'m TriMesh) -> Self {
        let boxes: Vec<FaceBox> = (0..mesh.faces().len() as u32)
            .map(|face| FaceBox(Aabb::from_points(&mesh.triangle(face).map(Into::into))))
            .collect();
        // Small leaves: a face costs more than a box here.
        let params = BvhBuildParams { max_prims_per_leaf: 4, ..BvhBuildParams::fast_build() };
        let bvh = build_bvh2(&boxes, params, &mut Duration::default());
        let b = mesh.aabb();
        let extent = f64::from(b.min.abs().max(b.max.abs()).max_element());
        let clusters = Clusters::new(mesh, &bvh);
        Self { mesh, bvh, clusters, extent }
    }

    /// The mesh.
    pub fn mesh(&self) -> &'m TriMesh {
        self.mesh
    }

    pub(crate) fn bvh(&self) -> &Bvh2 {
        &self.bvh
    }

    pub(crate) fn clusters(&self) -> &Clusters {
        &self.clusters
    }

    /// A bound on the coordinates in play, seen from `origin`: rounding errors are small multiples of it.
    pub(crate) fn magnitude(&self, origin: DVec3) -> f64 {
        self.extent + origin.abs().max_element()
    }
}

impl std::fmt::Debug for Scene<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scene")
            .field("faces", &self.mesh.faces().len())
            .field("nodes", &self.bvh.nodes.len())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn one_face_makes_a_scene_that_threads_share() {
        let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let scene = Scene::new(&mesh);
        std::thread::scope(|s| {
            s.spawn(|| assert_eq!(scene.bvh().primitive_indices, [0]));
        });
        assert_eq!(scene.magnitude(DVec3::new(0.0, -3.0, 1.0)), 4.0);
    }
}
