//! Procedural furnished buildings.
//!
//! A [`Building`] is plain data: rooms with openings and finishes, things that stand in them, scan locations.
//! [`Building::demo`] is the building of `s3d demo`. [`Building::generate`] makes one by rule from
//! [`BuildingOptions`]. The modules [`building`] and [`look`] hold the parts of buildings.
//! [`Building::build`] makes an [`AnnotatedScene`]: a mesh with light and shade in its textures. Every face
//! belongs to an instance of one of the 13 classes. [`AnnotatedScene::scan`] draws the points of a scan, and
//! `AnnotatedScene::write_scan` (feature `files`, on by default) writes what `s3d export` reads. Meshes for
//! benches and tests are in [`scenes`]. The module [`device`] simulates scanners and depth cameras, and
//! [`truth`] scores a mesh that was made of what they measured.
//!
//! ```
//! use s3d_label::Class;
//! use s3d_synth::{Building, BuildingOptions};
//!
//! // Two storeys of four random rooms, with coarse textures.
//! let options = BuildingOptions { storeys: 2, texture_scale: 0.1, ..BuildingOptions::drawn(8, 42) };
//! let building = Building::generate(&options)?;
//! assert_eq!(building.rooms.len(), 10, "with a hallway a storey");
//!
//! let scene = building.build()?;
//! assert_eq!(scene.instance_of_face.len(), scene.mesh.faces().len());
//! assert!(scene.instances.iter().filter(|i| i.class == Class::FLOOR).count() == 10);
//! # Ok::<(), s3d_synth::BuildingError>(())
//! ```

// A building is checked before it is built: nothing panics but the generators of `scenes`, whose docs say
// when. Loops index lists that the same function made.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::string_slice)
)]

pub mod building;
mod construct;
pub mod device;
mod error;
#[cfg(feature = "files")]
mod files;
mod generate;
pub mod look;
mod rays;
mod scan;
mod scene;
pub mod scenes;
mod sight;
pub mod truth;

pub use building::{Building, BuildingError};
pub use error::RangeError;
#[cfg(feature = "files")]
pub use error::ScanError;
#[cfg(feature = "files")]
pub use files::{is_area_scan, is_demo_scan};
pub use generate::{BuildingOptions, FloorPlan, Models, RoomOptions, Style};
pub use scan::{Scan, ScanOptions};
pub use scene::{AnnotatedScene, Instance};
pub use sight::SightOptions;

/// The example of the README, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
