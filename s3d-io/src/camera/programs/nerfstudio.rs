//! The pictures of a `transforms.json`, as nerfstudio, Polycam, Record3D and instant-ngp write it. Source:
//! nerfstudio's documentation, "Data conventions".
//!
//! A frame's `transform_matrix` is camera → world, 4 × 4, in OpenGL's axes: x right, y up, z backwards.
//! The camera's intrinsics stand in each frame, or once for all frames.

use crate::camera::posed::{Distortion, Optics, PosedCamera};
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use s3d_geom::Pose;
use s3d_geom::glam::{DVec2, DVec3, dvec2};
use serde::Deserialize;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

const IDENTITY: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

#[derive(Deserialize)]
struct Document {
    frames: Vec<FrameEntry>,
    #[serde(flatten)]
    camera: CameraKeys,
    /// The rotation and shift that were applied to the cameras, followed by `applied_scale`.
    applied_transform: Option<Vec<Vec<f64>>>,
    applied_scale: Option<f64>,
    /// How many units of the world a step of the numbers in depth pictures is.
    depth_unit_scale_factor: Option<f64>,
    /// The offset that had been subtracted from the mesh's coordinates when its images were rendered.
    world_offset_m: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct FrameEntry {
    file_path: String,
    transform_matrix: Vec<Vec<f64>>,
    mask_path: Option<String>,
    depth_file_path: Option<String>,
    /// ScanNet++ marks blurred pictures, and those whose pose failed.
    #[serde(default)]
    is_bad: bool,
    #[serde(flatten)]
    camera: CameraKeys,
}

/// The keys that describe a camera.
#[derive(Default, Deserialize)]
struct CameraKeys {
    camera_model: Option<String>,
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

/// Reads the pictures of a `transforms.json` and their poses. The matrices of a world in other units have a
/// scale, which is dropped.
pub(crate) fn read(path: &Path) -> Result<Vec<PosedCamera>> {
    let Document { frames, .. } = read_json(path)?;
    let mut pictures = Vec::with_capacity(frames.len());
    for (i, FrameEntry { file_path: name, transform_matrix, .. }) in frames.into_iter().enumerate() {
        let pose = square(&transform_matrix)
            .and_then(|rows| Pose::from_opengl(unscaled(rows)).map_err(|e| e.to_string()))
            .map_err(|message| at_frame(path, i, &name, &format!("transform_matrix: {message}")))?;
        pictures.push(PosedCamera::new(name, pose));
    }
    Ok(pictures)
}

/// Reads the cameras of a `transforms.json`, and how many more are marked as bad. Their poses are in the
/// frame before its `applied_transform`.
pub(crate) fn read_posed(path: &Path) -> Result<(Vec<PosedCamera>, usize)> {
    let DepthFrames { frames, bad, .. } = read_depth(path)?;
    Ok((frames.into_iter().map(|(camera, _)| camera).collect(), bad))
}

/// The frames of a list, with their depth.
pub(crate) struct DepthFrames {
    /// Each camera, and its depth picture if the list names one.
    pub(crate) frames: Vec<(PosedCamera, Option<PathBuf>)>,
    /// The number of frames that are marked as bad.
    pub(crate) bad: usize,
    /// How many metres a step of the numbers in depth pictures is, if the list says it.
    #[cfg_attr(not(feature = "raw"), allow(dead_code))]
    pub(crate) unit: Option<f64>,
}

/// Reads like [`read_posed`], with the depth of the frames.
pub(crate) fn read_depth(path: &Path) -> Result<DepthFrames> {
    let document: Document = read_json(path)?;
    let applied = Applied::new(&document, path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let unit = document.depth_unit_scale_factor;
    if let Some(unit) = unit.filter(|unit| !(*unit > 0.0 && unit.is_finite())) {
        return Err(Error::format(path, format!("depth_unit_scale_factor: {unit} is no scale")));
    }
    let unit = unit.map(|unit| unit / applied.scale);

    let mut frames = Vec::with_capacity(document.frames.len());
    let mut bad = 0;
    for (i, frame) in document.frames.into_iter().enumerate() {
        let FrameEntry { file_path: name, transform_matrix, mask_path, depth_file_path, is_bad, camera } =
            frame;
        if is_bad {
            bad += 1;
            continue;
        }

        let fault = |message: String| at_frame(path, i, &name, &message);
        let rows = square(&transform_matrix).map_err(|m| fault(format!("transform_matrix: {m}")))?;
        let pose = Pose::from_opengl(rows).map_err(|e| fault(format!("transform_matrix: {e}")))?;
        let keys = camera.or(&document.camera);
        let size = keys.size().map_err(fault)?;
        let optics = keys.optics().map_err(fault)?;
        let pose = applied.undo(pose);

        let picture = Some(folder.join(&name).into());
        let mask = mask_path.map(|mask| folder.join(mask));
        let depth = depth_file_path.map(|depth| folder.join(depth));
        frames.push((PosedCamera { name, pose, size, optics, picture, mask, line: 0 }, depth));
    }
    Ok(DepthFrames { frames, bad, unit })
}

fn at_frame(path: &Path, i: usize, name: &str, message: &str) -> Error {
    Error::format(path, format!("frames[{i}], {name:?}: {message}"))
}

/// What the writer of a file did to its world: turned, shifted and scaled it, after an offset was subtracted.
struct Applied {
    pose: Pose,
    scale: f64,
    offset_m: DVec3,
    /// Whether anything was done.
    is_moved: bool,
}

impl Applied {
    fn new(document: &Document, path: &Path) -> Result<Self> {
        let fault = |key: &str, message: String| Error::format(path, format!("{key}: {message}"));
        let rows = match &document.applied_transform {
            None => IDENTITY,
            Some(rows) => square(rows).map_err(|m| fault("applied_transform", m))?,
        };
        let pose = Pose::from_opengl(rows).map_err(|e| fault("applied_transform", e.to_string()))?;

        let scale = document.applied_scale.unwrap_or(1.0);
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(fault("applied_scale", format!("{scale} is no scale")));
        }
        let offset_m = document.world_offset_m.map_or(DVec3::ZERO, DVec3::from_array);
        let is_moved = document.applied_transform.is_some() || scale != 1.0 || offset_m != DVec3::ZERO;
        Ok(Self { pose, scale, offset_m, is_moved })
    }

    /// Returns a pose in the world as it was before. A world that was not moved keeps its last digits.
    fn undo(&self, pose: Pose) -> Pose {
        if !self.is_moved {
            return pose;
        }
        let turn = self.pose.world_from_camera.transpose();
        Pose {
            location: turn * (pose.location / self.scale - self.pose.location) + self.offset_m,
            world_from_camera: turn * pose.world_from_camera,
        }
    }
}

/// Returns a matrix of 4 × 4 numbers, from its rows or from the first three. The error is a sentence.
fn square(rows: &[Vec<f64>]) -> std::result::Result<[[f64; 4]; 4], String> {
    let full = rows
        .iter()
        .map(|row| <[f64; 4]>::try_from(row.as_slice()).ok())
        .collect::<Option<Vec<_>>>();
    match full.as_deref() {
        Some(&[x, y, z]) => Ok([x, y, z, [0.0, 0.0, 0.0, 1.0]]),
        Some(&[x, y, z, w]) => Ok([x, y, z, w]),
        _ => Err("is no matrix of 4 × 4 or 3 × 4 numbers".into()),
    }
}

/// Returns the matrix with axes of length 1, if all axes have the same length.
fn unscaled(rows: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
    let [[a, ..], [b, ..], [c, ..], _] = rows;
    let length = DVec3::new(a, b, c).length();
    let [x, y, z, last] = rows;
    let row = |[a, b, c, place]: [f64; 4]| [a / length, b / length, c / length, place];
    [row(x), row(y), row(z), last]
}

impl CameraKeys {
    /// Returns the keys of a frame. Keys that it does not have are taken from `shared`.
    fn or(self, shared: &Self) -> Self {
        Self {
            camera_model: self.camera_model.or_else(|| shared.camera_model.clone()),
            w: self.w.or(shared.w),
            h: self.h.or(shared.h),
            fl_x: self.fl_x.or(shared.fl_x),
            fl_y: self.fl_y.or(shared.fl_y),
            cx: self.cx.or(shared.cx),
            cy: self.cy.or(shared.cy),
            camera_angle_x: self.camera_angle_x.or(shared.camera_angle_x),
            camera_angle_y: self.camera_angle_y.or(shared.camera_angle_y),
            k1: self.k1.or(shared.k1),
            k2: self.k2.or(shared.k2),
            k3: self.k3.or(shared.k3),
            k4: self.k4.or(shared.k4),
            p1: self.p1.or(shared.p1),
            p2: self.p2.or(shared.p2),
        }
    }

