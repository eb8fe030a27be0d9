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
use s3d_geom::glam::{DVec3, Vec3};
use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap};
use std::f64::consts::{PI, TAU};
use thiserror::Error;

/// The place of a scanner that was found by its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundOrigin {
    /// The place, in the frame of the points, metres.
    pub origin: DVec3,
    /// How much the number of points differs between directions: the mean deviation from the median, as a
    /// share of it, in the three quarters of the directions where it differs least. 0: the same everywhere.
    pub unevenness: f64,
    /// The share of the points that lie behind others.
    pub hidden: f64,
}

/// The reason why no place was found.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum OriginError {
    /// There are fewer points than tell anything.
    #[error("there are {points}, and it takes {LEAST_POINTS}")]
    FewPoints {
        /// The number of finite points.
        points: usize,
    },
    /// From no place are the points spread evenly over all directions.
    #[error(
        "from no place are they spread evenly over all directions, so they are of several scans, thinned, or \
         of a scanner that moved"
    )]
    Uneven {
        /// The place that came closest.
        best: FoundOrigin,
    },
}

/// The fewest points.
const LEAST_POINTS: usize = 20_000;
/// Points of the coarse search, on the way from there and near the end, and points a cell of directions.
const COARSE: (usize, f64) = (4_000, 25.0);
const MIDDLE: (usize, f64) = (16_000, 50.0);
const FINE: (usize, f64) = (100_000, 100.0);

/// The side of the cubes of which the fullest is looked for, and the number of them, metres.
const CUBE_M: f32 = 0.25;
const CUBES: usize = 3;
/// How far from these cubes the scanner is looked for, sideways and in height, and in which steps, metres.
const SIDEWAYS_M: f64 = 2.4;
const UPWARDS_M: f64 = 6.0;
const STEP_M: f64 = 0.4;
/// The first and last steps from there, and those near the end, metres.
const MIDDLE_STEPS_M: [f64; 2] = [0.2, 0.025];
const FINE_STEPS_M: [f64; 2] = [0.05, 0.002];
/// So many of the coarse places are followed.
const FOLLOWED: usize = 4;

/// By chance alone, the numbers of [`FINE`] differ by 0.03.
const MOST_UNEVEN: f64 = 0.06;
/// The share of the cells that count. In the others less comes back, as beside a window, or where the view of
/// the scanner ends.
const COUNTED: f64 = 0.75;
/// More of the points lie behind others only if they are of several scans.
const MOST_HIDDEN: f64 = 0.1;
/// A point is behind another one if it is farther by this share.
const BEHIND: f64 = 1.2;
/// Points a cell when hidden points are counted. Beside an edge, a cell has near and far points.
const PER_SIGHT: f64 = 4.0;

/// Finds where a scanner stood that turned by equal steps about the upright axis, as terrestrial scanners do.
/// `points` are all points of one scan, in metres, Z-up, in any order. What is not finite is passed over. Its
/// height comes out within 5 cm, and the rest within 1 cm.
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

    let [middle, fine] = [MIDDLE, FINE].map(|of| Sky::new(&points, of));
    let ends: Vec<(f64, DVec3)> = places
        .par_iter()
        .map(|(_, place)| descent(&middle, *place, MIDDLE_STEPS_M))
        .collect();
    let end = ends.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let start = end.map_or(DVec3::ZERO, |(_, place)| place);
    let (unevenness, origin) = descent(&fine, start, FINE_STEPS_M);
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
    let [sideways, upwards] = [SIDEWAYS_M, UPWARDS_M].map(|reach_m| (reach_m / STEP_M).round() as i32);
    let mut places: BTreeSet<[i32; 3]> = BTreeSet::new();
    for (_, cube) in cubes.iter().take(CUBES) {
        let middle = (DVec3::from_array(cube.map(f64::from)) + 0.5) * f64::from(CUBE_M);
        let [x, y, z] = (middle / STEP_M).round().as_ivec3().to_array();
        for i in -sideways..=sideways {
            for j in -sideways..=sideways {
                places.extend((-upwards..=upwards).map(|k| [x + i, y + j, z + k]));
            }
        }
    }
    let places = places
        .into_iter()
        .map(|place| DVec3::from_array(place.map(f64::from)) * STEP_M);
    places
        .filter(|place| place.cmpgt(low).all() && place.cmplt(high).all())
        .collect()
}

