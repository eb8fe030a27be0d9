//! `s3d verify` names every planted fault, and finds no fault in a good data set.

mod told_elsewhere;

use crate::common;
use common::{UUID_A, list_files, s3d, s3d_ok, text, write_scan};
use glam::DMat3;
use s3d_geom::{Camera, Pose, Raster};
use s3d_io::dataset::{
    DatasetImage, Domain, Frame, Layout, PoseFile, dataset_images, read_labels, read_pose, write_labels,
};
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::{Compression, Content, encode_rgb8, read_gray16, read_rgb8, write_gray16, write_rgb8};
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_render::{Scene, cast_ray};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Runs `s3d verify`. Returns its report and its exit code.
fn verify(out: &Path, extra: &[&str]) -> (String, i32) {
    let result = s3d(&[&["verify", text(out)], extra].concat());
    let log = String::from_utf8_lossy(&result.stderr).into_owned();
    assert!(!log.contains("panicked"), "{log}");
    (String::from_utf8_lossy(&result.stdout).into_owned(), result.status.code().unwrap())
}

fn is_clean(out: &Path, extra: &[&str]) -> String {
    let (report, code) = verify(out, extra);
    assert!(code == 0 && report.ends_with(" 0 faults\n"), "{}: {code}\n{report}", out.display());
    report
}

/// Asserts that a line of the report names the file and contains all of the words.
#[track_caller]
fn tells(report: &str, file: &str, words: &[&str]) {
    let found = report
        .lines()
        .any(|l| l.trim_start().starts_with(&format!("{file}: ")) && words.iter().all(|w| l.contains(w)));
    assert!(found, "no line tells of {file}: {words:?}\n{report}");
}

/// The built-in scene, exported once. It has textures, all classes and several rooms.
fn demo() -> &'static Path {
    static DEMO: OnceLock<TempDir> = OnceLock::new();
    let dir = DEMO.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("demo");
        let small = ["--size", "64", "--pano-width", "128", "--views", "6", "--points-per-m2", "60"];
        s3d_ok(&[&["demo", "-o", text(&out), "--compression", "fast"][..], &small].concat());
        s3d_ok(&["profile", text(&out), "--to", "pointcept,open3d-ml,pointnet,mmdet3d"]);
        dir
    });
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| dir.path().join("demo"))
}

/// A copy for planted faults: hard links, so a file is shared until it is replaced.
fn copy(of: &Path) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("copy");
    for path in walk(of) {
        let to = out.join(path.strip_prefix(of).unwrap());
        create_dir(to.parent().unwrap()).unwrap();
        fs::hard_link(&path, &to)
            .or_else(|_| fs::copy(&path, &to).map(drop))
            .unwrap();
    }
    (dir, out)
}

fn walk(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(walk(&path))
        } else {
            found.push(path)
        }
    }
    found.sort();
    found
}

/// The first file below `folder` whose name ends like this.
fn first(out: &Path, folder: &str, ending: &str) -> String {
    let files = walk(&out.join(folder));
    let found = files.iter().find(|p| p.to_string_lossy().ends_with(ending));
    let found = found.unwrap_or_else(|| panic!("no {ending} in {folder}"));
    found.strip_prefix(out).unwrap().to_str().unwrap().to_owned()
}

/// Flips one bit in the middle of a file.
fn flip(out: &Path, file: &str) {
    let path = out.join(file);
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    write_bytes(&path, &bytes).unwrap();
}

fn images(out: &Path) -> Vec<DatasetImage> {
    dataset_images(&Layout::new(out), 1).unwrap()
}

/// The views of the location that has the most.
fn views(out: &Path) -> Vec<DatasetImage> {
    let all = images(out);
    let of = |uuid: &str| -> Vec<DatasetImage> {
        all.iter()
            .filter(|i| i.uuid == uuid && i.frame != Frame::Panorama)
            .cloned()
            .collect()
    };
    all.iter().map(|i| of(&i.uuid)).max_by_key(Vec::len).unwrap()
}

fn panoramas(out: &Path) -> Vec<DatasetImage> {
    images(out).into_iter().filter(|i| i.frame == Frame::Panorama).collect()
}

#[test]
fn a_clean_data_set_has_no_fault() {
    let report = is_clean(demo(), &[]);
    assert!(!report.contains("note:"), "{report}");
    is_clean(demo(), &["--full", "--threads", "1"]);
}

