//! The undistorted photographs of Matterport3D: `undistorted_camera_parameters/HOUSE.conf`. Sources:
//! niessner/Matterport, data_organization.md ("undistorted_camera_parameters") and code/gaps/pkgs/RGBD
//! (RGBDConfiguration.cpp, RGBDImage.cpp, RGBDCamera.cpp).
//!
//! A line is a command. `intrinsics_matrix` has K, row by row, for the lines `scan` that follow: a picture of
//! depth, one of colour, and its pose, camera → world in OpenGL's axes. Rows of pixels are counted from
//! below.

use crate::camera::posed::{Optics, PosedCamera};
use crate::camera::programs::scannet::optics_of_matrix;
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use s3d_geom::Pose;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The size of all pictures of the data set, for which the intrinsics are. mpview assumes it too.
const SIZE: [u32; 2] = [1280, 1024];

/// The commands that a file begins with.
const FIRST: [&[u8]; 5] =
    [b"dataset", b"n_images", b"depth_directory", b"color_directory", b"intrinsics_matrix"];

/// The commands that say nothing about the photographs.
const OTHERS: [&str; 5] =
    ["texture_directory", "depth_intrinsics", "depth_intrinsics_matrix", "rectangle", "mesh"];

/// The folder of the photographs, where no line says it.
const PICTURES: &str = "undistorted_color_images";

/// Returns whether a line, the first one that is not empty, begins such a file.
pub(crate) fn is_list(line: &[u8]) -> bool {
    let word = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    FIRST.contains(&word)
}

/// Returns the list in a folder, if it holds one alone.
pub(crate) fn find(dir: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(dir)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()));
    let mut lists = entries.filter(|path| path.extension().is_some_and(|ending| ending == "conf"));
    let list = lists.next().filter(|_| lists.next().is_none())?;
    list.is_file().then_some(list)
}

/// The folder of the depth pictures, where no line says it.
const DEPTHS: &str = "undistorted_depth_images";

/// Reads the cameras of a list, in its order.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Vec<PosedCamera>> {
    let depths = read_depth(path, bytes)?.into_iter();
    Ok(depths.map(|(camera, _)| camera).collect())
}

/// Reads the cameras of a list like [`read`], each with its depth picture. The file may not exist.
pub(crate) fn read_depth(path: &Path, bytes: &[u8]) -> Result<Vec<(PosedCamera, PathBuf)>> {
    let mut list = List::default();
    for (line, text) in (1u64..).zip(bytes.split(|&b| b == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }
        let fault = |message: String| Error::line(path, line, message);
        let text = std::str::from_utf8(text).map_err(|_| fault(format!("{} is no text", quote(text))))?;
        list.add(text, line).map_err(fault)?;
    }

    if let Some((told, line)) = list.told.filter(|(told, _)| *told != list.cameras.len() as u64) {
        let message = format!("tells of {told} images, and {} are listed", list.cameras.len());
        return Err(Error::line(path, line, message));
    }
    let colors = folder_of(path, list.folder.as_deref().unwrap_or(PICTURES));
    let depths = folder_of(path, list.depth_folder.as_deref().unwrap_or(DEPTHS));
    for camera in &mut list.cameras {
        camera.picture = Some(colors.join(&camera.name).into());
    }
    let names = list.depths.into_iter().map(|name| depths.join(name));
    Ok(list.cameras.into_iter().zip(names).collect())
}

/// Returns the folder that a list calls `named`. It is named from the folder of the house, in which the list
/// has a folder of its own.
fn folder_of(list: &Path, named: &str) -> PathBuf {
    let folder = list.parent().unwrap_or(Path::new(""));
    let beside = folder.join("..").join(named);
    let within = folder.join(named);
    match !beside.is_dir() && within.is_dir() {
        true => within,
        false => beside,
    }
}

/// What a list says so far.
#[derive(Default)]
struct List {
    cameras: Vec<PosedCamera>,
    names: HashSet<String>,
    optics: Option<Optics>,
    /// The names of the depth pictures, one a camera.
    depths: Vec<String>,
    /// The folder of the photographs.
    folder: Option<String>,
    /// The folder of the depth pictures.
    depth_folder: Option<String>,
    /// The number of images, and its line.
    told: Option<(u64, u64)>,
}

