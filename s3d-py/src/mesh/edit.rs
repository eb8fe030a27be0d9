//! Meshes that are made of meshes, and meshes as files.

use super::{IN_MEMORY, Mesh};
use crate::error::{exception, usage};
use crate::work::detached;
use pyo3::prelude::*;
use s3d_dataset::Error;
use s3d_geom::glam::{DAffine3, DMat3, DVec3};
use s3d_geom::{MeshError, MeshParts, TriMesh};
use s3d_io::Error as FileError;
use s3d_io::mesh::{MeshFile, MeshOut, write_ply_mesh, write_textured_glb};
use std::path::PathBuf;
use std::sync::Arc;

/// The faces of several meshes, in their order.
#[pyfunction]
pub(crate) fn merged(py: Python<'_>, meshes: Vec<Bound<'_, Mesh>>) -> PyResult<Mesh> {
    let files: Vec<Arc<MeshFile>> = meshes.iter().map(|mesh| Arc::clone(&mesh.get().file)).collect();
    made(py, || {
        let parts = files
            .iter()
            .map(|file| MeshParts { face_tags: Vec::new(), ..file.mesh.parts().clone() });
        let mut parts = MeshParts::merge(parts);
        parts.face_tags = (0..parts.faces.len() as u32).collect();
        TriMesh::new(parts)
    })
}

/// A mesh after a transform, 4 × 4, of its positions.
#[pyfunction]
pub(crate) fn transformed(py: Python<'_>, mesh: &Bound<'_, Mesh>, matrix: [[f64; 4]; 4]) -> PyResult<Mesh> {
    let column = |k: usize| DVec3::new(matrix[0][k], matrix[1][k], matrix[2][k]);
    let linear = DMat3::from_cols(column(0), column(1), column(2));
    let is_affine = matrix[3] == [0.0, 0.0, 0.0, 1.0] && matrix.as_flattened().iter().all(|m| m.is_finite());
    if !is_affine || linear.determinant() == 0.0 {
        return Err(usage("matrix: an affine transform that is no projection: its last row is 0 0 0 1"));
    }

    let file = Arc::clone(&mesh.get().file);
    made(py, || {
        let transform = DAffine3::from_mat3_translation(linear, column(3));
        let parts = MeshParts { face_tags: file.source_faces.clone(), ..file.mesh.parts().clone() };
        TriMesh::new(parts)?.transformed(&transform)
    })
}

/// A mesh of some faces, ascending, with the vertices that they use.
#[pyfunction]
pub(crate) fn with_faces(py: Python<'_>, mesh: &Bound<'_, Mesh>, faces: Vec<u32>) -> PyResult<Mesh> {
    let file = Arc::clone(&mesh.get().file);
    let count = file.mesh.faces().len();
    if let Some(face) = faces.iter().find(|face| **face as usize >= count) {
        return Err(usage(format!("faces: {face}, and there are {count}")));
    }
    made(py, || {
        let mut parts = file.mesh.with_faces(&faces)?.into_parts();
        parts.face_tags = faces
            .iter()
            .filter_map(|&face| file.source_faces.get(face as usize))
            .copied()
            .collect();
        TriMesh::new(parts)
    })
}

/// Writes a mesh as a GLB file with its textures, or as a PLY file with the colours of its vertices.
#[pyfunction]
pub(crate) fn save_mesh(py: Python<'_>, mesh: &Bound<'_, Mesh>, path: PathBuf) -> PyResult<()> {
    let file = Arc::clone(&mesh.get().file);
    let is = |ending: &str| path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending));
    let parts = file.mesh.parts();
    if is("ply") && !parts.textures.is_empty() {
        return Err(usage(format!("{}: PLY holds no textures: save it as .glb", path.display())));
    }
    let written = detached(py, None, || {
        if is("glb") {
            return write_textured_glb(&path, &file.mesh);
        }
        let out = MeshOut {
            positions: &parts.positions,
            faces: &parts.faces,
            colors: &parts.colors,
            ..MeshOut::default()
        };
        write_ply_mesh(&path, &out)
    })?;
    written.map(drop).map_err(|e| exception(&Error::from(e)))
}

/// Makes a mesh in memory. Its face tags are the numbers of its faces in their source.
fn made(py: Python<'_>, make: impl FnOnce() -> Result<TriMesh, MeshError> + Send) -> PyResult<Mesh> {
    let mesh = detached(py, None, make)?;
    let mut mesh =
        mesh.map_err(|source| exception(&FileError::Mesh { path: IN_MEMORY.into(), source }.into()))?;
    let source_faces = mesh.take_face_tags();
    let file = MeshFile { source_faces, ..MeshFile::in_memory(IN_MEMORY, mesh) };
    Ok(Mesh { file: Arc::new(file) })
}
