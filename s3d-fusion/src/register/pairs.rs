//! How far the surfaces of two scans are apart, and what a motion would change.

use super::matches::{Residual, Scans};
use super::mover::{Motion, Mover};
use super::points::ScanPoints;
use super::{RegisterError, RegisterOptions, check};
use rayon::prelude::*;
use s3d_geom::glam::DAffine3;

/// Two scans that overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct PairResidual {
    /// Indices of the scans, ascending.
    pub scans: [usize; 2],
    /// The distances as the scans lie.
    pub before: Residual,
    /// The distances after the best motion of the second scan by itself.
    pub after: Residual,
    /// This motion.
    pub motion: Motion,
}

/// Compares all scans that overlap, pair by pair. `poses` are world from scan, rigid, in metres.
///
/// A pair whose `after` is much smaller than its `before` is off by `motion`. Residuals that stay large have
/// other causes: noise, things that moved, a scan bent in itself.
///
/// # Errors
/// [`RegisterError`] for poses that are missing or not rigid, scans without normals, and options that are not
/// above zero.
pub fn pair_residuals(
    scans: &[ScanPoints],
    poses: &[DAffine3],
    options: &RegisterOptions,
) -> Result<Vec<PairResidual>, RegisterError> {
    check(scans, poses, options)?;
    let all = Scans::new(scans, options);
    let pairs = all.overlapping(poses);
    let told = pairs.par_iter().map(|&(pair, before)| {
        let mut mover = Mover::new(&all, poses, &[pair]);
        mover.run();
        let after = all.residual(&mover.poses, pair).unwrap_or(before);
        PairResidual { scans: pair, before, after, motion: mover.motion(poses, pair[1]) }
    });
    Ok(told.collect())
}
