//! `s3d pack --to scene-graph`: each area as a graph of its building, rooms, objects and cameras, after
//! Armeni et al., "3D Scene Graph: A Structure for Unified Semantics, 3D Space, and Camera" (ICCV 2019).
//! What a scan does not tell (materials, what a thing is used for) is left out.

mod cameras;
mod doors;
mod nodes;

use super::destination::Destination;
use super::source::Source;
use crate::context::Context;
use crate::error::{InputError, Result};
use crate::record::tables::RoomRecord;
use cameras::{Looked, look};
use doors::{Space, joined_rooms};
use glam::DVec2;
use nodes::{AdjacentRooms, BuildingNode, ObjectNode, Relations, RoomNode, RoomOrder, SceneGraph};
use s3d_geom::{OrientedBox, Polygon, TriMesh};
use s3d_io::Error as FileError;
use s3d_io::dataset::{Domain, InstanceEntry, read_instances};
use s3d_io::fs::{read_json, write_json};
use s3d_label::LabelTable;
use std::collections::BTreeMap;

/// Writes `area_N.json` for each area. Returns notes on how to use them.
pub(super) fn pack(ctx: &Context, source: &Source, destination: &Destination) -> Result<Vec<String>> {
    let Some(table) = source.data.labels()? else {
        let dataset = source.data.layout.root().to_owned();
        return Err(InputError::WithoutLabels { dataset, needs: "a scene graph needs" }.into());
    };
    source.require(Domain::Pose, "a scene graph")?;

    for &area in &source.areas {
        let graph = graph_of(ctx, source, &table, area)?;
        write_json(&destination.path().join(format!("area_{area}.json")), &graph)?;
    }

    let mut notes = vec!["an area a file; lengths in metres in the world of the data set".to_owned()];
    if !source.has(Domain::Objects) {
        notes.push("orders and occlusions are null: they need the modality objects".to_owned());
    }
    Ok(notes)
}

fn graph_of(ctx: &Context, source: &Source, table: &LabelTable, area: u32) -> Result<SceneGraph> {
    let (layout, files) = (&source.data.layout, &source.data.files);
    let instances = read_instances(files.checked(&layout.instances_json(area))?)?;
    let records: Vec<RoomRecord> = read_json(files.checked(&layout.rooms_json(area))?)?;
    let mesh = source.data.mesh(area)?.map(|file| file.mesh);
    let votes = source.data.face_votes(area)?;
    let Some((mesh, label_of_face)) = mesh.zip(votes.map(|votes| votes.label)) else {
        let message = "there is no labelled mesh: finish the export";
        return Err(FileError::format(&layout.rgb_obj(area), message).into());
    };

    let objects = objects(&instances, &mesh, &label_of_face);
    let rooms: Vec<RoomNode> = records.iter().map(|record| room(record, &instances)).collect();
    let Looked { cameras, orders, occlusions } = look(ctx, source, table, area)?;
    let adjacent_rooms = adjacent_rooms(ctx, source, &instances, &records, &rooms, &mesh, &label_of_face)?;

    let volumes: Option<Vec<f64>> = rooms.iter().map(|room| room.volume_m3).collect();
    let building = BuildingNode {
        id: format!("area_{area}"),
        floor_area_m2: rooms.iter().map(|room| room.floor_area_m2).sum(),
        volume_m3: volumes.map(|volumes| volumes.iter().sum()),
        rooms: rooms.len(),
        objects: objects.len(),
        cameras: cameras.len(),
    };
    let largest_first = rooms.iter().map(|room| largest_first(room, &objects)).collect();
    let relations = Relations { adjacent_rooms, largest_first, orders, occlusions };
    Ok(SceneGraph { building, rooms, objects, cameras, relations })
}

fn objects(instances: &[InstanceEntry], mesh: &TriMesh, label_of_face: &[u32]) -> Vec<ObjectNode> {
    let mut faces: BTreeMap<u32, (u64, f64)> = BTreeMap::new();
    for (face, label) in (0u32..).zip(label_of_face) {
        let (count, m2) = faces.entry(*label).or_default();
        *count += 1;
        *m2 += mesh.area(face);
    }

    let object = |instance: &InstanceEntry| {
        let upright = instance.surface.map(|surface| surface.upright);
        let (faces, surface_m2) = faces.get(&instance.label_index).copied().unwrap_or_default();
        ObjectNode {
            id: instance.label.clone(),
            label_index: instance.label_index,
            class: instance.class.clone(),
            room: instance.room.clone(),
            faces,
            surface_m2,
            center: upright.map(|upright| upright.center),
            size_m: upright.map(|upright| upright.size),
            yaw_deg: upright.map(|upright| upright.yaw_deg),
            box_volume_m3: upright.map(|upright| upright.size.iter().product()),
        }
    };
    instances.iter().map(object).collect()
}

