//! The scanner's own pictures: raw Matterport captures, sky boxes and equirectangular photographs.
//!
//! Source: [`crate::formats`], "The scanner's pictures". Files are looked up in a folder and in the folders
//! in it, because Matterport3D keeps colours, poses and intrinsics in separate ones
//! (`matterport_color_images/`…).

use crate::camera::narrow::too_narrow;
use crate::camera::picture::{check_picture, read_picture};
use crate::camera::table::ScanLocation;
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::{list_folder, read_file};
use glam::{DMat3, DVec2, DVec3};
use s3d_geom::{Lens, Pose, Raster};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The largest error of a rotation matrix, and of a last row that should be 0 0 0 1. It allows for eight
/// digits, and for scanners that round to four.
const ROTATION_ERROR: f64 = 2e-3;

/// The farthest that a camera may be from the origin, metres.
const FARTHEST_M: f64 = 1e7;

/// The number of the camera that looks level. Camera 0 looks up, camera 2 down.
const LEVEL: u32 = 1;

/// The number of captures of a location: three cameras at six stops.
pub const CAPTURES_A_LOCATION: usize = 18;

/// A folder of pictures. Its files are found by name; nothing else in it is read.
#[derive(Clone, Debug)]
pub struct PictureFolder {
    path: PathBuf,
    /// The files by lower-case name. The first path wins if several files have one name.
    files: BTreeMap<String, PathBuf>,
}

/// A capture: the file of its picture, its lens and its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct CaptureFile {
    /// The number of the scanner's camera: 0 looks up, 1 level, 2 down.
    pub camera: u32,
    /// The stop of the scanner's turn, 0 to 5.
    pub yaw: u32,
    /// The picture.
    pub color: PathBuf,
    /// The camera's lens.
    pub lens: Lens,
    /// The camera's position and rotation, in this project's axes (x right, y up, looking along −z).
    pub pose: Pose,
}

impl CaptureFile {
    /// Reads the picture.
    ///
    /// # Errors
    /// Like [`read_picture`]; [`Error::Format`] if the size is not the lens's.
    pub fn read(&self) -> Result<Raster<[u8; 3]>> {
        let image = read_picture(&self.color)?;
        check_size(&self.color, (image.width(), image.height()), &self.lens)?;
        Ok(image)
    }
}

fn check_size(path: &Path, (w, h): (u32, u32), lens: &Lens) -> Result<()> {
    if (w, h) == (lens.width(), lens.height()) {
        return Ok(());
    }
    Err(Error::format(
        path,
        format!(
            "has {w} × {h} pixels, but the intrinsics of its camera are for {} × {}",
            lens.width(),
            lens.height()
        ),
    ))
}

impl PictureFolder {
    /// Lists a folder, and the folders in it.
    ///
    /// # Errors
    /// [`Error::Io`] if one cannot be read.
    pub fn open(path: &Path) -> Result<Self> {
        let mut files = BTreeMap::new();
        let mut folders = Vec::new();
        for entry in list_folder(path)? {
            if entry.is_dir() {
                folders.push(entry);
            } else {
                remember(&mut files, entry);
            }
        }

        for folder in folders {
            list_folder(&folder)?
                .into_iter()
                .filter(|e| !e.is_dir())
                .for_each(|e| remember(&mut files, e));
        }
        Ok(Self { path: path.to_owned(), files })
    }

    /// Returns the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the names of all files, in lower case, sorted.
    #[cfg(feature = "raw")]
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Returns the path of a file; the case of `name` does not matter.
    pub(crate) fn find(&self, name: &str) -> Option<&PathBuf> {
        self.files.get(&name.to_ascii_lowercase())
    }

    /// Returns the path of a picture, from its name without the extension.
    pub(crate) fn picture(&self, stem: &str) -> Option<PathBuf> {
        ["jpg", "jpeg", "png"]
            .iter()
            .find_map(|e| self.find(&format!("{stem}.{e}")))
            .cloned()
    }

