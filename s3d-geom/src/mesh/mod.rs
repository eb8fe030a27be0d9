//! Textured triangle meshes, checked once, where they are made.

mod merge;
mod repeated;
pub(crate) mod texture;

pub use texture::{Texture, Wrap, sample_bilinear};

use crate::Aabb;
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use thiserror::Error;

/// In place of an index: this face (or corner) has none.
pub const NO_INDEX: u32 = u32::MAX;

/// The grey of faces that have neither texture, nor vertex colours, nor a material.
pub const DEFAULT_COLOR: [u8; 3] = [204; 3];

/// How a group of faces looks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Material {
    /// Its name in the file.
    pub name: String,
    /// Its colour where there is no texture, sRGB.
    pub color: [u8; 3],
    /// Which of the mesh's textures lies on it.
    pub texture: Option<u32>,
}

/// The columns of a mesh, before they are checked; see [`TriMesh::new`].
///
/// World frame: metres, Z-up, right-handed. A column that is not there is empty.
#[derive(Clone, Debug, Default)]
pub struct MeshParts {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` a face; counter-clockwise seen from the front.
    pub faces: Vec<[u32; 3]>,
    /// Vertex colours, sRGB: none, or one a position.
    pub colors: Vec<[u8; 3]>,
    /// Texture coordinates, (0, 0) at the bottom left of the image.
    pub uvs: Vec<Vec2>,
    /// Three indices into `uvs` a face, or [`NO_INDEX`] three times; none, or one a face.
    pub face_uvs: Vec<[u32; 3]>,
    /// Unit normals of corners.
    pub normals: Vec<Vec3>,
    /// Three indices into `normals` a face, or [`NO_INDEX`] three times; none, or one a face.
    pub face_normals: Vec<[u32; 3]>,
    /// The materials.
    pub materials: Vec<Material>,
    /// Which of `materials` a face has, or [`NO_INDEX`]; none, or one a face.
    pub face_materials: Vec<u32>,
    /// The textures.
    pub textures: Vec<Texture>,
    /// A number of the caller's for each face, such as its place in a file, by which columns of the caller's
    /// own can follow when faces are dropped; none, or one a face.
    pub face_tags: Vec<u32>,
}

/// What [`TriMesh::new`] mended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MeshReport {
    /// Faces of zero area, which were dropped.
    pub zero_area_faces: usize,
    /// Corner normals or texture coordinates that were not finite; their faces lost that attribute.
    pub non_finite_attributes: usize,
}

/// Why columns make no mesh.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// There is no face, or none with an area.
    #[error("the mesh has no face with an area ({faces} faces in the file)")]
    Empty {
        /// Faces before zero-area ones were dropped.
        faces: usize,
    },
    /// A used vertex is NaN or infinite.
    #[error("vertex {vertex} is not finite: {position}")]
    NonFinite {
        /// Index of the vertex, from 0.
        vertex: u32,
        /// Its position.
        position: Vec3,
    },
    /// An index points past its column.
    #[error("face {face} names {what} {index}, but there are only {count}")]
    OutOfRange {
        /// Index of the face, from 0.
        face: usize,
        /// The column: "vertex", "texture coordinate", "normal", "material" or "texture".
        what: &'static str,
        /// The index, from 0.
        index: u32,
        /// The column's length.
        count: usize,
    },
    /// A column has neither no entry nor one for each.
    #[error("{what}: {count} entries for {expected}")]
    Length {
        /// The column.
        what: &'static str,
        /// Its length.
        count: usize,
        /// The length of what it belongs to.
        expected: usize,
    },
}

/// Where a face takes its colour from.
#[derive(Clone, Copy, Debug)]
pub enum FaceColor<'a> {
    /// From a texture (its index in [`TriMesh::textures`]) at these coordinates of its corners.
    Texture(u32, &'a Texture, [Vec2; 3]),
    /// From the colours of its corners.
    Corners([[u8; 3]; 3]),
    /// One colour all over.
    Flat([u8; 3]),
}

/// A textured triangle mesh: at least one face, every face with an area, every index in range, every number
/// finite.
///
/// World frame: metres, Z-up, right-handed.
///
/// ```
/// use s3d_geom::{FaceColor, MeshError, MeshParts, TriMesh, glam::{Vec3, vec3}};
///
/// // Columns of three faces, of which the last has no area and is dropped.
/// let mesh = TriMesh::new(MeshParts {
///     positions: vec![Vec3::ZERO, Vec3::X, vec3(1.0, 1.0, 0.0), Vec3::Y],
///     faces: vec![[0, 1, 2], [0, 2, 3], [0, 0, 1]],
///     colors: vec![[255, 0, 0]; 4],
///     ..MeshParts::default()
/// })?;
/// assert_eq!((mesh.faces().len(), mesh.report().zero_area_faces), (2, 1));
/// assert_eq!((mesh.total_area(), mesh.normal(1)), (1.0, Vec3::Z));
/// assert!(matches!(mesh.color_of(0), FaceColor::Corners([[255, 0, 0], ..])));
///
/// let missing = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X], vec![[0, 1, 2]]);
/// assert!(matches!(missing, Err(MeshError::OutOfRange { index: 2, count: 2, .. })));
/// # Ok::<(), MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct TriMesh {
    parts: MeshParts,
    report: MeshReport,
}

