//! Raw scans become meshes and data sets: the built-in scene, scanned by simulated devices.

use crate::common;
use common::{s3d_fails, s3d_ok, text};
use e57::{E57Reader, E57Writer, ImageFormat, Projection, Quaternion, Transform, Translation};
use s3d_geom::glam::{DAffine3, DQuat, DVec3, Vec3};
use s3d_io::camera::{E57Pictures, read_cameras};
use s3d_io::dataset::{Domain, Layout, dataset_images, read_face_votes, read_labels, read_pose};
use s3d_io::image::read_xyz;
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_label::Class;
use s3d_synth::building::ScanLocation;
use s3d_synth::device::{DepthCamera, LaserScanner, ScanTarget};
use s3d_synth::truth::{Truth, TruthOptions};
use s3d_synth::{AnnotatedScene, Building, ScanOptions};
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

/// A quarter of the pixels of a real turntable, on each side.
const SCALE: f64 = 0.25;

fn scene(building: Building) -> AnnotatedScene {
    Building { texture_scale: 0.1, ..building }.build().unwrap()
}

/// The share of pixels of a data set's images that lie within `within_m` of the scene that was scanned, along
/// their rays.
fn agreement(out: &Path, target: &ScanTarget<'_>, within_m: f64) -> f64 {
    let layout = Layout::new(out);
    let (mut near, mut all) = (0, 0);
    for image in dataset_images(&layout, 1).unwrap() {
        let path = |domain: Domain| image.path(&layout, domain);
        let origin = DVec3::from_array(read_pose(&path(Domain::Pose)).unwrap().camera_location);
        let points = read_xyz(&path(Domain::GlobalXyz)).unwrap();
        let rays = points
            .pixels()
            .iter()
            .map(|xyz| Vec3::from_array(*xyz).as_dvec3() - origin);
        for ray in rays.filter(|ray| ray.is_finite() && *ray != -origin) {
            let truth = target.range(origin.as_vec3(), ray.normalize().as_vec3());
            all += 1;
            near +=
                usize::from(truth.is_some_and(|range| (f64::from(range) - ray.length()).abs() <= within_m));
        }
    }
    assert!(all > 10_000, "{all} pixels");
    near as f64 / all as f64
}

/// What an export of a fused scan is made with.
const EXPORT: [&str; 11] = [
    "--views",
    "4",
    "--size",
    "96",
    "--pano-width",
    "256",
    "--points-per-m2",
    "40",
    "--xyz",
    "float",
    "--threads=2",
];

#[test]
fn raw_captures_become_a_data_set() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene(Building::demo());
    let target = ScanTarget::new(&scene);
    let camera = DepthCamera::turntable().scaled(SCALE);
    let raw = dir.path().join("raw");
    target
        .write_matterport(&raw, &scene.locations[..1], &camera, || true)
        .unwrap();
    let file = dir.path().join("scene.toml");
    let toml = "area = 1\n[mesh]\nfuse = \"raw\"\ncell_m = 0.03\n[cameras]\npath = \"raw\"\n\
                [rgb]\nsource = \"captures\"\npath = \"raw\"\n";
    fs::write(&file, toml).unwrap();

    let out = dir.path().join("out");
    let log = s3d_ok(&[&["export", text(&file), "-o", text(&out)], &EXPORT[..]].concat());
    assert!(
        log.contains("18 depth pictures") && log.contains("colours from captures of 1 location"),
        "{log}"
    );
    assert!(dir.path().join("scene.fused/mesh.ply").is_file());
    s3d_ok(&["verify", text(&out)]);
    // The far walls are measured with a noise of 2 cm.
    let share = agreement(&out, &target, 0.02);
    assert!(share > 0.95, "{share}");
}

/// A closet of 1.2 × 1 × 1.2 m, scanned from its middle, as PTX.
fn closet() -> String {
    let [columns, rows] = [180, 90];
    let mut text =
        format!("{columns}\n{rows}\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let (azimuth, polar) = (f64::from(i) * TAU / 180.0, (f64::from(j) + 0.5) * PI / 90.0);
        let ray = DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), -polar.cos());
        let point = ray * (DVec3::new(0.6, 0.5, 0.6) / ray.abs()).min_element();
        let _ = writeln!(text, "{:.4} {:.4} {:.4} 0.5", point.x, point.y, point.z);
    }
    text
}

