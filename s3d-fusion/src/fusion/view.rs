//! Which pixels of an image see a voxel, or a box of voxels.

use crate::lanes::{LANES, Lanes, atan2, floor};
use crate::range_image::{AngleGrid, Directions, RangeImage, angles_of};
use s3d_geom::PhotoLens;
use s3d_geom::glam::{DMat3, DVec3};

/// From the world to the pixels of an image.
pub(crate) struct View<'a> {
    pub(crate) location: DVec3,
    /// From the world to OpenCV's axes of the sensor.
    pub(crate) turn: DMat3,
    pub(crate) size: [u32; 2],
    projection: Projection<'a>,
}

enum Projection<'a> {
    /// Focal lengths and principal point of a lens without distortion.
    Pinhole {
        focal: [f32; 2],
        center: [f32; 2],
    },
    Lens(&'a PhotoLens),
    Angles(&'a AngleGrid),
}

/// Pixels and ranges of a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extent {
    /// The first and last columns and rows that may see it, within the image.
    pub(crate) from: [u32; 2],
    pub(crate) to: [u32; 2],
    /// Whether all of it is within the image.
    pub(crate) is_within: bool,
    /// The smallest and largest range.
    pub(crate) near: f32,
    pub(crate) far: f32,
}

impl<'a> View<'a> {
    pub(crate) fn new(image: &'a RangeImage) -> Self {
        let pose = image.pose();
        let projection = match image.directions() {
            Directions::Lens(lens) => match lens {
                PhotoLens::Straight(straight) if straight.distortion() == [0.0; 5] => {
                    let focal = straight.focal_px().as_vec2().to_array();
                    let center = straight.center_px().as_vec2().to_array();
                    Projection::Pinhole { focal, center }
                }
                _ => Projection::Lens(lens),
            },
            Directions::Angles(grid) => Projection::Angles(grid),
        };
        let size = [image.width(), image.height()];
        Self { location: pose.location, turn: pose.opencv_from_world(), size, projection }
    }

    /// Returns the pixels and the ranges of points in the axes of the sensor; `u32::MAX` for points outside
    /// of the image.
    #[inline(always)]
    pub(crate) fn pixels(&self, points: &[Lanes; 3]) -> ([u32; LANES], Lanes) {
        let [x, y, z] = points;
        let mut pixels = [u32::MAX; LANES];
        match &self.projection {
            Projection::Pinhole { focal, center } => {
                let [width, height] = self.size.map(|s| s as f32);
                for k in 0..LANES {
                    let inverse = z[k].recip();
                    let u = focal[0] * x[k] * inverse + center[0];
                    let v = focal[1] * y[k] * inverse + center[1];
                    let is_seen = z[k] > 0.0 && u >= 0.0 && v >= 0.0 && u < width && v < height;
                    let (u, v) = if is_seen { (u, v) } else { (0.0, 0.0) };
                    let pixel = floor(v) as u32 * self.size[0] + floor(u) as u32;
                    pixels[k] = if is_seen { pixel } else { u32::MAX };
                }
                (pixels, *z)
            }
            Projection::Lens(lens) => {
                let size = self.size.map(f64::from);
                for k in 0..LANES {
                    let point = DVec3::new(x[k].into(), y[k].into(), z[k].into());
                    let Some(at) = lens.project(point) else { continue };
                    if at.x >= 0.0 && at.y >= 0.0 && at.x < size[0] && at.y < size[1] {
                        pixels[k] = at.y as u32 * self.size[0] + at.x as u32;
                    }
                }
                (pixels, *z)
            }
            Projection::Angles(grid) => {
                let (mut flat, mut ranges) = ([0.0; LANES], [0.0; LANES]);
                for k in 0..LANES {
                    let square = x[k] * x[k] + z[k] * z[k];
                    (flat[k], ranges[k]) = (square.sqrt(), (square + y[k] * y[k]).sqrt());
                }
                let (azimuths, elevations) = (atan2(x, z), atan2(y, &flat));
                for k in 0..LANES {
                    if let Some([column, row]) = grid.pixel(azimuths[k].into(), elevations[k].into()) {
                        pixels[k] = row * self.size[0] + column;
                    }
                }
                (pixels, ranges)
            }
        }
    }

