//! The coordinates in which planes are fitted to pixels: u, v and q, the inverse of the depth.
//!
//! The axis is the optical axis of a lens, and the ray of the pixel in a grid of angles.

use super::{Directions, RangeImage};
use crate::lanes::{LANES, Lanes};
use s3d_geom::glam::{DVec3, Vec3};

/// A vector of length 1. glam's own calls an instruction of SSE, for which the processor waits after AVX: the
/// fits took three times as long with it.
#[inline(always)]
fn unit(v: Vec3) -> Vec3 {
    v * v.dot(v).sqrt().recip()
}

/// The q of a pixel that is not taken. Not NaN: sums leave pixels out by the factor 0.
const FAR_Q: f32 = 1e30;
/// Numbers above this come from [`FAR_Q`].
pub(super) const MOST_Q: f32 = 1e20;

#[inline(always)]
pub(super) fn load(plane: &[f32], at: usize) -> Lanes {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(&plane[at..at + LANES]);
    lanes
}

/// The coordinates of the neighbours of some pixels, each about an axis of its own.
pub(super) trait Frame {
    /// What the band holds of a pixel that is not taken: its q is [`FAR_Q`].
    const NONE: [f32; 3];
    /// Makes the frames of pixels from what the band holds of them.
    fn of(pixels: &[Lanes; 3]) -> Self;
    /// Returns u, v and q of a neighbour of each pixel from what the band holds of it.
    fn uvq(&self, pixels: [Lanes; 3]) -> [Lanes; 3];
    /// Returns vectors in the axes of the sensor.
    fn vectors(&self, uvq: [Lanes; 3]) -> [Lanes; 3];
}

/// The frame of a lens. The band holds u, v and q.
pub(super) struct Flat;

impl Frame for Flat {
    const NONE: [f32; 3] = [0.0, 0.0, FAR_Q];

    #[inline(always)]
    fn of(_: &[Lanes; 3]) -> Self {
        Self
    }

    #[inline(always)]
    fn uvq(&self, pixels: [Lanes; 3]) -> [Lanes; 3] {
        pixels
    }

    #[inline(always)]
    fn vectors(&self, uvq: [Lanes; 3]) -> [Lanes; 3] {
        uvq
    }
}

/// The frames of pixels in a grid of angles: right, down and forward as columns. The band holds points.
pub(super) struct Round {
    axes: [[Lanes; 3]; 3],
}

impl Frame for Round {
    const NONE: [f32; 3] = [0.0; 3];

    #[inline(always)]
    fn of(pixels: &[Lanes; 3]) -> Self {
        let mut axes = [[[0.0; LANES]; 3]; 3];
        for lane in 0..LANES {
            let forward = unit(Vec3::new(pixels[0][lane], pixels[1][lane], pixels[2][lane]));
            let is_level = forward.x * forward.x + forward.z * forward.z > 1e-6;
            let flat = if is_level { forward } else { Vec3::Z };
            let right = unit(Vec3::new(flat.z, 0.0, -flat.x));
            for (axis, v) in axes.iter_mut().zip([right, forward.cross(right), forward]) {
                (axis[0][lane], axis[1][lane], axis[2][lane]) = (v.x, v.y, v.z);
            }
        }
        Self { axes }
    }

    #[inline(always)]
    fn uvq(&self, pixels: [Lanes; 3]) -> [Lanes; 3] {
        let mut uvq = [[0.0; LANES]; 3];
        for (k, [x, y, z]) in self.axes.iter().enumerate() {
            for lane in 0..LANES {
                uvq[k][lane] =
                    x[lane] * pixels[0][lane] + y[lane] * pixels[1][lane] + z[lane] * pixels[2][lane];
            }
        }
        let [u, v, q] = &mut uvq;
        for ((u, v), q) in u.iter_mut().zip(v).zip(q) {
            *q = 1.0 / if *q > 1.0 / FAR_Q { *q } else { 1.0 / FAR_Q };
            *u *= *q;
            *v *= *q;
        }
        uvq
    }

    #[inline(always)]
    fn vectors(&self, [u, v, q]: [Lanes; 3]) -> [Lanes; 3] {
        let [right, down, forward] = &self.axes;
        let mut vectors = [[0.0; LANES]; 3];
        for (axis, numbers) in vectors.iter_mut().enumerate() {
            for lane in 0..LANES {
                numbers[lane] =
                    right[axis][lane] * u[lane] + down[axis][lane] * v[lane] + forward[axis][lane] * q[lane];
            }
        }
        vectors
    }
}

impl RangeImage {
    /// Returns what a [`Frame`] needs of each pixel of some rows, which have these ranges.
    pub(super) fn frames(&self, ranges: &[f32], from_row: usize) -> Vec<[f32; 3]> {
        let width = self.width() as usize;
        match &self.directions {
            Directions::Lens(_) => {
                let (rays, mut row) = (self.rays(), [const { Vec::new() }; 3]);
                let mut frames = Vec::with_capacity(ranges.len());
                for (y, ranges) in ranges.chunks(width).enumerate() {
                    rays.row(from_row + y, &mut row);
                    let [u, v, _] = &row;
                    let uvq = |((range, u), v): ((&f32, &f32), &f32)| {
                        if range.is_nan() {
                            Flat::NONE
                        } else {
                            [*u, *v, range.recip()]
                        }
                    };
                    frames.extend(ranges.iter().zip(u).zip(v).map(uvq));
                }
                frames
            }
            Directions::Angles(grid) => {
                let columns = grid.column_rays();
                let rows: Vec<_> = (0..ranges.len() / width).map(|y| grid.row_ray(from_row + y)).collect();
                let steps = grid.steps_rad();
                let point = |(i, range): (usize, &f32)| {
                    if range.is_nan() {
                        return Round::NONE;
                    }
                    let [sin_x, cos_x] = columns[i % width];
                    let [sin_y, cos_y] = rows[i / width];
                    let middle = DVec3::new(cos_y * sin_x, sin_y, cos_y * cos_x);
                    let ray = match self.offsets.get(from_row * width + i) {
                        Some(off) => {
                            let [x, y] = [0, 1].map(|k| f64::from(off[k]) / 254.0 * steps[k]);
                            let right = DVec3::new(cos_y * cos_x, 0.0, -cos_y * sin_x);
                            let down = DVec3::new(-sin_y * sin_x, cos_y, -sin_y * cos_x);
                            (middle + right * x + down * y).normalize()
                        }
                        None => middle,
                    };
                    (ray * f64::from(*range)).as_vec3().to_array()
                };
                ranges.iter().enumerate().map(point).collect()
            }
        }
    }
}
