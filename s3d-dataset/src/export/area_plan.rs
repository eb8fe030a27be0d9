//! A labelled area as files: what voting found, so that no other process opens the annotations or votes again.
//!
//! Two files in a folder: `area.jsonl`, small, and `face_labels.npy`, an array of `<u4` with a label index a face. The
//! first holds the second's checksum and is written after it, so that an area which can be read is whole. Processes that
//! write the same area at the same time write the same bytes.

use crate::error::Result;
use crate::export::annotate::{Annotated, SkippedLines, SurveyedRoom};
use crate::export::inputs::RoomInput;
use crate::store::checked::{read_checked, write_checked};
use glam::{DMat3, DVec2, DVec3, Vec3};
use s3d_geom::{Aabb, Footprint, Polygon, Pose};
use s3d_io::Error as FileError;
use s3d_io::camera::ScanLocation;
use s3d_io::cloud::NpyWriter;
use s3d_io::dataset::is_valid_uuid;
use s3d_io::fs::{Checksum, create_dir};
use s3d_label::{Class, Label, LabelId, Room, VoteReport, VoteRow};
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// All that an export needs to know of an area's annotations once it is labelled.
#[derive(Debug)]
pub(crate) struct AreaPlan {
    /// Its number, from 1.
    pub(crate) area: u32,
    pub(crate) annotated: Annotated,
    /// The rooms, in the order of their names, each with the names of its instances.
    pub(crate) names: Vec<RoomNames>,
    /// The scan locations, listed or placed.
    pub(crate) locations: Vec<ScanLocation>,
    /// The room of each location.
    pub(crate) location_rooms: Vec<Room>,
    /// The box of the mesh.
    pub(crate) mesh_box: Aabb,
    /// The area of its faces.
    pub(crate) mesh_area_m2: f64,
    /// Faces of its file that the mesh has not.
    pub(crate) faces_left_out: usize,
}

/// The annotated instances of a room, without their points.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RoomNames {
    pub(crate) room: Room,
    pub(crate) instances: Vec<InstanceName>,
}

/// What an instance is called.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InstanceName {
    /// In the data set.
    pub(crate) label: Label,
    /// In its room, among those of its class.
    pub(crate) number_in_room: u32,
}

impl RoomNames {
    /// The names in annotations that are open.
    pub(crate) fn of(rooms: &[RoomInput]) -> Vec<Self> {
        let name = |room: &RoomInput| {
            let instances = room.instances.iter();
            let instances =
                instances.map(|i| InstanceName { label: i.label, number_in_room: i.number_in_room });
            Self { room: room.room, instances: instances.collect() }
        };
        rooms.iter().map(name).collect()
    }
}

impl AreaPlan {
    /// Whether an area was written into `folder`: its files are still to be checked.
    pub(crate) fn is_in(folder: &Path) -> bool {
        area_file(folder).is_file()
    }

    /// Writes the area into `folder`.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        create_dir(folder)?;
        let face_labels = &self.annotated.face_labels;
        let bytes: Vec<u8> = face_labels.iter().flat_map(|l| l.0.to_le_bytes()).collect();
        let mut array = NpyWriter::create(&labels_file(folder), "<u4", &[face_labels.len() as u64])?;
        array.put(&bytes)?;
        array.finish()?;
        write_checked(&area_file(folder), &AreaFile::of(self, Checksum::of(&bytes)))
    }

    /// Reads what [`write`](Self::write) wrote.
    ///
    /// # Errors
    /// Files that are not there, damaged, or of an area with another number.
    pub(crate) fn read(folder: &Path, area: u32) -> Result<Self> {
        let path = area_file(folder);
        let file: AreaFile = read_checked(&path)?;
        if file.area != area {
            return Err(FileError::format(&path, format!("is area {}, not area {area}", file.area)).into());
        }
        let face_labels = read_face_labels(&labels_file(folder), file.faces, file.face_labels_xxh3_128)?;
        file.into_plan(&path, face_labels)
    }
}

fn area_file(folder: &Path) -> PathBuf {
    folder.join("area.jsonl")
}

fn labels_file(folder: &Path) -> PathBuf {
    folder.join("face_labels.npy")
}

/// The labels are what the file ends with, as `area.jsonl` says how many there are and what their checksum is.
fn read_face_labels(path: &Path, faces: u64, checksum: Checksum) -> Result<Vec<LabelId>> {
    let bytes = std::fs::read(path).map_err(|e| FileError::io(path, "read", e))?;
    let labels = usize::try_from(faces)
        .ok()
        .and_then(|faces| faces.checked_mul(4))
        .and_then(|length| bytes.len().checked_sub(length))
        .map(|start| &bytes[start..])
        .filter(|labels| Checksum::of(labels) == checksum)
        .ok_or_else(|| {
            FileError::format(path, "is damaged: its checksum differs; remove it and area.jsonl")
        })?;
    let (labels, _) = labels.as_chunks::<4>();
    Ok(labels.iter().map(|b| LabelId(u32::from_le_bytes(*b))).collect())
}

