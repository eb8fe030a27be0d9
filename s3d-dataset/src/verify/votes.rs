//! Checks the votes of the annotated points against the labels of faces, the boxes of instances, the
//! directions of walls, and the report on them.

use super::labels::Labels;
use super::mesh::LabelledMesh;
use super::report::{Report, Topic};
use super::tables::{differ, first_of};
use crate::record::manifest::Manifest;
use crate::record::tables::{RoomRecord, VotesRecord};
use glam::{Vec3, vec3};
use s3d_geom::Aabb;
use s3d_io::dataset::{FaceVoteColumns, InstanceEntry, Layout, read_face_votes};
use s3d_io::fs::read_json;
use s3d_label::{
    Disputes, FaceVotes, LabelId, LabelTable, Room, VoteReport, VoteRow, fill_labels, wall_directions_deg,
};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

const VOTES: (Topic, &str) = (Topic::Mesh, "faces and votes");
const BOXES: (Topic, &str) = (Topic::Instances, "boxes of instances and their faces");
const ROOMS: (Topic, &str) = (Topic::Tables, "rooms");

/// Keys of the rows of `votes.json`.
const POINTS: &str = "points";
const FAR: &str = "points_farther_than_5_cm";

/// How far a face may be from the box of its voters beyond their distance, relative to its coordinates: the
/// rounding of both.
const ROUNDING: f32 = 1e-5;

/// Checks the votes of an area. Returns whether each face has votes.
pub(crate) fn check(
    layout: &Layout,
    area: u32,
    manifest: &Manifest,
    mesh: &LabelledMesh,
    (labels, instances): (&Labels, Option<&[InstanceEntry]>),
    report: &Report,
) -> Vec<bool> {
    let path = layout.votes_npz(area);
    // Data sets of earlier versions have no votes. A file that is listed but missing is reported with the
    // list of files.
    let votes = path
        .exists()
        .then(|| report.read(Topic::Mesh, &path, read_face_votes))
        .flatten()
        .filter(|votes| {
            let told = votes.label.len();
            let faces = mesh.label_of_face.len();
            let message = || format!("votes for {told} faces, and semantic.obj has {faces}");
            report.check(told == faces, VOTES, &path, message)
        });
    let Some(votes) = votes else {
        return mesh.label_of_face.iter().map(|label| *label != 0).collect();
    };

    let voted = check_labels(&path, mesh, &votes, manifest.options.fill, report);
    check_sums(&path, &votes, report);

    if let Some(instances) = instances {
        check_boxes(&layout.instances_json(area), mesh, &votes, instances, report);
    }
    // A table that is out of order is reported with the labels.
    if let Ok(table) = labels.taxonomy.table_from_names(&labels.names)
        && manifest.is_of_this_version()
    {
        check_walls(&layout.rooms_json(area), mesh, &voted, &table, report);
        if let Some(instances) = instances {
            check_report(layout, area, manifest, (mesh, &votes), (&table, instances), report);
        }
    }
    voted.into_iter().map(|label| label != LabelId::NULL).collect()
}

/// Checks the labels of `semantic.obj` against the votes of each face. Labels of faces without votes must be
/// the ones that filling gives. Returns the labels by votes alone.
fn check_labels(
    path: &Path,
    mesh: &LabelledMesh,
    votes: &FaceVoteColumns,
    fill_m: Option<f64>,
    report: &Report,
) -> Vec<LabelId> {
    let won = votes.label == mesh.label_of_face;
    report.check(won, VOTES, path, || "other labels won than semantic.obj has".to_owned());

    let voted: Vec<LabelId> = mesh
        .label_of_face
        .iter()
        .zip(&votes.total)
        .map(|(label, total)| LabelId(if *total == 0 { 0 } else { *label }))
        .collect();
    if won {
        let mut filled = voted.clone();
        if let Some(within_m) = fill_m {
            fill_labels(&mesh.file.mesh, &mut filled, within_m);
        }
        let pairs = filled.iter().zip(&mesh.label_of_face);
        let odd = pairs.filter(|(filled, label)| filled.0 != **label).count();
        report.check(odd == 0, VOTES, path, || {
            format!("{odd} faces have other labels than votes and filling give them")
        });
    }
    voted
}

/// Checks that the votes of each face add up.
fn check_sums(path: &Path, votes: &FaceVoteColumns, report: &Report) {
    let sums = votes.votes.iter().zip(&votes.runner_up_votes).zip(&votes.total);
    let odd = sums.filter(|((first, second), total)| {
        first < second || u64::from(**first) + u64::from(**second) > u64::from(**total)
    });
    let odd = odd.count();
    report.check(odd == 0, VOTES, path, || format!("{odd} faces have votes that do not add up"));
}

