//! numpy's arrays: NPY and NPZ.

mod array;
pub(crate) mod folder;
mod header;
mod literal;
#[cfg(feature = "dataset")]
pub(crate) mod npz;
pub(crate) mod read;
pub(crate) mod write;

pub use array::{NpyArray, NpzArchive};
pub use write::NpyWriter;
