//! An export in parts: what is planned before them, and what is made of them.

pub(crate) mod merge;
pub(crate) mod plan;
