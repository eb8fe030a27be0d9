//! Procedural furnished buildings: scenes with an annotation, and the files of a scan of them.

mod building;
mod construct;
mod error;
mod look;
mod scan;
mod scene;

pub use error::ScanError;
pub use scan::{is_demo_scan, write_scan};
pub use scene::{DemoInstance, DemoLocation, DemoScene, demo_scene};