#[test]
fn a_flipped_bit_in_every_kind_of_file_is_found() {
    let (_dir, out) = copy(demo());
    let kinds = [
        ("area_1/data/rgb", ".png"),
        ("area_1/data/depth", ".png"),
        ("area_1/data/normal", ".png"),
        ("area_1/data/semantic", ".png"),
        ("area_1/data/semantic_pretty", ".png"),
        ("area_1/data/global_xyz", ".exr"),
        ("area_1/data/pose", ".json"),
        ("area_1/pano/rgb", ".png"),
        ("area_1/pano/depth", ".png"),
        ("area_1/pano/normal", ".png"),
        ("area_1/pano/semantic", ".png"),
        ("area_1/pano/semantic_pretty", ".png"),
        ("area_1/pano/global_xyz", ".exr"),
        ("area_1/pano/pose", ".json"),
        ("area_1", "views.json"),
        ("area_1/3d", "rgb.obj"),
        ("area_1/3d", "semantic.obj"),
        ("area_1/3d", "rgb.mtl"),
        ("area_1/3d", "semantic.mtl"),
        ("area_1/3d/rgb_textures", ".png"),
        ("area_1/3d", "pointcloud.ply"),
        ("area_1/3d", "pointcloud.mat"),
        ("area_1/3d", "pointcloud_boxes.json"),
        ("area_1/3d", "instances.json"),
        ("area_1/3d", "instances.npz"),
        ("area_1/3d", "rooms.json"),
        ("area_1/3d", "votes.json"),
        ("area_1/3d", "votes.npz"),
        ("area_1/3d", "instance_numbers.json"),
        ("s3dis/Area_1", "_alignmentAngle.txt"),
        ("s3dis/Area_1", "Annotations/wall_1.txt"),
        ("assets", "semantic_labels.json"),
        ("assets", "utils.py"),
        ("assets/schema", "pose.schema.json"),
        ("assets/schema", "manifest.schema.json"),
        ("profiles/pointcept", ".txt"),
        ("profiles/pointnet", ".npy"),
        ("profiles/pointnet", ".txt"),
        ("profiles/mmdet3d", "_point.npy"),
        ("profiles/open3d-ml", ".pkl"),
        ("splits", "all.txt"),
        (".", "/splits.json"),
        (".", "/conventions.json"),
        (".", "/statistics.json"),
        (".", "/statistics.md"),
    ];
    let files: Vec<String> = kinds
        .iter()
        .map(|(folder, ending)| match *folder {
            "." => ending[1..].to_owned(),
            folder => first(&out, folder, ending),
        })
        .collect();
    files.iter().for_each(|file| flip(&out, file));
    let (report, code) = verify(&out, &[]);
    assert_eq!(code, 1);
    for file in &files {
        // A report names the first 20 files of a kind of fault.
        let named = report.lines().any(|l| l.trim_start().starts_with(&format!("{file}: ")));
        assert!(named || report.contains("more like this (sizes and checksums)"), "{file}\n{report}");
    }
    // In small groups, so that the limit of lines hides none.
    for chunk in files.chunks(14) {
        let (_dir, out) = copy(demo());
        chunk.iter().for_each(|file| flip(&out, file));
        let (report, code) = verify(&out, &[]);
        assert_eq!(code, 1);
        chunk
            .iter()
            .for_each(|file| tells(&report, file, &["other content than was written"]));
    }
    // The list of files and the manifest.
    let (_dir, out) = copy(demo());
    flip(&out, "files.csv");
    let (report, code) = verify(&out, &[]);
    assert_eq!(code, 1);
    assert!(report.contains("  files.csv: "), "{report}");
    let manifest = fs::read_to_string(out.join("manifest.json")).unwrap();
    write_bytes(&out.join("manifest.json"), manifest.replacen("complete", "completf", 1).as_bytes()).unwrap();
    let (report, code) = verify(&out, &[]);
    assert_eq!(code, 1);
    tells(&report, "manifest.json", &["did not finish"]);
}

#[test]
fn faults_while_another_process_is_at_work_are_temporary() {
    let (_dir, out) = copy(demo());
    flip(&out, "statistics.json");
    create_dir(&out.join(".s3d")).unwrap();
    let lock = fs::File::create(out.join(".s3d/lock")).unwrap();
    lock.lock().unwrap();
    common::s3d_fails(&["verify", text(&out)], 75, &[text(&out), "another process", "check it again"]);
    drop(lock);
    assert_eq!(verify(&out, &[]).1, 1);
}