impl TriMesh {
    /// Checks the columns, and drops the faces of zero area (exactly zero in `f64`: slivers stay).
    ///
    /// # Errors
    /// [`MeshError`] for an index out of range, a used vertex that is not finite, a column of the wrong
    /// length, or no face left.
    pub fn new(mut parts: MeshParts) -> Result<Self, MeshError> {
        let n = parts.faces.len();
        let length = |what, count: usize, expected| {
            if count == 0 || count == expected {
                Ok(())
            } else {
                Err(MeshError::Length { what, count, expected })
            }
        };
        length("vertex colours", parts.colors.len(), parts.positions.len())?;
        length("texture coordinates of faces", parts.face_uvs.len(), n)?;
        length("normals of faces", parts.face_normals.len(), n)?;
        length("materials of faces", parts.face_materials.len(), n)?;
        length("tags of faces", parts.face_tags.len(), n)?;

        let in_range = |face, what, index: u32, count: usize| {
            if (index as usize) < count {
                Ok(())
            } else {
                Err(MeshError::OutOfRange { face, what, index, count })
            }
        };
        for (f, corners) in parts.faces.iter().enumerate() {
            for &v in corners {
                in_range(f, "vertex", v, parts.positions.len())?;
                let position = parts.positions[v as usize];
                if !position.is_finite() {
                    return Err(MeshError::NonFinite { vertex: v, position });
                }
            }
        }
        for (what, columns, count) in [
            ("texture coordinate", &parts.face_uvs, parts.uvs.len()),
            ("normal", &parts.face_normals, parts.normals.len()),
        ] {
            for (f, corners) in columns.iter().enumerate() {
                if *corners != [NO_INDEX; 3] {
                    corners.iter().try_for_each(|&i| in_range(f, what, i, count))?;
                }
            }
        }
        for (f, &m) in parts.face_materials.iter().enumerate() {
            if m != NO_INDEX {
                in_range(f, "material", m, parts.materials.len())?;
                if let Some(t) = parts.materials[m as usize].texture {
                    in_range(f, "texture", t, parts.textures.len())?;
                }
            }
        }

        let mut report = MeshReport::default();
        for corners in &mut parts.face_uvs {
            if *corners != [NO_INDEX; 3] && corners.iter().any(|&i| !parts.uvs[i as usize].is_finite()) {
                *corners = [NO_INDEX; 3];
                report.non_finite_attributes += 1;
            }
        }
        for corners in &mut parts.face_normals {
            if *corners != [NO_INDEX; 3] && corners.iter().any(|&i| !parts.normals[i as usize].is_finite()) {
                *corners = [NO_INDEX; 3];
                report.non_finite_attributes += 1;
            }
        }

        let has_area: Vec<bool> = parts
            .faces
            .par_iter()
            .map(|f| area_vector(f.map(|v| parts.positions[v as usize])) != DVec3::ZERO)
            .collect();
        report.zero_area_faces = has_area.iter().filter(|&&keep| !keep).count();
        if report.zero_area_faces == n {
            return Err(MeshError::Empty { faces: n });
        }
        if report.zero_area_faces > 0 {
            keep_where(&mut parts.faces, &has_area);
            keep_where(&mut parts.face_uvs, &has_area);
            keep_where(&mut parts.face_normals, &has_area);
            keep_where(&mut parts.face_materials, &has_area);
            keep_where(&mut parts.face_tags, &has_area);
        }
        Ok(Self { parts, report })
    }

    /// A mesh of positions and faces alone.
    ///
    /// # Errors
    /// As [`TriMesh::new`].
    pub fn from_faces(positions: Vec<Vec3>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        Self::new(MeshParts { positions, faces, ..MeshParts::default() })
    }

    /// A mesh of columns that were part of a checked one.
    pub(crate) fn from_checked(parts: MeshParts, report: MeshReport) -> Self {
        Self { parts, report }
    }

