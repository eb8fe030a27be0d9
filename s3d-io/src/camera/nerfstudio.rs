//! The pictures of a `transforms.json`, as nerfstudio, Polycam, Record3D and instant-ngp write it. Source:
//! nerfstudio's documentation, "Data conventions".
//!
//! A frame's `transform_matrix` is camera → world, 4 × 4, in OpenGL's axes: x right, y up, z backwards.

use crate::camera::located::LocatedPicture;
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use s3d_geom::Pose;
use s3d_geom::glam::{DMat3, DMat4, DVec4};
use serde::Deserialize;
use std::path::Path;

/// How far the axes of a camera may be from perpendicular and equally long: files hold seven decimals or so.
const MOST_SKEW: f64 = 1e-3;

#[derive(Deserialize)]
struct Document {
    frames: Vec<FrameEntry>,
}

#[derive(Deserialize)]
struct FrameEntry {
    file_path: String,
    transform_matrix: Vec<Vec<f64>>,
}

/// Reads a `transforms.json`.
pub(crate) fn read(path: &Path) -> Result<Vec<LocatedPicture>> {
    let Document { frames } = read_json(path)?;
    let mut pictures = Vec::with_capacity(frames.len());
    for (i, frame) in frames.into_iter().enumerate() {
        let pose = pose(&frame.transform_matrix).map_err(|message| {
            Error::format(path, format!("frames[{i}], {:?}: transform_matrix {message}", frame.file_path))
        })?;
        pictures.push(LocatedPicture { name: frame.file_path, pose, line: 0 });
    }
    Ok(pictures)
}

fn pose(rows: &[Vec<f64>]) -> std::result::Result<Pose, String> {
    let full = rows.iter().map(|row| <[f64; 4]>::try_from(row.as_slice()).ok()).collect::<Option<Vec<_>>>();
    let (Some([x, y, z]) | Some([x, y, z, _])) = full.as_deref() else {
        return Err("is no matrix of 4 × 4 or 3 × 4 numbers".into());
    };
    if !rows.iter().flatten().all(|v| v.is_finite()) {
        return Err("holds a number that is not finite".into());
    }
    let columns = DMat4::from_cols_array_2d(&[*x, *y, *z, [0.0, 0.0, 0.0, 1.0]]).transpose();
    let [x, y, z, location] =
        [columns.x_axis, columns.y_axis, columns.z_axis, columns.w_axis].map(DVec4::truncate);
    // A world in other units has axes of another length.
    let length = x.length();
    let skew =
        [y.length() - length, z.length() - length, x.dot(y) / length, y.dot(z) / length, z.dot(x) / length];
    let is_straight = length > 0.0 && skew.iter().all(|s| s.abs() <= MOST_SKEW * length);
    if !is_straight || x.cross(y).dot(z) <= 0.0 {
        return Err("is no rotation with a translation".into());
    }
    // Perpendicular to the last digit, keeping the viewing direction.
    let back = z.normalize();
    let right = (x - back * x.dot(back)).normalize();
    Ok(Pose { location, world_from_camera: DMat3::from_cols(right, back.cross(right), back) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{DQuat, DVec3};

    fn rows(pose: &Pose) -> String {
        let m = pose.world_from_camera;
        let row = |i: usize| {
            format!("[{:.7}, {:.7}, {:.7}, {:.7}]", m.x_axis[i], m.y_axis[i], m.z_axis[i], pose.location[i])
        };
        format!("[{}, {}, {}, [0, 0, 0, 1]]", row(0), row(1), row(2))
    }

    fn read_text(text: &str) -> Result<Vec<LocatedPicture>> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("transforms.json");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    fn document(matrix: &str) -> String {
        format!(
            r#"{{"fl_x": 500, "camera_model": "OPENCV", "frames": [{{"file_path": "images/a.png", "transform_matrix": {matrix}}}]}}"#
        )
    }

    #[test]
    fn poses_come_back() {
        let pose =
            Pose::from_scanner(DVec3::new(1.0, -2.0, 1.5), DQuat::from_rotation_z(0.4)).turned(0.3, -0.5);
        let read = read_text(&document(&rows(&pose))).unwrap();
        assert_eq!((read.len(), read[0].name.as_str()), (1, "images/a.png"));
        assert!(read[0].pose.location.abs_diff_eq(pose.location, 1e-7));
        assert!(read[0].pose.world_from_camera.abs_diff_eq(pose.world_from_camera, 1e-6));
        let m = read[0].pose.world_from_camera;
        assert!((m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-12));
    }

    #[test]
    fn what_is_no_pose_is_refused() {
        for (matrix, words) in [
            ("[[1,0,0,0],[0,1,0,0]]", "is no matrix"),
            ("[[1,0,0],[0,1,0],[0,0,1]]", "is no matrix"),
            ("[[1,0,0,1e999],[0,1,0,0],[0,0,1,0]]", "line 1"),
            ("[[1,0,0,0],[0,1,0,0],[0,0,-1,0]]", "is no rotation"),
            ("[[1,0.1,0,0],[0,1,0,0],[0,0,1,0]]", "is no rotation"),
            ("[[0,0,0,0],[0,0,0,0],[0,0,0,0]]", "is no rotation"),
        ] {
            let message = read_text(&document(matrix)).err().unwrap().to_string();
            assert!(message.contains(words), "{matrix}: {message}");
        }
        assert!(read_text("{}").err().unwrap().to_string().contains("missing field `frames`"));
    }
}
