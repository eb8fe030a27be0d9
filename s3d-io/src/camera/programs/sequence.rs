//! The pictures of a 3RScan sequence: `frame-000000.pose.txt`, `frame-000000.color.jpg` and `_info.txt`.
//! Source: WaldJohannaU/3RScan, FAQ.md. BundleFusion and others write the same form.
//!
//! A pose is camera → world in OpenCV's axes, 4 × 4, of the colour camera itself.

use crate::camera::matterport::read_known_pose;
use crate::camera::numbered::{NumberedFiles, numbered_between};
use crate::camera::picture::read_picture_size;
use crate::camera::posed::{Optics, PosedCamera};
use crate::camera::programs::scannet::optics_of_matrix;
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use crate::fs::quote::quote;
use std::path::{Path, PathBuf};

/// The ends of the names of poses and pictures.
const POSE: &str = ".pose.txt";
const PICTURES: [&str; 2] = [".color.jpg", ".color.png"];

/// The names of the file with the intrinsics.
const INFO: [&str; 2] = ["_info.txt", "info.txt"];

/// Returns the poses of a sequence, by number. `dir` is its folder, or the folder of the scan with
/// `sequence`.
pub(crate) fn find(dir: &Path) -> Result<Option<NumberedFiles>> {
    for folder in [dir.join("sequence"), dir.to_owned()] {
        if folder.is_dir() {
            let files = numbered_between(&folder, "frame-", POSE)?;
            if !files.is_empty() {
                return Ok(Some(files));
            }
        }
    }
    Ok(None)
}

/// Reads the cameras that [`find`] found. Also returns the number of poses that are left out, because the
/// sequence marks them as unknown by an infinity, and the files that were read.
pub(crate) fn read(files: NumberedFiles) -> Result<(Vec<PosedCamera>, usize, Vec<PathBuf>)> {
    let mut size = None;
    let mut optics = None;
    let mut read = Vec::new();
    if let Some(info) = info_of(&files) {
        let told = Info::read(&info)?;
        size = told.size;
        optics = told.optics;
        read.push(info);
    }

    let mut cameras = Vec::new();
    let mut untracked = 0;
    for (_, path) in files {
        read.push(path.clone());
        let Some(pose) = read_known_pose(&path)? else {
            untracked += 1;
            continue;
        };
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let name = file.strip_suffix(POSE).unwrap_or(&file).to_owned();
        let [jpeg, png] = PICTURES.map(|ending| path.with_file_name(format!("{name}{ending}")));
        let picture = if !jpeg.is_file() && png.is_file() { png } else { jpeg };
        let picture = Some(picture.into());
        cameras.push(PosedCamera { name, pose, size, optics, picture, mask: None, line: 0 });
    }

    // All pictures of a sequence are of one size.
    let first = cameras
        .iter()
        .filter_map(|camera| Some(camera.picture.as_ref()?.path.as_path()));
    if size.is_none()
        && let Some(picture) = first.into_iter().find(|picture| picture.is_file())
    {
        let (width, height) = read_picture_size(picture)?;
        cameras
            .iter_mut()
            .for_each(|camera| camera.size = Some([width, height]));
    }
    Ok((cameras, untracked, read))
}

/// Returns the file of intrinsics beside the poses that [`find`] found, if there is one.
pub(crate) fn info_of(files: &NumberedFiles) -> Option<PathBuf> {
    let (_, pose) = files.first()?;
    INFO.iter()
        .map(|name| pose.with_file_name(name))
        .find(|path| path.is_file())
}

/// What `_info.txt` tells of the pictures of both cameras.
#[derive(Default)]
pub(crate) struct Info {
    size: Option<[u32; 2]>,
    optics: Option<Optics>,
    pub(crate) depth_size: Option<[u32; 2]>,
    pub(crate) depth_optics: Option<Optics>,
    /// The value of a depth of one metre.
    pub(crate) depth_scale: Option<f64>,
}

impl Info {
    /// Reads lines `key = value`.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let bytes = read_file(path)?;
        let text = text_of(&bytes, path)?;
        let mut info = Self::default();
        // Widths and heights: of colour, of depth.
        let mut sides = [[None; 2]; 2];

        for (line, text) in (1u64..).zip(text.split(|&b| b == b'\n')) {
            let text = String::from_utf8_lossy(text);
            let Some((key, value)) = text.split_once('=') else { continue };
            let value = value.trim();
            let fault = |message: String| Error::line(path, line, message);
            let not_whole = || fault(format!("{} is no number of pixels", quote(value.as_bytes())));
            let side = || value.parse::<u32>().ok().filter(|side| *side > 0).ok_or_else(not_whole);
            match key.trim() {
                "m_colorWidth" => sides[0][0] = Some(side()?),
                "m_colorHeight" => sides[0][1] = Some(side()?),
                "m_depthWidth" => sides[1][0] = Some(side()?),
                "m_depthHeight" => sides[1][1] = Some(side()?),
                "m_depthShift" => {
                    let scale = value
                        .parse()
                        .ok()
                        .filter(|scale: &f64| *scale > 0.0 && scale.is_finite());
                    let no_scale = || fault(format!("{} is no scale of depth", quote(value.as_bytes())));
                    info.depth_scale = Some(scale.ok_or_else(no_scale)?);
                }
                "m_calibrationColorIntrinsic" => info.optics = Some(optics_of(value).map_err(fault)?),
                "m_calibrationDepthIntrinsic" => info.depth_optics = Some(optics_of(value).map_err(fault)?),
                _ => {}
            }
        }

