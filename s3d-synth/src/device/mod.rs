//! Simulated devices: what a laser scanner or a depth camera measures of a scene, faults included.
//!
//! [`ScanTarget`] is a scene with a tree for rays. [`ScanTarget::laser_scan`] returns what a spherical laser
//! scanner on its tripod measures, and [`ScanTarget::depth_picture`] what a structured-light camera does.
//! [`turntable_poses`] and [`ScanTarget::hand_held_poses`] say where cameras stand. All of it is plain data.
//! It depends on the seed and the number of the scan or picture, and not on threads.
//!
//! ```
//! use s3d_synth::Building;
//! use s3d_synth::device::{DepthCamera, ScanTarget, turntable_poses};
//!
//! let scene = Building { texture_scale: 0.05, ..Building::demo() }.build()?;
//! let target = ScanTarget::new(&scene);
//! let camera = DepthCamera::turntable().scaled(0.05);
//! let poses = turntable_poses(&scene.locations[0]);
//! let pictures = (0..).zip(&poses).map(|(number, stop)| target.depth_picture(&stop.pose, &camera, number));
//! let pictures = pictures.collect::<Result<Vec<_>, _>>()?;
//!
//! // 18 pictures a location; most pixels have a depth.
//! let depths = pictures.iter().flat_map(|picture| picture.depth.pixels());
//! let (known, all) = (depths.clone().filter(|d| d.is_finite()).count(), depths.count());
//! assert!(pictures.len() == 18 && known * 2 > all);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod chance;
mod depth_camera;
mod disturbance;
mod laser;
mod poses;
mod target;

pub use depth_camera::{DepthCamera, DepthPicture};
pub use disturbance::{Disturbances, Mirror, Walker};
pub use laser::{LaserScan, LaserScanner};
pub use poses::{TurntableStop, turntable_poses};
pub use target::ScanTarget;
