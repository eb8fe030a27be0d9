//! Writes the mesh whose materials are labels.

#![expect(clippy::indexing_slicing, reason = "a writer: SemanticObj::new checks the labels")]

use super::statement::{Y_UP, write_face, write_material, write_positions};
use crate::error::Result;
use crate::fs::atomic::write_whole;
use s3d_geom::TriMesh;
use s3d_label::pretty_color;
use std::io::{self, Write};
use std::path::Path;

/// A mesh whose materials are the labels of its faces, as the files `semantic.obj` and `semantic.mtl`.
#[derive(Clone, Copy, Debug)]
pub struct SemanticObj<'a> {
    mesh: &'a TriMesh,
    label_of_face: &'a [u32],
    names: &'a [String],
}

impl<'a> SemanticObj<'a> {
    /// Prepares the files of `mesh`. The material of a face has the name of its label,
    /// `names[label_of_face[face]]`, and the colour of [`pretty_color`].
    ///
    /// # Panics
    /// If `label_of_face` does not have one entry for each face, or has one that is no index into `names`.
    pub fn new(mesh: &'a TriMesh, label_of_face: &'a [u32], names: &'a [String]) -> Self {
        let count = mesh.faces().len();
        assert_eq!(label_of_face.len(), count, "{count} faces need as many labels");
        for &label in label_of_face {
            assert!((label as usize) < names.len(), "label {label} of {}", names.len());
        }
        Self { mesh, label_of_face, names }
    }

    /// Writes the content of `semantic.mtl`: the labels that faces have.
    ///
    /// # Errors
    /// Returns the errors of `w`.
    pub fn write_mtl(&self, w: &mut dyn Write) -> io::Result<()> {
        let mut used = vec![false; self.names.len()];
        for &label in self.label_of_face {
            used[label as usize] = true;
        }

        for ((label, name), _) in (0u32..).zip(self.names).zip(&used).filter(|(_, used)| **used) {
            write_material(w, name, pretty_color(label), None)?;
        }
        Ok(())
    }

    /// Writes the content of `semantic.obj`, which names `semantic.mtl` as its library.
    ///
    /// # Errors
    /// Returns the errors of `w`.
    pub fn write_obj(&self, w: &mut dyn Write) -> io::Result<()> {
        writeln!(w, "{Y_UP}; materials are labels")?;
        writeln!(w, "mtllib semantic.mtl")?;
        write_positions(w, self.mesh)?;

        let mut current = None;
        for (corners, &label) in self.mesh.faces().iter().zip(self.label_of_face) {
            if current != Some(label) {
                current = Some(label);
                writeln!(w, "usemtl {}", self.names[label as usize])?;
            }
            write_face(w, corners, None, None)?;
        }
        Ok(())
    }
}

/// Writes the files of a [`SemanticObj`] into the folder `dir`, which must exist. Returns their size in
/// bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// Like [`SemanticObj::new`].
pub fn write_semantic_obj(
    dir: &Path,
    mesh: &TriMesh,
    label_of_face: &[u32],
    names: &[String],
) -> Result<u64> {
    let files = SemanticObj::new(mesh, label_of_face, names);
    let mtl = write_whole(&dir.join("semantic.mtl"), |w| files.write_mtl(w))?;
    Ok(mtl + write_whole(&dir.join("semantic.obj"), |w| files.write_obj(w))?)
}
