//! Everything that an export reads, found and checked before anything is written.

pub(crate) mod memory;
pub(crate) mod mesh;
pub(crate) mod pictures;
pub(crate) mod requested;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::export::input::memory::{SceneSource, SharedScene};
use crate::export::input::mesh::{MeshFrame, MeshSource};
use crate::export::labels::annotate::SurveyedRoom;
use crate::options::ExportOptions;
use crate::store::request::InputRecord;
use crate::tables::dataset::check_area;
use crate::useful::{Estimate, Finding, count_findings};
use glam::{DAffine3, DVec3};
use s3d_geom::TriMesh;
use s3d_io::Error as FileError;
use s3d_io::camera::ScanLocation;
use s3d_io::cloud::{AnnotatedInstance, AnnotationOptions, Annotations, OnFault};
use s3d_io::mesh::{MeshFile, MeshOptions, MeshOrigin};
use s3d_io::scene::{CameraSource, PictureSource, PublishedArea, PublishedOptions, SceneFile};
use s3d_label::{Class, Label, LabelTable, NumberingError, Room, number_area};
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
    /// The rooms, in the order of their names, each with its annotated instances.
    pub(crate) rooms: Vec<RoomInput>,
    /// The scan locations.
    pub(crate) cameras: Cameras,
    /// The list that they come from, for messages.
    pub(crate) cameras_path: PathBuf,
    /// What was odd in the annotations, as a sentence each.
    pub(crate) warnings: Vec<String>,
    /// Whether what is not as it should be in the annotations is skipped and counted.
    pub(crate) lenient: bool,
    /// All files and folders that it is made from: the data set must not lie on them.
    pub(crate) files: Vec<PathBuf>,
    /// Those that are read, and whose bytes decide those of the data set; but for what its mesh names.
    pub(crate) sources: Vec<PathBuf>,
    /// Those among them that are annotations and nothing else.
    pub(crate) annotations: Vec<PathBuf>,
    /// What it is made from that is no file.
    pub(crate) records: Vec<InputRecord>,
}

/// What of an area is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Opened {
    /// Whether its annotations are; if not, a plan stands for them, and it has no rooms.
    annotations: bool,
    /// Whether its mesh stays in memory. Several are read again where they are needed, so that they never
    /// share it.
    keep_mesh: bool,
}

/// Where an area is looked at from.
pub(crate) enum Cameras {
    /// At these scan locations, in the order of their list, each with its room if the list tells.
    Listed(Vec<ScanLocation>, Vec<Option<Room>>),
    /// At places that are chosen once its rooms are known, no two of a room nearer than this, metres.
    Placed(f64),
}

impl Cameras {
    /// The locations that are known before the area is labelled.
    pub(crate) fn listed(&self) -> &[ScanLocation] {
        match self {
            Self::Listed(locations, _) => locations,
            Self::Placed(_) => &[],
        }
    }
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
    /// Reads the scene files, the names in their annotations (of clouds, all points) and their lists of scan
    /// locations, instead of which locations are placed if `place_m` says how far apart.
    pub(crate) fn open(scenes: &[SceneSource], place_m: Option<f64>, lenient: bool) -> Result<Self> {
        let mut areas = Self::open_areas(scenes, place_m, lenient, true)?;
        let table = label_table(&mut areas)?;
        Ok(Self { areas, table })
    }

    /// The same without the annotations, for which a plan stands that has this table: rooms are not known
    /// then.
    pub(crate) fn open_planned(
        scenes: &[SceneSource],
        place_m: Option<f64>,
        lenient: bool,
        table: LabelTable,
    ) -> Result<Self> {
        let areas = Self::open_areas(scenes, place_m, lenient, false)?;
        Ok(Self { areas, table })
    }

