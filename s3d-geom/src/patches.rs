//! Connected faces.

use crate::{DisjointSets, TriMesh};
use std::collections::{BTreeMap, HashMap};
use std::hash::Hash;

/// Returns the connected patches among `faces`: lists of places in `faces`, in the order of their first
/// faces.
///
/// Two faces are connected if they have the same key and share a corner. Corners are the same if their
/// coordinates are equal.
///
/// ```
/// use s3d_geom::{TriMesh, face_patches, glam::Vec3};
///
/// let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE, 2.0 * Vec3::ONE, 3.0 * Vec3::Z];
/// let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2], [3, 4, 5], [2, 1, 3], [0, 1, 3]])?;
/// assert_eq!(face_patches(&mesh, &[(0, 'a'), (1, 'a'), (3, 'b')]), [[0], [1], [2]]);
/// assert_eq!(face_patches(&mesh, &[(0, 'a'), (1, 'a'), (2, 'a')]), [[0, 1, 2]]);
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
///
/// # Panics
/// If the mesh does not have one of `faces`.
pub fn face_patches<K: Copy + Eq + Hash>(mesh: &TriMesh, faces: &[(u32, K)]) -> Vec<Vec<usize>> {
    // The root of a patch is its first face.
    let mut patches = DisjointSets::new(faces.len());
    let mut at_corner: HashMap<([u32; 3], K), u32> = HashMap::new();
    for (place, (face, key)) in (0..).zip(faces) {
        for corner in mesh.triangle(*face) {
            // Adding 0 turns −0 into 0.
            let corner = (corner + 0.0).to_array().map(f32::to_bits);
            patches.unite(place, *at_corner.entry((corner, *key)).or_insert(place));
        }
    }

    let mut members: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (place, root) in patches.roots().into_iter().enumerate() {
        members.entry(root).or_default().push(place);
    }
    members.into_values().collect()
}
