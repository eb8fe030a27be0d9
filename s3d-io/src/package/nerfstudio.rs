//! Writes `transforms.json`, from which nerfstudio and other successors of instant-ngp read cameras.
//!
//! Its cameras have the axes of OpenGL, Blender and our poses: x right, y up, looking along −z. Distances
//! are metres, and the world is Z-up. The transform that was applied to the world is the identity.

use crate::dataset::pose::PoseFile;
use crate::error::Result;
use crate::fs::json::write_json;
use s3d_geom::{Camera, Pose};
use serde::Serialize;
use std::path::Path;

/// The kind of camera, which all images of a file share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NerfstudioCamera {
    /// A pinhole camera. Each image has its own focal length.
    Perspective,
    /// A panorama.
    Equirectangular,
}

/// An image of `transforms.json`. The fields are named as in the file. The lengths of the camera are pixels,
/// and the centre of the first pixel is at (½, ½).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NerfstudioFrame {
    /// The image, relative to the folder of the file.
    pub file_path: String,
    /// Its depth, a 16-bit PNG file. nerfstudio's option `depth-unit-scale-factor` converts the numbers to
    /// metres. They are depths along the optical axis, and in panoramas distances.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_file_path: Option<String>,
    /// Its mask, an 8-bit gray PNG file: 0 for pixels to ignore. Either all images of a file have a mask, or
    /// none has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask_path: Option<String>,
    /// The focal length along x; for a panorama its height.
    pub fl_x: f64,
    /// The focal length along y; for a panorama its height.
    pub fl_y: f64,
    /// The principal point along x.
    pub cx: f64,
    /// The principal point along y.
    pub cy: f64,
    /// The width of the image.
    pub w: u32,
    /// The height of the image.
    pub h: u32,
    /// Camera → world, 4 × 4.
    pub transform_matrix: [[f64; 4]; 4],
}

impl NerfstudioFrame {
    /// Makes an image of a camera.
    pub fn new(file_path: String, camera: &Camera) -> Self {
        let w = camera.width;
        let h = camera.height;
        if camera.is_panorama() {
            return Self::panorama(file_path, &camera.pose, (w, h));
        }
        let [[fl_x, _, cx], [_, fl_y, cy], _] = camera.k_matrix();
        let transform_matrix = matrix(&camera.pose);
        Self { file_path, depth_file_path: None, mask_path: None, fl_x, fl_y, cx, cy, w, h, transform_matrix }
    }

    /// Makes an image of a view, from its pose file.
    pub fn perspective(file_path: String, pose: &PoseFile, (w, h): (u32, u32)) -> Self {
        let [[fl_x, _, cx], [_, fl_y, cy], _] = pose.camera_k_matrix;
        let transform_matrix = matrix(&pose.pose());
        Self { file_path, depth_file_path: None, mask_path: None, fl_x, fl_y, cx, cy, w, h, transform_matrix }
    }

    /// Makes an image of a panorama, from its pose file. Panoramas of the data set are level even if the
    /// scanner is tilted, so only the heading of the pose counts.
    ///
    /// # Panics
    /// If the image is not twice as wide as high.
    pub fn equirectangular(file_path: String, pose: &PoseFile, (w, h): (u32, u32)) -> Self {
        assert!(h > 0 && w == 2 * h, "a panorama of {w} × {h}");
        Self::panorama(file_path, &pose.pose(), (w, h))
    }

    fn panorama(file_path: String, pose: &Pose, (w, h): (u32, u32)) -> Self {
        // A level pose with yaw 0 looks along +Y, which is 90° from +X.
        let yaw_rad = pose.azimuth_rad() - std::f64::consts::FRAC_PI_2;
        let level = Pose::level(pose.location, yaw_rad);
        Self {
            file_path,
            depth_file_path: None,
            mask_path: None,
            fl_x: f64::from(h),
            fl_y: f64::from(h),
            cx: 0.5 * f64::from(w),
            cy: 0.5 * f64::from(h),
            w,
            h,
            transform_matrix: matrix(&level),
        }
    }
}

fn matrix(pose: &Pose) -> [[f64; 4]; 4] {
    let m = pose.world_from_camera;
    // Adding 0 turns −0 into 0.
    let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], pose.location[i]].map(|v| v + 0.0);
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

/// Writes a `transforms.json` and returns its size in bytes. `ply_file_path` names a point cloud in world
/// coordinates, relative to the folder of the file, with which Gaussian splatting begins.
///
/// # Errors
/// [`crate::Error::Io`]; [`crate::Error::Format`] if a number is not finite.
pub fn write_nerfstudio(
    path: &Path,
    camera: NerfstudioCamera,
    ply_file_path: Option<&str>,
    frames: &[NerfstudioFrame],
) -> Result<u64> {
    #[derive(Serialize)]
    struct Transforms<'a> {
        camera_model: &'static str,
        applied_transform: [[f64; 4]; 3],
        #[serde(skip_serializing_if = "Option::is_none")]
        ply_file_path: Option<&'a str>,
        frames: &'a [NerfstudioFrame],
    }

    if let Some(f) = frames.iter().find(|f| !is_finite(f)) {
        return Err(crate::error::Error::format(
            path,
            format!("the camera of {} is not finite", f.file_path),
        ));
    }

    let camera_model = match camera {
        NerfstudioCamera::Perspective => "OPENCV",
        NerfstudioCamera::Equirectangular => "EQUIRECTANGULAR",
    };
    let applied_transform = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    write_json(path, &Transforms { camera_model, applied_transform, ply_file_path, frames })
}

