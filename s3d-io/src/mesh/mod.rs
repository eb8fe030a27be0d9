//! Meshes with their textures and labels: OBJ, glTF and PLY.

pub(crate) mod file;
mod gltf;
pub(crate) mod join;
pub(crate) mod labels;
pub(crate) mod obj;
pub(crate) mod ply;

pub use file::{MeshFile, MeshOptions, UpAxis, read_mesh, read_mesh_with};
pub use join::{MeshSource, read_meshes, read_meshes_with};
pub use labels::{LabelColumn, LabelElement, MeshLabels, NO_LABEL};
pub use obj::{TextureOut, write_rgb_obj, write_semantic_obj};
