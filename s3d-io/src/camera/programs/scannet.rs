//! The poses of a scan as ScanNet exports its `.sens` files: `pose/0.txt` …, camera → world, and
//! `intrinsic/intrinsic_color.txt`. Source: ScanNet's README, "SensReader".

use crate::camera::matterport::{numbers, read_known_pose};
use crate::camera::numbered::{NumberedFiles, numbered_files};
use crate::camera::picture::read_picture_size;
use crate::camera::picture_file::PictureFile;
use crate::camera::posed::{Distortion, Optics, PosedCamera};
use crate::error::{Error, Result};
use crate::fs::open::read_file;
use s3d_geom::glam::dvec2;
use std::path::{Path, PathBuf};

/// Returns the folder of a scan, and the files of its poses: those in its folder `pose` that are named by a
/// number, such as `0.txt`. `dir` is the folder of the scan or its folder `pose`.
pub(crate) fn find(dir: &Path) -> Result<Option<(PathBuf, NumberedFiles)>> {
    let is_pose = dir.file_name().is_some_and(|name| name == "pose");
    for (scan, poses) in [(dir.to_owned(), dir.join("pose")), (dir.join(".."), dir.to_owned())] {
        if !poses.is_dir() || (poses == *dir && !is_pose) {
            continue;
        }
        let files = numbered_files(&poses, "txt")?;
        if !files.is_empty() {
            return Ok(Some((scan, files)));
        }
    }
    Ok(None)
}

/// Reads the cameras of a scan that [`find`] found, by number. Also returns the number of poses that are left
/// out, because ScanNet marks them as unknown by −∞, and the files that were read.
pub(crate) fn read(scan: &Path, files: NumberedFiles) -> Result<(Vec<PosedCamera>, usize, Vec<PathBuf>)> {
    let intrinsics = scan.join("intrinsic").join("intrinsic_color.txt");
    let optics = if intrinsics.exists() {
        Some(optics(&intrinsics)?)
    } else {
        None
    };
    let mut cameras = Vec::new();
    let mut untracked = 0;
    let mut read: Vec<PathBuf> = optics.iter().map(|_| intrinsics.clone()).collect();

    for (number, path) in files {
        read.push(path.clone());
        let Some(pose) = read_known_pose(&path)? else {
            untracked += 1;
            continue;
        };
        let picture = ["jpg", "png"].map(|ending| scan.join("color").join(format!("{number}.{ending}")));
        let picture = picture.into_iter().find(|path| path.is_file()).map(PictureFile::from);
        let name = number.to_string();
        cameras.push(PosedCamera { name, pose, size: None, optics, picture, mask: None, line: 0 });
    }

    // All pictures of a scan are of one size.
    if let Some(picture) = cameras.iter().find_map(|camera| camera.picture.as_ref()) {
        let (width, height) = read_picture_size(&picture.path)?;
        cameras
            .iter_mut()
            .for_each(|camera| camera.size = Some([width, height]));
    }
    Ok((cameras, untracked, read))
}

/// Reads the optics from the file of an intrinsic matrix K.
pub(crate) fn optics(path: &Path) -> Result<Optics> {
    let numbers: Vec<f64> = numbers(&read_file(path)?, path)?
        .into_iter()
        .map(|(_, number)| number)
        .collect();
    optics_of_matrix(&numbers).map_err(|message| Error::format(path, message))
}

