//! Scores that look like a mistake in the files of the predictions have a note that says so.

use crate::points::{data_set, eval, integers, npz, rooms};
use s3d_dataset::DataSet;
use s3d_eval::{Context, EvalOptions, Protocol, evaluate};
use serde_json::json;
use std::fs;
use std::path::Path;

/// Returns the notes on predictions of points that have these arrays in each room.
fn notes(protocol: Protocol, arrays: impl Fn(&[i64]) -> Vec<(&'static str, Vec<u8>)>) -> Vec<String> {
    let dir = tempfile::tempdir().unwrap();
    for (room, (classes, _)) in rooms() {
        npz(&dir.path().join(format!("{room}.npz")), &arrays(&classes));
    }
    eval(protocol, dir.path(), &EvalOptions::default()).unwrap().notes
}

#[test]
fn points_without_predictions_or_of_one_class_are_noted() {
    let of = |number: i64| {
        move |classes: &[i64]| {
            let numbers = vec![number; classes.len()];
            vec![("instance", integers(&numbers)), ("semantic", integers(&vec![2; classes.len()]))]
        }
    };
    for (protocol, noun) in [(Protocol::InstCov, "instances"), (Protocol::Panoptic3d, "segments")] {
        let told = notes(protocol, of(0));
        assert!(told[0].starts_with("Doubtful: all ") && told[0].contains(noun), "{protocol}: {told:?}");
        assert!(told[0].contains("the class wall"), "{protocol}: {told:?}");
    }
    let told = notes(Protocol::InstCov, of(-1));
    assert_eq!(told, ["Doubtful: no instances are predicted, in any room."]);
    let told = notes(Protocol::InstAp, |classes| {
        let ids = vec![-1; classes.len()];
        vec![("instance", integers(&ids)), ("classes", integers(&[])), ("scores", integers(&[]))]
    });
    assert!(told[0].starts_with("Doubtful: no instances of 100 points or more"), "{told:?}");
    let told = notes(Protocol::Sem3d, |classes| vec![("semantic", integers(&vec![0; classes.len()]))]);
    assert!(told[0].contains("predicted points are of the class ceiling"), "{told:?}");
    let right = notes(Protocol::Sem3d, |classes| vec![("semantic", integers(classes))]);
    assert!(right.is_empty(), "{right:?}");
}

/// Returns the notes on boxes that are true ones, scaled and moved.
fn notes_on_boxes(folder: &Path, scale: f32, offset: f32) -> String {
    let data = DataSet::open(data_set()).unwrap();
    let mut list = Vec::new();
    for area in data.areas() {
        for i in data.instances(*area).unwrap() {
            let b = i.bbox.map(|c| scale * c + offset);
            list.push(json!({"area": area, "room": i.room, "class": i.class, "score": 0.5,
                "min": b[..3], "max": b[3..]}));
        }
    }
    let path = folder.join("boxes.json");
    fs::write(&path, json!(list).to_string()).unwrap();
    let options = EvalOptions::default();
    let evaluation = evaluate(Protocol::Det, data_set(), &path, &options, &Context::default()).unwrap();
    evaluation.notes.join("\n")
}

#[test]
fn boxes_in_another_unit_or_frame_are_noted() {
    let dir = tempfile::tempdir().unwrap();
    let same = notes_on_boxes(dir.path(), 1.0, 0.0);
    assert!(!same.contains("Doubtful"), "{same}");
    let far = notes_on_boxes(dir.path(), 1.0, 500.0);
    assert!(far.contains("Doubtful: no detected box touches a true one"), "{far}");
    let millimetres = notes_on_boxes(dir.path(), 1000.0, 0.0);
    assert!(millimetres.contains("Doubtful: the longest side of a detected box"), "{millimetres}");
}