#[test]
fn missing_extra_and_swapped_files_are_found() {
    let (_dir, out) = copy(demo());
    let gone = first(&out, "area_1/data/normal", ".png");
    fs::remove_file(out.join(&gone)).unwrap();
    fs::remove_file(out.join("assets/utils.py")).unwrap();
    write_bytes(&out.join("area_1/data/rgb/Thumbs.db"), b"x").unwrap();
    write_bytes(&out.join("area_1/3d/rgb_textures/more.png"), b"x").unwrap();
    let [a, b] = [0, 1].map(|i| panoramas(&out)[i].relative_path(Domain::SemanticPretty));
    let bytes = [&a, &b].map(|f| fs::read(out.join(f)).unwrap());
    write_bytes(&out.join(&a), &bytes[1]).unwrap();
    write_bytes(&out.join(&b), &bytes[0]).unwrap();
    let (report, code) = verify(&out, &[]);
    assert_eq!(code, 1);
    tells(&report, &gone, &["missing"]);
    tells(&report, "assets/utils.py", &["missing"]);
    tells(&report, "area_1/data/rgb/Thumbs.db", &["files.csv does not name it"]);
    tells(&report, "area_1/3d/rgb_textures/more.png", &["files.csv does not name it"]);
    for (file, other) in [(&a, panoramas(&out)[1].stem()), (&b, panoramas(&out)[0].stem())] {
        tells(&report, file, &["is damaged"]);
        tells(&report, file, &["colours of the labels in the semantic image"]);
        tells(&report, file, &["are not what the mesh shows", &other, "swapped"]);
    }
}

/// The depth of a view as a tool makes it that forgets half a pixel: the rays go through the corners of the
/// pixels.
fn shifted_depth(out: &Path, image: &DatasetImage) -> Raster<u16> {
    let layout = Layout::new(out);
    let mesh = read_mesh(&layout.rgb_obj(1), UpAxis::Y).unwrap().mesh;
    let scene = Scene::new(&mesh);
    let pose = read_pose(&image.path(&layout, Domain::Pose)).unwrap();
    let camera = Camera::perspective(pose.pose(), pose.field_of_view_rads, 64, 64);
    let depth = |i: u32| {
        let direction = camera.direction(f64::from(i % 64), f64::from(i / 64));
        let hit = cast_ray(&scene, camera.pose.location, direction);
        hit.map_or(u16::MAX, |h| (h.t * 512.0 + 0.5) as u16)
    };
    Raster::from_vec(64, 64, (0..64 * 64).map(depth).collect())
}

fn mirrored<T: Copy>(image: &Raster<T>) -> Raster<T> {
    let rows = image.rows().flat_map(|row| row.iter().rev().copied());
    Raster::from_vec(image.width(), image.height(), rows.collect())
}

fn swap(out: &Path, a: &str, b: &str) {
    let bytes = [a, b].map(|f| fs::read(out.join(f)).unwrap());
    write_bytes(&out.join(a), &bytes[1]).unwrap();
    write_bytes(&out.join(b), &bytes[0]).unwrap();
}