    /// Returns the pixels that may see a ball, and its ranges. Returns `None` if no pixel sees it.
    pub(crate) fn extent(&self, middle: DVec3, radius: f64) -> Option<Extent> {
        let at = self.turn * (middle - self.location);
        let whole = [[0.0; 2], self.size.map(f64::from)];
        let (near, far, bounds) = match &self.projection {
            Projection::Angles(grid) => {
                let distance = at.length();
                let bounds = if distance > 1.001 * radius {
                    self.angle_bounds(grid, at, radius)
                } else {
                    None
                };
                (distance - radius, distance + radius, bounds)
            }
            Projection::Pinhole { focal, center } => {
                let (near, far) = (at.z - radius, at.z + radius);
                if far <= 0.0 {
                    return None;
                }
                let side = |k: usize| {
                    let [f, c] = [focal[k], center[k]].map(f64::from);
                    let [low, high] = [at[k] - radius, at[k] + radius];
                    [f * (low / near).min(low / far) + c, f * (high / near).max(high / far) + c]
                };
                let bounds = (near > 1e-3)
                    .then(|| [0, 1].map(side))
                    .map(|[x, y]| [[x[0], y[0]], [x[1], y[1]]]);
                (near, far, bounds)
            }
            Projection::Lens(_) => {
                let (near, far) = (at.z - radius, at.z + radius);
                if far <= 0.0 {
                    return None;
                }
                (
                    near,
                    far,
                    if near > 1e-3 {
                        self.corner_bounds(at, radius)
                    } else {
                        None
                    },
                )
            }
        };

        let is_known = bounds.is_some();
        let [from, to] = bounds.unwrap_or(whole);
        let [width, height] = self.size.map(f64::from);
        if to[0] < 0.0 || to[1] < 0.0 || from[0] >= width || from[1] >= height {
            return None;
        }
        let is_within = is_known && from[0] >= 0.0 && from[1] >= 0.0 && to[0] < width && to[1] < height;
        let clipped = |p: [f64; 2]| [0, 1].map(|k| p[k].clamp(0.0, f64::from(self.size[k] - 1)) as u32);
        let (near, far) = (near.max(0.0) as f32, far as f32);
        Some(Extent { from: clipped(from), to: clipped(to), is_within, near, far })
    }

    /// Returns pixels around the projection of a cube about a ball, or `None` if a corner is not projected.
    fn corner_bounds(&self, at: DVec3, radius: f64) -> Option<[[f64; 2]; 2]> {
        let Projection::Lens(lens) = &self.projection else { return None };
        let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for corner in 0..8 {
            let sign = |bit: i32| if corner & bit == 0 { -radius } else { radius };
            let p = lens.project(at + DVec3::new(sign(1), sign(2), sign(4)))?;
            for k in 0..2 {
                bounds[0][k] = bounds[0][k].min(p[k]);
                bounds[1][k] = bounds[1][k].max(p[k]);
            }
        }
        // Edges of the cube may bend outwards by a little.
        let more = |k: usize| 2.0 + 0.1 * (bounds[1][k] - bounds[0][k]);
        Some([[0, 1].map(|k| bounds[0][k] - more(k)), [0, 1].map(|k| bounds[1][k] + more(k))])
    }

    /// Returns the columns and rows of the angles that a ball takes, or `None` if they are not one range of
    /// each.
    fn angle_bounds(&self, grid: &AngleGrid, at: DVec3, radius: f64) -> Option<[[f64; 2]; 2]> {
        let [azimuth, elevation] = angles_of(at);
        let half = libm::asin(radius / at.length());
        let flat = libm::hypot(at.x, at.z);
        if flat <= 1.001 * radius {
            return None;
        }
        let half_azimuth = libm::asin(radius / flat);
        let [a, b] = grid.columns_between(azimuth - half_azimuth, azimuth + half_azimuth)?;
        let [c, d] = grid.rows_between(elevation - half, elevation + half)?;
        Some([[a, c].map(f64::from), [b, d].map(f64::from)])
    }
}
