//! One area: its files, mesh, annotations and scan locations.

use crate::context::Context;
use crate::error::Result;
use crate::export::input::cameras::Cameras;
use crate::export::input::mesh::{MeshFrame, MeshSource};
use crate::export::input::photographs::Photographs;
use crate::export::input::requested;
use crate::options::ExportOptions;
use crate::options::placing::Placing;
use crate::record::request::InputRecord;
use crate::survey::annotated::SurveyedRoom;
use crate::survey::room_names::{InstanceName, RoomNames};
use crate::useful::{Estimate, Finding, count_findings};
use glam::{DAffine3, DVec3};
use s3d_geom::{Camera, TriMesh};
use s3d_io::cloud::AnnotatedInstance;
use s3d_io::mesh::{LengthUnit, MeshFile, UpAxis};
use s3d_io::scene::PictureSource;
use s3d_label::{Label, Room, Taxonomy};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// One area: its files, annotations and scan locations.
pub(crate) struct AreaInput {
    /// Its number, from 1.
    pub(crate) number: u32,
    /// What the user named: a scene file, or the folder of a published area.
    pub(crate) path: PathBuf,
    pub(super) source: MeshSource,
    /// Where its mesh is.
    pub(crate) frame: MeshFrame,
    /// Its mesh itself, if it is to stay in memory.
    pub(super) mesh_file: Option<Arc<MeshFile>>,
    /// The scanner's pictures; empty if colours are not taken from them.
    pub(crate) pictures: Vec<PictureSet>,
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
    /// The scene file that says what was found in its folder, if there is none.
    pub(crate) found: Option<String>,
    /// The records of inputs that are no files.
    pub(crate) records: Vec<InputRecord>,
}

/// The scanner's pictures of some scan locations.
pub(crate) struct PictureSet {
    pub(crate) source: PictureSource,
    /// Which of the listed locations they are of.
    pub(crate) locations: Range<usize>,
    /// What is subtracted from places where they were taken, metres, world axes.
    pub(crate) offset_m: DVec3,
    /// Then they are moved, if they are of a part of the area.
    pub(crate) scene_from_part: DAffine3,
}

impl PictureSet {
    /// From the frame that the poses of the pictures are read in to where the mesh lies.
    pub(crate) fn mesh_from_poses(&self) -> DAffine3 {
        self.scene_from_part * DAffine3::from_translation(-self.offset_m)
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

    /// Returns the mesh, read again if it is not in memory.
    pub(crate) fn read_mesh(&self) -> Result<Arc<MeshFile>> {
        self.mesh_file
            .as_ref()
            .map_or_else(|| self.source.read(), |file| Ok(Arc::clone(file)))
    }

    /// Returns the mesh itself, which is not in memory afterwards.
    pub(crate) fn take_mesh(&mut self) -> Result<MeshFile> {
        let file = match self.mesh_file.take() {
            Some(file) => file,
            None => self.source.read()?,
        };
        Ok(Arc::unwrap_or_clone(file))
    }

    /// The axis of the mesh files that points up, and their unit if it was said or guessed.
    pub(crate) fn mesh_axes(&self) -> Option<(UpAxis, Option<LengthUnit>)> {
        match &self.source {
            MeshSource::Files { up, options, .. } => Some((*up, options.units)),
            MeshSource::Published(_) | MeshSource::Memory(_) | MeshSource::Parts(..) => None,
        }
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

    /// The list of labels of a published area, whose labels keep their names.
    pub(super) fn published_labels(&self) -> Option<&PathBuf> {
        self.source.published_labels()
    }

    /// Whether images of some location have the mesh's own colours.
    pub(crate) fn shows_mesh_colors(&self) -> bool {
        let pictured: usize = self.pictures.iter().map(|set| set.locations.len()).sum();
        self.pictures.is_empty() || pictured < self.cameras.listed().len()
    }

    /// The words for the source of colours in the record of a data set.
    pub(crate) fn rgb_source(&self) -> &'static str {
        self.pictures.first().map_or("texture", |set| set.source.kind.name())
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
