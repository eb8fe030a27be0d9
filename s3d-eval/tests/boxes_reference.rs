//! Average precision of boxes, held against mmdetection3d's and Open3D-ML's own numbers: see
//! `reference/boxes/README.md`.

use s3d_dataset::s3d_label::Class;
use s3d_eval::boxes::{ClassScore, Detection, GroundTruth, Rule, average_precision, mean};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

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

/// Whether both are the same number, `null` being NaN, but for a relative error.
fn same(ours: f64, theirs: &Value, error: f64) -> bool {
    let theirs = theirs.as_f64().unwrap_or(f64::NAN);
    (ours.is_nan() && theirs.is_nan()) || (ours - theirs).abs() <= error * theirs.abs()
}

#[test]
fn mmdetection3d_gives_the_same() {
    // It rounds average precision to f32, and their mean.
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
