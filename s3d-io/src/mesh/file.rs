//! A mesh as it was read, with its textures and labels.

use crate::fs::quote::count;
use crate::image::texture::TextureFile;
use crate::mesh::labels::MeshLabels;
use crate::mesh::origin::{FileFrame, MeshOrigin};
use s3d_geom::glam::{DMat3, DVec3, Vec3, vec3};
use s3d_geom::{MeshError, MeshParts, TriMesh};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The axis of a file that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "toml", derive(serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum UpAxis {
    /// +Y, as in glTF and in the published OBJ files: (x, y, z) of the file is (x, −z, y) of the world.
    Y,
    /// +Z, as in the world.
    Z,
}

impl UpAxis {
    /// Returns its word: `y` or `z`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// Turns a point or direction of the file into the world's axes (Z-up).
    pub fn world_from_file(self, v: Vec3) -> Vec3 {
        match self {
            Self::Y => vec3(v.x, -v.z, v.y),
            Self::Z => v,
        }
    }

    /// Returns [`UpAxis::world_from_file`] as a matrix.
    pub fn rotation(self) -> DMat3 {
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| self.world_from_file(axis).as_dvec3());
        DMat3::from_cols(x, y, z)
    }
}

impl std::str::FromStr for UpAxis {
    type Err = &'static str;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        match word {
            "y" => Ok(Self::Y),
            "z" => Ok(Self::Z),
            _ => Err("must be y or z"),
        }
    }
}

/// A mesh as it was read, in world metres, Z-up.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// The mesh. Its faces keep the order of the file.
    pub mesh: TriMesh,
    /// The encoded image of each texture of the mesh. `None` if the decoded image was changed.
    pub texture_files: Vec<Option<TextureFile>>,
    /// What was repaired, left out or replaced: one sentence each, for the user.
    pub warnings: Vec<String>,
    /// The labels of its faces or vertices, if the file has any. They are aligned with the faces or vertices
    /// of `mesh`.
    pub labels: Option<MeshLabels>,
    /// For each face its number in its file, from 0. Triangles that were cut from a polygon share the number
    /// of the polygon. PLY and OBJ count their faces, those with fewer than three corners not in OBJ. glTF
    /// counts triangles in the order of the nodes of the scene. Empty if nothing numbers them.
    pub source_faces: Vec<u32>,
    /// The files that the mesh comes from, and where each begins in the mesh.
    pub sources: Vec<MeshSource>,
    /// The other files that were read: material libraries, textures, buffers. Missing files are not listed.
    pub companions: Vec<PathBuf>,
    /// The offset that was subtracted from the positions of the file, in the world's axes, in metres. Add it
    /// to a position to get the position in the scan. Source: [`MeshOptions::origin`].
    pub offset_m: DVec3,
    /// The unit that a comment in the (first) file names.
    pub unit_said: Option<LengthUnit>,
    /// How many faces of the file had more than three corners.
    pub polygons_triangulated: usize,
    /// How many faces were left out because an earlier one has the same corners.
    pub repeated_faces: usize,
}

impl MeshFile {
    /// Makes a mesh that no file holds. Messages and the manifest call it `name`.
    pub fn in_memory(name: &str, mesh: TriMesh) -> Self {
        let texture_files = vec![None; mesh.textures().len()];
        Self { texture_files, ..Self::new(Path::new(name), mesh) }
    }

    /// Makes a mesh of the file `path`, without textures, labels or warnings.
    pub(crate) fn new(path: &Path, mesh: TriMesh) -> Self {
        let source = MeshSource { path: path.to_owned(), first_face: 0 };
        Self {
            mesh,
            texture_files: Vec::new(),
            warnings: Vec::new(),
            labels: None,
            source_faces: Vec::new(),
            sources: vec![source],
            companions: Vec::new(),
            offset_m: DVec3::ZERO,
            unit_said: None,
            polygons_triangulated: 0,
            repeated_faces: 0,
        }
    }

    /// Returns the faces that come from `sources[source]`. The same object number may mean different objects
    /// in different files.
    ///
    /// # Panics
    /// If there is no such source.
    #[expect(clippy::indexing_slicing, reason = "another source is a caller's mistake: see Panics")]
    pub fn faces_of(&self, source: usize) -> Range<u32> {
        let end = self
            .sources
            .get(source + 1)
            .map_or(self.mesh.faces().len() as u32, |next| next.first_face);
        self.sources[source].first_face..end
    }

