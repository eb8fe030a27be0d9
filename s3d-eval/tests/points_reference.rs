//! Compares the metrics of points with the programs that define them: `reference/points`.

use s3d_eval::points::{
    AbsentClass, InstanceMatches, Mask, RoomCoverage, SemanticCounts, coverage, instance_ap,
    instances_of_masks, instances_of_segments,
};
use serde_json::Value;

const CLASSES: usize = 13;

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

/// Returns the name, the rooms and the expected numbers of each case of a protocol.
fn cases(protocol: &str) -> Vec<(String, Vec<Value>, Value)> {
    let cases = json(include_str!("reference/points/cases.json"));
    let expected = json(include_str!("reference/points/expected.json"));
    let of = |(name, rooms): (&String, &Value)| {
        (name.clone(), rooms.as_array().unwrap().clone(), expected[protocol][name].clone())
    };
    cases[protocol].as_object().unwrap().iter().map(of).collect()
}

/// Expands runs `[…, count]` to points that have the other numbers.
fn points<const N: usize>(runs: &Value) -> Vec<[i64; N]> {
    let number = |value: &Value| value.as_i64().unwrap();
    let run = |run: &Value| {
        let count = usize::try_from(number(&run[N])).unwrap();
        vec![std::array::from_fn(|i| number(&run[i])); count]
    };
    runs.as_array().unwrap().iter().flat_map(run).collect()
}

fn truth(room: &Value) -> Vec<(i64, i64)> {
    points::<2>(&room["truth"])
        .into_iter()
        .map(|[class, instance]| (class, instance))
        .collect()
}

/// Asserts that numbers are equal to a relative 1e-12. `null` is NaN.
#[track_caller]
fn assert_same(got: f64, expected: &Value, what: &str) {
    let Some(expected) = expected.as_f64() else {
        assert!(expected.is_null() && got.is_nan(), "{what}: {got}, and not {expected}");
        return;
    };
    assert!((got - expected).abs() <= 1e-12 * expected.abs(), "{what}: {got}, and not {expected}");
}

#[track_caller]
fn assert_all_same(got: &[f64], expected: &Value, what: &str) {
    let expected = expected.as_array().unwrap();
    assert_eq!(got.len(), expected.len(), "{what}");
    for (i, (got, expected)) in got.iter().zip(expected).enumerate() {
        assert_same(*got, expected, &format!("{what} {i}"));
    }
}

#[test]
fn pointcept_mmdetection3d_and_open3d_ml_give_the_same_for_classes() {
    for (name, rooms, expected) in cases("sem3d") {
        let rooms: Vec<SemanticCounts> = rooms
            .iter()
            .map(|room| {
                let predicted = points::<1>(&room["predicted"]).into_iter().map(|[class]| class);
                let mut counts = SemanticCounts::new(CLASSES);
                counts.add(truth(room).into_iter().map(|(class, _)| class).zip(predicted));
                counts
            })
            .collect();
        let sum = SemanticCounts::sum(CLASSES, &rooms);
        for (program, absent) in [
            ("pointcept", AbsentClass::Zero),
            ("mmdetection3d", AbsentClass::LeftOut),
            ("open3d-ml", AbsentClass::LeftOut),
        ] {
            let scores = sum.scores(absent);
            let what = format!("{name}, {program}");
            let expected = &expected[program];
            assert_all_same(&scores.iou, &expected[0], &what);
            assert_all_same(&scores.accuracy, &expected[1], &what);
            assert_same(scores.mean_iou, &expected[2], &what);
            assert_same(scores.mean_accuracy, &expected[3], &what);
            if let Some(overall) = expected.get(4) {
                assert_same(scores.overall_accuracy, overall, &what);
            }
        }
    }
}

#[test]
fn pointcept_gives_the_same_average_precision_of_instances() {
    for (name, rooms, expected) in cases("inst-ap") {
        let rooms: Vec<InstanceMatches> = rooms
            .iter()
            .map(|room| {
                let truth = truth(room);
                let predicted = room["masks"].as_array().unwrap();
                let inside: Vec<Vec<bool>> = predicted
                    .iter()
                    .map(|mask| {
                        let mut inside = vec![false; truth.len()];
                        for range in mask["ranges"].as_array().unwrap() {
                            let [a, b] = [0, 1].map(|i| range[i].as_u64().unwrap() as usize);
                            inside[a..b].fill(true);
                        }
                        inside
                    })
                    .collect();
                let mask = |(mask, inside)| {
                    let mask: &Value = mask;
                    let class = mask["class"].as_u64().unwrap() as usize;
                    Mask { class, score: mask["score"].as_f64().unwrap(), inside }
                };
                let masks: Vec<Mask<'_>> = predicted
                    .iter()
                    .zip(inside.iter().map(Vec::as_slice))
                    .map(mask)
                    .collect();
                let (truth, predicted) = instances_of_masks(&truth, &masks);
                InstanceMatches::new(&truth, &predicted, CLASSES)
            })
            .collect();
        let ap = instance_ap(&rooms.iter().collect::<Vec<_>>());
        for (class, ap) in ap.by_class.iter().enumerate() {
            assert_all_same(ap, &expected["classes"][class], &format!("{name}, class {class}"));
        }
        assert_all_same(&ap.mean, &expected["mean"], &name);
    }
}

#[test]
fn asis_gives_the_same_coverage_of_instances() {
    for (name, rooms, expected) in cases("inst-cov") {
        let rooms: Vec<RoomCoverage> = rooms
            .iter()
            .map(|room| {
                let classes = points::<1>(&room["classes"]).into_iter();
                let predicted = classes.zip(points::<1>(&room["instances"]));
                let predicted: Vec<_> = predicted.map(|([class], [instance])| (class, instance)).collect();
                let (truth, predicted) = instances_of_segments(&truth(room), &predicted);
                RoomCoverage::new(&truth, &predicted, CLASSES)
            })
            .collect();
        let scores = coverage(&rooms.iter().collect::<Vec<_>>());
        for (class, scores) in scores.iter().enumerate() {
            assert_all_same(
                &scores.to_array(),
                &expected["classes"][class],
                &format!("{name}, class {class}"),
            );
        }
        let mean = std::array::from_fn::<f64, 4, _>(|i| {
            scores.iter().map(|scores| scores.to_array()[i]).sum::<f64>() / CLASSES as f64
        });
        assert_all_same(&mean, &expected["mean"], &name);
    }
}
