//! Reads a folder in the published layout, which our own writers made, as input.

use s3d_geom::glam::{DAffine3, DQuat, DVec3, Vec3, dvec3, vec3};
use s3d_geom::{Camera, NO_INDEX, PointCloud, Pose, TriMesh};
use s3d_io::dataset::{Domain, Frame, Layout, PoseFile};
use s3d_io::scene::{PublishedArea, PublishedOptions};
use std::fs;
use std::path::Path;

const A: &str = "8eb9955b866b4b5f74abb1071416c628";
const B: &str = "508160ba5d80a2e365609578a09bab8b";

/// A quad of wall, one of floor, and a face without a label.
fn mesh() -> TriMesh {
    let positions =
        vec![Vec3::ZERO, Vec3::X, vec3(1.0, 1.0, 0.0), Vec3::Y, vec3(0.0, 0.0, 2.0), vec3(1.0, 0.0, 2.5)];
    TriMesh::from_faces(positions, vec![[0, 1, 2], [0, 2, 3], [0, 1, 4], [1, 4, 5], [2, 3, 5]]).unwrap()
}

const NAMES: [&str; 3] = ["<UNK>_0_<UNK>_0_0", "floor_7_office_5_3", "wall_2_office_5_3"];

fn original(n: f64) -> Pose {
    Pose::from_scanner(dvec3(n, 2.0, 1.5), DQuat::from_rotation_z(n) * DQuat::from_rotation_x(0.01))
}

fn pose(layout: &Layout, uuid: &str, n: f64, frame: Frame, room: &str) {
    let original = original(n);
    let camera = match frame {
        Frame::Panorama => Camera::equirectangular(original, 64),
        Frame::View(i) => Camera::perspective(original.turned(0.3 * f64::from(i), 0.1), 1.0, 64, 64),
    };
    let name = room.rsplit_once('_').unwrap().0;
    let path = layout.image_path(3, uuid, name, frame, Domain::Pose);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    PoseFile::new(&camera, &original, uuid, room, frame)
        .write(&path)
        .unwrap();
}

fn area(dir: &Path) {
    let layout = Layout::new(dir);
    fs::create_dir_all(layout.mesh_dir(3)).unwrap();
    s3d_io::mesh::write_rgb_obj(&layout.mesh_dir(3), &mesh(), &[]).unwrap();
    let names = NAMES.map(str::to_owned);
    s3d_io::mesh::write_semantic_obj(&layout.mesh_dir(3), &mesh(), &[1, 1, 2, 2, 0], &names).unwrap();
    for i in 0..3 {
        pose(&layout, A, 1.0, Frame::View(i), "office_5_3");
    }
    pose(&layout, A, 1.0, Frame::Panorama, "office_5_3");
    pose(&layout, B, 4.0, Frame::Panorama, "hallway_1_3");
    fs::create_dir_all(layout.assets_dir()).unwrap();
    fs::write(layout.labels_json(), "[]").unwrap();
}

#[test]
fn everything_is_found_and_comes_back() {
    let dir = tempfile::tempdir().unwrap();
    area(dir.path());
    let found = PublishedArea::open(&dir.path().join("area_3")).unwrap();
    assert_eq!((found.area, found.point_cloud.is_some(), found.warnings.len()), (3, false, 0));
    assert!(found.labels.is_some());
    let uuids: Vec<&str> = found.locations.iter().map(|l| l.location.uuid.as_str()).collect();
    assert_eq!(uuids, [B, A]);
    for (location, (n, room)) in found.locations.iter().zip([(4.0, "hallway_1"), (1.0, "office_5")]) {
        assert_eq!(location.room.unwrap().to_string(), room);
        assert_eq!(location.location.pose.location, original(n).location);
        let is = location.location.pose.world_from_camera;
        let should = original(n).world_from_camera;
        assert!(is.abs_diff_eq(should, 1e-12), "{is} {should}");
    }

    let read = found.read_mesh().unwrap();
    assert_eq!(read.file.mesh.positions(), mesh().positions());
    assert_eq!(read.file.mesh.faces(), mesh().faces());
    let labels: Vec<String> = read.labels.iter().map(|l| l.to_string()).collect();
    assert_eq!(labels, NAMES[1..]);
    assert_eq!(read.label_of_face, [0, 0, 1, 1, NO_INDEX]);

    let annotations = found.annotations(&read).unwrap();
    let mut cloud = PointCloud::default();
    annotations.rooms[0].instances[1].read(&mut cloud).unwrap();
    assert!(cloud.faces.iter().all(|f| [2, 3].contains(f)));
}