#[test]
fn the_mesh_of_a_raw_scan_is_kept_and_made_again_when_the_scan_changes() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("closet.ptx");
    let info = || {
        let out = common::s3d(&["info", text(&file)]);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        [out.stdout, out.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
    };
    fs::write(&file, closet()).unwrap();
    let [told, log] = info();
    assert!(told.contains("scan locations: 1") && !log.contains("fused earlier"), "{told}\n{log}");
    let mesh = fs::read(dir.path().join("closet.fused/mesh.ply")).unwrap();
    let [again, log] = info();
    assert!(again == told && log.contains("fused earlier"), "{log}");

    fs::write(
        &file,
        closet().replace("0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0", "9 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0"),
    )
    .unwrap();
    let [_, log] = info();
    assert!(!log.contains("fused earlier"), "{log}");
    fs::write(&file, closet()).unwrap();
    info();
    assert_eq!(fs::read(dir.path().join("closet.fused/mesh.ply")).unwrap(), mesh);
}

#[test]
fn threads_and_tiles_do_not_change_a_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene(Building::two_storeys());
    let target = ScanTarget::new(&scene);
    // A scan on each storey.
    let highest = |a: &&_, b: &&_| height(a).total_cmp(&height(b));
    let upper = scene.locations.iter().max_by(highest).unwrap();
    let lower = scene.locations.iter().min_by(highest).unwrap();
    assert!(height(upper) > height(lower) + 2.0);
    let file = dir.path().join("scan.ptx");
    let scanner = LaserScanner { columns: 360, rows: 160, ..LaserScanner::default() };
    target
        .write_ptx(&file, &[lower.clone(), upper.clone()], &scanner, || true)
        .unwrap();

    let fuse = |name: &str, more: &[&str]| {
        let mesh = dir.path().join(name);
        let log = s3d_ok(&[&["fuse", text(&file), "-o", text(&mesh), "--cell", "0.08"], more].concat());
        (fs::read(mesh).unwrap(), log)
    };
    let (one, _) = fuse("one.ply", &["--threads", "1"]);
    let (three, _) = fuse("three.ply", &["--threads", "3"]);
    let (tiles, log) = fuse("tiles.ply", &["--memory", "0.002"]);
    assert!(log.contains("fused in tiles"), "{log}");
    assert!(one == three && one == tiles, "{} {} {} bytes", one.len(), three.len(), tiles.len());

    // A folder names the places of the scanner, so an export has a location on each storey.
    let folder = dir.path().join("fused");
    s3d_ok(&["fuse", text(&file), "-o", text(&folder), "--cell", "0.08", "--close", "0.3"]);
    let told = String::from_utf8(common::s3d(&["info", text(&folder.join("scene.toml"))]).stdout).unwrap();
    assert!(told.contains("scan locations: 2") && told.contains("2 storeys"), "{told}");
}

#[test]
fn a_killed_fuse_goes_on_with_its_tiles() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("closet.ptx");
    fs::write(&file, closet()).unwrap();
    let [whole, killed] = ["whole.ply", "killed.ply"].map(|name| dir.path().join(name).display().to_string());
    let call = |mesh| ["fuse", text(&file), "-o", mesh, "--memory", "0.001"];
    s3d_ok(&call(&whole));

    let working = || {
        let entries = fs::read_dir(&dir).unwrap().map(|entry| entry.unwrap().path());
        entries
            .filter(|path| path.file_name().unwrap().to_string_lossy().starts_with(".s3d"))
            .collect::<Vec<_>>()
    };
    let has_tile = || {
        let kept = working()
            .into_iter()
            .filter_map(|path| fs::read_dir(path.join("kept")).ok());
        kept.flatten()
            .any(|file| file.is_ok_and(|file| file.path().extension().is_some_and(|e| e == "tile")))
    };
    // On a busy machine it may end before it is killed, and is begun again.
    loop {
        let mut child = Command::new(env!("CARGO_BIN_EXE_s3d"))
            .args(call(&killed))
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        while !has_tile() && child.try_wait().unwrap().is_none() {
            thread::sleep(Duration::from_millis(1));
        }
        let _ = child.kill();
        if !child.wait().unwrap().success() {
            break;
        }
        fs::remove_file(&killed).unwrap();
    }
    assert!(!fs::exists(&killed).unwrap() && has_tile());

    let log = s3d_ok(&call(&killed));
    assert!(log.contains("its finished tiles are kept"), "{log}");
    assert!(fs::read(&killed).unwrap() == fs::read(&whole).unwrap());
    assert_eq!(working(), Vec::<PathBuf>::new());
}