    /// Leaves out the faces that repeat an earlier one. Labels follow the face tags of the mesh, which are
    /// returned.
    pub(crate) fn tidy(mut self) -> (Self, Vec<u32>) {
        let (mut mesh, repeated) = self.mesh.without_repeated_faces();
        let tags = mesh.take_face_tags();
        if let Some(labels) = self.labels.as_mut() {
            labels.pick_faces(&tags);
        }

        self.mesh = mesh;
        self.repeated_faces += repeated;
        if repeated > 0 {
            let n = count(repeated, "face");
            self.warnings
                .push(format!("{n} left out: earlier faces have the same corners"));
        }
        (self, tags)
    }
}

/// A file that a mesh comes from. Its faces end where the next file's begin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshSource {
    /// The file.
    pub path: PathBuf,
    /// Its first face in the mesh.
    pub first_face: u32,
}

/// The unit of a file's coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "toml", derive(serde::Deserialize))]
pub enum LengthUnit {
    /// `m`
    #[default]
    #[cfg_attr(feature = "toml", serde(rename = "m"))]
    Metre,
    /// `cm`
    #[cfg_attr(feature = "toml", serde(rename = "cm"))]
    Centimetre,
    /// `mm`
    #[cfg_attr(feature = "toml", serde(rename = "mm"))]
    Millimetre,
    /// `ft`, of 0.3048 m.
    #[cfg_attr(feature = "toml", serde(rename = "ft"))]
    Foot,
    /// `in`, of 2.54 cm.
    #[cfg_attr(feature = "toml", serde(rename = "in"))]
    Inch,
}

impl LengthUnit {
    /// All units.
    pub const ALL: [Self; 5] = [Self::Metre, Self::Centimetre, Self::Millimetre, Self::Foot, Self::Inch];

    /// Returns its word: `m`, `cm`, `mm`, `ft` or `in`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Foot => "ft",
            Self::Inch => "in",
        }
    }

    /// Returns its length in metres.
    pub const fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
            Self::Foot => 0.3048,
            Self::Inch => 0.0254,
        }
    }

    /// Returns the unit that a program means by a word such as `meters`, `Inches` or `cm`.
    pub(crate) fn of_word(word: &str) -> Option<Self> {
        Some(match word.to_ascii_lowercase().trim_end_matches('s') {
            "m" | "meter" | "metre" => Self::Metre,
            "cm" | "centimeter" | "centimetre" => Self::Centimetre,
            "mm" | "millimeter" | "millimetre" => Self::Millimetre,
            "ft" | "foot" | "feet" => Self::Foot,
            "in" | "inch" | "inche" => Self::Inch,
            _ => return None,
        })
    }
}

impl std::fmt::Display for LengthUnit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for LengthUnit {
    type Err = &'static str;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|unit| unit.name() == word)
            .ok_or("must be m, cm, mm, ft or in")
    }
}

/// How a mesh is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshOptions {
    /// The name of the PLY property that holds the class of a face or vertex. By default the first of the
    /// names that scanners and data sets use, such as `label`, `class` and `category_id`.
    pub class_column: Option<String>,
    /// The name of the PLY property that holds the object of a face or vertex. By default the first of the
    /// usual names, such as `object_id` and `instance`.
    pub instance_column: Option<String>,
    /// Which point becomes the origin.
    pub origin: MeshOrigin,
    /// The unit of the coordinates. By default the unit that a comment in the head of the file names, as
    /// modellers write `# File units = inches` into OBJ files, or else metres.
    pub units: Option<LengthUnit>,
    /// Whether the buffers, images and schema of a glTF file may lie outside its folder. By default a file
    /// that names such a file is refused: a foreign one could bring any file of the disk into what is made
    /// of it.
    pub outside_files: bool,
}

/// Checks the parts, whose positions are in the file's unit, and makes the mesh. Adds what was repaired to
/// `warnings`.
pub(crate) fn checked_mesh(
    mut parts: MeshParts,
    frame: FileFrame,
    warnings: &mut Vec<String>,
) -> std::result::Result<TriMesh, MeshError> {
    frame.scale(&mut parts.positions);
    let mesh = TriMesh::new(parts)?;
    let report = mesh.report();
    if report.zero_area_faces > 0 {
        warnings.push(format!("{} of zero area left out", count(report.zero_area_faces, "face")));
    }
    if report.non_finite_attributes > 0 {
        let faces = count(report.non_finite_attributes, "face");
        warnings.push(format!(
            "normals or texture coordinates of {faces} left out: not finite, or without length"
        ));
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn y_up_files_are_turned() {
        assert_eq!(UpAxis::Y.world_from_file(vec3(1.0, 2.0, 3.0)), vec3(1.0, -3.0, 2.0));
        assert_eq!(UpAxis::Y.world_from_file(Vec3::Y), Vec3::Z);
        assert_eq!(UpAxis::Z.world_from_file(vec3(1.0, 2.0, 3.0)), vec3(1.0, 2.0, 3.0));
    }
}
