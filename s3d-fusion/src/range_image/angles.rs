//! Grids of directions: a column has one azimuth, a row one elevation.

use rayon::prelude::*;
use s3d_geom::glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A grid of directions in OpenCV's axes (x right, y down, z forward). Azimuths are angles to the right of z,
/// and elevations are angles downwards from the horizon.
#[derive(Clone, Debug)]
pub(crate) struct AngleGrid {
    /// The azimuth of each column, radians, and what finds the column of an azimuth.
    columns: Axis,
    rows: Axis,
}

/// The angles of the columns or rows of a grid.
#[derive(Clone, Debug)]
struct Axis {
    angles_rad: Vec<f64>,
    /// The angle between two neighbours, above 0.
    step_rad: f64,
    /// The index whose angle is nearest to the middle of a bin, or [`NONE`]. Bins start at `first_rad`.
    bins: Vec<u32>,
    first_rad: f64,
}

/// Rows that are summed at a time.
const ROWS: usize = 64;
/// No column or row.
const NONE: u32 = u32::MAX;
/// Bins for each step between two angles.
const BINS: f64 = 8.0;
/// Most bins of an axis.
const MOST_BINS: f64 = 1e6;
/// How far from its column's or row's angle a point of a scan on a grid may be, in steps, for nine of ten
/// points.
const MOST_OFF: f64 = 0.75;

impl AngleGrid {
    /// Returns a regular grid that goes all around. Rows lead from the elevation `top_rad` downwards.
    pub(crate) fn around(columns: u32, top_rad: f64, rows: u32) -> Self {
        let step = TAU / f64::from(columns);
        let azimuth = |c: u32| -PI + (f64::from(c) + 0.5) * step;
        let elevation = |r: u32| top_rad + (f64::from(r) + 0.5) * step;
        Self {
            columns: Axis::new((0..columns).map(azimuth).collect(), step, [-PI, PI]),
            rows: Axis::new((0..rows).map(elevation).collect(), step, [-FRAC_PI_2, FRAC_PI_2]),
        }
    }

    /// Returns the grid of a scan with columns and rows of points about the scanner, row by row, NaN where
    /// nothing was measured. Returns `None` if the columns or rows do not have one angle each.
    pub(crate) fn of_scan([columns, rows]: [u32; 2], points: &[DVec3]) -> Option<Self> {
        // By bands of rows, so that the sums are the same for any number of threads.
        let width = columns as usize;
        let bands: Vec<_> = points
            .par_chunks(width.max(1) * ROWS)
            .map(|band| {
                let (mut along, mut down) = (vec![DVec2::ZERO; width], vec![DVec2::ZERO; band.len() / width]);
                for (i, p) in band.iter().enumerate() {
                    if p.is_finite() && *p != DVec3::ZERO {
                        let p = *p / p.length();
                        along[i % width] += dvec2(p.z, p.x);
                        down[i / width] += dvec2((p.x * p.x + p.z * p.z).sqrt(), p.y);
                    }
                }
                (along, down)
            })
            .collect();
        let mut along = vec![DVec2::ZERO; width];
        let mut down = Vec::with_capacity(rows as usize);
        for (of_columns, of_rows) in bands {
            along.iter_mut().zip(of_columns).for_each(|(sum, more)| *sum += more);
            down.extend(of_rows);
        }

        let columns = Axis::of_sums(&along, [-PI, PI])?;
        let rows = Axis::of_sums(&down, [-FRAC_PI_2, FRAC_PI_2])?;
        let grid = Self { columns, rows };
        grid.holds(points).then_some(grid)
    }

    /// Returns true if nine of ten points, of some thousands, are in the column and row that they are said to
    /// be in.
    fn holds(&self, points: &[DVec3]) -> bool {
        let width = self.columns.angles_rad.len();
        let stride = (points.len() / 20_000).max(1) | 1;
        let (mut tried, mut off) = (0, 0);
        for (i, p) in points.iter().enumerate().step_by(stride).filter(|(_, p)| p.is_finite()) {
            let [x, y] = self.off_middle([(i % width) as u32, (i / width) as u32], *p);
            let flat = libm::hypot(p.x, p.z) / p.length().max(f64::MIN_POSITIVE);
            tried += 1;
            off += usize::from(!(x.abs() * flat <= MOST_OFF && y.abs() <= MOST_OFF));
        }
        tried > 0 && off * 10 <= tried
    }

