//! The names of labels: instances numbered by area, and the table of all labels.

use crate::error::{InputError, Result};
use crate::export::input::area::{AreaInput, InstanceInput, RoomInput};
use s3d_io::cloud::Annotations;
use s3d_label::{Class, Label, LabelTable, NumberingError, Room, number_area};
use std::collections::BTreeMap;

/// Returns the table of all labels. The table of a published data set is kept whole if it has all of them, so
/// that an index means the same in its images and in ours. Otherwise a new table is made from the labels of
/// the areas.
pub(super) fn label_table(areas: &mut [AreaInput]) -> Result<LabelTable> {
    let labels: Vec<Label> = areas
        .iter()
        .flat_map(|a| &a.rooms)
        .flat_map(|r| &r.instances)
        .map(|i| i.label)
        .collect();

    for area in areas.iter_mut() {
        let Some(path) = area.published_labels().cloned() else { continue };
        let names = s3d_io::dataset::read_labels(&path)?;
        match area.taxonomy.table_from_names(&names) {
            Ok(table) if labels.iter().all(|l| table.id_of(l).is_some()) => return Ok(table),
            Ok(_) => area.warnings.push(format!(
                "{}: has not every label of the meshes; the table is made anew, so that indices differ from \
                 it",
                path.display()
            )),
            Err(e) => area
                .warnings
                .push(format!("{}: {e}; the table is made anew", path.display())),
        }
    }

    let taxonomy = areas.first().map(|area| area.taxonomy.clone()).unwrap_or_default();
    taxonomy
        .table(labels)
        .map_err(|e| InputError::Labels { why: e.to_string() }.into())
}

/// Gives every instance its number in the area. The numbers of the annotations run per room.
pub(super) fn number(area: u32, annotations: Annotations) -> Result<Vec<RoomInput>, NumberingError> {
    let keys = annotations
        .rooms
        .iter()
        .flat_map(|r| r.instances.iter().map(|i| (r.room, i.class, i.number)));
    let numbered = number_area(area, keys)?;
    let labels = numbered
        .into_iter()
        .map(|n| ((n.room, n.class, n.number_in_room), n.label))
        .collect();
    Ok(named(annotations, &labels))
}

/// Gives every instance the label that it was published with. The instances of a class and room were numbered
/// there in the order of their labels.
pub(super) fn published_numbers(labels: &[Label], annotations: Annotations) -> Vec<RoomInput> {
    let mut sorted: Vec<Label> = labels.to_vec();
    sorted.sort_by_key(|l| (l.room, l.class, l.instance));
    sorted.dedup();
    let mut names: BTreeMap<(Room, Class, u32), Label> = BTreeMap::new();
    for same in sorted.chunk_by(|a, b| (a.room, a.class) == (b.room, b.class)) {
        names.extend(
            (1..)
                .zip(same)
                .map(|(number, label)| ((label.room, label.class, number), *label)),
        );
    }
    named(annotations, &names)
}

/// Gives every instance of these annotations its label.
pub(super) fn named(
    annotations: Annotations,
    labels: &BTreeMap<(Room, Class, u32), Label>,
) -> Vec<RoomInput> {
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

    rooms
        .iter_mut()
        .for_each(|r| r.instances.sort_by_key(|i| (i.label.class, i.number_in_room)));
    rooms.sort_by_key(|r| r.room);
    rooms
}
