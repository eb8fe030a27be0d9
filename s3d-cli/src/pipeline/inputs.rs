//! Everything that an export reads, found and checked before anything is written.

use super::manifest::half_step;
use crate::failure::{Failure, Outcome};
use s3d_geom::TriMesh;
use s3d_io::{AnnotatedInstance, Annotations, Error, MeshFile, OnFault, ScanLocation, SceneFile};
use s3d_label::{Label, LabelTable, NumberedInstance, Room, number_area};
use std::collections::BTreeMap;
use std::path::PathBuf;
use tracing::{info, warn};

/// The largest number that a half float can hold.
const LARGEST_HALF_M: f32 = 65_504.0;

/// One area: its scene file, annotation files and scan locations.
pub(crate) struct AreaInput {
    pub(crate) scene: SceneFile,
    /// The rooms, in the order of their names, each with its annotation files.
    pub(crate) rooms: Vec<RoomInput>,
    /// The scan locations, in the order of the camera table.
    pub(crate) locations: Vec<ScanLocation>,
    /// What was odd in the annotations, as a sentence each.
    pub(crate) warnings: Vec<String>,
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
    /// Reads the scene files, the names in their annotations (of clouds, all points) and their camera tables.
    pub(crate) fn open(scenes: &[PathBuf], lenient: bool) -> Outcome<Self> {
        let mut areas = Vec::new();
        let mut area_of: BTreeMap<u32, PathBuf> = BTreeMap::new();
        let mut location_of: BTreeMap<String, PathBuf> = BTreeMap::new();
        for path in scenes {
            let mut scene = s3d_io::read_scene(path)?;
            let options = &mut scene.annotation_options;
            options.on_fault = if lenient { OnFault::Skip } else { OnFault::Stop };
            // Areas wait beside one another.
            options.points_in_memory /= scenes.len() as u64;
            if let Some(other) = area_of.insert(scene.area, path.clone()) {
                return Err(Failure::Input(format!(
                    "{} and {} are both area {}: give each scene an area of its own",
                    other.display(),
                    path.display(),
                    scene.area
                )));
            }
            let area = AreaInput::open(scene)?;
            for location in &area.locations {
                if let Some(other) = location_of.insert(location.uuid.clone(), area.scene.cameras.clone()) {
                    return Err(Error::line(
                        &area.scene.cameras,
                        location.line,
                        format!("uuid {} is also in {}", location.uuid, other.display()),
                    )
                    .into());
                }
            }
            areas.push(area);
        }
        areas.sort_by_key(|a| a.scene.area);
        let labels = areas.iter().flat_map(|a| &a.rooms).flat_map(|r| &r.instances).map(|i| i.label);
        let table = LabelTable::from_labels(labels).map_err(|e| Failure::Input(e.to_string()))?;
        Ok(Self { areas, table })
    }

    /// The numbers of the areas, ascending.
    pub(crate) fn numbers(&self) -> Vec<u32> {
        self.areas.iter().map(|a| a.scene.area).collect()
    }
}

impl AreaInput {
    fn open(scene: SceneFile) -> Outcome<Self> {
        let mut annotations = Annotations::open(&scene.annotations, &scene.annotation_options)?;
        let warnings = std::mem::take(&mut annotations.warnings);
        let rooms = number(&scene, annotations)?;
        let locations = s3d_io::read_cameras(&scene.cameras)?;
        Ok(Self { scene, rooms, locations, warnings })
    }

    /// Reads the mesh.
    pub(crate) fn read_mesh(&self) -> Outcome<MeshFile> {
        Ok(s3d_io::read_mesh(&self.scene.mesh, self.scene.up)?)
    }

    /// Logs what the area's mesh is, and what was odd in mesh and annotations.
    pub(crate) fn tell_mesh(&self, file: &MeshFile) {
        self.warnings.iter().chain(&file.warnings).for_each(|w| warn!("{w}"));
        mesh_doubts(&file.mesh).iter().for_each(|w| warn!("{w}"));
        info!(
            "{}: {} faces, {} vertices, {} textures, {:.1} m²",
            self.scene.mesh.display(),
            file.mesh.faces().len(),
            file.mesh.positions().len(),
            file.mesh.textures().len(),
            file.mesh.total_area()
        );
    }
}

/// What looks wrong about the place and size of a mesh, as a sentence each.
pub(crate) fn mesh_doubts(mesh: &TriMesh) -> Vec<String> {
    let mut doubts = Vec::new();
    let bbox = mesh.aabb();
    let (length, farthest) = (bbox.size().max_element(), bbox.min.abs().max(bbox.max.abs()).max_element());
    if length > 1000.0 {
        doubts.push(format!("the mesh is {length:.0} m long: is it in metres?"));
    }
    if length < 0.5 {
        doubts.push(format!("the mesh is only {:.1} cm long: is it in metres?", 100.0 * length));
    }
    if farthest > LARGEST_HALF_M {
        doubts.push(format!(
            "the mesh lies {farthest:.0} m from the origin: half floats of world coordinates end at 65504; move mesh, \
             points and cameras nearer to it"
        ));
    } else if farthest > 1000.0 {
        doubts.push(format!(
            "the mesh lies {farthest:.0} m from the origin: half floats of world coordinates step by {} m there; move \
             mesh, points and cameras nearer to it",
            half_step(farthest)
        ));
    }
    doubts
}

/// Gives every instance, whose numbers run per room, its number in the area.
fn number(scene: &SceneFile, annotations: Annotations) -> Outcome<Vec<RoomInput>> {
    let mut found: BTreeMap<(Room, usize, u32), AnnotatedInstance> = BTreeMap::new();
    let mut keys = Vec::new();
    for room in annotations.rooms {
        for instance in room.instances {
            keys.push((room.room, instance.class, instance.number));
            found.insert((room.room, instance.class.index(), instance.number), instance);
        }
    }
    let numbered = number_area(scene.area, keys)
        .map_err(|e| Failure::Input(format!("{}: {e}", scene.annotations[0].display())))?;
    let mut rooms: Vec<RoomInput> = Vec::new();
    for NumberedInstance { room, class, number_in_room, label } in numbered {
        let Some(points) = found.remove(&(room, class.index(), number_in_room)) else { continue };
        let instance = InstanceInput { label, number_in_room, points };
        match rooms.iter_mut().find(|r| r.room == room) {
            Some(r) => r.instances.push(instance),
            None => rooms.push(RoomInput { room, instances: vec![instance] }),
        }
    }
    rooms.sort_by_key(|r| r.room);
    Ok(rooms)
}
