//! Meshes with their textures and labels: OBJ, glTF and PLY.

#[cfg(feature = "mesh")]
pub(crate) mod file;
#[cfg(feature = "gltf")]
mod gltf;
#[cfg(feature = "mesh")]
pub(crate) mod join;
#[cfg(feature = "mesh")]
pub(crate) mod labels;
#[cfg(feature = "obj")]
mod obj;
#[cfg(feature = "ply")]
pub(crate) mod ply;
#[cfg(feature = "mesh")]
pub(crate) mod read;

#[cfg(feature = "mesh")]
pub use file::{MeshFile, MeshOptions, MeshSource, UpAxis};
#[cfg(feature = "mesh")]
pub use join::{read_meshes, read_meshes_with};
#[cfg(feature = "mesh")]
pub use labels::{LabelColumn, LabelElement, MeshLabels, NO_LABEL};
#[cfg(all(feature = "obj", feature = "png"))]
pub use obj::{TextureOut, write_rgb_obj, write_semantic_obj};
#[cfg(feature = "mesh")]
pub use read::{read_mesh, read_mesh_from, read_mesh_with};
