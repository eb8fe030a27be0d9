//! numpy's arrays, NPY and NPZ.

mod header;
pub(crate) mod read;
pub(crate) mod write;

pub use write::NpyWriter;