    /// Returns the width and height of the pictures, pixels; `None` if the keys do not tell. The error is a
    /// sentence.
    fn size(&self) -> std::result::Result<Option<[u32; 2]>, String> {
        let (Some(w), Some(h)) = (self.w, self.h) else { return Ok(None) };
        match (side(w), side(h)) {
            (Some(w), Some(h)) => Ok(Some([w, h])),
            _ => Err(format!("a picture of {w} × {h} pixels")),
        }
    }

    /// Returns how directions become pixels; `None` if the keys do not tell. The error is a sentence.
    fn optics(&self) -> std::result::Result<Option<Optics>, String> {
        if self.camera_model.as_deref() == Some("EQUIRECTANGULAR") {
            return Ok(Some(Optics::Equirectangular));
        }
        let distortion = self.distortion()?;
        let angles = [self.camera_angle_x, self.camera_angle_y];
        if let Some(angle) = angles
            .into_iter()
            .flatten()
            .find(|angle| !(*angle > 0.0 && *angle < PI))
        {
            return Err(format!("an angle of view of {angle} rad: it must be between 0 and π"));
        }

        // One focal length stands for both, and an angle of view for a focal length.
        let fx = self.fl_x.or_else(|| focal_length(self.w, self.camera_angle_x));
        let fy = self.fl_y.or_else(|| focal_length(self.h, self.camera_angle_y));
        let (Some(fx), Some(fy)) = (fx.or(fy), fy.or(fx)) else {
            return Ok(self.camera_angle_x.map(|fov_rad| Optics::AngleOfView { fov_rad }));
        };
        if ![fx, fy].iter().all(|f| *f > 0.0 && f.is_finite()) {
            return Err(format!("focal lengths of {fx} and {fy} px: both must be above 0"));
        }

        let cx = self.cx.or(self.w.map(|w| 0.5 * w));
        let cy = self.cy.or(self.h.map(|h| 0.5 * h));
        let center_px: Option<DVec2> = cx.zip(cy).map(|(cx, cy)| dvec2(cx, cy));
        Ok(Some(Optics::Pinhole { focal_px: dvec2(fx, fy), center_px, distortion }))
    }

