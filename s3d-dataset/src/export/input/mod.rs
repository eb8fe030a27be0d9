//! Everything that an export reads, found and checked before anything is written.

pub(crate) mod cameras;
mod colors;
pub(crate) mod memory;
pub(crate) mod mesh;
mod numbering;
pub(crate) mod photographs;
pub(crate) mod pictures;
pub(crate) mod requested;
mod unit;
mod up_axis;

use crate::context::Context;
use crate::error::{Error, InputError, Result};
use crate::export::input::cameras::Cameras;
use crate::export::input::colors::PointColors;
use crate::export::input::memory::{SceneSource, SharedScene};
use crate::export::input::mesh::{MeshFrame, MeshSource};
use crate::export::input::numbering::{label_table, number, published_numbers};
use crate::export::input::photographs::Photographs;
use crate::export::input::unit::UnitGuess;
use crate::export::input::up_axis::UpGuess;
use crate::options::ExportOptions;
use crate::options::placing::Placing;
use crate::record::data_set::check_area;
use crate::record::request::InputRecord;
use crate::survey::annotated::SurveyedRoom;
use crate::survey::room_names::{InstanceName, RoomNames};
use crate::useful::{Estimate, Finding, count_findings};
use glam::{DAffine3, DVec3};
use s3d_geom::{Camera, TriMesh};
use s3d_io::Error as FileError;
use s3d_io::cloud::{AnnotatedInstance, AnnotationOptions, Annotations, OnFault};
use s3d_io::mesh::{LengthUnit, MeshFile, MeshFormat, MeshOptions, MeshOrigin, UpAxis};
use s3d_io::scene::{CameraSource, MeshColors, PictureSource, PublishedArea, PublishedOptions, SceneFile};
use s3d_label::{Label, LabelTable, Room, Taxonomy};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// One area: its files, annotations and scan locations.
pub(crate) struct AreaInput {
    /// Its number, from 1.
    pub(crate) number: u32,
    /// What the user named: a scene file, or the folder of a published area.
    pub(crate) path: PathBuf,
    source: MeshSource,
    /// Where its mesh is.
    pub(crate) frame: MeshFrame,
    /// Its mesh itself, if it is to stay in memory.
    mesh_file: Option<Arc<MeshFile>>,
    /// The scanner's pictures, if colours are taken from them.
    pub(crate) pictures: Option<PictureSource>,
    /// Whether there are labels at all.
    pub(crate) is_labelled: bool,
    /// Which classes and types of rooms it has.
    pub(crate) taxonomy: Taxonomy,
    /// The rooms, in the order of their names, each with its annotated instances.
    pub(crate) rooms: Vec<RoomInput>,
    /// The scan locations.
    pub(crate) cameras: Cameras,
    /// The list that they come from, for messages.
    pub(crate) cameras_path: PathBuf,
    /// Photographs with poses.
    pub(crate) photographs: Photographs,
    /// What was found out about the mesh, as a sentence each.
    pub(crate) notes: Vec<String>,
    /// What was odd in the annotations, as a sentence each.
    pub(crate) warnings: Vec<String>,
    /// Whether faults in the annotations are skipped and counted.
    pub(crate) lenient: bool,
    /// All files and folders that the area is made from. The data set must not lie on them.
    pub(crate) files: Vec<PathBuf>,
    /// The files that are read and whose bytes decide the data set, without the files that its mesh names.
    pub(crate) sources: Vec<PathBuf>,
    /// The sources that are annotations and nothing else.
    pub(crate) annotations: Vec<PathBuf>,
    /// The records of inputs that are no files.
    pub(crate) records: Vec<InputRecord>,
}

/// Which parts of an area are opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Opened {
    /// Whether the annotations are opened. If not, a plan replaces them, and the area has no rooms.
    annotations: bool,
    /// Whether the mesh stays in memory. Several meshes are read again where they are needed, so that they
    /// never share the memory.
    keep_mesh: bool,
}

/// One room of an area.
pub(crate) struct RoomInput {
    pub(crate) room: Room,
    pub(crate) instances: Vec<InstanceInput>,
}

/// One annotated instance: its points and the name that the data set gives it.
pub(crate) struct InstanceInput {
    pub(crate) label: Label,
    pub(crate) number_in_room: u32,
    pub(crate) points: AnnotatedInstance,
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

