//! What a place sees of the surface, and whether the place is inside.

use super::standing::Facing;
use crate::context::Context;
use crate::error::Result;
use crate::survey::rooms_around::directions;
use glam::DVec3;
use rayon::prelude::*;
use s3d_geom::{Density, PointCloud, SurfaceSampler, TriMesh};
use s3d_render::{Scene, Sight, cast_ray};

/// The number of surface samples per m², and the smallest and largest number of them in all.
const SAMPLES_PER_M2: f64 = 5.0;
const FEWEST_SAMPLES: u64 = 3000;
const MOST_SAMPLES: u64 = 30_000;

/// The distance beyond which a surface is not seen, metres. A texel of a scanner's picture is then about a
/// centimetre wide.
const REACH_M: f64 = 10.0;

/// The cosine of 78°. A surface seen at a flatter angle is not seen.
const GRAZING: f64 = 0.2;

/// A surface hides a sample if the ray hits it this much before the sample, metres.
const HIDES_M: f64 = 0.01;

/// The number of directions that tell whether a place is inside.
const DIRECTIONS: u32 = 256;

/// A place is inside if rays end on front sides in this share of all directions, …
const FRONT_SHARE: f64 = 0.5;
/// … on back sides in at most this share of the directions in which they end, …
const BACK_SHARE: f64 = 0.25;
/// … and on front sides in this share of directions a little above the horizon. The last condition is
/// needed since a ceiling may not have been captured, and a ceiling that reaches over a wall, as eaves do,
/// makes no room outside.
const AROUND_SHARE: f64 = 0.85;

/// Samples of the surface of a mesh, each of the same area.
pub(super) struct Surface {
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    m2_per_sample: f64,
}

impl Surface {
    pub(super) fn sample(mesh: &TriMesh, seed: u64) -> Self {
        let m2 = mesh.total_area();
        let total = ((m2 * SAMPLES_PER_M2) as u64).clamp(FEWEST_SAMPLES, MOST_SAMPLES);
        let sampler = SurfaceSampler::new(mesh, Density::Total(total), seed);
        let mut cloud = PointCloud::default();
        sampler.sample(0..sampler.len(), &mut cloud);
        Self {
            points: cloud.positions.iter().map(|p| p.as_dvec3()).collect(),
            normals: cloud.faces.iter().map(|&f| mesh.normal(f).as_dvec3()).collect(),
            m2_per_sample: m2 / total as f64,
        }
    }

    /// Returns the area of a number of samples, in m².
    pub(super) fn m2(&self, samples: usize) -> f64 {
        samples as f64 * self.m2_per_sample
    }

    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns the samples that each place sees, in ascending order.
    pub(super) fn seen_from(
        &self,
        ctx: &Context,
        scene: &Scene<'_>,
        eyes: &[DVec3],
    ) -> Result<Vec<Vec<u32>>> {
        let progress = ctx.progress("looking from", "places", eyes.len() as u64);
        eyes.par_iter()
            .map(|&eye| {
                ctx.check()?;
                let mut sight = Sight::from(scene, eye);
                let mut is_seen =
                    |&i: &u32| self.faces(eye, i as usize) && sight.is_free(self.points[i as usize], HIDES_M);
                let seen = (0..self.len() as u32).filter(|i| is_seen(i)).collect();
                progress.add(1);
                Ok(seen)
            })
            .collect()
    }

    /// Returns whether a sample is near, with its front towards `eye`.
    fn faces(&self, eye: DVec3, sample: usize) -> bool {
        let way = self.points[sample] - eye;
        let m = way.length();
        m <= REACH_M && -self.normals[sample].dot(way) >= GRAZING * m
    }
}

/// What rays from a place hit, as shares of directions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Enclosure {
    /// Front sides and back sides, as shares of all directions.
    front: f64,
    back: f64,
    /// Front sides, as a share of the directions up to 15° above the horizon.
    around: f64,
}

impl Enclosure {
    pub(super) fn of(scene: &Scene<'_>, eye: DVec3, facing: Facing) -> Self {
        // Counts of front sides, back sides and nothing; of all directions, and near the horizon.
        let mut all = [0.0; 3];
        let mut around = [0.0; 2];
        for direction in directions(DIRECTIONS) {
            let hit = cast_ray(scene, eye, direction);
            let kind = hit.map_or(2, |hit| {
                let normal = facing.normal(scene.mesh(), hit.face).as_dvec3();
                let is_front = normal.dot(direction) < 0.0;
                usize::from(!is_front)
            });
            all[kind] += 1.0;
            if (0.0..0.26).contains(&direction.z) {
                around[usize::from(kind != 0)] += 1.0;
            }
        }

        let n = f64::from(DIRECTIONS);
        let [front, other] = around;
        Self { front: all[0] / n, back: all[1] / n, around: front / (front + other) }
    }

    /// Returns whether a place is in a room, or in a yard with walls all around.
    pub(super) fn is_inside(&self) -> bool {
        self.front >= FRONT_SHARE
            && self.back <= BACK_SHARE * (self.front + self.back)
            && self.around >= AROUND_SHARE
    }

    pub(super) fn mean(all: &[Self]) -> Self {
        let n = all.len().max(1) as f64;
        let mean = |of: fn(&Self) -> f64| all.iter().map(of).sum::<f64>() / n;
        Self { front: mean(|e| e.front), back: mean(|e| e.back), around: mean(|e| e.around) }
    }

    /// Returns the percentages of directions with a front side, a back side and nothing.
    pub(super) fn percent(&self) -> [f64; 3] {
        [self.front, self.back, 1.0 - self.front - self.back].map(|share| 100.0 * share)
    }
}
