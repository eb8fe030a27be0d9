//! `scene.toml`: one area's mesh, annotations and scan locations.

use crate::cloud::annotations::AnnotationOptions;
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use crate::mesh::file::{LengthUnit, UpAxis};
use crate::scene::annotations::AnnotationTable;
use crate::scene::cameras::{CameraSource, CamerasTable, similarity};
use crate::scene::frames::{FrameSource, FramesTable};
use crate::scene::other_kind::{SCENE, other_kind};
use crate::scene::rgb::{PictureSource, RgbEntry};
use crate::scene::taxonomy::TaxonomyEntry;
use crate::scene::toml_fault::toml_fault;
use s3d_geom::glam::{DAffine3, DVec3};
use s3d_label::Taxonomy;
use serde::Deserialize;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

/// The parts of a scan of one area. Paths are resolved: relative ones start at the folder of the file that
/// names them.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// The `scene.toml` itself.
    pub path: PathBuf,
    /// The number of the area, from 1.
    pub area: u32,
    /// The folder of a published area that mesh, labels and scan locations come from; then `mesh` and
    /// `annotations` are empty. See [`PublishedArea`](crate::scene::PublishedArea).
    pub published: Option<PathBuf>,
    /// Takes that area's frame to the world's: turns, shifts and scales. For one of 5a and 5b.
    pub world_from_published: DAffine3,
    /// The textured mesh, in one file or several that are joined in this order. At least one.
    pub mesh: Vec<PathBuf>,
    /// Which axis of the mesh points up. Not said, it is +Y: by glTF's definition, and as in the published
    /// OBJ files.
    pub up: UpAxis,
    /// The unit of the mesh's coordinates: metres if neither this nor the mesh's file says it. Points and
    /// scan locations are in metres.
    pub units: Option<LengthUnit>,
    /// What is subtracted from the mesh's positions in `f64`, in the world's axes. `None`: nothing, unless
    /// it lies far from the origin ([`MeshOrigin::Near`](crate::mesh::MeshOrigin::Near)).
    pub mesh_offset_m: Option<DVec3>,
    /// Where its colours come from.
    pub mesh_colors: MeshColors,
    /// Which classes and types of rooms there are; a published area brings its own.
    pub taxonomy: Taxonomy,
    /// The file that the taxonomy is read from, if it is in one of its own.
    pub taxonomy_file: Option<PathBuf>,
    /// Whether there are labels. If not, `annotations` is empty; a published area brings its own.
    pub is_labelled: bool,
    /// The annotated points: files and folders, see [`Annotations::open`](crate::cloud::Annotations::open).
    /// None: the labels that came with the mesh, see
    /// [`Annotations::of_mesh`](crate::cloud::Annotations::of_mesh).
    pub annotations: Vec<PathBuf>,
    /// How they are read. Faults stop.
    pub annotation_options: AnnotationOptions,
    /// Whether the file says what is subtracted from them. If not, it is what is subtracted from the mesh.
    pub annotations_have_offset: bool,
    /// Where the scan locations come from; `None` if the file does not say.
    pub cameras: Option<CameraSource>,
    /// The scanner's pictures, if RGB images are made from them and not from the mesh's texture.
    pub pictures: Option<PictureSource>,
    /// Photographs with poses, each of which becomes a view.
    pub frames: Option<FrameSource>,
}

/// Where the colours of a mesh come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MeshColors {
    /// The mesh's own: its textures, the colours of its vertices or materials.
    #[default]
    File,
    /// The annotated points, for a mesh without textures (`s3d_geom::VertexColors`).
    Points,
}

