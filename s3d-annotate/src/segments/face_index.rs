//! The colours of faces, and the faces of segments.

use super::lists::Lists;
use super::looks::mean_colors;
use super::{MergeTree, Segments};
use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;

/// The colours of the faces of a mesh, and the faces of its segments. A workbench and a review share one. It
/// takes 16 bytes a face.
#[derive(Debug)]
pub struct FaceIndex {
    colors: Vec<Vec3>,
    faces: Lists,
}

impl FaceIndex {
    /// Looks at a mesh and its segments.
    ///
    /// # Panics
    /// If the segments are of a mesh with another number of faces.
    pub fn new(mesh: &TriMesh, segments: &Segments) -> Self {
        assert_eq!(segments.segment_of_face.len(), mesh.faces().len(), "each face has a segment");
        let faces = segments.segment_of_face.iter().zip(0..);
        let faces = faces.map(|(segment, face)| (*segment, face));
        Self { colors: mean_colors(mesh), faces: Lists::of(segments.tree.leaf_count() as usize, faces) }
    }

    /// Returns the mean colour of a face in Oklab.
    pub(crate) fn color(&self, face: u32) -> Vec3 {
        self.colors[face as usize]
    }

    /// Returns the faces of a segment, ascending.
    pub(crate) fn faces_of(&self, segment: u32) -> &[u32] {
        self.faces.list(segment)
    }

    /// Iterates over the faces of a node, segment by segment.
    pub(crate) fn faces_of_node<'a>(
        &'a self,
        tree: &'a MergeTree,
        node: u32,
    ) -> impl Iterator<Item = u32> + 'a {
        let segments = tree.segments_of(node).iter();
        segments.flat_map(|segment| self.faces_of(*segment)).copied()
    }
}
