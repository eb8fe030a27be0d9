//! Meshes with their textures and labels: OBJ, glTF and PLY.

pub(crate) mod file;
mod gltf;
pub(crate) mod join;
pub(crate) mod labels;
pub(crate) mod obj;
pub(crate) mod ply;
pub(crate) mod read;

pub use file::{MeshFile, MeshOptions, MeshSource, UpAxis};
pub use join::{read_meshes, read_meshes_with};
pub use labels::{LabelColumn, LabelElement, MeshLabels, NO_LABEL};
pub use obj::{TextureOut, write_rgb_obj, write_semantic_obj};
pub use read::{read_mesh, read_mesh_with};
