//! Readers and writers of scans and of the 2D-3D-S data set.
//!
//! Files on one side, the vocabulary of `s3d-geom` (meshes, clouds, cameras, rasters) on the other; nothing
//! is computed here. Every file is written **whole or not at all** ([`fs::AtomicFile`]), the same input gives
//! the same bytes, and every [`Error`] names the file.
//!
//! | module | the files |
//! |---|---|
//! | [`mesh`] | OBJ, glTF and PLY with textures and labels: [`mesh::read_mesh`]; the data set's OBJ files |
//! | [`cloud`] | annotated points: [`cloud::Annotations`]; writers of PLY, S3DIS, `pointcloud.mat`, NPY |
//! | [`camera`] | scan locations of camera lists: [`camera::read_scan_locations`]; the scanner's pictures |
//! | [`image`] | images, PNG and OpenEXR: [`image::encode_rgb8`]; [`image::Compression`] |
//! | [`dataset`] | names: [`dataset::Layout`], [`dataset::ImageName`]; poses, labels, instances, splits |
//! | [`package`] | WebDataset, COLMAP, nerfstudio, COCO, Parquet, from the images of a data set |
//! | [`scene`] | `scene.toml`: [`scene::read_scene`]; published areas as scenes |
//! | [`fs`] | files written whole or not at all, brought to the disk, checked by their checksums; JSON |
//!
//! What a file holds is decided by formats.md; the docs here name its section.
//!
//! Each format is a cargo feature, and all are on by default. A file whose format was left out is refused
//! with the name of the feature that reads it. With `default-features = false, features = ["obj"]` the crate
//! reads textured OBJ meshes and builds from 44 packages instead of 122.
//!
//! | features | what they bring |
//! |---|---|
//! | `obj`, `gltf`, `ply` | meshes; OBJ is written too, with `png` |
//! | `cloud` | annotated points: the S3DIS tree, and labels of meshes |
//! | `las`, `e57`, `npy`, `scannet`, `mat`, `ply` | annotated points of these formats |
//! | `camera` | scan locations, the scanner's pictures |
//! | `png`, `exr` | the images of a data set |
//! | `dataset` | what else it is made of: poses, labels, instances, splits, lists, conventions |
//! | `toml` | scenes: `scene.toml`, published areas |
//! | `webdataset`, `colmap`, `nerfstudio`, `coco`, `parquet` | packages |
//! | `mesh`, `texture`, `json`, `write` | what others have in common, no format of its own |
//!
//! ```
//! use s3d_geom::Raster;
//! use s3d_io::dataset::{Domain, Frame, ImageName, Layout};
//! use s3d_io::fs::create_dir;
//! use s3d_io::image::{Compression, read_gray16, write_gray16};
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

// What formats have in common is not all used where some are left out.
#![cfg_attr(not(feature = "default"), allow(dead_code))]
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

#[cfg(any(feature = "cloud", feature = "mesh"))]
mod bounds;
#[cfg(feature = "camera")]
pub mod camera;
#[cfg(feature = "cloud")]
pub mod cloud;
pub mod dataset;
mod error;
pub mod fs;
mod guarded;
pub mod image;
#[cfg(feature = "mesh")]
pub mod mesh;
#[cfg(any(
    feature = "webdataset",
    feature = "colmap",
    feature = "nerfstudio",
    feature = "coco",
    feature = "parquet"
))]
pub mod package;
#[cfg(feature = "toml")]
pub mod scene;

pub use error::{Error, Place, Result};
pub use guarded::panic_is_caught;

#[doc = include_str!("../docs/formats.md")]
pub mod formats {}

/// The README's example is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
