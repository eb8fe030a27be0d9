//! Scores of meshes whose distances are known.

use super::*;
use crate::building::ScanLocation;
use crate::device::LaserScanner;
use crate::{AnnotatedScene, Instance};
use s3d_geom::glam::{DVec3, Vec3, vec3};
use s3d_geom::{MeshParts, primitives};
use s3d_label::{Class, Room, RoomType};
use std::f64::consts::FRAC_PI_2;

/// A room of 4 m × 3 m × 2.5 m, seen from inside, with a scanner in it.
fn room() -> AnnotatedScene {
    let mut parts = primitives::cuboid(Vec3::ZERO, vec3(4.0, 3.0, 2.5));
    parts.flip();
    let mesh = TriMesh::new(parts).unwrap();
    let room = Room { room_type: RoomType::OFFICE, number: 1 };
    AnnotatedScene {
        instance_of_face: vec![0; mesh.faces().len()],
        instances: vec![Instance { class: Class::WALL, number: 1, room }],
        mesh,
        locations: vec![ScanLocation {
            uuid: "0".repeat(32),
            position: DVec3::new(2.0, 1.5, 1.5),
            yaw_rad: 0.0,
        }],
        title: String::new(),
    }
}

fn scored(scene: &AnnotatedScene, mesh: MeshParts) -> MeshScores {
    let target = ScanTarget::new(scene);
    let scanner = LaserScanner { elevation_rad: [-FRAC_PI_2, FRAC_PI_2], ..LaserScanner::default() };
    let views = [View::of_laser(&scene.locations[0], &scanner)];
    let truth = Truth::new(&target, &views, &TruthOptions::default()).unwrap();
    truth.score(&TriMesh::new(mesh).unwrap())
}

/// The room, larger by `by` on all sides: its walls are behind the real ones.
fn swollen(by: f32) -> MeshParts {
    let by = Vec3::splat(by);
    let mut parts = primitives::cuboid(-by, vec3(4.0, 3.0, 2.5) + by);
    parts.flip();
    parts
}

#[test]
fn a_scene_agrees_with_itself() {
    let scores = scored(&room(), swollen(0.0));
    assert!(scores.at.iter().all(|at| at.f_score == 1.0));
    assert!(scores.accuracy.rms_m < 1e-6 && scores.completeness.p95_m < 1e-6);
    assert!((scores.normals.consistency - 1.0).abs() < 1e-6 && scores.normals.flipped == 0.0);
    assert_eq!((scores.closed_sight, scores.seen_share), (0.0, 1.0));
}

#[test]
fn walls_that_are_off_are_told_by_their_distance() {
    let scores = scored(&room(), swollen(0.015));
    // 15 mm are between 1 and 2 cm. A corner is farther from the walls, so the mean is a little above.
    assert_eq!((scores.at[0].precision, scores.at[0].recall), (0.0, 0.0));
    assert!(scores.at[1].recall == 1.0 && scores.at[1].precision > 0.98);
    assert!(
        (scores.accuracy.median_m - 0.015).abs() < 1e-5 && (scores.completeness.mean_m - 0.015).abs() < 1e-5
    );
    assert_eq!(scores.closed_sight, 0.0);

    // Walls that come in by 6 cm hide the real ones, to which lines of sight must be free up to 5 cm.
    let scores = scored(&room(), swollen(-0.06));
    assert!(scores.closed_sight > 0.99 && scores.at[1].f_score == 0.0);
    // Walls that come in by 4 cm hide only what is next to a corner.
    let scores = scored(&room(), swollen(-0.04));
    assert!(scores.closed_sight < 0.05, "{}", scores.closed_sight);
}

