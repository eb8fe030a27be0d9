//! Whether scans fit each other, and poses that make them fit better.
//!
//! [`pair_residuals`] tells how far the surfaces of two scans are apart where both saw them. [`refine_poses`]
//! moves all scans together, by point to plane. Neither finds unknown poses: scans must lie within
//! [`RegisterOptions::max_distance_m`] of each other.
//!
//! Some motions change no residual: a scan in a bare corridor slides along it. Such a direction is left as it
//! is and told ([`OpenMotion`]), since noise alone would decide it.

mod matches;
mod mover;
mod pairs;
mod points;
mod refine;
mod system;

pub use matches::Residual;
pub use mover::{Motion, OpenMotion};
pub use pairs::{PairResidual, pair_residuals};
pub use points::ScanPoints;
pub use refine::{RefinedPoses, refine_poses};

pub(crate) use points::{Grid, Reach, cell};
pub(crate) use system::{Arm, Open, System};

use s3d_geom::glam::{DAffine3, DMat3};
use thiserror::Error;

/// How scans are compared and moved.
#[derive(Clone, Debug, PartialEq)]
pub struct RegisterOptions {
    /// The edge of the cubes that [`ScanPoints::sampled`] thinned the scans with, metres. Points belong
    /// together up to 1.5 times this distance along the surface.
    pub cell_m: f64,
    /// How far two surfaces may be apart and still be the same one, metres.
    pub max_distance_m: f64,
    /// The largest angle between the normals of points that belong together, radians.
    pub max_angle_rad: f64,
    /// Partners are looked up for so many points of a scan at most, evenly spread over all.
    pub most_points: usize,
    /// Two scans overlap if so many of their points belong together.
    pub min_correspondences: usize,
    /// A motion is left alone if less than this share of it is along normals: the mean of the squared
    /// cosines, 0 to 1. Noise of normals by 4° is a share of 0.005.
    pub least_share: f64,
    /// The largest number of steps.
    pub iterations: usize,
}

impl Default for RegisterOptions {
    fn default() -> Self {
        Self {
            cell_m: 0.05,
            max_distance_m: 0.25,
            max_angle_rad: 0.5,
            most_points: usize::MAX,
            min_correspondences: 200,
            least_share: 0.01,
            iterations: 40,
        }
    }
}

/// The reason why scans are not compared.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RegisterError {
    /// There is not one pose per scan.
    #[error("{poses} poses for {scans} scans: give one pose per scan")]
    Poses {
        /// The number of poses.
        poses: usize,
        /// The number of scans.
        scans: usize,
    },
    /// A scan has points without normals, or numbers that are not finite.
    #[error(
        "scan {scan}: {positions} points and {normals} normals: give one finite unit normal per finite point"
    )]
    Normals {
        /// Index of the scan, from 0.
        scan: usize,
        /// The number of points.
        positions: usize,
        /// The number of normals.
        normals: usize,
    },
    /// A pose is more than a rotation and a translation.
    #[error(
        "the pose of scan {scan} is not rigid: its 3 × 3 part must be a rotation, without scale or mirror"
    )]
    NotRigid {
        /// Index of the scan, from 0.
        scan: usize,
    },
    /// An option is not a positive number.
    #[error("{what} is {value}: give a number above zero")]
    Option {
        /// What the option is.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Checks what both calls take.
fn check(scans: &[ScanPoints], poses: &[DAffine3], options: &RegisterOptions) -> Result<(), RegisterError> {
    if poses.len() != scans.len() {
        return Err(RegisterError::Poses { poses: poses.len(), scans: scans.len() });
    }
    let is_whole = |s: &ScanPoints| {
        let numbers = s.positions.iter().all(|p| p.is_finite());
        numbers && s.positions.len() == s.normals.len() && s.normals.iter().all(|n| n.is_normalized())
    };
    if let Some(scan) = scans.iter().position(|s| !is_whole(s)) {
        let (positions, normals) = (scans[scan].positions.len(), scans[scan].normals.len());
        return Err(RegisterError::Normals { scan, positions, normals });
    }
    let is_rigid = |pose: &DAffine3| {
        let product = pose.matrix3.transpose() * pose.matrix3;
        let is_rotation = product.abs_diff_eq(DMat3::IDENTITY, 1e-4) && pose.matrix3.determinant() > 0.0;
        is_rotation && pose.translation.is_finite()
    };
    if let Some(scan) = poses.iter().position(|pose| !is_rigid(pose)) {
        return Err(RegisterError::NotRigid { scan });
    }

    let numbers = [
        ("the edge of the cubes", options.cell_m),
        ("the largest distance", options.max_distance_m),
        ("the largest angle", options.max_angle_rad),
    ];
    match numbers
        .into_iter()
        .find(|(_, value)| !value.is_finite() || *value <= 0.0)
    {
        Some((what, value)) => Err(RegisterError::Option { what, value }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
