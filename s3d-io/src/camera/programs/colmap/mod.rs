//! The pictures of a COLMAP model, `images.txt` or `images.bin`. Their cameras are in `cameras`.
//! Source: COLMAP's documentation, "Output Format".
//!
//! Own code: lines of ten words, and the same in binary, take eighty lines to read.
//!
//! A picture's pose is the transform from the world to the camera in OpenCV's axes (x right, y down, z
//! forward): a quaternion w x y z and a translation.

mod cameras;

use crate::camera::located::{fault, pose_from_extrinsics, rotation};
use crate::camera::posed::PosedCamera;
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use crate::fs::quote::quote;
use cameras::read_beside;
use s3d_geom::Pose;
use s3d_geom::glam::{DMat3, DVec3};
use std::path::{Path, PathBuf};

/// Returns the list of pictures of the model in `dir`. It is in `dir`, or in `0`, `sparse/0` or `sparse`
/// below it.
pub(crate) fn find(dir: &Path) -> Option<PathBuf> {
    ["", "0", "sparse/0", "sparse"]
        .iter()
        .flat_map(|below| ["images.bin", "images.txt"].map(|name| dir.join(below).join(name)))
        .find(|path| path.is_file())
}

/// The number of a camera, and a picture that was taken with it.
type Picture = (u32, PosedCamera);

/// Reads `images.txt` or `images.bin`; the extension says which.
pub(crate) fn read(path: &Path) -> Result<Vec<PosedCamera>> {
    Ok(read_pictures(path)?.into_iter().map(|(_, picture)| picture).collect())
}

/// Reads the pictures, and the list of cameras beside them. The pictures' files are in a folder `images`
/// beside the model, or beside the folder `sparse` or `sparse/0` that holds it. Also returns the path of the
/// list of cameras.
pub(crate) fn read_posed(path: &Path) -> Result<(Vec<PosedCamera>, PathBuf)> {
    let pictures = read_pictures(path)?;
    let (file, cameras) = read_beside(path)?;
    let folders = path.ancestors().skip(1).take(3).map(|dir| dir.join("images"));
    let folder = folders.into_iter().find(|dir| dir.is_dir());
    let mut with_cameras = Vec::with_capacity(pictures.len());
    for (id, mut picture) in pictures {
        let (size, optics) = cameras.get(&id).ok_or_else(|| {
            let name = quote(picture.name.as_bytes());
            fault(path, picture.line, format!("{name}: its camera {id} is not in {}", file.display()))
        })?;
        picture.size = Some(*size);
        picture.optics = Some(*optics);
        picture.picture = folder.as_ref().map(|folder| folder.join(&picture.name).into());
        with_cameras.push(picture);
    }
    Ok((with_cameras, file))
}

fn read_pictures(path: &Path) -> Result<Vec<Picture>> {
    let bytes = read_file(path)?;
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bin")) {
        read_binary(path, &bytes)
    } else {
        read_text(path, &text_of(&bytes, path)?)
    }
}

/// Reads two lines for each picture: `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, and its points, which
/// may be none. Some programs leave empty lines out. So the line after a picture is only taken as points if
/// it looks like points.
fn read_text(path: &Path, bytes: &[u8]) -> Result<Vec<Picture>> {
    const FORM: &str = "a picture is IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and the line after it may \
                        hold its points, X Y POINT3D_ID each";
    let mut pictures = Vec::new();
    let mut may_be_points = false;
    for (line, text) in (1u64..).zip(bytes.split(|&b| b == b'\n')) {
        let text = text.trim_ascii();
        if text.starts_with(b"#") {
            continue;
        }

        if std::mem::take(&mut may_be_points) && are_points(text) || text.is_empty() {
            continue;
        }

        let text = std::str::from_utf8(text).map_err(|_| Error::line(path, line, "is no text in UTF-8"))?;

        let mut rest = text;
        let mut fields = [""; 9];
        for field in &mut fields {
            let (head, tail) = rest
                .split_once(|c: char| c.is_ascii_whitespace())
                .ok_or_else(|| Error::line(path, line, format!("{}: {FORM}", quote(text.as_bytes()))))?;
            *field = head;
            rest = tail.trim_start();
        }

        let mut numbers = [0.0; 7];
        for (number, field) in numbers.iter_mut().zip(&fields[1..8]) {
            *number = field.parse().map_err(|_| {
                Error::line(path, line, format!("{} is no number: {FORM}", quote(field.as_bytes())))
            })?;
        }

        let [.., camera] = fields;
        let camera = camera.parse().map_err(|_| {
            Error::line(path, line, format!("{} is no number of a camera: {FORM}", quote(camera.as_bytes())))
        })?;

        let pose = pose(numbers).map_err(|m| Error::line(path, line, m))?;
        pictures.push((camera, picture(rest.to_owned(), pose, line)));
        may_be_points = true;
    }
    Ok(pictures)
}

