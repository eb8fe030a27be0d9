//! Points without a grid, sorted into a grid of directions.

use super::angles::{AngleGrid, angles_of};
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Vec3};
use s3d_geom::{Pose, Raster};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Points in a grid of directions.
pub(crate) struct Binned {
    pub(crate) grid: AngleGrid,
    /// The distance of the nearest point of each pixel; NaN where there is none.
    pub(crate) ranges: Raster<f32>,
    /// See [`AngleGrid::offset`].
    pub(crate) offsets: Vec<[i8; 2]>,
    /// The nearest point of each pixel; `u32::MAX` where there is none.
    pub(crate) point_of_pixel: Vec<u32>,
}

/// Returns world points in OpenCV's axes of a pose. NaN stays NaN.
pub(crate) fn local(pose: &Pose, points: &[Vec3]) -> Vec<DVec3> {
    let turn = pose.opencv_from_world();
    points
        .par_iter()
        .map(|p| turn * (p.as_dvec3() - pose.location))
        .collect()
}

/// The side of a pixel is this many times the distance of neighbouring points, so that most pixels have a
/// point.
const PIXEL_PER_SPACING: f64 = 1.2;
/// Points of a patch of directions by which the density of points is measured.
const POINTS_PER_PATCH: f64 = 64.0;

/// Sorts points about the scanner into a grid of directions as fine as the points are dense. Returns `None`
/// if no point is finite.
pub(crate) fn binned(points: &[DVec3]) -> Option<Binned> {
    let angles: Vec<Option<[f64; 2]>> = points
        .par_iter()
        .map(|p| (p.is_finite() && *p != DVec3::ZERO).then(|| angles_of(*p)))
        .collect();
    let measured = angles.iter().flatten().count();
    if measured == 0 {
        return None;
    }

    let pixel_rad = PIXEL_PER_SPACING * spacing_rad(&angles, measured);
    // No more pixels than a few for each point, whatever the points are.
    let fewest_rad = (TAU * PI / (8.0 * measured as f64 + 4096.0)).sqrt();
    let columns = (TAU / pixel_rad.max(fewest_rad)).round().clamp(8.0, 1e6);
    let pixel_rad = TAU / columns;
    let bounds = angles
        .iter()
        .flatten()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], [_, e]| [low.min(*e), high.max(*e)]);
    let top = (bounds[0] - 0.5 * pixel_rad).max(-FRAC_PI_2);
    let rows = ((bounds[1] - top) / pixel_rad + 0.5).ceil().max(1.0);
    let grid = AngleGrid::around(columns as u32, top, rows as u32);

    let [width, height] = grid.size();
    let mut ranges = Raster::filled(width, height, f32::NAN);
    let mut point_of_pixel = vec![u32::MAX; ranges.len()];
    for (i, (p, angles)) in points.iter().zip(&angles).enumerate() {
        let Some([x, y]) = angles.and_then(|[a, e]| grid.pixel(a, e)) else { continue };
        let pixel = y as usize * width as usize + x as usize;
        let range = p.length() as f32;
        let slot = &mut ranges.pixels_mut()[pixel];
        if slot.is_nan() || range < *slot {
            *slot = range;
            point_of_pixel[pixel] = i as u32;
        }
    }

    let offset = |(pixel, &point): (usize, &u32)| match points.get(point as usize) {
        Some(p) => grid.offset([pixel as u32 % width, pixel as u32 / width], *p),
        None => [0; 2],
    };
    let offsets = point_of_pixel.par_iter().enumerate().map(offset).collect();
    Some(Binned { grid, ranges, offsets, point_of_pixel })
}

/// Returns the angle between neighbouring points: the inverse root of the median density, over patches of
/// equal size.
fn spacing_rad(angles: &[Option<[f64; 2]>], measured: usize) -> f64 {
    let side = (4.0 * PI * POINTS_PER_PATCH / measured as f64).sqrt().clamp(0.002, 0.5);
    let rows = (PI / side).ceil();
    let columns = |row: f64| {
        let elevation = -FRAC_PI_2 + (row + 0.5) * PI / rows;
        (TAU * libm::cos(elevation) / side).ceil().max(1.0)
    };
    let widest = (TAU / side).ceil() + 1.0;

    let mut counts = vec![0_u32; (rows * widest) as usize];
    for [azimuth, elevation] in angles.iter().flatten() {
        let row = ((elevation + FRAC_PI_2) / PI * rows).floor().clamp(0.0, rows - 1.0);
        let column = ((azimuth + PI) / TAU * columns(row))
            .floor()
            .clamp(0.0, columns(row) - 1.0);
        counts[(row * widest + column) as usize] += 1;
    }

    let mut seen: Vec<u32> = counts.into_iter().filter(|c| *c > 0).collect();
    let middle = seen.len() / 2;
    let count = *seen.select_nth_unstable(middle).1;
    side / f64::from(count).sqrt()
}