impl List {
    /// Adds a line. The error is a sentence.
    fn add(&mut self, text: &str, line: u64) -> std::result::Result<(), String> {
        let mut words = text.split_ascii_whitespace();
        let command = words.next().unwrap_or_default();
        match command {
            "dataset" => match words.next() {
                Some("matterport") => {}
                name => {
                    let name = quote(name.unwrap_or_default().as_bytes());
                    return Err(format!("the data set {name}: only cameras of matterport are read"));
                }
            },
            "n_images" => {
                let word = words.next().unwrap_or_default();
                let count = word
                    .parse()
                    .map_err(|_| format!("{} is no number of images", quote(word.as_bytes())))?;
                self.told = Some((count, line));
            }
            "depth_directory" => self.depth_folder = words.next().map(str::to_owned),
            "color_directory" | "image_directory" => self.folder = words.next().map(str::to_owned),
            "intrinsics_matrix" | "color_intrinsics_matrix" => {
                let [width, height] = SIZE.map(f64::from);
                let mut k: [f64; 9] = numbers(words)?;
                // The rows of pixels were turned round, the last of which is the first.
                k[5] = height - 1.0 - k[5];
                let is_inside = (0.0..=width).contains(&k[2]) && (0.0..=height).contains(&k[5]);
                if !is_inside {
                    let [w, h] = SIZE;
                    return Err(format!("the principal point lies outside of a picture of {w} × {h} pixels"));
                }
                self.optics = Some(optics_of_matrix(&k)?);
            }
            "scan" | "image" => self.add_camera(words, line)?,
            _ if OTHERS.contains(&command) => {}
            _ => return Err(format!("{}: there is no such command", quote(command.as_bytes()))),
        }
        Ok(())
    }

    fn add_camera<'w>(
        &mut self,
        mut words: impl Iterator<Item = &'w str>,
        line: u64,
    ) -> std::result::Result<(), String> {
        let (Some(depth), Some(name)) = (words.next(), words.next()) else {
            return Err("names no pictures: a line is scan DEPTH COLOUR and sixteen numbers".into());
        };
        if self.optics.is_none() {
            return Err("stands before its intrinsics_matrix".into());
        }
        let [a, b, c, d] = *numbers::<16>(words)?.as_chunks::<4>().0 else {
            return Err("a pose has sixteen numbers".into());
        };
        let pose = Pose::from_opengl([a, b, c, d]).map_err(|e| format!("the pose: {e}"))?;
        if !self.names.insert(name.to_owned()) {
            return Err(format!("{} is listed twice", quote(name.as_bytes())));
        }

        let camera =
            PosedCamera { size: Some(SIZE), optics: self.optics, line, ..PosedCamera::new(name, pose) };
        self.cameras.push(camera);
        self.depths.push(depth.to_owned());
        Ok(())
    }
}

