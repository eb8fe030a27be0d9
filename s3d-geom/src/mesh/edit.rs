//! Meshes that are made of a mesh: moved, or of some of its faces.

use crate::{MeshError, MeshParts, NO_INDEX, TriMesh};
use glam::{DAffine3, Vec3};
use rayon::prelude::*;

impl TriMesh {
    /// Returns the mesh after an affine transform. Normals of corners stay at right angles to the surface. A
    /// mirror turns faces over, so that their fronts stay fronts.
    ///
    /// # Errors
    /// [`MeshError`] if positions become infinite, or no face keeps an area.
    ///
    /// ```
    /// use s3d_geom::{MeshError, TriMesh, glam::{DAffine3, DVec3, Vec3, vec3}};
    ///
    /// let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
    /// let lifted = mesh.transformed(&DAffine3::from_translation(2.0 * DVec3::Z))?;
    /// assert_eq!(lifted.positions()[1], vec3(1.0, 0.0, 2.0));
    /// # Ok::<(), MeshError>(())
    /// ```
    pub fn transformed(self, by: &DAffine3) -> Result<Self, MeshError> {
        let mut parts = self.into_parts();
        let of_normals = by.matrix3.inverse().transpose();
        parts.positions.par_iter_mut().for_each(|p| *p = moved_point(by, *p));
        parts
            .normals
            .par_iter_mut()
            .for_each(|n| *n = (of_normals * n.as_dvec3()).normalize_or_zero().as_vec3());
        if by.matrix3.determinant() < 0.0 {
            parts.flip();
        }
        Self::new(parts)
    }

    /// Returns a mesh of some faces, in the order of `faces`, with the vertices that they use. Textures and
    /// materials stay; tags of faces do not.
    ///
    /// # Errors
    /// [`MeshError::Empty`] if there is no face.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn with_faces(&self, faces: &[u32]) -> Result<Self, MeshError> {
        let parts = self.parts();
        let mut corners = rows(&parts.faces, faces);
        let mut number = vec![NO_INDEX; parts.positions.len()];
        corners.iter().flatten().for_each(|v| number[*v as usize] = 0);

        // Vertices keep their order.
        let mut kept: Vec<u32> = Vec::new();
        for (vertex, number) in (0..).zip(&mut number).filter(|(_, number)| **number == 0) {
            *number = kept.len() as u32;
            kept.push(vertex);
        }
        corners.iter_mut().flatten().for_each(|v| *v = number[*v as usize]);

        Self::new(MeshParts {
            positions: rows(&parts.positions, &kept),
            colors: rows(&parts.colors, &kept),
            faces: corners,
            uvs: parts.uvs.clone(),
            face_uvs: rows(&parts.face_uvs, faces),
            normals: parts.normals.clone(),
            face_normals: rows(&parts.face_normals, faces),
            materials: parts.materials.clone(),
            face_materials: rows(&parts.face_materials, faces),
            textures: parts.textures.clone(),
            face_tags: Vec::new(),
        })
    }
}

/// Moves a point. A vertex of a moved mesh lies exactly there.
pub fn moved_point(by: &DAffine3, point: Vec3) -> Vec3 {
    by.transform_point3(point.as_dvec3()).as_vec3()
}

/// The chosen rows of a column, which may be empty.
fn rows<T: Copy>(column: &[T], chosen: &[u32]) -> Vec<T> {
    if column.is_empty() {
        return Vec::new();
    }
    chosen.iter().map(|row| column[*row as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitives::cuboid;
    use glam::{DMat3, DVec3};

    #[test]
    fn a_mirrored_box_still_looks_outwards() {
        let mesh = TriMesh::new(cuboid(Vec3::ZERO, Vec3::ONE)).unwrap();
        let mirror = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(-2.0, 1.0, 1.0)));
        let mirrored = mesh.transformed(&mirror).unwrap();
        let middle = Vec3::new(-1.0, 0.5, 0.5);
        let outwards = |f| (mirrored.triangle(f)[0] - middle).dot(mirrored.normal(f)) > 0.0;
        assert!((0..12).all(outwards));
        assert_eq!(mirrored.aabb().min, Vec3::new(-2.0, 0.0, 0.0));
        let flat = DAffine3::from_scale(DVec3::ZERO);
        assert!(matches!(mirrored.transformed(&flat), Err(MeshError::Empty { .. })));
    }

    #[test]
    fn chosen_faces_bring_their_vertices_alone() {
        let mesh = TriMesh::new(cuboid(Vec3::ZERO, Vec3::ONE)).unwrap();
        let some = mesh.with_faces(&[7, 2]).unwrap();
        assert_eq!([some.triangle(0), some.triangle(1)], [mesh.triangle(7), mesh.triangle(2)]);
        assert!(some.positions().len() < mesh.positions().len());
        assert!(matches!(mesh.with_faces(&[]), Err(MeshError::Empty { .. })));
    }
}
