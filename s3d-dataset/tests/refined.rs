//! Refined labels are nearer to the truth than projected ones. `examples/refined_labels` measures the same on
//! whole buildings.

#[allow(dead_code, reason = "the example uses all of it")]
#[path = "../examples/refined_labels/scores.rs"]
mod scores;
#[allow(dead_code, reason = "the example uses all of it")]
#[path = "../examples/refined_labels/world.rs"]
mod world;

use s3d_geom::Pose;
use s3d_geom::glam::vec3;
use s3d_label::refine::refine;
use s3d_synth::Building;
use scores::{Scores, mean_iou};
use world::{ScanPlan, Shot, World, scanned};

fn scores(shots: &[Shot], world: &World<'_>, labels_of: impl Fn(&Shot) -> Vec<u32>) -> Scores {
    let mut scores = Scores::default();
    for shot in shots {
        let class_of = |label: u32| world.class_of(label);
        scores.add(shot.width as usize, &labels_of(shot), &shot.truth, &shot.colors, &class_of);
    }
    scores
}

#[test]
fn refined_labels_are_nearer_to_the_truth() {
    let mut scene = Building { texture_scale: 0.3, ..Building::demo() }.build().unwrap();
    scene.locations.truncate(1);
    let plan = ScanPlan { cell_m: 0.02, max_error_m: 0.008, pixels: 0.08, points_per_m2: 500.0 };
    let scan = scanned(&scene, &plan).unwrap();
    let world = World::new(&scene, &scan);
    let poses = [0.6, 1.1, 1.6, 2.1, 2.6, 3.1, 3.6, 4.1, 4.6, 5.1, 5.6, 6.1]
        .map(|yaw| Pose::level(scene.locations[0].position, yaw).turned(0.0, -0.2));

    let photographs: Vec<Shot> = poses.map(|pose| world.photograph(pose, 1.1, 240, 0.001)).into();
    let views: Vec<Shot> = poses
        .map(|pose| world.textured(pose, 1.1, 240, vec3(0.004, -0.003, 0.002)))
        .into();
    for (kind, shots) in [("photographs", photographs), ("views", views)] {
        let before = scores(&shots, &world, |shot| shot.labels.clone());
        let after = scores(&shots, &world, |shot| refine(&shot.input()).labels);
        let told = format!("{kind}: {before:?} → {after:?}");
        assert!(before.near.wrong > 1000, "{told}");
        // The scan is coarse, so that the test is fast: most wrong pixels are not at an edge of the picture.
        assert!(after.near.wrong * 12 < before.near.wrong * 11, "{told}");
        assert!(after.thin.percent() <= before.thin.percent() + 0.5, "{told}");
        assert!(mean_iou(&after.trimap) > mean_iou(&before.trimap), "{told}");
        assert!(after.f_scores()[0] > before.f_scores()[0] + 0.02, "{told}");
    }
}
