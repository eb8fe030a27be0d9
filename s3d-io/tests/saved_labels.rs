//! Folders of labels: what comes back, and what is told.

use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;
use s3d_io::Result;
use s3d_io::cloud::{
    AnnotatedMesh, AnnotationOptions, Annotations, EVENTS_FILE, LABELS_FILE, SavedLabels, mesh_checksum,
};
use s3d_io::mesh::{MeshFile, UpAxis};
use std::fs;
use std::path::Path;

fn mesh(last: Vec3) -> TriMesh {
    TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y, last], vec![[0, 1, 2], [1, 3, 2]]).unwrap()
}

fn labels() -> SavedLabels {
    SavedLabels {
        mesh: mesh_checksum(&mesh(Vec3::ONE)),
        revision: 3,
        class: vec![0, 1],
        instance: vec![7, 2],
        room: vec![-1, 4],
        classes: vec!["chair".into(), "wall".into()],
        instances: vec![(2, "wall_1".into()), (7, "chair_1".into())],
        rooms: vec![(4, "office_3".into()), (5, String::new())],
    }
}

/// Opens a folder as the annotations of a mesh. Faces without a room belong to `lobby_1`.
fn open(folder: &Path, mesh: TriMesh) -> Result<Annotations> {
    let file = MeshFile::in_memory("scan.ply", mesh);
    let mesh = AnnotatedMesh { file: &file, up: UpAxis::Z, units: None, outside_files: false };
    let options = AnnotationOptions { room: "lobby_1".parse().ok(), ..AnnotationOptions::default() };
    Annotations::open_for(&mesh, &[folder.to_owned()], &options)
}

#[test]
fn labels_come_back_and_damage_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let bytes = labels().write(dir.path()).unwrap();
    assert_eq!(SavedLabels::read(dir.path()).unwrap(), labels());
    let path = dir.path().join(LABELS_FILE);
    let whole = fs::read(&path).unwrap();
    assert_eq!(whole.len() as u64, bytes);

    for cut in [0, 10, whole.len() / 2, whole.len() - 1] {
        fs::write(&path, &whole[..cut]).unwrap();
        assert!(
            SavedLabels::read(dir.path())
                .unwrap_err()
                .to_string()
                .contains("labels.npz")
        );
    }
    for (wrong, words) in [
        (SavedLabels { class: vec![0, 2], ..labels() }, "no class 2"),
        (SavedLabels { instance: vec![7, 3], ..labels() }, "no instance 3"),
        (SavedLabels { room: vec![-2, 4], ..labels() }, "no room -2"),
    ] {
        wrong.write(dir.path()).unwrap();
        let message = SavedLabels::read(dir.path()).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn a_folder_of_labels_annotates_its_mesh_and_no_other() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join(EVENTS_FILE), "{\"v\":1}\n{\"n\":9}\n{\"n\":5}\ntorn").unwrap();
    let message = open(dir.path(), mesh(Vec3::ONE)).unwrap_err().to_string();
    assert!(message.contains("never written"), "{message}");

    labels().write(dir.path()).unwrap();
    let found = open(dir.path(), mesh(Vec3::ONE)).unwrap();
    let names = found.rooms.iter().flat_map(|room| {
        room.instances
            .iter()
            .map(move |i| format!("{}_{} of {}", i.class, i.number, room.room))
    });
    assert_eq!(names.collect::<Vec<_>>(), ["chair_1 of lobby_1", "wall_1 of office_3"]);
    assert!(found.warnings.iter().any(|told| told.contains("up to event 3 of 5")), "{:?}", found.warnings);

    let message = open(dir.path(), mesh(Vec3::Z)).unwrap_err().to_string();
    assert!(message.contains("another mesh"), "{message}");
    let message = Annotations::open(&[dir.path().to_owned()], &AnnotationOptions::default())
        .unwrap_err()
        .to_string();
    assert!(message.contains("open it for the mesh"), "{message}");
}

#[test]
fn labels_in_no_room_with_a_type_are_left_out_and_told() {
    let dir = tempfile::tempdir().unwrap();
    let file = MeshFile::in_memory("scan.ply", mesh(Vec3::ONE));
    let open = || {
        let mesh = AnnotatedMesh { file: &file, up: UpAxis::Z, units: None, outside_files: false };
        Annotations::open_for(&mesh, &[dir.path().to_owned()], &AnnotationOptions::default())
    };

    // The chair is in no room, and the wall in an office.
    labels().write(dir.path()).unwrap();
    let found = open().unwrap();
    assert_eq!(found.rooms.iter().map(|room| room.instances.len()).collect::<Vec<_>>(), [1]);
    assert!(found.warnings[0].contains("0.5 m² with labels are in no room"), "{:?}", found.warnings);

    // Nothing is left.
    SavedLabels { room: vec![-1, 5], ..labels() }.write(dir.path()).unwrap();
    let error = open().unwrap_err().to_string();
    assert!(error.contains("no label is in a room that has a type"), "{error}");
}
