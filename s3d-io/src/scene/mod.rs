//! Scenes: the parts that one area is made from, named by a `scene.toml`, or found in a published area or in
//! the folder of another data set.
//!
//! [`read_scene`] reads a [`SceneFile`]: the names of an area's mesh, annotations and scan locations, and how
//! they are read. The files themselves are read by [`mesh`](crate::mesh), [`cloud`](crate::cloud) and
//! [`camera`](crate::camera). [`PublishedArea`] finds the same parts in the folder of a published area, or of
//! an export. A [`PictureSource`] says which of the scanner's pictures give images their colours, and a
//! [`FrameSource`] which photographs become views. [`find_scene`] knows the folders of
//! other data sets. [`read_taxonomy`] reads the classes of a scene that does
//! not use the classes of S3DIS. An unknown key is an error with its line. Source: [`crate::formats`], "The
//! scene file".
//!
//! ```
//! use s3d_io::scene::parse_scene;
//!
//! # let folder = tempfile::tempdir().unwrap();
//! # std::fs::write(folder.path().join("room.obj"), "").unwrap();
//! # std::fs::write(folder.path().join("cameras.csv"), "").unwrap();
//! # std::fs::create_dir(folder.path().join("Area_1")).unwrap();
//! let text = r#"
//!     area = 1
//!     [mesh]
//!     path = "room.obj"
//!     [annotations]
//!     path = "Area_1"
//!     [cameras]
//!     path = "cameras.csv"
//! "#;
//! let scene = parse_scene(text, &folder.path().join("scene.toml"))?;
//! assert_eq!(scene.mesh, [folder.path().join("room.obj")]);
//! # Ok::<(), s3d_io::Error>(())
//! ```

mod annotations;
mod cameras;
mod document;
mod file;
mod folder;
mod found;
mod frames;
mod fuse;
mod other_kind;
mod parts;
mod published;
mod rgb;
mod taxonomy;
#[cfg(test)]
mod tests;
mod toml_fault;

pub use cameras::CameraSource;
pub use document::{parse_scene, read_scene};
pub use file::{MeshColors, SceneFile};
pub use found::{FoundScene, find_scene, found_sets};
pub use frames::FrameSource;
pub use fuse::FuseSource;
pub use parts::{PartPlace, PartSource};
pub use published::{PublishedArea, PublishedMesh, PublishedOptions};
pub use rgb::{PictureKind, PictureOptions, PictureSource, SkyBoxCaps, UnseenColor};
pub use taxonomy::{parse_taxonomy, read_taxonomy};
