//! A spherical laser scanner on its tripod.

use super::chance::Chance;
use super::disturbance::Disturbances;
use super::target::{Met, ScanTarget};
use crate::RangeError;
use crate::building::ScanLocation;
use rayon::prelude::*;
use s3d_geom::Raster;
use s3d_geom::glam::{DQuat, DVec3, Vec3, dvec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A laser scanner that turns about the vertical axis of its tripod, while its mirror turns about a level
/// one.
///
/// The `Default` has the figures of the data sheet of Leica's BLK360 (first generation): 360° × 300° of
/// view, ranges of 0.6 m to 60 m that are off by 4 mm at 10 m and 7 mm at 20 m, angles off by 40″, a beam
/// of 2.25 mm that widens by 0.4 mrad. Its grid is coarser: 0.15°, which is 1 cm at 4 m.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserScanner {
    /// The columns of a full turn: 4 to 40,000.
    pub columns: u32,
    /// The rows from the lowest to the highest elevation: 2 to 20,000.
    pub rows: u32,
    /// The lowest and the highest elevation of the field of view, −π/2 to π/2.
    pub elevation_rad: [f64; 2],
    /// The shortest and the longest range that is measured, metres: 0 to 1,000.
    pub range_m: [f32; 2],
    /// The deviation of ranges close by, on a white surface at a right angle, metres: 0 to 0.1.
    pub noise_m: f32,
    /// What a metre of range adds to the deviation, metres: 0 to 0.01. Less light that comes back makes it
    /// grow with its inverse root (Wujanz, Burger, Mettenleiter and Neitzel 2017, "An intensity-based
    /// stochastic model for terrestrial laser scanners").
    pub noise_per_m: f32,
    /// The deviation of both angles: 0 to 0.01.
    pub angle_noise_rad: f64,
    /// The width of the beam where it leaves the scanner, metres: 0 to 0.05.
    pub beam_m: f32,
    /// How much the beam widens a metre: 0 to 0.02. Where it hits two surfaces, the range is the mean of
    /// both, by their light (Hebert and Krotkov 1992, "3D measurements from imaging laser radars").
    pub beam_rad: f32,
    /// The share of the light that must come back from within 10 m, 0 to 1. A white surface at a right angle
    /// returns 1. Beyond 10 m the share that must come back grows with the square of the range.
    pub least_signal: f32,
    /// The share of rays that come back from the panes of windows: 0 to 1.
    pub glass: f32,
    /// What spoils the scan.
    pub disturbances: Disturbances,
    /// The seed of all randomness.
    pub seed: u64,
}

impl Default for LaserScanner {
    fn default() -> Self {
        Self {
            columns: 2400,
            rows: 1000,
            elevation_rad: [-60f64.to_radians(), FRAC_PI_2],
            range_m: [0.6, 60.0],
            noise_m: 0.001,
            noise_per_m: 0.0003,
            angle_noise_rad: 0.0002,
            beam_m: 0.002_25,
            beam_rad: 0.0004,
            least_signal: 0.02,
            glass: 0.1,
            disturbances: Disturbances::default(),
            seed: 1,
        }
    }
}

/// What a laser scanner measured from one place, on its grid. Columns are azimuths and rows are elevations:
/// see [`LaserScan::direction`].
#[derive(Clone, Debug, PartialEq)]
pub struct LaserScan {
    /// Where the scanner stood: world metres.
    pub origin: DVec3,
    /// The rotation from the scanner's axes (z up) to the world.
    pub world_from_scanner: DQuat,
    /// The lowest and the highest elevation of the field of view.
    pub elevation_rad: [f64; 2],
    /// Distances along the rays, metres: `columns` wide, `rows` high. NaN where nothing came back.
    pub ranges: Raster<f32>,
    /// Colours at the middles of the rays. Black where nothing came back.
    pub colors: Raster<[u8; 3]>,
    /// The share of the light that came back, 0 to 1. 0 where nothing did.
    pub intensity: Raster<f32>,
}

/// The middle and four places at half the width of the beam, with their shares of the light.
const BEAM: [([f32; 2], f32); 5] =
    [([0.0, 0.0], 0.4), ([0.5, 0.0], 0.15), ([-0.5, 0.0], 0.15), ([0.0, 0.5], 0.15), ([0.0, -0.5], 0.15)];

