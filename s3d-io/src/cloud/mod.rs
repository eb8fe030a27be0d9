//! Annotated points of any source, and writers of point clouds.

pub(crate) mod annotations;
#[cfg(feature = "e57")]
mod e57;
#[cfg(feature = "las")]
mod las;
#[cfg(feature = "mat")]
mod mat;
#[cfg(feature = "npy")]
pub(crate) mod npy;
mod of_faces;
mod of_memory;
#[cfg(feature = "mesh")]
mod of_mesh;
mod open;
pub(crate) mod passes;
#[cfg(feature = "ply")]
mod ply;
mod s3dis;
#[cfg(feature = "scannet")]
mod scannet;
mod table;

pub use annotations::{AnnotatedInstance, AnnotatedRoom, AnnotationOptions, Annotations, Skipped};
#[cfg(feature = "mat")]
pub use mat::{MatArea, MatObject, MatRoom, MatWriter};
#[cfg(feature = "npy")]
pub use npy::NpyWriter;
pub use of_memory::AnnotatedPoints;
pub use passes::{InstancePasses, InstanceReader, PointPasses};
#[cfg(feature = "ply")]
pub use ply::{
    LabelledPoint, LabelledPoints, PlyPointWriter, read_ply_point_count, read_point_sample,
    write_colored_points,
};
pub use s3dis::{
    AnnotationTree, InstanceFile, OnFault, PointReader, RoomFiles, S3disAreaWriter, S3disInstanceWriter,
    S3disRoomWriter, TreeOptions, read_points,
};
