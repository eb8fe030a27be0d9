//! The mesh of the zero level of a grid, by marching cubes.

mod bytes;
mod mesh;
mod samples;
mod surface;
mod table;

pub use mesh::FusedMesh;
pub use surface::Surface;
