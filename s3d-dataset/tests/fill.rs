//! Faces that nobody voted for take the label of the surface next to them, if that is asked for.

mod common;

use common::{memory_scene, options};
use s3d_dataset::export::MemoryScene;
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::{Context, Error, Export, ExportOptions, verify};
use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;
use s3d_label::{LabelId, fill_labels};
use s3d_synth::Building;
use serde_json::Value;
use std::path::Path;

/// Each face in four, `times` times; with it, the face that each was part of.
fn subdivided(mesh: &TriMesh, times: u32) -> (TriMesh, Vec<usize>) {
    let mut faces: Vec<(usize, [Vec3; 3])> = (0..mesh.faces().len())
        .map(|face| (face, mesh.triangle(face as u32)))
        .collect();
    for _ in 0..times {
        let four = |(face, [a, b, c]): (usize, [Vec3; 3])| {
            let [d, e, f] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]].map(|part| (face, part))
        };
        faces = faces.into_iter().flat_map(four).collect();
    }
    let positions: Vec<Vec3> = faces.iter().flat_map(|(_, corners)| *corners).collect();
    let corners = (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = TriMesh::from_faces(positions, corners).unwrap();
    assert_eq!(mesh.faces().len(), faces.len());
    (mesh, faces.into_iter().map(|(face, _)| face).collect())
}

/// Labels of a building that are hidden around hundreds of places come back, and hardly any of them wrong.
#[test]
fn labels_that_are_hidden_are_found_again() {
    let building = Building::two_storeys().build().unwrap();
    let (mesh, parents) = subdivided(&building.mesh, 2);
    let truth: Vec<LabelId> = parents
        .iter()
        .map(|face| LabelId(building.instance_of_face[*face] + 1))
        .collect();
    let middle = |face: usize| mesh.triangle(face as u32).iter().sum::<Vec3>() / 3.0;
    let middles: Vec<Vec3> = (0..truth.len()).map(middle).collect();
    let places: Vec<Vec3> = middles.iter().step_by(211).copied().collect();
    let is_hidden = |at: &Vec3| places.iter().any(|place| place.distance(*at) < 0.08);
    let mut labels: Vec<LabelId> = middles
        .iter()
        .zip(&truth)
        .map(|(at, label)| if is_hidden(at) { LabelId::NULL } else { *label })
        .collect();
    let hidden = labels.iter().filter(|label| label.is_null()).count();
    let filled = fill_labels(&mesh, &mut labels, 0.1);
    let right = filled
        .iter()
        .filter(|f| labels[**f as usize] == truth[**f as usize])
        .count();
    let (back, precision) = (filled.len() as f64 / hidden as f64, right as f64 / filled.len() as f64);
    assert!(hidden > 5000 && back > 0.7 && precision > 0.99, "{hidden} {back} {precision}");
}

