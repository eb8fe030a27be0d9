//! How many strokes a simulated person needs. `cargo bench -p s3d-annotate --bench person` has more scenes.

mod oracle;
#[expect(dead_code, reason = "the bench has more scenes")]
mod scenes;
mod sitting;

use oracle::label;
use scenes::{Known, demo, office};
use sitting::Sitting;
use std::path::Path;

fn sitting(scene: &Known) -> Sitting {
    // Each stroke syncs the log: a folder in memory takes less time.
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() {
        tempfile::tempdir_in(memory)
    } else {
        tempfile::tempdir()
    }
    .unwrap();
    label(scene, &folder.path().join("scan.labels"), 0.99, 150)
}

#[test]
fn a_room_of_90_things_takes_60_strokes_to_95_percent_and_90_to_99() {
    let sitting = sitting(&office());
    assert!((85..100).contains(&sitting.things), "{}", sitting.things);
    let [to_95, to_99] = [0.95, 0.99].map(|share| sitting.strokes_to(share).unwrap());
    // No face of a model lies over a border.
    assert!(sitting.mixed <= 0.0);
    assert_eq!(sitting.strokes_to_either(0.99), Some(to_99));
    // It takes 30 and 43.
    assert!(to_95 <= 45 && to_99 <= 65, "{to_95} and {to_99}");
    assert!(sitting.purity_after >= 0.97, "{}", sitting.purity_after);
}

#[test]
fn the_built_in_scene_takes_a_stroke_for_two_things() {
    let sitting = sitting(&demo());
    let [to_95, to_99] = [0.95, 0.99].map(|share| sitting.strokes_to(share).unwrap());
    // It takes 46 and 63 for 140 things in four rooms.
    assert!(to_95 <= 65 && to_99 <= 90, "{to_95} and {to_99}");
    assert!(sitting.purity_after >= 0.97, "{}", sitting.purity_after);
}
