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
        faces: &[[u32; 3]],
        least_m2: f64,
    ) -> Result<Self, FusionError> {
        let mut pieces = DisjointSets::new(vertices.len());
        for [a, b, c] in faces {
            pieces.unite(*a, *b);
            pieces.unite(*a, *c);
        }
        let root = pieces.roots();
        let piece = |face: &[u32; 3]| root[face[0] as usize];
        let area = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| vertices[v as usize].position.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        // Faces side by side are mostly of one piece.
        let of_runs = |some: &[[u32; 3]]| -> Vec<(u32, f64)> {
            let runs = some.chunk_by(|a, b| piece(a) == piece(b));
            runs.map(|run| (piece(&run[0]), run.iter().map(area).sum())).collect()
        };
        let mut area_m2 = vec![0.0; vertices.len()];
        for (piece, area) in faces.par_chunks(FACES).flat_map_iter(of_runs).collect::<Vec<_>>() {
            area_m2[piece as usize] += area;
        }

        // Vertices keep their order. Each is one of a face.
        let is_kept = |piece: u32| area_m2[piece as usize] >= least_m2;
        let (mut new_of, mut count) = (Vec::with_capacity(vertices.len()), 0);
        for piece in &root {
            new_of.push(count);
            count += u32::from(is_kept(*piece));
        }
        let kept = faces.par_iter().filter(|face| is_kept(piece(face)));
        let kept: Vec<_> = kept.map(|face| face.map(|v| new_of[v as usize])).collect();
        if kept.is_empty() {
            return Err(FusionError::NoSurface);
        }

        let dropped_faces = faces.len() - kept.len();
        let of_kept = vertices.par_iter().zip(&root).filter(|(_, piece)| is_kept(**piece));
        let (positions, mut colors): (Vec<_>, Vec<_>) = of_kept.map(|(v, _)| (v.position, v.color)).unzip();
        if colors.par_iter().all(|color| *color == [0; 3]) {
            colors.clear();
        }
        let unknown = colors.par_iter_mut().filter(|color| **color == [0; 3]);
        unknown.for_each(|color| *color = DEFAULT_COLOR);
        Ok(Self { positions, faces: kept, colors, dropped_faces })
    }
}
