//! The parts of a data set: names, poses, labels, instances, splits, lists.

mod conventions;
pub(crate) mod domain;
mod file_list;
pub(crate) mod images;
mod instances;
mod labels;
pub(crate) mod layout;
pub(crate) mod pose;
mod splits;

pub use conventions::{Conventions, DepthUnits, UnknownWord, XyzType, read_conventions};
pub use domain::{Domain, UnknownDomain};
pub use file_list::{FileRecord, read_file_list, write_file_list};
pub use images::{
    DatasetImage, ViewRecord, check_images_complete, dataset_images, read_png_size, read_views,
};
pub use instances::{
    InstanceArrays, InstanceEntry, InstanceRecord, InstanceWriter, read_instance_arrays,
    read_instance_members, read_instances,
};
pub use labels::{MAX_LABELS_OF_LOADERS, PADDED_LABELS, pad_labels, read_labels, write_labels};
pub use layout::{Frame, ImageName, Layout, PROFILES, image_stem, is_valid_room, is_valid_uuid};
pub use pose::{PoseFile, read_pose};
pub use splits::{Split, read_splits, write_image_list, write_splits};
