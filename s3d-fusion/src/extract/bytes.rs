//! A surface as bytes, so that a caller can keep the surfaces of tiles in files.

use super::samples::Vertex;
use super::surface::Surface;
use s3d_geom::glam::Vec3;

/// The first bytes, with the version of what follows.
const HEAD: [u8; 8] = *b"s3dsurf1";
/// The bytes before the vertices: the head, the size of a cell and the numbers of vertices and faces.
const START: usize = 32;
/// The bytes of a vertex: its key, its position and its colour.
const VERTEX: usize = 8 + 12 + 3;
/// The bytes of a face: its cell and its vertices.
const FACE: usize = 8 + 12;

impl Surface {
    /// Returns the surface as bytes, little-endian, for [`Surface::from_bytes`] of the same version.
    ///
    /// ```
    /// # use s3d_fusion::{Fusion, FusionOptions, Surface};
    /// let empty = Fusion::new(FusionOptions::default())?.surface();
    /// assert_eq!(Surface::from_bytes(&empty.to_bytes()), Some(empty));
    /// # Ok::<(), s3d_fusion::FusionError>(())
    /// ```
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(START + VERTEX * self.vertices.len() + FACE * self.faces.len());
        bytes.extend(HEAD);
        bytes.extend(self.cell_m.to_le_bytes());
        bytes.extend((self.vertices.len() as u64).to_le_bytes());
        bytes.extend((self.faces.len() as u64).to_le_bytes());
        for Vertex { key, position, color } in &self.vertices {
            bytes.extend(key.to_le_bytes());
            position.to_array().iter().for_each(|p| bytes.extend(p.to_le_bytes()));
            bytes.extend(color);
        }
        for (cell, face) in &self.faces {
            bytes.extend(cell.to_le_bytes());
            face.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        }
        bytes
    }

    /// Returns the surface of bytes that [`Surface::to_bytes`] made; `None` if they are something else.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (head, rest) = bytes.split_at_checked(START)?;
        let [vertices, faces] = [16, 24].map(|at| u64::from_le_bytes(part(head, at)));
        let of_vertices = usize::try_from(vertices).ok()?.checked_mul(VERTEX)?;
        let of_faces = usize::try_from(faces).ok()?.checked_mul(FACE)?;
        if part(head, 0) != HEAD || of_vertices.checked_add(of_faces) != Some(rest.len()) {
            return None;
        }

        let (of_vertices, of_faces) = rest.split_at(of_vertices);
        let vertex = |b: &[u8]| Vertex {
            key: u64::from_le_bytes(part(b, 0)),
            position: Vec3::from_array([8, 12, 16].map(|at| f32::from_le_bytes(part(b, at)))),
            color: part(b, 20),
        };
        let face = |b: &[u8]| {
            (u64::from_le_bytes(part(b, 0)), [8, 12, 16].map(|at| u32::from_le_bytes(part(b, at))))
        };
        let surface = Self {
            cell_m: f64::from_le_bytes(part(head, 8)),
            vertices: of_vertices.chunks_exact(VERTEX).map(vertex).collect(),
            faces: of_faces.chunks_exact(FACE).map(face).collect(),
        };
        let is_vertex = |v: &u32| u64::from(*v) < vertices;
        surface
            .faces
            .iter()
            .all(|(_, face)| face.iter().all(is_vertex))
            .then_some(surface)
    }
}

/// The bytes from `at`, which are there.
fn part<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    std::array::from_fn(|i| bytes[at + i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_comes_back_and_other_bytes_do_not() {
        let vertex = |key: u64| Vertex { key, position: Vec3::new(1.5, -2.0, key as f32), color: [1, 2, 3] };
        let surface =
            Surface { cell_m: 0.01, vertices: (0..3).map(vertex).collect(), faces: vec![(7, [0, 2, 1])] };
        let bytes = surface.to_bytes();
        assert_eq!(Surface::from_bytes(&bytes), Some(surface));
        for length in 0..bytes.len() {
            assert_eq!(Surface::from_bytes(&bytes[..length]), None, "{length}");
        }
        for at in [0, 16, 24, bytes.len() - 1] {
            let mut wrong = bytes.clone();
            wrong[at] ^= 0xff;
            assert_eq!(Surface::from_bytes(&wrong), None, "{at}");
        }
    }
}
