//! Trajectories of one matrix a line: 16 numbers, camera → world in OpenCV's axes, row by row. Replica's
//! sequences have this form, in the world of its meshes: `traj.txt` with pictures in `results`
//! (cvg/nice-slam, src/utils/datasets.py), and `traj_w_c.txt` with pictures in `rgb`
//! (Harry-Zhi/semantic_nerf, SSR/datasets/replica/replica_datasets.py).

use crate::camera::matterport::pose_of_matrix;
use crate::camera::numbered::{NumberedFiles, numbered_between};
use crate::camera::posed::{Distortion, Optics, PosedCamera};
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use crate::fs::quote::quote;
use s3d_geom::glam::dvec2;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The numbers of a line.
const NUMBERS: usize = 16;

/// The names of a trajectory in the folder of a scene.
const TRAJECTORIES: [&str; 2] = ["traj.txt", "traj_w_c.txt"];

/// The folders of pictures beside a trajectory, and what stands before and after the number of a picture.
const PICTURES: [(&str, &str, &str); 4] = [
    ("results", "frame", ".jpg"),
    ("results", "frame", ".png"),
    ("rgb", "rgb_", ".png"),
    ("rgb", "rgb_", ".jpg"),
];

/// The files of intrinsics: beside the trajectory, or beside its folder.
const INTRINSICS: [&str; 2] = ["cam_params.json", "../cam_params.json"];

/// The file of intrinsics.
#[derive(Deserialize)]
struct CameraFile {
    camera: CameraEntry,
}

#[derive(Deserialize)]
struct CameraEntry {
    w: u32,
    h: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
}

/// Returns the trajectory of the scene in `dir`, if there is one.
pub(crate) fn find(dir: &Path) -> Option<PathBuf> {
    TRAJECTORIES
        .iter()
        .map(|name| dir.join(name))
        .find(|path| path.is_file())
}

/// Returns whether a line has the 16 numbers of a matrix.
pub(crate) fn is_matrix(line: &[u8]) -> bool {
    numbers(line).is_some()
}

/// Reads the cameras of a trajectory. The picture of line N is the Nth by its number, in `images` or in the
/// folder beside the trajectory. Also returns the number of poses that are left out because they are not
/// finite, and the files that were read.
pub(crate) fn read(
    path: &Path,
    text: &[u8],
    images: Option<&Path>,
) -> Result<(Vec<PosedCamera>, usize, Vec<PathBuf>)> {
    let mut files = vec![path.to_owned()];
    let intrinsics = INTRINSICS
        .iter()
        .map(|name| path.with_file_name(name))
        .find(|path| path.is_file());
    let mut size = None;
    let mut optics = None;
    if let Some(file) = intrinsics {
        let told = CameraEntry::read(&file)?;
        size = Some([told.w, told.h]);
        optics = Some(told.optics());
        files.push(file);
    }

    let pictures = pictures(path, images)?;
    let mut pictures = pictures.into_iter();
    let mut cameras = Vec::new();
    let mut untracked = 0;
    for (line, text) in (1u64..).zip(text.split(|&b| b == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }
        let fault = |message: String| Error::line(path, line, message);
        let matrix = numbers(text)
            .ok_or_else(|| fault(format!("{}: a line is a matrix of {NUMBERS} numbers", quote(text))))?;
        let picture = pictures.next();
        if !matrix.iter().all(|number| number.is_finite()) {
            untracked += 1;
            continue;
        }

        let pose = pose_of_matrix(&matrix).map_err(|(_, message)| fault(message))?;
        let name = match &picture {
            Some((_, file)) => file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            None => (cameras.len() + untracked).to_string(),
        };
        let picture = picture.map(|(_, file)| file.into());
        cameras.push(PosedCamera { name, pose, size, optics, picture, mask: None, line });
    }

    if let Some((_, extra)) = pictures.next() {
        let lines = cameras.len() + untracked;
        let message = format!("has {lines} poses, and there are more pictures: {}", extra.display());
        return Err(Error::format(path, message));
    }
    Ok((cameras, untracked, files))
}

/// Returns the pictures of a trajectory, by number. There may be none.
fn pictures(path: &Path, images: Option<&Path>) -> Result<NumberedFiles> {
    for (folder, before, after) in PICTURES {
        let folder = images.map_or_else(|| path.with_file_name(folder), Path::to_owned);
        if folder.is_dir() {
            let found = numbered_between(&folder, before, after)?;
            if !found.is_empty() {
                return Ok(found);
            }
        }
    }
    Ok(Vec::new())
}

/// Returns the numbers of a matrix's line.
fn numbers(line: &[u8]) -> Option<[f64; NUMBERS]> {
    let words = std::str::from_utf8(line).ok()?.split_ascii_whitespace();
    let numbers: Option<Vec<f64>> = words.take(NUMBERS + 1).map(|word| word.parse().ok()).collect();
    numbers?.try_into().ok()
}