/// Faults of tools that also update the list of files: only the content shows them.
#[test]
fn what_tools_get_wrong_is_called_by_its_name() {
    let (_dir, out) = copy(demo());
    let layout = Layout::new(&out);
    let (views, panoramas) = (views(&out), panoramas(&out));
    assert!(views.len() >= 4 && panoramas.len() >= 4, "{} {}", views.len(), panoramas.len());
    let path = |image: &DatasetImage, domain| out.join(image.relative_path(domain));

    // A mirrored panorama: all of its images, but not the pose.
    let mirror = &panoramas[0];
    for domain in [Domain::Rgb, Domain::Normal, Domain::Semantic, Domain::SemanticPretty] {
        let image = mirrored(&read_rgb8(&path(mirror, domain)).unwrap());
        write_rgb8(&path(mirror, domain), &image, Content::Photo, Compression::Fast).unwrap();
    }
    let depth = mirrored(&read_gray16(&path(mirror, Domain::Depth)).unwrap());
    write_gray16(&path(mirror, Domain::Depth), &depth, Compression::Fast).unwrap();
    // Shifts by half a pixel and by one pixel.
    let half = &views[0];
    write_gray16(&path(half, Domain::Depth), &shifted_depth(&out, half), Compression::Fast).unwrap();
    let one = &panoramas[1];
    let semantic = read_rgb8(&path(one, Domain::Semantic)).unwrap();
    let rows = semantic.rows().flat_map(|r| [&r[1..], &r[..1]].concat());
    let moved = Raster::from_vec(semantic.width(), semantic.height(), rows.collect());
    write_rgb8(&path(one, Domain::Semantic), &moved, Content::Labels, Compression::Fast).unwrap();
    // Swapped files of two views: colours, and depth of panoramas.
    let [a, b] = [&views[1], &views[2]];
    swap(&out, &a.relative_path(Domain::Rgb), &b.relative_path(Domain::Rgb));
    swap(&out, &panoramas[2].relative_path(Domain::Depth), &panoramas[3].relative_path(Domain::Depth));
    // A transposed matrix in an otherwise good file, and a pose with every rotation transposed.
    let matrix = &panoramas[1];
    let mut pose = read_pose(&path(matrix, Domain::Pose)).unwrap();
    let rt = pose.camera_rt_matrix;
    for (i, row) in rt.iter().enumerate() {
        for (j, value) in row[..3].iter().enumerate() {
            pose.camera_rt_matrix[j][i] = *value;
        }
    }
    pose.write(&path(matrix, Domain::Pose)).unwrap();
    let turned = &views[3];
    let pose = read_pose(&path(turned, Domain::Pose)).unwrap();
    let wrong = Pose { world_from_camera: pose.pose().world_from_camera.transpose(), ..pose.pose() };
    let camera = Camera::perspective(wrong, pose.field_of_view_rads, 64, 64);
    PoseFile::new(&camera, &pose.original(), &pose.camera_uuid, &pose.room, pose.frame_num)
        .write(&path(turned, Domain::Pose))
        .unwrap();
    // Swapped colour channels, and a transposed K.
    let swapped = &views[1];
    let normals = read_rgb8(&path(swapped, Domain::Normal))
        .unwrap()
        .map(|[r, g, b]| [b, g, r]);
    write_bytes(&path(swapped, Domain::Normal), &encode_rgb8(&normals, Content::Normals, Compression::Fast))
        .unwrap();
    let mut pose = read_pose(&path(swapped, Domain::Pose)).unwrap();
    let k = pose.camera_k_matrix;
    pose.camera_k_matrix = std::array::from_fn(|i| std::array::from_fn(|j| k[j][i]));
    pose.write(&path(swapped, Domain::Pose)).unwrap();

    for listed in [true, false] {
        if listed {
            list_files(&out);
        } else {
            // As in an older data set, there is no list.
            fs::remove_file(layout.file_list()).unwrap();
            let manifest = fs::read(layout.manifest()).unwrap();
            let mut manifest: Value = serde_json::from_slice(&manifest).unwrap();
            manifest.as_object_mut().unwrap().remove("files");
            write_bytes(&layout.manifest(), manifest.to_string().as_bytes()).unwrap();
        }
        let (report, code) = verify(&out, if listed { &[] } else { &["--full"] });
        assert_eq!(code, 1);
        assert!(!report.contains("other content than was written"), "{report}");
        let is = |image: &DatasetImage, domain, words: &[&str]| {
            tells(&report, &image.relative_path(domain), words)
        };
        for domain in [Domain::Rgb, Domain::Depth, Domain::Normal, Domain::Semantic, Domain::SemanticPretty] {
            // A mirrored image of normals has the wrong directions, but the picture still shows that it is
            // mirrored.
            is(mirror, domain, &["not what the mesh shows", "mirrored left to right"]);
        }
        is(mirror, Domain::GlobalXyz, &["not where depth and pose put them"]);
        is(half, Domain::Depth, &["shifted by half a pixel to the right and down"]);
        is(one, Domain::Semantic, &["shifted by one pixel to the left"]);
        is(a, Domain::Rgb, &[&b.stem(), "swapped"]);
        is(b, Domain::Rgb, &[&a.stem(), "swapped"]);
        is(&panoramas[2], Domain::Depth, &[&panoramas[3].stem(), "swapped"]);
        is(&panoramas[3], Domain::Depth, &[&panoramas[2].stem(), "swapped"]);
        is(matrix, Domain::Pose, &["camera_rt_matrix", "it is transposed"]);
        is(turned, Domain::Pose, &["not as views.json drew it", "it is transposed"]);
        is(turned, Domain::Depth, &["fits the pose with its rotation transposed"]);
        is(turned, Domain::Pose, &["all images of it differ", "rotation transposed"]);
        is(swapped, Domain::Normal, &["red and blue are swapped"]);
        is(swapped, Domain::Pose, &["camera_k_matrix is transposed"]);
        assert!(report.contains("  manifest.json: tells of no files.csv") != listed, "{report}");
    }
}

