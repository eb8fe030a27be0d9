//! `scene.toml`, and published areas as scenes.

mod annotations;
mod cameras;
mod file;
mod published;
mod rgb;

pub use cameras::CameraSource;
pub use file::{SceneFile, parse_scene, read_scene};
pub use published::{PublishedArea, PublishedMesh, PublishedOptions};
pub use rgb::{PictureKind, PictureOptions, PictureSource, SkyBoxCaps, UnseenColor};
