//! Plan images of two surfaces, and the shifts at which they agree.
//!
//! A surface is cut into slabs by height. Each slab has three images: where walls stand and where they look,
//! where floors and ceilings are, and where there is room. All shifts are tried at once, by products of
//! Fourier transforms. Walls that look into opposite directions count against a shift, and so does what
//! stands where the other surface has room.

use super::free::{COLUMN_M, FreeSpace};
use super::surface::SurfacePoints;
use super::turns::vertex;
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlannerScalar};
use s3d_geom::glam::{DQuat, DVec3, Vec3};
use std::sync::Arc;

/// The edge of a pixel, metres, unless the images became too large.
const PIXEL_M: f64 = 0.25;
/// The most pixels along an edge.
const MOST_PIXELS: f64 = 900.0;
/// The height of a slab, metres.
const SLAB_M: f64 = 0.6;
/// The most slabs.
const MOST_SLABS: f64 = 24.0;
/// What a floor counts, where a wall counts 1. Most floors agree with most others.
pub(super) const FLOOR_WEIGHT: f32 = 0.3;
/// What stands where the other surface has room counts as so much that agrees. Pixels are coarse, so that
/// surfaces of one building contradict each other a little.
const AGAINST: f32 = 2.0;
/// A pixel is full if it has this share of the points of a wall that crosses it.
const FULL: f64 = 0.3;
/// The share of the points beside which no image is made: single points far away.
const STRAY: f64 = 0.001;
/// Peaks of one image, and the pixels between two of them.
const MOST_PEAKS: usize = 10;
const APART: i64 = 2;
/// Surfaces are level if their normal's cosine with the upright axis is at least this.
const LEVEL: f32 = 0.8;

/// A surface with its room.
pub(super) struct Shape<'a> {
    pub(super) surface: &'a SurfacePoints,
    pub(super) free: &'a FreeSpace,
}

/// A place of one surface in the frame of the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// What speaks for it, points.
    pub(super) score: f64,
    pub(super) turn_rad: f64,
    pub(super) shift: DVec3,
}

/// Images and their size, for one surface that stays.
pub(super) struct Plan<'a> {
    b: Shape<'a>,
    /// The surface that moves.
    a: Shape<'a>,
    are_two_sided: bool,
    /// How far `a` reaches from the axis that it turns about, metres.
    reach_m: f64,
    pixel_m: f64,
    slab_m: f64,
    /// Pixels along X and Y.
    size: [usize; 2],
    /// The lowest corner of `b`.
    low: DVec3,
    /// Transformed images of `b` by slab.
    slabs: Vec<Option<Images>>,
    forward: [Arc<dyn Fft<f32>>; 2],
    inverse: [Arc<dyn Fft<f32>>; 2],
}

/// The images of a slab.
#[derive(Clone)]
struct Images {
    walls: Vec<Complex32>,
    floors: Vec<Complex32>,
    /// In one image of both surfaces, points are the real part, in the other they are the imaginary one.
    room: Vec<Complex32>,
}

impl<'a> Plan<'a> {
    pub(super) fn new(a: Shape<'a>, b: Shape<'a>) -> Self {
        let (low, high) = extent(b.surface);
        let reach_m = radius(a.surface);
        let wide = (high - low).truncate().max_element() + 2.0 * reach_m;
        let pixel_m = PIXEL_M.max(wide / MOST_PIXELS);
        let slab_m = SLAB_M.max((high.z - low.z) / MOST_SLABS);
        let low = low - DVec3::new(0.0, 0.0, slab_m);

        let pixels = |edge_m: f64| smooth_size(((edge_m + 2.0 * reach_m) / pixel_m) as usize + 4);
        let size = [pixels(high.x - low.x), pixels(high.y - low.y)];
        let mut planner = FftPlannerScalar::new();
        let forward = size.map(|n| planner.plan_fft_forward(n));
        let inverse = size.map(|n| planner.plan_fft_inverse(n));
        let are_two_sided = !(a.surface.has_sides && b.surface.has_sides);
        let count = ((high.z - low.z) / slab_m) as usize + 2;

        let mut plan = Self {
            a,
            b,
            are_two_sided,
            reach_m,
            pixel_m,
            slab_m,
            size,
            low,
            slabs: Vec::new(),
            forward,
            inverse,
        };
        let mut slabs = plan.images(&plan.b, (DQuat::IDENTITY, DVec3::ZERO), low, count, false);
        slabs.iter_mut().flatten().for_each(|slab| {
            plan.saturate(&mut slab.walls, plan.pixel_m * plan.slab_m);
            plan.saturate(&mut slab.floors, plan.pixel_m * plan.pixel_m);
            for image in [&mut slab.walls, &mut slab.floors, &mut slab.room] {
                plan.transform(image);
            }
        });
        plan.slabs = slabs;
        plan
    }

