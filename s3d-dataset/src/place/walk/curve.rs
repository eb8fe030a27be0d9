//! Makes a smooth walk of a route.

use crate::place::free_space::{BODY_M, HIP_M};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use s3d_geom::{NearestFaces, Pose};
use s3d_render::{Scene, cast_ray};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The distance of the points of a curve, metres.
const POINT_M: f64 = 0.1;

/// The number of times that every point moves towards the middle of its neighbours: a bell of 0.3 m.
const ROUNDS: usize = 18;

/// The farthest that a point moves away from the route, metres. The floor is known this far around.
const MOST_SHIFT_M: f64 = 0.35;

/// The floor is this much higher or lower than under the route at most, metres: a step of stairs, and what
/// smoothing adds. It is no table, and no hole.
const UNEVEN_M: f64 = 0.35;

/// The distance before and behind a pose whose direction is that of the walk, metres.
const AHEAD_M: f64 = 0.25;

/// How long a turn takes: the width of the bell over which directions are averaged, seconds.
const TURN_S: f64 = 0.5;

/// A smooth curve through free space, as points that are about [`POINT_M`] apart.
pub(super) struct Curve {
    points: Vec<DVec3>,
    /// The distance of each point from the first, along the curve, metres.
    along_m: Vec<f64>,
}

impl Curve {
    /// Rounds the corners of a route of eyes at a height above the floor, where there is room to do so.
    pub(super) fn smooth(
        eyes: impl Iterator<Item = DVec3>,
        height_m: f64,
        around: &Surroundings<'_>,
    ) -> Self {
        let route = Self::of(eyes.collect());
        let count = (route.length_m() / POINT_M).ceil() as usize + 1;
        let start: Vec<DVec3> = (0..count).map(|i| route.at(i as f64 * POINT_M)).collect();

        let mut points = start.clone();
        let mut room_m = around.room_m(&points, height_m);
        for _ in 0..ROUNDS {
            let moved: Vec<DVec3> = (0..count)
                .map(|i| {
                    let [before, after] = [i.saturating_sub(1), (i + 1).min(count - 1)].map(|i| points[i]);
                    0.25 * (before + after) + 0.5 * points[i]
                })
                .collect();
            let moved_room_m = around.room_m(&moved, height_m);
            for i in 0..count {
                let has_room = moved_room_m[i] >= room_m[i].min(BODY_M);
                if has_room && moved[i].distance(start[i]) <= MOST_SHIFT_M {
                    points[i] = moved[i];
                    room_m[i] = moved_room_m[i];
                }
            }
        }
        Self::of(points)
    }

    fn of(points: Vec<DVec3>) -> Self {
        let mut length_m = 0.0;
        let along_m = (0..points.len())
            .map(|i| {
                length_m += points[i].distance(points[i.saturating_sub(1)]);
                length_m
            })
            .collect();
        Self { points, along_m }
    }

    pub(super) fn length_m(&self) -> f64 {
        self.along_m.last().copied().unwrap_or(0.0)
    }

    /// Returns the place at a distance from the first point; the ends if it is beyond.
    fn at(&self, metres: f64) -> DVec3 {
        let after = self
            .along_m
            .partition_point(|along| *along <= metres)
            .clamp(1, self.points.len().max(2) - 1);
        let [Some(&from), Some(&to)] = [self.points.get(after - 1), self.points.get(after)] else {
            return self.points.first().copied().unwrap_or(DVec3::ZERO);
        };
        let [from_m, to_m] = [self.along_m[after - 1], self.along_m[after]];
        let share = if to_m > from_m {
            (metres - from_m) / (to_m - from_m)
        } else {
            0.0
        };
        from.lerp(to, share.clamp(0.0, 1.0))
    }

    /// Returns poses a step apart, that look where the walk goes.
    pub(super) fn poses(&self, count: usize, step_m: f64, rate: f64) -> Vec<Pose> {
        let mut yaws = Vec::with_capacity(count);
        let mut yaw = 0.0;
        for i in 0..count {
            let here_m = i as f64 * step_m;
            let ahead = self.at(here_m + AHEAD_M) - self.at(here_m - AHEAD_M);
            if libm::hypot(ahead.x, ahead.y) > 0.1 * AHEAD_M {
                // A level pose looks along +Y at first. Turns are counted on, so that means make sense.
                let seen = libm::atan2(ahead.y, ahead.x) - FRAC_PI_2;
                yaw += (seen - yaw + PI).rem_euclid(TAU) - PI;
            }
            yaws.push(yaw);
        }

        let yaws = averaged(&yaws, TURN_S * rate);
        let place = |i: usize| self.at(i as f64 * step_m);
        yaws.into_iter()
            .enumerate()
            .map(|(i, yaw)| Pose::level(place(i), yaw))
            .collect()
    }
}

/// The surfaces around a walk.
pub(super) struct Surroundings<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) nearest: &'a NearestFaces<'a>,
}

impl Surroundings<'_> {
    /// Returns the distance of the nearest surface from each eye, and from the hips of who carries the
    /// camera; 0 where no floor is below.
    fn room_m(&self, eyes: &[DVec3], height_m: f64) -> Vec<f32> {
        let hips = (height_m - HIP_M) * DVec3::Z;
        let points: Vec<Vec3> = eyes
            .iter()
            .flat_map(|&eye| [eye, eye - hips])
            .map(|p| p.as_vec3())
            .collect();
        let mut found = Vec::new();
        self.nearest.nearest_many(&points, &mut found);

        let floors = height_m - UNEVEN_M..=height_m + UNEVEN_M;
        found
            .par_chunks_exact(2)
            .zip(eyes)
            .map(|(both, &eye)| {
                let is_above_floor =
                    cast_ray(self.scene, eye, -DVec3::Z).is_some_and(|below| floors.contains(&below.t));
                let room_m = both
                    .iter()
                    .fold(f32::INFINITY, |least, near| least.min(near.distance_m));
                if is_above_floor { room_m } else { 0.0 }
            })
            .collect()
    }
}

/// Returns means of numbers with those around them, weighted by a bell.
fn averaged(numbers: &[f64], sigma: f64) -> Vec<f64> {
    let reach = (3.0 * sigma).ceil().min(numbers.len() as f64) as usize;
    let weight = |away: usize| libm::exp(-0.5 * (away as f64 / sigma).powi(2));
    let weights: Vec<f64> = (0..=reach).map(weight).collect();
    (0..numbers.len())
        .map(|i| {
            let around = i.saturating_sub(reach)..=(i + reach).min(numbers.len() - 1);
            let [sum, total] = around.fold([0.0, 0.0], |[sum, total], j| {
                let weight = weights[i.abs_diff(j)];
                [sum + weight * numbers[j], total + weight]
            });
            sum / total
        })
        .collect()
}