/// The range up to which [`LaserScanner::least_signal`] holds.
const NEAR_M: f32 = 10.0;

/// The most that weak light widens the noise.
const MOST_NOISE: f32 = 5.0;

/// What random numbers are for.
const AZIMUTH: u32 = 0;
const ELEVATION: u32 = 1;
const RANGE: u32 = 2;
const SIGNAL: u32 = 3;
const GLASS: u32 = 4;

impl LaserScanner {
    pub(crate) fn check(&self) -> Result<(), RangeError> {
        let check = |value: f64, range, what: &str| RangeError::check(value, range, || what.to_owned());
        check(self.columns.into(), [4.0, 40_000.0], "the number of columns")?;
        check(self.rows.into(), [2.0, 20_000.0], "the number of rows")?;
        let [low, high] = self.elevation_rad;
        check(low, [-FRAC_PI_2, FRAC_PI_2], "the lowest elevation")?;
        check(high, [low + 1e-3, FRAC_PI_2], "the highest elevation")?;
        check(self.range_m[0].into(), [0.0, 1000.0], "the shortest range")?;
        check(self.range_m[1].into(), [self.range_m[0].into(), 1000.0], "the longest range")?;
        check(self.noise_m.into(), [0.0, 0.1], "the noise of ranges")?;
        check(self.noise_per_m.into(), [0.0, 0.01], "the noise of ranges a metre")?;
        check(self.angle_noise_rad, [0.0, 0.01], "the noise of angles")?;
        check(self.beam_m.into(), [0.0, 0.05], "the width of the beam")?;
        check(self.beam_rad.into(), [0.0, 0.02], "how much the beam widens")?;
        check(self.least_signal.into(), [0.0, 1.0], "the light that must come back")?;
        check(self.glass.into(), [0.0, 1.0], "the share of rays that panes return")?;
        self.disturbances.check()
    }
}

impl LaserScan {
    /// Returns the number of columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.ranges.width(), self.ranges.height()]
    }

    /// Returns the direction of a grid point in the scanner's axes, a unit vector. Column 0 is next to +x,
    /// and azimuths grow towards +y. Row 0 is next to the highest elevation.
    pub fn direction(&self, column: u32, row: u32) -> DVec3 {
        direction(self.size(), self.elevation_rad, [column, row].map(f64::from))
    }

    /// Returns a point in the scanner's axes, metres. `None` where nothing came back.
    pub fn point(&self, column: u32, row: u32) -> Option<DVec3> {
        let range = self.ranges.at(column, row);
        range
            .is_finite()
            .then(|| self.direction(column, row) * f64::from(range))
    }

    /// Returns a point in the world, metres. `None` where nothing came back.
    pub fn world_point(&self, column: u32, row: u32) -> Option<DVec3> {
        let point = self.point(column, row)?;
        Some(self.world_from_scanner * point + self.origin)
    }
}

fn direction([columns, rows]: [u32; 2], [low, high]: [f64; 2], [column, row]: [f64; 2]) -> DVec3 {
    let azimuth = (column + 0.5) * TAU / f64::from(columns);
    let elevation = (high - (row + 0.5) * (high - low) / f64::from(rows)).clamp(-FRAC_PI_2, FRAC_PI_2);
    let (sin, cos) = libm::sincos(elevation);
    let (y, x) = libm::sincos(azimuth);
    dvec3(x * cos, y * cos, sin)
}

/// What comes back of a pulse.
#[derive(Clone, Copy)]
struct Echo {
    range: f32,
    color: [u8; 3],
    intensity: f32,
}

/// A scan that is being taken.
struct Pulses<'a> {
    scanner: &'a LaserScanner,
    origin: DVec3,
    turn: DQuat,
    with: Disturbances,
    chance: Chance,
}

const NOTHING: Echo = Echo { range: f32::NAN, color: [0; 3], intensity: 0.0 };

