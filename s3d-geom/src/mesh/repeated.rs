//! Removing repeated faces.

use crate::{MeshParts, TriMesh};
use rayon::prelude::*;

impl TriMesh {
    /// Removes the faces that repeat an earlier one: the same three corners in space, in any order. Returns
    /// the mesh and the number of faces removed.
    ///
    /// Scans and two-sided models have such faces. A ray or a point always meets the earlier face first, and
    /// the sampler would draw twice as many points from the pair as from other surfaces.
    #[must_use]
    pub fn without_repeated_faces(self) -> (Self, usize) {
        let count = self.faces().len();
        let mut by_hash: Vec<(u64, u32)> = (0..count as u32)
            .into_par_iter()
            .map(|f| (hash(corners(&self, f)), f))
            .collect();
        by_hash.par_sort_unstable();

        let mut keep = vec![true; count];
        for group in by_hash.chunk_by(|a, b| a.0 == b.0) {
            // A group is almost always one face. If not, the corners decide, not the hashes.
            for (i, &(_, face)) in group.iter().enumerate() {
                keep[face as usize] = !group[..i]
                    .iter()
                    .any(|&(_, first)| corners(&self, first) == corners(&self, face));
            }
        }

        let repeated = keep.iter().filter(|k| !**k).count();
        if repeated == 0 {
            return (self, 0);
        }

        let report = self.report();
        let mut parts: MeshParts = self.into_parts();
        parts.keep_faces(&keep);
        (Self::from_checked(parts, report), repeated)
    }
}

/// Returns the corners of a face as bits, sorted: equal for faces with the same corners. 0 and −0 are
/// equal.
fn corners(mesh: &TriMesh, face: u32) -> [[u32; 3]; 3] {
    let mut corners = mesh.triangle(face).map(|p| p.to_array().map(|c| (c + 0.0).to_bits()));
    corners.sort_unstable();
    corners
}

fn hash(corners: [[u32; 3]; 3]) -> u64 {
    corners.as_flattened().iter().fold(0, mix)
}

fn mix(hash: u64, part: &u32) -> u64 {
    (hash ^ u64::from(*part))
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .rotate_left(29)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, vec3};

    #[test]
    fn the_first_of_equal_faces_stays() {
        // Face 1 is face 0 turned over. Face 3 is face 2 with vertices of its own. Face 4 only shares an
        // edge.
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, vec3(-0.0, 0.0, 0.0), Vec3::X, Vec3::Z];
        let faces = vec![[0, 1, 2], [2, 1, 0], [0, 1, 3], [5, 6, 4], [1, 2, 3]];
        let mut parts = MeshParts { positions, faces, ..MeshParts::default() };
        parts.face_materials = vec![0, 1, 2, 3, 4];
        parts.face_tags = vec![10, 11, 12, 13, 14];
        parts.materials = (0..5)
            .map(|i| crate::Material { name: i.to_string(), color: [i; 3], texture: None })
            .collect();
        let (mut mesh, repeated) = TriMesh::new(parts).unwrap().without_repeated_faces();
        assert_eq!(repeated, 2);
        assert_eq!(mesh.faces(), [[0, 1, 2], [0, 1, 3], [1, 2, 3]]);
        assert_eq!(mesh.take_face_tags(), [10, 12, 14]);
        assert_eq!((0..3).map(|f| mesh.material_of(f).unwrap()).collect::<Vec<_>>(), [0, 2, 4]);
    }
}
