//! The photographs in the raw data of a Polycam capture: `keyframes/corrected_images/N.jpg` and
//! `keyframes/corrected_cameras/N.json`, or `images` and `cameras` if the capture was not optimized. Source:
//! Polycam's polyform, README, "Polycam's data format".
//!
//! A file of `cameras` has fx, fy, cx, cy, width, height and the first three rows of camera → world, t_00
//! to t_23, in ARKit's axes: the world's +Y points up, the camera looks along its −Z.

use crate::camera::numbered::numbered_files;
use crate::camera::posed::{Distortion, Optics, PosedCamera};
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use s3d_geom::Pose;
use s3d_geom::glam::{DMat3, DVec3, dvec2};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The folders of cameras and of their photographs, the better ones first.
const FOLDERS: [(&str, &str); 2] = [("corrected_cameras", "corrected_images"), ("cameras", "images")];

#[derive(Deserialize)]
struct Keyframe {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    width: u32,
    height: u32,
    t_00: f64,
    t_01: f64,
    t_02: f64,
    t_03: f64,
    t_10: f64,
    t_11: f64,
    t_12: f64,
    t_13: f64,
    t_20: f64,
    t_21: f64,
    t_22: f64,
    t_23: f64,
}

/// The transform that Polycam applied to the mesh and not to the cameras, column by column.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct MeshInfo {
    alignment_transform: Option<Vec<f64>>,
}

/// Returns the files of a capture's cameras, sorted by number, and the folder of their photographs. `dir` is
/// the folder of the capture, or its folder `keyframes`.
pub(crate) fn find(dir: &Path) -> Result<Option<(Vec<PathBuf>, PathBuf)>> {
    for keyframes in [dir.join("keyframes"), dir.to_owned()] {
        for (cameras, images) in FOLDERS {
            let folder = keyframes.join(cameras);
            let images = keyframes.join(images);
            if !folder.is_dir() || !images.is_dir() {
                continue;
            }

            let files = numbered_files(&folder, "json")?;
            if !files.is_empty() {
                return Ok(Some((files.into_iter().map(|(_, path)| path).collect(), images)));
            }
        }
    }
    Ok(None)
}

/// Reads the cameras that [`find`] found, in the frame of the capture's mesh turned Z-up. Also returns the
/// files that were read.
pub(crate) fn read(files: Vec<PathBuf>, images: &Path) -> Result<(Vec<PosedCamera>, Vec<PathBuf>)> {
    let info = images.join("../../mesh_info.json");
    let aligned = if info.is_file() { alignment(&info)? } else { None };
    // Takes (x, y, z) to (x, −z, y).
    let z_up = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);

    let mut cameras = Vec::with_capacity(files.len());
    for path in &files {
        let keyframe: Keyframe = read_json(path)?;
        let mut camera = keyframe.camera(path, images)?;
        let pose = &mut camera.pose;
        if let Some(by) = &aligned {
            pose.location = by.world_from_camera * pose.location + by.location;
            pose.world_from_camera = by.world_from_camera * pose.world_from_camera;
        }
        pose.location = z_up * pose.location;
        pose.world_from_camera = z_up * pose.world_from_camera;
        cameras.push(camera);
    }

    let info = aligned.is_some().then_some(info);
    Ok((cameras, files.into_iter().chain(info).collect()))
}