/// Returns whether a line is empty or consists of numbers, three for each point. A picture has ten words, and
/// its name is seldom a number.
fn are_points(line: &[u8]) -> bool {
    let mut words = 0u64;
    let mut in_word = false;
    for byte in line {
        if !is_of_number(byte) && !byte.is_ascii_whitespace() {
            return false;
        }
        words += u64::from(is_of_number(byte) && !in_word);
        in_word = is_of_number(byte);
    }
    words.is_multiple_of(3)
}

/// Returns whether a byte can be part of a number.
fn is_of_number(byte: &u8) -> bool {
    matches!(byte, b'0'..=b'9' | b'.' | b'-' | b'+' | b'e' | b'E')
}

/// Reads the binary form, little-endian: a count, then for each picture its id (4 bytes), seven numbers (8
/// each), the number of its camera (4), a name that ends with a zero byte, a count of points (8) and 24 bytes
/// for each point.
fn read_binary(path: &Path, bytes: &[u8]) -> Result<Vec<Picture>> {
    let mut rest = bytes;
    let mut pictures = Vec::new();
    let count = u64::from_le_bytes(take(&mut rest).ok_or_else(|| cut_off(path, 0))?);
    for n in 1..=count {
        let (numbers, camera, name) = take_picture(&mut rest).ok_or_else(|| cut_off(path, n))?;
        let name = String::from_utf8_lossy(name).into_owned();
        let pose = pose(numbers).map_err(|m| Error::format(path, format!("picture {n}, {name:?}: {m}")))?;
        pictures.push((camera, picture(name, pose, 0)));
    }
    Ok(pictures)
}

/// Takes the next picture: the numbers of its pose, the number of its camera and its name. Returns `None` if
/// the bytes end before.
fn take_picture<'a>(rest: &mut &'a [u8]) -> Option<([f64; 7], u32, &'a [u8])> {
    take::<4>(rest)?;
    let mut numbers = [0.0; 7];
    for number in &mut numbers {
        *number = f64::from_le_bytes(take(rest)?);
    }
    let camera = u32::from_le_bytes(take(rest)?);

    let end = rest.iter().position(|&b| b == 0)?;
    let (name, behind) = rest.split_at_checked(end)?;
    *rest = behind.get(1..)?;

    let points = u64::from_le_bytes(take(rest)?);
    let length = usize::try_from(points).ok()?.checked_mul(24)?;
    *rest = rest.get(length..)?;
    Some((numbers, camera, name))
}

fn cut_off(path: &Path, picture: u64) -> Error {
    Error::format(path, format!("ends in picture {picture}: it was cut off, or is no images.bin"))
}

fn picture(name: String, pose: Pose, line: u64) -> PosedCamera {
    PosedCamera { line, ..PosedCamera::new(name, pose) }
}

/// Takes the next `N` bytes.
pub(crate) fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = rest.split_first_chunk::<N>()?;
    *rest = tail;
    Some(*head)
}

