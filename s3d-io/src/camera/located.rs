//! Pictures with poses, as reconstruction programs list them, and the scan locations that they give.

use crate::camera::posed::PosedCamera;
use crate::camera::table::{FARTHEST_M, ScanLocation};
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use s3d_geom::Pose;
use s3d_geom::glam::{DMat3, DQuat, DVec3, DVec4};
use std::collections::HashMap;
use std::path::Path;

/// The distance that two pictures of one location may have, because programs write few decimals.
const SAME_PLACE_M: f64 = 0.01;

/// Refuses a camera that is too far from the origin for a building.
pub(crate) fn check_place(path: &Path, camera: &PosedCamera) -> Result<()> {
    check_distance(path, camera.line, &camera.name, camera.pose.location)
}

/// Refuses a place, called `name`, that is too far from the origin for a building.
pub(crate) fn check_distance(path: &Path, line: u64, name: &str, at: DVec3) -> Result<()> {
    if at.is_finite() && at.abs().max_element() <= FARTHEST_M {
        return Ok(());
    }
    let name = quote(name.as_bytes());
    Err(fault(path, line, format!("{name}: {at} is more than {FARTHEST_M} m from the origin")))
}

/// Returns the uuid in a name, or the one that follows from it.
pub(crate) fn uuid_of(name: &str) -> String {
    uuid_in(name).unwrap_or_else(|| uuid_from_name(name))
}

/// Returns an error at a line, or about the whole file if `line` is 0.
pub(crate) fn fault(path: &Path, line: u64, message: String) -> Error {
    match line {
        0 => Error::format(path, message),
        _ => Error::line(path, line, message),
    }
}

/// Returns the scan locations of a list of pictures.
///
/// A location is where a picture was taken. Its camera is level and has the picture's heading, because views
/// are drawn around the horizon. Its uuid is the first run of 32 hexadecimal digits in the picture's name, or
/// follows from the name. Pictures of one uuid are one location, with the heading of the first.
pub(crate) fn locations_of(path: &Path, pictures: Vec<PosedCamera>) -> Result<Vec<ScanLocation>> {
    let mut locations: Vec<ScanLocation> = Vec::new();
    let mut index: HashMap<String, usize> = HashMap::new();
    for picture in pictures {
        check_place(path, &picture)?;
        let PosedCamera { name, pose, line, .. } = picture;
        let at = pose.location;
        let uuid = uuid_of(&name);

        match index.get(&uuid) {
            None => {
                index.insert(uuid.clone(), locations.len());
                locations.push(ScanLocation { uuid, pose: pose.leveled(), line });
            }
            Some(&first) => {
                let distance = locations
                    .get(first)
                    .map_or(0.0, |first| first.pose.location.distance(at));
                if distance > SAME_PLACE_M {
                    let message = format!(
                        "{}: another picture with the uuid {uuid} was taken {distance:.3} m away",
                        quote(name.as_bytes())
                    );
                    return Err(fault(path, line, message));
                }
            }
        }
    }

    if locations.is_empty() {
        return Err(Error::format(path, "lists no picture, so there is no scan location"));
    }
    Ok(locations)
}

/// Returns the first run of exactly 32 hexadecimal digits, in lower case. The hyphens of a uuid's usual form
/// do not count.
pub(crate) fn uuid_in(name: &str) -> Option<String> {
    name.split(|c: char| !c.is_ascii_hexdigit() && c != '-')
        .map(|run| run.replace('-', "").to_ascii_lowercase())
        .find(|run| run.len() == 32)
}

/// Returns a uuid of 32 hexadecimal digits that follows from a name alone (XXH3, 128 bits). It is the same on
/// every machine.
pub fn uuid_from_name(name: &str) -> String {
    format!("{:032x}", xxhash_rust::xxh3::xxh3_128(name.as_bytes()))
}

/// Returns the pose of a camera at `location`, from the world directions of OpenCV's axes (x right, y down, z
/// forward).
pub(crate) fn pose_from_opencv(location: DVec3, right: DVec3, down: DVec3, forward: DVec3) -> Pose {
    Pose { location, world_from_camera: DMat3::from_cols(right, -down, -forward) }
}

/// Returns the pose of a camera from the transform world → camera in OpenCV's axes.
pub(crate) fn pose_from_extrinsics(camera_from_world: DMat3, translation: DVec3) -> Pose {
    let world_from_camera = camera_from_world.transpose();
    let location = -(world_from_camera * translation);
    let [right, down, forward] =
        [world_from_camera.x_axis, world_from_camera.y_axis, world_from_camera.z_axis];
    pose_from_opencv(location, right, down, forward)
}

