//! `scene.toml`: its tables, and how they become a [`SceneFile`].

use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use crate::mesh::file::{LengthUnit, UpAxis};
use crate::scene::annotations::AnnotationTable;
use crate::scene::cameras::{CameraSource, CamerasTable, similarity};
use crate::scene::file::{MeshColors, SceneFile};
use crate::scene::folder::SceneFolder;
use crate::scene::frames::FramesTable;
use crate::scene::fuse::{FuseKeys, FusePaths, FuseSource};
use crate::scene::other_kind::{SCENE, other_kind};
use crate::scene::parts::{PartTable, part_sources};
use crate::scene::rgb::{PictureKind, PictureSource, RgbEntry};
use crate::scene::taxonomy::TaxonomyEntry;
use crate::scene::toml_fault::toml_fault;
use s3d_geom::glam::DVec3;
use s3d_label::Taxonomy;
use serde::Deserialize;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    area: NonZeroU32,
    taxonomy: Option<TaxonomyEntry>,
    published: Option<PublishedTable>,
    #[serde(default)]
    parts: Vec<PartTable>,
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
    fuse: Option<FusePaths>,
    cell_m: Option<f64>,
    max_error_m: Option<f64>,
    range_m: Option<f64>,
    close_m: Option<f64>,
    up: Option<UpAxis>,
    units: Option<LengthUnit>,
    offset_m: Option<[f64; 3]>,
    #[serde(default)]
    colors: MeshColors,
    #[serde(default)]
    outside_files: bool,
}

/// Reads a `scene.toml`:
///
/// ```toml
/// area = 1
/// [mesh]
/// path = "rgb.obj"    # or paths = ["floor_1.ply", "floor_2.ply"], or fuse = "scan.e57": see `FuseSource`
/// up   = "y"          # or "z"; left out: "y"
/// units = "cm"        # or "m", "mm", "ft", "in"; left out: what the mesh's file says, or metres
/// # Subtracted from positions; left out: chosen if the mesh is far from 0.
/// offset_m = [500000.0, 5400000.0, 300.0]
/// colors = "points"   # a mesh without textures takes the colours of the annotated points
/// outside_files = true  # a glTF file may name files outside its folder; left out: it is refused
/// [annotations]       # left out: there are no labels
/// path = "Area_1"     # or mesh = true: the labels that came with the mesh
/// [cameras]
/// path = "cameras.csv"  # or place = 2.0: scan locations on the floor, two metres apart
/// [rgb]               # left out: "texture"; or, before the first table, rgb = "texture"
/// source = "captures" # or "texture", "skybox", "panorama", "e57"
/// path = "raw"        # the pictures' folder; left out: named after the source. "e57": the file; left out:
///                     # the first one under [cameras] or [annotations]
/// [frames]            # photographs with poses: see `FrameSource`
/// path = "transforms.json"
/// ```
///
/// Before the first table, `taxonomy = "scannet20"` names the classes: one of [`Taxonomy::BUILT_IN`], or a
/// file that [`read_taxonomy`](crate::scene::read_taxonomy) reads. If it is left out, they are the classes of
/// S3DIS.
///
/// Without `[cameras]`, the caller places the scan locations. The frame of a list of cameras is the world
/// (Z-up), unless the table says `up = "y"` or gives a `transform`: four rows of four numbers, world from
/// file, applied after `up`.
///
/// Annotations may be of other kinds. The keys say how they are read (see
/// [`AnnotationOptions`](crate::cloud::AnnotationOptions)); all but the path may be left out:
///
/// ```toml
/// [annotations]
/// path       = "cloud.laz"            # or paths = ["office_1.ply", "office_2.ply"]
/// class      = "classification"       # the column of classes
/// instance   = "point_source_id"      # the column of instance numbers
/// room       = "office_1"             # the room of points that name none
/// rooms      = "room"                 # the column of rooms
/// columns    = ["x", "y", "z", "class"]         # of a file that does not name them
/// offset_m   = [500000.0, 4000000.0, 0.0]       # subtracted from coordinates; left out: the mesh's
/// unknown_as_clutter = true           # left out: unknown classes are errors
/// [annotations.classes]
/// "2" = "floor"
/// "7" = ""                            # unlabelled
/// ```
///
/// A published area, or an export, brings its own mesh, labels and scan locations. It replaces `[mesh]` and
/// `[annotations]`; `[cameras]` may still be given:
///
/// ```toml
/// area = 5
/// [published]
/// path      = "area_5b"
/// # to the frame of 5a; left out: the frame of the files
/// transform = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
/// ```
///
/// An area that was scanned in parts is joined from their scenes. `[cameras]` and `[annotations]` of the
/// whole area may be given beside them:
///
/// ```toml
/// area = 5
/// [[parts]]
/// path  = "5a.toml"   # a scene file, a published area, a mesh, a raw scan, a folder of another data set
/// [[parts]]
/// path  = "5b.toml"
/// align = true        # or transform, from its frame to the area's; left out: they share a frame
/// ```
///
/// The other keys of `[rgb]` are the fields of [`PictureOptions`](crate::scene::PictureOptions). The other
/// keys of `[frames]` are the fields of [`FrameSource`](crate::scene::FrameSource), with `up` and `transform`
/// as in `[cameras]`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`], with the line for a missing key, an unknown key or a wrong value,
/// without a line if a file or folder that it names does not exist; [`Error::Unsupported`] for the file of a
/// mesh, a cloud or another known kind.
pub fn read_scene(path: &Path) -> Result<SceneFile> {
    if let Some(what) = other_kind(path) {
        return Err(Error::unsupported(path, format!("is {what}; {SCENE}")));
    }
    let bytes = read_file(path)?;
    let text = text_of(&bytes, path).map_err(|e| explained(e, path))?;
    let text = std::str::from_utf8(&text)
        .map_err(|_| Error::format(path, format!("is no text in UTF-8; {SCENE}")))?;
    parse_scene(text, path).map_err(|e| explained(e, path))
}

