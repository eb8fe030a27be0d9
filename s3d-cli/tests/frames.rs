//! Points, scan locations and meshes in different frames, or in one frame far from the origin.

use crate::common;
use common::scan::{SMALL, Scan};
use common::{files, s3d_fails, s3d_ok, text};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Where the scan is moved: easting, northing, height.
const UTM: [f64; 3] = [500_000.0, 5_400_000.0, 300.0];
const UTM_LINE: &str = "offset_m = [500000.0, 5400000.0, 300.0]";

/// The annotated points of the scan, each with its class and its instance.
fn points(scan: &Scan) -> Vec<([f64; 3], &'static str, u32)> {
    let mut all = Vec::new();
    let instances =
        [("floor", 1), ("ceiling", 1), ("wall", 1), ("wall", 2), ("wall", 3), ("wall", 4), ("table", 1)];
    for (class, number) in instances {
        for line in fs::read_to_string(scan.annotation(&format!("{class}_{number}.txt")))
            .unwrap()
            .lines()
        {
            let mut words = line.split(' ').map(|w| w.parse().unwrap());
            all.push(([(); 3].map(|()| words.next().unwrap()), class, number));
        }
    }
    all
}

fn moved(p: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| p[k] + UTM[k])
}

/// Moves the points of the scan's annotations.
fn move_tree(scan: &Scan) {
    for path in files(&scan.file("Area_1")).into_keys() {
        let mut moved_lines = String::new();
        for line in fs::read_to_string(scan.file("Area_1").join(&path)).unwrap().lines() {
            let words: Vec<f64> = line.split(' ').map(|w| w.parse().unwrap()).collect();
            let [x, y, z] = moved([words[0], words[1], words[2]]);
            let _ = writeln!(moved_lines, "{x:.3} {y:.3} {z:.3} {} {} {}", words[3], words[4], words[5]);
        }
        scan.write(&format!("Area_1/{}", text(&path)), moved_lines);
    }
}

const CLASSES: [&str; 4] = ["floor", "ceiling", "wall", "table"];

/// Scene file entries for a cloud whose classes are numbers.
const CLASS_TABLE: &str = "room = \"office_1\"\n[annotations.classes]\n\
                           0 = \"floor\"\n1 = \"ceiling\"\n2 = \"wall\"\n3 = \"table\"\n";

/// The moved points as LAS 1.2, in millimetres from the header's offset.
fn las(scan: &Scan) -> Vec<u8> {
    let points = points(scan);
    let mut header = vec![0; 227];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, 2]);
    put(94, &227u16.to_le_bytes());
    put(96, &227u32.to_le_bytes());
    put(105, &20u16.to_le_bytes());
    put(107, &(points.len() as u32).to_le_bytes());
    for axis in 0..3 {
        put(131 + 8 * axis, &0.001f64.to_le_bytes());
        put(155 + 8 * axis, &UTM[axis].to_le_bytes());
        let of_axis = || points.iter().map(|(p, ..)| p[axis] + UTM[axis]);
        put(179 + 16 * axis, &of_axis().fold(f64::MIN, f64::max).to_le_bytes());
        put(187 + 16 * axis, &of_axis().fold(f64::MAX, f64::min).to_le_bytes());
    }
    for (p, class, number) in points {
        for v in p {
            header.extend(((v * 1000.0).round() as i32).to_le_bytes());
        }
        let class = CLASSES.iter().position(|c| *c == class).unwrap() as u8;
        header.extend([0, 0, 0, class, 0, 0]);
        header.extend((number as u16).to_le_bytes());
    }
    header
}

/// `info`, `export` and `plan` must fail with these words and write nothing.
fn refused(scan: &Scan, parts: &[&str]) {
    scan.fails(parts);
    s3d_fails(&["info", text(&scan.scene)], 1, parts);
    let plan = scan.dir.path().join("plan");
    s3d_fails(&["plan", text(&scan.scene), "-o", text(&plan)], 1, parts);
    assert!(!plan.exists());
}

