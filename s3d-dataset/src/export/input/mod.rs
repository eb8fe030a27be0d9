//! Everything that an export reads, found and checked before anything is written.

pub(crate) mod area;
pub(crate) mod cameras;
mod colors;
pub(crate) mod masks;
pub(crate) mod memory;
pub(crate) mod mesh;
mod numbering;
mod parts;
pub(crate) mod photographs;
pub(crate) mod pictures;
mod published;
pub(crate) mod requested;
mod scene;
pub(crate) mod stamps;

use crate::error::{Error, InputError, Result};
use crate::export::input::area::AreaInput;
use crate::export::input::memory::SceneSource;
use crate::export::input::numbering::label_table;
use crate::export::input::scene::Opened;
use crate::fuse::scene_of_raw;
use crate::mesh_axes::MeshAxes;
use crate::options::placing::Placing;
use s3d_io::Error as FileError;
use s3d_io::cloud::{AnnotationOptions, OnFault};
use s3d_label::LabelTable;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The scene file of a folder, which goes before whatever else is found in it.
const SCENE: &str = "scene.toml";

/// The error for a folder in which no scene is found.
pub(crate) fn no_scene(folder: &Path) -> FileError {
    let sets: Vec<&str> = s3d_io::scene::found_sets().collect();
    let message = format!(
        "holds no scene.toml, no published area (3d/rgb.obj), and no scene of {}: name the file of a mesh, \
         or write a scene.toml",
        sets.join(", ")
    );
    FileError::format(folder, message)
}

/// All areas, and the table of all their labels.
pub(crate) struct Inputs {
    pub(crate) areas: Vec<AreaInput>,
    pub(crate) table: LabelTable,
}

impl Inputs {
    /// Reads the scene files, the names in their annotations (all points, if these are clouds) and their
    /// lists of scan locations. If `asked` says how, locations are placed instead.
    pub(crate) fn open(scenes: &[SceneSource], asked: Option<Placing>, lenient: bool) -> Result<Self> {
        let mut areas = Self::open_areas(scenes, asked, lenient, true)?;
        let table = label_table(&mut areas)?;
        Ok(Self { areas, table })
    }

    /// Opens the scenes without their annotations: a plan that has this `table` replaces them. Rooms are not
    /// known then.
    pub(crate) fn open_planned(
        scenes: &[SceneSource],
        asked: Option<Placing>,
        lenient: bool,
        table: LabelTable,
    ) -> Result<Self> {
        let areas = Self::open_areas(scenes, asked, lenient, false)?;
        Ok(Self { areas, table })
    }

    /// Opens a scene without its annotations, which need not exist.
    pub(crate) fn open_bare(scene: SceneSource) -> Result<AreaInput> {
        let mut areas = Self::open_areas(&[scene], None, false, false)?;
        Ok(areas.remove(0))
    }

    fn open_areas(
        scenes: &[SceneSource],
        asked: Option<Placing>,
        lenient: bool,
        annotations: bool,
    ) -> Result<Vec<AreaInput>> {
        let opened = Opened { annotations, keep_mesh: scenes.len() == 1, is_part: false };

        let mut areas: Vec<AreaInput> = Vec::new();
        let mut area_of: BTreeMap<u32, PathBuf> = BTreeMap::new();
        let mut location_of: BTreeMap<String, PathBuf> = BTreeMap::new();

        for scene in scenes {
            let area = open_area(scene, asked, lenient, scenes.len(), opened)?;
            let path = &area.path;
            if let Some(other) = area_of.insert(area.number, path.clone()) {
                return Err(
                    InputError::SameArea { first: other, second: path.clone(), area: area.number }.into()
                );
            }

            let list = &area.cameras_path;
            for location in area.cameras.listed() {
                // On many file systems, uuids that differ only by case would give one file.
                if let Some(other) = location_of.insert(location.uuid.to_ascii_lowercase(), list.clone()) {
                    let message = format!("uuid {} is also in {}", location.uuid, other.display());
                    return Err(match location.line {
                        0 => FileError::format(list, message),
                        line => FileError::line(list, line, message),
                    }
                    .into());
                }
            }

            areas.push(area);
        }

        areas.sort_by_key(|a| a.number);
        refuse_mixed(&areas)?;
        Ok(areas)
    }

