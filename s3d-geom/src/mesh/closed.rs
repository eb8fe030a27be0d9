//! Whether a mesh encloses a volume.

use crate::TriMesh;
use glam::Vec3;
use rayon::prelude::*;

impl TriMesh {
    /// Counts the edges at which the surface ends: an odd number of faces meets there. Vertices at the same
    /// place are one.
    pub fn open_edges(&self) -> usize {
        // Each place in space has a number.
        let mut places: Vec<[u32; 3]> = self.positions().par_iter().map(|p| bits(*p)).collect();
        places.par_sort_unstable();
        places.dedup();
        let place_of: Vec<u64> = self
            .positions()
            .par_iter()
            .map(|p| places.partition_point(|place| *place < bits(*p)) as u64)
            .collect();

        let mut edges: Vec<(u64, u64)> = self
            .faces()
            .par_iter()
            .flat_map_iter(|face| {
                let [a, b, c] = face.map(|corner| place_of[corner as usize]);
                [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to)))
            })
            .collect();
        edges.par_sort_unstable();
        edges
            .chunk_by(|a, b| a == b)
            .filter(|faces| faces.len() % 2 == 1)
            .count()
    }

    /// Returns whether the surface has no [open edge](Self::open_edges), so that it encloses a volume.
    pub fn is_closed(&self) -> bool {
        self.open_edges() == 0
    }
}

/// Returns a position as bits that are equal for equal places. 0 and −0 are equal.
fn bits(position: Vec3) -> [u32; 3] {
    position.to_array().map(|c| (c + 0.0).to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn a_tetrahedron_is_closed_also_with_vertices_of_its_faces() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let shared = TriMesh::from_faces(corners.to_vec(), faces.to_vec()).unwrap();
        assert!(shared.is_closed());

        // −0 is the same place as 0.
        let mut own: Vec<Vec3> = faces.iter().flatten().map(|i| corners[*i as usize]).collect();
        own[0] = vec3(-0.0, -0.0, 0.0);
        let own_faces: Vec<[u32; 3]> = (0..4).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        assert!(TriMesh::from_faces(own, own_faces).unwrap().is_closed());

        let open = TriMesh::from_faces(corners.to_vec(), faces[..3].to_vec()).unwrap();
        assert_eq!((open.open_edges(), open.is_closed()), (3, false));
    }
}
