//! Points, scan locations and meshes that are in different frames, or in one that is far from the origin.

mod common;

use common::scan::{SMALL, Scan};
use common::{files, s3d_fails, s3d_ok, text};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Where the scan is moved: easting, northing, height.
const UTM: [f64; 3] = [500_000.0, 5_400_000.0, 300.0];
const UTM_LINE: &str = "offset_m = [500000.0, 5400000.0, 300.0]";

/// The scan's annotated points, each with the word of its class and its instance.
fn points(scan: &Scan) -> Vec<([f64; 3], &'static str, u32)> {
    let mut all = Vec::new();
    let instances =
        [("floor", 1), ("ceiling", 1), ("wall", 1), ("wall", 2), ("wall", 3), ("wall", 4), ("table", 1)];
    for (class, number) in instances {
        for line in fs::read_to_string(scan.annotation(&format!("{class}_{number}.txt"))).unwrap().lines() {
            let mut words = line.split(' ').map(|w| w.parse().unwrap());
            all.push(([(); 3].map(|()| words.next().unwrap()), class, number));
        }
    }
    all
}

fn moved(p: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| p[k] + UTM[k])
}

/// Moves the points of the scan's tree.
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

/// What a scene file says of a cloud whose classes are numbers.
const CLASS_TABLE: &str = "room = \"office_1\"\n[annotations.classes]\n0 = \"floor\"\n1 = \"ceiling\"\n2 = \"wall\"\n3 = \"table\"\n";

/// The moved points as LAS 1.2, millimetres from the offset of the header.
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

/// `info`, `export` and `plan` fail with these words and write nothing.
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
    // Its last row is no point, which nobody finds out.
    let mut ply = String::from(
        "ply\nformat ascii 1.0\nelement vertex 70001\nproperty double x\nproperty double y\nproperty double z\n\
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
    let mut args = vec!["info", text(&scan.scene)];
    s3d_ok(&args);
    let out = scan.out();
    args = vec!["export", text(&scan.scene), "-o", text(&out)];
    args.extend(SMALL);
    s3d_ok(&args);
    assert!(Path::new(&out).join("manifest.json").is_file());
}