/// Goes downhill from a place, in steps from the first length to the last. Returns the unevenness at the end,
/// and the end.
fn descent(sky: &Sky, start: DVec3, [mut step_m, last_m]: [f64; 2]) -> (f64, DVec3) {
    let mut best = (sky.unevenness(start), start);
    while step_m >= last_m {
        let around = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
        let next = around
            .map(|axis| best.1 + axis * step_m)
            .into_par_iter()
            .map(|place| (sky.unevenness(place), place))
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
    /// Takes about `count` points. Which they are looks random: every k-th point would be a pattern.
    fn new(points: &[Vec3], (count, per_cell): (usize, f64)) -> Self {
        let share = count as f64 / points.len() as f64;
        let is_taken = |i: usize| f64::from(chance(i as u32, 0)) <= share;
        let taken = points.iter().enumerate().filter(|(i, _)| is_taken(*i));
        Self { points: taken.map(|(_, point)| *point).collect(), per_cell }
    }

    /// Returns the columns and rows of cells for so many points a cell.
    fn size(&self, per_cell: f64) -> [usize; 2] {
        let rows = (self.points.len() as f64 / per_cell / 2.0).sqrt().ceil().max(2.0) as usize;
        [2 * rows, rows]
    }

    /// Returns where points are seen from a place, in columns and rows of cells, and their ranges.
    fn seen(&self, place: DVec3, size: [usize; 2]) -> impl Iterator<Item = ([f64; 2], f64)> {
        let [columns, rows] = size.map(|n| n as f64);
        self.points.iter().map(move |point| {
            let off = point.as_dvec3() - place;
            let azimuth = libm::atan2(off.y, off.x);
            let elevation = libm::atan2(off.z, libm::hypot(off.x, off.y));
            ([(azimuth / TAU + 0.5) * columns, (elevation / PI + 0.5) * rows], off.length())
        })
    }

    fn unevenness(&self, place: DVec3) -> f64 {
        // A point counts in the four cells around it. The steps of the scanner would make a pattern with the
        // borders of cells otherwise.
        let size = self.size(self.per_cell);
        let [columns, rows] = size;
        let mut counts = vec![0.0; columns * rows];
        for ([x, y], _) in self.seen(place, size) {
            let [(x, right), (y, up)] = [x, y].map(|at| ((at + 0.5) as usize, (at + 0.5).fract()));
            let x = [x + columns - 1, x].map(|x| x % columns);
            let y = [y.max(1) - 1, y.min(rows - 1)];
            counts[y[0] * columns + x[0]] += (1.0 - right) * (1.0 - up);
            counts[y[0] * columns + x[1]] += right * (1.0 - up);
            counts[y[1] * columns + x[0]] += (1.0 - right) * up;
            counts[y[1] * columns + x[1]] += right * up;
        }

        // Directions in which nothing comes back, as through the tripod and to the sky, tell nothing.
        counts.retain(|count| *count > 0.0);
        let at = counts.len() / 2;
        let Some(middle) = (!counts.is_empty()).then(|| *counts.select_nth_unstable_by(at, f64::total_cmp).1)
        else {
            return 1.0;
        };
        counts
            .iter_mut()
            .for_each(|count| *count = (*count / middle - 1.0).abs());
        counts.sort_unstable_by(f64::total_cmp);
        counts.truncate(((counts.len() as f64 * COUNTED) as usize).max(1));
        counts.iter().sum::<f64>() / counts.len() as f64
    }

    fn hidden(&self, place: DVec3) -> f64 {
        let size = self.size(PER_SIGHT);
        let cell = |[x, y]: [f64; 2]| (y as usize).min(size[1] - 1) * size[0] + (x as usize).min(size[0] - 1);
        let seen: Vec<(usize, f64)> = self.seen(place, size).map(|(at, range)| (cell(at), range)).collect();
        let mut nearest = vec![f64::INFINITY; size[0] * size[1]];
        seen.iter()
            .for_each(|(cell, range)| nearest[*cell] = nearest[*cell].min(*range));
        let behind = seen.iter().filter(|(cell, range)| *range > BEHIND * nearest[*cell]);
        behind.count() as f64 / seen.len().max(1) as f64
    }
}