fn height(location: &ScanLocation) -> f64 {
    location.position.z
}

#[test]
fn what_cannot_be_fused_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::write(at("hall.xyz"), "2 0 1\n0 3 1\n0 3 2\n").unwrap();
    fs::write(at("notes.md"), "no scan").unwrap();
    fs::write(at("there.ply"), "mine").unwrap();
    let [hall, notes, there] =
        ["hall.xyz", "notes.md", "there.ply"].map(|name| at(name).display().to_string());
    let [gone, mesh, obj] = ["gone.e57", "m.ply", "m.obj"].map(|name| at(name).display().to_string());

    s3d_fails(&["fuse", &hall, "-o", &mesh], 1, &["hall.xyz", "where the scanner stood"]);
    s3d_fails(&["fuse", &hall, "-o", &mesh, "--origin", "1,2"], 1, &["scanner's place has 2 numbers"]);
    s3d_fails(&["fuse", &notes, "-o", &mesh], 1, &["notes.md", "no raw scan"]);
    s3d_fails(&["fuse", &gone, "-o", &mesh], 1, &["gone.e57"]);
    s3d_fails(&["fuse", &hall, "-o", &obj], 2, &["m.obj", ".ply or a .glb"]);
    s3d_fails(&["fuse", &hall, "-o", &there, "--origin", "0,0,1"], 2, &["there.ply", "--overwrite"]);
    s3d_fails(&["fuse", &hall, "-o", &mesh, "--cell", "0"], 2, &["--cell"]);
    assert_eq!(fs::read(at("there.ply")).unwrap(), b"mine");
    assert!(!at("m.ply").exists());
}

/// The office of the built-in scene, with a second scan location.
fn office() -> AnnotatedScene {
    let demo = Building::demo();
    let mut scene =
        scene(Building { rooms: demo.rooms[..1].to_vec(), locations: demo.locations[..1].to_vec(), ..demo });
    let first = scene.locations[0].clone();
    let position = first.position + DVec3::new(-1.6, -0.8, -0.1);
    let yaw_rad = first.yaw_rad + 1.0;
    scene.locations.push(ScanLocation {
        uuid: "5b3e8a76d0f1492c8e47a92b6c1d05f3".to_owned(),
        position,
        yaw_rad,
    });
    scene
}

#[test]
fn points_tell_where_their_scanner_stood_unless_they_are_of_two_scans() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let scene = office();
    let target = ScanTarget::new(&scene);
    let scanner = LaserScanner { columns: 720, rows: 300, ..LaserScanner::default() };
    let lines = |location: &ScanLocation| {
        let scan = target.laser_scan(location, &scanner, 0).unwrap();
        let pixels = (0..scanner.rows).flat_map(|row| (0..scanner.columns).map(move |column| (column, row)));
        // In UTM: a scan is moved near the origin.
        let points = pixels
            .filter_map(|(column, row)| scan.world_point(column, row))
            .map(|p| p + DVec3::new(4e5, 5e6, 0.0));
        points.fold(String::new(), |mut text, p| {
            let _ = writeln!(text, "{:.3} {:.3} {:.3}", p.x, p.y, p.z);
            text
        })
    };
    let [first, second] = [0, 1].map(|number| lines(&scene.locations[number]));
    fs::write(at("one.xyz"), &first).unwrap();
    fs::write(at("two.xyz"), first + &second).unwrap();
    let [one, two, fused] = ["one.xyz", "two.xyz", "one_fused"].map(|name| at(name).display().to_string());

    let log = s3d_ok(&["fuse", &one, "-o", &fused, "--cell", "0.03"]);
    let place = scene.locations[0].position;
    let told: Vec<&str> = log
        .lines()
        .filter(|line| line.contains("By its points it was at"))
        .collect();
    assert!(told.len() == 1 && told[0].contains("WARN"), "{log}");
    let cameras = fs::read_to_string(at("one_fused/locations.csv")).unwrap();
    let numbers: Vec<f64> = cameras
        .lines()
        .nth(1)
        .unwrap()
        .split(',')
        .skip(1)
        .map(|n| n.parse().unwrap())
        .collect();
    let offset = fs::read_to_string(at("one_fused/offset.xyz")).unwrap();
    let offset: Vec<f64> = offset.split_whitespace().map(|n| n.parse().unwrap()).collect();
    let found = DVec3::from_slice(&numbers[..3]) + DVec3::from_slice(&offset) - DVec3::new(4e5, 5e6, 0.0);
    assert!(found.distance(place) < 0.05, "{found} is not {place}");

    let words = ["two.xyz", "where the scanner stood", "of several scans", "origin"];
    s3d_fails(&["fuse", &two, "-o", text(&at("two.ply"))], 1, &words);
    assert!(!at("two.ply").exists());
}