#[test]
fn a_label_table_out_of_order_is_found() {
    let (_dir, out) = copy(demo());
    let layout = Layout::new(&out);
    let mut names = read_labels(&layout.labels_json()).unwrap();
    let last = names.iter().rposition(|n| n != "<UNK>_0_<UNK>_0_0").unwrap();
    // The swapped names are two walls.
    let i = names.iter().position(|n| n.starts_with("wall_")).unwrap();
    names.swap(i, i + 1);
    write_labels(&layout.labels_json(), &names).unwrap();
    list_files(&out);
    let (report, code) = verify(&out, &[]);
    assert_eq!(code, 1);
    tells(&report, "assets/semantic_labels.json", &["out of order", &names[i + 1]]);
    tells(&report, "area_1/3d/instances.json", &[&names[i], "has the index"]);
    tells(&report, "area_1/3d/pointcloud.ply", &["do not fit their faces"]);

    // The image was made with another table, whose indices are sorted as numbers, not as words.
    names.swap(i, i + 1);
    write_labels(&layout.labels_json(), &names).unwrap();
    let mut natural: Vec<usize> = (1..=last).collect();
    let number = |n: &str| n.split('_').nth(1).and_then(|n| n.parse::<u32>().ok());
    natural.sort_by_key(|&i| (names[i].split('_').next().map(str::to_owned), number(&names[i])));
    // If both orders are the same, the order is reversed instead.
    if natural.is_sorted() {
        natural.reverse();
    }
    let image = &panoramas(&out)[0];
    let path = image.path(&layout, Domain::Semantic);
    let indices = read_rgb8(&path).unwrap().map(|c| {
        let index = u32::from_be_bytes([0, c[0], c[1], c[2]]);
        match natural.iter().position(|&i| i as u32 == index) {
            Some(place) => {
                let [_, r, g, b] = (place as u32 + 1).to_be_bytes();
                [r, g, b]
            }
            None => c,
        }
    });
    write_rgb8(&path, &indices, Content::Labels, Compression::Fast).unwrap();
    list_files(&out);
    let (report, code) = verify(&out, &[]);
    assert_eq!(code, 1);
    tells(&report, &image.relative_path(Domain::Semantic), &["those of another label table"]);

    // Votes and statistics that do not match the meshes.
    let (_dir, out) = copy(demo());
    for (file, key) in [("area_1/3d/votes.json", "faces_voted"), ("statistics.json", "panoramas")] {
        let text = fs::read_to_string(out.join(file)).unwrap();
        let at = text.find(key).unwrap() + key.len() + 3;
        let end = at + text[at..].find([',', '\n', '}']).unwrap();
        write_bytes(&out.join(file), format!("{}7{}", &text[..at], &text[end..]).as_bytes()).unwrap();
    }
    list_files(&out);
    let (report, code) = verify(&out, &[]);
    assert_eq!(code, 1);
    tells(&report, "area_1/3d/votes.json", &["not what votes.npz and instances.json give"]);
    tells(&report, "statistics.json", &["not what is counted from the files", "panoramas is 7"]);
}

#[test]
fn an_unfinished_data_set_and_none_are_told() {
    let (_dir, out) = copy(demo());
    let path = out.join("manifest.json");
    let mut manifest: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    manifest["status"] = "running".into();
    write_bytes(&path, manifest.to_string().as_bytes()).unwrap();
    let (report, code) = verify(&out, &[]);
    assert_eq!(code, 1);
    tells(&report, "manifest.json", &["\"running\"", "did not finish"]);
    assert!(report.ends_with(" 1 fault\n"), "{report}");
    common::s3d_fails(&["verify", text(&out.join("area_1"))], 2, &["no data set is there"]);
}

const SMALL: [&str; 10] =
    ["--size", "32", "--pano-width", "64", "--views", "4", "--points-per-m2", "50", "--compression", "fast"];

