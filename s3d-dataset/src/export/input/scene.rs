//! Opens an area of files: a scene file, or meshes alone.

use crate::error::{Error, Result};
use crate::export::input::area::{AreaInput, PictureSet};
use crate::export::input::cameras::Cameras;
use crate::export::input::colors::PointColors;
use crate::export::input::mesh::{MeshFrame, MeshSource};
use crate::export::input::numbering::number;
use crate::export::input::photographs::Photographs;
use crate::mesh_axes::{self, MeshAxes, has_own_frame};
use crate::options::placing::Placing;
use crate::record::request::InputRecord;
use glam::{DAffine3, DVec3};
use s3d_io::cloud::{AnnotatedMesh, AnnotationOptions, Annotations, OnFault};
use s3d_io::mesh::{MeshFile, MeshOptions, MeshOrigin, ToldOffset, UpAxis};
use s3d_io::scene::{CameraSource, FoundScene, MeshColors, PictureSource, SceneFile};
use std::path::PathBuf;
use std::sync::Arc;

/// Which parts of an area are opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Opened {
    /// Whether the annotations are opened. If not, a plan replaces them, and the area has no rooms.
    pub(super) annotations: bool,
    /// Whether the mesh stays in memory. Several meshes are read again where they are needed, so that they
    /// never share the memory.
    pub(super) keep_mesh: bool,
    /// Whether it is a part of another scene. If so, it has no parts itself.
    pub(super) is_part: bool,
}

impl AreaInput {
    /// Opens the area of a scene file.
    pub(super) fn open(scene: SceneFile, asked: Option<Placing>, opened: Opened) -> Result<Self> {
        if let Some(folder) = &scene.published {
            let folder = folder.clone();
            return Self::published(&folder, Some(scene), asked, opened);
        }

        let mut source = mesh_source(&scene);

        // The mesh is read first: annotations that lie far from it need not be read.
        let mut file = source.read()?;
        let mut frame = MeshFrame::of(&file);
        let told = told_offset(&scene)?;
        if let Some(told) = &told {
            frame.told(told.offset_m);
        }
        let takes_colors = scene.mesh_colors == MeshColors::Points;

        let mut rooms = Vec::new();
        let mut notes = Vec::new();
        let mut warnings = Vec::new();
        let mut companions = Vec::new();

        if (opened.annotations || takes_colors) && scene.is_labelled {
            let mut annotations =
                frame.open_beside(|offset_m| open_annotations(&scene, &file, &frame, offset_m))?;
            warnings = std::mem::take(&mut annotations.warnings);
            companions = companions_of(&scene, &mut annotations);

            if takes_colors && let MeshSource::Files { colors, .. } = &mut source {
                let found = PointColors::of(&scene.path, &file.mesh, &annotations)?;
                notes.push(found.sentence());
                warnings.extend(found.doubts());
                *colors = found.vertices.colors;
                let mut colored = Arc::unwrap_or_clone(file);
                colored.mesh = colored.mesh.with_vertex_colors(colors.clone());
                file = Arc::new(colored);
            }

            let of = scene.annotations.first().unwrap_or(&scene.mesh[0]);
            if opened.annotations {
                rooms = number(scene.area, annotations).map_err(|e| Error::unfit(of, e.to_string()))?;
            }
        }

        let mesh_file = opened.keep_mesh.then_some(file);
        let photographs = photographs_of(&scene, &frame)?;

        let listed = cameras_of(&scene, asked, &frame)?;
        let (cameras, cameras_path) = listed.unwrap_or_else(|| {
            // An area with photographs needs no other locations.
            let cameras = if photographs.all.is_empty() {
                Cameras::listed_or_placed(Vec::new(), Vec::new())
            } else {
                Cameras::Listed(Vec::new(), Vec::new())
            };
            (cameras, scene.path.clone())
        });
        if let Some(told) = told {
            let [x, y, z] = told.offset_m.to_array();
            notes.push(format!(
                "{}: the scan's coordinates are the mesh's plus ({x}, {y}, {z}), which the data set states; \
                 points and cameras may have either",
                told.file.display()
            ));
            companions.push(told.file);
        }

        Ok(Self {
            number: scene.area,
            source,
            frame,
            mesh_file,
            is_labelled: scene.is_labelled,
            taxonomy: scene.taxonomy.clone(),
            rooms,
            notes,
            warnings,
            lenient: scene.annotation_options.on_fault == OnFault::Skip,
            files: files_of(&scene)
                .into_iter()
                .chain(companions.iter().cloned())
                .chain(photographs.files().cloned())
                .collect(),
            sources: files_of(&scene)
                .into_iter()
                .chain(companions)
                .chain(photographs.by_folder().into_keys())
                .collect(),
            annotations: scene.annotations,
            records: Vec::new(),
            photographs,
            cameras_path,
            pictures: pictures_of(scene.pictures, &cameras, &frame),
            cameras,
            path: scene.path,
            found: None,
        })
    }

