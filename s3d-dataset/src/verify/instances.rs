//! Checks the tables of instances against each other: boxes, voxels and numbers.

use super::labels::Labels;
use super::report::{OfFile, Report, Topic};
use crate::record::manifest::Manifest;
use crate::record::tables::NumberRecord;
use crate::survey::surface_boxes::BoxesOfFaces;
use s3d_io::dataset::{
    InstanceArrays, InstanceEntry, Layout, SurfaceBoxes, read_instance_arrays, read_instance_members,
    read_instances,
};
use s3d_io::fs::read_json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

const INSTANCES: (Topic, &str) = (Topic::Instances, "tables of instances");

/// Checks `instances.json`, `instances.npz` and `instance_numbers.json` of an area. Returns the instances.
pub(crate) fn check(
    layout: &Layout,
    area: u32,
    manifest: &Manifest,
    labels: &Labels,
    report: &Report,
) -> Option<Vec<InstanceEntry>> {
    let json = layout.instances_json(area);
    let npz = layout.instances_npz(area);
    let entries = report.read(Topic::Instances, &json, read_instances);
    let arrays = report.read(Topic::Instances, &npz, read_instance_arrays);

    if let Some(entries) = &entries {
        let checks = report.of(INSTANCES, &json);
        let mut seen = BTreeSet::new();
        for e in entries {
            let name = &e.label;
            checks.check(seen.insert(name), || format!("{name} stands there twice"));
            label(name, e.label_index, labels, &checks);
            if let Ok(Some(l)) = labels.taxonomy.parse_name(name) {
                checks.check(
                    l.class.name() == e.class && l.room.to_string() == e.room && l.area == area,
                    || format!("{name} has the class {:?} and the room {:?} in area {area}", e.class, e.room),
                );
            }
            checks.check((0..3).all(|k| e.bbox[k] <= e.bbox[k + 3]), || {
                format!("{name} has the box {:?}", e.bbox)
            });

            let sum: u64 = e.points_per_voxel.iter().map(|n| u64::from(*n)).sum();
            checks.check(sum == e.points, || {
                format!("{name} has {} points, and {sum} in its voxels", e.points)
            });
            let mut voxels = e.voxel_occupancy.iter().zip(&e.points_per_voxel);
            checks.check(voxels.all(|(&o, &n)| o == u8::from(n > 0)), || {
                format!(
                    "{name} has voxels that are marked as occupied without points, or the other way round"
                )
            });
        }

        if let Some(manifest) = manifest.area(area) {
            let points: u64 = entries.iter().map(|e| e.points).sum();
            checks.check(points == manifest.annotated_points, || {
                format!("{points} points, and the manifest tells of {}", manifest.annotated_points)
            });
        }
    }

    if let (Some(entries), Some(arrays)) = (&entries, &arrays) {
        let checks = report.of(INSTANCES, &npz);
        let same = arrays.labels.iter().eq(entries.iter().map(|e| &e.label))
            && arrays.label_index.iter().eq(entries.iter().map(|e| &e.label_index));
        checks.check(same, || "its labels are not those of instances.json".to_owned());
        checks.check(arrays.bbox.iter().eq(entries.iter().map(|e| &e.bbox)), || {
            "its boxes are not those of instances.json".to_owned()
        });
        let same = arrays
            .voxel_occupancy
            .iter()
            .eq(entries.iter().flat_map(|e| &e.voxel_occupancy))
            && arrays
                .points_per_voxel
                .iter()
                .eq(entries.iter().flat_map(|e| &e.points_per_voxel));
        checks.check(same, || "its voxels are not those of instances.json".to_owned());
    }

    if let Some(arrays) = &arrays {
        members(arrays, &npz, report);
    }

    numbers(layout, area, labels, report);
    entries
}

/// Checks the boxes of the faces of each instance, `boxes` by label index. A data set of an earlier version
/// has none.
pub(crate) fn check_surfaces(
    path: &Path,
    entries: &[InstanceEntry],
    boxes: &BTreeMap<u32, BoxesOfFaces>,
    report: &Report,
) {
    if entries.iter().all(|entry| entry.surface.is_none()) {
        return;
    }
    let checks = report.of(INSTANCES, path);
    for entry in entries {
        let expected = boxes.get(&entry.label_index);
        let expected = expected.map(|of| SurfaceBoxes::new(of.bbox, &of.upright, &of.oriented));
        checks.check(entry.surface == expected, || {
            format!("{}: its boxes under \"surface\" are not those of its faces", entry.label)
        });
    }
}

/// Checks that a label has this index.
fn label(name: &str, index: u32, labels: &Labels, checks: &OfFile<'_>) {
    checks.check(labels.index_of(name) == Some(index), || {
        format!(
            "{name} has the index {index}, where semantic_labels.json has {}{}",
            labels.name_of(index),
            labels
                .index_of(name)
                .map_or(String::new(), |i| format!(", and {name} at {i}"))
        )
    });
}

/// Checks that the points of every instance are numbered from 0, each in one voxel, as many as the instance
/// has.
fn members(arrays: &InstanceArrays, path: &Path, report: &Report) {
    let checks = report.of(INSTANCES, path);
    let mut seen = Vec::new();
    let each = |i: usize, members: &[u32]| {
        seen.clear();
        seen.resize(members.len(), false);
        let once = members
            .iter()
            .all(|&m| seen.get_mut(m as usize).is_some_and(|s| !std::mem::replace(s, true)));
        checks.check(once, || {
            format!("point_index of {} names a point twice, or one that is not there", arrays.labels[i])
        });

        let counts = &arrays.points_per_voxel[216 * i..216 * (i + 1)];
        let sum: u64 = counts.iter().map(|n| u64::from(*n)).sum();
        checks.check(sum == members.len() as u64, || {
            format!(
                "{} has {sum} points in its voxels and {} in point_index",
                arrays.labels[i],
                members.len()
            )
        });
    };

    report.read(Topic::Instances, path, |path| read_instance_members(path, &arrays.point_start, each));
}

/// Checks `instance_numbers.json`.
fn numbers(layout: &Layout, area: u32, labels: &Labels, report: &Report) {
    let path = layout.instance_numbers_json(area);
    let Some(numbers) = report.read(Topic::Instances, &path, read_json::<Vec<NumberRecord>>) else { return };
    let checks = report.of(INSTANCES, &path);
    let mut names = BTreeSet::new();
    let mut places = BTreeSet::new();
    for n in &numbers {
        checks
            .check(labels.index_of(&n.label).is_some(), || format!("{:?} is no label of the table", n.label));
        checks.check(names.insert(&n.label), || format!("{} stands there twice", n.label));
        checks.check(places.insert((&n.room, &n.class, n.number_in_room)), || {
            format!("{}_{} of {} stands there twice", n.class, n.number_in_room, n.room)
        });
        if let Ok(Some(l)) = labels.taxonomy.parse_name(&n.label) {
            checks.check(l.class.name() == n.class && l.room.to_string() == n.room && l.area == area, || {
                format!("{} is {} of {}", n.label, n.class, n.room)
            });
        }
    }
}
