//! Labels, tables and reports as JSON: what is written comes back, and what cannot be is refused.

use proptest::prelude::*;
use s3d_label::{
    Class, ClassCounts, InstanceSummary, Label, LabelId, LabelTable, NULL_NAME, Room, RoomCounts, RoomType,
    VoteOptions, VoteReport, Votes, number_area,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

fn comes_back<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let json = serde_json::to_string(value).unwrap();
    assert_eq!(&serde_json::from_str::<T>(&json).expect(&json), value);
    // A reader's words are not borrowed.
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
    comes_back(&Class::ALL);
    comes_back(&RoomType::ALL);
    let label: Label = "chair_3_office_5_1".parse().unwrap();
    comes_back(&(label, label.room, LabelId(7)));
    let json = serde_json::to_string(&(label.class, label.room, label, LabelId(7))).unwrap();
    assert_eq!(json, r#"["chair","office_5","chair_3_office_5_1",7]"#);
    assert_eq!(serde_json::from_str::<Room>("\"office\\u005f5\"").unwrap(), label.room);
    assert_eq!(serde_json::to_value(table()).unwrap()[0], NULL_NAME);
    comes_back(&table());
    comes_back(&LabelTable::default());
    comes_back(&(ClassCounts::from_table(&table()), RoomCounts::from_table(&table())));
    comes_back(&number_area(5, [(label.room, Class::Wall, 3), (label.room, Class::Wall, 9)]).unwrap());
    comes_back(&InstanceSummary {
        label: LabelId(2),
        room: label.room,
        class: Class::Chair,
        points: u64::MAX,
        bbox: [0.1, -0.0, 1e-40, f32::MAX, 2.0, 3.0],
    });
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
    assert!(refusal::<VoteReport>(&value.to_string()).contains("length 12"));
    let mut value = serde_json::to_value(&report).unwrap();
    value["rooms"][0][1] = "kitchen_1".into();
    assert!(refusal::<VoteReport>(&value.to_string()).contains("kitchen_1"));
}