/// A good export has no fault, whatever its options.
#[test]
fn exports_of_every_kind_are_clean() {
    let dir = tempfile::tempdir().unwrap();
    let one = write_scan(&dir.path().join("one"), 1);
    let two = write_scan(&dir.path().join("two"), 2);
    let export = |name: &str, scenes: &[&Path], extra: &[&str]| {
        let out = dir.path().join(name);
        let scenes: Vec<&str> = scenes.iter().map(|s| text(s)).collect();
        s3d_ok(&[&["export"][..], &scenes, &["-o", text(&out)], &SMALL, extra].concat());
        out
    };
    let forms = [
        "--xyz",
        "float",
        "--normal-axes",
        "opencv",
        "--depth-units",
        "mm",
        "--keep-all",
        "--smooth-normals",
    ];
    is_clean(&export("forms", &[&one], &forms), &["--full"]);
    let areas = export(
        "areas",
        &[&one, &two],
        &["--pool", "location", "--profile", "pointnet", "--pad-labels", "off"],
    );
    is_clean(&areas, &["--full"]);
    let some = ["--modalities", "depth,pose,global_xyz", "--xyz", "none", "--only", UUID_A, "--keep-all"];
    let some = export("some", &[&one], &some);
    is_clean(&some, &[]);
    s3d_ok(&["xyz", text(&some), "--type", "float"]);
    is_clean(&some, &[]);
    s3d_ok(&["xyz", text(&some), "--type", "half", "--overwrite"]);
    is_clean(&some, &[]);
    let report = is_clean(&export("bare", &[&one], &["--modalities", "semantic_pretty,normal"]), &[]);
    assert!(report.contains("they have no poses"), "{report}");
    is_clean(
        &export("placed", &[&one], &["--seed", "9", "--place-cameras", "1.2", "--entropy-stride", "1"]),
        &["--full"],
    );
    // An export of an export; and textures that do not repeat, since colours at their edges would show it.
    let published = dir.path().join("published");
    s3d_ok(&[&["export", text(&demo().join("area_1")), "-o", text(&published)][..], &SMALL].concat());
    is_clean(&published, &["--full"]);
    let scan = dir.path().join("clamped");
    let (_dir, source) = copy(&demo().join("scan"));
    fs::rename(&source, &scan).unwrap();
    let mtl = fs::read_to_string(scan.join("rgb.mtl")).unwrap();
    assert!(mtl.contains("map_Kd "));
    write_bytes(&scan.join("rgb.mtl"), mtl.replace("map_Kd ", "map_Kd -clamp on ").as_bytes()).unwrap();
    let clamped =
        export("no_repeat", &[&scan.join("scene.toml")], &["--modalities", "rgb,pose", "--smooth-normals"]);
    let mtl = fs::read_to_string(clamped.join("area_1/3d/rgb.mtl")).unwrap();
    assert!(mtl.contains("# s3d wrap clamp clamp") || mtl.contains("-clamp on"), "{mtl}");
    is_clean(&clamped, &["--full"]);
    // Colours from pictures.
    let pictures = dir.path().join("one/panorama");
    fs::create_dir(&pictures).unwrap();
    for uuid in [UUID_A, common::UUID_B] {
        let colors = (0..64 * 32u32).map(|i| [4 * (i % 64) as u8, 8 * (i / 64) as u8, 60]);
        let photo = Raster::from_vec(64, 32, colors.collect());
        write_rgb8(&pictures.join(format!("{uuid}.png")), &photo, Content::Photo, Compression::Fast).unwrap();
    }
    let toml = fs::read_to_string(&one).unwrap();
    fs::write(&one, format!("rgb = \"panorama\"\n{toml}")).unwrap();
    let out = export("pictures", &[&one], &[]);
    let report = is_clean(&out, &["--full"]);
    assert!(report.contains("come from pictures (panorama)"), "{report}");

    // A view that was mirrored, or whose red and blue were exchanged, is not what the panorama shows.
    let view = first(&out, "area_1/data/rgb", ".png");
    let image = read_rgb8(&out.join(&view)).unwrap();
    for changed in [mirrored(&image), image.map(|[r, g, b]| [b, g, r])] {
        write_rgb8(&out.join(&view), &changed, Content::Photo, Compression::Fast).unwrap();
        common::list_files(&out);
        let (report, code) = verify(&out, &[]);
        assert_eq!(code, 1);
        tells(&report, &view, &["have another mean colour than area_1/pano/rgb/"]);
    }
}

#[test]
fn a_rotation_and_its_transposed_differ() {
    // The tests above transpose this matrix, which is not symmetric.
    let pose = read_pose(&views(demo())[3].path(&Layout::new(demo()), Domain::Pose)).unwrap();
    let r: DMat3 = pose.pose().world_from_camera;
    assert!(!r.abs_diff_eq(r.transpose(), 0.1));
}