impl SceneFile {
    /// A scene of meshes alone, without labels, as area 1. Its `path` is that of the first.
    pub fn of_meshes(mesh: Vec<PathBuf>, up: UpAxis) -> Self {
        Self {
            path: mesh.first().cloned().unwrap_or_default(),
            area: 1,
            published: None,
            world_from_published: DAffine3::IDENTITY,
            mesh,
            up,
            units: None,
            mesh_offset_m: None,
            mesh_colors: MeshColors::File,
            taxonomy: Taxonomy::s3dis(),
            taxonomy_file: None,
            is_labelled: false,
            annotations: Vec::new(),
            annotation_options: AnnotationOptions::default(),
            annotations_have_offset: false,
            cameras: None,
            pictures: None,
            frames: None,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    area: NonZeroU32,
    taxonomy: Option<TaxonomyEntry>,
    published: Option<PublishedTable>,
    mesh: Option<MeshTable>,
    annotations: Option<AnnotationTable>,
    cameras: Option<CamerasTable>,
    rgb: Option<RgbEntry>,
    frames: Option<FramesTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PublishedTable {
    path: PathBuf,
    transform: Option<[[f64; 4]; 4]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshTable {
    path: Option<PathBuf>,
    paths: Option<Vec<PathBuf>>,
    up: Option<UpAxis>,
    units: Option<LengthUnit>,
    offset_m: Option<[f64; 3]>,
    #[serde(default)]
    colors: MeshColors,
}

/// Reads a `scene.toml`:
///
/// ```toml
/// area = 1
/// [mesh]
/// path = "rgb.obj"    # or paths = ["floor_1.ply", "floor_2.ply"]
/// up   = "y"          # or "z"; "y" if it is left out
/// units = "cm"        # or "m", "mm", "ft", "in"; left out: what the mesh's file says, or metres
/// offset_m = [500000.0, 5400000.0, 300.0]  # subtracted from positions; found by itself if it is left out
/// colors = "points"   # a mesh without textures takes the colours of the annotated points
/// [annotations]       # left out: there are no labels
/// path = "Area_1"     # or mesh = true: the labels that came with the mesh
/// [cameras]
/// path = "cameras.csv"  # or place = 2.0: scan locations on the floor, two metres apart
/// [rgb]               # or, before the first table, rgb = "texture"; that, if it is left out
/// source = "captures" # or "texture", "skybox", "panorama"
/// path = "raw"        # the pictures' folder; named after the source if it is left out
/// [frames]            # photographs with poses: see `FrameSource`
/// path = "transforms.json"
/// ```
///
/// Before the first table, `taxonomy = "scannet20"` names the classes: S3DIS's if it is left out, one of
/// [`Taxonomy::BUILT_IN`], or a file (see [`read_taxonomy`](crate::scene::read_taxonomy)).
///
/// Without `[cameras]` the caller places scan locations. The list's frame is the world (Z-up) unless the
/// table says `up = "y"`, or gives a `transform` (four rows of four numbers, world from file, applied after
/// `up`).
///
/// Annotations of other kinds, and how they are read (see [`AnnotationOptions`]); every key but the path may
/// be left out:
///
/// ```toml
/// [annotations]
/// path       = "cloud.laz"            # or paths = ["office_1.ply", "office_2.ply"]
/// class      = "classification"       # the column of classes
/// instance   = "point_source_id"      # the column of instance numbers
/// room       = "office_1"             # the room of points that name none
/// rooms      = "room"                 # the column of rooms
/// columns    = ["x", "y", "z", "class"]         # of a plain NPY array
/// offset_m   = [500000.0, 4000000.0, 0.0]       # subtracted from coordinates; the mesh's if left out
/// unknown_as_clutter = true           # classes without a meaning; else they stop
/// [annotations.classes]
/// "2" = "floor"
/// "7" = ""                            # unlabelled
/// ```
///
/// A published area, or an export, brings mesh, labels and scan locations of its own, instead of `[mesh]`,
/// `[annotations]` and `[cameras]`, of which the last may still be given:
///
/// ```toml
/// area = 5
/// [published]
/// path      = "area_5b"
/// # to the frame of 5a; may be left out
/// transform = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
/// ```
///
/// Further keys of `[rgb]` are those of [`crate::scene::PictureOptions`], of `[frames]` those of
/// [`FrameSource`], with `up` and `transform` as in `[cameras]`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the line for a key that is missing or unknown and for a wrong value;
/// without one if a file or folder that it names is not there.
pub fn read_scene(path: &Path) -> Result<SceneFile> {
    if let Some(what) = other_kind(path) {
        return Err(Error::unsupported(path, format!("is {what}; {SCENE}")));
    }
    let bytes = read_file(path)?;
    let no_text = |_| Error::format(path, format!("is no text in UTF-8; {SCENE}"));
    parse_scene(std::str::from_utf8(&text_of(&bytes, path)?).map_err(no_text)?, path)
}

/// As [`read_scene`], from the text of a scene file. Errors call it `path`, and the files that it names are
/// looked for in the folder of `path`.
///
/// # Errors
/// As [`read_scene`].
pub fn parse_scene(text: &str, path: &Path) -> Result<SceneFile> {
    let document: Document = toml::from_str(text).map_err(|e| toml_fault(&e, text, path))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let fault = |message: String| Error::format(path, message);
    let found = |key: &str, written: &Path, what: &str, fits: fn(&Path) -> bool| {
        let full = folder.join(written);
        if fits(&full) {
            return Ok(full);
        }
        let state = match (full.exists(), what) {
            (true, _) => format!("is no {what}"),
            (false, "") => "is not there".to_owned(),
            (false, _) => format!("is not there; it should be a {what}"),
        };
        Err(fault(format!("{key} = {written:?}: {} {state}", full.display())))
    };
    let (mut published, mut world_from_published) = (None, DAffine3::IDENTITY);
    if let Some(table) = &document.published {
        if document.mesh.is_some() || document.annotations.is_some() {
            return Err(fault(
                "[published] brings a mesh and its labels: leave out [mesh] and [annotations]".into(),
            ));
        }
        published = Some(found("published.path", &table.path, "folder", Path::is_dir)?);
        if let Some(rows) = table.transform {
            world_from_published = similarity(rows).map_err(|m| fault(format!("[published]: {m}")))?;
        }
    }
    if published.is_some() && document.taxonomy.is_some() {
        return Err(fault("[published] brings a taxonomy: leave out the key".into()));
    }
    let (taxonomy, taxonomy_file) = document
        .taxonomy
        .map_or(Ok((Taxonomy::s3dis(), None)), |entry| entry.taxonomy(path))?;
    let is_labelled = published.is_some() || document.annotations.is_some();
    let (mut mesh, mut annotations) = (Vec::new(), Vec::new());
    let (mut up, mut annotation_options) = (UpAxis::Y, AnnotationOptions::default());
    let (mut mesh_offset_m, mut annotations_have_offset, mut units) = (None, false, None);
    let mut mesh_colors = MeshColors::File;
    if published.is_none() {
        let meshes = document.mesh.ok_or_else(|| fault("missing field `mesh`".to_owned()))?;
        mesh = match (&meshes.path, &meshes.paths) {
            (Some(written), None) => vec![found("mesh.path", written, "file", Path::is_file)?],
            (None, Some(paths)) if !paths.is_empty() => paths
                .iter()
                .map(|written| found("mesh.paths", written, "file", Path::is_file))
                .collect::<Result<_>>()?,
            _ => return Err(fault("mesh needs either path or paths, a list of at least one".into())),
        };
        if let Some(labels) = &document.annotations {
            let (key, written) = labels.paths().map_err(fault)?;
            annotations = written
                .iter()
                .map(|written| found(key, written, "", Path::exists))
                .collect::<Result<_>>()?;
            annotation_options = labels.options(&taxonomy).map_err(fault)?;
            annotations_have_offset = labels.has_offset();
        }
        mesh_offset_m = meshes.offset_m.map(DVec3::from_array);
        if let Some(offset_m) = mesh_offset_m.filter(|o| !o.is_finite()) {
            return Err(fault(format!("mesh.offset_m = {:?} is not finite", offset_m.to_array())));
        }
        mesh_colors = meshes.colors;
        if mesh_colors == MeshColors::Points && annotations.is_empty() {
            return Err(fault(
                "mesh.colors = \"points\" needs the path of a cloud under [annotations]".into(),
            ));
        }
        up = meshes.up.unwrap_or(UpAxis::Y);
        units = meshes.units;
    }
    let cameras = match document.cameras.map(CamerasTable::source).transpose() {
        Ok(Some(CameraSource::Listed { path: written, world_from_file })) => {
            let path = found("cameras.path", &written, "", Path::exists)?;
            Some(CameraSource::Listed { path, world_from_file })
        }
        Ok(other) => other,
        Err(message) => return Err(fault(format!("[cameras]: {message}"))),
    };
    let mut pictures = document.rgb.map_or(Ok(None), |entry| entry.pictures()).map_err(fault)?;
    if let Some(source) = &mut pictures {
        source.path = found("rgb.path", &source.path, "folder", Path::is_dir)?;
    }
    let frames = document.frames.map(|table| table.source(&found, &fault)).transpose()?;
    Ok(SceneFile {
        path: path.to_owned(),
        area: document.area.get(),
        published,
        world_from_published,
        mesh,
        up,
        units,
        mesh_offset_m,
        mesh_colors,
        taxonomy,
        taxonomy_file,
        is_labelled,
        annotations,
        annotation_options,
        annotations_have_offset,
        cameras,
        pictures,
        frames,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::rgb::{PictureKind, PictureOptions, UnseenColor};
    use s3d_label::Class;
    use std::collections::BTreeMap;
    use std::fs;

    const GOOD: &str = "area = 2\n[mesh]\npath = \"a.obj\"\nup = \"z\"\n[annotations]\npath = \"Area_2\"\n\
                        [cameras]\npath = \"c.csv\"\n";

    fn read(text: &str) -> Result<SceneFile> {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("a.obj"), "").unwrap();
        fs::write(dir.path().join("c.csv"), "").unwrap();
        fs::create_dir(dir.path().join("Area_2")).unwrap();
        fs::create_dir(dir.path().join("skybox")).unwrap();
        fs::create_dir(dir.path().join("raw")).unwrap();
        let path = dir.path().join("scene.toml");
        fs::write(&path, text).unwrap();
        let scene = read_scene(&path)?;
        if scene.published.is_some() {
            return Ok(scene);
        }
        assert_eq!(scene.mesh[0], dir.path().join("a.obj"));
        assert!(
            scene
                .annotations
                .first()
                .is_none_or(|path| *path == dir.path().join("Area_2"))
        );
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
        assert_eq!((scene.mesh_offset_m, scene.annotations_have_offset), (None, false));
        assert_eq!(scene.units, None);
        let scaled = read(&GOOD.replace("up = \"z\"\n", "units = \"in\"\n")).unwrap();
        assert_eq!(scaled.units, Some(LengthUnit::Inch));
        assert!(read(&GOOD.replace("up = \"z\"\n", "units = \"km\"\n")).is_err());
        let moved = read(&GOOD.replace("up = \"z\"\n", "offset_m = [5e5, 0, 7]\n")).unwrap();
        assert_eq!(moved.mesh_offset_m, Some(DVec3::new(5e5, 0.0, 7.0)));
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
    fn colours_come_from_the_texture_or_from_pictures() {
        let pictures = |rgb: &str| {
            let plain = rgb.starts_with("rgb");
            let text = if plain {
                format!("{rgb}\n{GOOD}")
            } else {
                format!("{GOOD}{rgb}\n")
            };
            let mut pictures = read(&text).unwrap().pictures;
            if let Some(source) = &mut pictures {
                source.path = source.path.file_name().unwrap().into();
            }
            pictures
        };
        let source = |kind, path: &str, options| Some(PictureSource { kind, path: path.into(), options });
        let options = PictureOptions::default();
        for texture in ["", "rgb = \"texture\"", "[rgb]\nsource = \"texture\""] {
            assert_eq!(pictures(texture), None);
        }
        assert_eq!(pictures("rgb = \"skybox\""), source(PictureKind::SkyBox, "skybox", options.clone()));
        let captures = pictures("[rgb]\nsource = \"captures\"\npath = \"raw\"\nparallax = false\nsize = 512");
        let small = PictureOptions { parallax: false, size: Some(512), ..options.clone() };
        assert_eq!(captures, source(PictureKind::Captures, "raw", small));
        let panorama =
            pictures("[rgb]\nsource = \"panorama\"\npath = \"raw\"\nyaw_deg = 90\nunseen = \"nearby\"");
        let turned = PictureOptions { yaw_deg: 90.0, unseen: UnseenColor::Nearby, ..options };
        assert_eq!(panorama, source(PictureKind::Panorama, "raw", turned));
        for (rgb, words) in [
            ("rgb = \"textures\"", "line 1: unknown variant `textures`, expected one of `texture`, `skybox`"),
            ("rgb = 3", "line 1: invalid type: integer `3`, expected \"texture\""),
            ("rgb = \"captures\"", "captures is not there; it should be a folder"),
            ("[rgb]\npath = \"raw\"", "missing field `source`"),
            ("[rgb]\nsource = \"skybox\"\nfolder = \"raw\"", "unknown field `folder`"),
            ("[rgb]\nsource = \"skybox\"\npath = \"gone\"", "rgb.path = \"gone\""),
            ("[rgb]\nsource = \"skybox\"\nyaw_deg = 1", "rgb.yaw_deg belongs to source = \"panorama\""),
            ("[rgb]\nsource = \"skybox\"\nsize = 16", "rgb.size = 16"),
            ("[rgb]\nsource = \"texture\"\npath = \"raw\"", "has no path"),
            ("[rgb]\nsource = \"panorama\"\npath = \"raw\"\nyaw_deg = nan", "rgb.yaw_deg = NaN"),
        ] {
            let text = if rgb.starts_with("rgb") {
                format!("{rgb}\n{GOOD}")
            } else {
                format!("{GOOD}{rgb}\n")
            };
            let message = read(&text).unwrap_err().to_string();
            assert!(message.contains(words), "{rgb}: {message}");
        }
    }

    #[test]
    fn clouds_and_how_they_are_read() {
        let scene = read(GOOD).unwrap();
        assert_eq!(scene.annotation_options, AnnotationOptions::default());
        let table = "paths = [\"Area_2\", \"c.csv\"]\nclass = \"classification\"\n\
                     instance = \"point_source_id\"\n\
                     room = \"office_1\"\nrooms = \"room\"\ncolumns = [\"x\", \"y\"]\n\
                     offset_m = [5e5, -1, 0.5]\n\
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
            classes: BTreeMap::from([("2".into(), Some(Class::FLOOR)), ("7".into(), None)]),
            ..AnnotationOptions::default()
        };
        assert_eq!(scene.annotation_options, expected);
        assert!(scene.annotations_have_offset);
    }

    #[test]
    fn published_areas_bring_their_own() {
        let text = "area = 5\n[published]\npath = \"Area_2\"\n";
        let scene = read(text).unwrap();
        assert!(scene.published.unwrap().ends_with("Area_2"));
        assert!(scene.mesh.is_empty() && scene.annotations.is_empty() && scene.cameras.is_none());
        let moved = format!(
            "{text}transform = [[0,-1,0,7], [1,0,0,0], [0,0,1,0], [0,0,0,1]]\n[cameras]\nplace = 3\n"
        );
        let scene = read(&moved).unwrap();
        assert_eq!(scene.world_from_published.transform_point3(DVec3::X), DVec3::new(7.0, 1.0, 0.0));
        assert_eq!(scene.cameras, Some(CameraSource::Placed { distance_m: 3.0 }));
        for (text, words) in [
            (format!("{text}[mesh]\npath = \"a.obj\"\n"), "leave out [mesh]"),
            (text.replace("Area_2", "Area_3"), "published.path = \"Area_3\""),
            (
                format!("{text}transform = [[2,0,0,0], [0,1,0,0], [0,0,1,0], [0,0,0,1]]\n"),
                "[published]: transform",
            ),
            ("area = 5\n[cameras]\nplace = 3\n".into(), "missing field `mesh`"),
        ] {
            let message = read(&text).unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
    }

    #[test]
    fn meshes_come_in_several_files_and_with_labels() {
        let several = GOOD.replace("path = \"a.obj\"", "paths = [\"a.obj\", \"c.csv\"]");
        assert_eq!(read(&several).unwrap().mesh.len(), 2);
        assert!(
            read(&GOOD.replace("path = \"Area_2\"", "mesh = true"))
                .unwrap()
                .annotations
                .is_empty()
        );
        let unlabelled = read(&GOOD.replace("[annotations]\npath = \"Area_2\"\n", "")).unwrap();
        assert!(!unlabelled.is_labelled && read(GOOD).unwrap().is_labelled);
        for (from, to, words) in [
            ("path = \"a.obj\"", "paths = []", "mesh needs either path or paths"),
            ("path = \"a.obj\"", "", "mesh needs either path or paths"),
            ("path = \"a.obj\"", "paths = [\"a.obj\", \"gone.obj\"]", "mesh.paths = \"gone.obj\""),
            ("path = \"Area_2\"", "mesh = true\npath = \"Area_2\"", "annotations needs one of"),
            ("path = \"Area_2\"", "mesh = false", "annotations needs one of"),
        ] {
            let message = read(&GOOD.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(words), "{to}: {message}");
        }
    }

    #[test]
    fn a_file_of_another_kind_is_called_what_it_is() {
        let dir = tempfile::tempdir().unwrap();
        for (name, words) in [
            ("m.obj", "m.obj: is a mesh, not a scene"),
            ("M.GLB", "M.GLB: is a mesh, not a scene"),
            ("scan.ply", "is a mesh or a cloud, not a scene"),
            ("scan.laz", "is a cloud of points, not a scene"),
            ("cameras.csv", "is a table, not a scene"),
            ("scene", "is no text: it holds zero bytes"),
        ] {
            let path = dir.path().join(name);
            fs::write(&path, b"# Blender\no Cube\n\0").unwrap();
            let message = read_scene(&path).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
            assert_eq!(message.contains("scene.toml, that names"), name != "scene", "{message}");
        }
    }

    #[test]
    fn a_scene_may_be_in_any_unicode() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("a.obj"), "").unwrap();
        let path = dir.path().join("scene.toml");
        let text = "area = 4\n[mesh]\npath = \"a.obj\"\n[annotations]\nmesh = true\n";
        for bytes in crate::fs::encoding::tests::encoded(text) {
            fs::write(&path, bytes).unwrap();
            assert_eq!(read_scene(&path).unwrap().area, 4);
        }
    }

    #[test]
    fn every_fault_is_named() {
        for (from, to, words) in [
            ("area = 2", "area = 0", "line 1: "),
            ("area = 2", "area = \"2\"", "line 1: invalid type"),
            ("area = 2", "", "missing field `area`"),
            ("up = \"z\"", "up = \"x\"", "line 4: unknown variant `x`, expected `y` or `z`"),
            ("up = \"z\"", "upp = \"z\"", "line 4: unknown field `upp`, expected one of `path`"),
            ("area = 2", "area = 2\nareas = 3", "line 2: unknown field `areas`"),
            ("path = \"c.csv\"", "", "[cameras]: needs a path"),
            ("[cameras]", "[cameras", "line 7"),
            ("a.obj", "b.obj", "mesh.path = \"b.obj\""),
            ("a.obj", "Area_2", "is no file"),
            ("Area_2", "Area_9", "annotations.path = \"Area_9\""),
            ("path = \"Area_2\"", "", "one of path, paths"),
            ("path = \"Area_2\"", "paths = []", "one of path, paths"),
            ("path = \"Area_2\"", "path = \"Area_2\"\npaths = [\"c.csv\"]", "one of path, paths"),
            ("path = \"Area_2\"", "paths = [\"Area_2\", \"gone.las\"]", "annotations.paths = \"gone.las\""),
            ("\"Area_2\"", "\"Area_2\"\nroom = \"kitchen_1\"", "annotations.room: \"kitchen_1\""),
            ("\"Area_2\"", "\"Area_2\"\nroms = \"a\"", "line 7: unknown field `roms`"),
            (
                "\"Area_2\"",
                "\"Area_2\"\nclasses = { 2 = \"sky\" }",
                "annotations.classes.\"2\": \"sky\" is no class",
            ),
            ("\"Area_2\"", "\"Area_2\"\noffset_m = [1, inf, 0]", "not finite"),
            ("\"a.obj\"", "\"a.obj\"\noffset_m = [1, inf, 0]", "mesh.offset_m"),
            ("c.csv", "gone.csv", "cameras.path = \"gone.csv\""),
        ] {
            let message = read(&GOOD.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("scene.toml"), "{to}: {message}");
        }
        assert!(matches!(read_scene(Path::new("gone.toml")), Err(Error::Io { .. })));
    }
}