const BOXES: [&str; 3] = [
    "points lie 54230",
    "between (500000.00, 5400000.00, 300.00) and (500004.00, 5400003.00, 302.50)",
    "the mesh between (0.00, 0.00, 0.00) and (4.00, 3.00, 2.50)",
];

#[test]
fn annotations_in_another_frame_are_refused_with_the_line_that_mends_it() {
    let home = Scan::new();
    home.exported();
    let home = files(&home.out());
    for kind in ["tree", "las"] {
        let scan = Scan::new();
        if kind == "tree" {
            move_tree(&scan);
        } else {
            scan.write("cloud.las", las(&scan));
            scan.use_annotations("cloud.las");
            scan.replace("scene.toml", "cloud.las\"\n", &format!("cloud.las\"\n{CLASS_TABLE}"));
        }
        refused(&scan, &[&BOXES[..], &[UTM_LINE, "scene file"]].concat());
        scan.replace("scene.toml", "[annotations]\n", &format!("[annotations]\n{UTM_LINE}\n"));
        scan.exported();
        let out = files(&scan.out());
        for (path, bytes) in &home {
            if path.starts_with("area_1/data")
                || path.starts_with("area_1/pano")
                || path.ends_with("semantic.obj")
            {
                assert!(bytes == &out[path], "{kind}: {} differs", path.display());
            }
        }
    }
}

#[test]
fn a_cloud_in_another_frame_is_refused_before_it_is_read() {
    let scan = Scan::new();
    // The last row is no point, but the cloud is refused before it is read.
    let mut ply = String::from(
        "ply\nformat ascii 1.0\nelement vertex 70001\nproperty double x\nproperty double y\n\
         property double z\n\
         property uchar class\nend_header\n",
    );
    let points = points(&scan);
    for i in 0..70_000 {
        let [x, y, z] = moved(points[i % points.len()].0);
        let _ = writeln!(ply, "{x} {y} {z} 2");
    }
    ply += "nan nan nan 2\n";
    scan.write("office_1.ply", ply);
    scan.use_annotations("office_1.ply");
    refused(&scan, &["office_1.ply: its points lie 54230", UTM_LINE]);
}

#[test]
fn locations_in_another_frame_are_refused() {
    let scan = Scan::new();
    scan.write(
        "cameras.csv",
        format!(
            "{},500002,5400001.2,301.5,0,0,0,1\n{},500003,5400000.8,301.4,0,0,0,1\n",
            common::UUID_A,
            common::UUID_B
        ),
    );
    refused(&scan, &["cameras.csv: the scan locations lie 54230", "transform = [[1, 0, 0, -500"]);
}

#[test]
fn a_part_of_the_points_elsewhere_is_no_other_frame() {
    let scan = Scan::new();
    let wall = fs::read_to_string(scan.annotation("wall_1.txt")).unwrap();
    scan.write("Area_1/office_1/Annotations/wall_1.txt", wall + "900 900 900 1 2 3\n");
    let info = common::s3d(&["info", text(&scan.scene)]);
    let told = String::from_utf8_lossy(&info.stdout);
    assert!(info.status.success() && told.contains("1 points are farther than 5 cm"), "{told}");
}

/// A number that is exact in `f64` both at home and in UTM.
fn snapped(v: f64) -> f64 {
    (v * 4096.0).round() / 4096.0
}