/// Adds what a scene is to the error of a file that is not named as one.
fn explained(error: Error, path: &Path) -> Error {
    match error {
        Error::Format { path: of, place, message }
            if of == path && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) =>
        {
            Error::Format { path: of, place, message: format!("{message}; {SCENE}") }
        }
        e => e,
    }
}

/// Reads like [`read_scene`], from the text of a scene file. Errors call the file `path`, and the files that
/// it names are looked up in the folder of `path`.
///
/// # Errors
/// Like [`read_scene`].
pub fn parse_scene(text: &str, path: &Path) -> Result<SceneFile> {
    let document: Document = toml::from_str(text).map_err(|e| toml_fault(&e, text, path))?;
    let folder = SceneFolder::of(path);
    let mut scene = SceneFile {
        path: path.to_owned(),
        area: document.area.get(),
        is_labelled: document.published.is_some() || document.annotations.is_some(),
        ..SceneFile::of_meshes(Vec::new(), UpAxis::Y)
    };

    if let Some(table) = &document.published {
        if document.mesh.is_some() || document.annotations.is_some() {
            let message = "[published] brings a mesh and its labels: leave out [mesh] and [annotations]";
            return Err(folder.fault(message));
        }
        table.add_to(&mut scene, folder)?;
        if document.taxonomy.is_some() {
            return Err(folder.fault("[published] brings a taxonomy: leave out the key"));
        }
    }
    if !document.parts.is_empty()
        && let Some(key) = document.besides_parts()
    {
        let message = format!("[[parts]] bring their meshes, labels and pictures: leave out {key}");
        return Err(folder.fault(message));
    }
    (scene.taxonomy, scene.taxonomy_file) = document
        .taxonomy
        .map_or(Ok((Taxonomy::s3dis(), None)), |entry| entry.taxonomy(path))?;

    if !document.parts.is_empty() {
        scene.parts = part_sources(document.parts, folder)?;
        if let Some(table) = &document.annotations {
            add_annotations(table, &mut scene, folder)?;
        }
    } else if scene.published.is_none() {
        let mesh = document.mesh.ok_or_else(|| folder.fault("missing field `mesh`"))?;
        scene.fuse = mesh.fuse_keys().source(path, folder)?;
        scene.mesh = match &scene.fuse {
            Some(fuse) => mesh.fused(fuse, folder)?,
            None => mesh.files(folder)?,
        };
        if let Some(table) = &document.annotations {
            add_annotations(table, &mut scene, folder)?;
        }
        mesh.add_to(&mut scene, folder)?;
    }
    scene.cameras = document.cameras.map(|table| camera_source(table, folder)).transpose()?;
    scene.pictures = document
        .rgb
        .map_or(Ok(None), |entry| picture_source(entry, &scene, folder))?;
    scene.frames = document.frames.map(|table| table.source(folder)).transpose()?;
    Ok(scene)
}

impl Document {
    /// The first key that no area of parts has.
    fn besides_parts(&self) -> Option<&'static str> {
        let of_meshes = self.annotations.as_ref().is_some_and(AnnotationTable::is_of_mesh);
        let keys = [
            ("[published]", self.published.is_some()),
            ("[mesh]", self.mesh.is_some()),
            ("rgb", self.rgb.is_some()),
            ("[frames]", self.frames.is_some()),
            ("annotations.mesh", of_meshes),
            ("taxonomy", self.taxonomy.is_some() && self.annotations.is_none()),
        ];
        keys.into_iter().find(|(_, is_given)| *is_given).map(|(key, _)| key)
    }
}

impl PublishedTable {
    fn add_to(&self, scene: &mut SceneFile, folder: SceneFolder<'_>) -> Result<()> {
        scene.published = Some(folder.folder("published.path", &self.path)?);
        if let Some(rows) = self.transform {
            scene.world_from_published =
                similarity(rows).map_err(|m| folder.fault(format!("[published]: {m}")))?;
        }
        Ok(())
    }
}

