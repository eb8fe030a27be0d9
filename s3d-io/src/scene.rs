//! `scene.toml`: one area's mesh, annotations and scan locations.

use crate::annotations::AnnotationOptions;
use crate::mesh_file::UpAxis;
use crate::texture_file::read_file;
use crate::{Error, Result};
use s3d_geom::glam::{DAffine3, DMat3, DVec3};
use s3d_label::{Class, Room};
use serde::Deserialize;
use std::collections::BTreeMap;
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
    /// The annotated points: files and folders, see [`Annotations::open`](crate::Annotations::open). At least one.
    pub annotations: Vec<PathBuf>,
    /// How they are read. Faults stop.
    pub annotation_options: AnnotationOptions,
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
    annotations: AnnotationTable,
    cameras: Option<CamerasTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AnnotationTable {
    path: Option<PathBuf>,
    paths: Option<Vec<PathBuf>>,
    class: Option<String>,
    instance: Option<String>,
    room: Option<String>,
    rooms: Option<String>,
    #[serde(default)]
    columns: Vec<String>,
    #[serde(default)]
    offset_m: [f64; 3],
    #[serde(default)]
    unknown_as_clutter: bool,
    #[serde(default)]
    classes: BTreeMap<String, String>,
}

impl AnnotationTable {
    fn options(&self) -> std::result::Result<AnnotationOptions, String> {
        let room: Option<Room> = match &self.room {
            Some(name) => Some(name.parse().map_err(|e| format!("annotations.room: {e}"))?),
            None => None,
        };
        let mut classes = BTreeMap::new();
        for (key, word) in &self.classes {
            let class: Option<Class> = match word.as_str() {
                "" => None,
                word => Some(word.parse().map_err(|e| format!("annotations.classes.{key:?}: {e}"))?),
            };
            classes.insert(key.clone(), class);
        }
        if !self.offset_m.iter().all(|v| v.is_finite()) {
            return Err(format!("annotations.offset_m = {:?} is not finite", self.offset_m));
        }
        Ok(AnnotationOptions {
            unknown_as_clutter: self.unknown_as_clutter,
            classes,
            room,
            class_column: self.class.clone(),
            instance_column: self.instance.clone(),
            room_column: self.rooms.clone(),
            columns: self.columns.clone(),
            offset_m: DVec3::from_array(self.offset_m),
            ..AnnotationOptions::default()
        })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshTable {
    path: PathBuf,
    up: Option<UpAxis>,
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
/// Annotations of other kinds, and how they are read (see [`AnnotationOptions`]); every key but the path may be left out:
///
/// ```toml
/// [annotations]
/// path       = "cloud.laz"            # or paths = ["office_1.ply", "office_2.ply"]
/// class      = "classification"       # the column of classes
/// instance   = "point_source_id"      # the column of instance numbers
/// room       = "office_1"             # the room of points that name none
/// rooms      = "room"                 # the column of rooms
/// columns    = ["x", "y", "z", "class"]         # of a plain NPY array
/// offset_m   = [500000.0, 4000000.0, 0.0]       # subtracted from coordinates
/// unknown_as_clutter = true           # classes without a meaning; else they stop
/// [annotations.classes]
/// "2" = "floor"
/// "7" = ""                            # unlabelled
/// ```
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
    let existing = |key: &str, written: &Path| {
        let full = folder.join(written);
        if full.is_file() {
            return Ok(full);
        }
        let state = if full.exists() { "is no" } else { "is not there; it should be a" };
        Err(Error::format(path, format!("{key} = {written:?}: {} {state} file", full.display())))
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
    let table = &document.annotations;
    let (key, written) = match (&table.path, &table.paths) {
        (Some(path), None) => ("annotations.path", std::slice::from_ref(path)),
        (None, Some(paths)) if !paths.is_empty() => ("annotations.paths", &paths[..]),
        _ => {
            return Err(Error::format(
                path,
                "annotations needs either path or paths, a list of at least one",
            ));
        }
    };
    let mut annotations = Vec::new();
    for written in written {
        let full = folder.join(written);
        if !full.exists() {
            let message = format!("{key} = {written:?}: {} is not there", full.display());
            return Err(Error::format(path, message));
        }
        annotations.push(full);
    }
    let annotation_options = table.options().map_err(|why| Error::format(path, why))?;
    Ok(SceneFile {
        path: path.to_owned(),
        area: document.area.get(),
        up: document.mesh.up.unwrap_or(UpAxis::Y),
        mesh: existing("mesh.path", &document.mesh.path)?,
        annotations,
        annotation_options,
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
        assert_eq!(scene.annotations[0], dir.path().join("Area_2"));
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
    fn clouds_and_how_they_are_read() {
        let scene = read(GOOD).unwrap();
        assert_eq!(scene.annotation_options, AnnotationOptions::default());
        let table = "paths = [\"Area_2\", \"c.csv\"]\nclass = \"classification\"\ninstance = \"point_source_id\"\n\
                     room = \"office_1\"\nrooms = \"room\"\ncolumns = [\"x\", \"y\"]\noffset_m = [5e5, -1, 0.5]\n\
                     unknown_as_clutter = true\n[annotations.classes]\n\"2\" = \"floor\"\n7 = \"\"";
        let scene = read(&GOOD.replace("path = \"Area_2\"", table)).unwrap();
        assert!(scene.annotations[1].ends_with("c.csv"));
        let expected = AnnotationOptions {
            class_column: Some("classification".into()),
            instance_column: Some("point_source_id".into()),
            room: Some("office_1".parse().unwrap()),
            room_column: Some("room".into()),
            columns: vec!["x".into(), "y".into()],
            offset_m: DVec3::new(5e5, -1.0, 0.5),
            unknown_as_clutter: true,
            classes: BTreeMap::from([("2".into(), Some(Class::Floor)), ("7".into(), None)]),
            ..AnnotationOptions::default()
        };
        assert_eq!(scene.annotation_options, expected);
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
            ("path = \"Area_2\"", "", "either path or paths"),
            ("path = \"Area_2\"", "paths = []", "either path or paths"),
            ("path = \"Area_2\"", "path = \"Area_2\"\npaths = [\"c.csv\"]", "either path or paths"),
            ("path = \"Area_2\"", "paths = [\"Area_2\", \"gone.las\"]", "annotations.paths = \"gone.las\""),
            ("\"Area_2\"", "\"Area_2\"\nroom = \"kitchen_1\"", "annotations.room: \"kitchen_1\""),
            ("\"Area_2\"", "\"Area_2\"\nroms = \"a\"", "line 7: unknown field `roms`"),
            (
                "\"Area_2\"",
                "\"Area_2\"\nclasses = { 2 = \"sky\" }",
                "annotations.classes.\"2\": \"sky\" is no class",
            ),
            ("\"Area_2\"", "\"Area_2\"\noffset_m = [1, inf, 0]", "not finite"),
            ("c.csv", "gone.csv", "cameras.path = \"gone.csv\""),
        ] {
            let message = read(&GOOD.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("scene.toml"), "{to}: {message}");
        }
        assert!(matches!(read_scene(Path::new("gone.toml")), Err(Error::Io { .. })));
    }
}