impl ScanTarget<'_> {
    /// Scans from a location, with the scanner's y axis along its heading. `number` tells scans apart that
    /// have the same seed.
    ///
    /// A range is too short or too long by a random share of the noise, and its ray is not quite in the
    /// direction of its grid point. Nothing comes back from dark and glancing surfaces, from most of glass,
    /// and from outside of the range.
    ///
    /// ```
    /// use s3d_synth::Building;
    /// use s3d_synth::device::{LaserScanner, ScanTarget};
    ///
    /// let scene = Building { texture_scale: 0.05, ..Building::demo() }.build()?;
    /// let target = ScanTarget::new(&scene);
    /// let scanner = LaserScanner { columns: 90, rows: 40, ..LaserScanner::default() };
    /// let scan = target.laser_scan(&scene.locations[0], &scanner, 0)?;
    ///
    /// // The ceiling above the scanner.
    /// let above = scan.world_point(0, 0).unwrap();
    /// assert!(above.z > scan.origin.z + 0.6);
    /// assert!(scan.colors.at(0, 0) != [0; 3] && scan.intensity.at(0, 0) > 0.02);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`RangeError`] for a number that is out of its range.
    pub fn laser_scan(
        &self,
        location: &ScanLocation,
        scanner: &LaserScanner,
        number: u64,
    ) -> Result<LaserScan, RangeError> {
        scanner.check()?;
        let turn = DQuat::from_rotation_z(location.yaw_rad);
        let pulses = Pulses {
            scanner,
            origin: location.position,
            turn,
            with: scanner.disturbances.during(number),
            chance: Chance::new(scanner.seed, number),
        };

        let mut echoes = Raster::filled(scanner.columns, scanner.rows, NOTHING);
        let rows = echoes.pixels_mut().par_chunks_mut(scanner.columns as usize);
        rows.enumerate().for_each(|(row, echoes)| {
            for (column, echo) in (0..).zip(echoes) {
                *echo = self.echo(&pulses, [column, row as u32]).unwrap_or(NOTHING);
            }
        });

        let column = |pixels: Vec<_>| Raster::from_vec(scanner.columns, scanner.rows, pixels);
        let pixels = echoes.pixels();
        Ok(LaserScan {
            origin: location.position,
            world_from_scanner: turn,
            elevation_rad: scanner.elevation_rad,
            ranges: column(pixels.iter().map(|e| e.range).collect()),
            colors: echoes.map(|e| e.color),
            intensity: column(pixels.iter().map(|e| e.intensity).collect()),
        })
    }

    /// Returns what comes back to a grid point, if anything does.
    fn echo(&self, pulses: &Pulses<'_>, [column, row]: [u32; 2]) -> Option<Echo> {
        let Pulses { scanner, origin, turn, ref with, chance } = *pulses;
        let size = [scanner.columns, scanner.rows];
        let [low, high] = scanner.elevation_rad;
        let off = |what| scanner.angle_noise_rad * f64::from(chance.normal(column, row, what));
        let place = [
            f64::from(column) + off(AZIMUTH) * f64::from(scanner.columns) / TAU,
            f64::from(row) + off(ELEVATION) * f64::from(scanner.rows) / (high - low),
        ];
        let ray = turn * direction(size, scanner.elevation_rad, place);
        let time = column as f32 / scanner.columns as f32;
        let hits_glass = chance.unit(column, row, GLASS) < scanner.glass;

        // The beam, by the light of its parts.
        let (right, up) = ray.as_vec3().any_orthonormal_pair();
        let mut middle: Option<Met> = None;
        let mut light = 0.0;
        let mut weighted = 0.0;
        for ([x, y], share) in BEAM {
            let aside = right * x + up * y;
            let from = origin.as_vec3() + aside * scanner.beam_m;
            let along: Vec3 = ray.as_vec3() + aside * scanner.beam_rad;

            let Some(met) = self.meet(from, along, with, time) else { continue };
            if met.is_glass && !hits_glass {
                continue;
            }
            middle = middle.or(Some(met));
            light += share * met.signal();
            weighted += share * met.signal() * met.distance;
        }

        let range = weighted / light;
        let far = (range / NEAR_M).max(1.0);
        let least = scanner.least_signal * far * far * (1.0 + 0.25 * chance.normal(column, row, SIGNAL));
        let [shortest, longest] = scanner.range_m;
        if !(light > 0.0 && light >= least && (shortest..=longest).contains(&range)) {
            return None;
        }

        let wider = light.sqrt().recip().min(MOST_NOISE);
        let noise = (scanner.noise_m + scanner.noise_per_m * range) * wider;
        let range = range + noise * chance.normal(column, row, RANGE);
        Some(Echo { range, color: middle?.rgb(), intensity: light.min(1.0) })
    }
}
