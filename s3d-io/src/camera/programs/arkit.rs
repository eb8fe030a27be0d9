//! The pictures of an ARKitScenes video: the trajectory `lowres_wide.traj`, pictures `VIDEO_TIME.png` and
//! intrinsics `VIDEO_TIME.pincam`. Source: apple/ARKitScenes, DATA.md and
//! threedod/benchmark_scripts/utils/tenFpsDataLoader.py.
//!
//! A line of the trajectory is `time rx ry rz tx ty tz`: world → camera in OpenCV's axes, the rotation as
//! an axis times its angle. Its ten poses a second belong to some of the pictures. The pose of a picture
//! between two of them lies between theirs.

use crate::camera::located::{pose_from_extrinsics, rotation_of_axis_angle};
use crate::camera::matterport::numbers;
use crate::camera::posed::{Distortion, Optics, PosedCamera};
use crate::error::{Error, Result};
use crate::fs::open::read_file;
use crate::fs::quote::quote;
use s3d_geom::Pose;
use s3d_geom::glam::{DMat3, DQuat, DVec3, DVec4, dvec2};
use std::path::{Path, PathBuf};

/// The names of a trajectory in the folder of a video.
const TRAJECTORIES: [&str; 2] = ["lowres_wide.traj", "color.traj"];

/// The folders of pictures beside a trajectory, the first that is there counts. The ultrawide camera is
/// another one.
const PICTURES: [&str; 3] = ["lowres_wide", "vga_wide", "wide"];

/// A picture this near to a pose has this pose, seconds. Names have milliseconds.
const SAME_S: f64 = 0.005;

/// A pose follows from the poses before and after it if these are at most so far from each other, seconds.
const GAP_S: f64 = 0.25;

/// Intrinsics of a picture were taken this near to it, seconds. They change slowly.
const INTRINSICS_S: f64 = 0.1;

/// A pose of a trajectory.
struct TimedPose {
    time_s: f64,
    name: String,
    pose: Pose,
    line: u64,
}

/// Files that are named by their times in seconds.
type TimedFiles = Vec<(f64, PathBuf)>;

/// Returns the trajectory of the video in `dir`, if there is one.
pub(crate) fn find(dir: &Path) -> Option<PathBuf> {
    TRAJECTORIES
        .iter()
        .map(|name| dir.join(name))
        .find(|path| path.is_file())
}

/// Returns whether a line has the seven numbers of a trajectory.
pub(crate) fn is_trajectory(line: &[u8]) -> bool {
    let words: Vec<&[u8]> = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).collect();
    let is_number = |word: &[u8]| std::str::from_utf8(word).is_ok_and(|word| word.parse::<f64>().is_ok());
    words.len() == 7 && words.into_iter().all(is_number)
}

/// Reads the cameras of the pictures in `images`, or in the folder beside the trajectory, by time. Without
/// pictures, each pose is a camera. Also returns the number of pictures without a pose, and the files that
/// were read.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    images: Option<&Path>,
) -> Result<(Vec<PosedCamera>, usize, Vec<PathBuf>)> {
    let folder = match images {
        Some(folder) => Some(folder.to_owned()),
        None => PICTURES
            .iter()
            .map(|name| path.with_file_name(name))
            .find(|folder| folder.is_dir()),
    };
    match folder {
        Some(folder) => read_pictures(path, bytes, &folder, &intrinsics_of(&folder)),
        None => Ok((unpictured(read_poses(path, bytes)?), 0, vec![path.to_owned()])),
    }
}

/// Reads the cameras of the pictures in a folder like [`read`], with the intrinsics in another folder.
pub(crate) fn read_pictures(
    path: &Path,
    bytes: &[u8],
    folder: &Path,
    intrinsics: &Path,
) -> Result<(Vec<PosedCamera>, usize, Vec<PathBuf>)> {
    let poses = read_poses(path, bytes)?;
    let mut read = vec![path.to_owned()];
    let pictures = timed_files(folder, &["png", "jpg"])?;
    if pictures.is_empty() {
        let message = "holds no picture that is named by its time, as VIDEO_6845.806.png is";
        return Err(Error::unsupported(folder, message));
    }
    let intrinsics = timed_files(intrinsics, &["pincam"])?;
    let mut cameras = Vec::with_capacity(pictures.len());
    let mut untracked = 0;

    for (time_s, picture) in pictures {
        let Some((pose, line)) = pose_at(&poses, time_s) else {
            untracked += 1;
            continue;
        };
        let mut size = None;
        let mut optics = None;
        if let Some((_, file)) = nearest(&intrinsics, time_s, |(time_s, _)| *time_s, INTRINSICS_S) {
            let (of_file, optics_of_file) = pincam(file)?;
            size = Some(of_file);
            optics = Some(optics_of_file);
            read.push(file.clone());
        }
        let name = picture.file_name().unwrap_or_default().to_string_lossy().into_owned();
        cameras.push(PosedCamera {
            name,
            pose,
            size,
            optics,
            picture: Some(picture.into()),
            mask: None,
            line,
        });
    }

    // Two pictures may share their intrinsics.
    read.dedup();
    Ok((cameras, untracked, read))
}

