//! What one sensor saw from one place: a raster of ranges, and how its pixels become rays.

mod angles;
mod frame;
mod gaps;
mod points;
mod rays;
mod surfels;
mod world;

use crate::{FusionError, SensorNoise};
pub(crate) use angles::{AngleGrid, angles_of};
use rayon::prelude::*;
pub(crate) use rays::Rays;
use s3d_geom::glam::{DVec3, Vec3, dvec2};
use s3d_geom::{PhotoLens, Pose, Raster};
pub(crate) use surfels::Surfel;

/// What the numbers of a raster of ranges are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RangeKind {
    /// The distance along the optical axis (z-depth), as depth cameras write it.
    Depth,
    /// The distance along the ray.
    Distance,
}

/// What one sensor saw from one place.
///
/// Ranges are metres. Pixels without a range hold NaN: constructors take 0, NaN and infinity for "nothing was
/// measured". The world is Z-up, in metres.
#[derive(Clone, Debug)]
pub struct RangeImage {
    pose: Pose,
    directions: Directions,
    /// The z-depth where `directions` is a lens, and the distance where it is a grid of angles.
    ranges: Raster<f32>,
    /// Where the point of a pixel lies from the pixel's middle, in 1/254 of a pixel. Empty: in the middle.
    offsets: Vec<[i8; 2]>,
    colors: Vec<[u8; 3]>,
    noise: SensorNoise,
}

/// How pixels become rays.
#[derive(Clone, Debug)]
pub(crate) enum Directions {
    /// Rays with z = 1 in OpenCV's axes.
    Lens(PhotoLens),
    /// Unit rays.
    Angles(AngleGrid),
}

/// More ranges than half above this: they are not metres.
const MOST_MEDIAN_M: f32 = 300.0;