    /// Opens a scene that was found in the folder of a known data set.
    pub(super) fn found(found: FoundScene, asked: Option<Placing>, opened: Opened) -> Result<Self> {
        let mut area = Self::open(found.scene, asked, opened)?;
        area.notes.insert(0, format!("read as a scene of {}", found.set));
        area.records.push(InputRecord::of_text("scene", &found.toml));
        area.found = Some(found.toml);
        Ok(area)
    }

    /// Opens an area of meshes alone. Their up axis and their unit are guessed if nobody says them.
    pub(super) fn of_meshes(
        paths: &[PathBuf],
        axes: MeshAxes,
        asked: Option<Placing>,
        opened: Opened,
    ) -> Result<Self> {
        // In glTF +Y points up, and the unit is the metre.
        let first = paths.first().filter(|path| !has_own_frame(path));
        let unsaid = first.filter(|_| axes.up.is_none() || axes.units.is_none());
        let (mut up, mut units) = (axes.up.unwrap_or(UpAxis::Y), axes.units);
        let (mut notes, mut warnings) = (Vec::new(), Vec::new());
        if let Some(path) = unsaid {
            let found = mesh_axes::find(path, axes, MeshOrigin::Near)?;
            (up, units, notes, warnings) = (found.up, found.units, found.notes, found.warnings);
        }

        let scene = SceneFile { units, ..SceneFile::of_meshes(paths.to_vec(), up) };
        let mut text = format!("area = {}\n[mesh]\nup = {:?}\n", scene.area, up.name());
        text.extend(units.map(|unit| format!("units = {:?}\n", unit.name())));

        let mut area = Self::open(scene, asked, opened)?;
        area.notes.extend(notes);
        area.warnings.extend(warnings);
        area.records.push(InputRecord::of_text("scene", &text));
        Ok(area)
    }
}

/// Returns where the mesh of a scene file is.
fn mesh_source(scene: &SceneFile) -> MeshSource {
    let options = &scene.annotation_options;
    // Named columns are columns of the annotations, if there are any.
    let are_of_mesh = scene.annotations.is_empty();
    MeshSource::Files {
        paths: scene.mesh.clone(),
        up: scene.up,
        options: MeshOptions {
            class_column: options.class_column.clone().filter(|_| are_of_mesh),
            instance_column: options.instance_column.clone().filter(|_| are_of_mesh),
            origin: scene.mesh_offset_m.map_or(MeshOrigin::Near, MeshOrigin::At),
            units: scene.units,
            outside_files: scene.outside_files,
        },
        colors: Vec::new(),
    }
}