/// Returns a camera at each pose.
fn unpictured(poses: Vec<TimedPose>) -> Vec<PosedCamera> {
    let camera = |TimedPose { name, pose, line, .. }| PosedCamera { line, ..PosedCamera::new(name, pose) };
    poses.into_iter().map(camera).collect()
}

/// Reads the poses of a trajectory, sorted by time.
fn read_poses(path: &Path, bytes: &[u8]) -> Result<Vec<TimedPose>> {
    const FORM: &str = "a line of a trajectory is time rx ry rz tx ty tz";
    let mut poses = Vec::new();
    // Lines of places and quaternions have seven numbers too.
    let mut are_quaternions = true;
    for (line, text) in (1u64..).zip(bytes.split(|&b| b == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }

        let fault = || Error::line(path, line, format!("{}: {FORM}", quote(text)));
        let words = std::str::from_utf8(text).map_err(|_| fault())?;
        let numbers: Option<Vec<f64>> = words
            .split_ascii_whitespace()
            .map(|word| word.parse().ok().filter(|v: &f64| v.is_finite()))
            .collect();
        let Some(&[time_s, rx, ry, rz, tx, ty, tz]) = numbers.as_deref() else { return Err(fault()) };

        are_quaternions &= (DVec4::new(rz, tx, ty, tz).length() - 1.0).abs() < 1e-3;
        let turn = rotation_of_axis_angle(DVec3::new(rx, ry, rz));
        let pose = pose_from_extrinsics(DMat3::from_quat(turn), DVec3::new(tx, ty, tz));
        let name = words.split_ascii_whitespace().next().unwrap_or_default().to_owned();
        poses.push(TimedPose { time_s, name, pose, line });
    }
    if are_quaternions && !poses.is_empty() {
        let message = "holds seven numbers a line, the last four a quaternion: a trajectory needs the time \
                       before them, timestamp tx ty tz qx qy qz qw";
        return Err(Error::format(path, message));
    }
    poses.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    Ok(poses)
}

/// Returns the pose at a time, and the line of the nearest pose of the trajectory. Returns `None` if the
/// trajectory was interrupted then.
fn pose_at(poses: &[TimedPose], time_s: f64) -> Option<(Pose, u64)> {
    if let Some(same) = nearest(poses, time_s, |pose| pose.time_s, SAME_S) {
        return Some((same.pose, same.line));
    }

    let next = poses.partition_point(|pose| pose.time_s <= time_s);
    let before = poses.get(next.checked_sub(1)?)?;
    let after = poses.get(next)?;
    let gap_s = after.time_s - before.time_s;
    if gap_s > GAP_S {
        return None;
    }

    let share = (time_s - before.time_s) / gap_s;
    let [from, to] = [before, after].map(|timed| DQuat::from_mat3(&timed.pose.world_from_camera));
    let pose = Pose {
        location: before.pose.location.lerp(after.pose.location, share),
        world_from_camera: DMat3::from_quat(from.slerp(to, share)),
    };
    Some((pose, if share < 0.5 { before.line } else { after.line }))
}

