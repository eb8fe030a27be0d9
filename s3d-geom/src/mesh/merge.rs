//! Joining meshes.

use crate::{DEFAULT_COLOR, Material, MeshParts, MeshReport, NO_INDEX, TriMesh};

impl MeshParts {
    /// Appends the vertices, faces, materials and textures of `other`. Every face keeps its attributes.
    ///
    /// If only one of the two has a column, the column of the other is filled with [`NO_INDEX`]. A missing
    /// vertex colour becomes the colour of the last material among the faces at the vertex, or
    /// [`DEFAULT_COLOR`] if none has a material.
    pub fn append(&mut self, mut other: MeshParts) {
        if self.colors.is_empty() != other.colors.is_empty() {
            self.fill_colors();
            other.fill_colors();
        }

        let vertices = self.positions.len();
        let uvs = self.uvs.len();
        let normals = self.normals.len();
        let materials = self.materials.len();
        let textures = self.textures.len();
        let faces = [self.faces.len(), other.faces.len()];

        self.positions.append(&mut other.positions);
        self.colors.append(&mut other.colors);
        self.uvs.append(&mut other.uvs);
        self.normals.append(&mut other.normals);
        self.textures.append(&mut other.textures);

        self.materials.extend(
            other
                .materials
                .into_iter()
                .map(|m| Material { texture: m.texture.map(|t| shifted(t, textures)), ..m }),
        );
        self.faces
            .extend(other.faces.into_iter().map(|f| f.map(|v| shifted(v, vertices))));

        append_column(&mut self.face_uvs, other.face_uvs, faces, [NO_INDEX; 3], |corners| {
            corners.map(|uv| shifted(uv, uvs))
        });
        append_column(&mut self.face_normals, other.face_normals, faces, [NO_INDEX; 3], |corners| {
            corners.map(|normal| shifted(normal, normals))
        });
        append_column(&mut self.face_materials, other.face_materials, faces, NO_INDEX, |material| {
            shifted(material, materials)
        });
        append_column(&mut self.face_tags, other.face_tags, faces, NO_INDEX, |tag| tag);
    }

    /// Joins all `parts` in order, as [`MeshParts::append`] does.
    pub fn merge(parts: impl IntoIterator<Item = MeshParts>) -> Self {
        let mut all = Self::default();
        for part in parts {
            all.append(part);
        }
        all
    }

    /// Turns every face around, so that its front becomes its back. Corner normals do not change.
    pub fn flip(&mut self) {
        let columns = [&mut self.faces, &mut self.face_uvs, &mut self.face_normals];
        columns.into_iter().flatten().for_each(|corners| corners.swap(1, 2));
    }

    fn fill_colors(&mut self) {
        if !self.colors.is_empty() {
            return;
        }
        self.colors = vec![DEFAULT_COLOR; self.positions.len()];
        for (corners, &m) in self.faces.iter().zip(&self.face_materials) {
            if let Some(material) = self.materials.get(m as usize) {
                corners.iter().for_each(|&v| self.colors[v as usize] = material.color);
            }
        }
    }
}

impl TriMesh {
    /// Joins two meshes as [`MeshParts::append`] does, and adds up their reports.
    ///
    /// # Panics
    /// If the meshes together have 2³² − 1 or more vertices, texture coordinates, normals or faces.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        let [a, b] = [self.report(), other.report()];
        let lengths = |p: &MeshParts| [p.positions.len(), p.uvs.len(), p.normals.len(), p.faces.len()];
        for (n, more) in lengths(self.parts()).into_iter().zip(lengths(other.parts())) {
            assert!(n + more < NO_INDEX as usize, "{n} and {more} are more than 32 bits count");
        }

        let mut parts = self.into_parts();
        parts.append(other.into_parts());
        let report = MeshReport {
            zero_area_faces: a.zero_area_faces + b.zero_area_faces,
            non_finite_attributes: a.non_finite_attributes + b.non_finite_attributes,
        };
        Self::from_checked(parts, report)
    }
}

fn shifted(index: u32, offset: usize) -> u32 {
    if index == NO_INDEX {
        NO_INDEX
    } else {
        index + offset as u32
    }
}

fn append_column<T: Clone>(
    own: &mut Vec<T>,
    other: Vec<T>,
    faces: [usize; 2],
    missing: T,
    shift: impl Fn(T) -> T,
) {
    if own.is_empty() && other.is_empty() {
        return;
    }

    own.resize(faces[0], missing.clone());
    own.extend(other.into_iter().map(shift));
    own.resize(faces[0] + faces[1], missing);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitives::{cuboid, quad};
    use glam::Vec3;

    fn quad_with_sliver(x: f32) -> TriMesh {
        let mut parts = quad([Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y].map(|p| p + Vec3::X * x));
        parts.faces.push([0, 0, 1]);
        parts.face_uvs.push([NO_INDEX; 3]);
        TriMesh::new(parts).unwrap()
    }

    #[test]
    fn joined_meshes_keep_what_was_mended() {
        let a = quad_with_sliver(0.0);
        let b = quad_with_sliver(5.0);
        let all = a.clone().join(b.clone());
        assert_eq!((all.faces().len(), all.report().zero_area_faces), (4, 2));
        assert_eq!([all.triangle(1), all.triangle(2)], [a.triangle(1), b.triangle(0)]);
        TriMesh::new(all.into_parts()).unwrap();
    }

    #[test]
    fn a_flipped_box_looks_inwards() {
        let mut parts = cuboid(Vec3::ZERO, Vec3::ONE);
        let outside = TriMesh::new(parts.clone()).unwrap();
        parts.flip();
        let inside = TriMesh::new(parts).unwrap();
        assert!((0..12).all(|f| inside.normal(f) == -outside.normal(f)));
    }
}
