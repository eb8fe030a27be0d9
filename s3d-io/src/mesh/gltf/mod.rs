//! glTF 2.0, `.gltf` and `.glb`.

mod accessor;
mod builder;
mod document;
mod material;
pub(crate) mod read;
