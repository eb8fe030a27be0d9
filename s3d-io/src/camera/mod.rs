//! Lists of cameras, and the scanner's own pictures. The cameras are scan locations, photographs, or views to
//! render.
//!
//! A [`ScanLocation`] is where the scanner stood and how it was turned. [`read_scan_locations`] reads any of
//! these lists:
//!
//! | path | what it is |
//! |---|---|
//! | `.csv` | a table `uuid,x,y,z,qx,qy,qz,qw`, or a target or heading: [`read_cameras`], [`parse_cameras`] |
//! | `images.txt`, `images.bin` | a COLMAP model |
//! | `transforms.json` | frames of nerfstudio, Polycam, Record3D, instant-ngp |
//! | a folder of `*.json` | pose files of a published area |
//! | `.e57` | the places of its scans |
//! | `.house` | the panoramas of a house of Matterport3D |
//! | a folder of Matterport captures | [`read_matterport_locations`] |
//!
//! The pictures of a model give locations where they were taken. A location lies at most 10,000 km from the
//! origin, and a list has each uuid once.
//!
//! [`read_posed_cameras`] reads cameras as they are. Each [`PosedCamera`] has a pose, and the size, focal
//! lengths and lens if the list tells them. It reads `transforms.json`, COLMAP models, Metashape's cameras,
//! RealityCapture's table, ScanNet's recordings, ScanNet's and 3RScan's poses, Polycam's keyframes,
//! Matterport3D's undistorted cameras, trajectories of ARKitScenes, Replica and TUM, and tables. A
//! [`Recording`] has depth too.
//! [`read_photograph_cameras`] also takes the folder of the pictures.
//!
//! A [`PictureFolder`] finds the pictures of each location: raw captures ([`CaptureFile`], with lens and
//! pose), sky boxes or panoramas. `E57Pictures` finds them in an E57 file. [`read_picture`] reads a PNG or
//! JPEG file. Source: [`crate::formats`], "Scan locations" and "The scanner's pictures".
//!
//! ```
//! use s3d_geom::glam::DAffine3;
//! use s3d_io::camera::read_scan_locations;
//!
//! # let folder = tempfile::tempdir().unwrap();
//! # let path = folder.path().join("cameras.csv");
//! std::fs::write(&path, "8eb9955b866b4b5f74abb1071416c628,1,2,1.5,0,0,0,1\n").unwrap();
//! let locations = read_scan_locations(&path, &DAffine3::IDENTITY)?;
//! assert_eq!(locations[0].pose.location.to_array(), [1.0, 2.0, 1.5]);
//! # Ok::<(), s3d_io::Error>(())
//! ```

#[cfg(feature = "e57")]
mod e57;
pub(crate) mod located;
pub(crate) mod locations;
mod matterport;
mod narrow;
pub(crate) mod numbered;
mod other_kind;
mod picture;
mod picture_file;
mod posed;
mod posed_list;
pub(crate) mod poses;
pub(crate) mod programs;
mod table;

#[cfg(feature = "e57")]
pub use e57::{E57Owners, E57Pictures, E57Shot};
pub use located::uuid_from_name;
pub use locations::read_scan_locations;
pub use matterport::{
    CAPTURES_A_LOCATION, CaptureFile, PictureFolder, parse_capture_pose, parse_intrinsics, read_capture_pose,
    read_intrinsics, read_matterport_locations,
};
pub use picture::{check_picture, decode_picture, read_picture, read_picture_size, read_picture_turn};
pub use picture_file::PictureFile;
pub use posed::{Distortion, GivenIntrinsics, IntrinsicsError, Optics, PosedCamera};
pub use posed_list::{PosedCameras, read_photograph_cameras, read_posed_cameras};
pub use poses::PublishedLocation;
pub use programs::sens::{RecordedFrame, Recording};
pub use table::{ScanLocation, parse_cameras, read_cameras};
