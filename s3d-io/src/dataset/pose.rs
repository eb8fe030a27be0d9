//! Pose files: the cameras of images. Source: [`crate::formats`], "What is written".

use crate::dataset::layout::Frame;
use crate::error::Result;
use crate::fs::atomic::write_bytes;
use crate::fs::json::read_json;
use s3d_geom::glam::{DMat3, DVec3, dvec3};
use s3d_geom::{Camera, Pose, euler_from_rotation, rotation_from_euler};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The contents of a pose file. The fields have the names of the file's keys, and are written in this order.
///
/// Rotations are Blender's XYZ Euler angles in radians, E = Rz·Ry·Rx. Lengths are metres in the world's
/// frame (Z-up).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawPoseFile")]
pub struct PoseFile {
    /// Focal lengths and principal point in pixels, row by row.
    pub camera_k_matrix: [[f64; 3]; 3],
    /// The horizontal angle of view; π/2 for a panorama.
    pub field_of_view_rads: f64,
    /// The rotation of the scanner: camera (looking along −Z, +Y up) → world.
    pub camera_original_rotation: [f64; 3],
    /// The rotation from the original rotation to the final one, in the world: E(final) =
    /// E(this)·E(original).
    pub rotation_from_original_to_point: [f64; 3],
    /// The rotation of this image: camera (looking along −Z, +Y up) → world.
    pub final_camera_rotation: [f64; 3],
    /// The same rotation, under a misspelt key that a published loader reads.
    pub camera_rotation_final: [f64; 3],
    /// The camera's position.
    pub camera_location: [f64; 3],
    /// World → camera in OpenCV's axes (x right, y down, z forward), 3 × 4.
    pub camera_rt_matrix: [[f64; 4]; 3],
    /// The scan location.
    pub camera_uuid: String,
    /// The scan location again.
    pub point_uuid: String,
    /// The number of the view; the word "equirectangular" for a panorama. ([`crate::formats`] leaves the
    /// panorama open; the word is the one in the file's name.)
    pub frame_num: Frame,
    /// Type, number and area of the room: "office_5_3".
    pub room: String,
    /// The offset that was subtracted from the scan's coordinates to make world coordinates, metres. `None`,
    /// and no key in the file, if there was none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world_offset_m: Option<[f64; 3]>,
}

/// The keys that a file may hold. The published files have no `camera_rotation_final`, and a matrix may have
/// its fourth row.
#[derive(Deserialize)]
struct RawPoseFile {
    camera_k_matrix: [[f64; 3]; 3],
    field_of_view_rads: f64,
    camera_original_rotation: [f64; 3],
    rotation_from_original_to_point: [f64; 3],
    final_camera_rotation: Option<[f64; 3]>,
    camera_rotation_final: Option<[f64; 3]>,
    camera_location: [f64; 3],
    camera_rt_matrix: Vec<[f64; 4]>,
    camera_uuid: String,
    point_uuid: Option<String>,
    frame_num: Frame,
    room: String,
    world_offset_m: Option<[f64; 3]>,
}

impl TryFrom<RawPoseFile> for PoseFile {
    type Error = String;

    fn try_from(raw: RawPoseFile) -> std::result::Result<Self, String> {
        let Some(last) = raw.final_camera_rotation.or(raw.camera_rotation_final) else {
            return Err("missing field `final_camera_rotation`".into());
        };
        let camera_rt_matrix = match raw.camera_rt_matrix.as_slice() {
            &[a, b, c] | &[a, b, c, [0.0, 0.0, 0.0, 1.0]] => [a, b, c],
            rows => return Err(format!("camera_rt_matrix has {} rows, not 3", rows.len())),
        };

        Ok(Self {
            camera_k_matrix: raw.camera_k_matrix,
            field_of_view_rads: raw.field_of_view_rads,
            camera_original_rotation: raw.camera_original_rotation,
            rotation_from_original_to_point: raw.rotation_from_original_to_point,
            final_camera_rotation: last,
            camera_rotation_final: last,
            camera_location: raw.camera_location,
            camera_rt_matrix,
            point_uuid: raw.point_uuid.unwrap_or_else(|| raw.camera_uuid.clone()),
            camera_uuid: raw.camera_uuid,
            frame_num: raw.frame_num,
            room: raw.room,
            world_offset_m: raw.world_offset_m,
        })
    }
}

impl PoseFile {
    /// Returns the pose file of an image of `camera`. The scan location `uuid`, where the scanner stood as
    /// `original`, is in the room `room` (type, number and area: "office_5_3").
    pub fn new(camera: &Camera, original: &Pose, uuid: &str, room: &str, frame_num: Frame) -> Self {
        let last = camera.pose.world_from_camera;
        let between = last * original.world_from_camera.transpose();
        Self {
            camera_k_matrix: camera.k_matrix(),
            field_of_view_rads: camera.fov_rad(),
            camera_original_rotation: euler_angles(original.world_from_camera),
            rotation_from_original_to_point: euler_angles(between),
            final_camera_rotation: euler_angles(last),
            camera_rotation_final: euler_angles(last),
            camera_location: camera.pose.location.to_array(),
            camera_rt_matrix: camera.pose.rt_matrix().map(|row| row.map(|v| v + 0.0)),
            camera_uuid: uuid.to_owned(),
            point_uuid: uuid.to_owned(),
            frame_num,
            room: room.to_owned(),
            world_offset_m: None,
        }
    }

