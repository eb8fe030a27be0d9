//! Wavefront OBJ with its material libraries.

mod diagnose;
pub(crate) mod lines;
pub(crate) mod looks;
mod mtl;
mod plain;
pub(crate) mod read;
mod write;

pub use write::{TextureOut, write_rgb_obj, write_semantic_obj};
