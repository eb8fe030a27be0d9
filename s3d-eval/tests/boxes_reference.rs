//! Compares the average precision of boxes with the numbers of mmdetection3d and Open3D-ML:
//! `reference/boxes/README.md`.

use crate::scene;
use s3d_dataset::s3d_label::Class;
use s3d_eval::boxes::{ClassScore, Detection, GroundTruth, Rule, average_precision, mean};
use s3d_eval::{BoxSource, Context, EvalOptions, Folds, Protocol, evaluate};
use s3d_io::dataset::{InstanceEntry, Layout};
use s3d_io::fs::{checksum_of_file, write_json};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

#[derive(Deserialize)]
struct Case {
    classes: usize,
    /// Room, class, box in steps of 1/256 m.
    truth: Vec<(u32, usize, [f64; 6])>,
    /// Room, class, score in steps of 1/4096, box.
    detections: Vec<(u32, usize, f64, [f64; 6])>,
}

impl Case {
    fn scores(&self, threshold: f64, rule: Rule) -> Vec<ClassScore> {
        let metres = |b: &[f64; 6]| b.map(|v| v / 256.0);
        let truth: Vec<GroundTruth> = (self.truth.iter())
            .map(|(room, c, b)| GroundTruth { room: *room, class: Class::S3DIS[*c], bbox: metres(b) })
            .collect();
        let detections: Vec<Detection> = (self.detections.iter())
            .map(|(room, c, score, b)| {
                let (class, score) = (Class::S3DIS[*c], score / 4096.0);
                Detection { room: *room, class, score, bbox: metres(b) }
            })
            .collect();
        average_precision(&truth, &detections, &Class::S3DIS[..self.classes], threshold, rule)
    }
}

fn cases() -> BTreeMap<String, (Case, Value)> {
    let cases: BTreeMap<String, Case> =
        serde_json::from_str(include_str!("reference/boxes/cases.json")).unwrap();
    let mut numbers: BTreeMap<String, Value> =
        serde_json::from_str(include_str!("reference/boxes/reference.json")).unwrap();
    assert!(cases.len() == 17 && cases.keys().eq(numbers.keys()));
    cases
        .into_iter()
        .map(|(name, case)| {
            let of = numbers.remove(&name).unwrap();
            (name, (case, of))
        })
        .collect()
}

/// Whether two numbers are equal up to a relative error. `null` is NaN.
fn same(ours: f64, theirs: &Value, error: f64) -> bool {
    let theirs = theirs.as_f64().unwrap_or(f64::NAN);
    (ours.is_nan() && theirs.is_nan()) || (ours - theirs).abs() <= error * theirs.abs()
}

#[test]
fn mmdetection3d_gives_the_same() {
    // The program rounds each average precision and their mean to f32.
    const F32: f64 = 1.2e-7;
    for (name, (case, numbers)) in cases() {
        let theirs = &numbers["mmdetection3d"];
        for (threshold, suffix) in [(0.25, "0.25"), (0.5, "0.50")] {
            let scores = case.scores(threshold, Rule::Mmdetection3d);
            for (class, score) in scores.iter().enumerate() {
                let [ap, recall] = ["AP", "rec"].map(|what| theirs.get(format!("{class}_{what}_{suffix}")));
                let told = format!("{name}, class {class}, {suffix}: {score:?}, {ap:?}, {recall:?}");
                assert_eq!(score.is_absent(), ap.is_none(), "{told}");
                if let (Some(ap), Some(recall)) = (ap, recall) {
                    assert!(same(score.ap, ap, F32) && same(score.recall, recall, 1e-12), "{told}");
                }
            }
            let (ap, recall) = mean(&scores, Rule::Mmdetection3d);
            let told = format!("{name}, mean, {suffix}: {ap}, {recall}");
            assert!(same(ap, &theirs[format!("mAP_{suffix}")], 2.0 * F32), "{told}");
            assert!(same(recall, &theirs[format!("mAR_{suffix}")], 1e-12), "{told}");
        }
    }
}

