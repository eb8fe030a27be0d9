//! A mesh and the tree over its faces.

mod blocks;
pub(crate) mod clusters;
pub(crate) mod tree;
pub(crate) mod wide;

use clusters::Clusters;
use glam::DVec3;
use rayon::prelude::*;
use s3d_geom::TriMesh;
use std::sync::OnceLock;
use tree::{FaceTree, Top};
use wide::WideTree;

/// A mesh with a bounding volume hierarchy over its faces. It is built once, and any number of threads can
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
    tree: FaceTree,
    clusters: Clusters,
    /// Made at the first call that needs it.
    wide: OnceLock<WideTree>,
    /// The largest absolute coordinate of a corner.
    extent: f64,
}

impl<'m> Scene<'m> {
    /// Builds the trees over blocks of faces on the threads of the current rayon pool, and joins them. The
    /// images do not depend on the tree.
    pub fn new(mesh: &'m TriMesh) -> Self {
        let blocks: Vec<(FaceTree, Clusters)> = blocks::blocks(mesh)
            .into_par_iter()
            .map(|faces| {
                let tree = FaceTree::new(mesh, &faces);
                let clusters = Clusters::new(mesh, &tree);
                (tree, clusters)
            })
            .collect();

        let top = Top::new(blocks.iter().map(|(tree, _)| tree.nodes[0]));
        let (trees, clusters): (Vec<_>, Vec<_>) = blocks.into_iter().unzip();
        let (tree, clusters) = rayon::join(|| FaceTree::join(&top, trees), || Clusters::join(&top, clusters));

        let bounds = mesh.aabb();
        let extent = f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
        Self { mesh, tree, clusters, wide: OnceLock::new(), extent }
    }

    /// The mesh.
    pub fn mesh(&self) -> &'m TriMesh {
        self.mesh
    }

    pub(crate) fn tree(&self) -> &FaceTree {
        &self.tree
    }

    pub(crate) fn wide(&self) -> &WideTree {
        self.wide.get_or_init(|| WideTree::new(self.mesh, &self.tree))
    }

    pub(crate) fn clusters(&self) -> &Clusters {
        &self.clusters
    }

    /// Returns a bound on the coordinates relative to `origin`. Rounding errors are small multiples of it.
    pub(crate) fn magnitude(&self, origin: DVec3) -> f64 {
        self.extent + origin.abs().max_element()
    }
}

impl std::fmt::Debug for Scene<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scene")
            .field("faces", &self.mesh.faces().len())
            .field("nodes", &self.tree.nodes.len())
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
            s.spawn(|| assert_eq!(scene.tree().faces, [0]));
        });
        assert_eq!(scene.magnitude(DVec3::new(0.0, -3.0, 1.0)), 4.0);
    }
}
