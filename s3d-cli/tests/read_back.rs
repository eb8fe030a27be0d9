//! Exports of the built-in scene and of the real scan are read back and compared with their own mesh, poses
//! and tables.

use crate::common;
use common::{copyroom, s3d, s3d_ok, text};
use glam::{DMat3, DVec3};
use s3d_geom::{Camera, Pose, rotation_from_euler};
use s3d_io::dataset::{Domain, Frame, ImageName, Layout, read_file_list, read_labels, read_pose};
use s3d_io::fs::Checksum;
use s3d_io::image::{read_gray16, read_rgb8, read_xyz};
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_label::{Class, LabelId, LabelTable};
use s3d_render::{Scene, cast_ray};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Compares all images of an area with the exported mesh. Returns the number of images.
fn check_images(layout: &Layout, area: u32) -> usize {
    let table = LabelTable::from_names(&read_labels(&layout.labels_json()).unwrap()).unwrap();
    let colored = read_mesh(&layout.mesh_dir(area).join("rgb.obj"), UpAxis::Y).unwrap();
    let semantic = read_mesh(&layout.mesh_dir(area).join("semantic.obj"), UpAxis::Y)
        .unwrap()
        .mesh;
    assert!(colored.warnings.is_empty(), "{:?}", colored.warnings);
    let mesh = colored.mesh;
    assert_eq!(mesh.faces().len(), semantic.faces().len());
    for face in 0..mesh.faces().len() as u32 {
        assert_eq!(mesh.triangle(face), semantic.triangle(face), "face {face} of rgb.obj and semantic.obj");
    }
    let label_of = |face: u32| -> u32 {
        let name = &semantic.materials()[semantic.material_of(face).unwrap() as usize].name;
        table
            .names()
            .iter()
            .position(|n| n == name)
            .unwrap_or_else(|| panic!("{name} is no label")) as u32
    };
    let labels: Vec<u32> = (0..mesh.faces().len() as u32).map(label_of).collect();
    let scene = Scene::new(&mesh);

    let mut images = 0;
    for kind in [Frame::Panorama, Frame::View(0)] {
        let poses = layout.image_dir(area, kind, Domain::Pose);
        let mut names: Vec<_> = fs::read_dir(&poses)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert!(!names.is_empty(), "{kind:?}: no image");
        for name in names {
            check_image(layout, area, &name, &scene, &labels);
            images += 1;
        }
    }
    images
}