/// Moves mesh, points and locations by `at`. The scene file does not mention it.
fn move_all(scan: &Scan, at: [f64; 3]) {
    let numbers = |line: &str| -> Vec<f64> { line.split(' ').map(|w| snapped(w.parse().unwrap())).collect() };
    let mut obj = String::new();
    for line in fs::read_to_string(scan.file("room.obj")).unwrap().lines() {
        match line.strip_prefix("v ").map(numbers).as_deref() {
            Some(&[x, y, z]) => writeln!(obj, "v {} {} {}", x + at[0], y + at[2], z - at[1]).unwrap(),
            _ => writeln!(obj, "{line}").unwrap(),
        }
    }
    scan.write("room.obj", obj);
    for path in files(&scan.file("Area_1")).into_keys() {
        let mut text_of_points = String::new();
        for line in fs::read_to_string(scan.file("Area_1").join(&path)).unwrap().lines() {
            let n = numbers(line);
            let [x, y, z] = [n[0] + at[0], n[1] + at[1], n[2] + at[2]];
            writeln!(text_of_points, "{x} {y} {z} {} {} {}", n[3], n[4], n[5]).unwrap();
        }
        scan.write(&format!("Area_1/{}", text(&path)), text_of_points);
    }
    let mut list = String::new();
    for line in fs::read_to_string(scan.file("cameras.csv")).unwrap().lines() {
        let mut words: Vec<String> = line.split(',').map(str::to_owned).collect();
        for (word, at) in words[1..4].iter_mut().zip(at) {
            *word = (snapped(word.parse().unwrap()) + at).to_string();
        }
        list += &(words.join(",") + "\n");
    }
    scan.write("cameras.csv", list);
}

const OFFSET_JSON: &str = "[500000.0,5400000.0,300.0]";

/// Removes the statement of the offset from a file of an export.
fn without_offset(path: &Path, bytes: &[u8]) -> Vec<u8> {
    let comment = b"comment offset_m 500000.0 5400000.0 300.0: add it for the scan's own coordinates\n";
    let in_pose = format!(",\"world_offset_m\":{OFFSET_JSON}");
    let stated: &[u8] = match path.extension().and_then(|e| e.to_str()) {
        Some("ply") => comment,
        Some("json") if path.iter().any(|part| part == "pose") => in_pose.as_bytes(),
        _ => return bytes.to_vec(),
    };
    let at = bytes
        .windows(stated.len())
        .position(|w| w == stated)
        .unwrap_or_else(|| panic!("{}", path.display()));
    [&bytes[..at], &bytes[at + stated.len()..]].concat()
}

fn json(out: &Path, name: &str) -> serde_json::Value {
    serde_json::from_slice(&fs::read(out.join(name)).unwrap()).unwrap()
}

/// Compares an export of the scan in UTM with one at home.
fn assert_same(home: &Path, moved: &Path) {
    let (home, out) = (files(home), files(moved));
    assert!(home.keys().eq(out.keys()));
    for (path, bytes) in &home {
        let name = text(path);
        // These three hold checksums, or state the offset in another form.
        if !["manifest.json", "files.csv", "conventions.json"].contains(&name) {
            assert!(*bytes == without_offset(path, &out[path]), "{name} differs");
        }
    }
    let offset = serde_json::json!([5e5, 5.4e6, 300.0]);
    assert_eq!(json(moved, "manifest.json")["areas"][0]["offset_m"], offset);
    assert_eq!(json(moved, "conventions.json")["world"]["offset_m"]["1"], offset);
}

/// Scan and export at home.
fn at_home() -> Scan {
    let home = Scan::new();
    move_all(&home, [0.0; 3]);
    home.exported();
    let told = |name: &str| fs::read_to_string(home.out().join(name)).unwrap();
    assert!(!told("manifest.json").contains("offset_m") && !told("conventions.json").contains("offset_m"));
    home
}

#[test]
fn a_scan_in_utm_makes_the_same_data_set_by_itself_and_when_told() {
    let home = at_home();
    for said in [false, true] {
        let scan = Scan::new();
        move_all(&scan, UTM);
        if said {
            scan.replace("scene.toml", "[mesh]\n", &format!("[mesh]\n{UTM_LINE}\n"));
        }
        let log = scan.exported();
        assert!(log.contains("offset_m = [500000.0, 5400000.0, 300.0] is subtracted"), "{log}");
        assert_same(&home.out(), &scan.out());
        assert!(scan.exported().contains("nothing to do"));
        let info = common::s3d(&["info", text(&scan.scene)]);
        let told = String::from_utf8_lossy(&info.stdout).into_owned();
        assert!(told.contains("less offset_m = [500000.0, 5400000.0, 300.0]"), "{told}");
        assert!(told.contains("to (4.00, 3.00, 2.50), Z-up"), "{told}");
    }
}