/// Returns the item nearest to a time, if it is at most `within_s` away. The items are sorted by time.
pub(crate) fn nearest<T>(items: &[T], time_s: f64, time_of: impl Fn(&T) -> f64, within_s: f64) -> Option<&T> {
    let next = items.partition_point(|item| time_of(item) < time_s);
    let around = [next.checked_sub(1).and_then(|last| items.get(last)), items.get(next)];
    let distance = |item: &T| (time_of(item) - time_s).abs();
    around
        .into_iter()
        .flatten()
        .filter(|item| distance(item) <= within_s)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// Returns the folder of intrinsics beside a folder of pictures: `lowres_wide_intrinsics` for `lowres_wide`.
fn intrinsics_of(pictures: &Path) -> PathBuf {
    let mut name = pictures.file_name().unwrap_or_default().to_owned();
    name.push("_intrinsics");
    pictures.with_file_name(name)
}

/// Returns the files with one of these endings whose names are times, perhaps after the number of a video:
/// `41254925_6845.806.png`. They are sorted by time. A folder that is not there has none.
fn timed_files(folder: &Path, endings: &[&str]) -> Result<TimedFiles> {
    let mut files = Vec::new();
    if !folder.is_dir() {
        return Ok(files);
    }
    let failed = |e| Error::io(folder, "read the folder", e);
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let is_kind = path
            .extension()
            .is_some_and(|e| endings.iter().any(|ending| e == *ending));
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let (_, time) = stem.rsplit_once('_').unwrap_or(("", stem));
        if is_kind && let Some(time_s) = time.parse::<f64>().ok().filter(|time| time.is_finite()) {
            files.push((time_s, path));
        }
    }
    files.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    Ok(files)
}

