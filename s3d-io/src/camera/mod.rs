//! Lists of cameras, and the pictures that they took.

mod colmap;
mod located;
mod locations;
mod matterport;
mod nerfstudio;
pub(crate) mod poses;
mod table;

pub use located::uuid_from_name;
pub use locations::read_scan_locations;
pub use matterport::{
    CAPTURES_A_LOCATION, CaptureFile, PictureFolder, decode_picture, parse_capture_pose, parse_intrinsics,
    read_capture_pose, read_intrinsics, read_matterport_locations, read_picture, read_picture_size,
};
pub use poses::PublishedLocation;
pub use table::{ScanLocation, parse_cameras, read_cameras};