    /// What was mended when the mesh was made.
    pub fn report(&self) -> MeshReport {
        self.report
    }

    /// The columns, to make another mesh from.
    pub fn into_parts(self) -> MeshParts {
        self.parts
    }

    /// The mesh with other tags.
    ///
    /// # Panics
    /// If `tags` is neither empty nor has one entry a face.
    #[must_use]
    pub fn with_face_tags(mut self, tags: Vec<u32>) -> Self {
        let faces = self.parts.faces.len();
        assert!(tags.is_empty() || tags.len() == faces, "{} tags for {faces} faces", tags.len());
        self.parts.face_tags = tags;
        self
    }

    /// The mesh with other colours of its vertices. Faces with a texture keep that.
    ///
    /// # Panics
    /// If `colors` is neither empty nor has one entry a vertex.
    #[must_use]
    pub fn with_vertex_colors(mut self, colors: Vec<[u8; 3]>) -> Self {
        let vertices = self.parts.positions.len();
        assert!(
            colors.is_empty() || colors.len() == vertices,
            "{} colours for {vertices} vertices",
            colors.len()
        );
        self.parts.colors = colors;
        self
    }

    /// The column [`MeshParts::face_tags`], which the mesh has no more after that.
    #[must_use]
    pub fn take_face_tags(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.parts.face_tags)
    }

    /// The columns.
    pub fn parts(&self) -> &MeshParts {
        &self.parts
    }

    /// Vertex positions, world metres.
    pub fn positions(&self) -> &[Vec3] {
        &self.parts.positions
    }

    /// Three indices into [`TriMesh::positions`] a face.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.parts.faces
    }

    /// The materials.
    pub fn materials(&self) -> &[Material] {
        &self.parts.materials
    }

    /// The textures.
    pub fn textures(&self) -> &[Texture] {
        &self.parts.textures
    }

    /// The corners of face `face`.
    ///
    /// # Panics
    /// If there is no such face; so do the other methods that take one.
    #[inline]
    pub fn triangle(&self, face: u32) -> [Vec3; 3] {
        self.parts.faces[face as usize].map(|v| self.parts.positions[v as usize])
    }

    /// Index of the material of face `face`, if it has one.
    #[inline]
    pub fn material_of(&self, face: u32) -> Option<u32> {
        self.parts
            .face_materials
            .get(face as usize)
            .copied()
            .filter(|&m| m != NO_INDEX)
    }

    /// Where face `face` takes its colour from: its texture if it has one and coordinates to look it up, else
    /// its corners' colours, else its material's, else [`DEFAULT_COLOR`].
    pub fn color_of(&self, face: u32) -> FaceColor<'_> {
        let p = &self.parts;
        let material = self.material_of(face).map(|m| &p.materials[m as usize]);
        if let (Some(texture), Some(corners)) =
            (material.and_then(|m| m.texture), p.face_uvs.get(face as usize).filter(|c| **c != [NO_INDEX; 3]))
        {
            let uvs = corners.map(|i| p.uvs[i as usize]);
            return FaceColor::Texture(texture, &p.textures[texture as usize], uvs);
        }
        if !p.colors.is_empty() {
            return FaceColor::Corners(p.faces[face as usize].map(|v| p.colors[v as usize]));
        }
        FaceColor::Flat(material.map_or(DEFAULT_COLOR, |m| m.color))
    }

    /// The normals at the corners of face `face`, if the mesh has them.
    #[inline]
    pub fn corner_normals(&self, face: u32) -> Option<[Vec3; 3]> {
        let corners = self
            .parts
            .face_normals
            .get(face as usize)
            .filter(|c| **c != [NO_INDEX; 3])?;
        Some(corners.map(|i| self.parts.normals[i as usize]))
    }

    /// The unit normal of face `face`, by its winding.
    pub fn normal(&self, face: u32) -> Vec3 {
        area_vector(self.triangle(face)).normalize().as_vec3()
    }

    /// The area of face `face` in m².
    pub fn area(&self, face: u32) -> f64 {
        area_vector(self.triangle(face)).length()
    }

    /// The area of all faces in m².
    pub fn total_area(&self) -> f64 {
        (0..self.parts.faces.len() as u32).map(|f| self.area(f)).sum()
    }

    /// The box of all faces.
    pub fn aabb(&self) -> Aabb {
        Aabb::from_points(
            self.parts
                .faces
                .iter()
                .flatten()
                .map(|&v| self.parts.positions[v as usize]),
        )
    }
}

