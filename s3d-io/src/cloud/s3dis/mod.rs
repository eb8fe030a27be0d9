//! The S3DIS tree: folders of text files with points.

pub(crate) mod points;
pub(crate) mod tree;
mod write;

pub use crate::cloud::on_fault::OnFault;
pub use points::{PointReader, read_points};
pub use tree::{AnnotationTree, InstanceFile, RoomFiles, TreeOptions};
pub use write::{
    S3disAreaWriter, S3disInstance, S3disInstanceWriter, S3disRoomWriter, s3dis_coordinate,
    write_s3dis_points,
};
