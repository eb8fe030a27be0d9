//! Areas that were scanned in parts: joined, they are what they were before they were cut.

use s3d_dataset::info::{InfoOptions, SceneInfo, info};
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::{BareScene, Context, Export, ExportOptions, verify};
use s3d_geom::glam::{DAffine3, DQuat, DVec3, Vec3, dvec3};
use s3d_geom::{Raster, TriMesh, moved_point};
use s3d_io::dataset::Layout;
use s3d_io::image::{Compression, Content, encode_rgb8};
use s3d_io::mesh::{UpAxis, read_mesh, write_textured_glb};
use s3d_label::{Class, Room};
use s3d_synth::{Building, ScanOptions};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Where the second part was scanned, from where it is.
fn motion() -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_z(2.2), dvec3(14.0, -6.0, 0.7))
}

/// A matrix as scene files take it.
fn rows(m: &DAffine3) -> String {
    let [x, y, z] = m.matrix3.to_cols_array_2d();
    let t = m.translation;
    let row = |i: usize| format!("[{:?}, {:?}, {:?}, {:?}]", x[i], y[i], z[i], t[i]);
    format!("[{}, {}, {}, [0, 0, 0, 1]]", row(0), row(1), row(2))
}

/// Writes a scan of a building.
fn write_scan(building: Building, folder: &Path, points_per_m2: f64) -> (TriMesh, PathBuf) {
    let scene = Building { texture_scale: 0.05, ..building }.build().unwrap();
    let options = ScanOptions { points_per_m2, ..ScanOptions::default() };
    let path = scene.write_scan(folder, &options, || true).unwrap();
    (scene.mesh, path)
}

/// Writes what a scan in `whole` shows where `keep` is true into `folder`, moved by `motion`. If asked, rooms
/// and objects count from 1 in another order.
fn write_part(
    [whole, folder]: [&Path; 2],
    mesh: &TriMesh,
    keep: impl Fn(Vec3) -> bool,
    motion: &DAffine3,
    renumbered: bool,
) {
    fs::create_dir_all(folder).unwrap();
    let shown = |face: &u32| mesh.triangle(*face).into_iter().all(&keep);
    let faces: Vec<u32> = (0..mesh.faces().len() as u32).filter(shown).collect();
    let part = mesh.with_faces(&faces).unwrap().transformed(motion).unwrap();
    write_textured_glb(&folder.join("rgb.glb"), &part).unwrap();

    let mut files: Vec<PathBuf> = Vec::new();
    for room in fs::read_dir(whole.join("Area_1")).unwrap() {
        let annotations = room.unwrap().path().join("Annotations");
        files.extend(
            fs::read_dir(annotations)
                .into_iter()
                .flatten()
                .map(|file| file.unwrap().path()),
        );
    }
    files.sort();
    if renumbered {
        files.reverse();
    }
    let mut rooms: BTreeMap<String, String> = BTreeMap::new();
    for file in files {
        let mut text = String::new();
        for line in fs::read_to_string(&file).unwrap().lines() {
            let numbers: Vec<f32> = line.split(' ').map(|word| word.parse().unwrap()).collect();
            let point = Vec3::from_slice(&numbers);
            if keep(point) {
                let p = moved_point(motion, point);
                let _ = writeln!(
                    text,
                    "{:.4} {:.4} {:.4} {} {} {}",
                    p.x, p.y, p.z, numbers[3], numbers[4], numbers[5]
                );
            }
        }
        if text.is_empty() {
            continue;
        }
        let mut room = file.iter().rev().nth(2).unwrap().to_str().unwrap().to_owned();
        let mut name = file.file_stem().unwrap().to_str().unwrap().to_owned();
        if renumbered {
            let kind = room.rsplit_once('_').unwrap().0.to_owned();
            let number = 1 + rooms
                .keys()
                .filter(|room| room.starts_with(&format!("{kind}_")))
                .count();
            room = rooms.entry(room).or_insert_with(|| format!("{kind}_{number}")).clone();
            let class = name.rsplit_once('_').unwrap().0.to_owned();
            let free = |n: &usize| {
                !folder
                    .join(format!("Area_1/{room}/Annotations/{class}_{n}.txt"))
                    .exists()
            };
            name = format!("{class}_{}", (1..).find(free).unwrap());
        }
        let to = folder.join("Area_1").join(room).join("Annotations");
        fs::create_dir_all(&to).unwrap();
        fs::write(to.join(format!("{name}.txt")), text).unwrap();
    }

    let cameras = fs::read_to_string(whole.join("cameras.csv")).unwrap();
    let stands_here = |line: &&str| {
        let number = |i: usize| line.split(',').nth(i).and_then(|word| word.parse().ok());
        let at = [1, 2, 3].map(number);
        matches!(at, [Some(x), Some(y), Some(z)] if keep(Vec3::new(x, y, z)))
    };
    let cameras: Vec<&str> = cameras.lines().filter(stands_here).collect();
    fs::write(folder.join("cameras.csv"), cameras.join("\n")).unwrap();
    let toml = format!(
        "area = 1\n[mesh]\npath = \"rgb.glb\"\n[annotations]\npath = \"Area_1\"\n[cameras]\npath = \
         \"cameras.csv\"\ntransform = {}\n",
        rows(motion)
    );
    fs::write(folder.join("scene.toml"), toml).unwrap();
}

