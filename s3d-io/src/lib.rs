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

mod annotations;
mod atomic;
mod bounded_claims;
mod cameras;
mod checksum;
mod cloud_columns;
mod cloud_records;
mod coco;
mod colmap_images;
mod colmap_write;
mod compression;
mod conventions;
mod dataset;
mod deflate;
mod domain;
mod e57_cloud;
mod error;
mod exr;
mod face_annotations;
mod file_list;
mod flat;
mod flat_meaning;
mod flat_rows;
mod flat_store;
mod gltf;
mod gltf_accessor;
mod gltf_builder;
mod gltf_document;
mod gltf_material;
mod guarded;
mod hdf5;
mod instance_arrays;
mod instance_passes;
mod instances;
mod json;
mod labelled_points;
mod labels;
mod las_cloud;
mod layout;
mod located_picture;
mod mat_annotations;
mod mat_read;
mod mat_write;
mod matterport;
mod mesh_annotations;
mod mesh_file;
mod mesh_join;
mod mesh_labels;
mod mtl;
mod nerfstudio_frames;
mod nerfstudio_write;
mod npy_cloud;
mod npy_header;
mod npy_write;
mod obj;
mod obj_diagnose;
mod obj_lines;
mod obj_looks;
mod obj_plain;
mod obj_write;
mod parquet_index;
mod ply;
mod ply_batch;
mod ply_cloud;
mod ply_elements;
mod ply_faces;
mod ply_header;
mod ply_labels;
mod ply_mesh;
mod ply_source;
mod ply_vertices;
mod png;
mod png_filter;
mod point_sample;
mod pose;
mod pose_locations;
mod pretty;
mod published;
mod quote;
mod rgb_source;
mod s3dis;
mod s3dis_points;
mod s3dis_write;
mod scan_locations;
mod scannet_cloud;
mod scene;
mod scene_annotations;
mod scene_cameras;
mod splits;
mod sync;
mod tar;
mod texture_file;
mod voxel_members;
mod webdataset;

pub use annotations::{AnnotatedInstance, AnnotatedRoom, AnnotationOptions, Annotations, Skipped};
pub use atomic::{AtomicFile, create_dir, write_bytes, write_whole};
pub use cameras::{ScanLocation, read_cameras};
pub use checksum::{BadChecksum, Checksum, ChecksumOfParts, checksum_of_file};
pub use coco::{
    CocoCategory, CocoImage, CocoSegment, UnknownLabelIndex, coco_categories, coco_category_id,
    coco_panoptic, write_coco,
};
pub use colmap_write::{ColmapImage, write_colmap_binary, write_colmap_text};
pub use compression::{Compression, UnknownCompression};
pub use conventions::{Conventions, DepthUnits, UnknownWord, XyzType, read_conventions};
pub use dataset::{
    DatasetImage, ViewRecord, check_images_complete, dataset_images, read_png_size, read_views,
};
pub use domain::{Domain, UnknownDomain};
pub use error::{Error, Place, Result};
pub use exr::{encode_xyz_float, encode_xyz_half, read_xyz, write_xyz_float, write_xyz_half};
pub use file_list::{FileRecord, read_file_list, write_file_list};
pub use guarded::panic_is_caught;
pub use instance_arrays::{InstanceArrays, read_instance_arrays, read_instance_members};
pub use instance_passes::{InstancePasses, InstanceReader, PointPasses};
pub use instances::{InstanceEntry, InstanceRecord, InstanceWriter, read_instances};
pub use json::{read_json, write_json};
pub use labelled_points::{LabelledPoint, LabelledPoints};
pub use labels::{MAX_LABELS_OF_LOADERS, PADDED_LABELS, pad_labels, read_labels, write_labels};
pub use layout::{Frame, ImageName, Layout, PROFILES, image_stem, is_valid_room, is_valid_uuid};
pub use located_picture::uuid_from_name;
pub use mat_read::{MatArea, MatObject, MatRoom};
pub use mat_write::MatWriter;
pub use matterport::{
    CAPTURES_A_LOCATION, CaptureFile, PictureFolder, read_capture_pose, read_intrinsics,
    read_matterport_locations, read_picture, read_picture_size,
};
pub use mesh_file::{MeshFile, MeshOptions, UpAxis, read_mesh, read_mesh_with};
pub use mesh_join::{MeshSource, read_meshes, read_meshes_with};
pub use mesh_labels::{LabelColumn, LabelElement, MeshLabels, NO_LABEL};
pub use nerfstudio_write::{NerfstudioCamera, NerfstudioFrame, write_nerfstudio};
pub use npy_write::NpyWriter;
pub use obj_write::{TextureOut, write_rgb_obj, write_semantic_obj};
pub use parquet_index::{ImageRow, SemanticRow, write_image_index};
pub use ply::{PlyPointWriter, read_ply_point_count};
pub use png::{Content, encode_gray16, encode_rgb8, read_gray16, read_rgb8, write_gray16, write_rgb8};
pub use point_sample::{read_point_sample, write_colored_points};
pub use pose::{PoseFile, read_pose};
pub use pose_locations::PublishedLocation;
pub use pretty::pretty_color;
pub use published::{PublishedArea, PublishedMesh, PublishedOptions};
pub use rgb_source::{PictureKind, PictureOptions, PictureSource, SkyBoxCaps, UnseenColor};
pub use s3dis::{AnnotationTree, InstanceFile, OnFault, RoomFiles, TreeOptions};
pub use s3dis_points::{PointReader, read_points};
pub use s3dis_write::{S3disAreaWriter, S3disInstanceWriter, S3disRoomWriter};
pub use scan_locations::read_scan_locations;
pub use scene::{SceneFile, read_scene};
pub use scene_cameras::CameraSource;
pub use splits::{Split, read_splits, write_image_list, write_splits};
pub use sync::{SyncAhead, sync_data_set, sync_file};
pub use tar::TarWriter;
pub use texture_file::TextureFile;
pub use webdataset::{ShardEntry, ShardLimits, plan_shards, sample_key, sample_member, write_shard_index};

/// The README's example is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
