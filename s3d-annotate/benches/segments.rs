//! Segments of a mesh.
fn main() {}
