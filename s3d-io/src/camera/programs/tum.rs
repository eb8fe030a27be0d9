//! Trajectories in the form of TUM's RGB-D benchmark: `timestamp tx ty tz qx qy qz qw` a line. Source: its
//! page "File Formats".
//!
//! A pose is camera → world in OpenCV's axes (x right, y down, z forward).

use crate::camera::located::{pose_from_opencv, rotation};
use crate::camera::posed::PosedCamera;
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use s3d_geom::glam::{DMat3, DVec3};
use std::path::Path;

/// Reads a trajectory from its bytes. A camera's name is its time, as it is written.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Vec<PosedCamera>> {
    const FORM: &str =
        "a line of a trajectory is timestamp tx ty tz qx qy qz qw; a table of cameras has commas";
    let mut cameras = Vec::new();
    for (line, text) in (1u64..).zip(bytes.split(|&b| b == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }

        let fault = |message: String| Error::line(path, line, message);
        let form = || fault(format!("{}: {FORM}", quote(text)));
        let words: Vec<&str> = std::str::from_utf8(text)
            .map_err(|_| form())?
            .split_ascii_whitespace()
            .collect();
        let [name, numbers @ ..] = words.as_slice() else { return Err(form()) };

        let numbers: Option<Vec<f64>> = numbers.iter().map(|word| word.parse().ok()).collect();
        let is_time = name.parse::<f64>().is_ok_and(f64::is_finite);
        let Some(&[x, y, z, qx, qy, qz, qw]) = numbers.as_deref().filter(|_| is_time) else {
            return Err(form());
        };

        if ![x, y, z, qx, qy, qz, qw].iter().all(|v| v.is_finite()) {
            return Err(fault("a number of the pose is not finite".into()));
        }

        let turn = DMat3::from_quat(rotation([qx, qy, qz, qw]).map_err(fault)?);
        let pose = pose_from_opencv(DVec3::new(x, y, z), turn.x_axis, turn.y_axis, turn.z_axis);
        let name = (*name).to_owned();
        cameras.push(PosedCamera { line, ..PosedCamera::new(name, pose) });
    }
    Ok(cameras)
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::Pose;
    use s3d_geom::glam::{DQuat, dvec3};

    #[test]
    fn a_trajectory_is_read() {
        // In the benchmark's form. Both cameras look along +Y: the first level, the second with its right
        // side down.
        let text = "# ground truth trajectory\n# timestamp tx ty tz qx qy qz qw\n\
                    1305031098.6659 1.3563 0.6305 1.6380 -0.70710678 0 0 0.70710678\n\n\
                    1305031098.6758 0 0 0 -0.5 0.5 0.5 0.5\r\n";
        let cameras = read(Path::new("groundtruth.txt"), text.as_bytes()).unwrap();
        let names: Vec<&str> = cameras.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["1305031098.6659", "1305031098.6758"]);
        assert_eq!((cameras[0].line, cameras[0].pose.location), (3, dvec3(1.3563, 0.6305, 1.638)));
        let level = Pose::level(cameras[0].pose.location, 0.0);
        assert!(
            cameras[0]
                .pose
                .world_from_camera
                .abs_diff_eq(level.world_from_camera, 1e-7)
        );
        assert!(cameras[1].pose.forward().abs_diff_eq(DVec3::Y, 1e-12), "{}", cameras[1].pose.forward());
        assert!(cameras[1].pose.right().abs_diff_eq(-DVec3::Z, 1e-12), "{}", cameras[1].pose.right());
    }

    #[test]
    fn poses_come_back() {
        let pose = Pose::from_scanner(dvec3(1.0, -2.0, 1.5), DQuat::from_rotation_z(0.4)).turned(0.3, -0.5);
        let q = DQuat::from_mat3(&pose.opencv_from_world().transpose());
        let text = format!("0.5 1 -2 1.5 {} {} {} {}", q.x, q.y, q.z, q.w);
        let read = read(Path::new("t"), text.as_bytes()).unwrap();
        assert!(
            read[0]
                .pose
                .world_from_camera
                .abs_diff_eq(pose.world_from_camera, 1e-12)
        );
    }

    #[test]
    fn faults_have_their_line() {
        for (line, words) in [
            ("1 0 0 0 0 0 1", "line 2: `1 0 0 0 0 0 1`: a line of a trajectory is"),
            ("1 0 0 0 0 0 0 1 9", "line 2: `1 0 0 0 0 0 0 1 9`"),
            ("1 0 0 x 0 0 0 1", "a line of a trajectory"),
            ("one 0 0 0 0 0 0 1", "a line of a trajectory"),
            ("1 0 0 inf 0 0 0 1", "line 2: a number of the pose"),
            ("1 0 0 0 0 0 0 0", "line 2: the quaternion [0.0, 0.0, 0.0, 0.0] (x y z w) has the length 0.000"),
        ] {
            let e = read(Path::new("t"), format!("1 0 0 0 0 0 0 1\n{line}\n").as_bytes()).unwrap_err();
            assert!(e.to_string().contains(words), "{e}");
        }
    }
}
