//! Meshes of any format that is read.

use crate::error::{Error, Result};
use crate::fs::open::open_file;
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis};
use std::io::Read;
use std::path::Path;

/// Reads a mesh and its textures; the name's ending says how: `.obj`, `.gltf`, `.glb` or `.ply`, in any case.
///
/// A texture that is missing or cannot be decoded, a face without area, of fewer than three corners or with
/// the corners of an earlier one and the like do not stop it: they become [`MeshFile::warnings`].
///
/// # Errors
/// [`Error::Unsupported`] for any other ending and for features of a format that are not read, [`Error::Io`],
/// [`Error::Format`] with the place, and [`Error::Mesh`] if no face is left.
pub fn read_mesh(path: &Path, up: UpAxis) -> Result<MeshFile> {
    read_mesh_with(path, up, &MeshOptions::default())
}

/// As [`read_mesh`], with another origin or unit, and the names of the columns of labels. Only PLY files have
/// such columns.
///
/// # Errors
/// As [`read_mesh`]; [`Error::Format`] too if a column that is asked for is not there or holds a number that
/// is not whole.
pub fn read_mesh_with(path: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let open = || {
        let file = open_file(path)?;
        let size = file.metadata().map_err(|e| Error::io(path, "read", e))?.len();
        Ok((file, size))
    };
    read(open, path, up, options)
}

/// As [`read_mesh_with`], from a reader of the file's bytes. The ending of `name` says how, errors call the
/// file so, and the libraries, textures and buffers that it names are looked for in the folder of `name`.
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
/// As [`read_mesh_with`].
pub fn read_mesh_from(reader: impl Read, name: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    read(|| Ok((reader, 0)), name, up, options)
}

/// Reads the mesh that `open` gives the bytes of, and how many they are (0: not known).
#[cfg_attr(not(feature = "ply"), allow(unused_variables))]
fn read<R: Read>(
    open: impl FnOnce() -> Result<(R, u64)>,
    path: &Path,
    up: UpAxis,
    options: &MeshOptions,
) -> Result<MeshFile> {
    let ending = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_ascii_lowercase();
    let file: Result<MeshFile> = match ending.as_str() {
        #[cfg(feature = "obj")]
        "obj" => crate::mesh::obj::read::read_bytes(whole(open, path)?, path, up, options),
        #[cfg(feature = "gltf")]
        "gltf" | "glb" => crate::mesh::gltf::read::read_bytes(whole(open, path)?, path, up, options),
        #[cfg(feature = "ply")]
        "ply" => {
            let (file, bytes) = open()?;
            crate::mesh::ply::read::read(file, bytes, path, up, options)
        }
        "" => Err(Error::unsupported(path, "has no ending; meshes are read from .obj, .gltf, .glb and .ply")),
        _ if let Some(feature) = feature_of(&ending) => Err(Error::not_built_in(path, feature)),
        _ => {
            let message = format!(".{ending} is not read; meshes are .obj, .gltf, .glb or .ply");
            Err(Error::unsupported(path, message))
        }
    };
    Ok(file?.tidy().0)
}

/// All bytes that `open` gives.
fn whole<R: Read>(open: impl FnOnce() -> Result<(R, u64)>, path: &Path) -> Result<Vec<u8>> {
    let (mut reader, size) = open()?;
    let mut bytes = Vec::with_capacity(usize::try_from(size).unwrap_or(0));
    reader.read_to_end(&mut bytes).map_err(|e| Error::io(path, "read", e))?;
    Ok(bytes)
}

/// The feature that reads files with this ending.
fn feature_of(ending: &str) -> Option<&'static str> {
    match ending {
        "obj" => Some("obj"),
        "gltf" | "glb" => Some("gltf"),
        "ply" => Some("ply"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_formats_are_refused_by_name() {
        for (name, word) in [("scan.fbx", ".fbx"), ("scan", "no ending"), ("a.b/scan.PLYX", ".ply")] {
            let message = read_mesh(Path::new(name), UpAxis::Y).unwrap_err().to_string();
            assert!(message.contains(word) && message.contains(".obj, .gltf"), "{message}");
        }
        assert!(matches!(read_mesh(Path::new("gone.OBJ"), UpAxis::Y), Err(Error::Io { .. })));
    }
}