#[test]
fn open3d_ml_gives_the_same() {
    for (name, (case, numbers)) in cases() {
        for (threshold, key) in [(0.25, "AP_0.25"), (0.5, "AP_0.50")] {
            let scores = case.scores(threshold, Rule::Open3dMl);
            let theirs = numbers["open3d-ml"][key].as_array().unwrap();
            assert_eq!(scores.len(), theirs.len());
            for (class, (score, ap)) in scores.iter().zip(theirs).enumerate() {
                assert!(same(100.0 * score.ap, ap, 1e-12), "{name}, class {class}, {key}: {score:?}, {ap}");
            }
        }
    }
}

/// The detections of `s3d detect` in rooms of a generated area.
#[derive(Deserialize)]
struct Detected {
    classes: Vec<String>,
    rooms: Vec<String>,
    /// Room, class, box in metres.
    truth: Vec<(usize, usize, [f32; 6])>,
    /// Room, class, score, box.
    detections: Vec<(usize, usize, f64, [f32; 6])>,
}

/// Makes a data set in a new folder, whose area 5 has only these instances.
fn write_with_instances(root: &Path, detected: &Detected) {
    scene::copy_to(root);
    let entries = detected
        .truth
        .iter()
        .enumerate()
        .map(|(i, &(room, class, bbox))| InstanceEntry {
            label: format!("{}_{i}_{}_5", detected.classes[class], detected.rooms[room]),
            label_index: 0,
            class: detected.classes[class].clone(),
            room: detected.rooms[room].clone(),
            points: 2,
            bbox,
            voxel_occupancy: vec![0; 216],
            points_per_voxel: vec![0; 216],
            surface: None,
        });
    let path = Layout::new(root).instances_json(5);
    let (bytes, sum) = checksum_of_file(&path).unwrap();
    write_json(&path, &json!({"instances": entries.collect::<Vec<_>>()})).unwrap();

    let (new_bytes, new_sum) = checksum_of_file(&path).unwrap();
    scene::change_list(root, |list| {
        list.replace(&format!("{bytes},{sum}"), &format!("{new_bytes},{new_sum}"))
    });
}

#[test]
fn mmdetection3d_gives_the_same_for_detections_of_our_detector() {
    let detected: Detected = serde_json::from_str(include_str!("reference/boxes/detector.json")).unwrap();
    let theirs: Value =
        serde_json::from_str(include_str!("reference/boxes/detector_reference.json")).unwrap();
    let list = detected.detections.iter().map(|(room, class, score, b)| {
        let room = &detected.rooms[*room];
        let class = &detected.classes[*class];
        json!({"area": 5, "room": room, "class": class, "score": score, "min": b[..3], "max": b[3..]})
    });
    let folder = tempfile::tempdir().unwrap();
    let found = folder.path().join("found.json");
    write_json(&found, &list.collect::<Vec<_>>()).unwrap();
    let mut options = EvalOptions::default();
    options.folds = Folds::Areas(vec![5]);
    options.boxes = Some(BoxSource::Annotations);
    let root = folder.path().join("data set");
    write_with_instances(&root, &detected);
    let ours = evaluate(Protocol::Det, &root, &found, &options, &Context::default()).unwrap();
    assert_eq!(ours.counted["boxes"], detected.truth.len() as u64);
    assert_eq!(ours.counted["detections"], detected.detections.len() as u64);

    let mut between = 0;
    for class in detected.classes.iter().map(String::as_str).chain(["mean"]) {
        for suffix in ["0.25", "0.50"] {
            let [ap, recall] = match class {
                "mean" => [format!("mAP_{suffix}"), format!("mAR_{suffix}")],
                _ => [format!("{class}_AP_{suffix}"), format!("{class}_rec_{suffix}")],
            };
            for (column, key, error) in [("AP", ap, 2.4e-7), ("AR", recall, 1e-12)] {
                let ours = ours.score("area 5", class, &format!("{column}@{suffix}")).unwrap();
                assert!(same(ours, &theirs[&key], error), "{key}: {ours}, {}", theirs[&key]);
                between += usize::from(ours > 0.0 && ours < 1.0);
            }
        }
    }
    // Enough numbers lie between 0 and 1.
    assert!(between > 30, "{between}");
}
