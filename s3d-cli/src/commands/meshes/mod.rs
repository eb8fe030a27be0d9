//! Commands that make a mesh, or take one without a scene.

pub(crate) mod align;
pub(crate) mod fuse;
pub(crate) mod render;
pub(crate) mod sample;
pub(crate) mod segments;
