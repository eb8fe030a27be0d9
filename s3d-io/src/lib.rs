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
//! - meshes: [`read_mesh`] (OBJ, glTF), [`write_rgb_obj`], [`write_semantic_obj`];
//! - scans: [`read_scene`], [`read_cameras`], [`AnnotationTree`], [`PointReader`];
//! - the scanner's pictures: [`PictureFolder`], [`CaptureFile`], [`read_matterport_locations`];
//! - points: [`PlyPointWriter`], [`S3disAreaWriter`], [`InstanceWriter`], which take them piece by piece;
//! - lists: [`write_labels`], [`write_splits`].
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

mod atomic;
mod cameras;
mod compression;
mod deflate;
mod error;
mod exr;
mod gltf;
mod gltf_accessor;
mod gltf_builder;
mod gltf_document;
mod gltf_material;
mod instances;
mod json;
mod labels;
mod layout;
mod matterport;
mod mesh_file;
mod mtl;
mod obj;
mod obj_diagnose;
mod obj_lines;
mod obj_looks;
mod obj_plain;
mod obj_write;
mod ply;
mod png;
mod png_filter;
mod pose;
mod pretty;
mod quote;
mod rgb_source;
mod s3dis;
mod s3dis_points;
mod s3dis_write;
mod scene;
mod splits;
mod texture_file;

pub use atomic::{AtomicFile, create_dir, write_bytes, write_whole};
pub use cameras::{ScanLocation, read_cameras};
pub use compression::{Compression, UnknownCompression};
pub use error::{Error, Place, Result};
pub use exr::{encode_xyz_float, encode_xyz_half, read_xyz, write_xyz_float, write_xyz_half};
pub use instances::{InstanceEntry, InstanceRecord, InstanceWriter, read_instances};
pub use json::{read_json, write_json};
pub use labels::{read_labels, write_labels};
pub use layout::{Domain, Frame, ImageName, Layout, UnknownDomain, image_stem, is_valid_room, is_valid_uuid};
pub use matterport::{
    CAPTURES_A_LOCATION, CaptureFile, PictureFolder, read_capture_pose, read_intrinsics, read_matterport_locations,
    read_picture, read_picture_size,
};
pub use mesh_file::{MeshFile, UpAxis, read_mesh};
pub use obj_write::{TextureOut, write_rgb_obj, write_semantic_obj};
pub use ply::{PlyPointWriter, read_ply_point_count};
pub use png::{Content, encode_gray16, encode_rgb8, read_gray16, read_rgb8, write_gray16, write_rgb8};
pub use pose::{PoseFile, read_pose};
pub use pretty::pretty_color;
pub use rgb_source::{PictureKind, PictureOptions, PictureSource, SkyBoxCaps, UnseenColor};
pub use s3dis::{AnnotationTree, InstanceFile, OnFault, RoomFiles, TreeOptions};
pub use s3dis_points::{PointReader, read_points};
pub use s3dis_write::{S3disAreaWriter, S3disInstanceWriter, S3disRoomWriter};
pub use scene::{SceneFile, read_scene};
pub use splits::{Split, read_splits, write_splits};
pub use texture_file::TextureFile;

/// The README's example is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
