//! How surfaces look: materials, finishes and the images on them.

pub(crate) mod finishes;
pub(crate) mod materials;
pub(crate) mod noise;
mod pictures;
pub(crate) mod textures;