fn check_image(layout: &Layout, area: u32, name: &str, scene: &Scene<'_>, labels: &[u32]) {
    let name = ImageName::parse(name).unwrap_or_else(|| panic!("{name} is no image's name"));
    let path = |domain| layout.image_path(area, &name.uuid, &name.room, name.frame, domain);
    let rgb = read_rgb8(&path(Domain::Rgb)).unwrap();
    let depth = read_gray16(&path(Domain::Depth)).unwrap();
    let normal = read_rgb8(&path(Domain::Normal)).unwrap();
    let index = read_rgb8(&path(Domain::Semantic)).unwrap();
    let pretty = read_rgb8(&path(Domain::SemanticPretty)).unwrap();
    let xyz = read_xyz(&path(Domain::GlobalXyz)).unwrap();
    let pose = read_pose(&path(Domain::Pose)).unwrap();
    assert_eq!(pose.camera_uuid, name.uuid);
    assert_eq!(pose.room, format!("{}_{area}", name.room));

    // The camera as a reader derives it from the pose file.
    let location = DVec3::from_array(pose.camera_location);
    let seen_from = Pose {
        location,
        world_from_camera: rotation_from_euler(DVec3::from_array(pose.final_camera_rotation)),
    };
    let camera = match name.frame {
        Frame::Panorama => Camera::equirectangular(seen_from, depth.width()),
        Frame::View(_) => {
            Camera::perspective(seen_from, pose.field_of_view_rads, depth.width(), depth.height())
        }
    };
    for (row, of_file) in seen_from.rt_matrix().iter().zip(pose.camera_rt_matrix) {
        for (a, b) in row.iter().zip(of_file) {
            assert!((a - b).abs() < 1e-6, "camera_rt_matrix");
        }
    }
    let size = (depth.width(), depth.height());
    assert!(
        [rgb.width(), normal.width(), index.width(), pretty.width(), xyz.width()]
            .iter()
            .all(|w| *w == size.0)
    );
    assert!(
        [rgb.height(), normal.height(), index.height(), pretty.height(), xyz.height()]
            .iter()
            .all(|h| *h == size.1)
    );

    let rays = camera.rays();
    let image_from_world: DMat3 = camera.normal_image_from_world();
    for y in 0..size.1 {
        for x in 0..size.0 {
            let direction = rays.at(x, y);
            let (d, i) = (depth.at(x, y), index.at(x, y));
            let place = format!("{name:?} pixel ({x}, {y})");
            let Some(hit) = cast_ray(scene, location, direction) else {
                assert_eq!(
                    (d, i, rgb.at(x, y), normal.at(x, y)),
                    (65535, [13; 3], [0; 3], [128; 3]),
                    "{place}"
                );
                assert_eq!((xyz.at(x, y), pretty.at(x, y)), ([0.0; 3], [0; 3]), "{place}");
                continue;
            };
            assert!((hit.t * 512.0 - f64::from(d)).abs() <= 0.51, "{place}: depth {d} for {}", hit.t);
            assert!(rgb.at(x, y) != [0; 3] && pretty.at(x, y) != [0; 3], "{place}: a seen pixel is black");
            let label = u32::from_be_bytes([0, i[0], i[1], i[2]]);
            assert_eq!(label, labels[hit.face as usize], "{place}: label");
            let point = location + direction * hit.t;
            for (axis, value) in xyz.at(x, y).into_iter().enumerate() {
                let bound = (point[axis].abs() * 2f64.powi(-11)).max(1e-4);
                assert!((f64::from(value) - point[axis]).abs() <= bound, "{place}: {value} for {point}");
            }
            let n = scene.mesh().normal(hit.face).as_dvec3();
            let n = image_from_world * if n.dot(direction) > 0.0 { -n } else { n };
            for (axis, value) in normal.at(x, y).into_iter().enumerate() {
                assert!((n[axis] * 127.5 + 127.5 - f64::from(value)).abs() <= 0.51, "{place}: normal");
            }
        }
    }
}

#[test]
fn the_demo_is_a_whole_and_correct_data_set() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("demo");
    s3d_ok(&[
        "demo",
        "-o",
        text(&out),
        "--size",
        "72",
        "--pano-width",
        "192",
        "--views",
        "6",
        "--points-per-m2",
        "200",
    ]);
    let layout = Layout::new(out.clone());
    assert!(check_images(&layout, 1) > 10);

    let table = LabelTable::from_names(&read_labels(&layout.labels_json()).unwrap()).unwrap();
    let classes: BTreeSet<Class> = (0..table.len() as u32)
        .filter_map(|i| table.class_of(LabelId(i)))
        .collect();
    assert_eq!(classes.len(), 13, "the demo has all classes");
    for file in ["splits.json", "statistics.json", "statistics.md", "manifest.json", "area_1/views.json"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    for file in [
        "pointcloud.ply",
        "instances.json",
        "instances.npz",
        "rooms.json",
        "votes.json",
        "instance_numbers.json",
    ] {
        assert!(out.join("area_1/3d").join(file).is_file(), "{file}");
    }
    assert!(
        fs::read_to_string(out.join("manifest.json"))
            .unwrap()
            .contains("\"status\": \"complete\"")
    );
    assert!(!out.join(".s3d-previous").exists());
    s3dis_tree_is_well_formed(&out.join("s3dis/Area_1"));

    let stats = s3d(&["stats", text(&out)]);
    assert!(stats.status.success());
    assert_eq!(
        String::from_utf8_lossy(&stats.stdout),
        fs::read_to_string(out.join("statistics.md")).unwrap()
    );

    let info = s3d(&["info", text(&out.join("scan/scene.toml"))]);
    let info = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(info.contains("hallway_1") && info.contains("nothing looks wrong"), "{info}");
}