fn is_finite(frame: &NerfstudioFrame) -> bool {
    let numbers = [frame.fl_x, frame.fl_y, frame.cx, frame.cy];
    numbers
        .iter()
        .chain(frame.transform_matrix.as_flattened())
        .all(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::layout::Frame;
    use crate::fs::json::read_json;
    use proptest::prelude::*;
    use s3d_geom::glam::{DMat4, DQuat, DVec3, dvec3};
    use std::f64::consts::PI;

    /// Returns the pose of a scanner that stands a little askew.
    fn original() -> Pose {
        Pose::from_scanner(dvec3(1.0, -2.0, 1.5), DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(0.05))
    }

    fn pose_file(camera: &Camera, frame: Frame) -> PoseFile {
        PoseFile::new(camera, &original(), "a1b2", "WC_1_4", frame)
    }

    /// Returns the ray of a pixel in the camera's axes, by nerfstudio's documentation.
    fn ray(frame: &NerfstudioFrame, panorama: bool, x: f64, y: f64) -> DVec3 {
        let a = (x - frame.cx) / frame.fl_x;
        let b = -(y - frame.cy) / frame.fl_y;
        let direction = if panorama {
            let theta = -PI * a;
            let phi = PI * (0.5 - b);
            dvec3(-theta.sin() * phi.sin(), phi.cos(), -theta.cos() * phi.sin())
        } else {
            dvec3(a, b, -1.0)
        };
        let rows = frame.transform_matrix;
        DMat4::from_cols_array_2d(&rows)
            .transpose()
            .transform_vector3(direction)
    }

    proptest! {
        #[test]
        fn rays_are_ours(x in 0.0..64.0f64, y in 0.0..32.0f64, yaw in -3.0..3.0f64, pitch in -0.7..0.7f64) {
            let camera = Camera::perspective(original().turned(yaw, pitch), 1.1, 64, 32);
            let frame =
                NerfstudioFrame::perspective("a".into(), &pose_file(&camera, Frame::View(0)), (64, 32));
            prop_assert!(ray(&frame, false, x, y).abs_diff_eq(camera.direction(x, y), 1e-9));

            let focal = glam::dvec2(40.0, 50.0 + y);
            let center = glam::dvec2(x, -3.0);
            let pinhole = Camera::pinhole(original().turned(yaw, pitch), focal, center, 64, 32).unwrap();
            let frame = NerfstudioFrame::new("a".into(), &pinhole);
            prop_assert!(ray(&frame, false, x, y).abs_diff_eq(pinhole.direction(x, y), 1e-9));

            let camera = Camera::equirectangular(original(), 64);
            let frame =
                NerfstudioFrame::equirectangular("a".into(), &pose_file(&camera, Frame::Panorama), (64, 32));
            prop_assert!(ray(&frame, true, x, y).abs_diff_eq(camera.direction(x, y), 1e-9));
            prop_assert_eq!(
                &NerfstudioFrame::new("a".into(), &camera).transform_matrix, &frame.transform_matrix
            );
            let up = frame.transform_matrix[2];
            prop_assert!(up[0].abs() < 1e-12 && (up[1] - 1.0).abs() < 1e-12 && up[2].abs() < 1e-12);
        }
    }

    #[test]
    fn the_file_has_the_keys_that_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("transforms.json");
        let camera = Camera::perspective(original(), 1.1, 64, 32);
        let mut frame = NerfstudioFrame::perspective(
            "images/a.png".into(),
            &pose_file(&camera, Frame::View(0)),
            (64, 32),
        );
        let write = |frames: &[NerfstudioFrame], ply| {
            write_nerfstudio(&path, NerfstudioCamera::Perspective, ply, frames).unwrap();
            read_json::<serde_json::Value>(&path).unwrap()
        };

        let json = write(std::slice::from_ref(&frame), None);
        assert!(json.get("ply_file_path").is_none() && json["frames"][0].get("depth_file_path").is_none());
        frame.depth_file_path = Some("depths/a.png".into());
        let json = write(std::slice::from_ref(&frame), Some("cloud.ply"));
        assert_eq!((&json["camera_model"], &json["ply_file_path"]), (&"OPENCV".into(), &"cloud.ply".into()));
        let f = &json["frames"][0];
        assert_eq!(
            (&f["file_path"], &f["depth_file_path"]),
            (&"images/a.png".into(), &"depths/a.png".into())
        );
        assert_eq!((f["w"].as_u64(), f["h"].as_u64(), f["cx"].as_f64()), (Some(64), Some(32), Some(32.0)));
        assert_eq!(f["fl_x"].as_f64(), Some(frame.fl_x));
        assert_eq!(f["transform_matrix"][0][3].as_f64(), Some(1.0));

        frame.transform_matrix[0][0] = f64::NAN;
        let e = write_nerfstudio(&path, NerfstudioCamera::Equirectangular, None, &[frame]).unwrap_err();
        assert!(e.to_string().contains("images/a.png is not finite"), "{e}");
    }
}
