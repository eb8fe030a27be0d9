//! Reads a mesh of any known format.

use crate::error::{Error, Result};
use crate::fs::open::open_file;
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis};
use std::io::Read;
use std::path::Path;

/// A format of meshes that are read.
#[derive(Clone, Copy, Debug)]
pub struct MeshFormat {
    /// Its usual name, "glTF".
    pub name: &'static str,
    /// The endings of its files, in lower case, without the dot.
    pub endings: &'static [&'static str],
    /// The cargo feature that reads it.
    pub feature: &'static str,
    /// Whether the format itself says that +Y points up and that the unit is the metre. If not, scenes of a
    /// lone mesh guess both.
    pub defines_frame: bool,
    /// Its reader. `None` if this build is without the feature.
    read: Option<Reader>,
}

type Reader = fn(OpenMesh<'_>, &Path, UpAxis, &MeshOptions) -> Result<MeshFile>;

impl MeshFormat {
    /// All formats, whether this build reads them or not. Messages list their endings, and scenes take files
    /// with these endings for meshes.
    pub const ALL: &'static [Self] = &[
        Self {
            name: "OBJ",
            endings: &["obj"],
            feature: "obj",
            defines_frame: false,
            #[cfg(feature = "obj")]
            read: Some(|file, path, up, options| {
                crate::mesh::obj::read::read_bytes(file.into_bytes(path)?, path, up, options)
            }),
            #[cfg(not(feature = "obj"))]
            read: None,
        },
        Self {
            name: "glTF",
            endings: &["gltf", "glb"],
            feature: "gltf",
            defines_frame: true,
            #[cfg(feature = "gltf")]
            read: Some(|file, path, up, options| {
                crate::mesh::gltf::read::read_bytes(file.into_bytes(path)?, path, up, options)
            }),
            #[cfg(not(feature = "gltf"))]
            read: None,
        },
        Self {
            name: "PLY",
            endings: &["ply"],
            feature: "ply",
            defines_frame: false,
            #[cfg(feature = "ply")]
            read: Some(|file, path, up, options| {
                crate::mesh::ply::read::read(file.reader, file.size, path, up, options)
            }),
            #[cfg(not(feature = "ply"))]
            read: None,
        },
    ];

    /// Finds the format of a file by the ending of its name, in upper or lower case. `None` if no format of
    /// meshes has it.
    pub fn of(path: &Path) -> Option<&'static Self> {
        let ending = ending_of(path);
        Self::ALL
            .iter()
            .find(|format| format.endings.contains(&ending.as_str()))
    }
}

/// Returns the ending of a file's name in lower case, without the dot.
fn ending_of(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_ascii_lowercase()
}

/// Reads a mesh and its textures. The name's ending tells the format, which is one of
/// [`MeshFormat::ALL`].
///
/// A small fault does not stop the reader: it becomes one of [`MeshFile::warnings`]. Such faults are a
/// texture that is missing or cannot be decoded, and a face that has no area, has fewer than three corners,
/// or has the corners of an earlier face.
///
/// # Errors
/// [`Error::Unsupported`] for any other ending and for features of a format that are not read, [`Error::Io`],
/// [`Error::Format`] with the place, and [`Error::Mesh`] if no face is left.
pub fn read_mesh(path: &Path, up: UpAxis) -> Result<MeshFile> {
    read_mesh_with(path, up, &MeshOptions::default())
}

/// Reads like [`read_mesh`], with another origin or unit, or with named label columns. Only PLY files have
/// label columns.
///
/// # Errors
/// Like [`read_mesh`], and [`Error::Format`] if a named column is not there or holds a number that is not
/// whole.
pub fn read_mesh_with(path: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let open = || {
        let file = open_file(path)?;
        let size = file.metadata().map_err(|e| Error::io(path, "read", e))?.len();
        Ok(OpenMesh { reader: Box::new(file), size })
    };
    read(open, path, up, options)
}

/// Reads like [`read_mesh_with`], from any reader. `name` has three uses: its ending tells the format, errors
/// name the file by it, and the libraries, textures and buffers that the mesh names are searched in its
/// folder.
///
/// ```
/// use s3d_io::mesh::{UpAxis, read_mesh_from};
/// use std::path::Path;
///
/// let obj = "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n";
/// let file = read_mesh_from(obj.as_bytes(), Path::new("floor.obj"), UpAxis::Y, &Default::default())?;
/// assert_eq!(file.mesh.triangle(0)[2].to_array(), [0.0, -1.0, 0.0]);
/// # Ok::<(), s3d_io::Error>(())
/// ```
///
/// # Errors
/// Like [`read_mesh_with`].
pub fn read_mesh_from(reader: impl Read, name: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    read(|| Ok(OpenMesh { reader: Box::new(reader), size: 0 }), name, up, options)
}

/// Reads the file that `open` opens. A file of an unknown format is not opened.
fn read<'r>(
    open: impl FnOnce() -> Result<OpenMesh<'r>>,
    path: &Path,
    up: UpAxis,
    options: &MeshOptions,
) -> Result<MeshFile> {
    let Some(format) = MeshFormat::of(path) else {
        return Err(Error::unsupported(path, unknown_ending(&ending_of(path))));
    };
    let Some(reader) = format.read else {
        return Err(Error::not_built_in(path, format.feature));
    };

    let (mut file, source_faces) = reader(open()?, path, up, options)?.tidy();
    file.source_faces = source_faces;
    Ok(file)
}

/// A mesh file that is open.
struct OpenMesh<'r> {
    reader: Box<dyn Read + 'r>,
    /// How many bytes the file has. 0 if that is not known.
    size: u64,
}

impl OpenMesh<'_> {
    /// Reads the whole file.
    fn into_bytes(mut self, path: &Path) -> Result<Vec<u8>> {
        let mut bytes = Vec::with_capacity(usize::try_from(self.size).unwrap_or(0));
        self.reader
            .read_to_end(&mut bytes)
            .map_err(|e| Error::io(path, "read", e))?;
        Ok(bytes)
    }
}

/// Says that no format has this ending, and which endings are known.
fn unknown_ending(ending: &str) -> String {
    let known: Vec<String> = MeshFormat::ALL
        .iter()
        .flat_map(|format| format.endings)
        .map(|ending| format!(".{ending}"))
        .collect();
    let known = match known.as_slice() {
        [others @ .., last] => format!("{} or {last}", others.join(", ")),
        [] => String::new(),
    };
    match ending {
        "" => format!("has no ending; meshes are {known}"),
        _ => format!(".{ending} is not read; meshes are {known}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_formats_are_refused_by_name() {
        let endings: Vec<&str> = MeshFormat::ALL
            .iter()
            .flat_map(|format| format.endings)
            .copied()
            .collect();
        let (last, others) = endings.split_last().unwrap();
        let known = format!("meshes are .{} or .{last}", others.join(", ."));
        assert!(known.starts_with("meshes are .obj, .gltf, .glb"));

        for (name, word) in [("scan.fbx", ".fbx"), ("scan", "no ending"), ("a.b/scan.PLYX", ".ply")] {
            let message = read_mesh(Path::new(name), UpAxis::Y).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
            assert!(message.ends_with(&known), "{message}");
        }
        assert!(MeshFormat::of(Path::new("a/SCAN.Glb")).is_some_and(|format| format.name == "glTF"));
        assert!(matches!(read_mesh(Path::new("gone.OBJ"), UpAxis::Y), Err(Error::Io { .. })));
    }
}