/// The file of a room holds the points of its instances, six numbers a line.
fn s3dis_tree_is_well_formed(area: &Path) {
    let mut rooms = 0;
    for room in fs::read_dir(area)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_dir())
    {
        let name = room.file_name().unwrap().to_str().unwrap();
        let all = fs::read_to_string(room.join(format!("{name}.txt"))).unwrap();
        let mut lines = 0;
        for instance in fs::read_dir(room.join("Annotations")).unwrap() {
            let points = fs::read_to_string(instance.unwrap().path()).unwrap();
            assert!(
                points
                    .lines()
                    .all(|l| l.split(' ').count() == 6 && l.split(' ').all(|t| t.parse::<f64>().is_ok()))
            );
            lines += points.lines().count();
        }
        assert_eq!(all.lines().count(), lines, "{name}");
        rooms += 1;
    }
    let angles = fs::read_to_string(area.join("Area_1_alignmentAngle.txt")).unwrap();
    assert_eq!(angles.lines().count(), rooms + 2);
}

#[test]
fn a_real_scan_reads_back() {
    let Some(scene) = copyroom() else { return };
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("copyroom");
    let small = ["--size", "96", "--pano-width", "256", "--views", "8", "--points-per-m2", "100"];
    let mut args = vec!["export", text(&scene), "-o", text(&out)];
    args.extend(small);
    let log = s3d_ok(&args);
    assert!(log.contains("508160ba5d80a2e365609578a09bab8b") && log.contains("coverage"), "{log}");
    assert!(check_images(&Layout::new(out), 1) >= 3);
}

#[test]
fn one_view_of_a_mesh_needs_no_annotation() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    common::write_scan(&scan, 1);
    let mesh = scan.join("room.obj");
    let view = dir.path().join("view");
    let at = ["--at", "2,1.2,1.5", "--size", "65"];
    let mut args =
        vec!["render", text(&mesh), "-o", text(&view), "--yaw", "20", "--pitch", "-10", "--fov", "60"];
    args.extend(at);
    s3d_ok(&args);
    let depth = read_gray16(&view.join("depth.png")).unwrap();
    assert!((depth.width(), depth.height()) == (65, 65) && depth.pixels().iter().all(|d| *d < 3000));
    for file in ["rgb.png", "normals.png", "faces.png", "global_xyz.exr", "camera.json"] {
        assert!(view.join(file).is_file(), "{file}");
    }
    common::s3d_fails(&args, 2, &["--overwrite"]);

    let cloud = dir.path().join("cloud.ply");
    s3d_ok(&["sample", text(&mesh), "-o", text(&cloud), "--points", "1234"]);
    assert_eq!(s3d_io::cloud::read_ply_point_count(&cloud).unwrap(), 1234);
    common::s3d_fails(&["sample", text(&mesh), "-o", text(&cloud)], 2, &["--overwrite"]);
}

/// `files.csv` lists every file of the data set except itself and the manifest, with its true size and
/// checksum, and the manifest describes the list.
fn assert_list_is_true(out: &Path) {
    let layout = Layout::new(out);
    let listed = read_file_list(&layout.file_list()).unwrap();
    let mut there = common::files(out);
    there.remove(Path::new("manifest.json")).unwrap();
    let list = there.remove(Path::new("files.csv")).unwrap();
    for record in &listed {
        let content = there
            .remove(Path::new(&record.path))
            .unwrap_or_else(|| panic!("no {}", record.path));
        let found = (content.len() as u64, Checksum::of(&content));
        assert_eq!((record.bytes, record.xxh3_128), found, "{}", record.path);
    }
    assert!(there.is_empty(), "not listed: {:?}", there.keys());
    let manifest = fs::read_to_string(layout.manifest()).unwrap();
    let bytes: u64 = listed.iter().map(|record| record.bytes).sum();
    let files = format!(
        "\"files\": {{\n    \"list\": \"files.csv\",\n    \"count\": {},\n    \"bytes\": {bytes},\n    \
         \"xxh3_128\": \"{}\"\n  }}",
        listed.len(),
        Checksum::of(&list)
    );
    assert!(manifest.contains(&files), "{files} is not in {manifest}");
}