    /// Returns the width and height in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.columns.angles_rad.len() as u32, self.rows.angles_rad.len() as u32]
    }

    /// Returns the angles between columns and between rows, radians.
    pub(crate) fn steps_rad(&self) -> [f64; 2] {
        [self.columns.step_rad, self.rows.step_rad]
    }

    /// Returns true if the last column is beside the first one.
    pub(crate) fn is_around(&self) -> bool {
        let angles = &self.columns.angles_rad;
        let [Some(a), Some(b)] = [angles.first(), angles.last()] else { return false };
        angles.len() > 2 && wrapped(a - b).abs() < 1.5 * self.columns.step_rad
    }

    /// Returns the sines and cosines of the azimuths of all columns.
    pub(crate) fn column_rays(&self) -> Vec<[f64; 2]> {
        self.columns
            .angles_rad
            .iter()
            .map(|a| libm::sincos(*a).into())
            .collect()
    }

    /// Returns the sine and cosine of the elevation of a row.
    pub(crate) fn row_ray(&self, row: usize) -> [f64; 2] {
        libm::sincos(self.rows.angles_rad[row]).into()
    }

    /// Returns the unit direction of the middle of a pixel.
    pub(crate) fn direction(&self, [column, row]: [u32; 2]) -> DVec3 {
        let (sin_x, cos_x) = libm::sincos(self.columns.angles_rad[column as usize]);
        let (sin_y, cos_y) = libm::sincos(self.rows.angles_rad[row as usize]);
        dvec3(cos_y * sin_x, sin_y, cos_y * cos_x)
    }

    /// Returns the column and row of a direction by its azimuth and elevation in radians.
    #[inline]
    pub(crate) fn pixel(&self, azimuth_rad: f64, elevation_rad: f64) -> Option<[u32; 2]> {
        Some([self.columns.index(azimuth_rad)?, self.rows.index(elevation_rad)?])
    }

    /// Returns the first and last columns of a range of azimuths, or `None` if they are not neighbours.
    pub(crate) fn columns_between(&self, from_rad: f64, to_rad: f64) -> Option<[u32; 2]> {
        let is_one = from_rad > -PI && to_rad < PI;
        is_one.then(|| self.columns.between(from_rad, to_rad)).flatten()
    }

    /// Returns the first and last rows of a range of elevations, or `None` if one is outside.
    pub(crate) fn rows_between(&self, from_rad: f64, to_rad: f64) -> Option<[u32; 2]> {
        self.rows.between(from_rad, to_rad)
    }

    /// Returns where a point is from the middle of a pixel, in 1/254 of a pixel, at most half a pixel.
    pub(crate) fn offset(&self, pixel: [u32; 2], point: DVec3) -> [i8; 2] {
        self.off_middle(pixel, point)
            .map(|off| (off * 254.0).round().clamp(-127.0, 127.0) as i8)
    }

    /// Returns where a point is from the middle of a pixel, in pixels.
    fn off_middle(&self, [column, row]: [u32; 2], point: DVec3) -> [f64; 2] {
        let [azimuth, elevation] = angles_of(point);
        let x = wrapped(azimuth - self.columns.angles_rad[column as usize]) / self.columns.step_rad;
        let y = (elevation - self.rows.angles_rad[row as usize]) / self.rows.step_rad;
        [x, y]
    }
}

/// Returns the azimuth and elevation of a direction, radians.
#[inline]
pub(crate) fn angles_of(direction: DVec3) -> [f64; 2] {
    let flat = libm::hypot(direction.x, direction.z);
    [libm::atan2(direction.x, direction.z), libm::atan2(direction.y, flat)]
}

/// Returns the same angle between −π and π.
fn wrapped(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}

