//! Points of two scans that belong together, and how far they are apart.

use super::RegisterOptions;
use super::points::{Grid, Reach, ScanPoints};
use rayon::prelude::*;
use s3d_geom::glam::DAffine3;

/// Distances between the surfaces of two scans, along normals, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Residual {
    /// The number of points that have a partner in the other scan.
    pub correspondences: usize,
    /// The median.
    pub median_m: f64,
    /// Nine tenths are not larger.
    pub p90_m: f64,
}

/// A point of one scan and its partner in another one, by their indices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Match {
    pub(super) from: u32,
    pub(super) to: u32,
}

/// Scans with their grids.
pub(super) struct Scans<'a> {
    pub(super) points: &'a [ScanPoints],
    grids: Vec<Grid<'a>>,
    options: &'a RegisterOptions,
}

impl<'a> Scans<'a> {
    pub(super) fn new(points: &'a [ScanPoints], options: &'a RegisterOptions) -> Self {
        let cell_m = options.max_distance_m.hypot(1.5 * options.cell_m);
        Self { points, grids: points.par_iter().map(|p| Grid::new(p, cell_m)).collect(), options }
    }

    pub(super) fn options(&self) -> &'a RegisterOptions {
        self.options
    }

    /// The partners in scan `b` of the points of scan `a`.
    pub(super) fn matches(&self, poses: &[DAffine3], a: usize, b: usize, along_m: f64) -> Vec<Match> {
        let b_from_a = poses[b].inverse() * poses[a];
        let reach = Reach {
            along_m,
            across_m: 1.5 * self.options.cell_m,
            cosine: libm::cos(self.options.max_angle_rad),
            is_two_sided: false,
        };
        let points = (0..).zip(self.points[a].positions.iter().zip(&self.points[a].normals));
        let every = self.points[a].positions.len().div_ceil(self.options.most_points.max(1));
        points
            .step_by(every.max(1))
            .filter_map(|(from, (p, n))| {
                let p = b_from_a.transform_point3(p.as_dvec3());
                let n = b_from_a.transform_vector3(n.as_dvec3());
                Some(Match { from, to: self.grids[b].nearest(p, n, &reach)? })
            })
            .collect()
    }

    /// Distances along normals of points and partners.
    pub(super) fn distances(&self, poses: &[DAffine3], a: usize, b: usize, matches: &[Match]) -> Vec<f64> {
        let b_from_a = poses[b].inverse() * poses[a];
        let distance = |m: &Match| {
            let p = b_from_a.transform_point3(self.points[a].positions[m.from as usize].as_dvec3());
            let q = self.points[b].positions[m.to as usize].as_dvec3();
            self.points[b].normals[m.to as usize].as_dvec3().dot(p - q)
        };
        matches.iter().map(distance).collect()
    }

    /// The distances of two scans in both directions; `None` if they do not overlap.
    pub(super) fn residual(&self, poses: &[DAffine3], [a, b]: [usize; 2]) -> Option<Residual> {
        let mut all = Vec::new();
        for (a, b) in [(a, b), (b, a)] {
            let matches = self.matches(poses, a, b, self.options.max_distance_m);
            all.extend(self.distances(poses, a, b, &matches).iter().map(|d| d.abs()));
        }
        if all.is_empty() || all.len() < self.options.min_correspondences {
            return None;
        }
        all.sort_unstable_by(f64::total_cmp);
        let (median_m, p90_m) = (all[all.len() / 2], all[all.len() * 9 / 10]);
        Some(Residual { correspondences: all.len(), median_m, p90_m })
    }

    /// The pairs that overlap, ascending.
    pub(super) fn overlapping(&self, poses: &[DAffine3]) -> Vec<([usize; 2], Residual)> {
        let count = self.points.len();
        let pairs: Vec<[usize; 2]> = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b])).collect();
        let found = pairs.par_iter().map(|&pair| Some((pair, self.residual(poses, pair)?)));
        found.collect::<Vec<_>>().into_iter().flatten().collect()
    }
}