impl RangeImage {
    /// Makes an image from a depth picture with the lens and the pose of the depth camera.
    ///
    /// # Errors
    /// [`FusionError::Size`] if the lens has another size, [`FusionError::NothingMeasured`],
    /// [`FusionError::NegativeRange`], [`FusionError::NotMetres`], [`FusionError::Pose`],
    /// [`FusionError::Noise`].
    pub fn from_depth(
        pose: Pose,
        lens: PhotoLens,
        kind: RangeKind,
        ranges_m: Raster<f32>,
        noise: SensorNoise,
    ) -> Result<Self, FusionError> {
        let found = lens.size().map(u64::from);
        let expected = [ranges_m.width(), ranges_m.height()].map(u64::from);
        if found != expected {
            return Err(FusionError::Size { what: "a lens", found, expected });
        }

        let mut ranges = ranges_m;
        if kind == RangeKind::Distance {
            let width = ranges.width() as usize;
            for (i, range) in ranges.pixels_mut().iter_mut().enumerate() {
                let pixel = dvec2((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
                let cosine = lens.direction(pixel).map_or(f64::NAN, |d| d.z / d.length());
                *range = (f64::from(*range) * cosine) as f32;
            }
        }
        Self::checked(pose, Directions::Lens(lens), ranges, Vec::new(), noise)
    }

    /// Makes an image from a laser scan on a grid: `columns` × `rows` points in world metres, row by row,
    /// NaN where nothing was measured. A column has one azimuth about the upright axis of `pose`, and a row
    /// one elevation.
    ///
    /// Scans whose columns or rows do not have one angle are taken as points without a grid
    /// ([`RangeImage::from_points`]).
    ///
    /// # Errors
    /// Those of [`RangeImage::from_points`]; [`FusionError::Size`] if there are not `columns` × `rows`
    /// points.
    pub fn from_scan(
        pose: Pose,
        [columns, rows]: [u32; 2],
        points: &[Vec3],
        colors: &[[u8; 3]],
        noise: SensorNoise,
    ) -> Result<Self, FusionError> {
        if points.len() as u64 != u64::from(columns) * u64::from(rows) {
            let expected = [columns, rows].map(u64::from);
            return Err(FusionError::Size { what: "points", found: [points.len() as u64, 1], expected });
        }
        check_colors(points, colors)?;
        check_pose(&pose)?;

        let local = points::local(&pose, points);
        let Some(grid) = AngleGrid::of_scan([columns, rows], &local) else {
            return Self::from_local(pose, &local, colors, noise);
        };
        let offset = |(i, p): (usize, &DVec3)| {
            let pixel = [i as u32 % columns, i as u32 / columns];
            if p.is_finite() { grid.offset(pixel, *p) } else { [0; 2] }
        };
        let offsets = local.par_iter().enumerate().map(offset).collect();
        let ranges = local.par_iter().map(|p| p.length() as f32).collect();
        let ranges = Raster::from_vec(columns, rows, ranges);
        let image = Self::checked(pose, Directions::Angles(grid), ranges, offsets, noise)?;
        Ok(Self { colors: colors.to_vec(), ..image })
    }

    /// Makes an image from points without a grid, in world metres, that a scanner at the place of `pose`
    /// measured. They are sorted into a grid of angles about the upright axis of `pose`, at the scan's own
    /// angular resolution. Where several points come to a pixel, the nearest stays. `colors` is empty or has
    /// one entry a point.
    ///
    /// # Errors
    /// [`FusionError::Count`], [`FusionError::NothingMeasured`], [`FusionError::NotMetres`],
    /// [`FusionError::Pose`], [`FusionError::Noise`].
    pub fn from_points(
        pose: Pose,
        points: &[Vec3],
        colors: &[[u8; 3]],
        noise: SensorNoise,
    ) -> Result<Self, FusionError> {
        check_colors(points, colors)?;
        check_pose(&pose)?;
        Self::from_local(pose, &points::local(&pose, points), colors, noise)
    }

    fn from_local(
        pose: Pose,
        local: &[DVec3],
        colors: &[[u8; 3]],
        noise: SensorNoise,
    ) -> Result<Self, FusionError> {
        let binned = points::binned(local).ok_or(FusionError::NothingMeasured)?;
        let pick = |i: &u32| colors.get(*i as usize).copied().unwrap_or_default();
        let colors = if colors.is_empty() {
            Vec::new()
        } else {
            binned.point_of_pixel.iter().map(pick).collect()
        };
        let image =
            Self::checked(pose, Directions::Angles(binned.grid), binned.ranges, binned.offsets, noise)?;
        Ok(Self { colors, ..image })
    }

    /// Adds colours, a pixel each: R G B. Black (0, 0, 0) is no colour: it counts nothing.
    ///
    /// # Errors
    /// [`FusionError::Size`] if they have another size than the ranges.
    pub fn with_colors(self, colors: Raster<[u8; 3]>) -> Result<Self, FusionError> {
        let found = [colors.width(), colors.height()].map(u64::from);
        let expected = [self.width(), self.height()].map(u64::from);
        if found != expected {
            return Err(FusionError::Size { what: "a colour picture", found, expected });
        }
        Ok(Self { colors: colors.into_vec(), ..self })
    }

    fn checked(
        pose: Pose,
        directions: Directions,
        mut ranges: Raster<f32>,
        offsets: Vec<[i8; 2]>,
        noise: SensorNoise,
    ) -> Result<Self, FusionError> {
        check_pose(&pose)?;
        let noise = noise.check()?;
        let width = ranges.width().max(1) as usize;
        let mut measured = Vec::new();
        for (i, range) in ranges.pixels_mut().iter_mut().enumerate() {
            if *range < 0.0 {
                let (column, row) = ((i % width) as u32, (i / width) as u32);
                return Err(FusionError::NegativeRange { range_m: *range, column, row });
            }
            if range.is_finite() && *range > 0.0 {
                measured.push(*range);
            } else {
                *range = f32::NAN;
            }
        }

        if measured.is_empty() {
            return Err(FusionError::NothingMeasured);
        }
        let middle = measured.len() / 2;
        let median_m = *measured.select_nth_unstable_by(middle, f32::total_cmp).1;
        if median_m > MOST_MEDIAN_M {
            return Err(FusionError::NotMetres { median_m });
        }
        Ok(Self { pose, directions, ranges, offsets, colors: Vec::new(), noise })
    }

    /// Returns how pixels become rays.
    pub(crate) fn directions(&self) -> &Directions {
        &self.directions
    }

    /// Returns the place and rotation of the sensor.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Returns the width of the image in pixels.
    pub fn width(&self) -> u32 {
        self.ranges.width()
    }

    /// Returns the height of the image in pixels.
    pub fn height(&self) -> u32 {
        self.ranges.height()
    }

    /// Returns the ranges in metres: z-depths if the image has a lens, distances if it is a laser scan. NaN
    /// where nothing was measured.
    pub fn ranges(&self) -> &Raster<f32> {
        &self.ranges
    }

    /// Returns the colours R G B, row by row; empty if there are none.
    pub fn colors(&self) -> &[[u8; 3]] {
        &self.colors
    }

    /// Returns the noise of the sensor.
    pub fn noise(&self) -> SensorNoise {
        self.noise
    }
}

fn check_colors(points: &[Vec3], colors: &[[u8; 3]]) -> Result<(), FusionError> {
    if colors.is_empty() || colors.len() == points.len() {
        Ok(())
    } else {
        Err(FusionError::Count { what: "colours", found: colors.len(), points: points.len() })
    }
}

fn check_pose(pose: &Pose) -> Result<(), FusionError> {
    if pose.location.is_finite() && pose.world_from_camera.is_finite() {
        Ok(())
    } else {
        Err(FusionError::Pose(pose.location))
    }
}