#[test]
fn clouds_of_a_scan_in_utm_line_up_and_an_offset_of_their_own_wins() {
    let home = Scan::new();
    let images = |scan: &Scan| {
        let mut all = files(&scan.out().join("area_1/data/semantic"));
        all.extend(files(&scan.out().join("area_1/pano/semantic")));
        all
    };
    move_all(&home, [0.0; 3]);
    let cloud = las(&home);
    home.exported();
    for own in [false, true] {
        let scan = Scan::new();
        move_all(&scan, UTM);
        let mut bytes = cloud.clone();
        if own {
            // The header's offset is wrong: the cloud lies elsewhere.
            for (axis, at) in [7000.0, 8000.0, 9.0f64].into_iter().enumerate() {
                bytes[155 + 8 * axis..163 + 8 * axis].copy_from_slice(&at.to_le_bytes());
            }
        }
        scan.write("cloud.las", bytes);
        scan.use_annotations("cloud.las");
        let line = if own { "offset_m = [7000, 8000, 9]\n" } else { "" };
        scan.replace("scene.toml", "cloud.las\"\n", &format!("cloud.las\"\n{line}{CLASS_TABLE}"));
        scan.exported();
        assert_eq!(images(&scan), images(&home));
    }
}

/// Photogrammetry programs write the mesh near the origin, and its offset beside it.
#[test]
fn an_offset_beside_the_mesh_is_stated_and_joins_points_and_cameras() {
    let home = at_home();
    for moves_points in [false, true] {
        let scan = Scan::new();
        move_all(&scan, [0.0; 3]);
        scan.write("project_offset.xyz", "500000.0 5400000.0 300.0\n");
        if moves_points {
            move_tree(&scan);
        }
        let log = scan.exported();
        assert!(log.contains("project_offset.xyz: the scan's coordinates are the mesh's plus"), "{log}");
        assert_same(&home.out(), &scan.out());
    }

    // An offset that does not join them is no excuse.
    let scan = Scan::new();
    move_tree(&scan);
    scan.write("project_offset.xyz", "7000 8000 9\n");
    refused(&scan, &[&BOXES[..], &[UTM_LINE]].concat());
    scan.write("project_offset.xyz", "7000 8000\n");
    refused(&scan, &["project_offset.xyz: has 2 numbers: an offset is x y z"]);
}

#[test]
fn points_that_are_near_already_say_so() {
    let (home, scan) = (at_home(), Scan::new());
    move_all(&scan, UTM);
    for (path, bytes) in files(&home.file("Area_1")) {
        scan.write(&format!("Area_1/{}", text(&path)), bytes);
    }
    let line = "offset_m = [0.0, 0.0, 0.0]";
    refused(&scan, &[line, "the mesh between (0.00, 0.00, 0.00) and (4.00, 3.00, 2.50)"]);
    scan.replace("scene.toml", "[annotations]\n", &format!("[annotations]\n{line}\n"));
    scan.exported();
    assert_same(&home.out(), &scan.out());
}

