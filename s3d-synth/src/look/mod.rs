//! How surfaces look: what covers walls, floors and ceilings, what furniture is made of, and the images on
//! it.
//!
//! All images are computed, so that a scene needs no files, and are the same on every platform.

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
