//! What a mesh is asked for while it is labelled: colours, neighbours, the faces of a segment.

use crate::segments::{Segments, borders_of, mean_colors};
use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;

/// Colours, neighbours and segments of the faces of a mesh.
#[derive(Debug)]
pub(super) struct Surface {
    /// The mean colour of each face in Oklab.
    colors: Vec<Vec3>,
    neighbours: Lists,
    segments: Lists,
}

/// A list for each number from 0, one after the other.
#[derive(Debug)]
struct Lists {
    /// Where each list begins, and where the last one ends.
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Lists {
    /// Makes lists of pairs of a list and an entry. The entries of a list keep their order.
    fn of(count: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut starts = vec![0u32; count + 1];
        for (list, _) in pairs.clone() {
            starts[list as usize + 1] += 1;
        }
        for i in 0..count {
            starts[i + 1] += starts[i];
        }

        let mut next = starts.clone();
        let mut entries = vec![0; starts[count] as usize];
        for (list, entry) in pairs {
            let place = &mut next[list as usize];
            entries[*place as usize] = entry;
            *place += 1;
        }
        Self { starts, entries }
    }

    fn list(&self, number: u32) -> &[u32] {
        let [start, end] = [0, 1].map(|i| self.starts[number as usize + i] as usize);
        &self.entries[start..end]
    }
}

impl Surface {
    pub(super) fn new(mesh: &TriMesh, segments: &Segments) -> Self {
        let count = mesh.faces().len();
        let borders = borders_of(mesh);
        let both = borders.iter().flat_map(|&[a, b]| [(a, b), (b, a)]);
        let of_face = &segments.segment_of_face;
        let faces_of = of_face.iter().zip(0..).map(|(segment, face)| (*segment, face));
        Self {
            colors: mean_colors(mesh),
            neighbours: Lists::of(count, both),
            segments: Lists::of(segments.tree.leaf_count() as usize, faces_of),
        }
    }

    pub(super) fn color(&self, face: u32) -> Vec3 {
        self.colors[face as usize]
    }

    /// The faces with which a face shares an edge.
    pub(super) fn neighbours(&self, face: u32) -> &[u32] {
        self.neighbours.list(face)
    }

    /// The faces of a segment, ascending.
    pub(super) fn faces_of(&self, segment: u32) -> &[u32] {
        self.segments.list(segment)
    }
}
