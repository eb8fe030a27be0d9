//! Textured triangle meshes, checked once, by their constructor.

mod closed;
mod edit;
mod merge;
mod repeated;
pub(crate) mod texture;

pub use edit::moved_point;
pub use texture::{Texture, Wrap, sample_bilinear};

use crate::Aabb;
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use thiserror::Error;

/// Stands for a missing index: the face (or corner) has none.
pub const NO_INDEX: u32 = u32::MAX;

/// The grey of faces without texture, vertex colours and material.
pub const DEFAULT_COLOR: [u8; 3] = [204; 3];

/// The appearance of a group of faces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Material {
    /// The name of the material in the file.
    pub name: String,
    /// The colour of faces without a texture, sRGB.
    pub color: [u8; 3],
    /// The index of the texture in [`TriMesh::textures`], if there is one.
    pub texture: Option<u32>,
}

/// The columns of a mesh, before [`TriMesh::new`] checks them.
///
/// World frame: metres, Z-up, right-handed. A missing column is empty.
#[derive(Clone, Debug, Default)]
pub struct MeshParts {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` per face, counter-clockwise seen from the front.
    pub faces: Vec<[u32; 3]>,
    /// Vertex colours, sRGB: none, or one per position.
    pub colors: Vec<[u8; 3]>,
    /// Texture coordinates, (0, 0) at the bottom left of the image.
    pub uvs: Vec<Vec2>,
    /// Three indices into `uvs`, or [`NO_INDEX`] three times: no entry, or one per face.
    pub face_uvs: Vec<[u32; 3]>,
    /// Unit normals of corners.
    pub normals: Vec<Vec3>,
    /// Three indices into `normals`, or [`NO_INDEX`] three times: no entry, or one per face.
    pub face_normals: Vec<[u32; 3]>,
    /// The materials.
    pub materials: Vec<Material>,
    /// An index into `materials`, or [`NO_INDEX`]: no entry, or one per face.
    pub face_materials: Vec<u32>,
    /// The textures.
    pub textures: Vec<Texture>,
    /// A number of the caller's choice, such as the place of a face in a file: no entry, or one per face. It
    /// tells which faces are left when some are dropped.
    pub face_tags: Vec<u32>,
}

/// The repairs that [`TriMesh::new`] made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MeshReport {
    /// The number of faces dropped for having no area.
    pub zero_area_faces: usize,
    /// The number of faces that lost their corner normals or texture coordinates, since one was not finite.
    /// A face that lost both counts twice.
    pub non_finite_attributes: usize,
}

/// The reason why columns are not a mesh.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// There is no face, or no face with an area.
    #[error("the mesh has no face with an area ({faces} faces in the file)")]
    Empty {
        /// The number of faces before those without an area were dropped.
        faces: usize,
    },
    /// A vertex of a face is NaN or infinite.
    #[error("vertex {vertex} is not finite: {position}")]
    NonFinite {
        /// Index of the vertex, from 0.
        vertex: u32,
        /// The position of the vertex.
        position: Vec3,
    },
    /// An index is past the end of its column.
    #[error("face {face} names {what} {index}, but there are only {count}")]
    OutOfRange {
        /// Index of the face, from 0.
        face: usize,
        /// The column: "vertex", "texture coordinate", "normal", "material" or "texture".
        what: &'static str,
        /// The index, from 0.
        index: u32,
        /// The length of the column.
        count: usize,
    },
    /// A column is neither empty nor has one entry per vertex or face.
    #[error("{what}: {count} entries for {expected}")]
    Length {
        /// The column.
        what: &'static str,
        /// The length of the column.
        count: usize,
        /// The number of vertices or faces.
        expected: usize,
    },
}

/// The source of the colour of a face.
#[derive(Clone, Copy, Debug)]
pub enum FaceColor<'a> {
    /// A texture, after its index in [`TriMesh::textures`], and the texture coordinates of the corners.
    Texture(u32, &'a Texture, [Vec2; 3]),
    /// The colours of the corners.
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
/// // Columns of three faces. The last has no area and is dropped.
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
    /// Checks the columns and drops the faces without an area. The area must be exactly zero in `f64`:
    /// slivers stay.
    ///
    /// # Errors
    /// [`MeshError`] for an index out of range, a vertex of a face that is not finite, a column of the wrong
    /// length, or no face left.
    pub fn new(mut parts: MeshParts) -> Result<Self, MeshError> {
        check_lengths(&parts)?;
        check_indices(&parts)?;

        let non_finite_attributes =
            drop_non_finite(&mut parts.face_uvs, |uv| parts.uvs[uv as usize].is_finite())
                + drop_non_finite(&mut parts.face_normals, |n| parts.normals[n as usize].is_finite());

        let faces = parts.faces.len();
        let has_area: Vec<bool> = parts
            .faces
            .par_iter()
            .map(|f| area_vector(f.map(|v| parts.positions[v as usize])) != DVec3::ZERO)
            .collect();
        let zero_area_faces = has_area.iter().filter(|&&keep| !keep).count();
        if zero_area_faces == faces {
            return Err(MeshError::Empty { faces });
        }
        if zero_area_faces > 0 {
            parts.keep_faces(&has_area);
        }

        Ok(Self { parts, report: MeshReport { zero_area_faces, non_finite_attributes } })
    }

    /// Makes a mesh of positions and faces alone.
    ///
    /// # Errors
    /// The errors of [`TriMesh::new`].
    pub fn from_faces(positions: Vec<Vec3>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        Self::new(MeshParts { positions, faces, ..MeshParts::default() })
    }

    /// Makes a mesh of columns that are checked already.
    pub(crate) fn from_checked(parts: MeshParts, report: MeshReport) -> Self {
        Self { parts, report }
    }

    /// Returns the repairs that were made when the mesh was made.
    pub fn report(&self) -> MeshReport {
        self.report
    }

    /// Turns the mesh into its columns, to make another mesh from.
    pub fn into_parts(self) -> MeshParts {
        self.parts
    }

    /// Returns the mesh with other tags.
    ///
    /// # Panics
    /// If `tags` is neither empty nor has one entry per face.
    #[must_use]
    pub fn with_face_tags(mut self, tags: Vec<u32>) -> Self {
        let faces = self.parts.faces.len();
        assert!(tags.is_empty() || tags.len() == faces, "{} tags for {faces} faces", tags.len());
        self.parts.face_tags = tags;
        self
    }

    /// Returns the mesh with other vertex colours. Faces with a texture keep it.
    ///
    /// # Panics
    /// If `colors` is neither empty nor has one entry per vertex.
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

    /// Takes the column [`MeshParts::face_tags`] out of the mesh.
    #[must_use]
    pub fn take_face_tags(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.parts.face_tags)
    }

    /// Returns the columns.
    pub fn parts(&self) -> &MeshParts {
        &self.parts
    }

    /// Returns the vertex positions, in world metres.
    pub fn positions(&self) -> &[Vec3] {
        &self.parts.positions
    }

    /// Returns three indices into [`TriMesh::positions`] per face.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.parts.faces
    }

    /// Returns the materials.
    pub fn materials(&self) -> &[Material] {
        &self.parts.materials
    }

    /// Returns the textures.
    pub fn textures(&self) -> &[Texture] {
        &self.parts.textures
    }

    /// Returns the corners of face `face`.
    ///
    /// # Panics
    /// If there is no such face. The other methods that take a face panic likewise.
    #[inline]
    pub fn triangle(&self, face: u32) -> [Vec3; 3] {
        self.parts.faces[face as usize].map(|v| self.parts.positions[v as usize])
    }

    /// Returns the index of the material of face `face`, if it has one.
    #[inline]
    pub fn material_of(&self, face: u32) -> Option<u32> {
        self.parts
            .face_materials
            .get(face as usize)
            .copied()
            .filter(|&m| m != NO_INDEX)
    }

    /// Returns the source of the colour of face `face`. It is the first of these that the face has: a texture
    /// with texture coordinates, the vertex colours, the colour of its material, [`DEFAULT_COLOR`].
    pub fn color_of(&self, face: u32) -> FaceColor<'_> {
        let p = &self.parts;
        let material = self.material_of(face).map(|m| &p.materials[m as usize]);
        let face_uvs = p.face_uvs.get(face as usize).filter(|uvs| **uvs != [NO_INDEX; 3]);
        if let Some(texture) = material.and_then(|m| m.texture)
            && let Some(corners) = face_uvs
        {
            let uvs = corners.map(|i| p.uvs[i as usize]);
            return FaceColor::Texture(texture, &p.textures[texture as usize], uvs);
        }
        if !p.colors.is_empty() {
            return FaceColor::Corners(p.faces[face as usize].map(|v| p.colors[v as usize]));
        }
        FaceColor::Flat(material.map_or(DEFAULT_COLOR, |m| m.color))
    }

    /// Returns the normals at the corners of face `face`, if it has them.
    #[inline]
    pub fn corner_normals(&self, face: u32) -> Option<[Vec3; 3]> {
        let corners = self
            .parts
            .face_normals
            .get(face as usize)
            .filter(|c| **c != [NO_INDEX; 3])?;
        Some(corners.map(|i| self.parts.normals[i as usize]))
    }

    /// Returns the unit normal of face `face`, from its winding.
    pub fn normal(&self, face: u32) -> Vec3 {
        area_vector(self.triangle(face)).normalize().as_vec3()
    }

    /// Returns the area of face `face`, in m².
    pub fn area(&self, face: u32) -> f64 {
        area_vector(self.triangle(face)).length()
    }

    /// Returns the area of all faces, in m².
    pub fn total_area(&self) -> f64 {
        (0..self.parts.faces.len() as u32).map(|f| self.area(f)).sum()
    }

    /// Returns the box around all faces.
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

impl MeshParts {
    /// Keeps the faces whose entry in `keep` is true, with their attributes.
    fn keep_faces(&mut self, keep: &[bool]) {
        keep_where(&mut self.faces, keep);
        keep_where(&mut self.face_uvs, keep);
        keep_where(&mut self.face_normals, keep);
        keep_where(&mut self.face_materials, keep);
        keep_where(&mut self.face_tags, keep);
    }
}

fn check_lengths(parts: &MeshParts) -> Result<(), MeshError> {
    let vertices = parts.positions.len();
    let faces = parts.faces.len();
    for (what, count, expected) in [
        ("vertex colours", parts.colors.len(), vertices),
        ("texture coordinates of faces", parts.face_uvs.len(), faces),
        ("normals of faces", parts.face_normals.len(), faces),
        ("materials of faces", parts.face_materials.len(), faces),
        ("tags of faces", parts.face_tags.len(), faces),
    ] {
        if count != 0 && count != expected {
            return Err(MeshError::Length { what, count, expected });
        }
    }
    Ok(())
}

fn check_indices(parts: &MeshParts) -> Result<(), MeshError> {
    for (face, corners) in parts.faces.iter().enumerate() {
        for &vertex in corners {
            check_index(face, "vertex", vertex, parts.positions.len())?;
            let position = parts.positions[vertex as usize];
            if !position.is_finite() {
                return Err(MeshError::NonFinite { vertex, position });
            }
        }
    }

    for (what, column, count) in [
        ("texture coordinate", &parts.face_uvs, parts.uvs.len()),
        ("normal", &parts.face_normals, parts.normals.len()),
    ] {
        for (face, corners) in column.iter().enumerate() {
            if *corners != [NO_INDEX; 3] {
                corners
                    .iter()
                    .try_for_each(|&index| check_index(face, what, index, count))?;
            }
        }
    }

    for (face, &material) in parts.face_materials.iter().enumerate() {
        if material != NO_INDEX {
            check_index(face, "material", material, parts.materials.len())?;
            if let Some(texture) = parts.materials[material as usize].texture {
                check_index(face, "texture", texture, parts.textures.len())?;
            }
        }
    }
    Ok(())
}

fn check_index(face: usize, what: &'static str, index: u32, count: usize) -> Result<(), MeshError> {
    if (index as usize) < count {
        Ok(())
    } else {
        Err(MeshError::OutOfRange { face, what, index, count })
    }
}

/// Takes the attribute away from faces that have one that is not finite. Returns the number of these faces.
fn drop_non_finite(column: &mut [[u32; 3]], is_finite: impl Fn(u32) -> bool) -> usize {
    let mut dropped = 0;
    for corners in column {
        if *corners != [NO_INDEX; 3] && corners.iter().any(|&index| !is_finite(index)) {
            *corners = [NO_INDEX; 3];
            dropped += 1;
        }
    }
    dropped
}

/// Returns half the cross product of two edges. It points along the normal, and its length is the area in
/// m².
pub(crate) fn area_vector([a, b, c]: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    (b - a).cross(c - a) * 0.5
}

fn keep_where<T>(column: &mut Vec<T>, keep: &[bool]) {
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