    /// The best places of `a` that is turned and lifted so.
    pub(super) fn places(&self, turn_rad: f64, lift_m: f64) -> Vec<Place> {
        let low = DVec3::new(-self.reach_m, -self.reach_m, self.low.z);
        let lift = DVec3::new(0.0, 0.0, lift_m);
        let count = self.slabs.len();
        let slabs = self.images(&self.a, (DQuat::from_rotation_z(turn_rad), lift), low, count, true);

        let [width, height] = self.size;
        let mut sum = vec![Complex32::ZERO; width * height];
        for (of_a, of_b) in slabs.into_iter().zip(&self.slabs) {
            let (Some(mut of_a), Some(of_b)) = (of_a, of_b) else { continue };
            for image in [&mut of_a.walls, &mut of_a.floors, &mut of_a.room] {
                self.transform(image);
            }
            for (i, sum) in sum.iter_mut().enumerate() {
                let agree = of_a.walls[i].conj() * of_b.walls[i]
                    + of_a.floors[i].conj() * of_b.floors[i] * FLOOR_WEIGHT;
                *sum += agree * 2.0 - of_a.room[i].conj() * of_b.room[i] * AGAINST;
            }
        }
        self.transform_back(&mut sum);
        self.peaks(&sum, turn_rad, lift_m, low)
    }

    /// The highest values of a correlation, apart from each other.
    fn peaks(&self, sum: &[Complex32], turn_rad: f64, lift_m: f64, low: DVec3) -> Vec<Place> {
        let [width, height] = self.size.map(|n| n as i64);
        let scale = 1.0 / (width * height) as f64;
        let at = |x: i64, y: i64| {
            let i = y.rem_euclid(height) * width + x.rem_euclid(width);
            f64::from(sum[i as usize].re) * scale
        };
        let is_highest = |x: i64, y: i64| {
            let value = at(x, y);
            let mut around = (-APART..=APART)
                .flat_map(|dy| (-APART..=APART).map(move |dx| (dx, dy)))
                .filter(|d| *d != (0, 0));
            around.all(|(dx, dy)| {
                let other = at(x + dx, y + dy);
                value > other || (value == other && (dy, dx) > (0, 0))
            })
        };

        let mut all: Vec<(f64, i64, i64)> = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let value = at(x, y);
                let counts = all.len() < MOST_PEAKS || all.last().is_some_and(|last| value > last.0);
                if value > 0.0 && counts && is_highest(x, y) {
                    all.push((value, x, y));
                    all.sort_by(|a, b| b.0.total_cmp(&a.0));
                    all.truncate(MOST_PEAKS);
                }
            }
        }

        let shift = |(score, x, y): (f64, i64, i64)| {
            let part_x = vertex(at(x - 1, y), score, at(x + 1, y));
            let part_y = vertex(at(x, y - 1), score, at(x, y + 1));
            // Beyond the size of `b`, shifts are negative.
            let wrapped = |v: i64, n: i64, most: f64| if v as f64 > most { v - n } else { v };
            let most = [0, 1].map(|axis| self.size[axis] as f64 - 2.0 * self.reach_m / self.pixel_m - 2.0);
            let x = wrapped(x, width, most[0]) as f64 + part_x;
            let y = wrapped(y, height, most[1]) as f64 + part_y;
            let shift = DVec3::new(x, y, 0.0) * self.pixel_m - low + self.low;
            Place { score, turn_rad, shift: DVec3::new(shift.x, shift.y, lift_m) }
        };
        all.into_iter().map(shift).collect()
    }

    /// The images of a surface that is turned and shifted, with their lowest corner at `low`.
    fn images(
        &self,
        shape: &Shape<'_>,
        (turn, shift): (DQuat, DVec3),
        low: DVec3,
        count: usize,
        is_moving: bool,
    ) -> Vec<Option<Images>> {
        let Shape { surface, free } = *shape;
        let mut slabs: Vec<Option<Images>> = vec![None; count];
        // Both surfaces count area, whatever the distance of their points.
        let area = ((surface.cell_m / 0.05) * (surface.cell_m / 0.05)) as f32;
        for (p, n) in surface.points.positions.iter().zip(&surface.points.normals) {
            let n = (turn * n.as_dvec3()).as_vec3();
            let is_level = n.z.abs() >= LEVEL;
            for (slab, i, part) in self.pixels(turn * p.as_dvec3() + shift, low, &mut slabs) {
                let weight = part * area;
                let counted = if is_level {
                    slab.floors[i].re += weight * if self.are_two_sided { 1.0 } else { n.z.signum() };
                    weight * FLOOR_WEIGHT
                } else {
                    slab.walls[i] += self.direction(n) * weight;
                    weight
                };
                if is_moving {
                    slab.room[i].re += counted;
                } else {
                    slab.room[i].im += counted;
                }
            }
        }

        let covered = (COLUMN_M * COLUMN_M / (self.pixel_m * self.pixel_m)) as f32;
        for ([x, y], heights) in free.columns() {
            for [bottom, top] in heights {
                let steps = ((f64::from(top - bottom) / (0.5 * self.slab_m)).ceil()).max(1.0);
                let step = f64::from(top - bottom) / steps;
                for k in 0..steps as usize {
                    let z = f64::from(*bottom) + (k as f64 + 0.5) * step;
                    let place = turn * DVec3::new(f64::from(x), f64::from(y), z) + shift;
                    for (slab, i, part) in self.pixels(place, low, &mut slabs) {
                        let room = part * covered * (step / self.slab_m) as f32;
                        if is_moving {
                            slab.room[i].im += room;
                        } else {
                            slab.room[i].re += room;
                        }
                    }
                }
            }
        }
        slabs
    }

    /// The two slabs that share a place, with its pixel and its share.
    fn pixels<'s>(
        &self,
        p: DVec3,
        low: DVec3,
        slabs: &'s mut [Option<Images>],
    ) -> impl Iterator<Item = (&'s mut Images, usize, f32)> {
        let [width, height] = self.size;
        let at = (p - low) / DVec3::new(self.pixel_m, self.pixel_m, self.slab_m);
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < width as f64 && at.y < height as f64;
        let (x, y) = (at.x.max(0.0) as usize, at.y.max(0.0) as usize);
        let slab = (at.z - 0.5).floor();
        let part = (at.z - 0.5 - slab) as f32;
        let is_inside = inside && slab >= 0.0 && slab + 1.0 < slabs.len() as f64;
        let (first, last) = if is_inside {
            (slab as usize, slab as usize + 2)
        } else {
            (0, 0)
        };
        let shares = [1.0 - part, part];
        slabs[first..last].iter_mut().zip(shares).map(move |(slab, share)| {
            let empty = || vec![Complex32::ZERO; width * height];
            let new = || Images { walls: empty(), floors: empty(), room: empty() };
            (slab.get_or_insert_with(new), y * width + x, share)
        })
    }

    /// Where a wall looks, as a number whose product with that of another wall is 1 if they agree.
    fn direction(&self, n: Vec3) -> Complex32 {
        let direction = Complex32::new(n.x, n.y);
        if self.are_two_sided {
            direction * direction / n.truncate().length().max(1e-6)
        } else {
            direction
        }
    }

    /// Makes of sums what is there, 0 to 1, and spreads it by a pixel.
    fn saturate(&self, image: &mut [Complex32], full_m2: f64) {
        let [width, height] = self.size;
        let full = (FULL * full_m2 / (0.05 * 0.05)) as f32;
        for value in image.iter_mut() {
            *value /= value.norm().max(full);
        }
        for (step, count) in [(1, width), (width, height)] {
            let old = image.to_vec();
            for (i, value) in image.iter_mut().enumerate() {
                let at = (i / step) % count;
                let before = if at > 0 { old[i - step] } else { Complex32::ZERO };
                let after = if at + 1 < count { old[i + step] } else { Complex32::ZERO };
                *value += (before + after) * 0.5;
            }
        }
        for value in image.iter_mut() {
            *value /= value.norm().max(1.0);
        }
    }

    /// Fourier's transform, transposed.
    fn transform(&self, image: &mut [Complex32]) {
        let [width, height] = self.size;
        self.forward[0].process(image);
        transpose(image, width, height);
        self.forward[1].process(image);
    }

    fn transform_back(&self, image: &mut [Complex32]) {
        let [width, height] = self.size;
        self.inverse[1].process(image);
        transpose(image, height, width);
        self.inverse[0].process(image);
    }
}

