//! Reads annotated points of any format, and writes points.
//!
//! [`Annotations::open`] finds the rooms of an area and their instances, in files and folders of the formats
//! below. [`AnnotatedInstance::read`] reads the points of one instance: world metres, Z-up, a colour each.
//! [`InstanceReader`] reads them block by block, so instances of any size need little memory.
//! [`AnnotationOptions`] name columns, classes and rooms where a file does not. [`Annotations::from_reader`]
//! takes any reader.
//!
//! | format | its labels |
//! |---|---|
//! | S3DIS tree | names of folders and text files: [`AnnotationTree`], [`PointReader`] |
//! | `pointcloud.mat` | MATLAB v7.3, as published: [`MatArea`] |
//! | PLY, NPY, NPZ, LAS, LAZ, E57, PCD, text | columns or attributes of points |
//! | SemanticKITTI, Pointcept | a file of labels, or arrays in a folder |
//! | ScanNet | objects as lists of segments of a mesh |
//! | `scan.labels` | a folder of labels of faces: [`SavedLabels`] |
//! | a mesh | labels of its faces or vertices: [`Annotations::of_mesh`], [`Annotations::from_face_labels`] |
//! | memory | [`AnnotatedPoints`] |
//!
//! A table of points may name up to 10,000 classes, 10,000 rooms and a million instances. Coordinates become
//! `f32`; for georeferenced clouds, [`AnnotationOptions::offset_m`] is subtracted first.
//!
//! Writers take points piece by piece. They write to a path (the whole file or none) or to any `Write`:
//! [`PlyPointWriter`], read back by [`LabelledPoints`]; [`S3disAreaWriter`]; [`MatWriter`]; and [`NpyWriter`]
//! for arrays, read back by [`NpyArray`] and [`NpzArchive`]. Source: [`crate::formats`], "Annotations".
//!
//! ```
//! use s3d_geom::PointCloud;
//! use s3d_io::cloud::Annotations;
//!
//! # let folder = tempfile::tempdir().unwrap();
//! let room = folder.path().join("office_1/Annotations");
//! std::fs::create_dir_all(&room).unwrap();
//! std::fs::write(room.join("chair_1.txt"), "1 2 0.5 200 100 50\n1 2 0.6 200 100 50\n").unwrap();
//!
//! let area = Annotations::open(&[folder.path().to_owned()], &Default::default())?;
//! let chair = &area.rooms[0].instances[0];
//! let mut points = PointCloud::default();
//! chair.read(&mut points)?;
//! assert_eq!((area.rooms[0].room.to_string(), points.len()), ("office_1".to_owned(), 2));
//! # Ok::<(), s3d_io::Error>(())
//! ```

pub(crate) mod annotations;
#[cfg(feature = "e57")]
pub(crate) mod e57;
pub(crate) mod frame_gap;
pub(crate) mod kind;
#[cfg(feature = "kitti")]
mod kitti;
#[cfg(feature = "labels")]
pub(crate) mod label_files;
#[cfg(feature = "las")]
mod las;
#[cfg(feature = "mat")]
mod mat;
#[cfg(feature = "npy")]
pub(crate) mod npy;
#[cfg(feature = "labels")]
mod of_label_file;
#[cfg(feature = "mesh")]
mod of_mesh;
pub(crate) mod on_fault;
mod open;
pub(crate) mod passes;
#[cfg(feature = "pcd")]
mod pcd;
#[cfg(feature = "ply")]
pub(crate) mod ply;
mod s3dis;
#[cfg(feature = "scannet")]
mod scannet;
pub(crate) mod table;
#[cfg(feature = "text")]
pub(crate) mod text;
#[cfg(any(feature = "mesh", feature = "scannet"))]
mod words;

pub use annotations::{
    AnnotatedInstance, AnnotatedPoints, AnnotatedRoom, AnnotationOptions, Annotations, PlacedInstance,
    Skipped,
};
pub use frame_gap::FrameGap;
#[cfg(feature = "labels")]
pub use label_files::numbers::{is_number_list, read_number_list, read_whole_numbers};
#[cfg(feature = "labels")]
pub use label_files::saved::{EVENTS_FILE, LABELS_FILE, SavedLabels, mesh_checksum};
#[cfg(feature = "labels")]
pub use label_files::transfer::labels_by_place;
#[cfg(feature = "las")]
pub use las::write_las_points;
#[cfg(feature = "mat")]
pub use mat::{MatArea, MatObject, MatRoom, MatWriter};
#[cfg(feature = "npy")]
pub use npy::{NpyArray, NpyWriter, NpzArchive};
#[cfg(feature = "labels")]
pub use of_label_file::AnnotatedMesh;
pub use passes::{InstancePasses, InstanceReader, PointPasses};
#[cfg(feature = "ply")]
pub use ply::{
    ColoredPointWriter, LabelledPoint, LabelledPoints, PlyPointWriter, read_ply_point_count,
    read_point_sample, write_colored_points,
};
pub use s3dis::{
    AnnotationTree, InstanceFile, OnFault, PointReader, RoomFiles, S3disAreaWriter, S3disInstance,
    S3disInstanceWriter, S3disRoomWriter, TreeOptions, read_points, s3dis_coordinate, write_s3dis_points,
};
