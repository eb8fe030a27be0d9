//! Compares the crate with the published `semantic_labels.json`, if the shared folder with it is there.

use s3d_label::{Class, ClassCounts, Label, LabelId, LabelTable, Room, RoomCounts, RoomType, number_area};
use std::collections::BTreeMap;
use std::path::Path;

/// Returns the published names. If the file is missing, it writes a line to the log and returns `None`.
fn published_names() -> Option<Vec<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/spec/semantic_labels.json");
    #[allow(clippy::print_stderr)] // For the line in the log.
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("skipped: there is no {}", path.display());
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}

fn labels(names: &[String]) -> Vec<Label> {
    names[1..].iter().map(|name| name.parse().unwrap()).collect()
}

#[test]
fn the_table_is_rebuilt_index_by_index_from_its_labels_shuffled() {
    let Some(names) = published_names() else { return };
    assert_eq!(names.len(), 9816);
    let mut labels = labels(&names);
    let mut state = 7u64;
    for i in (1..labels.len()).rev() {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        labels.swap(i, (state >> 33) as usize % (i + 1));
    }
    assert_ne!(labels[0].to_string(), names[1]);
    let table = LabelTable::from_labels(labels).unwrap();
    assert_eq!(table.len(), names.len());
    for (i, name) in names.iter().enumerate() {
        let id = LabelId(i as u32);
        assert_eq!(&table.name_of(id), name, "index {i}");
        if let Some(label) = table.get(id) {
            assert_eq!(table.id_of(label), Some(id));
        }
    }
    assert_eq!(table.name_of(LabelId(257)), "board_3_hallway_4_6");
    assert_eq!(LabelTable::from_names(&names), Ok(table));
}

#[test]
fn instance_numbers_of_areas_1_to_4_follow_from_rooms_and_numbers_in_rooms() {
    let Some(names) = published_names() else { return };
    let published = labels(&names);
    for area in 1..=4 {
        // The number in a room is the rank of the instance number among the labels of the same class and
        // room.
        let mut by_room: BTreeMap<(Room, Class), Vec<Label>> = BTreeMap::new();
        for &label in published.iter().filter(|l| l.area == area) {
            by_room.entry((label.room, label.class)).or_default().push(label);
        }
        let mut expected = BTreeMap::new();
        for (&(room, class), labels) in &mut by_room {
            labels.sort_by_key(|l| l.instance);
            for (i, &label) in labels.iter().enumerate() {
                expected.insert((room, class, i as u32 + 1), label);
            }
        }

        let numbered = number_area(area, expected.keys().copied()).unwrap();
        assert_eq!(numbered.len(), expected.len());
        for i in numbered {
            assert_eq!(i.label, expected[&(i.room, i.class, i.number_in_room)]);
        }
    }
}

#[test]
fn tables_of_statistics_are_those_of_the_published_labels() {
    let Some(names) = published_names() else { return };
    let table = LabelTable::from_names(&names).unwrap();
    let classes = ClassCounts::from_table(&table);
    let total = classes.total();
    assert_eq!(total.iter().sum::<u64>(), 9815);
    assert_eq!(total.iter().sum::<u64>() - total[Class::CLUTTER.index()], 5933);
    assert_eq!((classes.of(2, Class::CHAIR), classes.of(4, Class::BEAM)), (545, 3));

    let rooms = RoomCounts::from_table(&table);
    let by_area: Vec<(u32, u64)> = rooms.areas.iter().map(|(area, n)| (*area, n.iter().sum())).collect();
    assert_eq!(by_area, [(1, 44), (2, 40), (3, 23), (4, 49), (5, 68), (6, 48)]);
    assert_eq!((rooms.of(5, RoomType::OFFICE), rooms.of(6, RoomType::OPENSPACE)), (42, 1));
}
