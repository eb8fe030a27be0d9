//! Evaluates the panoptic quality of points: numbers of a published script, files, options, faults.

use crate::points::{assert_perfect, eval, integers, npz, options, rooms, write_instances};
use s3d_dataset::pack::ClassList;
use s3d_eval::panoptic::{ClassCounts, PanopticCounts, PanopticScore, mean};
use s3d_eval::points::panoptic_counts;
use s3d_eval::{EvalOptions, Folds, Protocol};
use serde_json::Value;
use std::fs;

const CLASSES: usize = 13;
const STUFF: [usize; 3] = [0, 1, 2];

/// Expands runs `[class, instance, count]`.
fn points(runs: &Value) -> Vec<(i64, i64)> {
    let run = |run: &Value| {
        let [class, instance, count] = [0, 1, 2].map(|at| run[at].as_i64().unwrap());
        vec![(class, instance); count as usize]
    };
    runs.as_array().unwrap().iter().flat_map(run).collect()
}

#[track_caller]
fn assert_same(score: PanopticScore, expected: &Value, what: &str) {
    for (at, got) in [score.pq, score.sq, score.rq].into_iter().enumerate() {
        match expected[at].as_f64() {
            Some(value) => assert!((got - value).abs() <= 1e-12 * value, "{what}: {got}, and not {value}"),
            None => assert!(got.is_nan(), "{what}: {got}"),
        }
    }
}

#[test]
fn semantic_kitti_gives_the_same_segments_and_scores() {
    let json = |text: &str| serde_json::from_str::<Value>(text).unwrap();
    let cases = json(include_str!("reference/panoptic3d/cases.json"));
    let expected = json(include_str!("reference/panoptic3d/expected.json"));
    for (name, rooms) in cases.as_object().unwrap() {
        for (kind, stuff) in [("stuff", &STUFF[..]), ("none", &[])] {
            let mut sum = PanopticCounts::new(CLASSES);
            for room in rooms.as_array().unwrap() {
                let [truth, predicted] = ["truth", "predicted"].map(|side| points(&room[side]));
                sum.add_counts(&panoptic_counts(truth, predicted, stuff, CLASSES).unwrap());
            }

            let expected = &expected[name][kind];
            for (class, counts) in sum.classes().iter().enumerate() {
                let what = format!("{name}, {kind}, class {class}");
                let of = [counts.matched, counts.invented, counts.missed];
                assert_eq!(Value::from(of.to_vec()), expected["counts"][class], "{what}");
                assert_same(counts.score(), &expected["classes"][class], &what);
            }
            let mean_of = |keep: fn(bool) -> bool| {
                let classes = sum.classes().iter().enumerate();
                let kept: Vec<&ClassCounts> = classes
                    .filter(|(class, _)| keep(stuff.contains(class)))
                    .map(|(_, counts)| counts)
                    .collect();
                mean(kept)
            };
            let means = [mean_of(|is_stuff| !is_stuff), mean_of(|is_stuff| is_stuff), mean_of(|_| true)];
            for (at, score) in means.into_iter().enumerate() {
                assert_same(score, &expected["means"][at], &format!("{name}, {kind}, mean {at}"));
            }
        }
    }
}

#[test]
fn a_data_set_is_a_perfect_prediction_of_its_segments() {
    for form in [2, 4] {
        let dir = tempfile::tempdir().unwrap();
        write_instances(dir.path(), form);
        for stuff in [None, Some(ClassList(Vec::new()))] {
            let mut options = options(None, Folds::EachArea);
            options.stuff = stuff;
            let evaluation = eval(Protocol::Panoptic3d, dir.path(), &options).unwrap();
            let of_stuff = evaluation.score("area 5", "mean of stuff", "PQ").unwrap();
            match options.stuff {
                None => assert_perfect(&evaluation),
                Some(_) => assert!(of_stuff.is_nan(), "{of_stuff}"),
            }
            assert_eq!(evaluation.score("all folds, pooled", "mean", "PQ"), Some(1.0));
            assert_eq!(evaluation.score("area 5", "mean of things", "RQ"), Some(1.0));
            assert!(evaluation.notes.is_empty(), "{:?}", evaluation.notes);
        }
    }
}

/// Stuff needs no instance; things do.
#[test]
fn points_without_an_instance_are_stuff_or_nothing() {
    let dir = tempfile::tempdir().unwrap();
    for (room, (classes, instances)) in rooms() {
        let instances: Vec<i64> = classes
            .iter()
            .zip(&instances)
            .map(|(class, instance)| if [0, 1, 2, 8].contains(class) { -1 } else { *instance })
            .collect();
        let arrays = [("instance", integers(&instances)), ("semantic", integers(&classes))];
        npz(&dir.path().join(format!("{room}.npz")), &arrays);
    }
    let evaluation = eval(Protocol::Panoptic3d, dir.path(), &EvalOptions::default()).unwrap();
    let score = |row| evaluation.score("areas 1, 5", row, "PQ").unwrap();
    assert_eq!([score("wall"), score("mean of stuff"), score("chair"), score("table")], [1.0, 1.0, 0.0, 1.0]);

    let mut options = EvalOptions::default();
    options.stuff = Some(ClassList(vec!["chair".into()]));
    let evaluation = eval(Protocol::Panoptic3d, dir.path(), &options).unwrap();
    let score = |row| evaluation.score("areas 1, 5", row, "PQ").unwrap();
    assert_eq!([score("wall"), score("chair"), score("mean of stuff")], [0.0, 1.0, 1.0]);
    assert!(evaluation.definition[0].contains("stuff class (chair)"), "{:?}", evaluation.definition);
    options.stuff = Some(ClassList(vec!["chairs".into()]));
    assert!(eval(Protocol::Panoptic3d, dir.path(), &options).unwrap_err().is_usage());
}

#[test]
fn wrong_segments_are_refused_with_their_file() {
    let all = rooms();
    let (room, (classes, instances)) = all.first_key_value().unwrap();
    let n = classes.len();
    let ids = || ("instance", integers(instances));
    for (arrays, words) in [
        (vec![ids()], "no array classes"),
        (vec![ids(), ("classes", integers(&[2]))], "instance has the instance"),
        (vec![("pred_masks", integers(&[1]))], "panoptic quality takes `instance`"),
        (vec![ids(), ("semantic", integers(&vec![13; n]))], "13 at point 0 is no class"),
        (vec![ids(), ("semantic", integers(&classes[1..]))], "N or N × 13 is due"),
        (vec![("instance", integers(&instances[1..])), ("classes", integers(&[2]))], "N is due"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        write_instances(dir.path(), 4);
        npz(&dir.path().join(format!("{room}.npz")), &arrays);
        let message = eval(Protocol::Panoptic3d, dir.path(), &EvalOptions::default())
            .unwrap_err()
            .to_string();
        assert!(message.contains(words) && message.contains(room), "{words}: {message}");
    }
    let dir = tempfile::tempdir().unwrap();
    write_instances(dir.path(), 4);
    fs::remove_file(dir.path().join(format!("{room}.npz"))).unwrap();
    let gone = eval(Protocol::Panoptic3d, dir.path(), &EvalOptions::default()).unwrap_err();
    assert!(gone.to_string().contains("no prediction of 1 of"), "{gone}");
}
