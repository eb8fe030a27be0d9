//! Reads glTF 2.0, `.gltf` and `.glb`.

mod accessor;
mod builder;
mod document;
mod extensions;
mod material;
mod objects;
pub(crate) mod read;
mod scene;
mod tolerant;
