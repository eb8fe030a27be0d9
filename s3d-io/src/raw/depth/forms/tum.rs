//! Depth of TUM's RGB-D benchmark: `depth.txt` and `rgb.txt` with lines `timestamp filename`, poses in
//! `groundtruth.txt`, 5,000 steps a metre, depth aligned with the colour camera. Sources: the benchmark's
//! pages "File Formats" and "Intrinsic Camera Calibration", and its `associate.py`, which pairs what is at
//! most 0.02 s apart.

use crate::camera::programs::arkit::nearest;
use crate::camera::programs::tum;
use crate::camera::{Distortion, Optics, PosedCamera};
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::quote::quote;
use crate::fs::read_file;
use crate::raw::depth::file::DepthPlace;
use crate::raw::depth::list::{Entry, Listed};
use crate::raw::form::RawForm;
use s3d_geom::glam::{DVec2, dvec2};
use std::path::{Component, Path, PathBuf};

/// The lists of a sequence.
const DEPTHS: &str = "depth.txt";
const COLORS: &str = "rgb.txt";
const POSES: &str = "groundtruth.txt";

/// A step of the numbers, metres.
const STEP_M: f64 = 1.0 / 5000.0;

/// The most that two things of one moment are apart, seconds.
const SAME_S: f64 = 0.02;

/// The size of all pictures.
const SIZE: [u32; 2] = [640, 480];

/// The lenses of the three devices, by the name of a sequence: focal lengths and principal point, as the
/// benchmark recommends them for depth. It counts pixels from the centre of the first.
const LENSES: [(&str, [f64; 4]); 3] = [
    ("freiburg1", [525.0, 525.0, 319.5, 239.5]),
    ("freiburg2", [525.0, 525.0, 319.5, 239.5]),
    ("freiburg3", [535.4, 539.2, 320.1, 247.6]),
];

/// The distance from the corner of a pixel to its centre.
const HALF_PX: f64 = 0.5;

/// A line of a list.
struct Timed {
    time_s: f64,
    path: PathBuf,
}

/// Returns whether a folder holds a sequence.
pub(super) fn is_sequence(dir: &Path) -> bool {
    dir.join(DEPTHS).is_file() && (dir.join(POSES).is_file() || dir.join(COLORS).is_file())
}

/// Lists the depth pictures of a sequence.
pub(super) fn list(dir: &Path) -> Result<Listed> {
    let mut listed = Listed::new(RawForm::Tum, dir.to_owned());
    let depths = read_list(&dir.join(DEPTHS))?;
    let poses = dir.join(POSES);
    if !poses.is_file() {
        let message = "has depth but no groundtruth.txt, so its poses are unknown: put the path of the \
                       camera there, lines `timestamp tx ty tz qx qy qz qw`, as programs for SLAM write it";
        return Err(Error::format(dir, message));
    }
    let bytes = read_file(&poses)?;
    let mut cameras = tum::read(&poses, &text_of(&bytes, &poses)?)?;
    cameras.sort_by(|a, b| time_of(a).total_cmp(&time_of(b)));
    listed.files.extend([dir.join(DEPTHS), poses]);

    let colors = dir.join(COLORS);
    let colors = match colors.is_file() {
        true => read_list(&colors)?,
        false => Vec::new(),
    };
    let optics = lens_of(dir);
    for depth in depths {
        let pose = nearest(&cameras, depth.time_s, time_of, SAME_S);
        let Some(pose) = pose.map(|camera| camera.pose) else {
            listed.untracked += 1;
            continue;
        };
        let name = depth
            .path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let camera = PosedCamera { size: optics.map(|_| SIZE), optics, ..PosedCamera::new(name, pose) };
        let color = nearest(&colors, depth.time_s, |color| color.time_s, SAME_S);
        let color =
            color.map(|color| PosedCamera { picture: Some(color.path.clone().into()), ..camera.clone() });
        listed.entries.push(Entry {
            camera,
            place: DepthPlace::File(depth.path),
            unit_m: STEP_M,
            missing: None,
            confidence: None,
            color,
        });
    }
    Ok(listed)
}

fn time_of(camera: &PosedCamera) -> f64 {
    camera.name.parse().unwrap_or(f64::NAN)
}

/// Returns the lens of the device that a sequence was recorded with, if its folder is named after it.
fn lens_of(dir: &Path) -> Option<Optics> {
    let folder = dir.canonicalize().unwrap_or_else(|_| dir.to_owned());
    let name = folder.file_name()?.to_string_lossy().to_ascii_lowercase();
    let (_, [fx, fy, cx, cy]) = LENSES.iter().find(|(device, _)| name.contains(device))?;
    Some(Optics::Pinhole {
        focal_px: dvec2(*fx, *fy),
        center_px: Some(dvec2(*cx, *cy) + DVec2::splat(HALF_PX)),
        distortion: Distortion::None,
    })
}

/// Returns whether a path stays below the folder that it starts from.
fn is_below(file: &str) -> bool {
    let mut parts = Path::new(file).components();
    parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

/// Reads a list of pictures, sorted by time.
fn read_list(path: &Path) -> Result<Vec<Timed>> {
    let bytes = read_file(path)?;
    let text = text_of(&bytes, path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut list = Vec::new();
    for (line, text) in (1u64..).zip(text.split(|&b| b == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }
        let words = std::str::from_utf8(text)
            .ok()
            .and_then(|text| text.split_once([' ', '\t']));
        let timed = words.and_then(|(time, file)| {
            let time_s = time.parse().ok().filter(|time: &f64| time.is_finite())?;
            Some((time_s, file.trim()))
        });
        let fault = || Error::line(path, line, format!("{}: a line is timestamp filename", quote(text)));
        let (time_s, file) = timed.ok_or_else(fault)?;
        if !is_below(file) {
            let message = format!("{file}: is outside of the recording: put the picture into its folder");
            return Err(Error::line(path, line, message));
        }
        list.push(Timed { time_s, path: folder.join(file) });
    }
    list.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    Ok(list)
}
