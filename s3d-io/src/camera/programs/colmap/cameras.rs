//! The cameras of a COLMAP model: `cameras.txt` or `cameras.bin`. Source: COLMAP's documentation, "Output
//! Format" and "Camera Models"; for models after the first twelve, colmap/colmap, src/colmap/sensor/models.h.
//!
//! An `EQUIRECTANGULAR` camera has its width and height as parameters. Its columns are azimuths that grow to
//! the right, and its centre column looks along the camera's forward axis, as in our panoramas.

use crate::camera::posed::{Distortion, Optics};
use crate::camera::programs::colmap::take;
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use crate::fs::quote::quote;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The size (width, height, pixels) and the optics of a camera.
pub(crate) type Intrinsics = ([u32; 2], Optics);

/// The camera models of COLMAP, in the order of their numbers: the name, and the number of parameters.
const MODELS: [(&str, usize); 18] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
    ("SIMPLE_DIVISION", 4),
    ("DIVISION", 5),
    ("SIMPLE_FISHEYE", 3),
    ("FISHEYE", 4),
    ("EUCM", 6),
    ("EQUIRECTANGULAR", 2),
];

/// The name that `EQUIRECTANGULAR` had before COLMAP took it.
const EARLIER_PANORAMA: &str = "SPHERICAL";

/// Returns the list of cameras beside a list of images, and its cameras by their numbers.
pub(crate) fn read_beside(images: &Path) -> Result<(PathBuf, HashMap<u32, Intrinsics>)> {
    let is_binary = images.extension().is_some_and(|e| e.eq_ignore_ascii_case("bin"));
    let path = images.with_file_name(if is_binary { "cameras.bin" } else { "cameras.txt" });
    let bytes = read_file(&path)?;
    let cameras = if is_binary {
        read_binary(&path, &bytes)
    } else {
        read_text(&path, &text_of(&bytes, &path)?)
    }?;
    Ok((path, cameras))
}

fn read_text(path: &Path, bytes: &[u8]) -> Result<HashMap<u32, Intrinsics>> {
    const FORM: &str = "a camera is CAMERA_ID MODEL WIDTH HEIGHT and its parameters";
    let mut cameras = HashMap::new();
    for (line, text) in (1u64..).zip(bytes.split(|&b| b == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }

        let fault = |message: String| Error::line(path, line, message);
        let words = std::str::from_utf8(text).map_err(|_| fault("is no text in UTF-8".into()))?;
        let mut words = words.split_ascii_whitespace();
        let mut next = || words.next().ok_or_else(|| fault(format!("{}: {FORM}", quote(text))));
        let [id, model, width, height] = [next()?, next()?, next()?, next()?];
        let whole = |word: &str| word.parse::<u32>().map_err(|_| fault(format!("{word:?}: {FORM}")));
        let id = whole(id)?;
        let size = [whole(width)?, whole(height)?];
        let numbers: Vec<f64> = words
            .map(|word| {
                word.parse()
                    .map_err(|_| fault(format!("{word:?} is no number: {FORM}")))
            })
            .collect::<Result<_>>()?;

        let intrinsics = intrinsics(model, size, &numbers).map_err(fault)?;
        if cameras.insert(id, intrinsics).is_some() {
            return Err(fault(format!("there is a camera {id} already")));
        }
    }
    Ok(cameras)
}

/// Reads the binary form, little-endian: a count, then for each camera its number (4 bytes), the number of
/// its model (4), width and height (8 each) and the parameters (8 each).
fn read_binary(path: &Path, bytes: &[u8]) -> Result<HashMap<u32, Intrinsics>> {
    let mut rest = bytes;
    let mut cameras = HashMap::new();
    let count = u64::from_le_bytes(take(&mut rest).ok_or_else(|| cut_off(path, 0))?);
    for n in 1..=count {
        let (id, model, size) = take_head(&mut rest).ok_or_else(|| cut_off(path, n))?;
        let fault = |message: String| Error::format(path, format!("camera {id}: {message}"));
        let (model, parameters) = *usize::try_from(model)
            .ok()
            .and_then(|model| MODELS.get(model))
            .ok_or_else(|| fault(format!("its model has the number {model}, which is none of COLMAP's")))?;

        let mut numbers = Vec::with_capacity(parameters);
        for _ in 0..parameters {
            numbers.push(f64::from_le_bytes(take(&mut rest).ok_or_else(|| cut_off(path, n))?));
        }
        // A side that does not fit is as wrong as 0.
        let size = size.map(|side| u32::try_from(side).unwrap_or(0));
        let intrinsics = intrinsics(model, size, &numbers).map_err(fault)?;

        if cameras.insert(id, intrinsics).is_some() {
            return Err(fault("there is one of this number already".into()));
        }
    }
    Ok(cameras)
}

