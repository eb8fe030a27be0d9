//! An export in parts: the plan before them, and the merge after them.

pub(crate) mod merge;
pub(crate) mod plan;
