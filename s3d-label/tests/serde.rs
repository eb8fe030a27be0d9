//! Labels, tables and reports as JSON: values are read back equal, and invalid values are refused.

use proptest::prelude::*;
use s3d_label::{
    Class, ClassCounts, InstanceSummary, Label, LabelId, LabelTable, NULL_NAME, Room, RoomCounts, RoomType,
    Taxonomy, VoteOptions, VoteReport, Votes, number_area,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

fn comes_back<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let json = serde_json::to_string(value).unwrap();
    assert_eq!(&serde_json::from_str::<T>(&json).expect(&json), value);
    // A reader cannot lend words.
    assert_eq!(&serde_json::from_reader::<_, T>(json.as_bytes()).expect(&json), value);
}

fn table() -> LabelTable {
    let names = ["chair_1_office_2_1", "chair_2_office_1_1", "table_1_office_1_1", "wall_1_WC_1_2"];
    LabelTable::from_labels(names.map(|name| name.parse().unwrap())).unwrap()
}

proptest! {
    #[test]
    fn reports_come_back_to_the_bit(
        points in prop::collection::vec((0u32..9, 0u32..5, 0f32..0.2), 0..60),
        far_m in any::<f32>().prop_filter("JSON has no other", |v| v.is_finite()),
    ) {
        let mut votes = Votes::with_options(9, VoteOptions { far_m });
        for (face, label, distance_m) in points {
            votes.add(face, LabelId(label), distance_m);
        }
        comes_back(&votes.options());
        comes_back(&VoteReport::new(&votes, &table()).unwrap());
        comes_back(&(0..9).map(|face| votes.of_face(face)).collect::<Vec<_>>());
        comes_back(&(0..5).map(|label| votes.points_of(LabelId(label))).collect::<Vec<_>>());
    }
}

#[test]
fn names_are_words() {
    comes_back(&Class::S3DIS);
    comes_back(&RoomType::S3DIS);
    let label: Label = "chair_3_office_5_1".parse().unwrap();
    comes_back(&(label, label.room, LabelId(7)));
    let json = serde_json::to_string(&(label.class, label.room, label, LabelId(7))).unwrap();
    assert_eq!(json, r#"["chair","office_5","chair_3_office_5_1",7]"#);
    assert_eq!(serde_json::from_str::<Room>("\"office\\u005f5\"").unwrap(), label.room);
    assert_eq!(serde_json::to_value(table()).unwrap()[0], NULL_NAME);
    comes_back(&table());
    comes_back(&LabelTable::default());
    comes_back(&(ClassCounts::from_table(&table()), RoomCounts::from_table(&table())));
    comes_back(&number_area(5, [(label.room, Class::WALL, 3), (label.room, Class::WALL, 9)]).unwrap());
    comes_back(&InstanceSummary {
        label: LabelId(2),
        room: label.room,
        class: Class::CHAIR,
        points: u64::MAX,
        bbox: [0.1, -0.0, 1e-40, f32::MAX, 2.0, 3.0],
    });
}

#[test]
fn names_are_those_of_the_taxonomy_that_reads() {
    let taxonomy = Taxonomy::built_in("nyu40").unwrap();
    let label = taxonomy.label("bed_3_bedroom_5_1").unwrap();
    let table = taxonomy.table([label]).unwrap();
    let report = VoteReport::new(&Votes::new(1), &table).unwrap();
    let json = serde_json::to_string(&(label, label.room, label.class, &table, &report)).unwrap();
    type All = (Label, Room, Class, LabelTable, VoteReport);
    let read = || serde_json::from_str::<All>(&json);
    assert_eq!(
        taxonomy.reading(read).unwrap(),
        (label, label.room, label.class, table.clone(), report.clone())
    );
    assert!(read().unwrap_err().to_string().contains("\"bed\" is no class"));

    // The innermost call counts, and a panic leaves nothing behind.
    let inner = taxonomy.reading(|| Taxonomy::s3dis().reading(read));
    assert!(inner.is_err());
    let _ = std::panic::catch_unwind(|| taxonomy.reading(|| panic!("as a reader should not")));
    assert!(read().is_err());

    // A class of another taxonomy with the same name is a different class.
    let wall = taxonomy.reading(|| serde_json::from_str::<Class>("\"wall\"")).unwrap();
    assert_eq!((wall.index(), wall == Class::WALL, wall.s3dis()), (0, false, Class::WALL));
}

fn refusal<T: DeserializeOwned + Debug>(json: &str) -> String {
    serde_json::from_str::<T>(json).expect_err(json).to_string()
}

#[test]
fn what_is_no_name_or_report_is_refused() {
    assert!(refusal::<Class>(r#""stairs""#).contains("is no class"));
    assert!(refusal::<Class>("3").contains("a class such as"));
    assert!(refusal::<Room>(r#""office_0""#).contains("is no room"));
    assert!(refusal::<Label>(&format!("{NULL_NAME:?}")).contains("null label"));
    assert!(refusal::<LabelId>("-1").contains("-1"));
    assert!(refusal::<LabelTable>("[]").contains("index 0"));
    let wrong = format!("[{NULL_NAME:?},\"wall_1_WC_1_2\",\"chair_1_office_2_1\"]");
    assert!(refusal::<LabelTable>(&wrong).contains("index 2"));

    let report = VoteReport::new(&Votes::new(1), &table()).unwrap();
    let mut value = serde_json::to_value(&report).unwrap();
    let classes = value["classes"].as_array_mut().unwrap();
    classes.swap(0, 1);
    assert!(refusal::<VoteReport>(&value.to_string()).contains("not in their order"));
    value["classes"].as_array_mut().unwrap().pop();
    assert!(refusal::<VoteReport>(&value.to_string()).contains("not in their order"));
    let mut value = serde_json::to_value(&report).unwrap();
    value["rooms"][0][1] = "kitchen_1".into();
    assert!(refusal::<VoteReport>(&value.to_string()).contains("kitchen_1"));
}
