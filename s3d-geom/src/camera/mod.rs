//! Cameras: from pixels to rays and back.
//!
//! Pixel coordinates: x to the right, y down, the centre of pixel (i, j) at (i + ½, j + ½). Source:
//! `s3d_io::formats`, "What is written".

mod capture_lens;
mod error;
mod fisheye;
mod intrinsics;
mod lens;
mod photo_lens;
mod pose;
mod spherical_lens;

pub use capture_lens::CaptureLens;
pub use error::CameraError;
pub use fisheye::FisheyeLens;
pub use lens::Lens;
pub use photo_lens::PhotoLens;
pub use pose::{Pose, euler_from_rotation, rotation_from_euler};
pub use spherical_lens::SphericalLens;

use glam::{DMat3, DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::PI;

/// The mapping from directions to pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Projection {
    /// A pinhole with square pixels and the principal point in the middle.
    Perspective {
        /// The full horizontal angle of view, in (0, π).
        fov_rad: f64,
    },
    /// A general pinhole: any pixel proportions, any principal point.
    Pinhole {
        /// Focal lengths in pixels, along the width and the height of the image; both above 0.
        focal_px: DVec2,
        /// The principal point, in pixels from the top left corner of the image. It may lie outside.
        center_px: DVec2,
    },
    /// A panorama. Columns are longitudes, growing to the right. Rows are latitudes, from +90° at the top to
    /// −90°. The centre column looks along the forward axis of the pose, projected to the horizon. Up is
    /// +Z of the world, whatever the tilt of the pose.
    Equirectangular,
}

/// The axes in which normals are written. Source: `s3d_io::formats`, "What is written".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum NormalAxes {
    /// The axes of the paper: right, down and towards the camera. A surface that faces the camera has the
    /// normal (0, 0, 1).
    #[default]
    Paper,
    /// The axes of OpenCV: right, down and forward. A surface that faces the camera has the normal (0, 0,
    /// −1).
    ///
    /// A panorama has the axes X, −Z, Y of the world under both choices. They are OpenCV's axes for a level
    /// camera that looks along +Y.
    OpenCv,
}

impl NormalAxes {
    /// Returns the name: `paper` or `opencv`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::OpenCv => "opencv",
        }
    }

    /// Returns the axes with the name `word`.
    pub fn from_name(word: &str) -> Option<Self> {
        [Self::Paper, Self::OpenCv].into_iter().find(|axes| axes.name() == word)
    }
}

/// A pose, a projection and an image size.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "as_data::Camera")
)]
///
/// ```
/// use s3d_geom::{Camera, Pose, glam::dvec3};
///
/// // The camera looks along +Y. A point ahead and to the right (+X) is right of the middle. A point behind
/// // the camera is not in the image.
/// let camera = Camera::perspective(Pose::level(dvec3(0.0, 0.0, 1.5), 0.0), 90f64.to_radians(), 200, 100);
/// let (pixel, depth) = camera.project(dvec3(1.0, 2.0, 1.5)).unwrap();
/// assert!((pixel.x - 150.0).abs() < 1e-9 && (pixel.y - 50.0).abs() < 1e-9 && (depth - 2.0).abs() < 1e-9);
/// assert_eq!(camera.project(dvec3(1.0, -2.0, 1.5)), None);
/// // A ray through the pixel leads back to the point.
/// let back = camera.pose.location + depth * camera.direction(pixel.x, pixel.y);
/// assert!(back.abs_diff_eq(dvec3(1.0, 2.0, 1.5), 1e-9));
/// ```
pub struct Camera {
    /// The place and rotation of the camera.
    pub pose: Pose,
    /// The mapping from directions to pixels.
    pub projection: Projection,
    /// Image width in pixels, at least 1.
    pub width: u32,
    /// Image height in pixels, at least 1.
    pub height: u32,
}

impl Camera {
    /// Makes a pinhole camera of `width` × `height` pixels with the horizontal angle of view `fov_rad`.
    ///
    /// # Panics
    /// If a size is 0 or the angle is not between 0 and π.
    pub fn perspective(pose: Pose, fov_rad: f64, width: u32, height: u32) -> Self {
        assert!(width > 0 && height > 0, "an image needs pixels");
        assert!(fov_rad > 0.0 && fov_rad < PI, "an angle of view of {fov_rad} rad");
        Self { pose, projection: Projection::Perspective { fov_rad }, width, height }
    }

