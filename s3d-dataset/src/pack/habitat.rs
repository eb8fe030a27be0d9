//! `s3d pack --to habitat`: each area as a scene of habitat-sim, in the form of HM3D.

use super::destination::Destination;
use super::source::Source;
use crate::context::Context;
use crate::error::{Error, Result};
use s3d_geom::TriMesh;
use s3d_io::Error as FileError;
use s3d_io::fs::{create_dir, write_json};
use s3d_io::package::{
    HabitatLabels, HabitatObject, MOST_HABITAT_OBJECTS, write_habitat_config, write_habitat_scene,
};
use s3d_label::{LabelId, LabelTable, Room};
use std::collections::BTreeSet;

/// The file that the simulator opens.
const CONFIG: &str = "s3d.scene_dataset_config.json";

/// The objects of an area.
struct Objects {
    objects: Vec<HabitatObject>,
    /// The label of each object.
    labels: Vec<LabelId>,
    /// The rooms by their numbers.
    rooms: Vec<Room>,
    /// The number of the object of each face, from 1; 0 for none.
    of_face: Vec<u32>,
}

/// Writes a folder for each area. Returns notes on how to use them.
pub(super) fn pack(ctx: &Context, source: &Source, destination: &Destination) -> Result<Vec<String>> {
    let data = &source.data;
    let table = source.data.labels()?;
    let progress = ctx.progress("packing", "areas", source.areas.len() as u64);
    let mut folders = Vec::new();
    for &area in &source.areas {
        ctx.check()?;
        let Some(file) = data.mesh(area)? else {
            let message = "there is no mesh: finish the export";
            return Err(FileError::format(&data.layout.rgb_obj(area), message).into());
        };
        let name = format!("area_{area}");
        let folder = destination.path().join(&name);
        create_dir(&folder)?;

        let objects = match &table {
            None => None,
            Some(table) => Some(objects_of(source, area, table, &file.mesh)?),
        };
        let labels = objects
            .as_ref()
            .map(|found| HabitatLabels { objects: &found.objects, object_of_face: &found.of_face });
        write_habitat_scene(&folder, &name, &file.mesh, labels)?;
        if let Some((objects, table)) = objects.zip(table.as_ref()) {
            let names = objects.labels.iter().map(|label| table.name_of(*label));
            let rooms = objects.rooms.iter().map(Room::to_string);
            let meaning = serde_json::json!({
                "objects": names.collect::<Vec<_>>(),
                "regions": rooms.collect::<Vec<_>>(),
            });
            write_json(&folder.join(format!("{name}.names.json")), &meaning)?;
        }
        folders.push(name);
        progress.add(1);
    }
    write_habitat_config(&destination.path().join(CONFIG), &folders)?;

    let mut notes = vec![format!(
        "SimulatorConfiguration of habitat-sim takes scene_dataset_config_file = {CONFIG} and scene_id = {}",
        folders.join(" or ")
    )];
    if table.is_some() {
        notes.push(
            "a semantic sensor gives numbers of objects: number N is entry N - 1 of objects in names.json"
                .to_owned(),
        );
    } else {
        notes.push("the data set has no labels: there is no semantic mesh".to_owned());
    }
    Ok(notes)
}

/// Numbers the labels that faces of an area have, and the rooms that they are in.
fn objects_of(source: &Source, area: u32, table: &LabelTable, mesh: &TriMesh) -> Result<Objects> {
    let path = source.data.layout.votes_npz(area);
    let Some(votes) = source.data.face_votes(area)? else {
        return Err(FileError::format(&path, "there are no labels of faces: finish the export").into());
    };
    debug_assert_eq!(votes.label.len(), mesh.faces().len());

    let used: BTreeSet<u32> = votes.label.iter().copied().filter(|label| *label != 0).collect();
    let found = used.into_iter().map(|index| {
        let label = table.get(LabelId(index));
        let label = label.ok_or_else(|| FileError::format(&path, format!("there is no label {index}")))?;
        Ok((LabelId(index), label))
    });
    let found = found.collect::<Result<Vec<_>>>()?;
    if found.len() > MOST_HABITAT_OBJECTS {
        let message = format!("{} objects, and habitat-sim keeps {MOST_HABITAT_OBJECTS}", found.len());
        return Err(Error::unfit(&path, message));
    }

    let rooms: BTreeSet<Room> = found.iter().map(|(_, label)| label.room).collect();
    let rooms: Vec<Room> = rooms.into_iter().collect();
    let objects = found.iter().map(|(_, label)| HabitatObject {
        class: label.class.to_string(),
        region: rooms.partition_point(|room| *room < label.room) as u32,
    });
    let labels: Vec<LabelId> = found.iter().map(|(index, _)| *index).collect();
    let number = |label: &u32| match *label {
        0 => 0,
        label => labels.partition_point(|of| of.0 < label) as u32 + 1,
    };
    let of_face = votes.label.iter().map(number).collect();
    Ok(Objects { objects: objects.collect(), labels, rooms, of_face })
}