/// Checks that the box of an instance reaches each face that it won: its voters are in the box, and none is
/// farther from the face than the farthest.
fn check_boxes(
    path: &Path,
    mesh: &LabelledMesh,
    votes: &FaceVoteColumns,
    instances: &[InstanceEntry],
    report: &Report,
) {
    let boxes: BTreeMap<u32, (&InstanceEntry, Aabb)> = instances
        .iter()
        .map(|entry| (entry.label_index, (entry, box_of(entry))))
        .collect();
    // The number of faces that a box does not reach, and the largest gap.
    let mut beyond: BTreeMap<u32, (u64, f32)> = BTreeMap::new();

    for (face, label) in (0u32..).zip(&votes.label) {
        let at = face as usize;
        let (Some((_, bbox)), true) = (boxes.get(label), votes.votes[at] > 0) else { continue };
        let around = Aabb::from_points(mesh.file.mesh.triangle(face));
        let gap = (bbox.min - around.max).max(around.min - bbox.max).max(Vec3::ZERO);
        let size = around.max.abs().max(around.min.abs()).max_element();
        let reach = votes.farthest_m[at] + ROUNDING * (1.0 + size);
        if gap.length() > reach {
            let (count, largest) = beyond.entry(*label).or_default();
            *count += 1;
            *largest = largest.max(gap.length());
        }
    }

    let checks = report.of(BOXES, path);
    for (label, (entry, _)) in &boxes {
        let found = beyond.get(label);
        checks.check(found.is_none(), || {
            let (count, largest) = found.copied().unwrap_or_default();
            format!(
                "{}: its box is up to {largest:.3} m away from {count} faces that its points won",
                entry.label
            )
        });
    }
}

/// Returns the box of an instance.
pub(crate) fn box_of(instance: &InstanceEntry) -> Aabb {
    let [x0, y0, z0, x1, y1, z1] = instance.bbox;
    Aabb { min: vec3(x0, y0, z0), max: vec3(x1, y1, z1) }
}

/// Checks `votes.json` against what the votes of the faces and the points of the instances give. How many
/// points were far from their face no other file tells.
fn check_report(
    layout: &Layout,
    area: u32,
    manifest: &Manifest,
    (mesh, votes): (&LabelledMesh, &FaceVoteColumns),
    (table, instances): (&LabelTable, &[InstanceEntry]),
    report: &Report,
) {
    let path = layout.votes_json(area);
    let unlabelled = manifest.area(area).and_then(|entry| entry.unlabelled);
    let Some(unlabelled) = unlabelled.filter(|_| !votes.total.contains(&u32::MAX)) else { return };
    let Some(found) = report.read(Topic::Mesh, &path, read_json::<Value>) else { return };

    let faces = results(votes);
    let expected = VotesRecord::new(
        area,
        &report_of(area, &faces, table, instances),
        &unlabelled,
        &Disputes::of_faces(&mesh.file.mesh, faces.iter().copied(), table),
        table,
    );
    // By way of its text, which has the digits of 32-bit floats.
    let text = serde_json::to_string(&expected);
    let Ok(mut expected) = text.and_then(|text| serde_json::from_str::<Value>(&text)) else { return };
    copy(FAR, &found, &mut expected);

    // An annotated vertex votes for every face around it, and each vote counts as a point. Which instance
    // these are of, no other file tells.
    let cast: u64 = votes.total.iter().map(|total| u64::from(*total)).sum();
    let annotated: u64 = instances.iter().map(|instance| instance.points).sum();
    if cast != annotated {
        copy(POINTS, &found, &mut expected);
    }
    expected["total"][POINTS] = cast.into();

    let mut differences = Vec::new();
    differ(&found, &expected, "", &mut differences);
    let checks = report.of(VOTES, &path);
    checks.check(differences.is_empty(), || {
        format!("not what votes.npz and instances.json give: {}", first_of(&differences))
    });
    checks.check(far_points_fit(&found), || "tells of more far points than there are points".to_owned());
}

/// Returns the result of each face, as far as the columns have it.
fn results(votes: &FaceVoteColumns) -> Vec<Option<FaceVotes>> {
    (0..votes.label.len())
        .map(|at| {
            (votes.total[at] > 0).then(|| FaceVotes {
                label: LabelId(votes.label[at]),
                votes: votes.votes[at].into(),
                runner_up: LabelId(votes.runner_up[at]),
                runner_up_votes: votes.runner_up_votes[at].into(),
                total: votes.total[at].into(),
                farthest_m: votes.farthest_m[at],
                mean_m: f32::NAN,
            })
        })
        .collect()
}