/// Returns the optics of an intrinsic matrix K: a 3 × 3 matrix, or the upper left of a 4 × 4 matrix. The
/// error is a sentence.
pub(crate) fn optics_of_matrix(numbers: &[f64]) -> std::result::Result<Optics, String> {
    let (fx, cx, fy, cy) = match *numbers {
        [fx, 0.0, cx, _, 0.0, fy, cy, _, 0.0, 0.0, 1.0, ..] if numbers.len() == 16 => (fx, cx, fy, cy),
        [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0] => (fx, cx, fy, cy),
        _ => return Err("is no matrix of intrinsics: fx 0 cx 0, 0 fy cy 0, 0 0 1 0, 0 0 0 1".into()),
    };

    if fx <= 0.0 || fy <= 0.0 {
        return Err(format!("focal lengths of {fx} and {fy} px: both must be above 0"));
    }
    let center_px = Some(dvec2(cx, cy));
    Ok(Optics::Pinhole { focal_px: dvec2(fx, fy), center_px, distortion: Distortion::None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::DVec3;
    use std::fs;

    const K: &str = "1170.1 0.0 647.7 0.0\n0.0 1170.2 483.7 0.0\n0 0 1 0\n0 0 0 1\n";

    /// Returns a scan with the poses 10, 2 and 3. Pose 3 is not known.
    fn scan() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        ["pose", "intrinsic", "color"]
            .iter()
            .for_each(|name| fs::create_dir(at(name)).unwrap());
        fs::write(at("pose/10.txt"), "1 0 0 4\n0 0 1 5\n0 -1 0 1.5\n0 0 0 1\n").unwrap();
        fs::write(at("pose/2.txt"), "1 0 0 4\n0 -1 0 5\n0 0 -1 1.5\n0 0 0 1\n").unwrap();
        fs::write(at("pose/3.txt"), "-inf -inf -inf -inf\n".repeat(4)).unwrap();
        fs::write(at("pose/notes.txt"), "").unwrap();
        fs::write(at("intrinsic/intrinsic_color.txt"), K).unwrap();
        dir
    }

    #[test]
    fn a_scan_is_read_by_number_and_unknown_poses_are_counted() {
        let dir = scan();
        for path in [dir.path().to_owned(), dir.path().join("pose")] {
            let (scan, files) = find(&path).unwrap().unwrap();
            let (cameras, untracked, read) = read(&scan, files).unwrap();
            assert_eq!((cameras.len(), untracked, read.len()), (2, 1, 4));
            assert_eq!([&cameras[0].name, &cameras[1].name], ["2", "10"]);
            assert_eq!(cameras[0].pose.forward(), -DVec3::Z);
            assert_eq!((cameras[1].pose.forward(), cameras[1].pose.location.z), (DVec3::Y, 1.5));
            let Some(Optics::Pinhole { focal_px, center_px, .. }) = cameras[1].optics else { panic!() };
            assert_eq!((focal_px, center_px), (dvec2(1170.1, 1170.2), Some(dvec2(647.7, 483.7))));
            assert_eq!((cameras[1].size, &cameras[1].picture), (None, &None));
        }
        assert!(find(&dir.path().join("color")).unwrap().is_none());
    }

    #[test]
    fn pictures_tell_the_size() {
        let dir = scan();
        let picture = dir.path().join("color/10.png");
        crate::image::png::write_rgb8(
            &picture,
            &s3d_geom::Raster::filled(13, 9, [1, 2, 3]),
            crate::image::png::Content::Photo,
            crate::image::compression::Compression::Fast,
        )
        .unwrap();
        let (scan, files) = find(dir.path()).unwrap().unwrap();
        let (cameras, ..) = read(&scan, files).unwrap();
        assert!(cameras.iter().all(|camera| camera.size == Some([13, 9])));
        assert_eq!((&cameras[0].picture, cameras[1].picture.clone()), (&None, Some(picture.into())));
    }

    #[test]
    fn faults_name_their_file() {
        let dir = scan();
        let faulty = |name: &str, text: &str| {
            let path = dir.path().join(name);
            let before = fs::read(&path).unwrap();
            fs::write(&path, text).unwrap();
            let (scan, files) = find(dir.path()).unwrap().unwrap();
            let message = read(&scan, files).unwrap_err().to_string();
            fs::write(&path, before).unwrap();
            assert!(message.contains(name), "{message}");
            message
        };
        assert!(faulty("pose/2.txt", "1 0 0 4\n0 0 1 5\n").contains("8 numbers"));
        assert!(
            faulty("pose/2.txt", "1 0 0 0\n0 0 1 0\n0 -1 0 0\n4 5 6 1\n").contains("the last row is 4 5 6 1")
        );
        assert!(faulty("intrinsic/intrinsic_color.txt", "1 2 3").contains("no matrix of intrinsics"));
        assert!(faulty("intrinsic/intrinsic_color.txt", &K.replace("1170.2", "-1")).contains("above 0"));
    }
}
