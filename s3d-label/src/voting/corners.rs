//! The faces around a corner of a mesh.

use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;

/// An index of the faces that have a corner at a place: a sorted list, with 16 bytes for each corner of each
/// face.
#[derive(Clone, Debug)]
pub(crate) struct Corners {
    /// Pairs of the bits of the place of a corner, and a face; sorted, each pair once.
    faces: Vec<([u32; 3], u32)>,
}

impl Corners {
    pub(crate) fn new(mesh: &TriMesh) -> Self {
        let mut faces: Vec<([u32; 3], u32)> = Vec::with_capacity(3 * mesh.faces().len());
        for face in 0..mesh.faces().len() as u32 {
            faces.extend(mesh.triangle(face).map(|corner| (key(corner), face)));
        }
        faces.sort_unstable();
        faces.dedup();
        Self { faces }
    }

    /// Iterates over the faces that have a corner at exactly `position`, ascending.
    pub(crate) fn faces_at(&self, position: Vec3) -> impl Iterator<Item = u32> {
        let key = key(position);
        let start = self.faces.partition_point(|(k, _)| *k < key);
        self.faces
            .iter()
            .skip(start)
            .take_while(move |(k, _)| *k == key)
            .map(|(_, face)| *face)
    }
}

/// Returns the bits of a place. Adding 0 turns −0 into 0.
fn key(position: Vec3) -> [u32; 3] {
    (position + 0.0).to_array().map(f32::to_bits)
}
