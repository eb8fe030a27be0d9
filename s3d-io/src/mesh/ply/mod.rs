//! PLY files, and the meshes in them.

pub(crate) mod batch;
pub(crate) mod elements;
mod faces;
pub(crate) mod header;
mod labels;
pub(crate) mod read;
mod source;
mod vertices;