#[test]
fn a_missing_wall_costs_recall_and_a_false_one_precision() {
    // Without the wall at x = 4: 7.5 m² of 59 m².
    let scene = room();
    let mut parts = swollen(0.0);
    let wall = |face: &[u32; 3]| face.iter().all(|v| parts.positions[*v as usize].x == 4.0);
    let kept: Vec<[u32; 3]> = parts.faces.iter().filter(|f| !wall(f)).copied().collect();
    assert_eq!(kept.len(), parts.faces.len() - 2);
    parts = MeshParts { faces: kept, positions: parts.positions, ..MeshParts::default() };
    let scores = scored(&scene, parts);
    assert_eq!((scores.at[0].precision, scores.closed_sight), (1.0, 0.0));
    // Samples next to the other walls are still near.
    assert!((scores.at[0].recall - (1.0 - 7.5 / 59.0)).abs() < 0.005, "{:?}", scores.at[0]);

    // A board of 1 m × 1 m across the room, 1 m from the scanner: it hides as much of the far wall.
    let board = primitives::quad([
        vec3(3.0, 2.0, 1.0),
        vec3(3.0, 1.0, 1.0),
        vec3(3.0, 1.0, 2.0),
        vec3(3.0, 2.0, 2.0),
    ]);
    let whole = MeshParts { uvs: Vec::new(), face_uvs: Vec::new(), ..swollen(0.0) };
    let board = MeshParts { uvs: Vec::new(), face_uvs: Vec::new(), ..board };
    let scores = scored(&scene, MeshParts::merge([whole, board]));
    assert!(scores.at[0].recall == 1.0 && (scores.at[0].precision - 59.0 / 60.0).abs() < 0.002);
    // The shadow is 2 m × 2 m.
    assert!((scores.closed_sight - 4.0 / 59.0).abs() < 0.005, "{}", scores.closed_sight);
}

#[test]
fn wrong_sides_are_told_as_flipped() {
    let mut parts = swollen(0.0);
    parts.flip();
    let scores = scored(&room(), parts);
    assert!(scores.normals.flipped == 1.0 && scores.normals.consistency > 0.999);
    assert_eq!(scores.at[0].f_score, 1.0);
}

#[test]
fn what_no_device_saw_does_not_count() {
    // A cupboard in the room: its back towards the wall, its underside on the floor.
    let mut scene = room();
    let cupboard = primitives::cuboid(vec3(3.5, 1.0, 0.0), vec3(3.99, 2.0, 2.0));
    let mut parts = scene.mesh.parts().clone();
    parts.append(cupboard);
    scene.mesh = TriMesh::new(parts.clone()).unwrap();
    scene.instance_of_face = vec![0; scene.mesh.faces().len()];

    let scores = scored(&scene, parts.clone());
    assert!(scores.at[0].f_score == 1.0 && scores.seen_share < 0.97);

    // Without the back and the underside.
    let hidden = |face: &[u32; 3]| {
        let corners = face.map(|v| parts.positions[v as usize]);
        corners.iter().all(|p| p.x == 3.99)
            || corners
                .iter()
                .all(|p| p.z == 0.0 && (3.5..=3.99).contains(&p.x) && (1.0..=2.0).contains(&p.y))
    };
    let kept: Vec<[u32; 3]> = parts.faces.iter().filter(|f| !hidden(f)).copied().collect();
    assert_eq!(kept.len(), parts.faces.len() - 4);
    let without = MeshParts { faces: kept, positions: parts.positions.clone(), ..MeshParts::default() };
    assert_eq!(scored(&scene, without).at[0].recall, 1.0);
}

#[test]
fn options_out_of_range_are_refused() {
    let scene = room();
    let target = ScanTarget::new(&scene);
    let refused = |options: TruthOptions| Truth::new(&target, &[], &options).unwrap_err().to_string();
    let default = TruthOptions::default;
    assert!(
        refused(TruthOptions { samples_per_m2: 0.0, ..default() }).starts_with("samples a square metre is 0")
    );
    assert!(refused(TruthOptions { margin_m: 2.0, ..default() }).contains("lines of sight is 2"));
    assert!(refused(TruthOptions { distances_m: vec![0.01, f32::NAN], ..default() }).contains("NaN"));
}
