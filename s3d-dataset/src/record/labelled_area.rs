//! A labelled area as files: the result of voting, so that no other process has to open the annotations or
//! vote again.
//!
//! A folder holds two files: the small `area.jsonl`, and `label_of_face.npy`, an array of `<u4` with a label
//! index for each face, whose highest bit is set if the label was filled. `area.jsonl` holds the checksum of
//! the array and is written after it, so an area that can be read is whole. Processes that write the same
//! area at the same time write the same bytes.

use crate::error::Result;
use crate::record::checked::{read_checked, write_checked};
use crate::survey::labelled_area::LabelledArea;
use s3d_io::Error as FileError;
use s3d_io::cloud::NpyWriter;
use s3d_io::dataset::is_valid_uuid;
use s3d_io::fs::{Checksum, create_dir};
use s3d_label::LabelId;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The bit that marks the label of a face without votes. Every index is smaller.
const FILLED: u32 = 1 << 31;

impl LabelledArea {
    /// Returns whether an area was written into `folder`. Its files are not checked.
    pub(crate) fn is_in(folder: &Path) -> bool {
        area_file(folder).is_file()
    }

    /// Writes the area into `folder`.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        create_dir(folder)?;
        let mut label_of_face: Vec<u32> = self.annotated.label_of_face.iter().map(|l| l.0).collect();
        self.annotated
            .filled
            .iter()
            .for_each(|&face| label_of_face[face as usize] |= FILLED);

        let bytes: Vec<u8> = label_of_face.iter().flat_map(|l| l.to_le_bytes()).collect();
        let mut array = NpyWriter::create(&labels_file(folder), "<u4", &[label_of_face.len() as u64])?;
        array.put(&bytes)?;
        array.finish()?;

        let faces = label_of_face.len() as u64;
        let file = AreaFile { faces, label_of_face_xxh3_128: Checksum::of(&bytes), plan: self };
        write_checked(&area_file(folder), &file)
    }

    /// Reads an area that [`write`](Self::write) wrote.
    ///
    /// # Errors
    /// Fails if a file is missing or damaged, or the area has another number.
    pub(crate) fn read(folder: &Path, area: u32) -> Result<Self> {
        let path = area_file(folder);
        let AreaFile { faces, label_of_face_xxh3_128, mut plan } = read_checked::<AreaFile<Self>>(&path)?;

        let refused = |message| Err(FileError::format(&path, message).into());
        if plan.area != area {
            return refused(format!("is area {}, not area {area}", plan.area));
        }
        // The uuids will be parts of file names.
        if let Some(location) = plan.locations.iter().find(|l| !is_valid_uuid(&l.uuid)) {
            return refused(format!("{:?} is no uuid of a scan location", location.uuid));
        }

        let locations = plan.locations.len();
        let rooms = plan.location_rooms.len();
        if locations != rooms {
            return refused(format!("has {locations} scan locations, and rooms of {rooms}"));
        }

        let labels = read_label_of_face(&labels_file(folder), faces, label_of_face_xxh3_128)?;
        let filled = (0u32..).zip(&labels).filter(|(_, label)| **label & FILLED != 0);
        plan.annotated.filled = filled.map(|(face, _)| face).collect();
        plan.annotated.label_of_face = labels.iter().map(|label| LabelId(label & !FILLED)).collect();
        Ok(plan)
    }
}

fn area_file(folder: &Path) -> PathBuf {
    folder.join("area.jsonl")
}

fn labels_file(folder: &Path) -> PathBuf {
    folder.join("label_of_face.npy")
}

/// Reads the labels from the end of the file. `area.jsonl` says how many there are, and their checksum.
fn read_label_of_face(path: &Path, faces: u64, checksum: Checksum) -> Result<Vec<u32>> {
    let bytes = s3d_io::fs::read_file(path)?;
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
    Ok(labels.iter().map(|b| u32::from_le_bytes(*b)).collect())
}

