//! Readers and writers of scans and of the 2D-3D-S data set.
//!
//! Files on one side, the vocabulary of `s3d-geom` (meshes, clouds, cameras, rasters) on the other; nothing is computed
//! here. Every file is written **whole or not at all** ([`AtomicFile`]), the same input gives the same bytes, and every
//! [`Error`] names the file.
//!
//! - names: [`Layout`] knows where everything lies, [`ImageName`] takes a file name apart, [`Domain`] and [`Frame`] are
//!   its parts;
//! - images: [`encode_rgb8`] and [`encode_gray16`] (PNG), [`encode_xyz_half`] and [`encode_xyz_float`] (OpenEXR), with a
//!   [`Compression`] to choose, and their readers;
//! - cameras: [`PoseFile`];
//! - meshes: [`read_mesh`] and [`read_meshes`] (OBJ, glTF, PLY), with [`MeshLabels`]; [`write_rgb_obj`], [`write_semantic_obj`];
//! - scans: [`read_scene`], [`read_scan_locations`], [`Annotations`], [`AnnotationTree`], [`PointReader`];
//! - the scanner's pictures: [`PictureFolder`], [`CaptureFile`], [`read_matterport_locations`];
//! - points: [`PlyPointWriter`], [`S3disAreaWriter`], [`InstanceWriter`], which take them piece by piece;
//! - what is there: [`FileRecord`], [`write_file_list`], [`Checksum`], [`sync_data_set`];
//! - lists: [`write_labels`], [`write_splits`], [`write_image_list`]; arrays: [`NpyWriter`];
//! - what the numbers of a data set mean: [`Conventions`];
//! - packages for loaders, from the images of a data set ([`dataset_images`]): [`TarWriter`] (WebDataset),
//!   [`write_colmap_text`], [`write_nerfstudio`], [`write_coco`], [`write_image_index`] (Parquet).
//!
//! What a file holds is decided by formats.md; the docs here name its section.
//!
//! ```
//! use s3d_geom::Raster;
//! use s3d_io::{Compression, Domain, Frame, ImageName, Layout, create_dir, read_gray16, write_gray16};
//!
//! # fn main() -> s3d_io::Result<()> {
//! # let folder = tempfile::tempdir().unwrap();
//! let layout = Layout::new(folder.path());
//! let frame = Frame::View(41);
//! create_dir(&layout.image_dir(3, frame, Domain::Depth))?;
//!
//! // A wall 2 m away: 512 units a metre.
//! let path = layout.image_path(3, "5c2959c3089c4ac5a7c5c913cc0df78d", "office_5", frame, Domain::Depth);
//! write_gray16(&path, &Raster::filled(64, 64, 1024u16), Compression::Balanced)?;
//!
//! assert!(path.ends_with(
//!     "area_3/data/depth/camera_5c2959c3089c4ac5a7c5c913cc0df78d_office_5_frame_41_domain_depth.png"
//! ));
//! assert_eq!(read_gray16(&path)?.at(10, 20), 1024);
//! let name = ImageName::parse(path.file_name().unwrap().to_str().unwrap()).unwrap();
//! assert_eq!((name.room.as_str(), name.frame, name.domain), ("office_5", frame, Domain::Depth));
//! # Ok(())
//! # }
//! ```

// Whatever a file holds, reading it must not panic. What may index says so, and why.
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable,
        clippy::indexing_slicing,
        clippy::string_slice
    )
)]

pub mod camera;
pub mod cloud;
pub mod dataset;
mod error;
pub mod fs;
mod guarded;
pub mod image;
pub mod mesh;
pub mod package;
mod quote;
pub mod scene;

pub use camera::{
    CAPTURES_A_LOCATION, CaptureFile, PictureFolder, PublishedLocation, ScanLocation, read_cameras,
    read_capture_pose, read_intrinsics, read_matterport_locations, read_picture, read_picture_size,
    read_scan_locations, uuid_from_name,
};
pub use cloud::{
    AnnotatedInstance, AnnotatedRoom, AnnotationOptions, AnnotationTree, Annotations, InstanceFile,
    InstancePasses, InstanceReader, LabelledPoint, LabelledPoints, MatArea, MatObject, MatRoom, MatWriter,
    NpyWriter, OnFault, PlyPointWriter, PointPasses, PointReader, RoomFiles, S3disAreaWriter,
    S3disInstanceWriter, S3disRoomWriter, Skipped, TreeOptions, read_ply_point_count, read_point_sample,
    read_points, write_colored_points,
};
pub use dataset::{
    Conventions, DatasetImage, DepthUnits, Domain, FileRecord, Frame, ImageName, InstanceArrays,
    InstanceEntry, InstanceRecord, InstanceWriter, Layout, MAX_LABELS_OF_LOADERS, PADDED_LABELS, PROFILES,
    PoseFile, Split, UnknownDomain, UnknownWord, ViewRecord, XyzType, check_images_complete, dataset_images,
    image_stem, is_valid_room, is_valid_uuid, pad_labels, read_conventions, read_file_list,
    read_instance_arrays, read_instance_members, read_instances, read_labels, read_png_size, read_pose,
    read_splits, read_views, write_file_list, write_image_list, write_labels, write_splits,
};
pub use error::{Error, Place, Result};
pub use fs::{
    AtomicFile, BadChecksum, Checksum, ChecksumOfParts, SyncAhead, checksum_of_file, create_dir, read_json,
    sync_data_set, sync_file, write_bytes, write_json, write_whole,
};
pub use guarded::panic_is_caught;
pub use image::{
    Compression, Content, TextureFile, UnknownCompression, encode_gray16, encode_rgb8, encode_xyz_float,
    encode_xyz_half, pretty_color, read_gray16, read_rgb8, read_xyz, write_gray16, write_rgb8,
    write_xyz_float, write_xyz_half,
};
pub use mesh::{
    LabelColumn, LabelElement, MeshFile, MeshLabels, MeshOptions, MeshSource, NO_LABEL, TextureOut, UpAxis,
    read_mesh, read_mesh_with, read_meshes, read_meshes_with, write_rgb_obj, write_semantic_obj,
};
pub use package::{
    CocoCategory, CocoImage, CocoSegment, ColmapImage, ImageRow, NerfstudioCamera, NerfstudioFrame,
    SemanticRow, ShardEntry, ShardLimits, TarWriter, UnknownLabelIndex, coco_categories, coco_category_id,
    coco_panoptic, plan_shards, sample_key, sample_member, write_coco, write_colmap_binary,
    write_colmap_text, write_image_index, write_nerfstudio, write_shard_index,
};
pub use scene::{
    CameraSource, PictureKind, PictureOptions, PictureSource, PublishedArea, PublishedMesh, PublishedOptions,
    SceneFile, SkyBoxCaps, UnseenColor, read_scene,
};

/// The README's example is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