#[test]
fn an_area_can_be_moved() {
    let dir = tempfile::tempdir().unwrap();
    area(dir.path());
    fs::rename(dir.path().join("area_3"), dir.path().join("area_5b")).unwrap();
    let world_from_area =
        DAffine3::from_rotation_translation(DQuat::from_rotation_z(1.0), dvec3(100.0, -20.0, 0.5));
    let options = PublishedOptions { area: None, world_from_area };
    let found = PublishedArea::open_with(&dir.path().join("area_5b"), &options).unwrap();
    assert_eq!(found.area, 5);

    let moved = &found.locations[0].location.pose;
    assert!(
        moved
            .location
            .abs_diff_eq(world_from_area.transform_point3(original(4.0).location), 1e-12)
    );
    let turned = DQuat::from_rotation_z(1.0) * original(4.0).forward();
    assert!(moved.forward().abs_diff_eq(turned, 1e-12));

    let read = found.read_mesh().unwrap();
    for (is, was) in read.file.mesh.positions().iter().zip(mesh().positions()) {
        assert!(
            is.as_dvec3()
                .abs_diff_eq(world_from_area.transform_point3(was.as_dvec3()), 1e-5)
        );
    }
    assert_eq!(read.label_of_face, [0, 0, 1, 1, NO_INDEX]);
    assert!(found.locations.iter().all(|l| l.location.pose.location != DVec3::ZERO));
}

#[test]
fn faces_in_another_order_are_matched() {
    let dir = tempfile::tempdir().unwrap();
    area(dir.path());
    let folder = dir.path().join("area_3");
    let path = folder.join("3d/semantic.obj");
    let text = fs::read_to_string(&path).unwrap();
    // The faces of the floor stand first, and are moved to the end.
    let (head, rest) = text.split_once("usemtl floor_7_office_5_3\n").unwrap();
    let (floor, rest) = rest.split_once("usemtl").unwrap();
    fs::write(&path, format!("{head}usemtl{rest}usemtl floor_7_office_5_3\n{floor}")).unwrap();
    let read = PublishedArea::open(&folder).unwrap().read_mesh().unwrap();
    assert_eq!(read.label_of_face, [0, 0, 1, 1, NO_INDEX]);
    assert_eq!(read.labels[0].to_string(), NAMES[1]);
    assert!(
        read.file
            .warnings
            .last()
            .unwrap()
            .contains("matched by their corners, 0 without")
    );
}

#[test]
fn what_is_missing_is_named() {
    let dir = tempfile::tempdir().unwrap();
    area(dir.path());
    let folder = dir.path().join("area_3");
    // An area without labels is still an area.
    fs::remove_file(folder.join("3d/semantic.obj")).unwrap();
    let found = PublishedArea::open(&folder).unwrap();
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.contains("has no 3d/semantic.obj, so that there are no labels"))
    );
    let mesh = found.read_mesh().unwrap();
    assert!(mesh.labels.is_empty() && mesh.label_of_face.is_empty() && mesh.file.mesh.faces().len() == 5);

    fs::remove_file(folder.join("3d/rgb.obj")).unwrap();
    let message = PublishedArea::open(&folder).unwrap_err().to_string();
    assert!(message.contains("has no 3d/rgb.obj, the textured mesh"), "{message}");

    let dir = tempfile::tempdir().unwrap();
    area(dir.path());
    let folder = dir.path().join("area_3");
    let pose = folder
        .join("pano/pose")
        .join(format!("camera_{B}_hallway_1_frame_equirectangular_domain_pose.json"));
    fs::write(&pose, "{\"camera_uuid\": 1}").unwrap();
    let message = PublishedArea::open(&folder).unwrap_err().to_string();
    assert!(message.contains("_hallway_1_") && message.contains("line 1"), "{message}");

    fs::remove_dir_all(folder.join("pano")).unwrap();
    assert_eq!(PublishedArea::open(&folder).unwrap().locations.len(), 1);
    fs::remove_dir_all(folder.join("data")).unwrap();
    let message = PublishedArea::open(&folder).unwrap_err().to_string();
    assert!(message.contains("without poses there are no scan locations"), "{message}");

    fs::rename(&folder, dir.path().join("third")).unwrap();
    let message = PublishedArea::open(&dir.path().join("third")).unwrap_err().to_string();
    assert!(message.contains("as in area_3 or area_5a"), "{message}");
    assert!(PublishedArea::open(&dir.path().join("gone")).is_err());
}

#[test]
fn labels_of_another_mesh_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    area(dir.path());
    let folder = dir.path().join("area_3");
    let other = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Z], vec![[0, 1, 2]]).unwrap();
    s3d_io::mesh::write_semantic_obj(&folder.join("3d"), &other, &[1], &NAMES.map(str::to_owned)).unwrap();
    let message = PublishedArea::open(&folder)
        .unwrap()
        .read_mesh()
        .unwrap_err()
        .to_string();
    assert!(message.contains("5 of the 5 faces") && message.contains("semantic.obj"), "{message}");

    s3d_io::mesh::write_semantic_obj(&folder.join("3d"), &mesh(), &[0; 5], &NAMES.map(str::to_owned))
        .unwrap();
    let message = PublishedArea::open(&folder)
        .unwrap()
        .read_mesh()
        .unwrap_err()
        .to_string();
    assert!(message.contains("no material of a face is a label"), "{message}");
}