impl MeshTable {
    fn files(&self, folder: SceneFolder<'_>) -> Result<Vec<PathBuf>> {
        match (&self.path, &self.paths) {
            (Some(written), None) => Ok(vec![folder.file("mesh.path", written)?]),
            (None, Some(paths)) if !paths.is_empty() => {
                paths.iter().map(|written| folder.file("mesh.paths", written)).collect()
            }
            _ => Err(folder.fault("mesh needs either path or paths, a list of at least one")),
        }
    }

    fn fuse_keys(&self) -> FuseKeys<'_> {
        let Self { up, cell_m, max_error_m, range_m, close_m, .. } = *self;
        FuseKeys { fuse: self.fuse.as_ref(), up, cell_m, max_error_m, range_m, close_m }
    }

    /// Returns the mesh that `fuse` makes, which stands in the world of the scan.
    fn fused(&self, fuse: &FuseSource, folder: SceneFolder<'_>) -> Result<Vec<PathBuf>> {
        let others = [
            ("path", self.path.is_some()),
            ("paths", self.paths.is_some()),
            ("units", self.units.is_some()),
            ("outside_files", self.outside_files),
        ];
        match others.iter().find(|(_, is_given)| *is_given) {
            Some((key, _)) => Err(folder.fault(format!("mesh.fuse makes the mesh: leave out mesh.{key}"))),
            None => Ok(vec![fuse.mesh()]),
        }
    }

    /// Adds everything but the files. The annotations of `scene` are known.
    fn add_to(&self, scene: &mut SceneFile, folder: SceneFolder<'_>) -> Result<()> {
        scene.mesh_offset_m = self.offset_m.map(DVec3::from_array);
        if let Some(offset_m) = scene.mesh_offset_m.filter(|o| !o.is_finite()) {
            return Err(folder.fault(format!("mesh.offset_m = {:?} is not finite", offset_m.to_array())));
        }
        scene.mesh_colors = self.colors;
        if self.colors == MeshColors::Points && scene.annotations.is_empty() {
            return Err(
                folder.fault("mesh.colors = \"points\" needs the path of a cloud under [annotations]")
            );
        }
        let up = if scene.fuse.is_some() { Some(UpAxis::Z) } else { self.up };
        scene.up = up.unwrap_or(UpAxis::Y);
        scene.units = self.units;
        scene.outside_files = self.outside_files;
        Ok(())
    }
}

/// Adds the annotations, which mean what the taxonomy of `scene` says.
fn add_annotations(table: &AnnotationTable, scene: &mut SceneFile, folder: SceneFolder<'_>) -> Result<()> {
    let (key, written) = table.paths().map_err(|m| folder.fault(m))?;
    scene.annotations = written
        .iter()
        .map(|written| folder.any(key, written))
        .collect::<Result<_>>()?;
    scene.annotation_options = table.options(&scene.taxonomy).map_err(|m| folder.fault(m))?;
    scene.annotations_have_offset = table.has_offset();
    Ok(())
}

fn camera_source(table: CamerasTable, folder: SceneFolder<'_>) -> Result<CameraSource> {
    match table.source() {
        Ok(CameraSource::Listed { path: written, world_from_file }) => {
            Ok(CameraSource::Listed { path: folder.any("cameras.path", &written)?, world_from_file })
        }
        Ok(placed) => Ok(placed),
        Err(message) => Err(folder.fault(format!("[cameras]: {message}"))),
    }
}

/// Returns the source of pictures. The annotations and the cameras of `scene` are known.
fn picture_source(
    entry: RgbEntry,
    scene: &SceneFile,
    folder: SceneFolder<'_>,
) -> Result<Option<PictureSource>> {
    let lacks_file = entry.lacks_file();
    let Some(mut source) = entry.pictures().map_err(|m| folder.fault(m))? else { return Ok(None) };
    source.path = match source.kind {
        PictureKind::E57 if lacks_file => e57_of(scene).ok_or_else(|| {
            folder.fault(
                "rgb = \"e57\" needs a file: neither [cameras] nor [annotations] names an .e57; write [rgb] \
                 with source = \"e57\" and path = \"scan.e57\"",
            )
        })?,
        PictureKind::E57 => folder.file("rgb.path", &source.path)?,
        PictureKind::SkyBox | PictureKind::Captures | PictureKind::Panorama => {
            folder.folder("rgb.path", &source.path)?
        }
    };

    let motions = source.motions.take();
    source.motions = motions.map(|path| folder.file("rgb.motions", &path)).transpose()?;

    if let Some(CameraSource::Listed { path, world_from_file }) = &scene.cameras
        && *path == source.path
    {
        source.world_from_file = *world_from_file;
    }
    Ok(Some(source))
}

/// Returns the first E57 file that names the scan locations or the annotations.
fn e57_of(scene: &SceneFile) -> Option<PathBuf> {
    let cameras = match &scene.cameras {
        Some(CameraSource::Listed { path, .. }) => Some(path),
        Some(CameraSource::Placed { .. }) | None => None,
    };
    let is_e57 = |path: &&PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("e57"));
    cameras.into_iter().chain(&scene.annotations).find(is_e57).cloned()
}