/// Returns the pose of a camera from the quaternion and the translation of its file. The error is a sentence.
fn pose([qw, qx, qy, qz, tx, ty, tz]: [f64; 7]) -> std::result::Result<Pose, String> {
    if ![qw, qx, qy, qz, tx, ty, tz].iter().all(|v| v.is_finite()) {
        return Err("a number of its pose is not finite".into());
    }
    let camera_from_world = DMat3::from_quat(rotation([qx, qy, qz, qw])?);
    Ok(pose_from_extrinsics(camera_from_world, DVec3::new(tx, ty, tz)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::DQuat;

    /// Returns the numbers in the line of a picture that was taken at `pose`.
    fn numbers(pose: &Pose) -> [f64; 7] {
        let r = pose.opencv_from_world();
        let q = DQuat::from_mat3(&r);
        let t = -(r * pose.location);
        [q.w, q.x, q.y, q.z, t.x, t.y, t.z]
    }

    fn some_pose(i: f64) -> Pose {
        Pose::from_scanner(DVec3::new(i, 2.0 * i, 1.5), DQuat::from_rotation_z(0.4 * i)).turned(0.2, -0.3 * i)
    }

    fn is_same(a: &Pose, b: &Pose) -> bool {
        a.location.abs_diff_eq(b.location, 1e-12)
            && a.world_from_camera.abs_diff_eq(b.world_from_camera, 1e-12)
    }

    fn text(poses: &[Pose]) -> String {
        let mut text = String::from("# Image list with two lines of data per image:\n");
        for (i, pose) in poses.iter().enumerate() {
            let n = numbers(pose).map(|v| v.to_string()).join(" ");
            // The second line, of points, is empty for the first picture.
            let points = if i == 0 { "" } else { "1.5 2.5 -1 3 4 17" };
            text += &format!("{} {n} 1 scan {i}.jpg\n{points}\n", i + 1);
        }
        text
    }

    fn binary(poses: &[Pose]) -> Vec<u8> {
        let mut bytes = (poses.len() as u64).to_le_bytes().to_vec();
        for (i, pose) in poses.iter().enumerate() {
            bytes.extend((i as u32 + 1).to_le_bytes());
            numbers(pose).iter().for_each(|v| bytes.extend(v.to_le_bytes()));
            bytes.extend(1u32.to_le_bytes());
            bytes.extend(format!("scan {i}.jpg\0").bytes());
            bytes.extend((i as u64).to_le_bytes());
            bytes.extend(vec![7; 24 * i]);
        }
        bytes
    }

    #[test]
    fn both_forms_give_the_poses_back() {
        let poses = [some_pose(0.0), some_pose(1.0), some_pose(-2.0)];
        let from_text = read_text(Path::new("images.txt"), text(&poses).as_bytes()).unwrap();
        let from_binary = read_binary(Path::new("images.bin"), &binary(&poses)).unwrap();
        for read in [from_text, from_binary] {
            assert_eq!(read.len(), 3);
            for (i, ((camera, picture), pose)) in read.iter().zip(&poses).enumerate() {
                assert_eq!(*camera, 1);
                assert!(is_same(&picture.pose, pose), "{:?} {pose:?}", picture.pose);
                assert_eq!(picture.name, format!("scan {i}.jpg"));
            }
        }
    }

    fn picture_line(name: &str) -> String {
        format!("1 1 0 0 0 0 0 0 1 {name}\n")
    }

    fn names_in(text: &str) -> Vec<String> {
        let read = read_text(Path::new("images.txt"), text.as_bytes()).unwrap();
        read.into_iter().map(|(_, picture)| picture.name).collect()
    }

    #[test]
    fn pictures_without_lines_of_points_are_all_read() {
        let [a, b, c] = ["a.jpg", "7", "c d.png"].map(picture_line);
        assert_eq!(names_in(&format!("# no points\n{a}{b}{c}")), ["a.jpg", "7", "c d.png"]);
        // With and without, and with what people write between.
        assert_eq!(names_in(&format!("{a}\n{b}1 2 -1 3.5 4e1 7\n{c}")), ["a.jpg", "7", "c d.png"]);
        assert_eq!(
            names_in(&format!("{a}# a comment\n0 0 -1\n{c}{a}\n\n\n{b}")),
            ["a.jpg", "c d.png", "a.jpg", "7"]
        );
        // Half a point is no picture either.
        let message = read_text(Path::new("i"), format!("{a}1.5 2.5 -1 3\n").as_bytes())
            .err()
            .unwrap();
        assert!(message.to_string().contains("line 2: `1.5 2.5 -1 3`: a picture is"), "{message}");
    }

    /// The same places in a panorama by COLMAP's formulas, written out again, and by ours.
    #[test]
    fn panoramas_have_the_axes_of_colmap() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        // Level, and looking along +X: the world's −Y is right, its −Z down.
        let level = "1 0.5 0.5 -0.5 0.5 2 1.5 -0.3 1 pano.png\n";
        std::fs::write(at("images.txt"), level).unwrap();
        std::fs::write(at("cameras.txt"), "1 EQUIRECTANGULAR 512 256 512 256\n").unwrap();
        for ignored in ["rigs.txt", "frames.txt"] {
            std::fs::write(at(ignored), "1 1 CAMERA 1\n").unwrap();
        }

        let (cameras, _) = read_posed(&at("images.txt")).unwrap();
        let camera = cameras[0].camera(&Default::default()).unwrap();
        assert!(camera.is_panorama() && (camera.width, camera.height) == (512, 256));
        let camera_from_world = DMat3::from_quat(DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5));
        assert!(
            camera
                .pose
                .forward()
                .abs_diff_eq(camera_from_world.transpose() * DVec3::Z, 1e-12)
        );

        for direction in [DVec3::X, -DVec3::Y, DVec3::new(1.0, 2.0, 3.0), DVec3::new(-4.0, 1.0, -2.0)] {
            let v = camera_from_world * direction;
            let theta = libm::atan2(v.x, v.z);
            let phi = libm::atan2(-v.y, libm::hypot(v.x, v.z));
            let turn = std::f64::consts::TAU;
            let expected = [(theta / turn + 0.5) * 512.0, (0.5 - phi / (0.5 * turn)) * 256.0];
            let (pixel, _) = camera.project(camera.pose.location + direction).unwrap();
            assert!(pixel.abs_diff_eq(expected.into(), 1e-9), "{direction}: {pixel} {expected:?}");
        }
    }

    #[test]
    fn pictures_have_their_cameras() {
        let dir = tempfile::tempdir().unwrap();
        let model = dir.path().join("sparse/0");
        std::fs::create_dir_all(&model).unwrap();
        let at = |name: &str| model.join(name);
        std::fs::write(at("images.txt"), "1 1 0 0 0 0 0 0 7 a.jpg\n\n2 1 0 0 0 0 0 0 8 b.jpg\n\n").unwrap();
        let gone = read_posed(&at("images.txt")).unwrap_err();
        assert!(gone.path().ends_with("cameras.txt"), "{gone}");
        std::fs::write(at("cameras.txt"), "7 SIMPLE_PINHOLE 64 48 50 32 24\n").unwrap();
        let other = read_posed(&at("images.txt")).unwrap_err().to_string();
        assert!(other.contains("images.txt, line 3: `b.jpg`: its camera 8 is not in"), "{other}");
        std::fs::write(at("cameras.txt"), "8 PINHOLE 32 24 25 26 16 12\n7 SIMPLE_PINHOLE 64 48 50 32 24\n")
            .unwrap();
        std::fs::create_dir(dir.path().join("images")).unwrap();
        let (cameras, _) = read_posed(&at("images.txt")).unwrap();
        assert_eq!([cameras[0].size, cameras[1].size], [Some([64, 48]), Some([32, 24])]);
        assert_eq!(cameras[1].picture, Some(dir.path().join("images/b.jpg").into()));
    }

    #[test]
    fn faults_have_their_place() {
        let good = text(&[some_pose(1.0)]);
        for (more, words) in [
            ("2 1 0 0 0 0 0 0 1\n", "line 4: `2 1 0 0 0 0 0 0 1`: a picture is"),
            ("2 1 0 0 x 0 0 0 1 a.jpg\n", "line 4: `x` is no number"),
            ("2 1 0 0 0 0 0 0 one a.jpg\n", "line 4: `one` is no number of a camera"),
            ("2 0 0 0 0 0 0 0 1 a.jpg\n", "line 4: the quaternion"),
            ("2 1 0 0 0 0 inf 0 1 a.jpg\n", "line 4: a number"),
        ] {
            let e = read_text(Path::new("images.txt"), (good.clone() + more).as_bytes())
                .err()
                .unwrap();
            assert!(e.to_string().contains(words), "{e}");
        }

        let bytes = binary(&[some_pose(0.0), some_pose(1.0)]);
        for length in [0, 7, 8, 60, 80, bytes.len() - 1] {
            let e = read_binary(Path::new("images.bin"), &bytes[..length]).err().unwrap();
            assert!(e.to_string().contains("cut off"), "{e}");
        }

        let mut lying = bytes.clone();
        lying[..8].copy_from_slice(&u64::MAX.to_le_bytes());
        assert!(
            read_binary(Path::new("i"), &lying)
                .err()
                .unwrap()
                .to_string()
                .contains("picture 3")
        );
    }
}
