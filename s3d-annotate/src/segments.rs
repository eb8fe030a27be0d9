//! Segments of a mesh.