/// Returns the rotation around an axis by its length, radians.
pub(crate) fn rotation_of_axis_angle(axis: DVec3) -> DQuat {
    let angle_rad = axis.length();
    let (sin, cos) = libm::sincos(0.5 * angle_rad);
    let v = axis.try_normalize().unwrap_or(DVec3::ZERO) * sin;
    DQuat::from_xyzw(v.x, v.y, v.z, cos)
}

/// How far the length of a quaternion may be from 1. Two decimals are enough for that; angles, or columns in
/// another order, are farther off.
const LENGTH_SLACK: f64 = 0.05;

/// Returns the rotation of a quaternion x y z w. The error is a sentence: its length is not 1.
pub(crate) fn rotation(xyzw: [f64; 4]) -> std::result::Result<DQuat, String> {
    let q = DVec4::from_array(xyzw);
    let length = q.length();
    if length.is_nan() || (length - 1.0).abs() > LENGTH_SLACK {
        return Err(format!(
            "the quaternion {xyzw:?} (x y z w) has the length {length:.3} and not 1: are the columns in this \
             order, and no angles?"
        ));
    }
    Ok(DQuat::from_vec4(q / length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::dvec3;

    fn picture(name: &str, x: f64, pitch: f64) -> PosedCamera {
        let pose = Pose::from_scanner(dvec3(x, 0.0, 1.5), DQuat::from_rotation_z(0.3)).turned(0.0, pitch);
        PosedCamera::new(name, pose)
    }

    #[test]
    fn quaternions_have_a_length_of_one() {
        // Two decimals.
        let q = rotation([0.0, 0.0, 0.71, 0.71]).unwrap();
        assert!((q.length() - 1.0).abs() < 1e-12 && (q.z - q.w).abs() < 1e-12);
        for wrong in [[0.0; 4], [0.0, 0.0, 90.0, 0.5], [f64::NAN, 0.0, 0.0, 1.0], [1.0, 1.0, 0.0, 0.0]] {
            let e = rotation(wrong).unwrap_err();
            assert!(e.contains("not 1: are the columns"), "{e}");
        }
    }

    #[test]
    fn names_give_uuids() {
        let hex = "8eb9955b866b4b5f74abb1071416c628";
        assert_eq!(uuid_in(&format!("rgb/camera_{hex}_office_1_frame_3_domain_rgb.png")).unwrap(), hex);
        assert_eq!(
            uuid_in("508160BA-5d80-a2e3-6560-9578a09bab8b.jpg").unwrap(),
            "508160ba5d80a2e365609578a09bab8b"
        );
        assert_eq!(uuid_in(&format!("{hex}0.png")), None);
        assert_eq!(uuid_in("IMG_0001.jpg"), None);
        let made = uuid_from_name("IMG_0001.jpg");
        assert!(
            made.len() == 32 && made.bytes().all(|b| b.is_ascii_hexdigit()) && made != uuid_from_name("")
        );
        // Files of data sets are named by it, so it never changes.
        assert_eq!(uuid_from_name(""), "99aa06d3014798d86001c324468d497f");
    }

    #[test]
    fn pictures_of_one_location_are_joined_and_leveled() {
        let hex = "8eb9955b866b4b5f74abb1071416c628";
        let a =
            [picture("a.jpg", 0.0, 0.4), picture(hex, 2.0, 0.1), picture(&format!("{hex}_2"), 2.005, -0.7)];
        let locations = locations_of(Path::new("p"), a.into()).unwrap();
        assert_eq!(locations.len(), 2);
        assert_eq!(locations[1].uuid, hex);
        assert!(locations.iter().all(|l| l.pose.up().abs_diff_eq(DVec3::Z, 1e-12)));
        assert!(
            locations[0]
                .pose
                .forward()
                .abs_diff_eq(dvec3(-libm::sin(0.3), libm::cos(0.3), 0.0), 1e-12)
        );
    }

    fn refused(p: Vec<PosedCamera>) -> String {
        locations_of(Path::new("p"), p).unwrap_err().to_string()
    }

    #[test]
    fn places_that_cannot_be_are_refused() {
        let hex = "8eb9955b866b4b5f74abb1071416c628";
        assert!(refused(vec![picture(hex, 0.0, 0.0), picture(hex, 1.0, 0.0)]).contains("1.000 m away"));
        assert!(refused(vec![picture("a", f64::NAN, 0.0)]).contains("from the origin"));
        assert!(refused(vec![]).contains("no picture"));
    }
}
