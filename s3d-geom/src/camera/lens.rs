//! Lenses with OpenCV's radial and tangential distortion.

use glam::{DVec2, DVec3, dvec2, dvec3};

/// The intrinsics of a real camera: a pinhole with a lens that bends straight lines.
///
/// A direction (x, y, z) in OpenCV's axes (x right, y down, z forward) is divided by z, distorted to
///
/// ```text
/// r² = x² + y²,   q = 1 + k₁r² + k₂r⁴ + k₃r⁶
/// x' = x·q + 2p₁xy + p₂(r² + 2x²),   y' = y·q + p₁(r² + 2y²) + 2p₂xy
/// ```
///
/// and projected to the pixel (fx·x' + cx, fy·y' + cy). The top left corner of the picture is (0, 0), and
/// the centre of pixel (i, j) is at (i + ½, j + ½), as everywhere. Source: OpenCV's `projectPoints`;
/// `s3d_io::formats`, "The scanner's pictures".
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "as_data::Lens")
)]
///
/// ```
/// use s3d_geom::{Lens, glam::{dvec2, dvec3}};
///
/// // k₁ < 0 moves points off the axis towards the middle.
/// let lens =
///     Lens::new([640, 480], dvec2(500.0, 500.0), dvec2(320.0, 240.0), [-0.1, 0.0, 0.0, 0.0, 0.0]).unwrap();
/// let pixel = lens.project(dvec3(1.0, 0.0, 2.0)).unwrap();
/// assert!(pixel.x < 320.0 + 500.0 * 0.5 && (pixel.y - 240.0).abs() < 1e-9);
/// assert!(lens.direction(pixel).unwrap().abs_diff_eq(dvec3(0.5, 0.0, 1.0), 1e-9));
/// ```
pub struct Lens {
    /// Width and height of the picture in pixels.
    size: [u32; 2],
    focal_px: DVec2,
    center_px: DVec2,
    /// k₁ k₂ p₁ p₂ k₃.
    distortion: [f64; 5],
    /// The r² up to which q·r grows. Directions farther off the axis would appear in the wrong place.
    #[cfg_attr(feature = "serde", serde(skip_serializing))]
    last_r2: f64,
}

/// The r² at which the search for the largest r² stops: 84° off the axis.
const FARTHEST_R2: f64 = 100.0;

impl Lens {
    /// Makes a lens from the focal lengths and the principal point in pixels, and OpenCV's k₁ k₂ p₁
    /// p₂ k₃.
    ///
    /// Returns `None` if a number is not finite, a size is 0, a focal length is not above 0, or no direction
    /// is projected to the middle of the picture.
    pub fn new(size: [u32; 2], focal_px: DVec2, center_px: DVec2, distortion: [f64; 5]) -> Option<Self> {
        let finite =
            focal_px.is_finite() && center_px.is_finite() && distortion.iter().all(|k| k.is_finite());
        if !finite || focal_px.min_element() <= 0.0 || size.contains(&0) {
            return None;
        }

        // Searches where the derivative of r·q(r²) becomes negative. Steps are small where most lenses end.
        let [k1, k2, _, _, k3] = distortion;
        let mut last_r2 = 0.0;
        while last_r2 < FARTHEST_R2 {
            let s = last_r2 + 0.002 + 0.01 * last_r2;
            if 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * 7.0 * k3)) <= 0.0 {
                break;
            }
            last_r2 = s;
        }

        let lens = Self { size, focal_px, center_px, distortion, last_r2 };
        lens.direction(dvec2(f64::from(size[0]), f64::from(size[1])) * 0.5)
            .is_some()
            .then_some(lens)
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

    /// Returns OpenCV's k₁ k₂ p₁ p₂ k₃.
    pub fn distortion(&self) -> [f64; 5] {
        self.distortion
    }

    /// Projects a direction of any length, in OpenCV's axes, to the plane of the picture, in pixels. Returns
    /// `None` if the direction points behind the camera, or so far off the axis that the polynomial folds
    /// back.
    #[inline]
    pub fn project(&self, direction: DVec3) -> Option<DVec2> {
        if direction.z <= 0.0 {
            return None;
        }
        let x = direction.x / direction.z;
        let y = direction.y / direction.z;
        (x * x + y * y <= self.last_r2).then(|| self.focal_px * self.bent(x, y) + self.center_px)
    }

    #[inline]
    fn bent(&self, x: f64, y: f64) -> DVec2 {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let xx = x * x;
        let yy = y * y;
        let xy = x * y;
        let r2 = xx + yy;
        let q = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        dvec2(x * q + 2.0 * p1 * xy + p2 * (r2 + 2.0 * xx), y * q + p1 * (r2 + 2.0 * yy) + 2.0 * p2 * xy)
    }

    /// Returns the direction, with z = 1 in OpenCV's axes, that is projected to `pixel`. Returns `None` if
    /// there is none. Newton's method, exact to 1e-12.
    pub fn direction(&self, pixel: DVec2) -> Option<DVec3> {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let goal = (pixel - self.center_px) / self.focal_px;
        let mut at = goal;
        if self.distortion == [0.0; 5] {
            return (at.length_squared() <= self.last_r2).then(|| at.extend(1.0));
        }

        for _ in 0..50 {
            let error = self.bent(at.x, at.y) - goal;
            if error.abs().max_element() < 1e-13 {
                break;
            }

            // The Jacobian. dq is twice the derivative of q by r².
            let x = at.x;
            let y = at.y;
            let r2 = at.length_squared();
            let q = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let dq = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
            let xx = q + x * x * dq + 2.0 * p1 * y + 6.0 * p2 * x;
            let xy = x * y * dq + 2.0 * p1 * x + 2.0 * p2 * y;
            let yy = q + y * y * dq + 6.0 * p1 * y + 2.0 * p2 * x;
            let det = xx * yy - xy * xy;
            if det <= 0.0 {
                return None;
            }
            at -= dvec2(yy * error.x - xy * error.y, xx * error.y - xy * error.x) / det;
        }

        let close = (self.bent(at.x, at.y) - goal).abs().max_element() < 1e-9;
        (close && at.length_squared() <= self.last_r2).then(|| dvec3(at.x, at.y, 1.0))
    }

    /// Returns the tangent of the largest angle off the axis that the picture shows.
    pub fn reach(&self) -> f64 {
        self.border(16)
            .map(|pixel| self.direction(pixel).map_or(self.last_r2, |d| d.x * d.x + d.y * d.y))
            .fold(0.0, f64::max)
            .sqrt()
    }

    /// Returns places along the border of the picture, `steps` per side.
    fn border(&self, steps: u32) -> impl Iterator<Item = DVec2> {
        let size = dvec2(f64::from(self.size[0]), f64::from(self.size[1]));
        (0..steps).flat_map(move |k| {
            let t = f64::from(k) / f64::from(steps);
            [dvec2(t, 0.0), dvec2(1.0, t), dvec2(1.0 - t, 1.0), dvec2(0.0, 1.0 - t)].map(|p| p * size)
        })
    }
}