/// Returns the numbers that the words are: exactly so many, all finite.
fn numbers<'w, const N: usize>(
    words: impl Iterator<Item = &'w str>,
) -> std::result::Result<[f64; N], String> {
    let mut found = [0.0; N];
    let mut count = 0;
    for (place, word) in words.enumerate() {
        let number = word.parse().ok().filter(|number: &f64| number.is_finite());
        let number = number.ok_or_else(|| format!("{} is no number", quote(word.as_bytes())))?;
        if let Some(entry) = found.get_mut(place) {
            *entry = number;
        }
        count = place + 1;
    }
    if count == N {
        Ok(found)
    } else {
        Err(format!("{count} numbers follow, and {N} are expected"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{DVec3, dvec2, dvec3};
    use std::fs;

    /// Lines of the data set (1LXtFkjw3qL): its intrinsics of the camera, as the scanner has them, are
    /// `1280 1024 1076.45 1077.19 631.116 513.798`, counted from above.
    const LIST: &str = "\
dataset matterport
n_images 2
depth_directory undistorted_depth_images
color_directory undistorted_color_images

intrinsics_matrix 1076.45 0 631.116  0 1077.19 509.202  0 0 1
scan a_d0_0.png a_i0_0.jpg 0.90525 0.275848 0.323155 -2.99825 0.42464 -0.612795 -0.666455 -14.4532 \
0.0141878 0.740533 -0.67187 1.33124 0 0 0 1
intrinsics_matrix 500 0 640  0 500 511  0 0 1
scan a_d1_0.png a_i1_0.jpg 0 0 -1 1 -1 0 0 2 0 1 0 1.5 0 0 0 1
";

    fn list(text: &str) -> Result<Vec<PosedCamera>> {
        read(Path::new("h/p/a.conf"), text.as_bytes())
    }

    #[test]
    fn photographs_show_what_is_before_them() {
        for text in [LIST.to_owned(), LIST.replace('\n', "\r\n"), LIST.replace("n_images 2\n", "")] {
            let cameras = list(&text).unwrap();
            let [up, level] = &cameras[..] else { panic!("{cameras:?}") };
            // Camera 0 of the scanner looks up.
            assert!((up.pose.forward().z - 0.671_87).abs() < 1e-5, "{:?}", up.pose);
            let Some(Optics::Pinhole { focal_px, center_px: Some(center), .. }) = up.optics else { panic!() };
            assert_eq!(focal_px, dvec2(1076.45, 1077.19));
            assert!(center.abs_diff_eq(dvec2(631.116, 513.798), 1e-9), "{center}");

            // The second looks along +X. A point two metres ahead, half a metre to the left (+Y) and a
            // quarter above is at the left and above the middle.
            assert_eq!((level.pose.location, level.pose.forward()), (dvec3(1.0, 2.0, 1.5), DVec3::X));
            let camera = level.camera(&Default::default()).unwrap();
            let (seen, _) = camera.project(dvec3(3.0, 2.5, 1.75)).unwrap();
            assert!(seen.abs_diff_eq(dvec2(640.0 - 125.0, 512.0 - 62.5), 1e-9), "{seen}");
            assert_eq!((level.name.as_str(), level.size), ("a_i1_0.jpg", Some(SIZE)));
            let picture = &level.picture.as_ref().unwrap().path;
            assert!(picture.ends_with("../undistorted_color_images/a_i1_0.jpg"), "{}", picture.display());
        }
    }

    #[test]
    fn the_list_of_a_folder_is_found_and_its_pictures_beside_it() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for folder in ["undistorted_camera_parameters", "undistorted_color_images"] {
            fs::create_dir(at(folder)).unwrap();
        }
        assert_eq!(find(&at("undistorted_camera_parameters")), None);
        let path = at("undistorted_camera_parameters/a.conf");
        fs::write(&path, LIST).unwrap();
        assert_eq!(find(&at("undistorted_camera_parameters")).as_ref(), Some(&path));
        let cameras = read(&path, LIST.as_bytes()).unwrap();
        let folder = cameras[0].picture.as_ref().unwrap().path.parent().unwrap();
        assert_eq!(folder.canonicalize().unwrap(), at("undistorted_color_images").canonicalize().unwrap());
        fs::write(at("undistorted_camera_parameters/b.conf"), LIST).unwrap();
        assert_eq!(find(&at("undistorted_camera_parameters")), None);
    }

    #[test]
    fn faults_have_their_line() {
        for (from, to, words) in [
            ("matterport", "sun3d", "h/p/a.conf, line 1: the data set `sun3d`"),
            ("n_images 2", "n_images 3", "line 2: tells of 3 images, and 2 are listed"),
            ("n_images 2", "n_images 99999999999999999999", "line 2: `99999999999999999999` is no number"),
            ("n_images 2", "m_images 2", "line 2: `m_images`: there is no such command"),
            (" 0 0 1\nscan", "\nscan", "line 6: 6 numbers follow, and 9 are expected"),
            ("1076.45 0", "1076.45 0.1", "line 6: is no matrix of intrinsics"),
            ("1076.45", "-1", "line 6: focal lengths of -1"),
            ("509.202", "5092.02", "line 6: the principal point lies outside of a picture of 1280 × 1024"),
            ("intrinsics_matrix 1076", "# intrinsics_matrix 1076", "line 7: stands before its"),
            ("0.90525", "0.5", "line 7: the pose: "),
            ("0.90525", "x", "line 7: `x` is no number"),
            ("0.90525", "1e999", "line 7: `1e999` is no number"),
            (" 1.5 0 0 0 1", " 1.5 0 0 0", "line 9: 15 numbers follow, and 16 are expected"),
            ("a_d1_0.png a_i1_0.jpg 0 0 -1 1 -1 0 0 2 0 1 0 1.5 0 0 0 1", "a", "line 9: names no pictures"),
            ("a_i1_0.jpg", "a_i0_0.jpg", "line 9: `a_i0_0.jpg` is listed twice"),
        ] {
            assert!(LIST.contains(from), "{from}");
            let message = list(&LIST.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(words), "{from} → {to}: {message}");
        }
    }
}
