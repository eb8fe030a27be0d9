//! Meshes of any format that is read.

use crate::error::{Error, Result};
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis};
use std::path::Path;

/// Reads a mesh and its textures; the name's ending says how: `.obj`, `.gltf`, `.glb` or `.ply`, in any case.
///
/// A texture that is missing or cannot be decoded, a face without area, of fewer than three corners or with the corners
/// of an earlier one and the like do not stop it: they become [`MeshFile::warnings`].
///
/// # Errors
/// [`Error::Unsupported`] for any other ending and for features of a format that are not read, [`Error::Io`],
/// [`Error::Format`] with the place, and [`Error::Mesh`] if no face is left.
pub fn read_mesh(path: &Path, up: UpAxis) -> Result<MeshFile> {
    read_mesh_with(path, up, &MeshOptions::default())
}

/// As [`read_mesh`], with the names of the columns of labels. Only PLY files have such columns.
///
/// # Errors
/// As [`read_mesh`]; [`Error::Format`] too if a column that is asked for is not there or holds a number that is not
/// whole.
#[cfg_attr(not(feature = "ply"), allow(unused_variables))]
pub fn read_mesh_with(path: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let file: Result<MeshFile> = match ending.as_str() {
        #[cfg(feature = "obj")]
        "obj" => crate::mesh::obj::read::read(path, up),
        #[cfg(feature = "gltf")]
        "gltf" | "glb" => crate::mesh::gltf::read::read(path, up),
        #[cfg(feature = "ply")]
        "ply" => crate::mesh::ply::read::read(path, up, options),
        "" => Err(Error::unsupported(path, "has no ending; meshes are read from .obj, .gltf, .glb and .ply")),
        _ if let Some(feature) = feature_of(&ending) => Err(Error::not_built_in(path, feature)),
        _ => {
            let message = format!(".{ending} is not read; meshes are .obj, .gltf, .glb or .ply");
            Err(Error::unsupported(path, message))
        }
    };
    Ok(file?.tidy().0)
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
