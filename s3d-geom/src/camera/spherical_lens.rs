//! Pictures whose columns are azimuths and whose rows are elevations.

use glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::{PI, TAU};

/// The projection of a spherical picture: all around, or a part of it.
///
/// Pixels are counted like those of a [`Lens`](super::Lens), and directions are in OpenCV's axes (x right, y
/// down, z forward). The middle of the picture looks forward. Columns are angles about the vertical axis of
/// the camera, rows are angles above its horizon; each pixel has the same size in both.
///
/// ```
/// use s3d_geom::{SphericalLens, glam::{dvec2, dvec3}};
/// use std::f64::consts::PI;
///
/// let whole = SphericalLens::new([360, 180], dvec2(PI / 180.0, PI / 180.0)).unwrap();
/// assert!(whole.is_whole());
/// // Straight right is a quarter turn from the middle, and up is the upper border.
/// assert!(whole.project(dvec3(2.0, 0.0, 0.0)).abs_diff_eq(dvec2(270.0, 90.0), 1e-9));
/// assert!((whole.project(dvec3(0.0, -1.0, 1e-12)).y).abs() < 1e-9);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalLens {
    size: [u32; 2],
    /// The width and height of a pixel, radians.
    pixel_rad: DVec2,
}

impl SphericalLens {
    /// Makes the projection from the size of the picture and the width and height of a pixel in radians. A
    /// picture that is within half a pixel of a full turn is one, and so is one of half a turn in height.
    ///
    /// Returns `None` if a size is 0, an angle is not above 0 and finite, or the picture is wider than a
    /// full turn or higher than half a turn.
    pub fn new(size: [u32; 2], pixel_rad: DVec2) -> Option<Self> {
        let is_angle = pixel_rad.is_finite() && pixel_rad.cmpgt(DVec2::ZERO).all();
        if size.contains(&0) || !is_angle {
            return None;
        }

        let x = fitted(size[0], pixel_rad.x, TAU)?;
        let y = fitted(size[1], pixel_rad.y, PI)?;
        Some(Self { size, pixel_rad: dvec2(x, y) })
    }

    /// Returns the width of the picture in pixels.
    pub fn width(&self) -> u32 {
        self.size[0]
    }

    /// Returns the height of the picture in pixels.
    pub fn height(&self) -> u32 {
        self.size[1]
    }

    /// Returns the width and height of a pixel in radians.
    pub fn pixel_rad(&self) -> DVec2 {
        self.pixel_rad
    }

    /// Tells whether the first column follows the last one.
    pub fn is_around(&self) -> bool {
        self.pixel_rad.x == TAU / f64::from(self.size[0])
    }

    /// Tells whether the picture reaches from pole to pole.
    pub fn is_pole_to_pole(&self) -> bool {
        self.pixel_rad.y == PI / f64::from(self.size[1])
    }

    /// Tells whether the picture shows every direction.
    pub fn is_whole(&self) -> bool {
        self.is_around() && self.is_pole_to_pole()
    }

    /// Projects a direction of any length to the plane of the picture, in pixels. The place is outside of
    /// the picture if this does not show the direction.
    pub fn project(&self, direction: DVec3) -> DVec2 {
        let flat = libm::hypot(direction.x, direction.z);
        let to_the_right = libm::atan2(direction.x, direction.z);
        let downwards = libm::atan2(direction.y, flat);
        self.middle() + dvec2(to_the_right, downwards) / self.pixel_rad
    }

    /// Returns the direction, a unit vector, that is projected to `pixel`.
    pub fn direction(&self, pixel: DVec2) -> DVec3 {
        let angles = (pixel - self.middle()) * self.pixel_rad;
        let (sin_x, cos_x) = libm::sincos(angles.x);
        let (sin_y, cos_y) = libm::sincos(angles.y);
        dvec3(cos_y * sin_x, sin_y, cos_y * cos_x)
    }

    fn middle(&self) -> DVec2 {
        dvec2(f64::from(self.size[0]), f64::from(self.size[1])) * 0.5
    }
}

/// Returns the angle of a pixel, exact if `count` of them are within half a pixel of `most`. Returns `None`
/// if they are more.
fn fitted(count: u32, pixel_rad: f64, most: f64) -> Option<f64> {
    let beyond = f64::from(count) * pixel_rad - most;
    if beyond.abs() <= 0.5 * pixel_rad {
        return Some(most / f64::from(count));
    }
    (beyond < 0.0).then_some(pixel_rad)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_and_directions_are_inverse() {
        for lens in [
            SphericalLens::new([360, 180], dvec2(PI / 180.0, PI / 180.0)).unwrap(),
            SphericalLens::new([100, 80], dvec2(0.02, 0.01)).unwrap(),
        ] {
            for pixel in [dvec2(0.5, 0.5), dvec2(50.0, 40.0), dvec2(99.0, 3.25)] {
                let direction = lens.direction(pixel);
                assert!((direction.length() - 1.0).abs() < 1e-12);
                assert!(lens.project(direction * 7.0).abs_diff_eq(pixel, 1e-9), "{pixel}");
            }
        }
        // The middle looks forward, right of it is right, below it is down.
        let lens = SphericalLens::new([100, 80], dvec2(0.02, 0.01)).unwrap();
        assert!(lens.direction(dvec2(50.0, 40.0)).abs_diff_eq(DVec3::Z, 1e-12));
        assert!(lens.direction(dvec2(60.0, 40.0)).x > 0.1 && lens.direction(dvec2(50.0, 50.0)).y > 0.09);
    }

    #[test]
    fn a_rounded_full_turn_is_one() {
        // Four digits of 2π / 100.
        let lens = SphericalLens::new([100, 50], dvec2(0.0628, 0.0628)).unwrap();
        assert!(lens.is_whole());
        assert_eq!(lens.pixel_rad(), dvec2(TAU / 100.0, PI / 50.0));
        let band = SphericalLens::new([100, 40], dvec2(0.0628, 0.0628)).unwrap();
        assert!(band.is_around() && !band.is_pole_to_pole());
        let part = SphericalLens::new([90, 50], dvec2(0.0628, 0.0628)).unwrap();
        assert!(!part.is_around() && part.is_pole_to_pole() && !part.is_whole());

        for (size, pixel_rad) in [
            ([0, 50], dvec2(0.01, 0.01)),
            ([100, 50], dvec2(0.0, 0.01)),
            ([100, 50], dvec2(f64::NAN, 0.01)),
            ([102, 50], dvec2(0.0628, 0.0628)),
            ([100, 52], dvec2(0.0628, 0.0628)),
        ] {
            assert_eq!(SphericalLens::new(size, pixel_rad), None, "{size:?} {pixel_rad}");
        }
    }
}
