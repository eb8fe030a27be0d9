//! The looks of surfaces: finishes of walls, floors and ceilings, materials of furniture, and the images on
//! it.
//!
//! All images are computed, so that a scene needs no files. They are the same on every platform.

mod finishes;
mod materials;
mod noise;
mod pictures;
mod textures;

pub use finishes::{CeilingFinish, FloorFinish, Paint};
pub use materials::*;
pub(crate) use noise::hash;
pub use textures::{Pattern, Wood};
pub(crate) use textures::{scaled, to_bytes};
