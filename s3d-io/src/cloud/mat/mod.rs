//! `pointcloud.mat`, which holds the points of a published area.

mod annotations;
mod hdf5;
mod read;
mod write;

pub use read::{MatArea, MatObject, MatRoom};
pub use write::MatWriter;