fn described(path: &Path) -> SceneInfo {
    info(path.to_owned(), &InfoOptions::default(), &Context::default()).unwrap()
}

fn instances(info: &SceneInfo) -> BTreeMap<Room, BTreeMap<Class, u32>> {
    info.rooms
        .iter()
        .map(|room| (room.room, room.instances.clone()))
        .collect()
}

fn labelled_share(info: &SceneInfo) -> f64 {
    info.labelled_faces as f64 / info.mesh.faces as f64
}

#[test]
fn a_house_of_two_storeys_is_joined_of_parts_that_nobody_placed() {
    let dir = tempfile::tempdir().unwrap();
    let whole = dir.path().join("whole");
    let (mesh, scene) = write_scan(Building::two_storeys(), &whole, 150.0);
    let (low, high) = (mesh.aabb().min.x, mesh.aabb().max.x);
    let at = |share: f32| low + share * (high - low);
    let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
    write_part([&whole, &a], &mesh, |p| p.x < at(0.68), &DAffine3::IDENTITY, false);
    write_part([&whole, &b], &mesh, |p| p.x > at(0.32), &motion(), true);
    // No location is in both.
    let cameras = fs::read_to_string(a.join("cameras.csv")).unwrap();
    let others = fs::read_to_string(b.join("cameras.csv")).unwrap();
    let others: Vec<&str> = others.lines().filter(|line| !cameras.contains(line)).collect();
    fs::write(b.join("cameras.csv"), others.join("\n")).unwrap();

    let text =
        "area = 5\n[[parts]]\npath = \"a/scene.toml\"\n[[parts]]\npath = \"b/scene.toml\"\nalign = true\n";
    let path = dir.path().join("scene.toml");
    fs::write(&path, text).unwrap();

    let [expected, found] = [&scene, &path].map(|path| described(path));
    assert_eq!(instances(&found), instances(&expected), "{:#?}", found.notes);
    assert_eq!((found.area, found.storeys.len()), (5, expected.storeys.len()));
    assert!(found.notes.iter().any(|note| note.contains("aligned: ")), "{:#?}", found.notes);
    // What both parts show, a third of the house, is there once, but for faces across the end of a part.
    let ratio = found.mesh.area_m2 / expected.mesh.area_m2;
    assert!((0.99..1.1).contains(&ratio), "{ratio}");
    // On those faces a point is as near to either part's, and votes for the earlier one.
    let [of_parts, of_whole] = [&found, &expected].map(labelled_share);
    assert!(of_parts > of_whole - 0.06, "{of_parts} {of_whole}");

    let places: BTreeMap<&String, DVec3> = expected
        .locations
        .iter()
        .map(|l| (&l.location.uuid, l.location.pose.location))
        .collect();
    assert_eq!(found.locations.len(), places.len());
    for l in &found.locations {
        let off_m = l.location.pose.location.distance(places[&l.location.uuid]);
        let room = expected
            .locations
            .iter()
            .find(|e| e.location.uuid == l.location.uuid)
            .unwrap()
            .room;
        assert!(off_m < 0.005 && l.room == room, "{off_m} {:?}", l.room);
    }
}

