//! Meshes with their textures and labels.
//!
//! [`read_mesh`] reads one file and [`read_meshes`] joins several. The name's ending tells the
//! [format](MeshFormat). The result is a [`MeshFile`]: the mesh in world metres, Z-up, its encoded textures
//! as the file has them, [`MeshLabels`] if the file labels its faces or vertices, and warnings of everything
//! that was repaired. [`read_mesh_from`] takes any reader. A mesh far from its origin, as in UTM, can be
//! moved near to it before its positions are rounded to `f32`: [`MeshOptions::origin`].
//!
//! | ending | what is read |
//! |---|---|
//! | `.obj` | Wavefront OBJ in the dialects of scanners and modellers, `Kd` and `map_Kd` of its libraries |
//! | `.gltf`, `.glb` | glTF 2.0, also compressed: triangles of the default scene, base colours, textures |
//! | `.ply` | ASCII and binary, either byte order: polygons, strips, colours, texture coordinates, labels |
//!
//! Vertices and faces keep the file's order. Polygons are cut into triangles, and a face that repeats an
//! earlier one is left out. Textures are PNG or JPEG of at most 2²⁹ pixels each; vertices and faces are
//! counted by 32 bits. glTF may be compressed by meshopt, and by Draco with the feature `draco`. Textures in
//! KTX2 are refused with a message that names a way out.
//!
//! [`write_rgb_obj`] and [`write_semantic_obj`] write the meshes of a data set into a folder; [`RgbObj`] and
//! [`SemanticObj`] write them into any writer. [`write_ply_mesh`] and [`write_glb_mesh`] write a mesh of
//! coloured vertices, [`write_textured_glb`] one with its textures. Source: [`crate::formats`], "Meshes".
//!
//! ```
//! use s3d_io::mesh::{UpAxis, read_mesh};
//!
//! # let folder = tempfile::tempdir().unwrap();
//! # let path = folder.path().join("table.obj");
//! std::fs::write(&path, "v 0 1 0\nv 2 1 0\nv 2 1 -1\nv 0 1 -1\nf 1 2 3 4\n").unwrap();
//! let file = read_mesh(&path, UpAxis::Y)?;
//! assert_eq!((file.mesh.faces().len(), file.polygons_triangulated), (2, 1));
//! // Y was up in the file, Z is in the world.
//! assert_eq!(file.mesh.positions()[2].to_array(), [2.0, 1.0, 1.0]);
//! # Ok::<(), s3d_io::Error>(())
//! ```

#[cfg(feature = "mesh")]
pub(crate) mod file;
#[cfg(feature = "gltf")]
mod glb;
#[cfg(all(feature = "gltf", feature = "png"))]
mod glb_labels;
#[cfg(all(feature = "gltf", feature = "png"))]
mod glb_textured;
#[cfg(feature = "gltf")]
pub(crate) mod gltf;
#[cfg(feature = "mesh")]
pub(crate) mod join;
#[cfg(feature = "mesh")]
pub(crate) mod labels;
#[cfg(feature = "obj")]
mod obj;
#[cfg(feature = "mesh")]
pub(crate) mod origin;
#[cfg(feature = "ply")]
pub(crate) mod ply;
#[cfg(feature = "mesh")]
pub(crate) mod read;
#[cfg(feature = "mesh")]
mod told_offset;
#[cfg(any(feature = "gltf", feature = "ply"))]
mod write;

#[cfg(feature = "mesh")]
pub use file::{LengthUnit, MeshFile, MeshOptions, MeshSource, UpAxis};
#[cfg(feature = "gltf")]
pub use glb::write_glb_mesh;
#[cfg(all(feature = "gltf", feature = "png"))]
pub use glb_textured::{write_labelled_glb, write_textured_glb};
#[cfg(feature = "mesh")]
pub use join::{read_meshes, read_meshes_with};
#[cfg(feature = "mesh")]
pub use labels::{LabelColumn, LabelElement, LabelledObject, LabelledRoom, MeshLabels, NO_LABEL};
#[cfg(all(feature = "obj", feature = "png"))]
pub use obj::{RgbObj, SemanticObj, TextureOut, write_rgb_obj, write_semantic_obj};
#[cfg(feature = "mesh")]
pub use origin::MeshOrigin;
#[cfg(feature = "mesh")]
pub use read::{MeshFormat, read_mesh, read_mesh_from, read_mesh_with};
#[cfg(feature = "mesh")]
pub use told_offset::ToldOffset;
#[cfg(feature = "ply")]
pub use write::write_ply_mesh;
#[cfg(any(feature = "gltf", feature = "ply"))]
pub use write::{FaceColumn, MeshOut};