/// `area.jsonl`.
#[derive(Serialize, Deserialize)]
struct AreaFile {
    area: u32,
    faces: u64,
    /// Of the labels' bytes, without the array's header.
    face_labels_xxh3_128: Checksum,
    faces_left_out: usize,
    mesh_box: Option<[f64; 6]>,
    mesh_area_m2: f64,
    points: u64,
    rooms: Vec<RoomFile>,
    votes: VotesFile,
    locations: Vec<LocationFile>,
}

#[derive(Serialize, Deserialize)]
struct RoomFile {
    room: String,
    /// What points tell of it; a room may have names alone.
    survey: Option<SurveyFile>,
    /// Label, and number in the room.
    instances: Vec<(String, u32)>,
}

#[derive(Serialize, Deserialize)]
struct SurveyFile {
    points: u64,
    bbox: Option<[f64; 6]>,
    wall_direction_deg: u32,
    floor_m2: f64,
    polygons: Vec<(Vec<DVec2File>, Vec<Vec<DVec2File>>)>,
}

type DVec2File = [f64; 2];

#[derive(Serialize, Deserialize)]
struct VotesFile {
    far_m: f64,
    face_count: u64,
    faces_without_vote: u64,
    unlabeled_points: u64,
    total: RowFile,
    rooms: Vec<(u32, String, RowFile)>,
    classes: Vec<(String, RowFile)>,
}

/// The columns of a [`VoteRow`].
type RowFile = [u64; 7];

#[derive(Serialize, Deserialize)]
struct LocationFile {
    uuid: String,
    room: String,
    location: [f64; 3],
    world_from_camera_columns: [f64; 9],
    line: u64,
}

impl AreaFile {
    fn of(plan: &AreaPlan, face_labels_xxh3_128: Checksum) -> Self {
        let survey = |room: Room| plan.annotated.rooms.iter().find(|r| r.room == room).map(survey_file);
        let rooms = plan.names.iter().map(|names| RoomFile {
            room: names.room.to_string(),
            survey: survey(names.room),
            instances: names.instances.iter().map(|i| (i.label.to_string(), i.number_in_room)).collect(),
        });
        let locations = plan.locations.iter().zip(&plan.location_rooms).map(|(l, room)| LocationFile {
            uuid: l.uuid.clone(),
            room: room.to_string(),
            location: l.pose.location.to_array(),
            world_from_camera_columns: l.pose.world_from_camera.to_cols_array(),
            line: l.line,
        });
        Self {
            area: plan.area,
            faces: plan.annotated.face_labels.len() as u64,
            face_labels_xxh3_128,
            faces_left_out: plan.faces_left_out,
            mesh_box: box_file(plan.mesh_box),
            mesh_area_m2: plan.mesh_area_m2,
            points: plan.annotated.points,
            rooms: rooms.collect(),
            votes: VotesFile::of(&plan.annotated.report),
            locations: locations.collect(),
        }
    }

    fn into_plan(self, path: &Path, face_labels: Vec<LabelId>) -> Result<AreaPlan> {
        let (mut names, mut rooms) = (Vec::new(), Vec::new());
        for file in self.rooms {
            let room: Room = parsed(path, &file.room)?;
            let instances = file.instances.iter().map(|(label, number)| {
                Ok(InstanceName { label: parsed(path, label)?, number_in_room: *number })
            });
            names.push(RoomNames { room, instances: instances.collect::<Result<_>>()? });
            rooms.extend(file.survey.map(|survey| survey.into_room(room)));
        }
        let (mut locations, mut location_rooms) = (Vec::new(), Vec::new());
        for file in self.locations {
            // It will stand in the names of files.
            if !is_valid_uuid(&file.uuid) {
                return Err(FileError::format(
                    path,
                    format!("{:?} is no uuid of a scan location", file.uuid),
                )
                .into());
            }
            location_rooms.push(parsed(path, &file.room)?);
            let pose = Pose {
                location: DVec3::from_array(file.location),
                world_from_camera: DMat3::from_cols_array(&file.world_from_camera_columns),
            };
            locations.push(ScanLocation { uuid: file.uuid, pose, line: file.line });
        }
        Ok(AreaPlan {
            area: self.area,
            annotated: Annotated {
                face_labels,
                report: self.votes.into_report(path)?,
                rooms,
                points: self.points,
                skipped: SkippedLines::default(),
            },
            names,
            locations,
            location_rooms,
            mesh_box: box_of(self.mesh_box),
            mesh_area_m2: self.mesh_area_m2,
            faces_left_out: self.faces_left_out,
        })
    }
}

