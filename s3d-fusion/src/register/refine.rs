//! Moves scans until their surfaces lie on each other.

use super::matches::Scans;
use super::mover::{Motion, Mover, OpenMotion, motion};
use super::pairs::PairResidual;
use super::points::ScanPoints;
use super::{RegisterError, RegisterOptions, check};
use rayon::prelude::*;
use s3d_geom::glam::DAffine3;

/// Poses after [`refine_poses`].
#[derive(Clone, Debug, PartialEq)]
pub struct RefinedPoses {
    /// World from scan.
    pub poses: Vec<DAffine3>,
    /// How far each scan moved.
    pub motions: Vec<Motion>,
    /// The pairs that overlapped, with the distances before and after. `motion` is of the second scan
    /// relative to the first.
    pub pairs: Vec<PairResidual>,
    /// For each scan, the first scan of those that it is linked with by overlaps; that one stays. A scan
    /// without an overlap has itself.
    pub group: Vec<usize>,
    /// The motions that were left alone.
    pub open: Vec<OpenMotion>,
    /// The number of steps.
    pub iterations: usize,
    /// Whether the last step was smaller than 10 µm and 10 µrad.
    pub is_converged: bool,
}

/// Moves all scans but the first together, so that surfaces seen by two scans lie on each other. `poses` are
/// world from scan, rigid, in metres.
///
/// Each step finds partners again, weights their distances along normals by the function of Geman and
/// McClure, and solves for all scans at once (Gauss and Newton). Scans that no overlap links with the first
/// scan are groups of their own, and the first scan of each group stays.
///
/// A step takes memory and time by the square and the cube of the number of scans that are linked: about a
/// second for 40 scans.
///
/// ```
/// use s3d_fusion::{RegisterOptions, ScanPoints, refine_poses};
/// use s3d_geom::glam::{DAffine3, DVec3, Vec3, vec3};
///
/// // A corner of a room from two places; the second scan is 2 cm off.
/// let mut corner = ScanPoints::default();
/// for i in 0..1600 {
///     let (u, v) = ((i % 40) as f32 * 0.05, (i / 40) as f32 * 0.05);
///     corner.positions.extend([vec3(u, v, 0.0), vec3(u, 0.0, v), vec3(0.0, u, v)]);
///     corner.normals.extend([Vec3::Z, Vec3::Y, Vec3::X]);
/// }
/// let off = DAffine3::from_translation(DVec3::new(0.01, -0.01, 0.014));
/// let scans = [corner.clone(), corner];
/// let refined = refine_poses(&scans, &[DAffine3::IDENTITY, off], &RegisterOptions::default())?;
/// assert!(refined.poses[1].translation.length() < 1e-4);
/// # Ok::<(), s3d_fusion::RegisterError>(())
/// ```
///
/// # Errors
/// [`RegisterError`] for poses that are missing or not rigid, scans without normals, and options that are not
/// above zero.
pub fn refine_poses(
    scans: &[ScanPoints],
    poses: &[DAffine3],
    options: &RegisterOptions,
) -> Result<RefinedPoses, RegisterError> {
    check(scans, poses, options)?;
    let all = Scans::new(scans, options);
    let before = all.overlapping(poses);
    let links: Vec<[usize; 2]> = before.iter().map(|(pair, _)| *pair).collect();
    let mut mover = Mover::new(&all, poses, &links);
    mover.run();

    let motions: Vec<Motion> = (0..scans.len()).map(|scan| mover.motion(poses, scan)).collect();
    let pairs = before.into_par_iter().map(|(pair, before)| {
        let [a, b] = pair;
        let after = all.residual(&mover.poses, pair).unwrap_or_default();
        // As if the first scan had stayed.
        let second = poses[a] * mover.poses[a].inverse() * mover.poses[b];
        PairResidual { scans: pair, before, after, motion: motion(scans[b].middle(), &poses[b], &second) }
    });
    Ok(RefinedPoses {
        pairs: pairs.collect(),
        motions,
        open: mover.open.iter().map(|open| mover.told(open)).collect(),
        group: mover.group,
        poses: mover.poses,
        iterations: mover.iterations,
        is_converged: mover.is_converged,
    })
}