/// A step of the scanner is 0.5°, and of its panoramas 0.7°.
fn write_e57(target: &ScanTarget<'_>, path: &Path) {
    let scanner = LaserScanner { columns: 720, rows: 300, ..LaserScanner::default() };
    target
        .write_e57(path, &target.scene().locations, &scanner, 512, || true)
        .unwrap();
}

#[test]
fn an_e57_with_panoramas_becomes_a_data_set() {
    let dir = tempfile::tempdir().unwrap();
    let scene = office();
    let target = ScanTarget::new(&scene);
    write_e57(&target, &dir.path().join("scan.e57"));
    let file = dir.path().join("scene.toml");
    let toml = "rgb = \"e57\"\narea = 1\n[mesh]\nfuse = \"scan.e57\"\ncell_m = 0.02\n\
                [cameras]\npath = \"scan.e57\"\n";
    fs::write(&file, toml).unwrap();

    let out = dir.path().join("out");
    let log = s3d_ok(&[&["export", text(&file), "-o", text(&out)], &EXPORT[..]].concat());
    assert!(log.contains("2 laser scans") && log.contains("colours from images of 2 locations"), "{log}");
    s3d_ok(&["verify", text(&out)]);
    let share = agreement(&out, &target, 0.01);
    assert!(share > 0.95, "{share}");
}

/// Copies an E57 file with the last scan, and its picture, moved by `motion`.
fn copy_with_a_motion(from: &Path, to: &Path, motion: &DAffine3) {
    let mut reader = E57Reader::from_file(from).unwrap();
    let mut writer = E57Writer::from_file(to, "{0}").unwrap();
    let (scans, images) = (reader.pointclouds(), reader.images());
    let last = scans.last().unwrap().guid.clone();
    let moved = |transform: &Transform| {
        let (q, t) = (&transform.rotation, &transform.translation);
        let turn = DQuat::from_mat3(&motion.matrix3) * DQuat::from_xyzw(q.x, q.y, q.z, q.w);
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let at = motion.transform_point3(DVec3::new(t.x, t.y, t.z));
        Transform {
            rotation: Quaternion { w: turn.w, x: turn.x, y: turn.y, z: turn.z },
            translation: Translation { x: at.x, y: at.y, z: at.z },
        }
    };
    let placed = |transform: &Option<Transform>, is_last: bool| {
        let transform = transform.as_ref().unwrap();
        if is_last { moved(transform) } else { transform.clone() }
    };

    for scan in &scans {
        let points: Vec<_> = reader.pointcloud_raw(scan).unwrap().map(Result::unwrap).collect();
        let mut copy = writer
            .add_pointcloud(scan.guid.as_deref().unwrap(), scan.prototype.clone())
            .unwrap();
        copy.set_name(scan.name.clone());
        copy.set_transform(Some(placed(&scan.transform, scan.guid == last)));
        points.into_iter().for_each(|point| copy.add_point(point).unwrap());
        copy.finalize().unwrap();
    }
    for image in &images {
        let Some(Projection::Spherical(sphere)) = &image.projection else { panic!("a panorama") };
        let mut bytes = Vec::new();
        reader.blob(&sphere.blob.data, &mut bytes).unwrap();
        let mut copy = writer.add_image(image.guid.as_deref().unwrap()).unwrap();
        copy.set_pointcloud_guid(image.pointcloud_guid.as_deref().unwrap());
        copy.set_transform(placed(&image.transform, image.pointcloud_guid == last));
        copy.add_spherical(ImageFormat::Jpeg, &mut bytes.as_slice(), sphere.properties.clone(), None)
            .unwrap();
        copy.finalize().unwrap();
    }
    writer.finalize().unwrap();
}

