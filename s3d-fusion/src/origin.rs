//! Where a scanner stood, if only its points are known.
//!
//! A scanner on a tripod turns by equal steps, so each range of azimuths and elevations has as many points as
//! any other, whatever is there. That is so from the scanner's place alone. From elsewhere, near surfaces
//! have too few points, and far ones too many.
//!
//! Points are densest above, below or close beside the scanner. The search goes from there over a coarse
//! grid of places, and from the best of them in ever smaller steps.

use crate::fusion::chance;
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Vec3, dvec3};
use std::cmp::Reverse;
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};
use thiserror::Error;

/// The place of a scanner that was found by its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundOrigin {
    /// The place, in the frame of the points, metres.
    pub origin: DVec3,
    /// How much the number of points differs between directions: the median deviation as a share of the
    /// median, 0 for the same everywhere.
    pub unevenness: f64,
    /// The share of the points that lie behind others.
    pub hidden: f64,
}

/// The reason why no place was found.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum OriginError {
    /// There are fewer points than tell anything.
    #[error("{points} points do not tell it: it takes {LEAST_POINTS}")]
    FewPoints {
        /// The number of finite points.
        points: usize,
    },
    /// From no place are the points spread evenly over all directions.
    #[error(
        "the points do not tell it, since from no place they are spread evenly: they are of several scans, \
         thinned, or of a scanner that moved"
    )]
    Uneven {
        /// The place that came closest.
        best: FoundOrigin,
    },
}

/// The fewest points.
const LEAST_POINTS: usize = 20_000;
/// Points of the coarse search and of the fine one, and points a cell of directions.
const COARSE: (usize, f64) = (16_000, 40.0);
const FINE: (usize, f64) = (100_000, 100.0);

/// The side of the cubes of which the fullest is looked for, and the number of them, metres.
const CUBE_M: f32 = 0.25;
const CUBES: usize = 3;
/// How far from these cubes the scanner is looked for, sideways and in height, and in which steps, metres.
const SIDEWAYS_M: f64 = 2.4;
const UPWARDS_M: f64 = 6.0;
const STEP_M: f64 = 0.4;
/// The last step, metres.
const LAST_STEP_M: f64 = 0.002;
/// So many of the coarse places are followed.
const FOLLOWED: usize = 4;

/// By chance alone, the numbers of [`FINE`] differ by 0.07.
const MOST_UNEVEN: f64 = 0.13;
/// More of the points lie behind others only if they are of several scans.
const MOST_HIDDEN: f64 = 0.1;
/// A point is behind another one if it is farther by this share.
const BEHIND: f64 = 1.2;
/// Points a cell when hidden points are counted. Beside an edge, a cell has near and far points.
const PER_SIGHT: f64 = 4.0;

/// Finds where a scanner stood that turned by equal steps about the upright axis, as terrestrial scanners do.
/// `points` are all points of one scan, in metres, Z-up, in any order. What is not finite is passed over. The
/// place comes out within a few centimetres.
///
/// # Errors
/// [`OriginError`].
pub fn find_origin(points: &[Vec3]) -> Result<FoundOrigin, OriginError> {
    let points: Vec<Vec3> = points.iter().copied().filter(|p| p.is_finite()).collect();
    if points.len() < LEAST_POINTS {
        return Err(OriginError::FewPoints { points: points.len() });
    }

    let coarse = Sky::new(&points, COARSE);
    let mut places: Vec<(f64, DVec3)> = candidates(&points)
        .into_par_iter()
        .map(|place| (coarse.unevenness(place), place))
        .collect();
    // The order of the places decides between equals.
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    places.truncate(FOLLOWED);

    let fine = Sky::new(&points, FINE);
    let ends: Vec<(f64, DVec3)> = places.par_iter().map(|(_, place)| descent(&fine, *place)).collect();
    let end = ends.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let (unevenness, origin) = end.unwrap_or((f64::INFINITY, DVec3::ZERO));
    let best = FoundOrigin { origin, unevenness, hidden: fine.hidden(origin) };
    if best.unevenness <= MOST_UNEVEN && best.hidden <= MOST_HIDDEN {
        Ok(best)
    } else {
        Err(OriginError::Uneven { best })
    }
}