        let [color, depth] = sides.map(|[width, height]| Some([width?, height?]));
        Ok(Self { size: color, depth_size: depth, ..info })
    }
}

/// Returns the optics of the numbers of a matrix. The error is a sentence.
fn optics_of(numbers: &str) -> std::result::Result<Optics, String> {
    let numbers: Option<Vec<f64>> = numbers
        .split_ascii_whitespace()
        .map(|word| word.parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    optics_of_matrix(&numbers.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{DVec3, dvec2};
    use std::fs;

    const INFO_TEXT: &str = "m_versionNumber = 4\nm_sensorName = Tango\nm_colorWidth = 960\n\
                             m_colorHeight = 540\nm_depthWidth = 224\n\
                             m_calibrationColorIntrinsic = 756.8 0 492.9 0 0 756.0 270.4 0 0 0 1 0 0 0 0 1 \n\
                             m_calibrationColorExtrinsic = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n\
                             m_frames.size = 3\n";

    /// Returns a scan with three frames. The pose of the second is not known.
    fn scan() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        let sequence = dir.path().join("sequence");
        fs::create_dir(&sequence).unwrap();
        let write = |name: &str, text: &str| fs::write(sequence.join(name), text).unwrap();
        write("_info.txt", INFO_TEXT);
        write("frame-000000.pose.txt", "1 0 0 4\n0 0 1 5\n0 -1 0 1.5\n0 0 0 1\n");
        write("frame-000001.pose.txt", &"-inf -inf -inf -inf\n".repeat(4));
        write("frame-000010.pose.txt", "1 0 0 4\n0 -1 0 5\n0 0 -1 1.5\n0 0 0 1\n");
        write("frame-000000.depth.pgm", "");
        dir
    }

    #[test]
    fn a_sequence_is_read_by_number_and_unknown_poses_are_counted() {
        let dir = scan();
        for path in [dir.path().to_owned(), dir.path().join("sequence")] {
            let (cameras, untracked, read) = read(find(&path).unwrap().unwrap()).unwrap();
            assert_eq!((cameras.len(), untracked, read.len()), (2, 1, 4));
            assert_eq!([&cameras[0].name, &cameras[1].name], ["frame-000000", "frame-000010"]);
            assert_eq!((cameras[0].pose.forward(), cameras[1].pose.forward()), (DVec3::Y, -DVec3::Z));
            assert_eq!(cameras[0].size, Some([960, 540]));
            assert!(
                cameras[0]
                    .picture
                    .as_ref()
                    .unwrap()
                    .path
                    .ends_with("sequence/frame-000000.color.jpg")
            );
            let Some(Optics::Pinhole { focal_px, center_px, .. }) = cameras[1].optics else { panic!() };
            assert_eq!((focal_px, center_px), (dvec2(756.8, 756.0), Some(dvec2(492.9, 270.4))));
        }
        assert!(find(&dir.path().join("sequence").join("gone")).unwrap().is_none());
    }

    #[test]
    fn intrinsics_may_be_missing() {
        let dir = scan();
        fs::remove_file(dir.path().join("sequence/_info.txt")).unwrap();
        crate::image::png::write_rgb8(
            &dir.path().join("sequence/frame-000000.color.png"),
            &s3d_geom::Raster::filled(13, 9, [1, 2, 3]),
            crate::image::png::Content::Photo,
            crate::image::compression::Compression::Fast,
        )
        .unwrap();
        let (cameras, ..) = read(find(dir.path()).unwrap().unwrap()).unwrap();
        assert_eq!((cameras[0].optics, cameras[1].size), (None, Some([13, 9])));
        assert!(
            cameras[0]
                .picture
                .as_ref()
                .unwrap()
                .path
                .ends_with("frame-000000.color.png")
        );
    }

    #[test]
    fn faults_name_their_file() {
        let dir = scan();
        for (from, to, words) in [
            ("756.8 0 492.9", "756.8 1 492.9", "line 6: is no matrix of intrinsics"),
            ("756.8 0 492.9", "x 0 492.9", "line 6: is no matrix of intrinsics"),
            ("756.8 0", "-756.8 0", "line 6: focal lengths of -756.8"),
            ("= 960", "= 0", "line 3: `0` is no number of pixels"),
        ] {
            fs::write(dir.path().join("sequence/_info.txt"), INFO_TEXT.replace(from, to)).unwrap();
            let message = read(find(dir.path()).unwrap().unwrap()).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("_info.txt"), "{message}");
        }
        fs::write(dir.path().join("sequence/_info.txt"), INFO_TEXT).unwrap();
        fs::write(dir.path().join("sequence/frame-000010.pose.txt"), "1 0 0 4\n").unwrap();
        let message = read(find(dir.path()).unwrap().unwrap()).unwrap_err().to_string();
        assert!(message.contains("frame-000010.pose.txt, line 1: 4 numbers"), "{message}");
    }
}
