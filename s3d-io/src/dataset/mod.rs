//! The parts of a data set: names, poses, labels, instances, splits, lists.

#[cfg(feature = "dataset")]
mod conventions;
pub(crate) mod domain;
#[cfg(feature = "dataset")]
mod file_list;
#[cfg(feature = "dataset")]
pub(crate) mod images;
#[cfg(feature = "dataset")]
mod instances;
#[cfg(feature = "dataset")]
mod labels;
pub(crate) mod layout;
#[cfg(feature = "dataset")]
pub(crate) mod pose;
#[cfg(feature = "dataset")]
mod splits;

#[cfg(feature = "dataset")]
pub use conventions::{Conventions, DepthUnits, UnknownWord, XyzType, read_conventions};
pub use domain::{Domain, UnknownDomain};
#[cfg(feature = "dataset")]
pub use file_list::{FileRecord, parse_file_list, read_file_list, write_file_list};
#[cfg(feature = "dataset")]
pub use images::{
    DatasetImage, ViewRecord, check_images_complete, dataset_images, read_png_size, read_views,
};
#[cfg(feature = "dataset")]
pub use instances::{
    InstanceArrays, InstanceEntry, InstanceRecord, InstanceWriter, read_instance_arrays,
    read_instance_arrays_from, read_instance_members, read_instance_members_from, read_instances,
};
#[cfg(feature = "dataset")]
pub use labels::{MAX_LABELS_OF_LOADERS, PADDED_LABELS, pad_labels, read_labels, write_labels};
pub use layout::{Frame, ImageName, Layout, PROFILES, image_stem, is_valid_room, is_valid_uuid};
#[cfg(feature = "dataset")]
pub use pose::{PoseFile, read_pose};
#[cfg(feature = "dataset")]
pub use splits::{Split, read_splits, write_image_list, write_splits};
