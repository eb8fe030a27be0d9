//! Compares panoptic quality with the numbers of panopticapi: `reference/panoptic/README.md`.

use s3d_eval::panoptic::{PanopticCounts, PanopticScore, Segment, mean};
use serde_json::Value;
use std::collections::BTreeMap;

/// The pixels, and the number and the class of each segment.
type Side = (Vec<u32>, Vec<(u32, usize)>);

const CLASSES: usize = 5;
/// The classes from here on are stuff.
const STUFF: usize = 3;

fn same(ours: f64, theirs: &Value) -> bool {
    let theirs = theirs.as_f64().unwrap();
    (ours - theirs).abs() <= 1e-12 * theirs
}

fn assert_same(ours: PanopticScore, theirs: &Value, name: &str) {
    let pairs = [(ours.pq, "pq"), (ours.sq, "sq"), (ours.rq, "rq")];
    if theirs.is_null() {
        // The script stops if there is no class to take the mean over.
        return assert!(pairs.iter().all(|(ours, _)| ours.is_nan()), "{name}: {ours:?}");
    }
    assert!(pairs.iter().all(|(ours, key)| same(*ours, &theirs[key])), "{name}: {ours:?}, {theirs}");
}

#[test]
fn panopticapi_gives_the_same() {
    let cases: BTreeMap<String, Vec<[Side; 2]>> =
        serde_json::from_str(include_str!("reference/panoptic/cases.json")).unwrap();
    let numbers: BTreeMap<String, Value> =
        serde_json::from_str(include_str!("reference/panoptic/reference.json")).unwrap();
    assert!(cases.len() == 11 && cases.keys().eq(numbers.keys()));
    for ((name, images), theirs) in cases.iter().zip(numbers.values()) {
        let mut sum = PanopticCounts::new(CLASSES);
        for [truth, found] in images {
            let segments = |side: &Side| {
                side.1
                    .iter()
                    .map(|&(id, class)| Segment { id, class })
                    .collect::<Vec<_>>()
            };
            let mut counts = PanopticCounts::new(CLASSES);
            counts
                .add(&truth.0, &segments(truth), &found.0, &segments(found))
                .unwrap();
            sum.add_counts(&counts);
        }
        let classes = sum.classes();
        for (class, counts) in classes.iter().enumerate() {
            let theirs = &theirs["classes"][class];
            let ours = [counts.matched, counts.missed, counts.invented];
            assert_eq!(ours, [0, 2, 1].map(|i| theirs[i].as_u64().unwrap()), "{name}, class {class}");
            assert!(same(counts.iou, &theirs[3]), "{name}, class {class}: {counts:?}, {theirs}");
        }
        if let Some(scores) = theirs["scores"].as_array().filter(|scores| !scores.is_empty()) {
            // The script gives 0 to the classes that it leaves out of means.
            let there = classes.iter().zip(scores).filter(|(counts, _)| !counts.is_absent());
            there.for_each(|(counts, theirs)| assert_same(counts.score(), theirs, name));
        }
        assert_same(mean(classes), &theirs["all"], name);
        assert_same(mean(&classes[..STUFF]), &theirs["things"], name);
        assert_same(mean(&classes[STUFF..]), &theirs["stuff"], name);
    }
}