/// The places around the fullest cubes, within the box of the points.
fn candidates(points: &[Vec3]) -> Vec<DVec3> {
    let mut counts: HashMap<[i32; 3], u32> = HashMap::new();
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for point in points {
        *counts
            .entry((*point / CUBE_M).floor().as_ivec3().to_array())
            .or_default() += 1;
        (low, high) = (low.min(*point), high.max(*point));
    }
    let mut cubes: Vec<(Reverse<u32>, [i32; 3])> =
        counts.into_iter().map(|(cube, count)| (Reverse(count), cube)).collect();
    cubes.sort_unstable();

    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    let steps = |reach_m: f64| {
        let count = (reach_m / STEP_M).round() as i32;
        move || (-count..=count).map(|k| f64::from(k) * STEP_M)
    };
    let (sideways, upwards) = (steps(SIDEWAYS_M), steps(UPWARDS_M));
    let mut places = Vec::new();
    for (_, cube) in cubes.iter().take(CUBES) {
        let middle = (DVec3::from_array(cube.map(f64::from)) + 0.5) * f64::from(CUBE_M);
        for (x, y) in sideways().flat_map(|x| sideways().map(move |y| (x, y))) {
            let all = upwards().map(|z| middle + dvec3(x, y, z));
            places.extend(all.filter(|place| place.cmpgt(low).all() && place.cmplt(high).all()));
        }
    }
    places
}

/// Goes downhill from a place in ever smaller steps. Returns the unevenness at the end, and the end.
fn descent(sky: &Sky, start: DVec3) -> (f64, DVec3) {
    let mut best = (sky.unevenness(start), start);
    let mut step_m = STEP_M / 2.0;
    while step_m >= LAST_STEP_M {
        let around = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
        let next = around
            .map(|axis| best.1 + axis * step_m)
            .map(|place| (sky.unevenness(place), place))
            .into_iter()
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match next {
            Some(next) if next.0 < best.0 => best = next,
            _ => step_m /= 2.0,
        }
    }
    best
}

/// Some of the points, to be seen from places.
struct Sky {
    points: Vec<Vec3>,
    per_cell: f64,
}

impl Sky {
    /// Takes about `count` points. Which they are looks random: every k-th point of a file would be a pattern.
    fn new(points: &[Vec3], (count, per_cell): (usize, f64)) -> Self {
        let share = count as f64 / points.len() as f64;
        let is_taken = |i: usize| f64::from(chance(i as u32, 0)) <= share;
        let taken = points.iter().enumerate().filter(|(i, _)| is_taken(*i));
        Self { points: taken.map(|(_, point)| *point).collect(), per_cell }
    }

    /// Calls `visit` with the cell of each point, and its range. There are twice as many columns of cells as
    /// rows. Returns the number of cells.
    fn cells(&self, place: DVec3, per_cell: f64, mut visit: impl FnMut(usize, f64)) -> usize {
        let rows = (self.points.len() as f64 / per_cell / 2.0).sqrt().ceil().max(2.0);
        let columns = 2.0 * rows;
        for point in &self.points {
            let off = point.as_dvec3() - place;
            let azimuth = libm::atan2(off.y, off.x);
            let elevation = libm::atan2(off.z, libm::hypot(off.x, off.y));
            let column = ((azimuth / TAU + 0.5) * columns).min(columns - 1.0);
            let row = ((elevation / PI + 0.5) * rows).min(rows - 1.0);
            visit(row as usize * columns as usize + column as usize, off.length());
        }
        (rows * columns) as usize
    }

    fn unevenness(&self, place: DVec3) -> f64 {
        let mut counts: Vec<u32> = Vec::new();
        self.cells(place, self.per_cell, |cell, _| {
            if counts.len() <= cell {
                counts.resize(cell + 1, 0);
            }
            counts[cell] += 1;
        });
        // Directions in which nothing comes back, as through the tripod and to the sky, tell nothing.
        counts.retain(|count| *count > 0);
        let mut numbers: Vec<f64> = counts.into_iter().map(f64::from).collect();
        let middle = median(&mut numbers);
        numbers.iter_mut().for_each(|n| *n = (*n - middle).abs());
        median(&mut numbers) / middle.max(1.0)
    }

    fn hidden(&self, place: DVec3) -> f64 {
        let mut seen: Vec<(usize, f64)> = Vec::with_capacity(self.points.len());
        let count = self.cells(place, PER_SIGHT, |cell, range| seen.push((cell, range)));
        let mut nearest = vec![f64::INFINITY; count];
        seen.iter()
            .for_each(|(cell, range)| nearest[*cell] = nearest[*cell].min(*range));
        let behind = seen.iter().filter(|(cell, range)| *range > BEHIND * nearest[*cell]);
        behind.count() as f64 / seen.len().max(1) as f64
    }
}

/// The middle one of some numbers, 0 of none.
fn median(numbers: &mut [f64]) -> f64 {
    if numbers.is_empty() {
        return 0.0;
    }
    let at = numbers.len() / 2;
    *numbers.select_nth_unstable_by(at, f64::total_cmp).1
}