/// `area.jsonl`.
#[derive(Serialize, Deserialize)]
struct AreaFile<P> {
    faces: u64,
    /// The checksum of the labels' bytes, without the array's header.
    label_of_face_xxh3_128: Checksum,
    plan: P,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::{Surface, Unlabelled};
    use crate::survey::annotated::Annotated;
    use crate::survey::annotated::{SkippedLines, SurveyedRoom};
    use crate::survey::columns::Columns;
    use crate::survey::room_names::{InstanceName, RoomNames};
    use crate::survey::strays::Strays;
    use crate::survey::surface_seen::SurfaceSeen;
    use glam::{DMat3, DVec2, DVec3, Vec3};
    use proptest::prelude::*;
    use proptest::strategy::ValueTree;
    use s3d_geom::{Aabb, Footprint, Polygon, Pose};
    use s3d_io::camera::ScanLocation;
    use s3d_label::{Class, Room, VoteReport, VoteRow};

    fn room(name: &str) -> Room {
        name.parse().unwrap()
    }

    fn any_row() -> impl Strategy<Value = VoteRow> {
        any::<[u64; 7]>().prop_map(|columns| {
            let [points, far_points, faces, face_votes, contested, three_quarters, half] = columns;
            VoteRow {
                points,
                far_points,
                faces,
                face_votes,
                contested,
                contested_below_three_quarters: three_quarters,
                contested_below_half: half,
            }
        })
    }

    fn any_number() -> impl Strategy<Value = f64> {
        any::<f64>().prop_filter("JSON has no other", |v| v.is_finite())
    }

    fn any_corner() -> impl Strategy<Value = [f32; 3]> {
        any::<[f32; 3]>().prop_filter("finite", |v| v.iter().all(|v| v.is_finite()))
    }

    /// Returns why an area is refused, or nothing.
    fn refusal(folder: &Path, area: u32) -> String {
        LabelledArea::read(folder, area)
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default()
    }

    fn any_box() -> impl Strategy<Value = Aabb> {
        (any::<bool>(), any_corner(), any_corner()).prop_map(|(empty, a, b)| {
            if empty {
                Aabb::EMPTY
            } else {
                Aabb::from_points([a, b].map(Vec3::from_array))
            }
        })
    }

    prop_compose! {
        fn any_plan()(
            labels in prop::collection::vec((0..FILLED, any::<bool>()), 0..200),
            row in any_row(),
            class_row in any_row(),
            number in any_number(),
            ring in prop::collection::vec((any_number(), any_number()), 0..9),
            place in prop::array::uniform12(any_number()),
            boxes in (any_box(), any_box()),
            far_m in any::<f32>().prop_filter("finite", |v| v.is_finite()),
            count in any::<u32>(),
        ) -> LabelledArea {
            let ring: Vec<DVec2> = ring.into_iter().map(|(x, y)| DVec2::new(x, y)).collect();
            let mut classes = Class::S3DIS.map(|class| (class, row));
            classes[3].1 = class_row;
            let [x, y, z, turn @ ..] = place;
            LabelledArea {
                area: 3,
                annotated: Annotated {
                    label_of_face: labels.iter().map(|(label, _)| LabelId(*label)).collect(),
                    filled: (0..).zip(&labels).filter(|(_, (_, filled))| *filled).map(|(f, _)| f).collect(),
                    unlabelled: Unlabelled {
                        without_votes: Surface { faces: 7, m2: number, pixels: None },
                        without_label: Surface { faces: 2, m2: 0.1, pixels: Some(3) },
                    },
                    report: VoteReport {
                        far_m,
                        face_count: labels.len() as u64,
                        faces_without_vote: u64::from(count),
                        unlabeled_points: 7,
                        total: row,
                        rooms: vec![(3, room("office_1"), class_row), (4, room("WC_2"), row)],
                        classes: classes.into(),
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
                        columns: Columns::default(),
                    }],
                    points: u64::from(count),
                    skipped: SkippedLines::default(),
                    strays: Strays::default(),
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
                location_rooms: vec![Some(room("WC_2"))],
                surface_seen: Some(SurfaceSeen { surface_m2: number, visible_m2: 1.0, seen_m2: [number; 3] }),
                mesh_box: boxes.1,
                mesh_area_m2: number,
                faces_left_out: 5,
                warnings: vec!["one \"thing\"\n".into(), String::new()],
            }
        }
    }

