//! Readers and writers of scans and of the 2D-3D-S data set.
//!
//! Files are on one side, and the types of [`s3d_geom`] on the other: meshes, clouds, cameras, rasters. The
//! crate translates between them and computes nothing else. Three rules hold for all formats:
//!
//! - A file is written **whole or not at all** ([`fs::AtomicFile`]).
//! - The same input gives the same bytes, on every machine.
//! - An [`Error`] names the file.
//!
//! | module | files |
//! |---|---|
//! | [`mesh`] | meshes with textures and labels; the OBJ files of a data set |
//! | [`cloud`] | annotated points in twelve forms; writers of PLY, S3DIS, `pointcloud.mat`, NPY |
//! | [`camera`] | lists of scan locations and of photographs; the scanner's own pictures |
//! | [`image`] | the images of a data set, PNG and OpenEXR |
//! | [`dataset`] | the rest of a data set: names, poses, labels, instances, splits |
//! | [`package`] | WebDataset, COLMAP, nerfstudio, COCO, Parquet, from the images of a data set |
//! | [`raw`] | raw scans: depth pictures with poses, laser scans |
//! | [`scene`] | `scene.toml`; published areas as scenes |
//! | [`fs`] | files that are whole, synced and checked by checksums; JSON |
//!
//! [`formats`] defines what the files hold, and the docs here name its sections. A function that takes a path
//! has a counterpart that takes a reader, a writer or bytes; the examples below use both.
//!
//! # Reading a mesh
//!
//! [`mesh::read_mesh`] reads a mesh with its textures and labels, and [`mesh::read_meshes`] joins several
//! files. The extension tells the format. Positions are in world metres with +Z up, so the reader must know
//! which axis is up in the file.
//!
//! ```
//! use s3d_io::mesh::{UpAxis, read_mesh_from};
//! use std::path::Path;
//!
//! // A square of 2 m, with y up.
//! let obj = "v 0 0 0\nv 2 0 0\nv 2 0 -2\nv 0 0 -2\nf 1 2 3 4\n";
//! let file = read_mesh_from(obj.as_bytes(), Path::new("floor.obj"), UpAxis::Y, &Default::default())?;
//!
//! // Polygons become triangles, and z is up.
//! assert_eq!(file.mesh.faces().len(), 2);
//! assert_eq!(file.mesh.positions()[2].to_array(), [2.0, 2.0, 0.0]);
//! # Ok::<(), s3d_io::Error>(())
//! ```
//!
//! # Reading a table of annotated points
//!
//! [`cloud::Annotations`] finds rooms and their instances in tables of points, S3DIS trees, `pointcloud.mat`,
//! scans of ScanNet and labelled meshes. [`cloud::AnnotationOptions`] say what a file does not: the meaning
//! of its class numbers, the names of its columns, the room. The points stay in the file until an instance is
//! read.
//!
//! ```
//! use s3d_geom::PointCloud;
//! use s3d_io::cloud::{AnnotationOptions, Annotations};
//! use s3d_label::Class;
//! use std::{io::Cursor, path::Path};
//!
//! let ply = "ply\nformat ascii 1.0\nelement vertex 3\n\
//!            property float x\nproperty float y\nproperty float z\n\
//!            property uchar class\nproperty uchar instance\nend_header\n\
//!            0 0 0 2 0\n1 1 0.4 7 1\n1 1 0.5 7 1\n";
//! let classes = [("2".to_owned(), Some(Class::FLOOR)), ("7".to_owned(), Some(Class::CHAIR))];
//! let options = AnnotationOptions { classes: classes.into(), ..Default::default() };
//! let area = Annotations::from_reader(Cursor::new(ply), Path::new("office_3.ply"), &options)?;
//!
//! // The file is named after its room.
//! let room = &area.rooms[0];
//! assert_eq!(room.room.to_string(), "office_3");
//!
//! let chair = room.instances.iter().find(|i| i.class == Class::CHAIR).unwrap();
//! let mut points = PointCloud::default();
//! chair.read(&mut points)?;
//! assert_eq!(points.positions[1].to_array(), [1.0, 1.0, 0.5]);
//! # Ok::<(), s3d_io::Error>(())
//! ```
//!
//! # Cameras
//!
//! [`camera::read_scan_locations`] reads where a scanner stood, from a table, a COLMAP model, a
//! `transforms.json`, pose files or a Matterport's captures. [`camera::read_posed_cameras`] reads photographs
//! or views to render, with their sizes and lenses. Both take a transform from the file's frame to the world.
//!
//! ```
//! use s3d_geom::glam::DAffine3;
//! use s3d_io::camera::{parse_cameras, read_posed_cameras};
//! use std::path::Path;
//!
//! let table = b"uuid,x,y,z,qx,qy,qz,qw\n8eb9955b866b4b5f74abb1071416c628,1,2,1.5,0,0,0,1\n";
//! let locations = parse_cameras(table, Path::new("cameras.csv"))?;
//! assert_eq!(locations[0].pose.location.to_array(), [1.0, 2.0, 1.5]);
//!
//! # let folder = tempfile::tempdir().unwrap();
//! # let path = folder.path().join("views.csv");
//! std::fs::write(&path, "name,x,y,z,yaw,width,height,fov\ndoor,1,2,1.5,90,640,480,60\n").unwrap();
//! let views = read_posed_cameras(&path, &DAffine3::IDENTITY)?;
//! let camera = views.cameras[0].camera(&Default::default()).unwrap();
//! assert_eq!((camera.width, camera.height), (640, 480));
//! # Ok::<(), s3d_io::Error>(())
//! ```
//!
//! # A scene file
//!
//! A `scene.toml` names the parts of a scan: mesh, annotations, scan locations, and perhaps pictures and
//! photographs. [`scene::read_scene`] checks it, finds the files and returns their paths; it does not read
//! them. [`scene::PublishedArea`] does the same for the folder of a published area.
//!
//! ```
//! use s3d_io::mesh::UpAxis;
//! use s3d_io::scene::parse_scene;
//!
//! # let folder = tempfile::tempdir().unwrap();
//! # let folder = folder.path();
//! std::fs::write(folder.join("scan.obj"), "v 0 0 0\n").unwrap();
//! let text = "area = 1\n[mesh]\npath = \"scan.obj\"\nup = \"z\"\n";
//! let scene = parse_scene(text, &folder.join("scene.toml"))?;
//!
//! assert_eq!(scene.mesh, [folder.join("scan.obj")]);
//! assert_eq!((scene.up, scene.is_labelled), (UpAxis::Z, false));
//! # Ok::<(), s3d_io::Error>(())
//! ```
//!
//! # Writing the images of a data set
//!
//! A [`dataset::Layout`] knows the path of every file, and the functions of [`image`] write one file each.
//! Readers refuse any image of another kind, because its channels may be numbers. Loaders that were written
//! for the published data set read these files.
//!
//! ```
//! use s3d_geom::glam::dvec3;
//! use s3d_geom::{Camera, Pose, Raster};
//! use s3d_io::dataset::{Domain, Frame, ImageName, Layout, PoseFile, read_pose};
//! use s3d_io::fs::create_dir;
//! use s3d_io::image::{Compression, read_gray16, write_gray16};
//!
//! # fn main() -> s3d_io::Result<()> {
//! # let folder = tempfile::tempdir().unwrap();
//! let layout = Layout::new(folder.path());
//! let uuid = "5c2959c3089c4ac5a7c5c913cc0df78d";
//! let frame = Frame::View(41);
//! let path = |domain| layout.image_path(3, uuid, "office_5", frame, domain);
//!
//! // The depth of a wall 2 m away: 512 units a metre.
//! create_dir(&layout.image_dir(3, frame, Domain::Depth))?;
//! write_gray16(&path(Domain::Depth), &Raster::filled(64, 64, 1024u16), Compression::Balanced)?;
//! assert!(path(Domain::Depth).ends_with(
//!     "area_3/data/depth/camera_5c2959c3089c4ac5a7c5c913cc0df78d_office_5_frame_41_domain_depth.png"
//! ));
//! assert_eq!(read_gray16(&path(Domain::Depth))?.at(10, 20), 1024);
//!
//! // The camera of the image.
//! let scanner = Pose::level(dvec3(1.0, 2.0, 1.5), 0.0);
//! let camera = Camera::perspective(scanner.turned(0.3, -0.1), 1.2, 64, 64);
//! create_dir(&layout.image_dir(3, frame, Domain::Pose))?;
//! PoseFile::new(&camera, &scanner, uuid, "office_5_3", frame).write(&path(Domain::Pose))?;
//! assert_eq!(read_pose(&path(Domain::Pose))?.frame_num, frame);
//!
//! // Names can be parsed again.
//! let name = path(Domain::Depth).file_name().unwrap().to_string_lossy().into_owned();
//! let name = ImageName::parse(&name).unwrap();
//! assert_eq!((name.room.as_str(), name.frame, name.domain), ("office_5", frame, Domain::Depth));
//! # Ok(())
//! # }
//! ```
//!
//! # Warnings and errors
//!
//! An [`Error`] has a kind: the system refused, the content is wrong, the mesh cannot be used, or something
//! is not supported. All kinds name the file, and a text file's errors name the line. The message says what
//! to do if it can. Reading never panics, whatever a file holds. A small fault of a mesh or of annotations is
//! no error: the reader repairs it or leaves something out, and adds a sentence to `warnings`.
//!
//! ```
//! use s3d_io::camera::parse_cameras;
//! use s3d_io::mesh::{UpAxis, read_mesh_from};
//! use s3d_io::{Error, Place};
//! use std::path::Path;
//!
//! let error = parse_cameras(b"scan_0,1,2,three,0,0,0,1\n", Path::new("cameras.csv")).unwrap_err();
//! assert!(matches!(error, Error::Format { place: Place::Line(1), .. }));
//! assert!(error.to_string().starts_with("cameras.csv, line 1: z is \"three\""));
//!
//! let obj = "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\nf 1 2 3\n";
//! let file = read_mesh_from(obj.as_bytes(), Path::new("twice.obj"), UpAxis::Y, &Default::default())?;
//! assert_eq!((file.mesh.faces().len(), file.warnings.len()), (1, 1));
//! # Ok::<(), s3d_io::Error>(())
//! ```
//!
//! # Features
//!
//! Each format is a cargo feature, and all are on by default. A file whose format was left out is refused
//! with the name of the feature that reads it. With `default-features = false, features = ["obj"]` the crate
//! reads textured OBJ meshes and builds from 45 packages instead of 124.
//!
//! | feature | formats |
//! |---|---|
//! | `obj`, `gltf`, `ply` | meshes; OBJ is written too, with `png` |
//! | `draco` | glTF that Draco compressed |
//! | `textures` | WebP, BMP, TGA and TIFF beside PNG and JPEG |
//! | `cloud` | annotated points: the S3DIS tree, and the labels of meshes |
//! | `las`, `e57`, `npy`, `pcd`, `text`, `kitti`, `scannet`, `mat`, `ply` | annotated points of each |
//! | `labels` | files that label faces: HM3D, Replica, 3RScan, ScanNet++, Matterport3D, `scan.labels` |
//! | `camera` | lists of cameras; the scanner's pictures |
//! | `raw` | raw scans: depth pictures with poses, laser scans of each format that is built in |
//! | `png`, `exr` | the images of a data set |
//! | `dataset` | the rest of a data set: poses, labels, instances, splits, lists, conventions |
//! | `toml` | scenes: `scene.toml`, published areas |
//! | `webdataset`, `colmap`, `nerfstudio`, `coco`, `parquet`, `huggingface`, `multiview` | packages |
//! | `mesh`, `texture`, `json`, `write` | none: the common code of other features |

// Without some formats, not all of their common code is used.
#![cfg_attr(not(feature = "default"), allow(dead_code))]
// Reading must not panic, whatever a file holds. Code that may index says so, and why.
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
#[cfg(any(feature = "camera", feature = "labels"))]
mod house;
pub mod image;
#[cfg(feature = "mesh")]
pub mod mesh;
#[cfg(any(
    feature = "webdataset",
    feature = "colmap",
    feature = "nerfstudio",
    feature = "coco",
    feature = "parquet",
    feature = "multiview"
))]
pub mod package;
#[cfg(feature = "raw")]
pub mod raw;
#[cfg(feature = "toml")]
pub mod scene;

pub use error::{Error, Place, Result};
pub use guarded::panic_is_caught;

#[doc = include_str!("../docs/formats.md")]
pub mod formats {}

/// The examples of the README, which are compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