fn survey_file(room: &SurveyedRoom) -> SurveyFile {
    let ring = |points: &[DVec2]| -> Vec<DVec2File> { points.iter().map(DVec2::to_array).collect() };
    let polygon = |p: &Polygon| (ring(&p.outer), p.holes.iter().map(|hole| ring(hole)).collect());
    SurveyFile {
        points: room.points,
        bbox: box_file(room.bbox),
        wall_direction_deg: room.wall_direction_deg,
        floor_m2: room.footprint.area_m2,
        polygons: room.footprint.polygons.iter().map(polygon).collect(),
    }
}

impl SurveyFile {
    fn into_room(self, room: Room) -> SurveyedRoom {
        let ring =
            |points: &[DVec2File]| -> Vec<DVec2> { points.iter().copied().map(DVec2::from_array).collect() };
        let polygons = self.polygons.iter().map(|(outer, holes)| Polygon {
            outer: ring(outer),
            holes: holes.iter().map(|hole| ring(hole)).collect(),
        });
        SurveyedRoom {
            room,
            points: self.points,
            footprint: Footprint { polygons: polygons.collect(), area_m2: self.floor_m2 },
            bbox: box_of(self.bbox),
            wall_direction_deg: self.wall_direction_deg,
        }
    }
}

impl VotesFile {
    fn of(report: &VoteReport) -> Self {
        Self {
            far_m: f64::from(report.far_m),
            face_count: report.face_count,
            faces_without_vote: report.faces_without_vote,
            unlabeled_points: report.unlabeled_points,
            total: row_file(&report.total),
            rooms: report.rooms.iter().map(|(a, room, row)| (*a, room.to_string(), row_file(row))).collect(),
            classes: report.classes.iter().map(|(c, row)| (c.to_string(), row_file(row))).collect(),
        }
    }

    fn into_report(self, path: &Path) -> Result<VoteReport> {
        let mut rooms = Vec::new();
        for (area, room, row) in self.rooms {
            rooms.push((area, parsed(path, &room)?, vote_row(row)));
        }
        let mut classes = Class::ALL.map(|class| (class, VoteRow::default()));
        for (class, row) in self.classes {
            let class: Class = parsed(path, &class)?;
            classes[class.index()].1 = vote_row(row);
        }
        Ok(VoteReport {
            far_m: self.far_m as f32,
            face_count: self.face_count,
            faces_without_vote: self.faces_without_vote,
            unlabeled_points: self.unlabeled_points,
            total: vote_row(self.total),
            rooms,
            classes,
        })
    }
}

fn row_file(row: &VoteRow) -> RowFile {
    [
        row.points,
        row.far_points,
        row.faces,
        row.face_votes,
        row.contested,
        row.contested_below_three_quarters,
        row.contested_below_half,
    ]
}

fn vote_row(file: RowFile) -> VoteRow {
    let [
        points,
        far_points,
        faces,
        face_votes,
        contested,
        contested_below_three_quarters,
        contested_below_half,
    ] = file;
    VoteRow {
        points,
        far_points,
        faces,
        face_votes,
        contested,
        contested_below_three_quarters,
        contested_below_half,
    }
}

/// A box's corners, as numbers that 64 bits hold exactly; an empty one has none.
fn box_file(bbox: Aabb) -> Option<[f64; 6]> {
    (!bbox.is_empty()).then(|| bbox.to_array().map(f64::from))
}

fn box_of(file: Option<[f64; 6]>) -> Aabb {
    file.map_or(Aabb::EMPTY, |c| {
        let [a, b, c, d, e, f] = c.map(|c| c as f32);
        Aabb { min: Vec3::new(a, b, c), max: Vec3::new(d, e, f) }
    })
}