#[test]
fn parts_with_given_places_are_exported_as_one_area() {
    let dir = tempfile::tempdir().unwrap();
    let whole = dir.path().join("whole");
    let (mesh, _) = write_scan(Building::demo(), &whole, 60.0);
    let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
    write_part([&whole, &a], &mesh, |p| p.x < 18.6, &DAffine3::IDENTITY, false);
    write_part([&whole, &b], &mesh, |p| p.x > 18.2, &motion(), false);
    let text = format!(
        "area = 5\n[[parts]]\npath = \"a\"\n[[parts]]\npath = \"b/scene.toml\"\ntransform = {}\n",
        rows(&motion().inverse())
    );
    let scene = dir.path().join("scene.toml");
    fs::write(&scene, text).unwrap();

    let options =
        ExportOptions { views: 1, size: 32, pano_width: 64, points_per_m2: 40.0, ..ExportOptions::default() };
    let out = dir.path().join("out");
    let export = || {
        let exported = Export::new([scene.clone()]).options(options.clone());
        exported.run(&out, &Context::default()).unwrap()
    };
    export();
    let report = verify(&out, &VerifyOptions::default(), &Context::default()).unwrap();
    assert_eq!(report.fault_count(), 0, "{report:?}");
    let manifest = fs::read(out.join("manifest.json")).unwrap();
    export();
    assert_eq!(fs::read(out.join("manifest.json")).unwrap(), manifest);

    // The mesh lies where the whole one lies.
    let read = read_mesh(&Layout::new(out).rgb_obj(5), UpAxis::Y).unwrap();
    assert!(read.mesh.aabb().min.abs_diff_eq(mesh.aabb().min, 1e-4));
    assert!(read.mesh.aabb().max.abs_diff_eq(mesh.aabb().max, 1e-4));

    // Labels of the whole area, whose parts are meshes alone.
    let text = format!(
        "area = 5\n[[parts]]\npath = \"a/rgb.glb\"\n[[parts]]\npath = \"b/rgb.glb\"\ntransform = \
         {}\n[annotations]\npath = \"whole/Area_1\"\n[cameras]\npath = \"whole/cameras.csv\"\n",
        rows(&motion().inverse())
    );
    fs::write(&scene, text).unwrap();
    let [expected, found] = [&whole.join("scene.toml"), &scene].map(|path| described(path));
    assert_eq!(instances(&found), instances(&expected));
    assert_eq!((found.points, found.locations.len()), (expected.points, expected.locations.len()));
    let [of_parts, of_whole] = [&found, &expected].map(labelled_share);
    assert!(of_parts > of_whole - 0.02, "{of_parts} {of_whole}");

    // The parts of another area are told, and so are mixed ones.
    let refused = |text: &str, words: &str| {
        fs::write(&scene, text).unwrap();
        let error = info(scene.clone(), &InfoOptions::default(), &Context::default()).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    };
    refused("area = 5\n[[parts]]\npath = \"scene.toml\"\n", "has parts itself");
    refused("area = 5\n[[parts]]\npath = \"a\"\n[[parts]]\npath = \"a\"\n", "is also in");
    refused("area = 5\n[[parts]]\npath = \"a\"\n[[parts]]\npath = \"b/rgb.glb\"\n", "has labels");
}

#[test]
fn photographs_of_one_name_in_two_parts_stay_apart() {
    let dir = tempfile::tempdir().unwrap();
    let (mesh, _) = write_scan(Building::demo(), &dir.path().join("whole"), 20.0);
    // It stands in the hallway, tilted.
    let turn = DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(1.3);
    let pose = DAffine3::from_rotation_translation(turn, dvec3(17.8, 10.4, 1.4));
    for (name, motion) in [("a", DAffine3::IDENTITY), ("b", motion())] {
        let folder = dir.path().join(name);
        fs::create_dir_all(&folder).unwrap();
        let keep = |p: Vec3| if name == "a" { p.x < 18.0 } else { p.x > 17.6 };
        let shown = |face: &u32| mesh.triangle(*face).into_iter().all(keep);
        let faces: Vec<u32> = (0..mesh.faces().len() as u32).filter(shown).collect();
        let part = mesh.with_faces(&faces).unwrap().transformed(&motion).unwrap();
        write_textured_glb(&folder.join("rgb.glb"), &part).unwrap();

        let photo = encode_rgb8(&Raster::filled(8, 4, [90; 3]), Content::Photo, Compression::Fast);
        fs::write(folder.join("1.png"), photo).unwrap();
        let matrix: serde_json::Value = serde_json::from_str(&rows(&(motion * pose))).unwrap();
        let list = serde_json::json!({
            "fl_x": 8, "fl_y": 8, "cx": 4, "cy": 2, "w": 8, "h": 4,
            "frames": [{ "file_path": "1.png", "transform_matrix": matrix }],
        });
        fs::write(folder.join("transforms.json"), list.to_string()).unwrap();
        let toml = "area = 1\n[mesh]\npath = \"rgb.glb\"\n[frames]\npath = \"transforms.json\"\n";
        fs::write(folder.join("scene.toml"), toml).unwrap();
    }
    let text = format!(
        "area = 3\n[[parts]]\npath = \"a\"\n[[parts]]\npath = \"b\"\ntransform = {}\n",
        rows(&motion().inverse())
    );
    fs::write(dir.path().join("scene.toml"), text).unwrap();

    let scene = BareScene::open(dir.path().join("scene.toml"), &Context::default()).unwrap();
    let photographs: Vec<_> = scene.photographs().collect();
    let names: Vec<&str> = photographs.iter().map(|photograph| photograph.name()).collect();
    assert_eq!(names, ["1.png", "part_2/1.png"]);
    let ahead = pose.transform_vector3(dvec3(0.1, 0.2, -1.0));
    let places = [0, 1].map(|i| photographs[i].place(ahead).unwrap());
    assert!(places[0].abs_diff_eq(places[1], 1e-9), "{places:?}");
    let uuids: BTreeSet<String> = scene
        .locations(&Context::default())
        .unwrap()
        .into_iter()
        .map(|l| l.uuid)
        .collect();
    assert_eq!(uuids.len(), 2);
}
