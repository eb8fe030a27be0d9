//! Annotated points of any source, and writers of point clouds.

pub(crate) mod annotations;
mod e57;
mod las;
mod mat;
pub(crate) mod npy;
mod of_faces;
mod of_mesh;
mod open;
pub(crate) mod passes;
mod ply;
mod s3dis;
mod scannet;
mod table;

pub use annotations::{AnnotatedInstance, AnnotatedRoom, AnnotationOptions, Annotations, Skipped};
pub use mat::{MatArea, MatObject, MatRoom, MatWriter};
pub use npy::NpyWriter;
pub use passes::{InstancePasses, InstanceReader, PointPasses};
pub use ply::{
    LabelledPoint, LabelledPoints, PlyPointWriter, read_ply_point_count, read_point_sample,
    write_colored_points,
};
pub use s3dis::{
    AnnotationTree, InstanceFile, OnFault, PointReader, RoomFiles, S3disAreaWriter, S3disInstanceWriter,
    S3disRoomWriter, TreeOptions, read_points,
};