    /// Returns the pose of the image's camera.
    pub fn pose(&self) -> Pose {
        self.pose_of(self.final_camera_rotation)
    }

    /// Returns the pose of the image's camera by the rows of `camera_rt_matrix`, which our own files hold to
    /// the bit. Angles and matrix are not compared.
    pub fn exact_pose(&self) -> Pose {
        // The rows are right, down and forward.
        let [right, down, forward] = self.camera_rt_matrix.map(|[x, y, z, _]| dvec3(x, y, z));
        let location = DVec3::from_array(self.camera_location);
        Pose { location, world_from_camera: DMat3::from_cols(right, -down, -forward) }
    }

    /// Returns the pose of the scanner.
    pub fn original(&self) -> Pose {
        self.pose_of(self.camera_original_rotation)
    }

    fn pose_of(&self, [x, y, z]: [f64; 3]) -> Pose {
        let location = DVec3::from_array(self.camera_location);
        Pose { location, world_from_camera: rotation_from_euler(dvec3(x, y, z)) }
    }

    /// Returns the file's bytes: JSON on one line, keys in the order of the fields. The numbers can be read
    /// back exactly.
    #[expect(
        clippy::expect_used,
        reason = "only maps with other keys than strings, and own serializers, can fail"
    )]
    pub fn to_json(&self) -> Vec<u8> {
        let mut json = serde_json::to_vec(self).expect("numbers and strings can be written as JSON");
        json.push(b'\n');
        json
    }

    /// Writes the file, whole or not at all, and returns its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn write(&self, path: &Path) -> Result<u64> {
        write_bytes(path, &self.to_json())
    }
}

/// Returns Euler angles without −0: adding 0 turns it into 0.
fn euler_angles(rotation: DMat3) -> [f64; 3] {
    (euler_from_rotation(rotation) + DVec3::ZERO).to_array()
}

