//! The mesh of the zero level of a grid.

use crate::FusionError;
use s3d_geom::glam::Vec3;
use s3d_geom::{MeshError, MeshParts, TriMesh};

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
}

/// The surface of a grid or tile, before surfaces of tiles are joined.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    cell_m: f64,
}

impl Surface {
    /// Joins the surfaces of the tiles of a grid. The order of tiles does not matter.
    ///
    /// # Errors
    /// [`FusionError::OtherCells`].
    pub fn join(_tiles: Vec<Self>) -> Result<Self, FusionError> {
        todo!()
    }

    /// Returns the mesh, without pieces smaller than `least_piece_m2`.
    ///
    /// # Errors
    /// [`FusionError::NoSurface`].
    pub fn into_mesh(self, _least_piece_m2: f64) -> Result<FusedMesh, FusionError> {
        todo!()
    }
}
