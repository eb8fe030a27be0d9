//! The parts of a data set besides images, meshes and points: names, poses, labels, instances, splits and
//! lists.
//!
//! - Names: a [`Layout`] knows the path of every file. An [`ImageName`] is the name of an image, parsed into
//!   scan location, room, [`Frame`] and [`Domain`]. They need no cargo feature.
//! - [`dataset_images`] lists the images on the disk, with the domains of each ([`DatasetImage`]).
//! - [`PoseFile`]: the camera of an image, `*.json`.
//! - [`read_labels`], [`write_labels`]: `semantic_labels.json`. The usual loaders handle at most
//!   [`MAX_LABELS_OF_LOADERS`].
//! - [`read_taxonomy_json`], [`write_taxonomy_json`]: `taxonomy.json`, if the classes are not S3DIS's.
//! - [`InstanceWriter`]: boxes and voxels of instances, `instances.json` and `instances.npz`. They are read
//!   by [`read_instances`] and [`read_instance_arrays`].
//! - [`ObjectsFile`]: the objects of an image, with what hides them.
//! - [`PairColumns`]: `pairs.npz`, the images that see the same surface.
//! - [`Split`]: folds of areas; [`write_image_list`]: lists of images.
//! - [`FileRecord`]: `files.csv`, the sizes and checksums of all files.
//! - [`BundleWriter`]: many files in one, until they are packed.
//! - [`Conventions`]: `conventions.json`, the meaning of the numbers.
//!
//! Source: [`crate::formats`], "What is written".
//!
//! ```
//! use s3d_io::dataset::{Domain, Frame, ImageName, Layout};
//!
//! let layout = Layout::new("out");
//! let path = layout.image_path(3, "5c2959c3", "office_5", Frame::View(41), Domain::Depth);
//! let name = path.file_name().unwrap().to_str().unwrap();
//! assert_eq!(name, "camera_5c2959c3_office_5_frame_41_domain_depth.png");
//! assert_eq!(ImageName::parse(name).unwrap().domain, Domain::Depth);
//! ```

#[cfg(feature = "dataset")]
mod bundle;
#[cfg(feature = "dataset")]
mod conventions;
pub(crate) mod domain;
#[cfg(feature = "dataset")]
mod face_votes;
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
pub(crate) mod objects;
#[cfg(feature = "dataset")]
mod pairs;
#[cfg(feature = "dataset")]
mod point_boxes;
#[cfg(feature = "dataset")]
pub(crate) mod pose;
#[cfg(feature = "dataset")]
mod source_faces;
#[cfg(feature = "dataset")]
mod splits;
#[cfg(feature = "dataset")]
pub(crate) mod taxonomy;

#[cfg(feature = "dataset")]
pub use bundle::{BundleWriter, BundledFile, read_bundle};
#[cfg(feature = "dataset")]
pub use conventions::{
    Conventions, DepthUnits, UnknownWord, WorldOffsets, XyzType, read_conventions, read_world_offsets,
};
pub use domain::{Domain, PixelKind, UnknownDomain};
#[cfg(feature = "dataset")]
pub use face_votes::{FaceVoteColumns, read_face_votes, read_face_votes_from, write_face_votes};
#[cfg(feature = "dataset")]
pub use file_list::{
    CheckedFile, FileRecord, file_list_checksum, parse_file_list, read_file_list, write_file_list,
};
#[cfg(feature = "dataset")]
pub use images::{
    DatasetImage, PhotographRecord, ViewRecord, check_images_complete, dataset_images, read_photographs,
    read_png_size, read_png_size_from, read_views,
};
#[cfg(feature = "dataset")]
pub use instances::{
    FreeBox, InstanceArrays, InstanceEntry, InstanceRecord, InstanceWriter, SurfaceBoxes, UprightBox,
    read_instance_arrays, read_instance_arrays_from, read_instance_members, read_instance_members_from,
    read_instances,
};
#[cfg(feature = "dataset")]
pub use labels::{MAX_LABELS_OF_LOADERS, PADDED_LABELS, pad_labels, read_labels, write_labels};
pub use layout::{Frame, ImageName, Layout, PROFILES, image_stem, is_valid_room, is_valid_uuid};
#[cfg(feature = "dataset")]
pub use objects::{
    BeyondFrame, BoxAngles, BoxCorners, Corner, Hider, ImageObject, ObjectsFile, RunLengths, read_objects,
};
#[cfg(feature = "dataset")]
pub use pairs::{PairColumns, read_pairs, write_pairs};
#[cfg(feature = "dataset")]
pub use point_boxes::{PointBox, read_point_boxes, write_point_boxes};
#[cfg(feature = "dataset")]
pub use pose::{PoseFile, read_pose};
#[cfg(feature = "dataset")]
pub use source_faces::{SourceFaces, read_source_faces, read_source_faces_from, write_source_faces};
#[cfg(feature = "dataset")]
pub use splits::{Split, read_splits, write_image_list, write_splits};
#[cfg(feature = "dataset")]
pub use taxonomy::{read_taxonomy_json, read_taxonomy_json_or_s3dis, write_taxonomy_json};