    fn distortion(&self) -> std::result::Result<Distortion, String> {
        let [k1, k2, k3, k4, p1, p2] =
            [self.k1, self.k2, self.k3, self.k4, self.p1, self.p2].map(|k| k.unwrap_or(0.0));
        match self.camera_model.as_deref() {
            Some("OPENCV_FISHEYE") => Ok(Distortion::Fisheye([k1, k2, k3, k4])),
            None | Some("OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL") => {
                if k4 != 0.0 {
                    return Err(format!(
                        "k4 is {k4}: OPENCV cameras are supported with k1, k2, k3, p1 and p2 alone"
                    ));
                }
                Ok(Distortion::opencv([k1, k2, p1, p2, k3]))
            }
            Some(other) => Err(format!(
                "the camera_model {other:?} is not supported: OPENCV, OPENCV_FISHEYE, PINHOLE and \
                 EQUIRECTANGULAR are"
            )),
        }
    }
}

/// Returns the side of a picture in pixels, if the number is one.
fn side(number: f64) -> Option<u32> {
    (number.fract() == 0.0 && (1.0..=1e9).contains(&number)).then_some(number as u32)
}

/// Returns the focal length of an angle of view that spans `size` pixels.
fn focal_length(size: Option<f64>, angle_rad: Option<f64>) -> Option<f64> {
    size.zip(angle_rad)
        .map(|(size, angle_rad)| 0.5 * size / libm::tan(0.5 * angle_rad))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{DMat3, DQuat};

    fn rows(pose: &Pose) -> String {
        let m = pose.world_from_camera;
        let row = |i: usize| {
            format!("[{:.7}, {:.7}, {:.7}, {:.7}]", m.x_axis[i], m.y_axis[i], m.z_axis[i], pose.location[i])
        };
        format!("[{}, {}, {}, [0, 0, 0, 1]]", row(0), row(1), row(2))
    }

    fn read_text(text: &str) -> Result<Vec<PosedCamera>> {
        read_with(text, read)
    }

    fn posed(text: &str) -> Result<Vec<PosedCamera>> {
        read_with(text, |path| read_posed(path).map(|(cameras, _)| cameras))
    }

    fn read_with(text: &str, read: fn(&Path) -> Result<Vec<PosedCamera>>) -> Result<Vec<PosedCamera>> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("transforms.json");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    fn document(matrix: &str) -> String {
        let frame = format!(r#"{{"file_path": "images/a.png", "transform_matrix": {matrix}}}"#);
        format!(r#"{{"fl_x": 500, "camera_model": "OPENCV", "frames": [{frame}]}}"#)
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
            ("[[1,0,0,0],[0,1,0,0],[0,0,-1,0]]", "mirrors"),
            ("[[1,0.1,0,0],[0,1,0,0],[0,0,1,0]]", "is no rotation"),
            ("[[0,0,0,0],[0,0,0,0],[0,0,0,0]]", "transform_matrix: "),
            ("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[4,5,6,1]]", "is transposed"),
        ] {
            let message = read_text(&document(matrix)).err().unwrap().to_string();
            assert!(message.contains(words), "{matrix}: {message}");
        }
        assert!(
            read_text("{}")
                .err()
                .unwrap()
                .to_string()
                .contains("missing field `frames`")
        );
    }

    #[test]
    fn a_world_in_other_units_has_locations_but_no_cameras() {
        let text = document("[[2,0,0,4],[0,2,0,5],[0,0,2,6]]");
        assert_eq!(read_text(&text).unwrap()[0].pose.location, DVec3::new(4.0, 5.0, 6.0));
        let message = posed(&text).unwrap_err().to_string();
        assert!(message.contains("2 long instead of 1"), "{message}");
    }

    const FRAME: &str =
        r#""file_path": "images/a.png", "transform_matrix": [[1,0,0,4],[0,0,-1,5],[0,1,0,6],[0,0,0,1]]"#;

    fn pinhole(focal: [f64; 2], distortion: Distortion) -> Option<Optics> {
        Some(Optics::Pinhole { focal_px: focal.into(), center_px: Some(dvec2(320.0, 241.0)), distortion })
    }

    #[test]
    fn intrinsics_are_shared_or_the_frames_own() {
        let text = format!(
            r#"{{"camera_model": "OPENCV", "w": 640.0, "h": 480,
            "fl_x": 500, "fl_y": 510, "cx": 320, "cy": 241, "k1": 0.1, "p2": 0.2,
            "frames": [{{{FRAME}}}, {{{FRAME}, "fl_x": 400, "w": 320, "k1": 0, "p2": 0}},
            {{{FRAME}, "camera_model": "OPENCV_FISHEYE", "k4": 0.4}}]}}"#
        );
        let cameras = posed(&text).unwrap();
        assert_eq!(cameras[0].optics, pinhole([500.0, 510.0], Distortion::OpenCv([0.1, 0.0, 0.0, 0.2, 0.0])));
        assert_eq!(cameras[1].optics, pinhole([400.0, 510.0], Distortion::None));
        assert_eq!(cameras[2].optics, pinhole([500.0, 510.0], Distortion::Fisheye([0.1, 0.0, 0.0, 0.4])));
        assert_eq!([cameras[0].size, cameras[1].size], [Some([640, 480]), Some([320, 480])]);
        assert!(cameras[0].picture.as_ref().unwrap().path.ends_with("images/a.png"));
        assert_eq!(
            (cameras[0].pose.location, cameras[0].pose.forward()),
            (DVec3::new(4.0, 5.0, 6.0), DVec3::Y)
        );
    }