    /// Makes a panorama of `width` × `width / 2` pixels.
    ///
    /// # Panics
    /// If `width` is odd or 0.
    pub fn equirectangular(pose: Pose, width: u32) -> Self {
        assert!(width >= 2 && width.is_multiple_of(2), "a panorama is twice as wide as high: {width} wide");
        Self { pose, projection: Projection::Equirectangular, width, height: width / 2 }
    }

    /// Precomputes the ray directions of the camera. Call it once per image.
    pub fn rays(&self) -> Rays {
        let w = f64::from(self.width);
        let h = f64::from(self.height);
        match self.projection {
            Projection::Perspective { .. } | Projection::Pinhole { .. } => {
                let f = self.focal_px();
                let c = self.center_px();
                let right = self.pose.right();
                let down = -self.pose.up();
                let forward = self.pose.forward();

                Rays::Perspective {
                    x_step: right / f.x,
                    y_step: down / f.y,
                    origin: forward - right * (c.x / f.x) - down * (c.y / f.y),
                }
            }
            Projection::Equirectangular => {
                // Longitude grows to the right, azimuth to the left.
                let azimuth = self.pose.azimuth_rad();
                let columns = (0..self.width)
                    .map(|u| {
                        let (sin, cos) = libm::sincos(azimuth - ((f64::from(u) + 0.5) / w - 0.5) * 2.0 * PI);
                        dvec2(cos, sin)
                    })
                    .collect();

                let rows = (0..self.height)
                    .map(|v| {
                        let (sin, cos) = libm::sincos((0.5 - (f64::from(v) + 0.5) / h) * PI);
                        dvec2(cos, sin)
                    })
                    .collect();

                Rays::Equirectangular { columns, rows }
            }
        }
    }

    /// Returns the world direction through the point (x, y) of the image. The direction of a pinhole has the
    /// component 1 along the optical axis, so its multiple by a z-depth ends at the surface. The direction of
    /// a panorama is a unit vector.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        match self.projection {
            Projection::Perspective { .. } | Projection::Pinhole { .. } => {
                let f = self.focal_px();
                let c = self.center_px();
                let a = (x - c.x) / f.x;
                let b = (y - c.y) / f.y;
                self.pose.right() * a - self.pose.up() * b + self.pose.forward()
            }
            Projection::Equirectangular => {
                let azimuth = self.pose.azimuth_rad() - (x / f64::from(self.width) - 0.5) * 2.0 * PI;
                let latitude = (0.5 - y / f64::from(self.height)) * PI;
                let (sin_a, cos_a) = libm::sincos(azimuth);
                let (sin_l, cos_l) = libm::sincos(latitude);
                dvec3(cos_l * cos_a, cos_l * sin_a, sin_l)
            }
        }
    }

    /// Projects `point` (world) to the image. Returns its pixel coordinates and its depth in metres: z along
    /// the optical axis for a pinhole, the distance for a panorama. Returns `None` if the point is behind a
    /// pinhole camera or in the centre of the camera.
    pub fn project(&self, point: DVec3) -> Option<(DVec2, f64)> {
        let w = f64::from(self.width);
        let h = f64::from(self.height);
        let d = point - self.pose.location;
        match self.projection {
            Projection::Perspective { .. } | Projection::Pinhole { .. } => {
                let v: DVec3 = self.pose.opencv_from_world() * d;
                let f = self.focal_px();
                let c = self.center_px();
                (v.z > 0.0).then(|| (dvec2(c.x + f.x * v.x / v.z, c.y + f.y * v.y / v.z), v.z))
            }
            Projection::Equirectangular => {
                let distance = d.length();
                let turn = (self.pose.azimuth_rad() - libm::atan2(d.y, d.x)) / (2.0 * PI) + 0.5;
                let latitude = libm::asin((d.z / distance).clamp(-1.0, 1.0));
                (distance > 0.0)
                    .then(|| (dvec2(turn.rem_euclid(1.0) * w, (0.5 - latitude / PI) * h), distance))
            }
        }
    }

    /// Returns the rotation from the world to the axes in which normal images of this camera are written
    /// (`s3d_io::formats`, "What is written"). The channels R G B are right, down and towards the camera for
    /// a pinhole, and X, −Z, Y of the world for a panorama.
    pub fn normal_image_from_world(&self) -> DMat3 {
        self.normal_axes_from_world(NormalAxes::Paper)
    }

    /// Returns the same as [`Camera::normal_image_from_world`], for a choice of axes.
    pub fn normal_axes_from_world(&self, axes: NormalAxes) -> DMat3 {
        match self.projection {
            Projection::Perspective { .. } | Projection::Pinhole { .. } => {
                let forward = self.pose.forward();
                let third = if axes == NormalAxes::OpenCv { forward } else { -forward };
                DMat3::from_cols(self.pose.right(), -self.pose.up(), third).transpose()
            }
            Projection::Equirectangular => DMat3::from_cols(DVec3::X, -DVec3::Z, DVec3::Y).transpose(),
        }
    }
}

