//! Buffers that are compressed: by meshoptimizer, its filters, or Draco.

#[cfg(feature = "draco")]
pub(crate) mod draco;
mod filters;
mod meshopt;
pub(crate) mod unpack;