#[test]
fn panoramas_move_with_their_scans() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let scene = office();
    let target = ScanTarget::new(&scene);
    write_e57(&target, &at("right.e57"));
    // The second scan is off by 5 cm and half a degree.
    let off = DAffine3::from_translation(DVec3::new(0.04, -0.03, 0.01));
    let turn = DAffine3::from_rotation_z(0.5_f64.to_radians());
    let middle = DAffine3::from_translation(scene.locations[1].position);
    copy_with_a_motion(&at("right.e57"), &at("scan.e57"), &(off * middle * turn * middle.inverse()));

    let folder = at("fused");
    let scan = at("scan.e57");
    let fuse = ["fuse", text(&scan), "-o", text(&folder), "--cell", "0.03", "--refine-poses"];
    let log = s3d_ok(&fuse);
    assert!(log.contains("moved by"), "{log}");
    let listed = read_cameras(&folder.join("locations.csv")).unwrap();
    // Either scan may have moved, so the places count from each other.
    let apart = listed[1].pose.location - listed[0].pose.location;
    let truth = scene.locations[1].position - scene.locations[0].position;
    let error_m = apart.length() - truth.length();
    assert!(error_m.abs() < 0.005, "{error_m}: {apart} {truth}");
    assert_eq!([&listed[0].uuid, &listed[1].uuid], [&scene.locations[0].uuid, &scene.locations[1].uuid]);

    let motions = read_cameras(&folder.join("motions.csv")).unwrap();
    let pictures = E57Pictures::open(&at("scan.e57"), &DAffine3::IDENTITY).unwrap();
    assert_eq!(motions.len(), pictures.of_locations(&listed).pictures.iter().flatten().count());
    let scene_file = folder.join("scene.toml");
    let out = at("out");
    let log = s3d_ok(&[&["export", text(&scene_file), "-o", text(&out)], &EXPORT[..]].concat());
    assert!(log.contains("colours from images of 2 locations"), "{log}");
    s3d_ok(&["verify", text(&out)]);
    let manifest = fs::read_to_string(out.join("manifest.json")).unwrap();
    assert!(manifest.contains("motions.csv"), "{manifest}");
}

#[test]
fn labelled_points_vote_onto_a_fused_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let scene = office();
    let target = ScanTarget::new(&scene);
    let options = ScanOptions { points_per_m2: 3000.0, ..ScanOptions::default() };
    scene.write_scan(dir.path(), &options, || true).unwrap();
    let scanner = LaserScanner { columns: 1200, rows: 500, ..LaserScanner::default() };
    target
        .write_ptx(&dir.path().join("scan.ptx"), &scene.locations, &scanner, || true)
        .unwrap();
    let file = dir.path().join("fused.toml");
    let toml = "area = 1\n[mesh]\nfuse = \"scan.ptx\"\ncell_m = 0.02\n[annotations]\npath = \"Area_1\"\n\
                [cameras]\npath = \"cameras.csv\"\n";
    fs::write(&file, toml).unwrap();
    let out = dir.path().join("out");
    s3d_ok(&[&["export", text(&file), "-o", text(&out)], &EXPORT[..]].concat());

    let layout = Layout::new(&out);
    let names = read_labels(&layout.labels_json()).unwrap();
    let votes = read_face_votes(&layout.votes_npz(1)).unwrap();
    let class = |label: &u32| names[*label as usize].split('_').next().unwrap().parse::<Class>().ok();
    let classes: Vec<Option<Class>> = votes.label.iter().map(class).collect();
    let mesh = read_mesh(&layout.rgb_obj(1), UpAxis::Y).unwrap().mesh;
    let truth = Truth::new(&target, &[], &TruthOptions::default()).unwrap();
    let scores = truth.score_labels(&mesh, &classes);
    assert!(scores.mean_iou > 0.85 && scores.accuracy > 0.95, "{scores:?}");
}