/// Transposes an image of `height` rows.
fn transpose(image: &mut [Complex32], width: usize, height: usize) {
    let old = image.to_vec();
    for y in 0..height {
        for x in 0..width {
            image[x * height + y] = old[y * width + x];
        }
    }
}

/// The least number from `least` on whose factors are 2, 3 and 5.
fn smooth_size(least: usize) -> usize {
    (least.max(8)..)
        .find(|n| {
            let mut rest = *n;
            for factor in [2, 3, 5] {
                while rest % factor == 0 {
                    rest /= factor;
                }
            }
            rest == 1
        })
        .unwrap_or(least)
}

/// The box of a surface without its strays.
fn extent(surface: &SurfacePoints) -> (DVec3, DVec3) {
    let axis = |axis: usize| {
        let mut values: Vec<f32> = surface.points.positions.iter().map(|p| p[axis]).collect();
        values.sort_unstable_by(f32::total_cmp);
        let skipped = (STRAY * values.len() as f64) as usize;
        [values[skipped], values[values.len() - 1 - skipped]].map(f64::from)
    };
    let [x, y, z] = [0, 1, 2].map(axis);
    (DVec3::new(x[0], y[0], z[0]), DVec3::new(x[1], y[1], z[1]))
}

/// How far a surface reaches from the upright axis through its middle, without strays.
fn radius(surface: &SurfacePoints) -> f64 {
    let mut all: Vec<f32> = surface.points.positions.iter().map(|p| p.truncate().length()).collect();
    all.sort_unstable_by(f32::total_cmp);
    let skipped = (STRAY * all.len() as f64) as usize;
    f64::from(all[all.len() - 1 - skipped])
}
