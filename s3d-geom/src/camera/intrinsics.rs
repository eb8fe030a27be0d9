//! Focal lengths, principal points and angles of view.

use super::{Camera, CameraError, Pose, Projection};
use glam::{DVec2, dvec2};
use std::f64::consts::{FRAC_PI_2, PI};

impl Camera {
    /// Makes a pinhole camera from focal lengths and the principal point in pixels. The centre of the first
    /// pixel is at (½, ½). An undistorted photograph has such a camera.
    ///
    /// ```
    /// use s3d_geom::{Camera, Pose, glam::{dvec2, dvec3}};
    ///
    /// // The camera looks along +Y. A point straight ahead is at the principal point, not in the middle.
    /// let pose = Pose::level(dvec3(0.0, 0.0, 1.5), 0.0);
    /// let camera = Camera::pinhole(pose, dvec2(500.0, 510.0), dvec2(300.0, 250.0), 640, 480)?;
    /// let (pixel, depth_m) = camera.project(dvec3(0.0, 4.0, 1.5)).unwrap();
    /// assert!(pixel.abs_diff_eq(dvec2(300.0, 250.0), 1e-9) && depth_m == 4.0);
    /// # Ok::<(), s3d_geom::CameraError>(())
    /// ```
    ///
    /// # Errors
    /// [`CameraError::NoPixels`], [`CameraError::FocalLength`], [`CameraError::PrincipalPoint`],
    /// [`CameraError::NotFinite`].
    pub fn pinhole(
        pose: Pose,
        focal_px: DVec2,
        center_px: DVec2,
        width: u32,
        height: u32,
    ) -> Result<Self, CameraError> {
        if !pose.location.is_finite() || !pose.world_from_camera.is_finite() {
            return Err(CameraError::NotFinite);
        }
        let projection = Projection::Pinhole { focal_px, center_px };
        Self { pose, projection, width, height }.checked()
    }

