//! The table of RealityCapture, "Internal/External camera parameters":
//! `#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2`, whose columns the user may choose. Sources:
//! the importers of nerfstudio-project/nerfstudio (nerfstudio/process_data/realitycapture_utils.py) and of
//! ArthurBrussee/brush (crates/brush-dataset), and RealityCapture's support, "XMP Camera Math".
//!
//! Angles are degrees: a camera in OpenGL's axes is turned by roll about y, by pitch about x, and by
//! −heading about z. `f` is the focal length for a picture whose longer side is 36; `px` and `py` are the
//! distance of the principal point from the middle, as shares of the longer side. The unit of the distortion
//! is not documented, so lenses that distort are refused.

use crate::camera::picture::read_picture_size;
use crate::camera::posed::{Distortion, Optics, PosedCamera};
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use s3d_geom::Pose;
use s3d_geom::glam::{DMat3, DVec3, dvec2};
use std::path::Path;

/// The longer side of a picture in the unit of `f`.
const LONGER_SIDE: f64 = 36.0;

/// The columns of a pose, in this order, after the name.
const POSE: [&str; 6] = ["x", "y", "alt", "heading", "pitch", "roll"];

/// The columns of the distortion.
const DISTORTION: [&str; 6] = ["k1", "k2", "k3", "k4", "t1", "t2"];

/// Returns whether the lines of a text begin as the table does. A line with the number of cameras may come
/// first.
pub(crate) fn is_table(text: &[u8]) -> bool {
    text.split(|&b| b == b'\n')
        .take(2)
        .any(|line| Header::of(line).is_some())
}

/// Reads the cameras of a table. Their pictures are in `images`, or in the folder of the table; they tell the
/// sizes.
pub(crate) fn read(path: &Path, text: &[u8], images: Option<&Path>) -> Result<Vec<PosedCamera>> {
    let folder = images.map_or_else(|| path.parent().unwrap_or(Path::new("")).to_owned(), Path::to_owned);
    let mut header = None;
    let mut cameras = Vec::new();

    for (line, text) in (1u64..).zip(text.split(|&b| b == b'\n')) {
        let Some(header) = &header else {
            header = Header::of(text);
            continue;
        };
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }
        let row = Row { header, cells: text.split(|&b| b == b',').collect() };
        let camera = row
            .camera(&folder, line)
            .map_err(|message| Error::line(path, line, message))?;
        cameras.push(camera);
    }
    Ok(cameras)
}

/// The place of each column.
struct Header {
    columns: Vec<String>,
}

impl Header {
    /// Reads a line that names at least a name, a pose and a focal length.
    fn of(line: &[u8]) -> Option<Self> {
        let text = String::from_utf8_lossy(line).to_lowercase();
        let names = text
            .trim()
            .trim_start_matches('\u{feff}')
            .trim_start_matches('#')
            .split(',');
        let columns: Vec<String> = names.map(|name| name.trim().to_owned()).collect();
        let header = Self { columns };
        let needed = POSE.iter().chain(&["name", "f"]);
        needed
            .copied()
            .all(|name| header.place(name).is_some())
            .then_some(header)
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }
}

/// A line of the table.
struct Row<'a> {
    header: &'a Header,
    cells: Vec<&'a [u8]>,
}