/// Opens the annotations of a scene file: its own, or the labels of its mesh.
pub(super) fn open_annotations(
    scene: &SceneFile,
    file: &MeshFile,
    frame: &MeshFrame,
    offset_m: DVec3,
) -> Result<Annotations> {
    let options = &scene.annotation_options;
    if scene.annotations.is_empty() {
        return Ok(Annotations::of_mesh(file, options)?);
    }
    let given = Some(options.offset_m).filter(|_| scene.annotations_have_offset);
    let options = AnnotationOptions {
        offset_m: given.unwrap_or(offset_m),
        mesh_bounds: Some(frame.bounds),
        ..options.clone()
    };
    let outside_files = scene.outside_files;
    let mesh = AnnotatedMesh { file, up: scene.up, units: scene.units, outside_files };
    Ok(Annotations::open_for(&mesh, &scene.annotations, &options)?)
}

/// Takes the files that were read beside those that a scene file names.
pub(super) fn companions_of(scene: &SceneFile, annotations: &mut Annotations) -> Vec<PathBuf> {
    let mut companions = std::mem::take(&mut annotations.companions);
    // A file that lies in a folder of annotations is read with the folder.
    companions.retain(|path| !scene.annotations.iter().any(|named| path.starts_with(named)));
    companions.retain(|path| !scene.mesh.contains(path));
    companions
}

/// Returns the scan locations of a scene file, or how to place them, with the file that says so.
pub(super) fn cameras_of(
    scene: &SceneFile,
    asked: Option<Placing>,
    frame: &MeshFrame,
) -> Result<Option<(Cameras, PathBuf)>> {
    frame.open_beside(|offset_m| {
        let found = Cameras::of_scene(scene, asked, offset_m)?;
        if let Some((cameras, list)) = &found {
            frame.refuse_far_locations(list, cameras.listed())?;
        }
        Ok(found)
    })
}

/// Opens the photographs that a scene file names.
pub(super) fn photographs_of(scene: &SceneFile, frame: &MeshFrame) -> Result<Photographs> {
    let Some(source) = &scene.frames else { return Ok(Photographs::default()) };
    frame.open_beside(|offset_m| {
        let photographs = Photographs::open(source, scene.area, offset_m)?;
        frame.refuse_far_locations(&source.path, &photographs.locations())?;
        Ok(photographs)
    })
}

/// Returns the pictures of a scene file, which are of all listed locations.
pub(super) fn pictures_of(
    source: Option<PictureSource>,
    cameras: &Cameras,
    frame: &MeshFrame,
) -> Vec<PictureSet> {
    let locations = 0..cameras.listed().len();
    let (offset_m, scene_from_part) = (frame.offset_m, DAffine3::IDENTITY);
    let of_all = |source| PictureSet { source, locations, offset_m, scene_from_part };
    source.map(of_all).into_iter().collect()
}

/// Returns the offset that a program tells beside the mesh of a scene, which must not say another itself.
fn told_offset(scene: &SceneFile) -> Result<Option<ToldOffset>> {
    match (scene.mesh.as_slice(), scene.mesh_offset_m) {
        ([mesh], None) => Ok(ToldOffset::beside(mesh)?),
        _ => Ok(None),
    }
}

/// The scene file, and the files and folders that it names.
pub(super) fn files_of(scene: &SceneFile) -> Vec<PathBuf> {
    // A scene that was found has no file.
    let mut files: Vec<PathBuf> = Some(scene.path.clone())
        .filter(|path| path.exists())
        .into_iter()
        .collect();
    files.extend(
        scene
            .mesh
            .iter()
            .chain(&scene.annotations)
            .chain(&scene.published)
            .cloned(),
    );
    if let Some(CameraSource::Listed { path, .. }) = &scene.cameras {
        files.push(path.clone());
    }
    // Pictures may be in the folder or the file that lists the locations.
    if let Some(pictures) = &scene.pictures
        && !files.contains(&pictures.path)
    {
        files.push(pictures.path.clone());
    }
    files.extend(scene.pictures.iter().filter_map(|pictures| pictures.motions.clone()));
    files.extend(scene.taxonomy_file.clone());
    files
}
