//! Scenes: what one area is made from, as `scene.toml` or as a published area.
//!
//! [`read_scene`] reads the names of an area's mesh, annotations and scan locations, and how they are read
//! ([`SceneFile`]); the files themselves are read by [`mesh`](crate::mesh), [`cloud`](crate::cloud) and
//! [`camera`](crate::camera). [`PublishedArea`] finds the same in the folder of a published area, or of an
//! export. [`PictureSource`] tells what the colours of images are taken from, [`FrameSource`] which
//! photographs become views. [`read_taxonomy`] reads the classes that a scene may have in place of S3DIS's. A
//! key that is not known is an error, with its line. Source: formats.md, "The scene file".
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
mod file;
mod frames;
mod other_kind;
mod published;
mod rgb;
mod taxonomy;
mod toml_fault;

pub use cameras::CameraSource;
pub use file::{MeshColors, SceneFile, parse_scene, read_scene};
pub use frames::FrameSource;
pub use published::{PublishedArea, PublishedMesh, PublishedOptions};
pub use rgb::{PictureKind, PictureOptions, PictureSource, SkyBoxCaps, UnseenColor};
pub use taxonomy::{parse_taxonomy, read_taxonomy};