impl Keyframe {
    /// Returns the camera of the file `path`, in ARKit's axes.
    fn camera(&self, path: &Path, images: &Path) -> Result<PosedCamera> {
        let rows = [
            [self.t_00, self.t_01, self.t_02, self.t_03],
            [self.t_10, self.t_11, self.t_12, self.t_13],
            [self.t_20, self.t_21, self.t_22, self.t_23],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let pose = Pose::from_opengl(rows).map_err(|e| Error::format(path, e.to_string()))?;

        let Self { fx, fy, cx, cy, .. } = *self;
        let are_focal = [fx, fy].iter().all(|f| *f > 0.0 && f.is_finite());
        if !are_focal || !cx.is_finite() || !cy.is_finite() {
            let message = format!("focal lengths of {fx} and {fy} px, centre ({cx}, {cy})");
            return Err(Error::format(path, message));
        }
        let optics = Optics::Pinhole {
            focal_px: dvec2(fx, fy),
            center_px: Some(dvec2(cx, cy)),
            distortion: Distortion::None,
        };

        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let jpeg = images.join(format!("{name}.jpg"));
        let png = images.join(format!("{name}.png"));
        let picture = if !jpeg.is_file() && png.is_file() { png } else { jpeg };
        Ok(PosedCamera {
            name,
            pose,
            size: Some([self.width, self.height]),
            optics: Some(optics),
            picture: Some(picture.into()),
            mask: None,
            line: 0,
        })
    }
}

/// Returns the transform from the cameras' frame to the mesh's, if the file has one.
fn alignment(path: &Path) -> Result<Option<Pose>> {
    let MeshInfo { alignment_transform } = read_json(path)?;
    let Some(columns) = alignment_transform else { return Ok(None) };
    let fault = |message: String| Error::format(path, format!("alignmentTransform: {message}"));
    let Ok([a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3, d0, d1, d2, d3]) = <[f64; 16]>::try_from(columns)
    else {
        return Err(fault("is no matrix of 16 numbers".into()));
    };
    let rows = [[a0, b0, c0, d0], [a1, b1, c1, d1], [a2, b2, c2, d2], [a3, b3, c3, d3]];
    Pose::from_opengl(rows).map(Some).map_err(|e| fault(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::dvec3;
    use std::fs;

    /// A keyframe at (1, 2, 3) of ARKit's world that looks along its −Z.
    const KEYFRAME: &str = r#"{"fx": 700.5, "fy": 701.5, "cx": 510.25, "cy": 384.5,
        "width": 1024, "height": 768,
        "t_00": 1, "t_01": 0, "t_02": 0, "t_03": 1, "t_10": 0, "t_11": 1, "t_12": 0, "t_13": 2,
        "t_20": 0, "t_21": 0, "t_22": 1, "t_23": 3, "blur_score": 99.5, "timestamp": 7}"#;

    fn capture(folders: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for folder in folders {
            fs::create_dir_all(dir.path().join("keyframes").join(folder)).unwrap();
            if folder.ends_with("cameras") {
                for name in ["10.json", "9.json", "notes.json"] {
                    fs::write(dir.path().join("keyframes").join(folder).join(name), KEYFRAME).unwrap();
                }
            }
        }
        dir
    }

    #[test]
    fn keyframes_are_read_by_number_and_turned_z_up() {
        let dir = capture(&["cameras", "images", "corrected_cameras", "corrected_images"]);
        for path in [dir.path().to_owned(), dir.path().join("keyframes")] {
            let (files, images) = find(&path).unwrap().unwrap();
            assert!(images.ends_with("corrected_images"));
            let (cameras, read) = read(files, &images).unwrap();
            assert_eq!((cameras.len(), read.len()), (2, 2));
            assert_eq!((cameras[0].name.as_str(), cameras[1].name.as_str()), ("9", "10"));
            let PosedCamera { pose, size, optics, picture, .. } = &cameras[0];
            // Y-up (x, y, z) is Z-up (x, −z, y); −Z becomes +Y.
            assert_eq!(
                (pose.location, pose.forward(), pose.up()),
                (dvec3(1.0, -3.0, 2.0), DVec3::Y, DVec3::Z)
            );
            assert!(
                picture.as_ref().unwrap().path.ends_with("corrected_images/9.jpg")
                    && *size == Some([1024, 768])
            );
            let Some(Optics::Pinhole { focal_px, center_px, distortion }) = optics else { panic!() };
            assert_eq!((*focal_px, center_px.unwrap()), (dvec2(700.5, 701.5), dvec2(510.25, 384.5)));
            assert_eq!(*distortion, Distortion::None);
        }

        // A capture that was not optimized has the other two alone.
        let plain = capture(&["cameras", "images"]);
        assert!(find(plain.path()).unwrap().unwrap().1.ends_with("keyframes/images"));
        assert!(find(capture(&["cameras"]).path()).unwrap().is_none());
    }

    #[test]
    fn cameras_go_where_the_mesh_was_aligned_to() {
        let dir = capture(&["cameras", "images"]);
        // A quarter turn around +Y and a shift, column by column.
        let write = |text: &str| fs::write(dir.path().join("mesh_info.json"), text).unwrap();
        write(
            r#"{"alignmentTransform": [0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 10, 20, 30, 1], "faceCount": 5}"#,
        );
        let cameras = || {
            let (files, images) = find(dir.path()).unwrap().unwrap();
            read(files, &images)
        };
        let (found, files) = cameras().unwrap();
        // (1, 2, 3) → (3, 2, −1) + (10, 20, 30) = (13, 22, 29), Y-up; −Z → −X.
        assert_eq!(found[0].pose.location, dvec3(13.0, -29.0, 22.0));
        assert_eq!((found[0].pose.forward(), files.len()), (-DVec3::X, 3));

        write(r#"{"faceCount": 5}"#);
        assert_eq!(cameras().unwrap().0[0].pose.location, dvec3(1.0, -3.0, 2.0));
        for (text, words) in [
            ("{\"alignmentTransform\": [1, 2]}", "is no matrix of 16 numbers"),
            ("{\"alignmentTransform\": [2,0,0,0, 0,2,0,0, 0,0,2,0, 0,0,0,1]}", "alignmentTransform: "),
        ] {
            write(text);
            let message = cameras().unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("mesh_info.json"), "{message}");
        }
    }

    #[test]
    fn faults_name_their_file() {
        let dir = capture(&["cameras", "images"]);
        for (from, to, words) in [
            ("\"t_22\": 1", "\"t_22\": -1", "mirrors"),
            ("\"fx\": 700.5", "\"fx\": 0", "focal lengths of 0"),
            ("\"fy\": 701.5,", "", "missing field `fy`"),
        ] {
            fs::write(dir.path().join("keyframes/cameras/9.json"), KEYFRAME.replace(from, to)).unwrap();
            let (files, images) = find(dir.path()).unwrap().unwrap();
            let message = read(files, &images).unwrap_err().to_string();
            assert!(message.contains("9.json") && message.contains(words), "{message}");
        }
    }
}