/// Sums up the results of faces and the points of instances. No point is counted as far.
fn report_of(
    area: u32,
    faces: &[Option<FaceVotes>],
    table: &LabelTable,
    instances: &[InstanceEntry],
) -> VoteReport {
    let mut total = VoteRow::default();
    let mut rooms: BTreeMap<(u32, Room), VoteRow> = table
        .iter()
        .map(|(_, label)| ((label.area, label.room), VoteRow::default()))
        .collect();
    let mut classes: Vec<_> = table
        .taxonomy()
        .classes()
        .iter()
        .map(|class| (*class, VoteRow::default()))
        .collect();

    let mut add = |label: LabelId, change: &dyn Fn(&mut VoteRow)| {
        let Some(label) = table.get(label) else { return };
        change(&mut total);
        rooms.get_mut(&(label.area, label.room)).into_iter().for_each(change);
        classes
            .iter_mut()
            .filter(|(class, _)| *class == label.class)
            .for_each(|(_, row)| change(row));
    };
    for instance in instances {
        add(LabelId(instance.label_index), &|row| row.points += instance.points);
    }
    for face in faces.iter().flatten() {
        add(face.label, &|row| row.add_face(face));
    }

    VoteReport {
        far_m: 0.0,
        face_count: faces.len() as u64,
        faces_without_vote: faces.iter().filter(|face| face.is_none()).count() as u64,
        unlabeled_points: 0,
        total,
        rooms: rooms
            .into_iter()
            .filter(|((of, _), _)| *of == area)
            .map(|((of, room), row)| (of, room, row))
            .collect(),
        classes,
    }
}

/// Copies the values of a key from one `votes.json` to another, wherever both have it.
fn copy(key: &str, from: &Value, to: &mut Value) {
    match (from, to) {
        (Value::Object(from), Value::Object(to)) => {
            for (name, told) in to {
                match from.get(name) {
                    Some(value) if name == key => *told = value.clone(),
                    Some(value) => copy(key, value, told),
                    None => {}
                }
            }
        }
        (Value::Array(from), Value::Array(to)) => {
            from.iter().zip(to).for_each(|(from, to)| copy(key, from, to));
        }
        _ => {}
    }
}

/// Whether no row of a `votes.json` has more far points than points.
fn far_points_fit(votes: &Value) -> bool {
    match votes {
        Value::Object(fields) => {
            let number = |key| fields.get(key).and_then(Value::as_u64);
            number(FAR) <= number(POINTS) && fields.values().all(far_points_fit)
        }
        Value::Array(items) => items.iter().all(far_points_fit),
        _ => true,
    }
}

/// Checks the directions of walls in `rooms.json` against the mesh.
fn check_walls(path: &Path, mesh: &LabelledMesh, voted: &[LabelId], table: &LabelTable, report: &Report) {
    // A file that cannot be read is reported with the rooms.
    let Ok(rooms) = read_json::<Vec<RoomRecord>>(path) else { return };
    let known = wall_directions_deg(&mesh.file.mesh, table, voted);
    let known: BTreeMap<String, u32> = known.into_iter().map(|(room, deg)| (room.to_string(), deg)).collect();
    let checks = report.of(ROOMS, path);
    for room in rooms {
        let expected = known.get(&room.room).copied().unwrap_or(0);
        checks.check(room.wall_direction_deg == expected, || {
            format!(
                "{}: wall_direction_deg {}, its faces give {expected}",
                room.room, room.wall_direction_deg
            )
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::TriMesh;
    use s3d_io::mesh::MeshFile;

    #[test]
    fn a_box_that_was_moved_does_not_reach_its_faces() {
        // Two chairs, a face each, whose voters are up to 2 cm away.
        let corners = [0.0, 3.0].map(|x| [vec3(x, 0.0, 0.0), vec3(x + 0.4, 0.0, 0.0), vec3(x, 0.4, 0.5)]);
        let mesh = TriMesh::from_faces(corners.concat(), vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        let mesh = LabelledMesh {
            file: MeshFile::in_memory("mesh", mesh),
            label_of_face: vec![1, 2],
            all_in_table: true,
            is_voted: vec![true; 2],
        };
        let votes = FaceVoteColumns {
            label: vec![1, 2],
            votes: vec![3; 2],
            total: vec![3; 2],
            runner_up: vec![0; 2],
            runner_up_votes: vec![0; 2],
            farthest_m: vec![0.02; 2],
        };
        let instance = |index: u32, x: f32| InstanceEntry {
            label: format!("chair_{index}_office_1_1"),
            label_index: index,
            class: "chair".into(),
            room: "office_1".into(),
            points: 3,
            bbox: [x + 0.415, 0.1, 0.1, x + 0.5, 0.3, 0.4],
            voxel_occupancy: Vec::new(),
            points_per_voxel: Vec::new(),
            surface: None,
        };
        let told = |instances: &[InstanceEntry]| {
            let report = Report::new(&Layout::new("out"));
            check_boxes(Path::new("out/instances.json"), &mesh, &votes, instances, &report);
            report.finish().to_string()
        };

        assert!(!told(&[instance(1, 0.0), instance(2, 3.0)]).contains("away from"));
        let moved = told(&[instance(1, 1.0), instance(2, 3.0)]);
        assert!(moved.contains("chair_1_office_1_1: its box is up to 1.015 m away from 1 faces"), "{moved}");
        let exchanged = told(&[instance(1, 3.0), instance(2, 0.0)]);
        assert!(exchanged.contains("chair_1") && exchanged.contains("chair_2"), "{exchanged}");
    }
}