/// A room whose faces are smaller than the distance between its annotated points: many get no vote.
fn scene_of_small_faces() -> MemoryScene {
    let mut scene = memory_scene();
    let (mesh, _) = subdivided(&scene.mesh, 5);
    let mut parts = mesh.into_parts();
    parts.colors = parts
        .positions
        .iter()
        .map(|p| [(p.x * 60.0) as u8, 200, (p.z * 90.0) as u8])
        .collect();
    scene.mesh = TriMesh::new(parts).unwrap();
    scene
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn an_export_tells_what_it_filled() {
    let dir = tempfile::tempdir().unwrap();
    let export = |name: &str, fill: Option<f64>| {
        let out = dir.path().join(name);
        let options = ExportOptions { fill, ..options(3) };
        let export = Export::new([scene_of_small_faces()]).options(options);
        let summary = export.run(&out, &Context::default()).unwrap().unwrap();
        let report = verify(&out, &VerifyOptions::default(), &Context::default()).unwrap();
        assert_eq!(report.fault_count(), 0, "{report:?}");
        (out, summary)
    };
    let (as_voted, before) = export("as_voted", None);
    let (out, after) = export("filled", Some(0.2));
    let (unfilled, filled) = (before.unlabelled.unwrap(), after.unlabelled.unwrap());
    assert_eq!(
        (unfilled.without_votes, unfilled.without_votes),
        (unfilled.without_label, filled.without_votes)
    );
    assert!(unfilled.without_label.faces > 1000 && unfilled.without_label.m2 > 1.0);
    assert!(unfilled.without_label.pixels.unwrap() > 1000);
    // Some in the corners of walls are farther from the next point.
    assert!(filled.without_label.faces < 10 && filled.without_label.pixels.unwrap() < 50, "{filled:?}");
    // What was voted for stays, and the tables tell both.
    assert_eq!(json(&as_voted.join("manifest.json"))["options"].get("fill"), None);
    let manifest = json(&out.join("manifest.json"));
    assert_eq!(manifest["options"]["fill"], 0.2);
    let told = &manifest["areas"][0]["unlabelled"];
    assert_eq!(told["without_votes"]["faces"], unfilled.without_label.faces);
    assert_eq!(told["without_votes"]["pixels"], unfilled.without_label.pixels.unwrap());
    assert_eq!(told["without_label"]["pixels"], filled.without_label.pixels.unwrap());
    let votes = json(&out.join("area_2/3d/votes.json"));
    assert_eq!(votes["faces_without_votes"], unfilled.without_label.faces);
    assert_eq!(votes["faces_without_label"], filled.without_label.faces);
    assert_eq!(votes["m2_without_label"], filled.without_label.m2);
    let columns = |out: &Path| s3d_io::dataset::read_face_votes(&out.join("area_2/3d/votes.npz")).unwrap();
    let (a, b) = (columns(&as_voted), columns(&out));
    assert_eq!((&a.votes, &a.total, &a.farthest_m), (&b.votes, &b.total, &b.farthest_m));
    let changed: Vec<usize> = (0..a.label.len()).filter(|i| a.label[*i] != b.label[*i]).collect();
    assert!(changed.iter().all(|i| a.label[*i] == 0 && a.total[*i] == 0) && changed.len() > 1000);
    // A label that filling does not give is found.
    std::fs::copy(as_voted.join("area_2/3d/votes.npz"), out.join("area_2/3d/votes.npz")).unwrap();
    let report = verify(&out, &VerifyOptions::default(), &Context::default()).unwrap();
    assert!(format!("{report:?}").contains("other labels won"), "{report:?}");
}

/// Whoever takes labels from a plan knows which of them were filled.
#[test]
fn a_plan_keeps_what_was_filled() {
    let dir = tempfile::tempdir().unwrap();
    let options = ExportOptions { fill: Some(0.1), ..options(3) };
    let (plan, context) = (dir.path().join("plan"), Context::default());
    s3d_dataset::plan(&[scene_of_small_faces()], &plan, &options, None, &context).unwrap();
    let export = Export::new([scene_of_small_faces()]).options(options);
    let manifest = |export: Export, name: &str| {
        let out = dir.path().join(name);
        export.run(&out, &context).unwrap().unwrap();
        json(&out.join("manifest.json"))
    };
    let direct = manifest(export.clone(), "direct");
    assert_eq!(direct, manifest(export.clone().plan(Some(plan.clone())), "planned"));
    // A plan without filling is of another call.
    let other = ExportOptions { fill: None, ..common::options(3) };
    let refused = export
        .options(other)
        .plan(Some(plan))
        .run(dir.path().join("other"), &context);
    assert!(refused.unwrap_err().to_string().contains("is a plan of another call"));
}

#[test]
fn filling_needs_labels_and_a_distance() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |scene: MemoryScene, fill: f64| {
        let options = ExportOptions { fill: Some(fill), ..options(3) };
        let export = Export::new([scene])
            .options(options)
            .run(dir.path().join("out"), &Context::default());
        let error = export.unwrap_err();
        assert!(matches!(error, Error::Usage(_)), "{error}");
        error.to_string()
    };
    let unlabelled = MemoryScene { annotations: None, ..memory_scene() };
    assert!(refused(unlabelled, 0.1).contains("`fill` needs labels"));
    assert!(refused(memory_scene(), 0.0).contains("`fill`: must be above 0"));
}
