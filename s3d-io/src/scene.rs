//! `scene.toml`: one area's mesh, annotations and scan locations.

use crate::mesh_file::UpAxis;
use crate::texture_file::read_file;
use crate::{Error, Result};
use s3d_geom::glam::{DAffine3, DMat3, DVec3};
use serde::Deserialize;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

/// The parts of a scan of one area. Paths are resolved: relative ones start at the folder of the file that names them.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// The `scene.toml` itself.
    pub path: PathBuf,
    /// The number of the area, from 1.
    pub area: u32,
    /// The textured mesh.
    pub mesh: PathBuf,
    /// Which axis of the mesh points up. Not said, it is +Y: by glTF's definition, and as in the published OBJ files.
    pub up: UpAxis,
    /// The area's folder of the S3DIS tree: ROOM/Annotations/CLASS_N.txt.
    pub annotations: PathBuf,
    /// Where the scan locations come from; `None` if the file does not say.
    pub cameras: Option<CameraSource>,
}

/// Where an area's scan locations come from.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraSource {
    /// A list of them: see [`read_scan_locations`](crate::read_scan_locations).
    Listed {
        /// The file or folder.
        path: PathBuf,
        /// Takes its frame to the world's (metres, Z-up): turns, shifts and scales.
        world_from_file: DAffine3,
    },
    /// They are to be put on the floor, no two of a room nearer than this, metres.
    Placed {
        /// Above 0, finite.
        distance_m: f64,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    area: NonZeroU32,
    mesh: MeshTable,
    annotations: PathTable,
    cameras: Option<CamerasTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshTable {
    path: PathBuf,
    up: Option<UpAxis>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathTable {
    path: PathBuf,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CamerasTable {
    path: Option<PathBuf>,
    place: Option<f64>,
    up: Option<UpAxis>,
    transform: Option<[[f64; 4]; 4]>,
}

impl CamerasTable {
    /// What it asks for; a message if that cannot be.
    fn source(self) -> std::result::Result<CameraSource, String> {
        match (self.path, self.place) {
            (Some(_), Some(_)) => Err("path and place exclude each other".into()),
            (None, None) => Err("needs a path, or place = METRES to put scan locations on the floor".into()),
            (None, Some(_)) if self.up.is_some() || self.transform.is_some() => {
                Err("up and transform go with a path".into())
            }
            (None, Some(distance_m)) if distance_m > 0.0 && distance_m.is_finite() => {
                Ok(CameraSource::Placed { distance_m })
            }
            (None, Some(distance_m)) => Err(format!("place = {distance_m} is no distance in metres")),
            (Some(path), None) => {
                let up = self.up.unwrap_or(UpAxis::Z);
                let turn = DMat3::from_cols_array_2d(
                    &[DVec3::X, DVec3::Y, DVec3::Z]
                        .map(|axis| up.world_from_file(axis.as_vec3()).as_dvec3().to_array()),
                );
                let given = self.transform.map_or(Ok(DAffine3::IDENTITY), similarity)?;
                Ok(CameraSource::Listed { path, world_from_file: given * DAffine3::from_mat3(turn) })
            }
        }
    }
}

/// The rows of a 4 × 4 matrix as what it does: turn, shift and scale, nothing else.
fn similarity(rows: [[f64; 4]; 4]) -> std::result::Result<DAffine3, String> {
    const FORM: &str = "transform is no rotation with a scale and a shift: its rows are [x, y, z, shift], the last [0, 0, 0, 1]";
    let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
    let m = DMat3::from_cols(column(0), column(1), column(2));
    let scale = libm::cbrt(m.determinant());
    let is_finite = rows.iter().flatten().all(|v| v.is_finite());
    let is_similar = (m.transpose() * m)
        .abs_diff_eq(DMat3::from_diagonal(DVec3::splat(scale * scale)), 1e-4 * scale * scale);
    if !is_finite || rows[3] != [0.0, 0.0, 0.0, 1.0] || scale <= 0.0 || !is_similar {
        return Err(FORM.into());
    }
    Ok(DAffine3 { matrix3: m, translation: column(3) })
}

/// Reads a `scene.toml`:
///
/// ```toml
/// area = 1
/// [mesh]
/// path = "rgb.obj"
/// up   = "y"          # or "z"; "y" if it is left out
/// [annotations]
/// path = "Area_1"
/// [cameras]
/// path = "cameras.csv"  # or place = 2.0: scan locations on the floor, two metres apart
/// ```
///
/// Without `[cameras]` there is nowhere to stand, unless the caller places scan locations. The list's frame is the world
/// (Z-up) unless the table says `up = "y"`, or gives a `transform` (four rows of four numbers, world from file, applied
/// after `up`).
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the line for a key that is missing or unknown and for a wrong value; without
/// one if a file or folder that it names is not there.
pub fn read_scene(path: &Path) -> Result<SceneFile> {
    let text = String::from_utf8(read_file(path)?).map_err(|_| Error::format(path, "is no text in UTF-8"))?;
    let document: Document = toml::from_str(&text).map_err(|e| {
        let message = e.message().replace('\n', "; ");
        match e.span() {
            // An error at the very start is about the file as a whole: a table that is missing.
            Some(span) if span.end > 0 => {
                let line = text[..span.start.min(text.len())].matches('\n').count() + 1;
                Error::line(path, line as u64, message)
            }
            _ => Error::format(path, message),
        }
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let existing = |key: &str, written: &Path, is_folder: bool| {
        let full = folder.join(written);
        let (what, fits) = if is_folder { ("folder", full.is_dir()) } else { ("file", full.is_file()) };
        if fits {
            return Ok(full);
        }
        let state = if full.exists() { "is no" } else { "is not there; it should be a" };
        Err(Error::format(path, format!("{key} = {written:?}: {} {state} {what}", full.display())))
    };
    let cameras = |table: CamerasTable| match table.source() {
        Ok(CameraSource::Listed { path: written, world_from_file }) => {
            let full = folder.join(&written);
            if !full.exists() {
                let message = format!("cameras.path = {written:?}: {} is not there", full.display());
                return Err(Error::format(path, message));
            }
            Ok(CameraSource::Listed { path: full, world_from_file })
        }
        Ok(placed) => Ok(placed),
        Err(message) => Err(Error::format(path, format!("[cameras]: {message}"))),
    };
    Ok(SceneFile {
        path: path.to_owned(),
        area: document.area.get(),
        up: document.mesh.up.unwrap_or(UpAxis::Y),
        mesh: existing("mesh.path", &document.mesh.path, false)?,
        annotations: existing("annotations.path", &document.annotations.path, true)?,
        cameras: document.cameras.map(cameras).transpose()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const GOOD: &str = "area = 2\n[mesh]\npath = \"a.obj\"\nup = \"z\"\n[annotations]\npath = \"Area_2\"\n[cameras]\npath = \"c.csv\"\n";

    fn read(text: &str) -> Result<SceneFile> {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("a.obj"), "").unwrap();
        fs::write(dir.path().join("c.csv"), "").unwrap();
        fs::create_dir(dir.path().join("Area_2")).unwrap();
        let path = dir.path().join("scene.toml");
        fs::write(&path, text).unwrap();
        let scene = read_scene(&path)?;
        assert_eq!(scene.mesh, dir.path().join("a.obj"));
        assert_eq!(scene.annotations, dir.path().join("Area_2"));
        if let Some(CameraSource::Listed { path, .. }) = &scene.cameras {
            assert_eq!(*path, dir.path().join("c.csv"));
        }
        Ok(scene)
    }

    #[test]
    fn paths_are_resolved_and_up_is_y_unless_said() {
        let scene = read(GOOD).unwrap();
        assert_eq!((scene.area, scene.up), (2, UpAxis::Z));
        assert_eq!(read(&GOOD.replace("up = \"z\"\n", "")).unwrap().up, UpAxis::Y);
    }

    #[test]
    fn cameras_are_listed_placed_or_not_said() {
        let cameras = |table: &str| {
            read(&GOOD.replace("[cameras]\npath = \"c.csv\"\n", table)).map(|scene| scene.cameras)
        };
        let frame = |table: &str| match cameras(&format!("[cameras]\npath = \"c.csv\"\n{table}")).unwrap() {
            Some(CameraSource::Listed { world_from_file, .. }) => world_from_file,
            other => panic!("{other:?}"),
        };
        assert_eq!(cameras("").unwrap(), None);
        assert_eq!(
            cameras("[cameras]\nplace = 2\n").unwrap(),
            Some(CameraSource::Placed { distance_m: 2.0 })
        );
        assert_eq!(frame(""), DAffine3::IDENTITY);
        let p = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!(frame("up = \"y\"\n").transform_point3(p), DVec3::new(1.0, -3.0, 2.0));
        let transform = "transform = [[2, 0, 0, 5], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]\n";
        assert_eq!(frame(transform).transform_point3(p), DVec3::new(7.0, 4.0, 6.0));
        let both = format!("up = \"y\"\n{transform}");
        assert_eq!(frame(&both).transform_point3(p), DVec3::new(7.0, -6.0, 4.0));
        for (table, words) in [
            ("[cameras]\n", "needs a path, or place"),
            ("[cameras]\nplace = 0\n", "is no distance"),
            ("[cameras]\nplace = inf\n", "is no distance"),
            ("[cameras]\nplace = 2\npath = \"c.csv\"\n", "exclude each other"),
            ("[cameras]\nplace = 2\nup = \"y\"\n", "go with a path"),
            (
                "[cameras]\npath = \"c.csv\"\ntransform = [[1,0,0,0],[0,-1,0,0],[0,0,1,0],[0,0,0,1]]\n",
                "no rotation",
            ),
            (
                "[cameras]\npath = \"c.csv\"\ntransform = [[1,0,0,0],[0,2,0,0],[0,0,1,0],[0,0,0,1]]\n",
                "no rotation",
            ),
            (
                "[cameras]\npath = \"c.csv\"\ntransform = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[1,0,0,1]]\n",
                "no rotation",
            ),
            (
                "[cameras]\npath = \"c.csv\"\ntransform = [[1,0,0,nan],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n",
                "no rotation",
            ),
            ("[cameras]\npath = \"gone.csv\"\n", "is not there"),
        ] {
            let message = cameras(table).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("scene.toml"), "{table}: {message}");
        }
    }

    #[test]
    fn every_fault_is_named() {
        for (from, to, words) in [
            ("area = 2", "area = 0", "line 1: "),
            ("area = 2", "area = \"2\"", "line 1: invalid type"),
            ("area = 2", "", "missing field `area`"),
            ("up = \"z\"", "up = \"x\"", "line 4: unknown variant `x`, expected `y` or `z`"),
            ("up = \"z\"", "upp = \"z\"", "line 4: unknown field `upp`, expected `path` or `up`"),
            ("area = 2", "area = 2\nareas = 3", "line 2: unknown field `areas`"),
            ("path = \"c.csv\"", "", "[cameras]: needs a path"),
            ("[cameras]", "[cameras", "line 7"),
            ("a.obj", "b.obj", "mesh.path = \"b.obj\""),
            ("a.obj", "Area_2", "is no file"),
            ("Area_2", "Area_9", "annotations.path = \"Area_9\""),
            ("Area_2", "c.csv", "is no folder"),
            ("c.csv", "gone.csv", "cameras.path = \"gone.csv\""),
        ] {
            let message = read(&GOOD.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("scene.toml"), "{to}: {message}");
        }
        assert!(matches!(read_scene(Path::new("gone.toml")), Err(Error::Io { .. })));
    }
}