#[test]
fn the_list_of_files_is_true_and_stays_so() {
    let dir = tempfile::tempdir().unwrap();
    let scene = common::write_scan(&dir.path().join("scan"), 1);
    let out = dir.path().join("out");
    let small = ["--size", "32", "--pano-width", "64", "--views", "3", "--points-per-m2", "50"];
    s3d_ok(&[&["export", text(&scene), "-o", text(&out), "--profile", "mmdet3d"], &small[..]].concat());
    assert_list_is_true(&out);
    let before = fs::read(out.join("files.csv")).unwrap();
    s3d_ok(&["xyz", text(&out), "--type", "float", "--overwrite"]);
    assert_list_is_true(&out);
    assert!(fs::read(out.join("files.csv")).unwrap() != before);
    s3d_ok(&["profile", text(&out), "--to", "pointnet", "--to", "open3d-ml"]);
    assert_list_is_true(&out);
    // A profile that is made again: its old files leave the list.
    fs::write(out.join("profiles/pointnet/mine.txt"), "").unwrap();
    s3d_ok(&["profile", text(&out), "--to", "pointnet", "--overwrite"]);
    assert_list_is_true(&out);
}

/// A command that changes a complete data set and fails on the way can be called again with the same
/// arguments.
#[test]
fn coordinates_and_profiles_that_failed_are_made_by_the_same_call() {
    let dir = tempfile::tempdir().unwrap();
    let scene = common::write_scan(&dir.path().join("scan"), 1);
    let out = dir.path().join("out");
    let small = ["--size", "32", "--pano-width", "64", "--views", "3", "--points-per-m2", "50"];
    let modalities = ["--modalities", "depth,pose", "--keep-all"];
    s3d_ok(&[&["export", text(&scene), "-o", text(&out)], &small[..], &modalities[..]].concat());
    let layout = Layout::new(&out);

    let poses = layout.image_dir(1, Frame::View(0), Domain::Pose);
    let last = common::files(&poses).into_keys().next_back().unwrap();
    let pose = fs::read(poses.join(&last)).unwrap();
    fs::write(poses.join(&last), "{").unwrap();
    common::s3d_fails(&["xyz", text(&out)], 1, &[text(&last)]);
    assert!(!out.join(".s3d").exists());
    fs::write(poses.join(&last), pose).unwrap();
    s3d_ok(&["xyz", text(&out)]);
    assert_list_is_true(&out);

    let rooms = layout.s3dis_area_dir(1);
    let points = common::files(&rooms);
    points
        .keys()
        .for_each(|name| fs::write(rooms.join(name), "no points").unwrap());
    common::s3d_fails(&["profile", text(&out), "--to", "pointnet"], 1, &["Area_1"]);
    points
        .iter()
        .for_each(|(name, content)| fs::write(rooms.join(name), content).unwrap());
    s3d_ok(&["profile", text(&out), "--to", "pointnet"]);
    assert_list_is_true(&out);

    // It is refused while another process changes the data set.
    fs::create_dir(out.join(".s3d")).unwrap();
    let lock = fs::File::create(out.join(".s3d/lock")).unwrap();
    lock.lock().unwrap();
    common::s3d_fails(&["xyz", text(&out), "--overwrite"], 75, &["another process"]);
    common::s3d_fails(&["profile", text(&out), "--to", "open3d-ml"], 75, &["another process"]);
    drop(lock);
    s3d_ok(&["profile", text(&out), "--to", "open3d-ml"]);
    assert_list_is_true(&out);
}