    /// Returns the names of the locations that have a capture's pose: 32 lower-case hexadecimal digits each,
    /// sorted.
    pub fn uuids(&self) -> Vec<String> {
        let uuids = self.files.keys().filter_map(|name| {
            let (uuid, rest) = name.split_at_checked(32)?;
            let is_pose = rest.starts_with("_pose_") && rest.ends_with(".txt");
            (is_pose && uuid.bytes().all(|b| b.is_ascii_hexdigit())).then(|| uuid.to_owned())
        });
        uuids.collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// Returns the six pictures of a location's sky box in their order: 0 up, 1 right, 2 back, 3 left, 4
    /// front, 5 down. The error names the missing files.
    pub fn sky_box(&self, uuid: &str) -> std::result::Result<[PathBuf; 6], String> {
        let stem = |k: usize| format!("{uuid}_skybox{k}_sami");
        let found: [Option<PathBuf>; 6] = std::array::from_fn(|k| self.picture(&stem(k)));
        let missing = found.iter().enumerate().filter(|(_, path)| path.is_none());
        let missing: Vec<String> = missing.map(|(k, _)| format!("{}.jpg", stem(k))).collect();
        if missing.is_empty() {
            Ok(found.map(Option::unwrap_or_default))
        } else {
            Err(missing.join(", "))
        }
    }

    /// Returns a location's equirectangular photograph: `{uuid}.jpg` or `.png`, or the name of the published
    /// data set, `camera_{uuid}_…_frame_equirectangular_domain_rgb.png`. The error names the missing files.
    pub fn panorama(&self, uuid: &str) -> std::result::Result<PathBuf, String> {
        let found = self.picture(uuid).or_else(|| self.published_panorama(uuid));
        found.ok_or_else(|| {
            format!("{uuid}.jpg, {uuid}.png or camera_{uuid}_…_frame_equirectangular_domain_rgb.png")
        })
    }

    fn published_panorama(&self, uuid: &str) -> Option<PathBuf> {
        let start = format!("camera_{uuid}_");
        self.files
            .range(start.clone()..)
            .take_while(|(name, _)| name.starts_with(&start))
            .find(|(name, _)| name.contains("_frame_equirectangular_domain_rgb."))
            .map(|(_, path)| path.clone())
    }

    /// Returns a location's captures with their poses and lenses, by camera and stop. There may be none.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if
    /// - a pose is not the 4×4 matrix of a rotation and a translation (with the line);
    /// - intrinsics are not the eleven numbers of a lens (with the line);
    /// - a picture has no pose or no intrinsics, or a pose has no picture;
    /// - a picture's size is not its lens's.
    pub fn captures(&self, uuid: &str) -> Result<Vec<CaptureFile>> {
        let mut captures = Vec::new();
        for camera in 0..3 {
            let mut lens = None;
            for yaw in 0..6 {
                let color = self.picture(&format!("{uuid}_i{camera}_{yaw}"));
                let pose_name = format!("{uuid}_pose_{camera}_{yaw}.txt");
                let (color, pose) = match (color, self.find(&pose_name)) {
                    (None, None) => continue,
                    (Some(color), Some(pose)) => (color, pose),
                    (Some(color), None) => {
                        return Err(Error::format(&color, format!("has no pose: {pose_name} is not there")));
                    }
                    (None, Some(pose)) => {
                        let name = format!("{uuid}_i{camera}_{yaw}.jpg");
                        return Err(Error::format(pose, format!("has no picture: {name} is not there")));
                    }
                };

                let lens = match lens {
                    Some(lens) => lens,
                    None => {
                        let name = format!("{uuid}_intrinsics_{camera}.txt");
                        let path = self.find(&name).ok_or_else(|| {
                            Error::format(&color, format!("has no intrinsics: {name} is not there"))
                        })?;
                        *lens.insert(read_intrinsics(path)?)
                    }
                };

                check_size(&color, check_picture(&color)?, &lens)?;
                captures.push(CaptureFile { camera, yaw, color, lens, pose: read_capture_pose(pose)? });
            }
        }
        Ok(captures)
    }
}

fn remember(files: &mut BTreeMap<String, PathBuf>, path: PathBuf) {
    if let Some(name) = path.file_name().and_then(|n| n.to_str()) {
        files.entry(name.to_ascii_lowercase()).or_insert(path);
    }
}

/// Returns the numbers of a text file, each with its line.
pub(crate) fn numbers(bytes: &[u8], path: &Path) -> Result<Vec<(u64, f64)>> {
    let bytes = text_of(bytes, path)?;
    let text = std::str::from_utf8(&bytes).map_err(|_| Error::format(path, "is no text"))?;
    let mut numbers = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        for word in text.split_ascii_whitespace() {
            let number = word.parse::<f64>().ok().filter(|v| v.is_finite());
            let number =
                number.ok_or_else(|| Error::line(path, line, format!("{word:?} is no finite number")))?;
            numbers.push((line, number));
        }
    }
    Ok(numbers)
}

