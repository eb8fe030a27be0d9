//! Fisheye lenses, by OpenCV's model.

use glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::PI;

/// The intrinsics of a fisheye camera: the distance of a pixel from the principal point follows the angle off
/// the axis.
///
/// A direction (x, y, z) in OpenCV's axes (x right, y down, z forward) at the angle θ off the axis is
/// projected to
///
/// ```text
/// θ' = θ (1 + k₁θ² + k₂θ⁴ + k₃θ⁶ + k₄θ⁸),   r = √(x² + y²)
/// (fx · θ'x/r + cx, fy · θ'y/r + cy)
/// ```
///
/// in pixels, with (0, 0) at the top left corner of the picture. Source: OpenCV's `fisheye` module; COLMAP's
/// OPENCV_FISHEYE.
#[derive(Clone, Copy, Debug, PartialEq)]
///
/// ```
/// use s3d_geom::{FisheyeLens, glam::{dvec2, dvec3}};
///
/// // Without distortion, every degree takes equally many pixels. Straight right is 90° off the axis.
/// let lens = FisheyeLens::new([640, 480], dvec2(200.0, 200.0), dvec2(320.0, 240.0), [0.0; 4]).unwrap();
/// let pixel = lens.project(dvec3(5.0, 0.0, 0.0)).unwrap();
/// assert!((pixel.x - 320.0 - 200.0 * 90f64.to_radians()).abs() < 1e-9);
/// assert!(lens.direction(pixel).unwrap().abs_diff_eq(dvec3(1.0, 0.0, 0.0), 1e-9));
/// ```
pub struct FisheyeLens {
    /// Width and height of the picture in pixels.
    size: [u32; 2],
    focal_px: DVec2,
    center_px: DVec2,
    /// k₁ k₂ k₃ k₄.
    distortion: [f64; 4],
    /// The largest θ up to which θ' grows. Directions farther off the axis would appear in the wrong place.
    last_rad: f64,
    /// θ' of `last_rad`.
    last_bent: f64,
}

/// The steps from 0 to π in which the largest θ is searched.
const STEPS: u32 = 2000;

impl FisheyeLens {
    /// Makes a lens from the focal lengths and the principal point in pixels, and OpenCV's k₁ k₂ k₃
    /// k₄.
    ///
    /// Returns `None` if a number is not finite, a size is 0, a focal length is not above 0, or no direction
    /// is projected to the middle of the picture.
    pub fn new(size: [u32; 2], focal_px: DVec2, center_px: DVec2, distortion: [f64; 4]) -> Option<Self> {
        let finite =
            focal_px.is_finite() && center_px.is_finite() && distortion.iter().all(|k| k.is_finite());
        if !finite || focal_px.min_element() <= 0.0 || size.contains(&0) {
            return None;
        }

        let last_rad = (1..=STEPS)
            .map(|k| PI * f64::from(k) / f64::from(STEPS))
            .take_while(|angle| slope(distortion, *angle) > 0.0)
            .last()
            .unwrap_or(0.0);
        let last_bent = bent(distortion, last_rad);

        let lens = Self { size, focal_px, center_px, distortion, last_rad, last_bent };
        let middle = dvec2(f64::from(size[0]), f64::from(size[1])) * 0.5;
        lens.direction(middle).is_some().then_some(lens)
    }

    /// Returns the width of the picture in pixels.
    pub fn width(&self) -> u32 {
        self.size[0]
    }

    /// Returns the height of the picture in pixels.
    pub fn height(&self) -> u32 {
        self.size[1]
    }

    /// Returns the focal lengths in pixels, to the right and downwards.
    pub fn focal_px(&self) -> DVec2 {
        self.focal_px
    }

    /// Returns the principal point in pixels from the top left corner of the picture.
    pub fn center_px(&self) -> DVec2 {
        self.center_px
    }

    /// Returns k₁ k₂ k₃ k₄.
    pub fn distortion(&self) -> [f64; 4] {
        self.distortion
    }

    /// Projects a direction of any length, in OpenCV's axes, to the plane of the picture, in pixels. Returns
    /// `None` if the direction is zero, not finite, or so far off the axis that the polynomial folds back.
    pub fn project(&self, direction: DVec3) -> Option<DVec2> {
        let r = libm::hypot(direction.x, direction.y);
        let angle = libm::atan2(r, direction.z);
        if !direction.is_finite() || direction == DVec3::ZERO || angle > self.last_rad {
            return None;
        }

        let outwards = if r > 0.0 { direction.truncate() / r } else { DVec2::ZERO };
        Some(self.focal_px * outwards * bent(self.distortion, angle) + self.center_px)
    }