    #[test]
    fn angles_are_as_good_as_focal_lengths() {
        let keys =
            |keys: &str| posed(&format!(r#"{{{keys} "frames": [{{{FRAME}}}]}}"#)).map(|c| c[0].clone());
        let camera = keys(r#""w": 200, "h": 100, "camera_angle_x": 1.5707963267948966,"#).unwrap();
        let Some(Optics::Pinhole { focal_px, center_px, .. }) = camera.optics else { panic!() };
        assert!(focal_px.abs_diff_eq(dvec2(100.0, 100.0), 1e-9) && center_px == Some(dvec2(100.0, 50.0)));
        let camera = keys(r#""camera_angle_x": 1.5,"#).unwrap();
        assert_eq!((camera.size, camera.optics), (None, Some(Optics::AngleOfView { fov_rad: 1.5 })));
        assert_eq!(keys("").unwrap().optics, None);
        let panorama = keys(r#""camera_model": "EQUIRECTANGULAR", "w": 8, "h": 4,"#).unwrap();
        assert_eq!(panorama.optics, Some(Optics::Equirectangular));

        for (text, words) in [
            (r#""camera_model": "ORTHOPHOTO","#, "the camera_model \"ORTHOPHOTO\" is not supported"),
            (r#""w": 10.5, "h": 4,"#, "a picture of 10.5 × 4"),
            (r#""fl_x": -3,"#, "focal lengths of -3"),
            (r#""camera_angle_x": 3.5,"#, "an angle of view of 3.5"),
            (r#""fl_x": 3, "k4": 1,"#, "k4 is 1"),
            (r#""applied_transform": [[1,0],[0,1]],"#, "applied_transform: is no matrix"),
            (
                r#""applied_transform": [[1,0,0,0],[0,1,0,0],[0,0,-1,0]],"#,
                "applied_transform: the matrix mirrors",
            ),
            (r#""applied_scale": 0,"#, "applied_scale: 0 is no scale"),
        ] {
            let message = keys(text).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }

    #[test]
    fn what_was_applied_to_a_world_is_undone() {
        // nerfstudio turns COLMAP's worlds by this: x, z, −y; then it scales.
        let keys = r#""applied_transform": [[1,0,0,1],[0,0,1,2],[0,-1,0,3]], "applied_scale": 0.5,"#;
        let text = format!(r#"{{{keys} "world_offset_m": [100, 0, 0], "frames": [{{{FRAME}}}]}}"#);
        let pose = posed(&text).unwrap()[0].pose;
        // (4, 5, 6) / 0.5 − (1, 2, 3) = (7, 8, 9) = (x, z, −y).
        assert!(pose.location.abs_diff_eq(DVec3::new(107.0, -9.0, 8.0), 1e-12), "{}", pose.location);
        assert!(pose.forward().abs_diff_eq(DVec3::Z, 1e-12), "{}", pose.forward());
    }
}