/// Reads the intrinsics of a camera: `width height fx fy cx cy k1 k2 p1 p2 k3`, in OpenCV's model. The origin
/// is the picture's top left corner.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if they are not eleven numbers, or no lens has them.
pub fn read_intrinsics(path: &Path) -> Result<Lens> {
    parse_intrinsics(&read_file(path)?, path)
}

/// Reads like [`read_intrinsics`], from the file's bytes. Errors call the file `name`.
///
/// # Errors
/// Like [`read_intrinsics`].
pub fn parse_intrinsics(bytes: &[u8], name: &Path) -> Result<Lens> {
    let numbers = numbers(bytes, name)?;
    let Ok(lines_and_values) = <[(u64, f64); 11]>::try_from(numbers.as_slice()) else {
        let line = numbers.last().map_or(1, |n| n.0);
        let message =
            format!("{} numbers; intrinsics are width height fx fy cx cy k1 k2 p1 p2 k3", numbers.len());
        return Err(Error::line(name, line, message));
    };
    let lines = lines_and_values.map(|n| n.0);
    let [width, height, fx, fy, cx, cy, k1, k2, p1, p2, k3] = lines_and_values.map(|n| n.1);

    let (Some(w), Some(h)) = (side(width), side(height)) else {
        return Err(Error::line(name, lines[0], format!("a picture of {width} × {height} pixels")));
    };
    if let Some(why) = too_narrow([w, h], DVec2::new(fx, fy)) {
        return Err(Error::line(name, lines[2], why));
    }
    Lens::new([w, h], DVec2::new(fx, fy), DVec2::new(cx, cy), [k1, k2, p1, p2, k3]).ok_or_else(|| {
        let message = format!(
            "no lens: fx {fx} fy {fy} cx {cx} cy {cy}, distortion {k1} {k2} {p1} {p2} {k3} (focal lengths \
             must be above 0, and some direction must come to the middle of the picture)"
        );
        Error::line(name, lines[2], message)
    })
}

/// Returns the side of a picture in pixels, if the number is one.
fn side(number: f64) -> Option<u32> {
    (number.fract() == 0.0 && (1.0..=65_535.0).contains(&number)).then_some(number as u32)
}