impl Row<'_> {
    /// Returns the camera of the line. The error is a sentence.
    fn camera(&self, folder: &Path, line: u64) -> std::result::Result<PosedCamera, String> {
        let name = String::from_utf8_lossy(self.cell("name")?.trim_ascii()).into_owned();
        let mut numbers = [0.0; 6];
        for (number, column) in numbers.iter_mut().zip(POSE) {
            *number = self.number(column)?;
        }
        let [x, y, alt, heading, pitch, roll] = numbers;
        let turn = DMat3::from_rotation_z(-heading.to_radians())
            * DMat3::from_rotation_x(pitch.to_radians())
            * DMat3::from_rotation_y(roll.to_radians());
        let pose = Pose { location: DVec3::new(x, y, alt), world_from_camera: turn };

        for column in DISTORTION {
            if self.header.place(column).is_some() && self.number(column)? != 0.0 {
                return Err(format!(
                    "{column} is not 0, and RealityCapture does not say how its lenses distort: export \
                     undistorted pictures, or the registration for COLMAP (text)"
                ));
            }
        }

        let picture = folder.join(&name);
        let size = self.size(&picture)?;
        let optics = size.map(|size| self.optics(size)).transpose()?;
        Ok(PosedCamera { name, pose, size, optics, picture: Some(picture.into()), mask: None, line })
    }

    /// Returns the size of the picture. Returns `None` if it is not there.
    fn size(&self, picture: &Path) -> std::result::Result<Option<[u32; 2]>, String> {
        if !picture.is_file() {
            return Ok(None);
        }
        let (width, height) = read_picture_size(picture).map_err(|e| e.to_string())?;
        Ok(Some([width, height]))
    }

    fn optics(&self, [width, height]: [u32; 2]) -> std::result::Result<Optics, String> {
        let focal = self.number("f")?;
        if focal <= 0.0 {
            return Err(format!("a focal length of {focal}: it must be above 0"));
        }
        let longer = f64::from(width.max(height));
        let mut off = [0.0; 2];
        for (off, column) in off.iter_mut().zip(["px", "py"]) {
            if self.header.place(column).is_some() {
                *off = self.number(column)?;
            }
        }

        let middle = 0.5 * dvec2(f64::from(width), f64::from(height));
        Ok(Optics::Pinhole {
            focal_px: dvec2(1.0, 1.0) * focal / LONGER_SIDE * longer,
            center_px: Some(middle + longer * dvec2(off[0], off[1])),
            distortion: Distortion::None,
        })
    }

    fn cell(&self, column: &str) -> std::result::Result<&[u8], String> {
        let cell = self.header.place(column).and_then(|place| self.cells.get(place));
        cell.copied().ok_or_else(|| {
            format!("has {} cells, and the header has {}", self.cells.len(), self.header.columns.len())
        })
    }

    fn number(&self, column: &str) -> std::result::Result<f64, String> {
        let cell = self.cell(column)?.trim_ascii();
        let number = std::str::from_utf8(cell).ok().and_then(|cell| cell.parse().ok());
        number
            .filter(|number: &f64| number.is_finite())
            .ok_or_else(|| format!("{column}: {} is no number", quote(cell)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "#cameras 2\n#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2\n";

    /// Reads a table beside the picture `a.png` of 60 × 40 pixels.
    fn table(text: &str) -> Result<Vec<PosedCamera>> {
        let dir = tempfile::tempdir().unwrap();
        crate::image::png::write_rgb8(
            &dir.path().join("a.png"),
            &s3d_geom::Raster::filled(60, 40, [1, 2, 3]),
            crate::image::png::Content::Photo,
            crate::image::compression::Compression::Fast,
        )
        .unwrap();
        read(&dir.path().join("cameras.csv"), text.as_bytes(), None)
    }

    /// A level camera has the pitch 90°, and looks along +Y with the heading 0.
    #[test]
    fn angles_turn_from_a_camera_that_looks_down() {
        for (angles, forward, up) in [
            ("0,90,0", DVec3::Y, DVec3::Z),
            ("90,90,0", DVec3::X, DVec3::Z),
            ("0,0,0", -DVec3::Z, DVec3::Y),
            ("0,90,90", -DVec3::X, DVec3::Z),
        ] {
            let row = format!("a.png,1,2,3,{angles},30,0.01,-0.02,0,0,0,0,0,0\n");
            let cameras = table(&format!("{HEADER}{row}")).unwrap();
            let pose = cameras[0].pose;
            assert_eq!((cameras.len(), cameras[0].line, pose.location), (1, 3, DVec3::new(1.0, 2.0, 3.0)));
            assert!(pose.forward().abs_diff_eq(forward, 1e-12), "{angles}: {}", pose.forward());
            assert!(pose.up().abs_diff_eq(up, 1e-12), "{angles}: {}", pose.up());
            assert_eq!(cameras[0].size, Some([60, 40]));
            let Some(Optics::Pinhole { focal_px, center_px, .. }) = cameras[0].optics else { panic!() };
            assert_eq!((focal_px, center_px), (dvec2(50.0, 50.0), Some(dvec2(30.6, 18.8))));
        }
    }

    #[test]
    fn columns_may_be_fewer_and_pictures_elsewhere() {
        let text = "name,x,y,alt,heading,pitch,roll,f\nb.png,1,2,3,0,90,0,30\n\n";
        assert!(is_table(text.as_bytes()) && is_table(HEADER.as_bytes()));
        assert!(!is_table(b"name,x,y,z,yaw\n") && !is_table(b""));
        let cameras = table(text).unwrap();
        assert_eq!((cameras[0].size, cameras[0].optics), (None, None));
    }

    #[test]
    fn lenses_that_distort_and_faults_are_refused_with_their_line() {
        for (row, words) in [
            ("a.png,1,2,3,0,90,0,30,0,0,0.1,0,0,0,0,0", "line 3: k1 is not 0"),
            ("a.png,1,2,3,0,90,0,30,0,0,0,0,0,0,0,1e-3", "line 3: t2 is not 0"),
            ("a.png,1,2,3,0,90,0,-30,0,0,0,0,0,0,0,0", "line 3: a focal length of -30"),
            ("a.png,1,2,x,0,90,0,30,0,0,0,0,0,0,0,0", "line 3: alt: `x` is no number"),
            ("a.png,1,2,3", "line 3: has 4 cells, and the header has 16"),
        ] {
            let message = table(&format!("{HEADER}{row}\n")).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
