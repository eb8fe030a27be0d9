//! A mesh as plain columns, borrowed and checked.

use s3d_geom::glam::Vec3;
use thiserror::Error;

/// The columns of a mesh. World frame: metres, Z-up.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshColumns<'a> {
    /// The vertices.
    pub positions: &'a [Vec3],
    /// Three indices into `positions` per face, counter-clockwise seen from the front.
    pub faces: &'a [[u32; 3]],
    /// The colours of the vertices, sRGB: none, or one per vertex.
    pub colors: &'a [[u8; 3]],
}

/// The reason why columns are not a mesh.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ColumnsError {
    /// The column of colours is neither empty nor as long as the column of positions.
    #[error("{colors} colours for {vertices} vertices: give one colour per vertex, or none")]
    Colors {
        /// The number of colours.
        colors: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// A face names a vertex that does not exist.
    #[error("face {face} names vertex {vertex}, but there are only {vertices}: check the faces' indices")]
    OutOfRange {
        /// Index of the face, from 0.
        face: usize,
        /// The vertex that it names.
        vertex: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A vertex is NaN or infinite.
    #[error("vertex {vertex} is not finite: remove it, and the faces that use it")]
    NonFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
    },
    /// There are more faces or vertices than indices of 32 bits can number.
    #[error("{count} {what}: at most {most} fit; cut the mesh into parts")]
    TooMany {
        /// "faces" or "vertices".
        what: &'static str,
        /// Their number.
        count: usize,
        /// The largest number.
        most: usize,
    },
}

/// The largest number of faces or vertices: three corners of each face, and six points, have numbers of 32
/// bits.
const MOST: usize = (u32::MAX / 8) as usize;

impl MeshColumns<'_> {
    /// Checks lengths, indices and numbers.
    pub(crate) fn check(&self) -> Result<(), ColumnsError> {
        let vertices = self.positions.len();
        for (what, count) in [("faces", self.faces.len()), ("vertices", vertices)] {
            if count > MOST {
                return Err(ColumnsError::TooMany { what, count, most: MOST });
            }
        }
        if !self.colors.is_empty() && self.colors.len() != vertices {
            return Err(ColumnsError::Colors { colors: self.colors.len(), vertices });
        }

        let wrong = |face: &[u32; 3]| face.iter().copied().find(|&v| v as usize >= vertices);
        if let Some((face, vertex)) = (0..).zip(self.faces).find_map(|(i, f)| Some((i, wrong(f)?))) {
            return Err(ColumnsError::OutOfRange { face, vertex, vertices });
        }
        match self.positions.iter().position(|p| !p.is_finite()) {
            Some(vertex) => Err(ColumnsError::NonFinite { vertex }),
            None => Ok(()),
        }
    }
}