/// Takes the number of the next camera, the number of its model, and its width and height. Returns `None` if
/// the bytes end before.
fn take_head(rest: &mut &[u8]) -> Option<(u32, u32, [u64; 2])> {
    let id = u32::from_le_bytes(take(rest)?);
    let model = u32::from_le_bytes(take(rest)?);
    let size = [take(rest)?, take(rest)?].map(u64::from_le_bytes);
    Some((id, model, size))
}

fn cut_off(path: &Path, camera: u64) -> Error {
    Error::format(path, format!("ends in camera {camera}: it was cut off, or is no cameras.bin"))
}

/// Returns the size and the optics of a camera, from its model and parameters. The error is a sentence.
fn intrinsics(model: &str, size: [u32; 2], numbers: &[f64]) -> std::result::Result<Intrinsics, String> {
    let [width, height] = size;
    if width == 0 || height == 0 {
        return Err(format!("a picture of {width} × {height} pixels"));
    }

    let model = if model == EARLIER_PANORAMA {
        "EQUIRECTANGULAR"
    } else {
        model
    };
    let known = MODELS.iter().find(|(name, _)| *name == model);
    let (_, count) =
        known.ok_or_else(|| format!("{} is no camera model of COLMAP", quote(model.as_bytes())))?;
    if numbers.len() != *count {
        return Err(format!("{model} has {count} parameters, not {}", numbers.len()));
    }
    if !numbers.iter().all(|v| v.is_finite()) {
        return Err(format!("a parameter of {model} is not finite"));
    }

    let optics = match (model, numbers) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => pinhole([f, f], [cx, cy], Distortion::None),
        ("PINHOLE", &[fx, fy, cx, cy]) => pinhole([fx, fy], [cx, cy], Distortion::None),
        ("SIMPLE_RADIAL", &[f, cx, cy, k]) => {
            pinhole([f, f], [cx, cy], Distortion::opencv([k, 0.0, 0.0, 0.0, 0.0]))
        }
        ("RADIAL", &[f, cx, cy, k1, k2]) => {
            pinhole([f, f], [cx, cy], Distortion::opencv([k1, k2, 0.0, 0.0, 0.0]))
        }
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => {
            pinhole([fx, fy], [cx, cy], Distortion::opencv([k1, k2, p1, p2, 0.0]))
        }
        ("OPENCV_FISHEYE", &[fx, fy, cx, cy, k1, k2, k3, k4]) => {
            pinhole([fx, fy], [cx, cy], Distortion::Fisheye([k1, k2, k3, k4]))
        }
        ("SIMPLE_RADIAL_FISHEYE", &[f, cx, cy, k]) => {
            pinhole([f, f], [cx, cy], Distortion::Fisheye([k, 0.0, 0.0, 0.0]))
        }
        ("RADIAL_FISHEYE", &[f, cx, cy, k1, k2]) => {
            pinhole([f, f], [cx, cy], Distortion::Fisheye([k1, k2, 0.0, 0.0]))
        }
        ("SIMPLE_FISHEYE", &[f, cx, cy]) => pinhole([f, f], [cx, cy], Distortion::Fisheye([0.0; 4])),
        ("FISHEYE", &[fx, fy, cx, cy]) => pinhole([fx, fy], [cx, cy], Distortion::Fisheye([0.0; 4])),
        ("EQUIRECTANGULAR", &[w, h]) if [w, h] == size.map(f64::from) => Optics::Equirectangular,
        ("EQUIRECTANGULAR", &[w, h]) => {
            return Err(format!(
                "a panorama of {w} × {h} pixels in a picture of {width} × {height}: only whole panoramas \
                 are supported"
            ));
        }
        _ => {
            return Err(format!(
                "the camera model {model} is not supported: undistort the pictures with colmap \
                 image_undistorter, which makes a model of PINHOLE cameras"
            ));
        }
    };

    if let Optics::Pinhole { focal_px, .. } = optics
        && focal_px.min_element() <= 0.0
    {
        return Err(format!("focal lengths of {} and {} px: both must be above 0", focal_px.x, focal_px.y));
    }
    Ok((size, optics))
}

fn pinhole(focal_px: [f64; 2], center_px: [f64; 2], distortion: Distortion) -> Optics {
    Optics::Pinhole { focal_px: focal_px.into(), center_px: Some(center_px.into()), distortion }
}

#[cfg(test)]
mod tests {

    use super::*;
    use s3d_geom::glam::dvec2;

    const ALL: &str = "# Camera list\n1 PINHOLE 640 480 500 510 320 240\n\
                       2 SIMPLE_PINHOLE 640 480 500 320 240\n\
                       3 SIMPLE_RADIAL 640 480 500 320 240 0.1\r\n4 RADIAL 640 480 500 320 240 0.1 -0.2\n\
                       5 OPENCV 640 480 500 510 320 240 0.1 -0.2 0.003 0.004\n\
                       6 OPENCV_FISHEYE 640 480 500 510 320 240 0.1 -0.2 0.03 0.04\n\
                       7 RADIAL 640 480 500 320 240 0 0\n\
                       8 SIMPLE_FISHEYE 640 480 500 320 240\n9 FISHEYE 640 480 500 510 320 240\n\
                       10 EQUIRECTANGULAR 512 256 512 256\n";

