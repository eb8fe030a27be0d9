//! Scans on their way to each other, step by step.

use super::RegisterOptions;
use super::matches::{Match, Scans};
use super::system::{Arm, Open, RIGID, System};
use rayon::prelude::*;
use s3d_geom::glam::{DAffine3, DMat3, DQuat, DVec3};

/// How far a scan moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// How far the mean of its points moved, world metres.
    pub translation: DVec3,
    /// The rotation about this mean: an axis in the world, as long as the angle in radians.
    pub rotation: DVec3,
}

/// A motion of scans that changes no distance along normals: nothing was done along it.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenMotion {
    /// The share of the motion that is along normals: the mean squared cosine, 0 to 1.
    pub share: f64,
    /// The scans that move in it, each with a motion relative to the first scan of its group. The largest
    /// translation, or rotation in radians, is 1.
    pub motions: Vec<(usize, Motion)>,
}

/// The motion between two poses of a scan whose points have the mean `middle`.
pub(super) fn motion(middle: DVec3, before: &DAffine3, after: &DAffine3) -> Motion {
    let turn = DQuat::from_mat3(&(after.matrix3 * before.matrix3.transpose()));
    let translation = after.transform_point3(middle) - before.transform_point3(middle);
    Motion { translation, rotation: turn.to_scaled_axis() }
}

/// Scans on their way.
pub(super) struct Mover<'a> {
    scans: &'a Scans<'a>,
    options: &'a RegisterOptions,
    links: Vec<[usize; 2]>,
    pub(super) poses: Vec<DAffine3>,
    pub(super) group: Vec<usize>,
    /// The scans that may move, ascending, and for each scan its place among them.
    moving: Vec<usize>,
    place: Vec<Option<usize>>,
    pub(super) open: Vec<Open>,
    pub(super) iterations: usize,
    pub(super) is_converged: bool,
}

/// Distances along normals that are sought at the end, at least, metres.
const LEAST_REACH_M: f64 = 0.02;

/// The least width of the weights, metres.
const LEAST_WIDTH_M: f64 = 0.001;

/// A step below this, in metres and radians, is the last one.
const LAST_STEP: f64 = 1e-5;

impl<'a> Mover<'a> {
    pub(super) fn new(scans: &'a Scans<'a>, poses: &[DAffine3], links: &[[usize; 2]]) -> Self {
        // The smallest number goes along the links until nothing changes.
        let mut group: Vec<usize> = (0..poses.len()).collect();
        loop {
            let old = group.clone();
            for &[a, b] in links {
                let least = group[a].min(group[b]);
                (group[a], group[b]) = (least, least);
            }
            if group == old {
                break;
            }
        }
        let moving: Vec<usize> = (0..poses.len()).filter(|&scan| group[scan] != scan).collect();
        let place = (0..poses.len()).map(|scan| moving.binary_search(&scan).ok()).collect();
        Self {
            options: scans.options(),
            scans,
            links: links.to_vec(),
            poses: poses.to_vec(),
            group,
            moving,
            place,
            open: Vec::new(),
            iterations: 0,
            is_converged: true,
        }
    }

    pub(super) fn motion(&self, before: &[DAffine3], scan: usize) -> Motion {
        motion(self.scans.points[scan].middle(), &before[scan], &self.poses[scan])
    }

    /// Steps until they are small. The reach shrinks on the way, since far partners are wrong ones by then.
    pub(super) fn run(&mut self) {
        if self.moving.is_empty() {
            return;
        }
        let mut reach_m = self.options.max_distance_m;
        self.is_converged = false;
        while self.iterations < self.options.iterations && !self.is_converged {
            self.iterations += 1;
            let (largest, width_m) = self.step(reach_m);
            let least_m = LEAST_REACH_M.max(6.0 * width_m).min(self.options.max_distance_m);
            let is_narrow = reach_m <= least_m;
            self.is_converged = largest < LAST_STEP && is_narrow;
            if self.iterations >= 3 {
                reach_m = least_m.max(0.7 * reach_m);
            }
        }
    }

    /// One step. Returns the largest motion, in metres or radians, and the width of the weights.
    fn step(&mut self, reach_m: f64) -> (f64, f64) {
        let links = self
            .links
            .iter()
            .flat_map(|&[a, b]| [[a, b], [b, a]])
            .collect::<Vec<_>>();
        let found: Vec<(Vec<Match>, Vec<f64>)> = links
            .par_iter()
            .map(|&[a, b]| {
                let matches = self.scans.matches(&self.poses, a, b, reach_m);
                let distances = self.scans.distances(&self.poses, a, b, &matches);
                (matches, distances)
            })
            .collect();

        // Twice the standard deviation of the distances, if they were normal.
        let mut sizes: Vec<f64> = found.iter().flat_map(|(_, d)| d.iter().map(|d| d.abs())).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let median = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
        let width_m = (2.0 * 1.4826 * median).max(LEAST_WIDTH_M);

        let middles: Vec<DVec3> = self
            .poses
            .iter()
            .zip(self.scans.points)
            .map(|(pose, p)| pose.transform_point3(p.middle()))
            .collect();
        let mut system = System::new(self.moving.len(), RIGID);
        for (&[a, b], (matches, distances)) in links.iter().zip(&found) {
            let (points, partners) = (&self.scans.points[a], &self.scans.points[b]);
            for (m, &distance) in matches.iter().zip(distances) {
                let p = self.poses[a].transform_point3(points.positions[m.from as usize].as_dvec3());
                let normal = self.poses[b].transform_vector3(partners.normals[m.to as usize].as_dvec3());
                let arms = [a, b].map(|scan| Arm { place: self.place[scan], arm: p - middles[scan] });
                let spread = 1.0 + (distance / width_m) * (distance / width_m);
                system.add(arms, normal, distance, 1.0 / (spread * spread));
            }
        }

        let (step, open) = system.solve(self.options.least_share);
        self.open = open;
        for (&scan, motion) in self.moving.iter().zip(step.chunks_exact(RIGID.len())) {
            let [translation, rotation] = [0, 3].map(|i| DVec3::new(motion[i], motion[i + 1], motion[i + 2]));
            let turn = DMat3::from_quat(DQuat::from_scaled_axis(rotation));
            let pose = &self.poses[scan];
            let middle = middles[scan];
            // The rotation is made exact, so that many steps do not add up to a scale.
            let matrix3 = DMat3::from_quat(DQuat::from_mat3(&(turn * pose.matrix3)).normalize());
            let translation = turn * (pose.translation - middle) + middle + translation;
            self.poses[scan] = DAffine3 { matrix3, translation };
        }
        (step.iter().fold(0.0, |largest, s| largest.max(s.abs())), width_m)
    }

    /// An open direction in terms of scans.
    pub(super) fn told(&self, open: &Open) -> OpenMotion {
        let largest = open.motion.iter().fold(0.0, |largest: f64, m| largest.max(m.abs()));
        let scaled: Vec<f64> = open.motion.iter().map(|m| m / largest.max(f64::MIN_POSITIVE)).collect();
        let motions = self
            .moving
            .iter()
            .zip(scaled.chunks_exact(RIGID.len()))
            .filter_map(|(&scan, m)| {
                let motion = Motion {
                    translation: DVec3::new(m[0], m[1], m[2]),
                    rotation: DVec3::new(m[3], m[4], m[5]),
                };
                let moves = motion.translation.length().max(motion.rotation.length()) > 0.05;
                moves.then_some((scan, motion))
            });
        OpenMotion { share: open.share, motions: motions.collect() }
    }
}
