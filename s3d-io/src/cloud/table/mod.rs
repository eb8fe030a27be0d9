//! Tables of points, called clouds: every instance of an area in one file, or in a few.

pub(crate) mod cloud;
pub(crate) mod columns;
mod gathered;
#[cfg(any(feature = "pcd", feature = "text"))]
pub(crate) mod line_block;
pub(crate) mod meaning;
pub(crate) mod measured;
mod points;
pub(crate) mod read;
pub(crate) mod records;
pub(crate) mod rows;
mod store;
pub(crate) mod wanted;
#[cfg(any(feature = "pcd", feature = "text"))]
pub(crate) mod words;