    /// Returns the cameras of `text` in binary.
    fn binary(text: &str) -> Vec<u8> {
        let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
        let mut bytes = (lines.len() as u64).to_le_bytes().to_vec();
        for line in lines {
            let words: Vec<&str> = line.split_whitespace().collect();
            let model = MODELS.iter().position(|(name, _)| *name == words[1]).unwrap();
            bytes.extend(words[0].parse::<u32>().unwrap().to_le_bytes());
            bytes.extend((model as u32).to_le_bytes());
            words[2..4]
                .iter()
                .for_each(|w| bytes.extend(w.parse::<u64>().unwrap().to_le_bytes()));
            words[4..]
                .iter()
                .for_each(|w| bytes.extend(w.parse::<f64>().unwrap().to_le_bytes()));
        }
        bytes
    }

    #[test]
    fn every_model_is_read_in_both_forms() {
        let text = read_text(Path::new("cameras.txt"), ALL.as_bytes()).unwrap();
        assert_eq!(read_binary(Path::new("cameras.bin"), &binary(ALL)).unwrap(), text);
        let distortion = |id: u32| {
            let ([640, 480], Optics::Pinhole { focal_px, center_px, distortion }) = text[&id] else {
                panic!("camera {id}")
            };
            assert_eq!(center_px, Some(dvec2(320.0, 240.0)));
            assert_eq!(focal_px, dvec2(500.0, if [1, 5, 6, 9].contains(&id) { 510.0 } else { 500.0 }));
            distortion
        };
        assert_eq!([1, 2, 7].map(distortion), [Distortion::None; 3]);
        assert_eq!(distortion(3), Distortion::OpenCv([0.1, 0.0, 0.0, 0.0, 0.0]));
        assert_eq!(distortion(4), Distortion::OpenCv([0.1, -0.2, 0.0, 0.0, 0.0]));
        assert_eq!(distortion(5), Distortion::OpenCv([0.1, -0.2, 0.003, 0.004, 0.0]));
        assert_eq!(distortion(6), Distortion::Fisheye([0.1, -0.2, 0.03, 0.04]));
        assert_eq!([8, 9].map(distortion), [Distortion::Fisheye([0.0; 4]); 2]);
        assert_eq!(text[&10], ([512, 256], Optics::Equirectangular));
        let earlier = read_text(Path::new("cameras.txt"), b"10 SPHERICAL 512 256 512 256\n").unwrap();
        assert_eq!(earlier[&10], text[&10]);
    }

    #[test]
    fn faults_have_their_place() {
        for (line, words) in [
            ("1 PINHOLE 640 480 500 510 320", "line 2: PINHOLE has 4 parameters, not 3"),
            ("1 PINHOLE 640 480 500 510 320 nan", "line 2: a parameter of PINHOLE is not finite"),
            ("1 PINHOLE 640 480 500 510 320 x", "line 2: \"x\" is no number"),
            ("1 PINHOLE 0 480 500 510 320 240", "line 2: a picture of 0 × 480"),
            ("1 PINHOLE 640 480 500 -510 320 240", "line 2: focal lengths of 500 and -510"),
            ("1 FISHY 640 480 500", "line 2: `FISHY` is no camera model"),
            ("1 FOV 640 480 500 500 320 240 0.9", "line 2: the camera model FOV is not supported"),
            ("1 EUCM 640 480 500 500 320 240 0.5 1", "line 2: the camera model EUCM is not supported"),
            ("1 EQUIRECTANGULAR 512 256 400 256", "line 2: a panorama of 400 × 256 pixels in a picture"),
            ("1 PINHOLE 640", "line 2: `1 PINHOLE 640`: a camera is"),
            ("9 PINHOLE 640 480 500 510 320 240", "line 2: there is a camera 9 already"),
        ] {
            let text = format!("9 SIMPLE_PINHOLE 640 480 500 320 240\n{line}\n");
            let e = read_text(Path::new("cameras.txt"), text.as_bytes())
                .unwrap_err()
                .to_string();
            assert!(e.contains(words), "{e}");
        }

        let bytes = binary(ALL);
        for length in [0, 9, 30, bytes.len() - 1] {
            let e = read_binary(Path::new("cameras.bin"), &bytes[..length])
                .unwrap_err()
                .to_string();
            assert!(e.contains("cut off"), "{e}");
        }

        let mut odd = bytes;
        odd[12] = 77;
        let e = read_binary(Path::new("cameras.bin"), &odd).unwrap_err().to_string();
        assert!(e.contains("camera 1: its model has the number 77"), "{e}");
    }
}