/// The ray directions of a camera, by pixel. [`Camera::rays`] makes them.
#[derive(Clone, Debug)]
pub enum Rays {
    /// The direction is origin + x_step·(i + ½) + y_step·(j + ½). Its component along the optical axis is
    /// 1.
    Perspective {
        /// The step from a pixel to the next on the right.
        x_step: DVec3,
        /// The step from a pixel to the next below.
        y_step: DVec3,
        /// The direction through the top left corner of the image.
        origin: DVec3,
    },
    /// The direction is (cos lat · column, sin lat), a unit vector.
    Equirectangular {
        /// Cosine and sine of the azimuth of each column.
        columns: Vec<DVec2>,
        /// Cosine and sine of the latitude of each row.
        rows: Vec<DVec2>,
    },
}

impl Rays {
    /// Returns the direction through the centre of pixel (i, j), with the length of [`Camera::direction`].
    ///
    /// # Panics
    /// In a panorama, if the pixel is outside the image.
    #[inline]
    pub fn at(&self, i: u32, j: u32) -> DVec3 {
        match self {
            Rays::Perspective { x_step, y_step, origin } => {
                *origin + *x_step * (f64::from(i) + 0.5) + *y_step * (f64::from(j) + 0.5)
            }
            Rays::Equirectangular { columns, rows } => {
                let c = columns[i as usize];
                let r = rows[j as usize];
                dvec3(r.x * c.x, r.x * c.y, r.y)
            }
        }
    }
}

#[cfg(feature = "serde")]
mod as_data {
    use super::{CameraError, Pose, Projection};

    /// A camera before it is checked.
    #[derive(serde::Deserialize)]
    pub(super) struct Camera {
        pose: Pose,
        projection: Projection,
        width: u32,
        height: u32,
    }

    impl TryFrom<Camera> for super::Camera {
        type Error = CameraError;