    /// Makes a pinhole camera from the matrices of computer vision, row by row: K, and RT, which is world →
    /// camera in OpenCV's axes. [`Camera::k_matrix`] and [`Pose::rt_matrix`] return the same matrices.
    ///
    /// # Errors
    /// [`CameraError::Intrinsics`] if K has a skew or another last row; the errors of [`Camera::pinhole`] and
    /// [`Pose::from_rt`].
    pub fn from_k_rt(
        k: [[f64; 3]; 3],
        rt: [[f64; 4]; 3],
        width: u32,
        height: u32,
    ) -> Result<Self, CameraError> {
        let [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]] = k else { return Err(CameraError::Intrinsics) };
        Self::pinhole(Pose::from_rt(rt)?, dvec2(fx, fy), dvec2(cx, cy), width, height)
    }

    /// Makes a pinhole camera with square pixels, the principal point in the middle, and the vertical angle
    /// of view `fov_y_rad`.
    ///
    /// # Errors
    /// [`CameraError::NoPixels`], [`CameraError::AngleOfView`].
    pub fn perspective_vertical(
        pose: Pose,
        fov_y_rad: f64,
        width: u32,
        height: u32,
    ) -> Result<Self, CameraError> {
        let aspect = f64::from(width) / f64::from(height);
        let fov_rad = 2.0 * libm::atan(aspect * libm::tan(0.5 * fov_y_rad));
        if !(fov_y_rad > 0.0 && fov_y_rad < PI) {
            return Err(CameraError::AngleOfView(fov_y_rad));
        }
        Self { pose, projection: Projection::Perspective { fov_rad }, width, height }.checked()
    }

    /// Returns the camera if its image size and projection are valid.
    pub(super) fn checked(self) -> Result<Self, CameraError> {
        let Self { width, height, .. } = self;
        if width == 0 || height == 0 {
            return Err(CameraError::NoPixels { width, height });
        }
        match self.projection {
            Projection::Perspective { fov_rad } if !(fov_rad > 0.0 && fov_rad < PI) => {
                Err(CameraError::AngleOfView(fov_rad))
            }
            Projection::Pinhole { focal_px, .. } if !is_focal_length(focal_px) => {
                Err(CameraError::FocalLength(focal_px))
            }
            Projection::Pinhole { center_px, .. } if !center_px.is_finite() => {
                Err(CameraError::PrincipalPoint(center_px))
            }
            _ => Ok(self),
        }
    }

    /// Returns true for a panorama. All other cameras are pinholes.
    pub fn is_panorama(&self) -> bool {
        self.projection == Projection::Equirectangular
    }

    /// Returns the horizontal angle of view for the pose file. For a pinhole, this is the angle between the
    /// left and the right edge of the image, in the plane of the optical axis. For a panorama it is π/2, as
    /// in the published files.
    pub fn fov_rad(&self) -> f64 {
        match self.projection {
            Projection::Perspective { fov_rad } => fov_rad,
            Projection::Pinhole { focal_px, center_px } => {
                let right = f64::from(self.width) - center_px.x;
                libm::atan(center_px.x / focal_px.x) + libm::atan(right / focal_px.x)
            }
            Projection::Equirectangular => FRAC_PI_2,
        }
    }

    /// Returns the focal lengths in pixels, along the width and the height of the image. A camera with an
    /// angle of view has (W/2) / tan(fov/2) along both.
    pub fn focal_px(&self) -> DVec2 {
        match self.projection {
            Projection::Pinhole { focal_px, .. } => focal_px,
            _ => DVec2::splat(0.5 * f64::from(self.width) / libm::tan(0.5 * self.fov_rad())),
        }
    }

    /// Returns the principal point in pixels from the top left corner of the image. It is the middle, unless
    /// it was given.
    pub fn center_px(&self) -> DVec2 {
        match self.projection {
            Projection::Pinhole { center_px, .. } => center_px,
            _ => dvec2(0.5 * f64::from(self.width), 0.5 * f64::from(self.height)),
        }
    }

    /// Returns `camera_k_matrix` of the pose files, row by row: the focal lengths and the principal point.
    pub fn k_matrix(&self) -> [[f64; 3]; 3] {
        let f = self.focal_px();
        let c = self.center_px();
        [[f.x, 0.0, c.x], [0.0, f.y, c.y], [0.0, 0.0, 1.0]]
    }
}