    fn open_areas(
        scenes: &[SceneSource],
        place_m: Option<f64>,
        lenient: bool,
        annotations: bool,
    ) -> Result<Vec<AreaInput>> {
        let opened = Opened { annotations, keep_mesh: scenes.len() == 1 };
        let mut areas: Vec<AreaInput> = Vec::new();
        let mut area_of: BTreeMap<u32, PathBuf> = BTreeMap::new();
        let mut location_of: BTreeMap<String, PathBuf> = BTreeMap::new();
        for scene in scenes {
            let area = match scene {
                SceneSource::Memory(scene) => AreaInput::in_memory(scene, place_m, opened)?,
                SceneSource::Path(path) if path.is_dir() => {
                    AreaInput::published(path, None, place_m, opened)?
                }
                SceneSource::Path(path) => {
                    let mut scene = s3d_io::scene::read_scene(path)?;
                    let options = &mut scene.annotation_options;
                    options.on_fault = if lenient { OnFault::Skip } else { OnFault::Stop };
                    // Areas wait beside one another.
                    options.points_in_memory /= scenes.len() as u64;
                    AreaInput::open(scene, place_m, opened)?
                }
            };
            let path = &area.path;
            if let Some(other) = area_of.insert(area.number, path.clone()) {
                return Err(Error::Input(format!(
                    "{} and {} are both area {}: give each scene an area of its own",
                    other.display(),
                    path.display(),
                    area.number
                )));
            }
            let list = &area.cameras_path;
            for location in area.cameras.listed() {
                // Files of two uuids that differ by case alone would be one on many file systems.
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
        Ok(areas)
    }

    /// The numbers of the areas, ascending.
    pub(crate) fn numbers(&self) -> Vec<u32> {
        self.areas.iter().map(|a| a.number).collect()
    }
}

impl AreaInput {
    fn open(scene: SceneFile, place_m: Option<f64>, opened: Opened) -> Result<Self> {
        if let Some(folder) = &scene.published {
            let folder = folder.clone();
            return Self::published(&folder, Some(scene), place_m, opened);
        }
        let options = &scene.annotation_options;
        let source = MeshSource::Files {
            paths: scene.mesh.clone(),
            up: scene.up,
            // The columns that are named are those of the annotations.
            options: MeshOptions {
                class_column: options.class_column.clone().filter(|_| scene.annotations.is_empty()),
                instance_column: options.instance_column.clone().filter(|_| scene.annotations.is_empty()),
                origin: scene.mesh_offset_m.map_or(MeshOrigin::Near, MeshOrigin::At),
            },
        };
        // The mesh comes first: what lies far from it need not be read.
        let file = source.read()?;
        let frame = MeshFrame::of(&file);
        let file = Some(file).filter(|_| opened.keep_mesh || scene.annotations.is_empty());
        let (mut rooms, mut warnings) = (Vec::new(), Vec::new());
        if opened.annotations {
            let mut annotations = match &file {
                Some(file) if scene.annotations.is_empty() => Annotations::of_mesh(file, options)?,
                _ => {
                    let given = Some(options.offset_m).filter(|_| scene.annotations_have_offset);
                    let options = AnnotationOptions {
                        offset_m: given.unwrap_or(frame.offset_m),
                        mesh_bounds: Some(frame.bounds),
                        ..options.clone()
                    };
                    Annotations::open(&scene.annotations, &options)?
                }
            };
            warnings = std::mem::take(&mut annotations.warnings);
            let of = scene.annotations.first().unwrap_or(&scene.mesh[0]);
            rooms = number(scene.area, annotations)
                .map_err(|e| Error::Input(format!("{}: {e}", of.display())))?;
        }
        let mesh_file = file.filter(|_| opened.keep_mesh);
        let Some((cameras, cameras_path)) = listed_cameras(&scene, place_m, frame.offset_m)? else {
            return Err(FileError::format(
                &scene.path,
                "has no scan locations: add [cameras] with a path, or place some with --place-cameras 2 (metres)",
            )
            .into());
        };
        frame.refuse_far_locations(&cameras_path, cameras.listed())?;
        Ok(Self {
            number: scene.area,
            source,
            frame,
            mesh_file,
            rooms,
            cameras,
            warnings,
            lenient: scene.annotation_options.on_fault == OnFault::Skip,
            files: files_of(&scene),
            sources: files_of(&scene),
            annotations: scene.annotations,
            records: Vec::new(),
            cameras_path,
            pictures: scene.pictures,
            path: scene.path,
        })
    }

    /// Takes an area that is no file.
    fn in_memory(scene: &SharedScene, place_m: Option<f64>, opened: Opened) -> Result<Self> {
        scene.check()?;
        let name = scene.name();
        let (mut rooms, mut warnings) = (Vec::new(), Vec::new());
        let frame = MeshFrame::of(&scene.mesh);
        if opened.annotations {
            frame.refuse_far_points(&name, &scene.annotations)?;
            let mut annotations = scene.annotations.clone();
            warnings = std::mem::take(&mut annotations.warnings);
            rooms = number(scene.area, annotations)
                .map_err(|e| Error::Input(format!("{}: {e}", name.display())))?;
        }
        let cameras = match place_m {
            Some(distance_m) => Cameras::Placed(distance_m),
            None if scene.locations.is_empty() => {
                return Err(Error::Input(format!("{}: has no scan locations", name.display())));
            }
            None => Cameras::Listed(scene.locations.clone(), vec![None; scene.locations.len()]),
        };
        frame.refuse_far_locations(&name, cameras.listed())?;
        Ok(Self {
            number: scene.area,
            source: MeshSource::Memory(Arc::clone(&scene.mesh)),
            frame,
            mesh_file: Some(Arc::clone(&scene.mesh)),
            pictures: None,
            rooms,
            cameras,
            cameras_path: name.clone(),
            path: name,
            warnings,
            lenient: false,
            files: Vec::new(),
            sources: Vec::new(),
            annotations: Vec::new(),
            records: scene.records()?,
        })
    }

    /// Opens the folder of a published area; `scene` is what names it, if that is no command line.
    fn published(
        folder: &Path,
        scene: Option<SceneFile>,
        place_m: Option<f64>,
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
        if opened.annotations {
            for label in &mut mesh.labels {
                label.area = area.area;
            }
            let mut annotations = area.annotations(&mesh)?;
            warnings.append(&mut annotations.warnings);
            rooms = published_numbers(&mesh.labels, annotations);
        }
        let listed = match &scene {
            Some(scene) => listed_cameras(scene, place_m, DVec3::ZERO)?,
            None => place_m.map(|distance_m| (Cameras::Placed(distance_m), folder.to_owned())),
        };
        let (cameras, cameras_path) = listed.unwrap_or_else(|| {
            let (locations, rooms) =
                std::mem::take(&mut area.locations).into_iter().map(|l| (l.location, l.room)).unzip();
            (Cameras::Listed(locations, rooms), folder.to_owned())
        });
        let mut files = vec![folder.to_owned()];
        let mut sources = vec![area.mesh.clone(), area.semantic_mesh.clone()];
        sources.extend(area.labels.clone());
        if area.world_offset_m != DVec3::ZERO {
            sources.push(area.conventions());
        }
        let poses = ["data/pose", "pano/pose"].map(|name| folder.join(name));
        sources.extend(poses.into_iter().filter(|path| path.is_dir()));
        if let Some(scene) = &scene {
            files.extend(files_of(scene));
            sources.extend(files_of(scene).into_iter().filter(|path| path != folder));
        }
        let file = Arc::new(mesh.file);
        let frame = MeshFrame::of(&file);
        frame.refuse_far_locations(&cameras_path, cameras.listed())?;
        Ok(Self {
            number: area.area,
            path: scene.as_ref().map_or(folder, |s| &s.path).to_owned(),
            source: MeshSource::Published(Box::new(area)),
            frame,
            mesh_file: opened.keep_mesh.then_some(file),
            pictures: scene.and_then(|s| s.pictures),
            rooms,
            cameras,
            cameras_path,
            warnings,
            lenient: false,
            files,
            sources,
            annotations: Vec::new(),
            records: Vec::new(),
        })
    }

    /// The mesh, read again if it is not in memory.
    pub(crate) fn read_mesh(&self) -> Result<Arc<MeshFile>> {
        self.mesh_file.as_ref().map_or_else(|| self.source.read(), |file| Ok(Arc::clone(file)))
    }

    /// About how much an export of it writes. Placed locations, which are not known yet, count as one on 4 m² of
    /// floor, and floors as a fifth of the mesh.
    pub(crate) fn estimate(&self, mesh: &TriMesh, options: &ExportOptions) -> Estimate {
        let area_m2 = mesh.total_area();
        let locations = match &self.cameras {
            Cameras::Listed(locations, _) => locations.len() as f64,
            Cameras::Placed(distance_m) => area_m2 / 5.0 / distance_m.max(2.0).powi(2),
        };
        Estimate::new(area_m2, locations, options)
    }

    /// What looks wrong about the number of its scan locations. Places nearer to each other than a distance
    /// fill a floor with about one on 0.7 times its square.
    pub(crate) fn count_findings(&self, rooms: &[SurveyedRoom]) -> Vec<Finding> {
        let floor_m2: f64 = rooms.iter().map(|r| r.footprint.area_m2).sum();
        let count = match &self.cameras {
            Cameras::Listed(locations, _) => locations.len() as f64,
            Cameras::Placed(distance_m) => floor_m2 / (0.7 * distance_m.powi(2)),
        };
        count_findings(count, rooms)
    }

    /// The data set's list of labels that the area's folder came with.
    fn published_labels(&self) -> Option<&PathBuf> {
        match &self.source {
            MeshSource::Published(area) => area.labels.as_ref(),
            MeshSource::Files { .. } | MeshSource::Memory(_) => None,
        }
    }

    /// Logs what the area's mesh is, and what was odd in mesh and annotations.
    pub(crate) fn tell_mesh(&self, ctx: &Context, file: &MeshFile) {
        self.frame.tell(ctx);
        self.warnings.iter().chain(&file.warnings).for_each(|w| ctx.warn(w));
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

/// The scan locations that a scene file names, less the mesh's offset, or that are to be placed, and where
/// they come from.
fn listed_cameras(
    scene: &SceneFile,
    place_m: Option<f64>,
    offset_m: DVec3,
) -> Result<Option<(Cameras, PathBuf)>> {
    Ok(match (place_m, &scene.cameras) {
        (Some(distance_m), _) => Some((Cameras::Placed(distance_m), scene.path.clone())),
        (None, Some(CameraSource::Placed { distance_m })) => {
            Some((Cameras::Placed(*distance_m), scene.path.clone()))
        }
        (None, Some(CameraSource::Listed { path, world_from_file })) => {
            let moved = DAffine3::from_translation(-offset_m) * *world_from_file;
            let world_from_file = if offset_m == DVec3::ZERO { world_from_file } else { &moved };
            let locations = s3d_io::camera::read_scan_locations(path, world_from_file)?;
            let rooms = vec![None; locations.len()];
            Some((Cameras::Listed(locations, rooms), path.clone()))
        }
        (None, None) => None,
    })
}

/// What a scene file names, and itself.
fn files_of(scene: &SceneFile) -> Vec<PathBuf> {
    let mut files = vec![scene.path.clone()];
    files.extend(scene.mesh.iter().chain(&scene.annotations).chain(&scene.published).cloned());
    if let Some(CameraSource::Listed { path, .. }) = &scene.cameras {
        files.push(path.clone());
    }
    files.extend(scene.pictures.iter().map(|p| p.path.clone()));
    files
}

/// The table of all labels. That of a published data set is kept whole if it has them all, so that an index
/// means the same in its images and in ours; else it is made of the labels at hand.
fn label_table(areas: &mut [AreaInput]) -> Result<LabelTable> {
    let labels: Vec<Label> =
        areas.iter().flat_map(|a| &a.rooms).flat_map(|r| &r.instances).map(|i| i.label).collect();
    for area in areas.iter_mut() {
        let Some(path) = area.published_labels().cloned() else { continue };
        let names = s3d_io::dataset::read_labels(&path)?;
        match LabelTable::from_names(&names) {
            Ok(table) if labels.iter().all(|l| table.id_of(l).is_some()) => return Ok(table),
            Ok(_) => area.warnings.push(format!(
                "{}: has not every label of the meshes; the table is made anew, so that indices differ from it",
                path.display()
            )),
            Err(e) => area.warnings.push(format!("{}: {e}; the table is made anew", path.display())),
        }
    }
    LabelTable::from_labels(labels).map_err(|e| Error::Input(e.to_string()))
}

/// Gives every instance, whose numbers run per room, its number in the area.
fn number(area: u32, annotations: Annotations) -> Result<Vec<RoomInput>, NumberingError> {
    let keys = annotations.rooms.iter().flat_map(|r| r.instances.iter().map(|i| (r.room, i.class, i.number)));
    let numbered = number_area(area, keys)?;
    let labels = numbered.into_iter().map(|n| ((n.room, n.class, n.number_in_room), n.label)).collect();
    Ok(named(annotations, &labels))
}

/// Gives every instance the label that it was published with: those of a class and room were numbered there
/// in the order of their labels.
fn published_numbers(labels: &[Label], annotations: Annotations) -> Vec<RoomInput> {
    let mut sorted: Vec<Label> = labels.to_vec();
    sorted.sort_by_key(|l| (l.room, l.class, l.instance));
    sorted.dedup();
    let mut names: BTreeMap<(Room, Class, u32), Label> = BTreeMap::new();
    for same in sorted.chunk_by(|a, b| (a.room, a.class) == (b.room, b.class)) {
        names.extend((1..).zip(same).map(|(number, label)| ((label.room, label.class, number), *label)));
    }
    named(annotations, &names)
}

fn named(annotations: Annotations, labels: &BTreeMap<(Room, Class, u32), Label>) -> Vec<RoomInput> {
    let mut rooms: Vec<RoomInput> = annotations
        .rooms
        .into_iter()
        .map(|r| RoomInput {
            room: r.room,
            instances: r
                .instances
                .into_iter()
                .filter_map(|i| {
                    let label = *labels.get(&(r.room, i.class, i.number))?;
                    Some(InstanceInput { label, number_in_room: i.number, points: i })
                })
                .collect(),
        })
        .collect();
    rooms.iter_mut().for_each(|r| r.instances.sort_by_key(|i| (i.label.class, i.number_in_room)));
    rooms.sort_by_key(|r| r.room);
    rooms
}