    fn open_areas(
        scenes: &[SceneSource],
        asked: Option<Placing>,
        lenient: bool,
        annotations: bool,
    ) -> Result<Vec<AreaInput>> {
        let opened = Opened { annotations, keep_mesh: scenes.len() == 1 };

        let mut areas: Vec<AreaInput> = Vec::new();
        let mut area_of: BTreeMap<u32, PathBuf> = BTreeMap::new();
        let mut location_of: BTreeMap<String, PathBuf> = BTreeMap::new();

        for scene in scenes {
            let area = match scene {
                SceneSource::Memory(scene) => AreaInput::in_memory(scene, asked, opened)?,
                SceneSource::Path(path) if path.is_dir() => AreaInput::published(path, None, asked, opened)?,
                SceneSource::Meshes { paths, up, units } => {
                    AreaInput::of_meshes(paths, (*up, *units), asked, opened)?
                }
                SceneSource::Path(path) => {
                    let mut scene = s3d_io::scene::read_scene(path)?;
                    let options = &mut scene.annotation_options;
                    options.on_fault = if lenient { OnFault::Skip } else { OnFault::Stop };
                    // The annotations of all areas wait in memory together.
                    options.points_in_memory /= scenes.len() as u64;
                    AreaInput::open(scene, asked, opened)?
                }
            };

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

impl AreaInput {
    /// Returns the rooms with the names of their instances.
    pub(crate) fn room_names(&self) -> Vec<RoomNames> {
        self.rooms
            .iter()
            .map(|room| RoomNames {
                room: room.room,
                instances: room
                    .instances
                    .iter()
                    .map(|i| InstanceName { label: i.label, number_in_room: i.number_in_room })
                    .collect(),
            })
            .collect()
    }

    fn open(scene: SceneFile, asked: Option<Placing>, opened: Opened) -> Result<Self> {
        if let Some(folder) = &scene.published {
            let folder = folder.clone();
            return Self::published(&folder, Some(scene), asked, opened);
        }

        let options = &scene.annotation_options;
        let mut source = MeshSource::Files {
            paths: scene.mesh.clone(),
            up: scene.up,
            // Named columns are columns of the annotations, if there are any.
            options: MeshOptions {
                class_column: options.class_column.clone().filter(|_| scene.annotations.is_empty()),
                instance_column: options.instance_column.clone().filter(|_| scene.annotations.is_empty()),
                origin: scene.mesh_offset_m.map_or(MeshOrigin::Near, MeshOrigin::At),
                units: scene.units,
            },
            colors: Vec::new(),
        };

        // The mesh is read first: annotations that lie far from it need not be read.
        let mut file = source.read()?;
        let frame = MeshFrame::of(&file);
        let takes_colors = scene.mesh_colors == MeshColors::Points;

        let mut rooms = Vec::new();
        let mut notes = Vec::new();
        let mut warnings = Vec::new();

        if (opened.annotations || takes_colors) && scene.is_labelled {
            let mut annotations = open_annotations(&scene, &file, &frame)?;
            warnings = std::mem::take(&mut annotations.warnings);

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

        let (cameras, cameras_path) =
            Cameras::of_scene(&scene, asked, frame.offset_m)?.unwrap_or_else(|| {
                // An area with photographs needs no other locations.
                let cameras = if photographs.all.is_empty() {
                    Cameras::listed_or_placed(Vec::new(), Vec::new())
                } else {
                    Cameras::Listed(Vec::new(), Vec::new())
                };
                (cameras, scene.path.clone())
            });
        frame.refuse_far_locations(&cameras_path, cameras.listed())?;

        Ok(Self {
            number: scene.area,
            source,
            frame,
            mesh_file,
            is_labelled: scene.is_labelled,
            taxonomy: scene.taxonomy.clone(),
            rooms,
            cameras,
            notes,
            warnings,
            lenient: scene.annotation_options.on_fault == OnFault::Skip,
            files: files_of(&scene)
                .into_iter()
                .chain(photographs.files().cloned())
                .collect(),
            sources: files_of(&scene)
                .into_iter()
                .chain(photographs.by_folder().into_keys())
                .collect(),
            annotations: scene.annotations,
            records: Vec::new(),
            photographs,
            cameras_path,
            pictures: scene.pictures,
            path: scene.path,
        })
    }

    /// Opens an area of meshes alone. Their up axis and their unit are guessed if nobody says them.
    fn of_meshes(
        paths: &[PathBuf],
        (up, units): (Option<UpAxis>, Option<LengthUnit>),
        asked: Option<Placing>,
        opened: Opened,
    ) -> Result<Self> {
        // In glTF +Y points up, and the unit is the metre.
        let first = paths.first().filter(|path| !has_own_frame(path));
        let first = match first.filter(|_| up.is_none() || units.is_none()) {
            Some(path) => {
                let options = MeshOptions { origin: MeshOrigin::Near, units, ..MeshOptions::default() };
                Some(s3d_io::mesh::read_mesh_with(path, UpAxis::Z, &options)?)
            }
            None => None,
        };

        let guess = first
            .as_ref()
            .filter(|_| up.is_none())
            .map(|file| UpGuess::of(&file.mesh));
        let up = up.or(guess.map(|guess| guess.up())).unwrap_or(UpAxis::Y);

        let unsaid = first
            .as_ref()
            .filter(|file| units.is_none() && file.unit_said.is_none());
        let unit_guess = unsaid.map(|file| UnitGuess::of(&file.mesh, up));
        let units = units.or(unit_guess
            .map(|guess| guess.unit())
            .filter(|unit| *unit != LengthUnit::Metre));
        drop(first);

        let scene = SceneFile { units, ..SceneFile::of_meshes(paths.to_vec(), up) };
        let mut text = format!("area = {}\n[mesh]\nup = {:?}\n", scene.area, up.name());
        text.extend(units.map(|unit| format!("units = {:?}\n", unit.name())));

        let mut area = Self::open(scene, asked, opened)?;
        area.notes.extend(guess.map(|guess| guess.sentence()));
        area.notes.extend(unit_guess.and_then(|guess| guess.sentence()));
        area.warnings.extend(guess.and_then(|guess| guess.doubt()));
        area.warnings.extend(unit_guess.and_then(|guess| guess.doubt()));

        area.records.push(InputRecord::of_text("scene", &text));
        Ok(area)
    }

    /// Opens an area that is in memory.
    fn in_memory(scene: &SharedScene, asked: Option<Placing>, opened: Opened) -> Result<Self> {
        scene.check()?;
        let name = scene.name();

        let frame = MeshFrame::of(&scene.mesh);
        let mut rooms = Vec::new();
        let mut warnings = Vec::new();
        if opened.annotations
            && let Some(annotations) = &scene.annotations
        {
            frame.refuse_far_points(&name, annotations)?;
            let mut annotations = annotations.clone();
            warnings = std::mem::take(&mut annotations.warnings);
            rooms = number(scene.area, annotations).map_err(|e| Error::unfit(&name, e.to_string()))?;
        }

        let cameras = match asked {
            Some(placing) => Cameras::Placed(placing),
            None => Cameras::listed_or_placed(scene.locations.clone(), vec![None; scene.locations.len()]),
        };
        frame.refuse_far_locations(&name, cameras.listed())?;

        Ok(Self {
            number: scene.area,
            source: MeshSource::Memory(Arc::clone(&scene.mesh)),
            frame,
            mesh_file: Some(Arc::clone(&scene.mesh)),
            pictures: None,
            is_labelled: scene.annotations.is_some(),
            taxonomy: scene
                .annotations
                .as_ref()
                .map(|a| a.taxonomy.clone())
                .unwrap_or_default(),
            rooms,
            cameras,
            cameras_path: name.clone(),
            photographs: Photographs::default(),
            path: name,
            notes: Vec::new(),
            warnings,
            lenient: false,
            files: Vec::new(),
            sources: Vec::new(),
            annotations: Vec::new(),
            records: scene.records()?,
        })
    }

    /// Opens the folder of a published area. `scene` is the scene file that names it; `None` if the command
    /// line does.
    fn published(
        folder: &Path,
        scene: Option<SceneFile>,
        asked: Option<Placing>,
        opened: Opened,
    ) -> Result<Self> {
        let options = PublishedOptions {
            area: scene.as_ref().map(|s| s.area),
            world_from_area: scene.as_ref().map_or(DAffine3::IDENTITY, |s| s.world_from_published),
        };

        check_area(folder)?;
        let mut area = PublishedArea::open_with(folder, &options)?;
        let mut warnings = std::mem::take(&mut area.warnings);
        let mut rooms = Vec::new();
        let mut mesh = area.read_mesh()?;

        let is_labelled = area.semantic_mesh.is_some();
        if opened.annotations && is_labelled {
            for label in &mut mesh.labels {
                label.area = area.area;
            }
            let mut annotations = area.annotations(&mesh)?;
            warnings.append(&mut annotations.warnings);
            rooms = published_numbers(&mesh.labels, annotations);
        }

        let taxonomy = area.taxonomy.clone();

        let listed = match &scene {
            Some(scene) => Cameras::of_scene(scene, asked, DVec3::ZERO)?,
            None => asked.map(|placing| (Cameras::Placed(placing), folder.to_owned())),
        };
        let (cameras, cameras_path) = listed.unwrap_or_else(|| {
            let (locations, rooms) = std::mem::take(&mut area.locations)
                .into_iter()
                .map(|l| (l.location, l.room))
                .unzip();
            (Cameras::Listed(locations, rooms), folder.to_owned())
        });

        let mut files = vec![folder.to_owned()];
        let mut sources = published_sources(folder, &area);
        if let Some(scene) = &scene {
            files.extend(files_of(scene));
            sources.extend(files_of(scene).into_iter().filter(|path| path != folder));
        }

        let file = Arc::new(mesh.file);
        let frame = MeshFrame::of(&file);
        frame.refuse_far_locations(&cameras_path, cameras.listed())?;

        let photographs = match &scene {
            Some(scene) => photographs_of(scene, &MeshFrame { offset_m: DVec3::ZERO, ..frame })?,
            None => Photographs::default(),
        };

        files.extend(photographs.files().cloned());
        sources.extend(photographs.by_folder().into_keys());

        Ok(Self {
            number: area.area,
            path: scene.as_ref().map_or(folder, |s| &s.path).to_owned(),
            source: MeshSource::Published(Box::new(area)),
            frame,
            mesh_file: opened.keep_mesh.then_some(file),
            pictures: scene.and_then(|s| s.pictures),
            is_labelled,
            taxonomy,
            rooms,
            cameras,
            cameras_path,
            photographs,
            notes: Vec::new(),
            warnings,
            lenient: false,
            files,
            sources,
            annotations: Vec::new(),
            records: Vec::new(),
        })
    }

    /// Returns the mesh, read again if it is not in memory.
    pub(crate) fn read_mesh(&self) -> Result<Arc<MeshFile>> {
        self.mesh_file
            .as_ref()
            .map_or_else(|| self.source.read(), |file| Ok(Arc::clone(file)))
    }

    /// Estimates how much an export of the area writes. Where locations are placed, a fifth of the mesh
    /// counts as floor, and no more of them are counted than stand 2 m apart: a slip in their distance is
    /// another finding.
    pub(crate) fn estimate(&self, mesh: &TriMesh, options: &ExportOptions) -> Estimate {
        let area_m2 = mesh.total_area();
        let floor_m2 = area_m2 / 5.0;
        let most = Cameras::Placed(Placing::Apart(2.0)).count_on(floor_m2).max(1.0);
        let count = self.cameras.count_on(floor_m2);
        let is_listed = matches!(self.cameras, Cameras::Listed(..));
        let locations = if is_listed { count } else { count.min(most) };

        let photographs = self.photographs.all.iter().map(|p| pixels(&p.camera));
        Estimate::new(area_m2, locations, options).with_views(photographs, options)
    }

    /// Returns what looks wrong about the number of its scan locations.
    pub(crate) fn count_findings(&self, rooms: &[SurveyedRoom]) -> Vec<Finding> {
        let floor_m2: f64 = rooms.iter().map(|r| r.footprint.area_m2).sum();
        count_findings(self.cameras.count_on(floor_m2), rooms)
    }

    /// The list of labels of a published area.
    fn published_labels(&self) -> Option<&PathBuf> {
        match &self.source {
            MeshSource::Published(area) => area.labels.as_ref(),
            MeshSource::Files { .. } | MeshSource::Memory(_) => None,
        }
    }

    /// Returns what was odd in mesh, annotations and photographs, a sentence each.
    pub(crate) fn doubts<'a>(&'a self, file: &'a MeshFile) -> impl Iterator<Item = &'a String> {
        self.warnings
            .iter()
            .chain(&self.photographs.warnings)
            .chain(&file.warnings)
    }

    /// Returns a sentence about this area with its files named as in the manifest. These names are the same
    /// wherever the scene lies.
    pub(crate) fn with_short_names(&self, sentence: &str, companions: &[PathBuf]) -> String {
        let mut paths: Vec<&PathBuf> = self.sources.iter().chain(&self.files).chain(companions).collect();
        paths.push(&self.path);
        // A name without folders is short already, and might be a word of the sentence.
        paths.retain(|path| path.components().count() > 1);
        // Long paths come first, so that files are named before the folder they lie in.
        paths.sort_by_key(|path| std::cmp::Reverse(path.as_os_str().len()));
        paths.iter().fold(sentence.to_owned(), |text, path| {
            text.replace(&*path.to_string_lossy(), &requested::name_of(&self.path, path))
        })
    }

    /// Logs what the area's mesh is, and what was odd in mesh and annotations.
    pub(crate) fn tell_mesh(&self, ctx: &Context, file: &MeshFile) {
        self.frame.tell(ctx);
        self.notes.iter().for_each(|note| ctx.info(note));
        self.photographs.notes.iter().for_each(|note| ctx.info(note));
        ctx.warn_each(self.doubts(file));
        ctx.info(format_args!(
            "{}: {} faces, {} vertices, {} textures, {:.1} m²",
            self.source.describe(),
            file.mesh.faces().len(),
            file.mesh.positions().len(),
            file.mesh.textures().len(),
            file.mesh.total_area()
        ));
    }
}

/// The number of pixels of a camera's image.
fn pixels(camera: &Camera) -> f64 {
    f64::from(camera.width) * f64::from(camera.height)
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

/// Opens the annotations of a scene file: its own, or the labels of its mesh.
fn open_annotations(scene: &SceneFile, file: &MeshFile, frame: &MeshFrame) -> Result<Annotations> {
    let options = &scene.annotation_options;
    if scene.annotations.is_empty() {
        return Ok(Annotations::of_mesh(file, options)?);
    }
    let given = Some(options.offset_m).filter(|_| scene.annotations_have_offset);
    let options = AnnotationOptions {
        offset_m: given.unwrap_or(frame.offset_m),
        mesh_bounds: Some(frame.bounds),
        ..options.clone()
    };
    Ok(Annotations::open(&scene.annotations, &options)?)
}

/// Whether the format of a mesh file says which axis points up and what its unit is.
fn has_own_frame(path: &Path) -> bool {
    MeshFormat::of(path).is_some_and(|format| format.defines_frame)
}

/// The files and folders of a published area that decide the bytes of the data set.
fn published_sources(folder: &Path, area: &PublishedArea) -> Vec<PathBuf> {
    let mut sources = vec![area.mesh.clone()];
    sources.extend(area.semantic_mesh.iter().chain(&area.labels).cloned());
    if !area.taxonomy.is_s3dis() {
        sources.push(area.taxonomy_json());
    }
    if area.world_offset_m != DVec3::ZERO {
        sources.push(area.conventions());
    }
    let poses = ["data/pose", "pano/pose"].map(|name| folder.join(name));
    sources.extend(poses.into_iter().filter(|path| path.is_dir()));
    sources
}

/// Opens the photographs that a scene file names.
fn photographs_of(scene: &SceneFile, frame: &MeshFrame) -> Result<Photographs> {
    let Some(source) = &scene.frames else { return Ok(Photographs::default()) };
    let photographs = Photographs::open(source, scene.area, frame.offset_m)?;
    frame.refuse_far_locations(&source.path, &photographs.locations())?;
    Ok(photographs)
}

/// The scene file, and the files and folders that it names.
fn files_of(scene: &SceneFile) -> Vec<PathBuf> {
    let mut files = vec![scene.path.clone()];
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
    files.extend(scene.pictures.iter().map(|p| p.path.clone()));
    files.extend(scene.taxonomy_file.clone());
    files
}
