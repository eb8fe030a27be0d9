//! The mesh without small pieces.

use super::samples::Vertex;
use crate::FusionError;
use rayon::prelude::*;
use s3d_geom::glam::Vec3;
use s3d_geom::{DEFAULT_COLOR, DisjointSets, MeshError, MeshParts, TriMesh};

/// So many faces are measured at a time.
const FACES: usize = 1 << 16;

/// A mesh that was fused from ranges: world metres, Z-up. Fronts are on the side from which they were seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FusedMesh {
    /// The positions of the vertices.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` per face.
    pub faces: Vec<[u32; 3]>,
    /// Colours R G B of the vertices; empty if no image had colours. What no image with colours saw is grey.
    pub colors: Vec<[u8; 3]>,
    /// The number of faces that were left out because their piece was too small.
    pub dropped_faces: usize,
}

impl FusedMesh {
    /// Turns the mesh into one that the other crates read.
    ///
    /// # Errors
    /// [`MeshError`] if there is no face.
    pub fn into_tri_mesh(self) -> Result<TriMesh, MeshError> {
        let Self { positions, faces, colors, .. } = self;
        TriMesh::new(MeshParts { positions, faces, colors, ..MeshParts::default() })
    }

    /// Makes a mesh of the pieces that have enough surface.
    pub(super) fn of_pieces(
        vertices: &[Vertex],
        mut faces: Vec<[u32; 3]>,
        least_m2: f64,
    ) -> Result<Self, FusionError> {
        let mut pieces = DisjointSets::new(vertices.len());
        for [a, b, c] in &faces {
            pieces.unite(*a, *b);
            pieces.unite(*a, *c);
        }
        let root = pieces.roots();
        let area = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| vertices[v as usize].position.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        let mut area_m2 = vec![0.0; vertices.len()];
        for some in faces.chunks(FACES) {
            let areas: Vec<f64> = some.par_iter().map(area).collect();
            for (face, area) in some.iter().zip(areas) {
                area_m2[root[face[0] as usize] as usize] += area;
            }
        }

        let count = faces.len();
        faces.retain(|face| area_m2[root[face[0] as usize] as usize] >= least_m2);
        if faces.is_empty() {
            return Err(FusionError::NoSurface);
        }

        // Vertices keep their order.
        let mut new_of = vec![0; vertices.len()];
        faces.iter().flatten().for_each(|v| new_of[*v as usize] = 1);
        let mut kept = Vec::new();
        for (vertex, new) in vertices.iter().zip(&mut new_of) {
            let is_used = *new == 1;
            *new = kept.len() as u32;
            if is_used {
                kept.push(*vertex);
            }
        }
        faces.iter_mut().flatten().for_each(|v| *v = new_of[*v as usize]);

        let dropped_faces = count - faces.len();
        let positions = kept.iter().map(|v| v.position).collect();
        let known = |color: [u8; 3]| if color == [0; 3] { DEFAULT_COLOR } else { color };
        let colors = if kept.iter().any(|v| v.color != [0; 3]) {
            kept.iter().map(|v| known(v.color)).collect()
        } else {
            Vec::new()
        };
        Ok(Self { positions, faces, colors, dropped_faces })
    }
}
