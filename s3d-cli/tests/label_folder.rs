//! A scan that was labelled on one's own machine: its folder of labels is the annotation of the scene.

use crate::common;
use common::{s3d_fails, s3d_ok, text, write_scan};
use s3d_annotate::labelling::{Action, FaceRuns, LabelFolder, Room, RoomPart, carry_over};
use s3d_geom::TriMesh;
use s3d_io::mesh::{MeshLabels, UpAxis, read_mesh};
use s3d_label::Taxonomy;
use std::fs;
use std::path::Path;

const SMALL: [&str; 8] = ["--size", "48", "--pano-width", "96", "--views", "4", "--points-per-m2", "200"];

/// The sides of the room and the table, two faces each.
const OBJECTS: [&str; 7] = ["floor", "ceiling", "wall", "wall", "wall", "wall", "table"];

fn mesh_of(scan: &Path) -> TriMesh {
    read_mesh(&scan.join("room.obj"), UpAxis::Y).unwrap().mesh
}

/// Labels the scan of [`write_scan`] without its annotation, and names the labels in its scene file.
fn label(scan: &Path) -> LabelFolder {
    let mesh = mesh_of(scan);
    let mut labels = LabelFolder::open(&scan.join("room.labels"), &mesh, &Taxonomy::s3dis()).unwrap();
    let mut add = |action| {
        let revision = labels.state().revision();
        labels.add(revision, action, None).unwrap();
    };
    for (instance, class) in (1..).zip(OBJECTS) {
        let faces = FaceRuns::of_range(2 * instance - 2..2 * instance);
        add(Action::Paint { faces, instance, class: Some(class.into()) });
    }
    let outline = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]];
    let parts = vec![RoomPart { outline, heights: [0.0, 2.5] }];
    add(Action::Room { room: 1, is: Room { kind: Some("office".into()), name: None, parts } });
    labels.write_labels(&mesh).unwrap();

    let scene = scan.join("scene.toml");
    let toml = fs::read_to_string(&scene).unwrap();
    let toml = toml.replace("path = \"Area_1\"", "path = \"room.labels\"");
    fs::write(&scene, toml).unwrap();
    labels
}

/// The names of the labels of each face of an exported area.
fn labels_of_faces(out: &Path) -> Vec<String> {
    let mesh = read_mesh(&out.join("area_1/3d/semantic.obj"), UpAxis::Y).unwrap().mesh;
    let Some((MeshLabels::Names { labels, faces }, _)) =
        MeshLabels::from_materials(&mesh, &Taxonomy::s3dis())
    else {
        panic!("no labels")
    };
    faces
        .iter()
        .map(|face| labels.get(*face as usize).map_or_else(String::new, ToString::to_string))
        .collect()
}

fn export(scan: &Path, out: &Path) -> String {
    let scene = scan.join("scene.toml");
    s3d_ok(&[&["export", text(&scene), "-o", text(out)], &SMALL[..]].concat())
}

#[test]
fn a_labelled_scan_is_exported_with_what_was_painted() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    write_scan(&scan, 1);
    let annotated = dir.path().join("annotated");
    export(&scan, &annotated);

    let labels = label(&scan);
    let out = dir.path().join("out");
    export(&scan, &out);
    let found = labels_of_faces(&out);
    let expected = ["floor_1", "ceiling_1", "wall_1", "wall_2", "wall_3", "wall_4", "table_1"];
    let expected: Vec<String> = expected
        .iter()
        .flat_map(|name| [format!("{name}_office_1_1"), format!("{name}_office_1_1")])
        .collect();
    assert_eq!(found, expected);
    // As from the annotated points of the same scan.
    assert_eq!(found, labels_of_faces(&annotated));
    let list = |out: &Path| fs::read_to_string(out.join("assets/semantic_labels.json")).unwrap();
    assert_eq!(list(&out), list(&annotated));
    s3d_ok(&["verify", text(&out), "--full"]);
    drop(labels);
}

#[test]
fn labels_that_are_old_or_of_another_mesh_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    let scene = write_scan(&scan, 1);
    let mut labels = label(&scan);
    let class = Action::Class { instance: 7, class: "board".into() };
    labels.add(8, class, None).unwrap();
    let log = export(&scan, &dir.path().join("out"));
    assert!(log.contains("has the labels up to event 8 of 9"), "{log}");
    assert!(labels_of_faces(&dir.path().join("out")).contains(&"table_1_office_1_1".to_owned()));

    // A table that was moved by 2 cm is another mesh.
    let old = mesh_of(&scan);
    let obj = fs::read_to_string(scan.join("room.obj")).unwrap();
    fs::write(scan.join("room.obj"), obj.replace(" 0.7 ", " 0.72 ")).unwrap();
    let out = dir.path().join("other");
    let args = [&["export", text(&scene), "-o", text(&out)], &SMALL[..]].concat();
    s3d_fails(&args, 1, &["room.labels/labels.npz", "another mesh", "carry the labels over"]);

    let new = mesh_of(&scan);
    let carried = carry_over(&old, labels.state(), &new);
    assert!((carried.report.carried_m2 - new.total_area()).abs() < 1e-6, "{:?}", carried.report);
    let path = scan.join("new.labels");
    let mut labels = LabelFolder::open(&path, &new, &Taxonomy::s3dis()).unwrap();
    for (revision, action) in (0..).zip(carried.actions) {
        labels.add(revision, action, None).unwrap();
    }
    labels.write_labels(&new).unwrap();
    let toml = fs::read_to_string(&scene).unwrap();
    fs::write(&scene, toml.replace("room.labels", "new.labels")).unwrap();
    export(&scan, &out);
    assert_eq!(labels_of_faces(&out)[12..], ["board_1_office_1_1", "board_1_office_1_1"]);
}