fn room(record: &RoomRecord, instances: &[InstanceEntry]) -> RoomNode {
    let height = |class: &str| {
        let of_class = instances
            .iter()
            .filter(|instance| instance.room == record.room && instance.class == class);
        let boxes = of_class.filter_map(|instance| instance.surface.map(|surface| surface.upright));
        let ground_m2 = |size: [f64; 3]| size[0] * size[1];
        boxes
            .max_by(|a, b| ground_m2(a.size).total_cmp(&ground_m2(b.size)))
            .map(|largest| largest.center[2])
    };

    let [floor_z, ceiling_z] = ["floor", "ceiling"].map(height);
    let height_m = floor_z.zip(ceiling_z).map(|(floor, ceiling)| ceiling - floor);
    let kind = record.room.rsplit_once('_').map_or(&*record.room, |(kind, _)| kind);
    RoomNode {
        id: record.room.clone(),
        kind: kind.to_owned(),
        floor_area_m2: record.floor_m2,
        floor_z,
        ceiling_z,
        volume_m3: height_m.filter(|m| *m > 0.0).map(|m| m * record.floor_m2),
    }
}

fn largest_first(room: &RoomNode, objects: &[ObjectNode]) -> RoomOrder {
    let in_room = objects.iter().filter(|object| object.room == room.id);
    let mut sized: Vec<(f64, &ObjectNode)> = in_room
        .filter_map(|object| object.box_volume_m3.map(|volume| (volume, object)))
        .collect();
    sized.sort_by(|(a, x), (b, y)| b.total_cmp(a).then(x.label_index.cmp(&y.label_index)));
    let objects = sized.iter().map(|(_, object)| object.id.clone());
    RoomOrder { room: room.id.clone(), objects: objects.collect() }
}

/// The height of a room whose ceiling is not known, metres.
const USUAL_HEIGHT_M: f64 = 2.5;

fn adjacent_rooms(
    ctx: &Context,
    source: &Source,
    instances: &[InstanceEntry],
    records: &[RoomRecord],
    rooms: &[RoomNode],
    mesh: &TriMesh,
    label_of_face: &[u32],
) -> Result<Option<Vec<AdjacentRooms>>> {
    if source.data.taxonomy.class("door").is_err() {
        return Ok(None);
    }
    let doors: Vec<&InstanceEntry> = instances.iter().filter(|of| of.class == "door").collect();
    let indices: Vec<u32> = doors.iter().map(|door| door.label_index).collect();
    let is_door = |face: usize| indices.contains(&label_of_face[face]);

    // Rooms without a floor have no height at which one could see through a door.
    let mut known = Vec::new();
    let mut spaces = Vec::new();
    for (record, room) in records.iter().zip(rooms) {
        let Some(floor_z) = room.floor_z else { continue };
        let top = room
            .ceiling_z
            .filter(|z| *z > floor_z)
            .unwrap_or(floor_z + USUAL_HEIGHT_M);
        known.push(&room.id);
        spaces.push(Space { outline: polygons(record), heights: [floor_z, top] });
    }

    let with_box = doors
        .into_iter()
        .filter_map(|door| door.surface.map(|surface| (door, surface.upright.to_box())));
    let (doors, boxes): (Vec<&InstanceEntry>, Vec<OrientedBox>) = with_box.unzip();
    let joined = joined_rooms(ctx, mesh, is_door, &boxes, &spaces)?;

    let mut adjacent: BTreeMap<[usize; 2], Vec<String>> = BTreeMap::new();
    for (door, rooms) in doors.iter().zip(joined) {
        if let Some(rooms) = rooms {
            adjacent.entry(rooms).or_default().push(door.label.clone());
        }
    }
    let named = |(rooms, doors): ([usize; 2], Vec<String>)| AdjacentRooms {
        rooms: rooms.map(|room| known[room].clone()),
        doors,
    };
    Ok(Some(adjacent.into_iter().map(named).collect()))
}

fn polygons(record: &RoomRecord) -> Vec<Polygon> {
    let ring = |ring: &Vec<[f64; 2]>| ring.iter().copied().map(DVec2::from).collect();
    let polygons = record.outline.iter().map(|polygon| Polygon {
        outer: ring(&polygon.outer),
        holes: polygon.holes.iter().map(ring).collect(),
    });
    polygons.collect()
}
