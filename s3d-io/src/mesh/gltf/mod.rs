//! Reads glTF 2.0, `.gltf` and `.glb`.

mod accessor;
mod builder;
mod container;
mod document;
#[cfg(feature = "draco")]
mod draco;
mod extensions;
mod features;
mod filters;
mod material;
mod meshopt;
mod objects;
pub(crate) mod read;
mod scene;
mod tolerant;
mod unpack;
mod uri;
mod words;