/// Reads intrinsics: `width height fx fy cx cy`. Returns the size of the pictures and their optics.
fn pincam(path: &Path) -> Result<([u32; 2], Optics)> {
    let numbers: Vec<f64> = numbers(&read_file(path)?, path)?
        .into_iter()
        .map(|(_, number)| number)
        .collect();
    let fault = |message: String| Error::format(path, message);
    let &[width, height, fx, fy, cx, cy] = numbers.as_slice() else {
        let message = format!("{} numbers; intrinsics are width height fx fy cx cy", numbers.len());
        return Err(fault(message));
    };

    if ![width, height].iter().all(|side| (1.0..=1e6).contains(side)) {
        return Err(fault(format!("a picture of {width} × {height} pixels")));
    }
    if fx <= 0.0 || fy <= 0.0 {
        return Err(fault(format!("focal lengths of {fx} and {fy} px: both must be above 0")));
    }
    let center_px = Some(dvec2(cx, cy));
    let optics = Optics::Pinhole { focal_px: dvec2(fx, fy), center_px, distortion: Distortion::None };
    Ok(([width as u32, height as u32], optics))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::dvec3;
    use std::fs;

    /// Two poses a tenth of a second apart, and one much later. The camera looks along +Y, is turned to +X,
    /// and goes a metre.
    const TRAJECTORY: &str = "6845.806 1.5707963267948966 0 0 -2 1.5 -0.3\n\
                              6845.906 1.2091995761561452 -1.2091995761561452 1.2091995761561452 0.3 1.5 -3\n\
                              6850.0 1.5707963267948966 0 0 -2 1.5 -0.3\n";

    /// Returns a video with pictures at these times.
    fn video(times: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("lowres_wide.traj"), TRAJECTORY).unwrap();
        for folder in ["lowres_wide", "lowres_wide_intrinsics"] {
            fs::create_dir(dir.path().join(folder)).unwrap();
        }
        for time in times {
            fs::write(dir.path().join(format!("lowres_wide/41254925_{time}.png")), "").unwrap();
        }
        let pincam = dir.path().join("lowres_wide_intrinsics/41254925_6845.807.pincam");
        fs::write(pincam, "256 192 211.9 212.5 127.9 95.6\n").unwrap();
        dir
    }

    fn read_video(dir: &Path) -> Result<(Vec<PosedCamera>, usize, Vec<PathBuf>)> {
        let path = find(dir).unwrap();
        read(&path, &fs::read(&path).unwrap(), None)
    }

    #[test]
    fn pictures_have_the_pose_and_the_intrinsics_of_their_time() {
        let dir = video(&["6845.806", "6845.856", "6845.909", "6847.000", "6850.004", "6851.000"]);
        let (cameras, untracked, read) = read_video(dir.path()).unwrap();
        assert_eq!((cameras.len(), untracked, read.len()), (4, 2, 2));
        let first = &cameras[0];
        assert_eq!((first.name.as_str(), first.line), ("41254925_6845.806.png", 1));
        assert!(first.pose.location.abs_diff_eq(dvec3(2.0, 0.3, 1.5), 1e-9), "{}", first.pose.location);
        assert!(
            first.pose.forward().abs_diff_eq(DVec3::Y, 1e-9) && first.pose.up().abs_diff_eq(DVec3::Z, 1e-9)
        );
        assert_eq!(first.size, Some([256, 192]));
        let Some(Optics::Pinhole { focal_px, center_px, .. }) = first.optics else { panic!() };
        assert_eq!((focal_px, center_px), (dvec2(211.9, 212.5), Some(dvec2(127.9, 95.6))));

        // Half a way between two poses, in place and direction.
        let between = &cameras[1];
        assert!(between.pose.location.abs_diff_eq(dvec3(2.5, 0.3, 1.5), 1e-6), "{}", between.pose.location);
        let diagonal = dvec3(1.0, 1.0, 0.0).normalize();
        assert!(between.pose.forward().abs_diff_eq(diagonal, 1e-6), "{}", between.pose.forward());
        assert!(cameras[2].pose.forward().abs_diff_eq(DVec3::X, 1e-9));
        assert_eq!((cameras[3].line, cameras[3].size), (3, None));
    }

    /// A phone that is held upright takes pictures that lie on their side; the pose says so.
    #[test]
    fn a_phone_may_be_held_upright() {
        let dir = video(&["1.000"]);
        fs::write(
            dir.path().join("lowres_wide.traj"),
            "1 1.2091995761561452 1.2091995761561452 1.2091995761561452 0 0 0\n",
        )
        .unwrap();
        let (cameras, ..) = read_video(dir.path()).unwrap();
        let pose = cameras[0].pose;
        assert!(pose.forward().abs_diff_eq(DVec3::Y, 1e-9), "{}", pose.forward());
        assert!(pose.right().abs_diff_eq(DVec3::Z, 1e-9) && pose.up().abs_diff_eq(-DVec3::X, 1e-9));
    }

    #[test]
    fn pictures_may_be_elsewhere_or_nowhere() {
        let dir = video(&["6845.806"]);
        let path = dir.path().join("lowres_wide.traj");
        let elsewhere = dir.path().join("wide");
        fs::create_dir(&elsewhere).unwrap();
        let read_in = |folder: &Path| read(&path, TRAJECTORY.as_bytes(), Some(folder));
        let message = read_in(&elsewhere).unwrap_err().to_string();
        assert!(message.contains("wide: holds no picture that is named by its time"), "{message}");
        fs::write(elsewhere.join("6850.0.jpg"), "").unwrap();
        let (cameras, ..) = read_in(&elsewhere).unwrap();
        assert_eq!((cameras.len(), cameras[0].line, cameras[0].optics), (1, 3, None));

        fs::remove_dir_all(dir.path().join("lowres_wide")).unwrap();
        fs::remove_dir_all(elsewhere).unwrap();
        let (cameras, ..) = read_video(dir.path()).unwrap();
        let names: Vec<&str> = cameras.iter().map(|camera| camera.name.as_str()).collect();
        assert_eq!(names, ["6845.806", "6845.906", "6850.0"]);
    }

    #[test]
    fn faults_have_their_place() {
        assert!(is_trajectory(b"1 2 3 4 5 6 7\r") && !is_trajectory(b"1 2 3 4 5 6 7 8"));
        assert!(!is_trajectory(b"1 2 3 4 5 6 a"));
        for line in ["1 2 3 4 5 6", "1 2 3 4 5 6 inf", "1 2 3 4 5 6 7 8"] {
            let e = read(Path::new("t"), format!("1 0 0 0 0 0 0\n{line}\n").as_bytes(), None).unwrap_err();
            assert!(e.to_string().contains("line 2: `") && e.to_string().contains("rx ry rz"), "{e}");
        }

        let untimed = read(Path::new("t"), b"1 2 3 0 0 0 1\n4 5 6 0.6 0 -0.8 0\n", None).unwrap_err();
        assert!(untimed.to_string().contains("the last four a quaternion"), "{untimed}");

        let dir = video(&["6845.806"]);
        let pincam = dir.path().join("lowres_wide_intrinsics/41254925_6845.807.pincam");
        for (text, words) in [
            ("256 192 211.9 212.5 127.9", "5 numbers"),
            ("0 192 211.9 212.5 127.9 95.6", "a picture of 0 × 192"),
            ("256 192 0 212.5 127.9 95.6", "focal lengths of 0"),
            ("256 192 x 212.5 127.9 95.6", "line 1: \"x\""),
        ] {
            fs::write(&pincam, text).unwrap();
            let message = read_video(dir.path()).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains(".pincam"), "{message}");
        }
    }
}
