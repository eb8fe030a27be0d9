//! Gaps of single pixels within a surface.

use super::RangeImage;
use rayon::prelude::*;

impl RangeImage {
    /// Returns the ranges. A pixel without one gets the mean of two on opposite sides of it, if two such
    /// pairs of its neighbours are on one surface: dark surfaces send every other ray back.
    pub(super) fn without_gaps(&self) -> Vec<f32> {
        let (width, pixels) = (self.width() as usize, self.ranges.pixels());
        let pixel_rad = self.pixel_rad() as f32;
        let mut ranges = pixels.to_vec();
        let inner = ranges.par_chunks_exact_mut(width).enumerate().skip(1);
        inner
            .take(self.height().saturating_sub(2) as usize)
            .for_each(|(y, row)| {
                for x in (1..width - 1).filter(|x| pixels[y * width + x].is_nan()) {
                    let pairs = [1, width - 1, width, width + 1]
                        .map(|step| [pixels[y * width + x - step], pixels[y * width + x + step]]);
                    let is_one =
                        |[a, b]: &&[f32; 2]| (a - b).abs() <= 4.0 * (self.noise.sigma_m(*a) + a * pixel_rad);
                    let near = pairs.iter().filter(is_one);
                    if near.clone().count() >= 2 {
                        let least = near.min_by(|p, q| (p[0] - p[1]).abs().total_cmp(&(q[0] - q[1]).abs()));
                        row[x] = least.map_or(f32::NAN, |[a, b]| a.midpoint(*b));
                    }
                }
            });
        ranges
    }
}

#[cfg(test)]
pub(super) mod tests {
    use crate::{RangeImage, RangeKind, SensorNoise};
    use s3d_geom::glam::{DVec3, dvec2};
    use s3d_geom::{Lens, PhotoLens, Pose, Raster};

    /// A picture of two walls, one before the other, with a little noise.
    pub(in crate::range_image) fn image(hole: impl Fn(u32, u32) -> bool) -> RangeImage {
        let size = [70, 60];
        let lens = Lens::new(size, dvec2(80.0, 80.0), dvec2(35.0, 30.0), [0.0; 5]).unwrap();
        let depth = (0..size[0] * size[1]).map(|i| {
            let (x, y) = (i % size[0], i / size[0]);
            let noise = 0.001 * ((i.wrapping_mul(2_654_435_761) >> 16) % 7) as f32;
            let wall = if x < 40 {
                1.5 + 0.004 * x as f32
            } else {
                2.5 - 0.002 * y as f32
            };
            if hole(x, y) { f32::NAN } else { wall + noise }
        });
        let depth = Raster::from_vec(size[0], size[1], depth.collect());
        let pose = Pose::level(DVec3::ZERO, 0.0);
        RangeImage::from_depth(pose, PhotoLens::Straight(lens), RangeKind::Depth, depth, SensorNoise::LASER)
            .unwrap()
    }

    #[test]
    fn single_gaps_are_bridged_within_a_surface() {
        // Every other pixel of a dark wall, a hole of 3 × 3 pixels, and the step between the walls.
        let is_hole = |x: u32, y: u32| {
            (x < 20 && (x + y).is_multiple_of(2))
                || (x.abs_diff(30) < 2 && y.abs_diff(30) < 2)
                || x == 39
                || x == 40
        };
        let (whole, holed) = (image(|_, _| false), image(is_hole));
        let ranges = holed.without_gaps();
        let at = |x: u32, y: u32| (y * 70 + x) as usize;
        for y in 2..58 {
            for x in 2..18 {
                let truth = whole.ranges.pixels()[at(x, y)];
                assert!((ranges[at(x, y)] - truth).abs() < 0.008, "{x} {y}");
            }
            assert!(ranges[at(39, y)].is_nan() && ranges[at(40, y)].is_nan(), "{y}");
        }
        assert!(ranges[at(30, 30)].is_nan());
    }
}