#[cfg(feature = "serde")]
mod as_data {
    use glam::DVec2;

    /// A lens before it is checked.
    #[derive(serde::Deserialize)]
    pub(super) struct Lens {
        size: [u32; 2],
        focal_px: DVec2,
        center_px: DVec2,
        distortion: [f64; 5],
    }

    impl TryFrom<Lens> for super::Lens {
        type Error = &'static str;

        fn try_from(Lens { size, focal_px, center_px, distortion }: Lens) -> Result<Self, &'static str> {
            Self::new(size, focal_px, center_px, distortion)
                .ok_or("no direction is projected to the middle of the picture")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lens(distortion: [f64; 5]) -> Option<Lens> {
        Lens::new([1280, 1024], dvec2(1075.72, 1075.66), dvec2(636.877, 515.013), distortion)
    }

    #[test]
    fn a_pixel_as_opencv_computes_it() {
        // cv2.projectPoints of (0.4, −0.3, 1.1) with these intrinsics.
        let lens = lens([0.11, -0.23, 0.0012, -0.0007, 0.05]).unwrap();
        let pixel = lens.project(dvec3(0.4, -0.3, 1.1)).unwrap();
        assert!(pixel.abs_diff_eq(dvec2(OPENCV[0], OPENCV[1]), 1e-9), "{pixel}");
    }
    const OPENCV: [f64; 2] = [1032.6592609652184, 218.342875382699];

    proptest! {
        #[test]
        fn pixels_come_back(
            x in 0.0..1280.0f64, y in 0.0..1024.0f64, k1 in -0.12..0.15f64, k2 in -0.05..0.1f64,
            p1 in -0.003..0.003f64, p2 in -0.003..0.003f64, k3 in -0.02..0.02f64,
        ) {
            let lens = lens([k1, k2, p1, p2, k3]).unwrap();
            let direction = lens.direction(dvec2(x, y)).unwrap();
            let back = lens.project(direction * 3.0).unwrap();
            prop_assert!(back.abs_diff_eq(dvec2(x, y), 1e-6), "{back}");
        }
    }

    #[test]
    fn what_a_polynomial_folds_back_is_not_seen() {
        // q·r is largest at r² = 1 / (3 · 0.3).
        let lens = lens([-0.3, 0.0, 0.0, 0.0, 0.0]).unwrap();
        assert_eq!(lens.direction(DVec2::ZERO), None, "no direction comes to the corner");
        assert!((1.0..1.1).contains(&lens.reach()), "{}", lens.reach());
        assert!(lens.project(dvec3(1.0, 0.0, 1.0)).is_some());
        assert_eq!(lens.project(dvec3(1.1, 0.0, 1.0)), None);
        // Without that limit it would be projected to the middle.
        assert!(lens.bent(1.8, 0.0).x < 0.1);
        assert_eq!(lens.project(dvec3(0.0, 0.0, -1.0)), None);
        assert_eq!(lens.project(dvec3(1.0, 0.0, 0.0)), None);
    }

    #[test]
    fn lenses_that_cannot_be_are_refused() {
        assert_eq!(lens([f64::NAN, 0.0, 0.0, 0.0, 0.0]), None);
        // The polynomial folds back before the middle of the picture.
        let off =
            Lens::new([640, 480], dvec2(500.0, 500.0), dvec2(-400.0, 240.0), [-3.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(off, None);
        assert_eq!(Lens::new([0, 4], DVec2::ONE, DVec2::ONE, [0.0; 5]), None);
        assert_eq!(Lens::new([4, 4], dvec2(1.0, 0.0), DVec2::ONE, [0.0; 5]), None);
    }
}
