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
    /// The word for it: `y` or `z`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// A point or direction of the file in the world's axes (Z-up).
    pub fn world_from_file(self, v: Vec3) -> Vec3 {
        match self {
            Self::Y => vec3(v.x, -v.z, v.y),
            Self::Z => v,
        }
    }

    /// The same as a matrix.
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
    /// The mesh. Its faces stand in the order of the file.
    pub mesh: TriMesh,
    /// For each texture of the mesh its encoded image, or `None` if the decoded one was altered.
    pub texture_files: Vec<Option<TextureFile>>,
    /// What was mended, left out or replaced: a sentence each, for the user.
    pub warnings: Vec<String>,
    /// Labels that the file gives its faces or vertices, if it does; aligned with those of `mesh`.
    pub labels: Option<MeshLabels>,
    /// The files that the mesh comes from, and where in it each begins.
    pub sources: Vec<MeshSource>,
    /// The other files that were read for it: libraries of materials, textures, buffers. Those that it names
    /// and that are not there are not among them.
    pub companions: Vec<PathBuf>,
    /// What was subtracted from the positions of its files, in the world's axes: add it to a position to have
    /// that of the scan. Source: [`MeshOptions::origin`].
    pub offset_m: DVec3,
    /// The unit that a comment in the (first) file says it is in.
    pub unit_said: Option<LengthUnit>,
    /// How many faces of the file had more than three corners.
    pub polygons_triangulated: usize,
    /// How many faces were left out because an earlier one has the same corners.
    pub repeated_faces: usize,
}

impl MeshFile {
    /// A mesh that no file holds, under the name that messages and the manifest call it.
    pub fn in_memory(name: &str, mesh: TriMesh) -> Self {
        let texture_files = vec![None; mesh.textures().len()];
        Self { texture_files, ..Self::new(Path::new(name), mesh) }
    }

    /// A mesh of the file `path`, with nothing else to say about it.
    pub(crate) fn new(path: &Path, mesh: TriMesh) -> Self {
        let (texture_files, warnings, labels, companions) = Default::default();
        let sources = vec![MeshSource { path: path.to_owned(), first_face: 0, first_vertex: 0 }];
        let (polygons_triangulated, repeated_faces) = (0, 0);
        Self {
            mesh,
            texture_files,
            warnings,
            labels,
            sources,
            companions,
            offset_m: DVec3::ZERO,
            unit_said: None,
            polygons_triangulated,
            repeated_faces,
        }
    }

    /// The faces that come from `sources[source]`. Numbers of objects may mean different objects in different
    /// files.
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

    /// Leaves out the faces that repeat an earlier one; labels follow the tags of the mesh, which are
    /// returned.
    pub(crate) fn tidy(mut self) -> (Self, Vec<u32>) {
        let (mut mesh, repeated) = self.mesh.without_repeated_faces();
        let tags = mesh.take_face_tags();
        if let Some(labels) = self.labels.as_mut().filter(|_| !tags.is_empty()) {
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

/// A file that a mesh comes from. Its faces and vertices go on to where those of the next file begin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshSource {
    /// The file.
    pub path: PathBuf,
    /// Its first face in the mesh.
    pub first_face: u32,
    /// Its first vertex in the mesh.
    pub first_vertex: u32,
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
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Metre, Self::Centimetre, Self::Millimetre, Self::Foot, Self::Inch];

    /// The word for it: `m`, `cm`, `mm`, `ft` or `in`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Foot => "ft",
            Self::Inch => "in",
        }
    }

    /// How many metres it is.
    pub const fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
            Self::Foot => 0.3048,
            Self::Inch => 0.0254,
        }
    }

    /// The unit that programs mean by a word, such as `meters`, `Inches` or `cm`.
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
    /// The property of a PLY file's faces or vertices that tells what they are; by default one of the names
    /// that scanners and data sets use, such as `label`, `class` and `category_id`, if it is there.
    pub class_column: Option<String>,
    /// The property that tells which object they belong to; by default one such as `object_id` and
    /// `instance`, if it is there.
    pub instance_column: Option<String>,
    /// Which place becomes the origin.
    pub origin: MeshOrigin,
    /// The unit of the coordinates. `None`: that which a comment in the head of the file says, as modellers
    /// write `# File units = inches` into OBJ files; else metres.
    pub units: Option<LengthUnit>,
}

/// Makes the mesh of parts in the file's unit, and tells in `warnings` what was mended.
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
