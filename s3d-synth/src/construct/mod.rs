//! From what stands where to annotated surfaces.

pub(crate) mod builder;
pub(crate) mod furniture;
mod light;
mod openings;
pub(crate) mod shell;
pub(crate) mod things;