/// Returns true if both focal lengths and their inverses are finite and above 0.
fn is_focal_length(focal_px: DVec2) -> bool {
    focal_px.is_finite() && focal_px.recip().is_finite() && focal_px.min_element() > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec3};
    use proptest::prelude::*;

    fn pose() -> Pose {
        Pose::level(dvec3(1.0, 2.0, 1.5), 0.8).turned(0.4, -0.3)
    }

    proptest! {
        #[test]
        fn pixels_come_back_and_matrices_say_the_same(
            x in -20.0..84.0f64, y in -20.0..52.0f64, t in 0.1..50.0f64,
            fx in 5.0..300.0f64, fy in 5.0..300.0f64, cx in -100.0..200.0f64, cy in -100.0..200.0f64,
        ) {
            let camera = Camera::pinhole(pose(), dvec2(fx, fy), dvec2(cx, cy), 64, 32).unwrap();
            let direction = camera.direction(x, y);
            prop_assert!((direction.dot(camera.pose.forward()) - 1.0).abs() < 1e-12);
            let point = camera.pose.location + direction * t;
            let (pixel, depth) = camera.project(point).unwrap();
            prop_assert!(pixel.abs_diff_eq(dvec2(x, y), 1e-6) && (depth - t).abs() < 1e-9 * t);

            // K · RT · point, as other programs compute it.
            let k = camera.k_matrix();
            let rt = camera.pose.rt_matrix();
            let v = DVec3::from_array(rt.map(|r| r[0] * point.x + r[1] * point.y + r[2] * point.z + r[3]));
            let v = DVec3::from_array(k.map(|r| DVec3::from_array(r).dot(v)));
            prop_assert!((v.truncate() / v.z).abs_diff_eq(dvec2(x, y), 1e-6));
            let back = Camera::from_k_rt(k, rt, 64, 32).unwrap();
            prop_assert_eq!(back.projection, camera.projection);
            prop_assert!(back.pose.location.abs_diff_eq(camera.pose.location, 1e-12));
        }

        #[test]
        fn rays_are_those_of_directions(
            i in 0u32..64,
            j in 0u32..32,
            fx in 5.0..300.0f64,
            cy in -99.0..99.0f64,
        ) {
            let camera = Camera::pinhole(pose(), dvec2(fx, 80.0), dvec2(20.0, cy), 64, 32).unwrap();
            let direction = camera.direction(f64::from(i) + 0.5, f64::from(j) + 0.5);
            prop_assert!(camera.rays().at(i, j).abs_diff_eq(direction, 1e-11 * direction.length()));
        }
    }

    /// A camera from an angle of view equals the camera from its focal length, to the last bit.
    #[test]
    fn a_centred_pinhole_is_the_perspective_camera() {
        for (fov, width, height) in [(1.2, 64, 32), (0.3, 1080, 1080), (2.9, 33, 517)] {
            let a = Camera::perspective(pose(), fov, width, height);
            let b = Camera::pinhole(pose(), a.focal_px(), a.center_px(), width, height).unwrap();
            assert!((b.fov_rad() - fov).abs() < 1e-14 && a.k_matrix() == b.k_matrix());
            for (i, j) in [(0, 0), (width - 1, height - 1), (7, 20)] {
                assert_eq!(a.rays().at(i, j), b.rays().at(i, j));
            }
            let point = dvec3(-2.0, 5.0, 1.0);
            assert_eq!(a.project(point), b.project(point));
            assert_eq!(a.direction(3.25, 4.5), b.direction(3.25, 4.5));
        }
    }

    #[test]
    fn angles_of_view() {
        let tall = Camera::perspective_vertical(pose(), 1.2, 300, 600).unwrap();
        assert!((tall.focal_px() - 300.0 / 0.6f64.tan()).abs().max_element() < 1e-9);
        let half_rad = tall.direction(150.0, 0.0).angle_between(tall.pose.forward());
        assert!((half_rad - 0.6).abs() < 1e-7, "{half_rad}");
        // The left edge is 45° off the axis, and the right edge is on it.
        let off = Camera::pinhole(pose(), dvec2(100.0, 50.0), dvec2(100.0, 0.0), 100, 10).unwrap();
        assert!((off.fov_rad() - PI / 4.0).abs() < 1e-12);
    }

    fn refused(f: DVec2, c: DVec2, w: u32, h: u32) -> CameraError {
        Camera::pinhole(pose(), f, c, w, h).unwrap_err()
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        let f = dvec2(100.0, 100.0);
        let c = dvec2(5.0, 5.0);
        assert_eq!(refused(f, c, 0, 3), CameraError::NoPixels { width: 0, height: 3 });
        for focal in [dvec2(0.0, 1.0), dvec2(1.0, -1.0), dvec2(1.0, f64::INFINITY), dvec2(1e-320, 1.0)] {
            assert_eq!(refused(focal, c, 9, 9), CameraError::FocalLength(focal));
        }
        let far = dvec2(f64::INFINITY, 0.0);
        assert_eq!(refused(f, far, 9, 9), CameraError::PrincipalPoint(far));
        let nowhere = Pose { location: DVec3::NAN, ..pose() };
        assert_eq!(Camera::pinhole(nowhere, f, c, 9, 9), Err(CameraError::NotFinite));
        let skewed = [[100.0, 0.1, 5.0], [0.0, 100.0, 5.0], [0.0, 0.0, 1.0]];
        assert_eq!(Camera::from_k_rt(skewed, pose().rt_matrix(), 9, 9), Err(CameraError::Intrinsics));
        let flat = Camera::perspective_vertical(pose(), PI, 9, 9);
        assert_eq!(flat, Err(CameraError::AngleOfView(PI)));
        assert!(Camera::perspective_vertical(pose(), 1.0, 9, 0).is_err());
    }
}