/// Reads the pose of a capture: a 4×4 matrix, row by row, from the camera (x right, y down, z forward) to
/// the world (metres, Z-up).
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`], with the line if there is one, if there are not sixteen numbers, the
/// last row is not 0 0 0 1, the 3×3 part is no rotation, or the camera is more than 10,000 km from the
/// origin.
pub fn read_capture_pose(path: &Path) -> Result<Pose> {
    parse_capture_pose(&read_file(path)?, path)
}

/// Reads like [`read_capture_pose`], from the file's bytes. Errors call the file `name`.
///
/// # Errors
/// Like [`read_capture_pose`].
pub fn parse_capture_pose(bytes: &[u8], name: &Path) -> Result<Pose> {
    let numbers = numbers(bytes, name)?;
    let Ok(lines_and_values) = <[(u64, f64); 16]>::try_from(numbers.as_slice()) else {
        let line = numbers.last().map_or(1, |n| n.0);
        return Err(Error::line(name, line, format!("{} numbers; a 4×4 matrix has 16", numbers.len())));
    };
    let lines = lines_and_values.map(|n| n.0);
    let m = lines_and_values.map(|n| n.1);

    pose_of_matrix(&m)
        .map_err(|(number, message)| Error::line(name, lines.get(number).copied().unwrap_or(1), message))
}

/// Reads a pose like [`read_capture_pose`]. Returns `None` if it holds an infinity or NaN: programs mark
/// poses so that they do not know.
pub(crate) fn read_known_pose(path: &Path) -> Result<Option<Pose>> {
    let bytes = read_file(path)?;
    let text = text_of(&bytes, path)?;
    let words = text
        .split(u8::is_ascii_whitespace)
        .filter_map(|word| std::str::from_utf8(word).ok());
    let is_unknown = words
        .filter_map(|word| word.parse::<f64>().ok())
        .any(|number| !number.is_finite());
    if is_unknown {
        return Ok(None);
    }
    parse_capture_pose(&bytes, path).map(Some)
}

/// Returns the pose of a 4×4 matrix, row by row, from the camera (x right, y down, z forward) to the world.
/// The error is the index of the number at fault, and a sentence.
pub(crate) fn pose_of_matrix(m: &[f64; 16]) -> std::result::Result<Pose, (usize, String)> {
    let last = [m[12], m[13], m[14], m[15] - 1.0];
    if last.iter().any(|v| v.abs() > ROTATION_ERROR) {
        let is_transposed = [m[3], m[7], m[11]] == [0.0; 3];
        let hint = if is_transposed {
            ": the matrix is transposed"
        } else {
            ""
        };
        let row = format!("{} {} {} {}", m[12], m[13], m[14], m[15]);
        return Err((12, format!("the last row is {row}, not 0 0 0 1{hint}")));
    }

    let rows = [[m[0], m[1], m[2]], [m[4], m[5], m[6]], [m[8], m[9], m[10]]].map(DVec3::from_array);
    let turn = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
    let square = turn.transpose() * turn;
    let off = (0..3)
        .flat_map(|k| (square.col(k) - DMat3::IDENTITY.col(k)).to_array())
        .fold(0.0, |a: f64, v| a.max(v.abs()));
    if off > ROTATION_ERROR {
        let message = format!(
            "the upper left 3×3 part is no rotation: its axes are off by {off:.4} from length 1 and right \
             angles"
        );
        return Err((0, message));
    }
    if turn.determinant() < 0.0 {
        let message = "the upper left 3×3 part mirrors: its determinant is −1, a rotation's is 1";
        return Err((0, message.into()));
    }

    let location = DVec3::new(m[3], m[7], m[11]);
    if location.abs().max_element() > FARTHEST_M {
        return Err((3, format!("the camera is at {location}: are these metres?")));
    }

    // Makes a rotation of the rounded matrix. The viewing direction stays.
    let forward = turn.z_axis.normalize();
    let right = (turn.x_axis - forward * forward.dot(turn.x_axis)).normalize();
    let down = forward.cross(right);
    Ok(Pose { location, world_from_camera: DMat3::from_cols(right, -down, -forward) })
}

/// Reads the scan locations of a folder of raw captures, by uuid. A location lies at the mean position of its
/// level camera (camera 1). Its E(original) is the pose of that camera at stop 0, tilt included.
/// [`ScanLocation::line`] counts the locations from 1.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] for the folder if it has no location, for a pose that
/// [`read_capture_pose`] refuses, and for a location without `_pose_1_0.txt`.
pub fn read_matterport_locations(dir: &Path) -> Result<Vec<ScanLocation>> {
    let folder = PictureFolder::open(dir)?;
    let uuids = folder.uuids();
    if uuids.is_empty() {
        let message = "has no captures: no file is called {uuid}_pose_{camera}_{yaw}.txt";
        return Err(Error::format(dir, message));
    }

    let mut locations = Vec::new();
    for (line, uuid) in (1..).zip(uuids) {
        let mut poses = Vec::new();
        for yaw in 0..6 {
            if let Some(path) = folder.find(&format!("{uuid}_pose_{LEVEL}_{yaw}.txt")) {
                poses.push(read_capture_pose(path)?);
            } else if yaw == 0 {
                let message = format!(
                    "location {uuid} has no {uuid}_pose_{LEVEL}_0.txt, from which its original camera would \
                     be taken"
                );
                return Err(Error::format(dir, message));
            }
        }

        let center = poses.iter().map(|p| p.location).sum::<DVec3>() / poses.len() as f64;
        // There is a first one: without it there was an error.
        let pose = poses.first().map(|first| Pose { location: center, ..*first });
        locations.extend(pose.map(|pose| ScanLocation { uuid, pose, line }));
    }
    Ok(locations)
}

#[cfg(test)]
mod tests;