        fn try_from(Camera { pose, projection, width, height }: Camera) -> Result<Self, CameraError> {
            Self { pose, projection, width, height }.checked()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use proptest::prelude::*;

    fn pose() -> Pose {
        Pose::from_scanner(dvec3(1.0, 2.0, 1.5), DQuat::from_rotation_z(0.8)).turned(0.4, -0.3)
    }

    proptest! {
        #[test]
        fn pixels_come_back(i in 0u32..64, j in 0u32..32, t in 0.1..50.0f64, pano in any::<bool>()) {
            let c = if pano {
                Camera::equirectangular(pose(), 64)
            } else {
                Camera::perspective(pose(), 1.2, 64, 32)
            };
            let d = c.rays().at(i, j);
            prop_assert!(d.abs_diff_eq(c.direction(f64::from(i) + 0.5, f64::from(j) + 0.5), 1e-12));
            let (px, depth) = c.project(c.pose.location + d * t).unwrap();
            prop_assert!(px.abs_diff_eq(dvec2(f64::from(i) + 0.5, f64::from(j) + 0.5), 1e-6), "{px}");
            prop_assert!((depth - t).abs() < 1e-9 * t);
        }
    }

    #[test]
    fn perspective_directions_have_unit_depth() {
        let c = Camera::perspective(pose(), 1.0, 1080, 1080);
        for (x, y) in [(0.5, 0.5), (540.0, 540.0), (1079.5, 3.5)] {
            assert!((c.direction(x, y).dot(c.pose.forward()) - 1.0).abs() < 1e-12);
        }
        assert_eq!(c.k_matrix()[0][2], 540.0);
        assert!(c.project(c.pose.location - c.pose.forward()).is_none());
    }

    #[test]
    fn panorama_looks_forward_in_the_middle_and_right_to_the_right() {
        let p = Pose::level(DVec3::ZERO, 0.3);
        let c = Camera::equirectangular(p.turned(0.0, 0.4), 4096);
        assert!(c.direction(2048.0, 1024.0).abs_diff_eq(p.forward(), 1e-12));
        assert!(c.direction(3072.0, 1024.0).abs_diff_eq(p.right(), 1e-12));
        assert!(c.direction(100.0, 0.0).abs_diff_eq(DVec3::Z, 1e-12));
    }

    #[test]
    fn a_wall_that_faces_the_camera_is_written_128_128_255() {
        let p = Pose::level(DVec3::ZERO, 0.3);
        let n = Camera::perspective(p, 1.0, 8, 8).normal_image_from_world() * -p.forward();
        assert!(n.abs_diff_eq(DVec3::Z, 1e-12));
        let panorama = Camera::equirectangular(p, 8);
        let floor = panorama.normal_image_from_world() * DVec3::Z;
        assert!(floor.abs_diff_eq(-DVec3::Y, 1e-12));
        let n = Camera::perspective(p, 1.0, 8, 8).normal_axes_from_world(NormalAxes::OpenCv);
        assert!(
            (n * -p.forward()).abs_diff_eq(-DVec3::Z, 1e-12) && (n * p.right()).abs_diff_eq(DVec3::X, 1e-12)
        );
        assert!((n.determinant() - 1.0).abs() < 1e-12, "right-handed");
        assert_eq!(panorama.normal_axes_from_world(NormalAxes::OpenCv), panorama.normal_image_from_world());
    }

    /// A genuine pose of the published data set (Area 3): K, the original rotation and the final rotation
    /// agree with the rest.
    #[test]
    fn a_genuine_pose_is_reproduced() {
        let original = dvec3(1.57489812374115, 0.0024619516916573048, 0.7112205624580383);
        let last = dvec3(1.2404561042785645, -0.002153967274352908, -2.3568427562713623);
        let between = dvec3(-0.2545155882835388, -0.21941225230693817, -3.0398263931274414);
        let location = dvec3(21.554668, -2.93087, 1.374648);
        let from = Pose { location, world_from_camera: crate::rotation_from_euler(original) };
        let genuine = Pose { location, world_from_camera: crate::rotation_from_euler(last) };
        let (yaw, pitch) = from.yaw_pitch_to(&genuine);
        let view = from.turned(yaw, pitch);
        assert!(crate::euler_from_rotation(view.world_from_camera).abs_diff_eq(last, 1e-6));
        let turn = view.world_from_camera * from.world_from_camera.transpose();
        assert!(crate::euler_from_rotation(turn).abs_diff_eq(between, 1e-6));

        let rt = view.rt_matrix();
        let expected = [
            [-0.7075634002685547, -0.7066466212272644, 0.0021539656445384026, 13.17724323272705],
            [-0.2306535392999649, 0.22806943953037262, -0.9459298253059387, 6.940423011779785],
            [0.6679468750953674, -0.6698021292686462, -0.3243641257286072, -15.914589881896973],
        ];
        for (row, genuine) in rt.iter().zip(expected) {
            for (a, b) in row.iter().zip(genuine) {
                assert!((a - b).abs() < 2e-6, "{a} {b}");
            }
        }

        let camera = Camera::perspective(view, 1.1030245194845198, 1080, 1080);
        assert!((camera.focal_px() - 877.7806396484375).abs().max_element() < 3e-5);
    }
}
