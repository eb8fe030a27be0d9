//! Boxes and voxels of instances: `instances.json` and `instances.npz`.

mod arrays;
mod members;
mod write;

pub use arrays::{InstanceArrays, read_instance_arrays, read_instance_members};
pub use write::{InstanceEntry, InstanceRecord, InstanceWriter, read_instances};