/// Reads a pose file of this crate or of the published data set.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io); [`Error::Format`](crate::Error::Format) if it is not JSON, or a key is
/// missing or holds something else.
pub fn read_pose(path: &Path) -> Result<PoseFile> {
    read_json(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::DQuat;

    /// A pose file of the published data set (Area 3). Only the order of its keys is changed.
    const GENUINE: &str = r#"{
        "camera_k_matrix":
            [[877.7806396484375, 0.0, 540.0], [0.0, 877.7806396484375, 540.0], [0.0, 0.0, 1.0]],
        "field_of_view_rads": 1.1030245194845198,
        "camera_rt_matrix": [
            [-0.7075634002685547, -0.7066466212272644, 0.0021539656445384026, 13.17724323272705],
            [-0.2306535392999649, 0.22806943953037262, -0.9459298253059387, 6.940423011779785],
            [0.6679468750953674, -0.6698021292686462, -0.3243641257286072, -15.914589881896973]],
        "rotation_from_original_to_point": [-0.2545155882835388, -0.21941225230693817, -3.0398263931274414],
        "point_uuid": "5c2959c3089c4ac5a7c5c913cc0df78d",
        "camera_original_rotation": [1.57489812374115, 0.0024619516916573048, 0.7112205624580383],
        "camera_location": [21.554668, -2.93087, 1.374648],
        "frame_num": 41,
        "final_camera_rotation": [1.2404561042785645, -0.002153967274352908, -2.3568427562713623],
        "camera_uuid": "5c2959c3089c4ac5a7c5c913cc0df78d",
        "room": "office_5_3"
    }"#;

    fn assert_close(a: &[f64], b: &[f64], tolerance: f64) {
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance), "{a:?}\n{b:?}");
    }

    /// Checks that location, original rotation, yaw, pitch and angle of view give everything else.
    fn assert_reproduced(genuine: &PoseFile) {
        let original = genuine.original();
        let (yaw, pitch) = original.yaw_pitch_to(&genuine.pose());
        let camera = Camera::perspective(original.turned(yaw, pitch), genuine.field_of_view_rads, 1080, 1080);
        let ours = PoseFile::new(&camera, &original, &genuine.camera_uuid, &genuine.room, genuine.frame_num);
        assert_close(ours.camera_k_matrix.as_flattened(), genuine.camera_k_matrix.as_flattened(), 3e-5);
        // The translation is a sum of products with single-precision rotations and 22 m.
        assert_close(ours.camera_rt_matrix.as_flattened(), genuine.camera_rt_matrix.as_flattened(), 2e-6);
        assert_close(&ours.final_camera_rotation, &genuine.final_camera_rotation, 1e-6);
        assert_close(&ours.camera_rotation_final, &genuine.final_camera_rotation, 1e-6);
        assert_close(&ours.camera_original_rotation, &genuine.camera_original_rotation, 1e-6);
        assert_close(&ours.rotation_from_original_to_point, &genuine.rotation_from_original_to_point, 1e-6);
        assert_close(&ours.camera_location, &genuine.camera_location, 1e-6);
        assert_eq!(ours.field_of_view_rads, genuine.field_of_view_rads);
        assert_eq!(
            (&ours.camera_uuid, &ours.point_uuid, &ours.room, ours.frame_num),
            (&genuine.camera_uuid, &genuine.point_uuid, &genuine.room, genuine.frame_num)
        );
    }

    #[test]
    fn a_genuine_pose_is_read_and_reproduced() {
        let genuine: PoseFile = serde_json::from_str(GENUINE).unwrap();
        assert_eq!(genuine.camera_rotation_final, genuine.final_camera_rotation);
        assert_reproduced(&genuine);
    }

    #[test]
    #[expect(clippy::print_stderr, reason = "a skipped test says so")]
    fn the_pose_beside_formats_md_is_reproduced() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/spec/pose-office_5.json");
        if !path.exists() {
            eprintln!("skipped: {} is not there", path.display());
            return;
        }
        #[derive(Deserialize)]
        struct Wrapper {
            pose: PoseFile,
        }
        let wrapper: Wrapper = read_json(&path).unwrap();
        assert_eq!(wrapper.pose, serde_json::from_str(GENUINE).unwrap());
        assert_reproduced(&wrapper.pose);
    }

    #[test]
    fn files_come_back_exactly_and_have_all_keys_in_order() {
        let dir = tempfile::tempdir().unwrap();
        let original = Pose::from_scanner(dvec3(1.0, -2.0, 1.5), DQuat::from_rotation_z(0.4));
        for (camera, frame) in [
            (Camera::perspective(original.turned(-2.0, 0.3), 1.1, 1080, 1080), Frame::View(3)),
            (Camera::equirectangular(original, 4096), Frame::Panorama),
        ] {
            let file = PoseFile::new(&camera, &original, "a1b2", "WC_1_4", frame);
            let path = dir.path().join("pose.json");
            let moved = PoseFile { world_offset_m: Some([5e5, -1.0, 0.5]), ..file.clone() };
            moved.write(&path).unwrap();
            assert_eq!(read_pose(&path).unwrap(), moved);
            file.write(&path).unwrap();
            assert_eq!(read_pose(&path).unwrap(), file);
            assert!(
                (file.pose().world_from_camera - camera.pose.world_from_camera)
                    .col(0)
                    .length()
                    < 1e-12
            );

            let text = std::fs::read_to_string(&path).unwrap();
            let places: Vec<_> = [
                "camera_k_matrix",
                "field_of_view_rads",
                "camera_original_rotation",
                "rotation_from_original_to_point",
                "final_camera_rotation",
                "camera_rotation_final",
                "camera_location",
                "camera_rt_matrix",
                "camera_uuid",
                "point_uuid",
                "frame_num",
                "room",
            ]
            .map(|key| text.find(&format!("\"{key}\":")).unwrap())
            .to_vec();
            assert!(places.is_sorted());
            let frame_num = if frame == Frame::Panorama {
                "\"equirectangular\""
            } else {
                "3"
            };
            assert!(text.contains(&format!("\"frame_num\":{frame_num},\"room\":\"WC_1_4\"")));
            assert!(!text.contains("-0.0,") && !text.contains("rgb"));
        }
    }

    #[test]
    fn other_forms_are_read_and_wrong_ones_refused() {
        let four_rows = GENUINE.replace("-15.914589881896973]]", "-15.914589881896973], [0, 0, 0, 1]]");
        assert_eq!(
            serde_json::from_str::<PoseFile>(&four_rows).unwrap(),
            serde_json::from_str::<PoseFile>(GENUINE).unwrap()
        );
        let misspelt = GENUINE.replace("final_camera_rotation", "camera_rotation_final");
        assert!(serde_json::from_str::<PoseFile>(&misspelt).is_ok());
        for (from, to, message) in [
            ("final_camera_rotation", "gone", "missing field `final_camera_rotation`"),
            ("\"room\"", "\"gone\"", "missing field `room`"),
            ("-15.914589881896973]]", "-15.914589881896973], [1, 0, 0, 1]]", "camera_rt_matrix has 4 rows"),
            ("41,", "-41,", "expected a frame number"),
        ] {
            let e = serde_json::from_str::<PoseFile>(&GENUINE.replace(from, to))
                .unwrap_err()
                .to_string();
            assert!(e.contains(message), "{e}");
        }
    }
}
