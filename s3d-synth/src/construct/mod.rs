//! From what stands where to annotated surfaces with the light in their looks.

pub(crate) mod builder;
mod furniture;
mod light;
mod models;
mod openings;
pub(crate) mod shell;
mod things;
