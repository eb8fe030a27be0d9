//! Procedural furnished buildings.
//!
//! A [`Building`] is plain data: rooms with openings and finishes, things that stand in them, scan locations.
//! [`Building::build`] makes an [`AnnotatedScene`] of it: a mesh with light and shade in its textures, whose every face
//! belongs to an instance of one of the 13 classes.
//!
//! ```
//! use s3d_synth::Building;
//!
//! let scene = Building { texture_scale: 0.1, ..Building::demo() }.build()?;
//! assert!(scene.mesh.faces().len() > 20_000 && scene.instances.len() > 100);
//! # Ok::<(), s3d_synth::BuildingError>(())
//! ```

// Nothing panics, whatever a building says. Loops index by what was made here.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::string_slice)
)]

pub mod building;
mod construct;
mod error;
#[cfg(feature = "files")]
mod files;
pub mod look;
mod scan;
mod scene;
pub mod scenes;

pub use building::Building;
#[cfg(feature = "files")]
pub use error::ScanError;
pub use error::{BuildingError, RangeError};
#[cfg(feature = "files")]
pub use files::is_demo_scan;
pub use scan::{Scan, ScanOptions};
pub use scene::{AnnotatedScene, Instance};