#[test]
fn what_follows_an_export_keeps_the_offset() {
    let home = at_home();
    let scan = Scan::new();
    move_all(&scan, UTM);
    scan.exported();
    let (out, dir) = (scan.out(), scan.dir.path());
    s3d_ok(&["verify", text(&out)]);
    // The same from shards.
    let (plan, parts, merged) = (dir.join("plan"), dir.join("parts"), dir.join("merged"));
    s3d_ok(&["plan", text(&scan.scene), "-o", text(&plan), "--size", "32", "--views", "3"]);
    for shard in ["1/2", "2/2"] {
        let mut args = scan.args(&parts);
        args.extend(["--shard", shard, "--plan", text(&plan)]);
        s3d_ok(&args);
    }
    s3d_ok(&["merge", text(&parts), "-o", text(&merged)]);
    assert!(files(&merged) == files(&out));
    // A new export of the export is still in that frame.
    let again = dir.join("again");
    let mut args = vec!["export", text(&out), "-o", text(&again)];
    let area = out.join("area_1");
    args[1] = text(&area);
    args.extend(SMALL);
    s3d_ok(&args);
    assert_eq!(json(&again, "conventions.json")["world"], json(&out, "conventions.json")["world"]);
    // Packages state the offset.
    for kind in ["colmap", "nerfstudio", "webdataset"] {
        let place = dir.join(kind);
        s3d_ok(&["pack", text(&out), "--to", kind, "-o", text(&place)]);
        let notes = json(&place, "pack.json").to_string();
        assert!(notes.contains("its scan less offset_m = [500000.0, 5400000.0, 300.0]"), "{notes}");
        if kind != "webdataset" {
            // Paths of images are relative.
            let plain = home.dir.path().join(kind);
            s3d_ok(&["pack", text(&home.out()), "--to", kind, "-o", text(&plain)]);
            let (mut here, mut there) = (files(&place), files(&plain));
            [&mut here, &mut there]
                .into_iter()
                .for_each(|all| drop(all.remove(Path::new("pack.json"))));
            assert!(here == there, "{kind}");
        }
    }
    // Coordinate images that are made again are in the same frame.
    s3d_ok(&["xyz", text(&out), "--type", "float", "--overwrite"]);
    assert_eq!(json(&out, "conventions.json")["world"]["offset_m"]["1"], serde_json::json!(UTM));
    s3d_ok(&["verify", text(&out)]);
    // `verify` finds a pose that has another offset or none.
    let folder = out.join("area_1/pano/pose");
    let pose = folder.join(files(&folder).into_keys().next().unwrap());
    let content = fs::read_to_string(&pose).unwrap();
    fs::write(&pose, content.replace("5400000.0", "5400001.0")).unwrap();
    s3d_fails(&["verify", text(&out)], 1, &[]);
    let found = common::s3d(&["verify", text(&out)]);
    assert!(
        String::from_utf8_lossy(&found.stdout)
            .contains("world_offset_m is Some([500000.0, 5400001.0, 300.0])")
    );
}

#[test]
fn a_mesh_in_utm_is_sampled_and_rendered_near_the_origin() {
    let (home, scan) = (Scan::new(), Scan::new());
    move_all(&home, [0.0; 3]);
    move_all(&scan, UTM);
    let sampled = |scan: &Scan| {
        let ply = scan.file("points.ply");
        s3d_ok(&["sample", text(&scan.file("room.obj")), "-o", text(&ply), "--points", "500"]);
        fs::read(ply).unwrap()
    };
    let (near, far) = (sampled(&home), sampled(&scan));
    assert!(near == without_offset(Path::new("points.ply"), &far));
    let rendered = |scan: &Scan, at: &str| {
        let out = scan.file("view");
        s3d_ok(&["render", text(&scan.file("room.obj")), "--at", at, "--size", "32", "-o", text(&out)]);
        files(&out)
    };
    let near = rendered(&home, "2,1.5,1.5");
    let mut far = rendered(&scan, "500002,5400001.5,301.5");
    let camera: serde_json::Value =
        serde_json::from_slice(&far.remove(Path::new("camera.json")).unwrap()).unwrap();
    assert_eq!(camera["world_offset_m"], serde_json::json!(UTM));
    assert_eq!(camera["camera_location"], serde_json::json!([2.0, 1.5, 1.5]));
    assert!(far.iter().all(|(path, bytes)| near[path] == *bytes));
}
