//! Tables of points: every instance of an area in one file, or in a few.

pub(crate) mod cloud;
pub(crate) mod columns;
pub(crate) mod meaning;
pub(crate) mod read;
pub(crate) mod records;
pub(crate) mod rows;
mod store;