    /// Returns the direction, a unit vector in OpenCV's axes, that is projected to `pixel`. Returns `None` if
    /// there is none. Newton's method within bounds, exact to 1e-12.
    pub fn direction(&self, pixel: DVec2) -> Option<DVec3> {
        let goal = (pixel - self.center_px) / self.focal_px;
        let distance = libm::hypot(goal.x, goal.y);
        if distance.is_nan() || distance > self.last_bent {
            return None;
        }

        // θ' grows over the whole range, so the bounds close in on the one solution.
        let mut low = 0.0;
        let mut high = self.last_rad;
        let mut angle = distance.min(high);
        for _ in 0..60 {
            let error = bent(self.distortion, angle) - distance;
            if error.abs() < 1e-15 {
                break;
            }
            if error > 0.0 {
                high = angle;
            } else {
                low = angle;
            }
            let newton = angle - error / slope(self.distortion, angle);
            angle = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
        }

        let (sin, cos) = libm::sincos(angle);
        let outwards = if distance > 0.0 { goal / distance } else { DVec2::ZERO };
        Some(dvec3(outwards.x * sin, outwards.y * sin, cos))
    }
}

/// Returns θ' for the angle θ.
fn bent([k1, k2, k3, k4]: [f64; 4], angle: f64) -> f64 {
    let s = angle * angle;
    angle * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4))))
}

/// Returns the derivative of θ' by θ.
fn slope([k1, k2, k3, k4]: [f64; 4], angle: f64) -> f64 {
    let s = angle * angle;
    1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lens(distortion: [f64; 4]) -> Option<FisheyeLens> {
        FisheyeLens::new([640, 480], dvec2(300.5, 301.75), dvec2(321.25, 239.5), distortion)
    }

    #[test]
    fn a_pixel_as_the_formula_has_it() {
        // Computed independently of this code, in Python.
        let lens = lens([0.03, -0.012, 0.004, -0.0006]).unwrap();
        let pixel = lens.project(dvec3(0.9, -0.7, 0.8)).unwrap();
        assert!(pixel.abs_diff_eq(PIXEL, 1e-9), "{pixel}");
        assert!(
            lens.project(dvec3(0.9, -0.7, 0.8) * 7.0)
                .unwrap()
                .abs_diff_eq(PIXEL, 1e-9)
        );
    }
    const PIXEL: DVec2 = DVec2::new(553.2941891413759, 58.270442405667865);

    proptest! {
        #[test]
        fn pixels_come_back(
            x in 0.0..640.0f64, y in 0.0..480.0f64, k1 in -0.02..0.1f64, k2 in -0.01..0.02f64,
            k3 in -0.002..0.005f64, k4 in -0.0002..0.001f64,
        ) {
            let lens = lens([k1, k2, k3, k4]).unwrap();
            let direction = lens.direction(dvec2(x, y)).unwrap();
            prop_assert!((direction.length() - 1.0).abs() < 1e-12);
            let back = lens.project(direction * 3.0).unwrap();
            prop_assert!(back.abs_diff_eq(dvec2(x, y), 1e-9), "{back}");
        }

        #[test]
        fn directions_come_back(angle in 0.0..3.0f64, around in 0.0..6.3f64, k1 in 0.0..0.1f64) {
            let (sin, cos) = libm::sincos(angle);
            let (s, c) = libm::sincos(around);
            let direction = dvec3(sin * c, sin * s, cos);
            let lens = lens([k1, 0.0, 0.0, 0.0]).unwrap();
            let back = lens.direction(lens.project(direction).unwrap()).unwrap();
            prop_assert!(back.abs_diff_eq(direction, 1e-9), "{back}");
        }
    }

    #[test]
    fn what_a_polynomial_folds_back_is_not_seen() {
        // θ' is largest at θ² = 1 / (3 · 0.3).
        let lens = lens([-0.3, 0.0, 0.0, 0.0]).unwrap();
        let at = |angle: f64| lens.project(dvec3(angle.sin(), 0.0, angle.cos()));
        assert!(at(1.05).is_some() && at(1.06).is_none());
        assert_eq!(lens.direction(dvec2(321.25 + 300.5 * 0.71, 239.5)), None);
        assert!(lens.direction(dvec2(321.25 + 300.5 * 0.7, 239.5)).is_some());
        assert_eq!(lens.direction(DVec2::NAN), None);
        assert_eq!(lens.project(DVec3::ZERO), None);
        assert_eq!(lens.project(dvec3(0.0, 0.0, 2.0)), Some(dvec2(321.25, 239.5)));
    }

    #[test]
    fn lenses_that_cannot_be_are_refused() {
        assert_eq!(lens([f64::NAN, 0.0, 0.0, 0.0]), None);
        assert_eq!(FisheyeLens::new([0, 4], DVec2::ONE, DVec2::ONE, [0.0; 4]), None);
        assert_eq!(FisheyeLens::new([4, 4], dvec2(1.0, 0.0), DVec2::ONE, [0.0; 4]), None);
        // The polynomial folds back before the middle of the picture.
        let off =
            FisheyeLens::new([640, 480], dvec2(300.0, 300.0), dvec2(-400.0, 240.0), [-3.0, 0.0, 0.0, 0.0]);
        assert_eq!(off, None);
    }
}
