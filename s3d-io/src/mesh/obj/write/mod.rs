//! Writes the meshes of the data set, `rgb.obj` and `semantic.obj`, with their materials. tobj only reads.
//!
//! Both files are **Y-up**, as published: (x, y, z) in them is (x, z, −y) of the Z-up world. Both have one
//! line for each face, in the order of the mesh, since consumers pair the two files face by face; `usemtl`
//! stands where the material changes. Numbers are written so that they are read back bit by bit. Source:
//! [`crate::formats`], "What is written".

mod rgb;
mod semantic;
mod statement;
#[cfg(test)]
mod tests;

pub use rgb::{RgbObj, TextureOut, write_rgb_obj};
pub use semantic::{SemanticObj, write_semantic_obj};
