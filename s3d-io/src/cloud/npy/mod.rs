//! numpy's arrays: NPY and NPZ.

mod array;
pub(crate) mod folder;
mod header;
mod literal;
pub(crate) mod read;
pub(crate) mod write;

pub use array::{NpyArray, NpzArchive};
pub use write::NpyWriter;
