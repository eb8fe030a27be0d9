//! Raw scans to meshes: depth pictures with poses, and laser scans whose scanner's place is known, are fused to a mesh
//! with colours. Values in, values out: no files.

// Only a caller's mistake panics, and a section "Panics" names it. Loops take their indices from checked
// columns.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::string_slice)
)]

mod close;
mod columns;
mod decimate;
mod error;
mod extract;
mod fusion;
mod grid;
mod noise;
mod range_image;
mod register;

pub use close::{CloseError, CloseOptions, ClosedHoles, OpenLoops, close_holes};
pub use columns::{ColumnsError, MeshColumns};
pub use decimate::{DecimateError, DecimateOptions, Decimated, decimate};
pub use error::FusionError;
pub use extract::{FusedMesh, Surface};
pub use fusion::{Fusion, FusionOptions, Tile};
pub use noise::SensorNoise;
pub use range_image::{RangeImage, RangeKind};
pub use register::{
    Motion, OpenMotion, PairResidual, RefinedPoses, RegisterError, RegisterOptions, Residual, ScanPoints,
    pair_residuals, refine_poses,
};