impl CameraEntry {
    fn read(path: &Path) -> Result<Self> {
        let CameraFile { camera } = read_json(path)?;
        let Self { w, h, fx, fy, cx, cy } = camera;
        if w == 0 || h == 0 || ![fx, fy].iter().all(|f| *f > 0.0 && f.is_finite()) {
            let message = format!("a camera of {w} × {h} pixels with focal lengths of {fx} and {fy} px");
            return Err(Error::format(path, message));
        }
        if !cx.is_finite() || !cy.is_finite() {
            return Err(Error::format(path, format!("a principal point at ({cx}, {cy})")));
        }
        Ok(camera)
    }

    /// The file counts pixels from the middle of the first: of 1,200 columns, the middle is 599.5.
    fn optics(&self) -> Optics {
        Optics::Pinhole {
            focal_px: dvec2(self.fx, self.fy),
            center_px: Some(dvec2(self.cx + 0.5, self.cy + 0.5)),
            distortion: Distortion::None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::DVec3;
    use std::fs;

    const ALONG_Y: &str = "1 0 0 4 0 0 1 5 0 -1 0 1.5 0 0 0 1";
    const DOWN: &str = "1.0e+00 0 0 4 0 -1 0 5 0 0 -1 1.5 0 0 0 1";
    const CAMERA: &str = r#"{"camera": {"w": 1200, "h": 680, "fx": 600.0, "fy": 601.0, "cx": 599.5,
                             "cy": 339.5, "scale": 6553.5}}"#;

    /// Returns a folder of scenes with one, of these poses and pictures.
    fn scene(lines: &[&str], pictures: usize) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        let room = dir.path().join("room0");
        fs::create_dir_all(room.join("results")).unwrap();
        fs::write(room.join("traj.txt"), lines.join("\n")).unwrap();
        for number in 0..pictures {
            fs::write(room.join(format!("results/frame{number:06}.jpg")), "").unwrap();
            fs::write(room.join(format!("results/depth{number:06}.png")), "").unwrap();
        }
        fs::write(dir.path().join("cam_params.json"), CAMERA).unwrap();
        dir
    }

    fn read_scene(dir: &tempfile::TempDir) -> Result<(Vec<PosedCamera>, usize, Vec<PathBuf>)> {
        let path = find(&dir.path().join("room0")).unwrap();
        read(&path, &fs::read(&path).unwrap(), None)
    }

    #[test]
    fn each_line_is_the_pose_of_a_picture() {
        let lost = vec!["nan"; 16].join(" ");
        let (cameras, untracked, files) = read_scene(&scene(&[ALONG_Y, &lost, DOWN, ""], 3)).unwrap();
        assert_eq!((cameras.len(), untracked, files.len()), (2, 1, 2));
        assert_eq!([cameras[0].name.as_str(), &cameras[1].name], ["frame000000.jpg", "frame000002.jpg"]);
        assert_eq!((cameras[0].pose.forward(), cameras[1].pose.forward()), (DVec3::Y, -DVec3::Z));
        assert_eq!((cameras[1].pose.location, cameras[1].line), (DVec3::new(4.0, 5.0, 1.5), 3));
        assert_eq!(cameras[0].size, Some([1200, 680]));
        let Some(Optics::Pinhole { focal_px, center_px, .. }) = cameras[1].optics else { panic!() };
        assert_eq!((focal_px, center_px), (dvec2(600.0, 601.0), Some(dvec2(600.0, 340.0))));

        // Poses alone are cameras too.
        let (cameras, ..) = read_scene(&scene(&[ALONG_Y, DOWN], 0)).unwrap();
        assert_eq!((cameras[1].name.as_str(), &cameras[1].picture), ("1", &None));
    }

    #[test]
    fn faults_have_their_line() {
        assert!(is_matrix(ALONG_Y.as_bytes()) && !is_matrix(b"1 2 3") && !is_matrix(b"a b"));
        let message = |lines: &[&str], pictures| read_scene(&scene(lines, pictures)).unwrap_err().to_string();
        assert!(message(&[ALONG_Y, "1 2 3"], 2).contains("traj.txt, line 2: `1 2 3`: a line is a matrix"));
        let sheared = ALONG_Y.replacen('1', "2", 1);
        assert!(message(&[ALONG_Y, &sheared], 2).contains("line 2: the upper left 3×3 part is no rotation"));
        assert!(message(&[ALONG_Y], 2).contains("has 1 poses, and there are more pictures"));

        let dir = scene(&[ALONG_Y], 1);
        for (from, to, words) in [("600.0", "-1", "focal lengths of -1"), ("1200", "0", "0 × 680 pixels")] {
            fs::write(dir.path().join("cam_params.json"), CAMERA.replace(from, to)).unwrap();
            assert!(read_scene(&dir).unwrap_err().to_string().contains(words));
        }
    }
}
