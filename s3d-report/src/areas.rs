//! Reads the tables of a data set: labels, classes, rooms, votes, statistics.

use crate::faults::Faults;
use crate::index::{AreaVotes, ClassEntry, LabelEntry, RoomEntry, rounded};
use s3d_dataset::{DataSet, Result};
use s3d_io::Error as FileError;
use s3d_io::dataset::InstanceEntry;
use s3d_label::{Class, LabelId, LabelTable, pretty_color};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// A room of `rooms.json`.
#[derive(Deserialize)]
struct Room {
    room: String,
    floor_m2: f64,
    outline: Vec<Polygon>,
}

#[derive(Deserialize)]
struct Polygon {
    outer: Vec<[f64; 2]>,
    holes: Vec<Vec<[f64; 2]>>,
}

/// Reads a JSON file of the data set. `None` if there is no such file, or if it is wrong, which becomes a
/// fault.
fn json<T: DeserializeOwned>(data: &DataSet, path: &Path, faults: &mut Faults) -> Result<Option<T>> {
    if !data.names(path) {
        return Ok(None);
    }
    let read = data.read(path).and_then(|bytes| {
        serde_json::from_slice(&bytes)
            .map_err(|e| FileError::line(path, e.line() as u64, e.to_string()).into())
    });
    faults.keep(data.layout().root(), read)
}

/// Returns the one of two floors that has more points.
fn largest_of(a: (u64, f32), b: (u64, f32)) -> (u64, f32) {
    if b.0 > a.0 { b } else { a }
}

pub(crate) fn rooms(data: &DataSet, faults: &mut Faults) -> Result<Vec<RoomEntry>> {
    let mut rooms = Vec::new();
    for &area in data.areas() {
        let path = data.layout().rooms_json(area);
        let found: Vec<Room> = json(data, &path, faults)?.unwrap_or_default();
        let instances = faults
            .keep(data.layout().root(), data.instances(area))?
            .unwrap_or_default();

        let mut heights: BTreeMap<String, [f32; 2]> = BTreeMap::new();
        let mut floors: BTreeMap<String, (u64, f32)> = BTreeMap::new();
        for InstanceEntry { room, class, points, bbox: [_, _, low, _, _, high], .. } in instances {
            if class == Class::FLOOR.name() {
                let largest = floors.entry(room.clone()).or_default();
                *largest = largest_of(*largest, (points, 0.5 * (low + high)));
            }
            let range = heights.entry(room).or_insert([low, high]);
            *range = [range[0].min(low), range[1].max(high)];
        }

        rooms.extend(found.into_iter().map(|Room { room: name, floor_m2, outline }| {
            let rings = outline
                .into_iter()
                .flat_map(|p| std::iter::once(p.outer).chain(p.holes));
            let heights = heights.get(&name).map(|range| range.map(|z| rounded(z.into(), 3)));
            let floor = floors.get(&name).map(|(_, z)| rounded((*z).into(), 3));
            RoomEntry {
                area,
                name,
                floor_m2,
                floor,
                heights,
                outline: rings
                    .map(|ring| ring.iter().map(|p| p.map(|c| rounded(c, 3))).collect())
                    .collect(),
            }
        }));
    }
    Ok(rooms)
}

pub(crate) fn votes(data: &DataSet, faults: &mut Faults) -> Result<Vec<AreaVotes>> {
    let mut all = Vec::new();
    for &area in data.areas() {
        if let Some(votes) = json(data, &data.layout().votes_json(area), faults)? {
            all.push(AreaVotes { area, votes });
        }
    }
    Ok(all)
}

pub(crate) fn statistics(data: &DataSet, faults: &mut Faults) -> Result<Option<Value>> {
    json(data, &data.layout().statistics_json(), faults)
}

/// Returns the entry of each area in the manifest, without the list of its input.
pub(crate) fn areas(data: &DataSet) -> Result<Vec<Value>> {
    data.area_entries()
        .map(|area| {
            let failed = |e: serde_json::Error| FileError::format(&data.layout().manifest(), e.to_string());
            let mut value = serde_json::to_value(area).map_err(failed)?;
            if let Some(members) = value.as_object_mut() {
                members.remove("inputs");
            }
            Ok(value)
        })
        .collect()
}

pub(crate) fn classes(data: &DataSet) -> Vec<ClassEntry> {
    data.taxonomy()
        .map(|t| {
            t.classes()
                .iter()
                .map(|c| ClassEntry { name: c.name(), color: t.color(*c) })
                .collect()
        })
        .unwrap_or_default()
}

pub(crate) fn labels(table: &LabelTable) -> Vec<LabelEntry> {
    let names = table.names().into_iter().enumerate();
    names
        .map(|(i, name)| {
            let index = u32::try_from(i).unwrap_or(u32::MAX);
            LabelEntry {
                name,
                class: table.class_of(LabelId(index)).map(|c| c.index()),
                color: pretty_color(index),
            }
        })
        .collect()
}