impl Axis {
    /// Makes an axis of angles with about the same step, whose bins reach over `span` or a part of it.
    fn new(angles_rad: Vec<f64>, step_rad: f64, [from, to]: [f64; 2]) -> Self {
        let count = ((to - from) / step_rad * BINS).ceil().clamp(1.0, MOST_BINS);
        let bin = (to - from) / count;
        let mut bins = vec![NONE; count as usize];
        let mut distance = vec![f64::INFINITY; bins.len()];
        let around = to - from > PI + 1e-9;

        // Each index claims the bins within three quarters of a step, if no other is nearer.
        let reach = (0.75 * step_rad / bin).ceil() as i64;
        for (index, angle) in angles_rad.iter().enumerate() {
            let middle = ((angle - from) / bin).floor() as i64;
            for at in middle - reach..=middle + reach {
                let off = (from + (at as f64 + 0.5) * bin - angle).abs();
                let at = if around { at.rem_euclid(bins.len() as i64) } else { at };
                let Some(slot) = usize::try_from(at).ok().filter(|at| *at < bins.len()) else { continue };
                if off <= 0.75 * step_rad && off < distance[slot] {
                    distance[slot] = off;
                    bins[slot] = index as u32;
                }
            }
        }
        Self { angles_rad, step_rad, bins, first_rad: from }
    }

    /// Makes an axis whose angles are the directions of sums of vectors. Sums that are zero get an angle
    /// between their neighbours' angles. Returns `None` if fewer than two are known, or neighbours do not
    /// differ by about one step.
    fn of_sums(sums: &[DVec2], span: [f64; 2]) -> Option<Self> {
        let known = sums.iter().enumerate().filter(|(_, v)| **v != DVec2::ZERO);
        let known: Vec<(usize, f64)> = known.map(|(i, v)| (i, libm::atan2(v.y, v.x))).collect();
        let mut steps: Vec<f64> = known
            .windows(2)
            .filter(|w| w[1].0 == w[0].0 + 1)
            .map(|w| wrapped(w[1].1 - w[0].1))
            .collect();
        let middle = steps.len() / 2;
        let step = *steps.get_mut(..)?.select_nth_unstable_by_checked(middle)?;
        if step == 0.0 {
            return None;
        }

        // From one known angle to the next, whole turns as the usual step says.
        let (first, start) = *known.first()?;
        let mut angles: Vec<f64> = (0..sums.len())
            .map(|i| start + step * (i as f64 - first as f64))
            .collect();
        let (mut at, mut angle) = (first, start);
        for &(next, raw) in &known {
            let expected = angle + step * (next - at) as f64;
            let reached = expected + wrapped(raw - expected);
            let each = (reached - angle) / (next - at).max(1) as f64;
            let between = angles.iter_mut().take(next + 1).skip(at).enumerate();
            between.for_each(|(i, slot)| *slot = angle + each * i as f64);
            (at, angle) = (next, reached);
        }
        let behind = angles.iter_mut().skip(at).enumerate();
        behind.for_each(|(i, slot)| *slot = angle + step * i as f64);
        Some(Self::new(angles.into_iter().map(wrapped).collect(), step.abs(), span))
    }

    /// Returns the smallest and largest index of a range of angles, with one more on each side.
    fn between(&self, from_rad: f64, to_rad: f64) -> Option<[u32; 2]> {
        let [a, b] = [self.index(from_rad)?, self.index(to_rad)?];
        let is_straight = (f64::from(a.abs_diff(b)) - (to_rad - from_rad) / self.step_rad).abs() < 3.0;
        let last = self.angles_rad.len() as u32 - 1;
        is_straight.then(|| [a.min(b).saturating_sub(1), (a.max(b) + 1).min(last)])
    }

    #[inline]
    fn index(&self, angle_rad: f64) -> Option<u32> {
        let span = if self.first_rad == -PI { TAU } else { PI };
        let at = (angle_rad - self.first_rad) * (self.bins.len() as f64 / span);
        let at = (at as usize).min(self.bins.len() - 1);
        self.bins.get(at).copied().filter(|i| *i != NONE)
    }
}

/// Selects from lists that may be empty.
trait SelectChecked {
    fn select_nth_unstable_by_checked(&mut self, n: usize) -> Option<&mut f64>;
}

impl SelectChecked for [f64] {
    fn select_nth_unstable_by_checked(&mut self, n: usize) -> Option<&mut f64> {
        (n < self.len()).then(|| self.select_nth_unstable_by(n, f64::total_cmp).1)
    }
}
