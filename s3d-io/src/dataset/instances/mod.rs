//! Boxes and voxels of instances: `instances.json` and `instances.npz`.

mod arrays;
mod members;
mod surface;
mod write;

pub use arrays::{
    InstanceArrays, read_instance_arrays, read_instance_arrays_from, read_instance_members,
    read_instance_members_from,
};
pub use surface::{FreeBox, SurfaceBoxes, UprightBox};
pub use write::{InstanceEntry, InstanceRecord, InstanceWriter, read_instances};