/// Half the cross product of two edges: along the normal, as long as the area in m².
pub(crate) fn area_vector([a, b, c]: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    (b - a).cross(c - a) * 0.5
}

pub(crate) fn keep_where<T>(column: &mut Vec<T>, keep: &[bool]) {
    let mut flags = keep.iter();
    column.retain(|_| *flags.next().unwrap_or(&true));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Raster;
    use glam::vec3;

    fn square() -> MeshParts {
        MeshParts {
            positions: vec![Vec3::ZERO, Vec3::X, vec3(1.0, 1.0, 0.0), Vec3::Y],
            faces: vec![[0, 1, 2], [0, 2, 3]],
            ..MeshParts::default()
        }
    }

    #[test]
    fn areas_normals_and_box() {
        let m = TriMesh::new(square()).unwrap();
        assert_eq!(m.total_area(), 1.0);
        assert_eq!(m.normal(1), Vec3::Z);
        assert_eq!(m.aabb().to_array(), [0.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
        assert!(matches!(m.color_of(0), FaceColor::Flat(DEFAULT_COLOR)));
    }

    #[test]
    fn zero_area_faces_go_with_their_attributes() {
        let mut parts = square();
        parts.faces = vec![[0, 1, 2], [1, 1, 2], [0, 2, 3]];
        parts.face_materials = vec![0, 1, 2];
        parts.face_tags = vec![7, 8, 9];
        parts.materials = ["a", "b", "c"]
            .map(|name| Material { name: name.into(), color: [9; 3], texture: None })
            .to_vec();
        let mut m = TriMesh::new(parts).unwrap();
        assert_eq!((m.take_face_tags(), m.take_face_tags()), (vec![7, 9], vec![]));
        assert_eq!(m.report().zero_area_faces, 1);
        assert_eq!(m.faces(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(m.material_of(1), Some(2));
    }

    #[test]
    fn slivers_stay() {
        let m =
            TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, vec3(0.5, 1e-7, 0.0)], vec![[0, 1, 2]]).unwrap();
        assert_eq!(m.report().zero_area_faces, 0);
    }

    #[test]
    fn bad_columns_are_named() {
        let mut p = square();
        p.faces[1] = [0, 2, 4];
        let e = TriMesh::new(p).unwrap_err();
        assert_eq!(e, MeshError::OutOfRange { face: 1, what: "vertex", index: 4, count: 4 });

        let mut p = square();
        p.positions[3].y = f32::NAN;
        assert!(matches!(TriMesh::new(p), Err(MeshError::NonFinite { vertex: 3, .. })));

        let mut p = square();
        p.colors = vec![[0; 3]; 3];
        assert!(matches!(TriMesh::new(p), Err(MeshError::Length { count: 3, expected: 4, .. })));

        let mut p = square();
        p.face_tags = vec![1];
        assert!(matches!(TriMesh::new(p), Err(MeshError::Length { count: 1, expected: 2, .. })));

        let mut p = square();
        p.faces = vec![[0, 0, 0]];
        assert_eq!(TriMesh::new(p).unwrap_err(), MeshError::Empty { faces: 1 });
    }

    #[test]
    fn an_unused_vertex_may_be_anything() {
        let mut p = square();
        p.positions.push(vec3(f32::NAN, 0.0, 0.0));
        assert!(TriMesh::new(p).unwrap().aabb().contains(Vec3::ZERO));
    }

    #[test]
    fn colours_fall_back_from_texture_to_corners_to_material() {
        let mut p = square();
        p.textures =
            vec![Texture { name: "t".into(), image: Raster::filled(1, 1, [1; 3]), wrap: Default::default() }];
        p.materials = vec![
            Material { name: "textured".into(), color: [2; 3], texture: Some(0) },
            Material { name: "plain".into(), color: [3; 3], texture: None },
        ];
        p.face_materials = vec![0, 1];
        p.uvs = vec![Vec2::ZERO, Vec2::X, Vec2::Y];
        p.face_uvs = vec![[0, 1, 2], [NO_INDEX; 3]];
        let m = TriMesh::new(p.clone()).unwrap();
        assert!(matches!(m.color_of(0), FaceColor::Texture(0, _, [Vec2::ZERO, Vec2::X, Vec2::Y])));
        assert!(matches!(m.color_of(1), FaceColor::Flat([3, 3, 3])));
        p.colors = vec![[5; 3], [6; 3], [7; 3], [8; 3]];
        assert!(matches!(
            TriMesh::new(p).unwrap().color_of(1),
            FaceColor::Corners([[5, ..], [7, ..], [8, ..]])
        ));
    }
}
