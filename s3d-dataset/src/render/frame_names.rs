//! Names the files of a list of cameras.

use s3d_io::camera::PosedCamera;
use s3d_io::fs::{UniqueNames, portable_file_name};

/// Endings of pictures, which are left out of the names. Other endings stay, such as the decimals of a time
/// stamp.
const ENDINGS: [&str; 9] = ["png", "jpg", "jpeg", "webp", "bmp", "tif", "tiff", "exr", "heic"];

/// A unique file name without ending for each camera: its name in the list without folders, or with them if
/// the short names are not unique.
pub(super) fn frame_names(cameras: &[PosedCamera]) -> Vec<String> {
    let mut seen = UniqueNames::default();
    let short: Vec<String> = cameras.iter().map(|camera| last_stem(&camera.name)).collect();
    if short.iter().all(|name| seen.add(name) == *name) {
        return short;
    }
    let mut names = UniqueNames::default();
    cameras
        .iter()
        .map(|camera| names.add(&stem(camera.name.trim_start_matches("./"))))
        .collect()
}

/// The name without the ending of a picture, as a portable file name.
fn stem(name: &str) -> String {
    let cut = name
        .rsplit_once('.')
        .filter(|(_, e)| ENDINGS.iter().any(|ending| e.eq_ignore_ascii_case(ending)));
    let name = portable_file_name(cut.map_or(name, |(stem, _)| stem));
    if name.is_empty() { "view".to_owned() } else { name }
}

/// The stem of a name without its folders.
fn last_stem(name: &str) -> String {
    stem(name.rsplit(['/', '\\']).next().unwrap_or(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use s3d_geom::Pose;

    fn names(list: &[&str]) -> Vec<String> {
        let pose = Pose::level(DVec3::ZERO, 0.0);
        let mut cameras = Vec::new();
        for name in list {
            let name = (*name).to_owned();
            cameras.push(PosedCamera::new(name, pose));
        }
        frame_names(&cameras)
    }

    #[test]
    fn names_are_short_and_never_twice() {
        assert_eq!(names(&["./images/a.png", "images/b.JPG"]), ["a", "b"]);
        assert_eq!(names(&["left/a.png", "right/A.png"]), ["left_a", "right_A"]);
        assert_eq!(names(&["1305031098.6659", "1305031098.6758"]), ["1305031098.6659", "1305031098.6758"]);
        assert_eq!(names(&["a", "a", "a.png"]), ["a", "a_2", "a_3"]);
        assert_eq!(names(&["../../etc/passwd", "..", "con"]), ["passwd", "view", "_con"]);
        assert_eq!(names(&["C:\\x\\a.png", "Büro 1"]), ["a", "B_ro_1"]);
    }
}