    proptest! {
        #[test]
        fn an_area_comes_back_to_the_bit(plan in any_plan()) {
            let dir = tempfile::tempdir().unwrap();
            plan.write(dir.path()).unwrap();
            let first = std::fs::read(area_file(dir.path())).unwrap();
            let back = LabelledArea::read(dir.path(), 3).unwrap();
            // Equal debug texts mean equal bits.
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
        plan.annotated.label_of_face = (0..100).map(LabelId).collect();
        plan.annotated.filled = vec![0, 99];
        plan.write(dir.path()).unwrap();
        assert!(LabelledArea::is_in(dir.path()) && LabelledArea::read(dir.path(), 3).is_ok());

        assert!(refusal(dir.path(), 4).contains("is area 3, not area 4"), "{}", refusal(dir.path(), 4));

        let labels = labels_file(dir.path());
        let whole = std::fs::read(&labels).unwrap();
        let mut other = whole.clone();
        *other.last_mut().unwrap() ^= 1;
        for bytes in [&whole[..whole.len() - 4], &[], &other] {
            std::fs::write(&labels, bytes).unwrap();
            assert!(
                refusal(dir.path(), 3).contains("label_of_face.npy: is damaged"),
                "{}",
                refusal(dir.path(), 3)
            );
        }

        std::fs::remove_file(&labels).unwrap();
        assert!(refusal(dir.path(), 3).contains("label_of_face.npy"), "{}", refusal(dir.path(), 3));
    }

    #[test]
    fn uuids_that_lead_elsewhere_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let mut plan = any_plan().new_tree(&mut runner).unwrap().current();
        plan.locations[0].uuid = "../../elsewhere".into();
        plan.write(dir.path()).unwrap();
        let e = LabelledArea::read(dir.path(), 3)
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default();
        assert!(e.contains("\"../../elsewhere\" is no uuid"), "{e}");
    }

    /// Returns the paths of `value` and all values within it.
    fn paths(value: &serde_json::Value, path: &str) -> Vec<String> {
        let inner: Vec<String> = match value {
            serde_json::Value::Array(list) => list
                .iter()
                .enumerate()
                .flat_map(|(i, v)| paths(v, &format!("{path}/{i}")))
                .collect(),
            serde_json::Value::Object(map) => map
                .iter()
                .flat_map(|(key, v)| paths(v, &format!("{path}/{key}")))
                .collect(),
            _ => Vec::new(),
        };
        [vec![path.to_owned()], inner].concat()
    }

    #[test]
    fn values_of_another_kind_are_refused_wherever_they_stand() {
        let dir = tempfile::tempdir().unwrap();
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        any_plan()
            .new_tree(&mut runner)
            .unwrap()
            .current()
            .write(dir.path())
            .unwrap();
        let text = std::fs::read_to_string(area_file(dir.path())).unwrap();
        let whole: serde_json::Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
        let paths = paths(&whole, "");
        assert!(paths.len() > 100, "{} values", paths.len());

        for path in paths {
            for odd in [serde_json::json!({}), serde_json::json!(true)] {
                let mut file = whole.clone();
                *file.pointer_mut(&path).unwrap() = odd;
                write_checked(&area_file(dir.path()), &file).unwrap();
                assert!(LabelledArea::read(dir.path(), 3).is_err(), "{path}");
            }
        }
    }

    #[test]
    fn a_location_without_a_room_and_a_word_that_is_no_room_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let mut plan = any_plan().new_tree(&mut runner).unwrap().current();
        plan.write(dir.path()).unwrap();
        let text = std::fs::read_to_string(area_file(dir.path())).unwrap();
        let mut file: serde_json::Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
        assert_eq!(refusal(dir.path(), 3), "");

        file["plan"]["names"][0]["room"] = "kitchen_1".into();
        write_checked(&area_file(dir.path()), &file).unwrap();
        assert!(
            refusal(dir.path(), 3).contains("kitchen_1") && refusal(dir.path(), 3).contains("area.jsonl"),
            "{}",
            refusal(dir.path(), 3)
        );

        plan.location_rooms.clear();
        plan.write(dir.path()).unwrap();
        assert!(
            refusal(dir.path(), 3).contains("1 scan locations, and rooms of 0"),
            "{}",
            refusal(dir.path(), 3)
        );
    }
}
