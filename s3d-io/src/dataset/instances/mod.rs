//! Boxes and voxels of instances: `instances.json` and `instances.npz`.

mod arrays;
mod members;
mod surface;
mod write;

pub(crate) use arrays::text_of_units;
pub use arrays::{
    InstanceArrays, read_instance_arrays, read_instance_arrays_from, read_instance_members,
    read_instance_members_from,
};
pub use surface::{FreeBox, SurfaceBoxes, UprightBox};
pub(crate) use write::padded_units;
pub use write::{InstanceEntry, InstanceRecord, InstanceWriter, read_instances};
