//! Reads and writes Wavefront OBJ with its material libraries.

mod diagnose;
mod lines;
mod looks;
mod mtl;
#[cfg(feature = "png")]
mod names;
mod normal;
pub(crate) mod read;
mod statement;
mod tiles;
#[cfg(feature = "png")]
mod write;

#[cfg(feature = "png")]
pub use write::{RgbObj, SemanticObj, TextureOut, write_rgb_obj, write_semantic_obj};