    /// Whether there are labels at all: all areas have some, or none has.
    pub(crate) fn are_labelled(&self) -> bool {
        self.areas.iter().all(|area| area.is_labelled)
    }

    /// The numbers of the areas, ascending.
    pub(crate) fn numbers(&self) -> Vec<u32> {
        self.areas.iter().map(|a| a.number).collect()
    }
}

/// Opens a scene, which is one of several.
fn open_area(
    scene: &SceneSource,
    asked: Option<Placing>,
    lenient: bool,
    scenes: usize,
    opened: Opened,
) -> Result<AreaInput> {
    let mut file = match scene {
        SceneSource::Memory(scene) => return AreaInput::in_memory(scene, asked, opened),
        SceneSource::Meshes { paths, up, units } => {
            return AreaInput::of_meshes(paths, MeshAxes { up: *up, units: *units }, asked, opened);
        }
        SceneSource::Path(path) => path.clone(),
    };
    if file.is_dir() && !file.join(SCENE).is_file() {
        let Some(mut found) = s3d_io::scene::find_scene(&file)? else {
            if !file.join("3d").is_dir() {
                return Err(no_scene(&file).into());
            }
            return AreaInput::published(&file, None, asked, opened);
        };
        set_reading(&mut found.scene.annotation_options, lenient, scenes);
        return AreaInput::found(found, asked, opened);
    }
    if file.is_dir() {
        file = file.join(SCENE);
    }

    let mut scene = s3d_io::scene::read_scene(&file)?;
    set_reading(&mut scene.annotation_options, lenient, scenes);
    if scene.parts.is_empty() {
        return AreaInput::open(scene, asked, opened);
    }
    if opened.is_part {
        return Err(Error::unfit(
            &file,
            "is a part of a scene, and has parts itself: name them in that scene",
        ));
    }
    let scenes = scenes * scene.parts.len();
    // Labels of the whole area replace those of its parts.
    let annotations = opened.annotations && !scene.is_labelled;
    let opened_part = Opened { annotations, keep_mesh: true, is_part: true };
    AreaInput::of_parts(scene, asked, opened, |path| {
        let mut source: SceneSource = path.into();
        if let SceneSource::Path(path) = &mut source
            && let Some(fused) = scene_of_raw(path)?
        {
            *path = fused;
        }
        open_area(&source, asked, lenient, scenes, opened_part)
    })
}

/// Says how the annotations of one of several scenes are read.
fn set_reading(options: &mut AnnotationOptions, lenient: bool, scenes: usize) {
    options.on_fault = if lenient { OnFault::Skip } else { OnFault::Stop };
    // The annotations of all areas wait in memory together.
    options.points_in_memory /= scenes as u64;
}

/// Refuses areas with and without labels, and areas of different taxonomies.
fn refuse_mixed(areas: &[AreaInput]) -> Result<()> {
    let with = areas.iter().find(|area| area.is_labelled);
    let without = areas.iter().find(|area| !area.is_labelled);
    if let Some(with) = with
        && let Some(without) = without
    {
        return Err(InputError::MixedLabels { with: with.path.clone(), without: without.path.clone() }.into());
    }

    let Some(first) = areas.first() else { return Ok(()) };
    match areas.iter().find(|area| area.taxonomy != first.taxonomy) {
        None => Ok(()),
        Some(other) => Err(InputError::MixedTaxonomies {
            first: (first.path.clone(), first.taxonomy.name().to_owned()),
            second: (other.path.clone(), other.taxonomy.name().to_owned()),
        }
        .into()),
    }
}
