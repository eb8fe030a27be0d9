//! Reads glTF 2.0, `.gltf` and `.glb`.

mod accessor;
mod builder;
mod container;
mod document;
mod extensions;
mod features;
mod material;
mod objects;
mod packed;
pub(crate) mod read;
mod scene;
mod tolerant;
mod uri;
pub(super) mod words;

pub(crate) use material::linear_from_srgb;