fn parsed<T: FromStr<Err: Display>>(path: &Path, text: &str) -> Result<T> {
    text.parse().map_err(|e: T::Err| FileError::format(path, e.to_string()).into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::strategy::ValueTree;

    fn room(name: &str) -> Room {
        name.parse().unwrap()
    }

    fn any_row() -> impl Strategy<Value = VoteRow> {
        any::<[u64; 7]>().prop_map(vote_row)
    }

    fn any_number() -> impl Strategy<Value = f64> {
        any::<f64>().prop_filter("JSON has no other", |v| v.is_finite())
    }

    fn any_box() -> impl Strategy<Value = Aabb> {
        let corner = || any::<[f32; 3]>().prop_filter("finite", |v| v.iter().all(|v| v.is_finite()));
        (any::<bool>(), corner(), corner()).prop_map(|(empty, a, b)| {
            if empty { Aabb::EMPTY } else { Aabb::from_points([a, b].map(Vec3::from_array)) }
        })
    }

    prop_compose! {
        fn any_plan()(
            labels in prop::collection::vec(any::<u32>(), 0..200),
            row in any_row(),
            class_row in any_row(),
            number in any_number(),
            ring in prop::collection::vec((any_number(), any_number()), 0..9),
            place in prop::array::uniform12(any_number()),
            boxes in (any_box(), any_box()),
            far_m in any::<f32>().prop_filter("finite", |v| v.is_finite()),
            count in any::<u32>(),
        ) -> AreaPlan {
            let ring: Vec<DVec2> = ring.into_iter().map(|(x, y)| DVec2::new(x, y)).collect();
            let mut classes = Class::ALL.map(|class| (class, row));
            classes[3].1 = class_row;
            let [x, y, z, turn @ ..] = place;
            AreaPlan {
                area: 3,
                annotated: Annotated {
                    face_labels: labels.iter().copied().map(LabelId).collect(),
                    report: VoteReport {
                        far_m,
                        face_count: labels.len() as u64,
                        faces_without_vote: u64::from(count),
                        unlabeled_points: 7,
                        total: row,
                        rooms: vec![(3, room("office_1"), class_row), (4, room("WC_2"), row)],
                        classes,
                    },
                    rooms: vec![SurveyedRoom {
                        room: room("office_1"),
                        points: u64::MAX,
                        footprint: Footprint {
                            polygons: vec![Polygon { outer: ring.clone(), holes: vec![ring.clone(), ring] }],
                            area_m2: number,
                        },
                        bbox: boxes.0,
                        wall_direction_deg: 89,
                    }],
                    points: u64::from(count),
                    skipped: SkippedLines::default(),
                },
                names: vec![
                    RoomNames {
                        room: room("office_1"),
                        instances: vec![InstanceName {
                            label: "chair_12_office_1_3".parse().unwrap(),
                            number_in_room: count,
                        }],
                    },
                    RoomNames { room: room("WC_2"), instances: Vec::new() },
                ],
                locations: vec![ScanLocation {
                    uuid: "00112233445566778899aabbccddeeff".to_owned(),
                    pose: Pose {
                        location: DVec3::new(x, y, z),
                        world_from_camera: DMat3::from_cols_array(&turn),
                    },
                    line: 2,
                }],
                location_rooms: vec![room("WC_2")],
                mesh_box: boxes.1,
                mesh_area_m2: number,
                faces_left_out: 5,
            }
        }
    }

    proptest! {
        #[test]
        fn an_area_comes_back_to_the_bit(plan in any_plan()) {
            let dir = tempfile::tempdir().unwrap();
            plan.write(dir.path()).unwrap();
            let first = std::fs::read(area_file(dir.path())).unwrap();
            let back = AreaPlan::read(dir.path(), 3).unwrap();
            // Equal texts mean equal bits.
            prop_assert_eq!(format!("{back:?}"), format!("{plan:?}"));
            back.write(dir.path()).unwrap();
            prop_assert_eq!(std::fs::read(area_file(dir.path())).unwrap(), first);
        }
    }

    #[test]
    fn damage_and_mixed_up_areas_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let mut plan = any_plan().new_tree(&mut runner).unwrap().current();
        plan.annotated.face_labels = (0..100).map(LabelId).collect();
        plan.write(dir.path()).unwrap();
        assert!(AreaPlan::is_in(dir.path()) && AreaPlan::read(dir.path(), 3).is_ok());
        let refusal =
            |area| AreaPlan::read(dir.path(), area).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(refusal(4).contains("is area 3, not area 4"), "{}", refusal(4));
        let labels = labels_file(dir.path());
        let whole = std::fs::read(&labels).unwrap();
        let mut other = whole.clone();
        *other.last_mut().unwrap() ^= 1;
        for bytes in [&whole[..whole.len() - 4], &[], &other] {
            std::fs::write(&labels, bytes).unwrap();
            assert!(refusal(3).contains("face_labels.npy: is damaged"), "{}", refusal(3));
        }
        std::fs::remove_file(&labels).unwrap();
        assert!(refusal(3).contains("face_labels.npy"), "{}", refusal(3));
    }

    #[test]
    fn uuids_that_lead_elsewhere_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let mut plan = any_plan().new_tree(&mut runner).unwrap().current();
        plan.locations[0].uuid = "../../elsewhere".into();
        plan.write(dir.path()).unwrap();
        let e = AreaPlan::read(dir.path(), 3).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(e.contains("\"../../elsewhere\" is no uuid"), "{e}");
    }
}
