//! Broken, hostile or absurd input: every export of it ends soon, with exit code 1 and a message that names
//! the file. No content of a file makes the program write outside OUT.

use crate::common;
use common::scan::{SMALL, Scan, png_that_claims, run, wait};
use common::{UUID_A, UUID_B, text};
use s3d_io::mesh::MeshFormat;
use std::fs;
use std::path::Path;
use std::process::Command;

/// A JPEG file that ends after a header with this size.
fn jpeg_that_claims(width: u16, height: u16) -> Vec<u8> {
    let mut jpeg = b"\xff\xd8\xff\xe0\0\x10JFIF\0\x01\x01\0\0\x01\0\x01\0\0\xff\xc0\0\x11\x08".to_vec();
    jpeg.extend(height.to_be_bytes());
    jpeg.extend(width.to_be_bytes());
    jpeg.extend(b"\x03\x01\x11\0\x02\x11\0\x03\x11\0\xff\xda\0\x0c\x03\x01\0\x02\0\x03\0\0\x3f\0\0\xff\xd9");
    jpeg
}

#[test]
fn a_texture_bomb_is_refused_with_its_size_and_the_limit() {
    for (name, bytes) in
        [("bomb.png", png_that_claims(60_000, 60_000)), ("bomb.jpg", jpeg_that_claims(60_000, 60_000))]
    {
        let scan = Scan::new();
        scan.write(name, bytes);
        scan.replace("room.mtl", "newmtl floor\n", &format!("newmtl floor\nmap_Kd {name}\n"));
        scan.refused(&[name, "60000 × 60000 pixels", "536870912"]);
    }
    // Many textures, none of them too large alone.
    let scan = Scan::new();
    let (mut obj, mut mtl) = (fs::read_to_string(scan.file("room.obj")).unwrap(), String::new());
    // Any bytes may follow the end of an image. They make this file large enough for the size that its header
    // claims.
    let mut large = png_that_claims(23_000, 23_000);
    large.resize(70_000, 0);
    scan.write("large.png", large);
    for i in 0..20 {
        fs::copy(scan.file("large.png"), scan.file(&format!("large_{i}.png"))).unwrap();
        mtl += &format!("newmtl m{i}\nmap_Kd large_{i}.png\n");
        obj += &format!("usemtl m{i}\nf 1 2 3\n");
    }
    scan.write("room.obj", obj);
    scan.write("room.mtl", mtl);
    scan.refused(&["large_16.png", "8589934592"]);
    // An image that claims more pixels than its bytes can hold counts as damaged.
    let scan = Scan::new();
    scan.write("claim.png", png_that_claims(16_000, 16_000));
    scan.replace("room.mtl", "newmtl floor\n", "newmtl floor\nmap_Kd claim.png\n");
    let log = scan.exported();
    assert!(log.contains("claim.png claims 16000 × 16000 pixels in"), "{log}");
}

#[test]
fn one_bad_line_among_many_is_named() {
    // The long line and the lines before it are read as a stream. (A file of a hundred million lines: see
    // `s3d_io::formats`, "Limits".)
    let scan = Scan::new();
    let path = "Area_1/office_1/Annotations/floor_1.txt";
    let mut points = "1.234 2.345 0.001 120 130 140\n".repeat(1_500_000);
    points += "1.234 2.345 0.001 120 130 14x\n";
    scan.write(path, points);
    scan.refused(&["floor_1.txt, line 1500001", "14x"]);
}

#[test]
fn a_mesh_of_degenerate_faces_only_is_refused() {
    let scan = Scan::new();
    let mut obj = "v 0 0 0\nv 1 0 0\nv 2 0 0\n".to_owned();
    for _ in 0..1000 {
        obj += "f 1 2 3\nf 1 1 2\nf 2 2 2\n";
    }
    scan.write("room.obj", obj);
    scan.refused(&["room.obj", "no face"]);
}

#[test]
fn rooms_that_overlap_are_exported_and_told() {
    let scan = Scan::new();
    let (from, to) = (scan.file("Area_1/office_1/Annotations"), scan.file("Area_1/lobby_1/Annotations"));
    fs::create_dir_all(&to).unwrap();
    for name in ["floor_1.txt", "ceiling_1.txt", "wall_1.txt"] {
        fs::copy(from.join(name), to.join(name)).unwrap();
    }
    let log = scan.exported();
    assert!(log.contains("rooms lobby_1 and office_1 overlap: 100 % of the floor of"), "{log}");
    let info = common::s3d(&["info", text(&scan.scene)]);
    assert!(String::from_utf8_lossy(&info.stdout).contains("overlap: 100 %"));
}

#[test]
fn a_camera_inside_a_wall_is_told() {
    let scan = Scan::new();
    scan.write("cameras.csv", format!("{UUID_A},2,1.5,1.5,0,0,0,1\n{UUID_B},0.004,1.5,1.5,0,0,0,1\n"));
    let log = scan.exported();
    assert!(log.contains(&format!("location {UUID_B} is 4 mm from a surface")), "{log}");
    assert!(!log.contains(&format!("location {UUID_A} is")), "{log}");
}

/// Names of files of every kind that is read, by the part of the scan that they make up. Meshes are in
/// [`MeshFormat::ALL`].
const ANNOTATIONS: [&str; 8] =
    ["a.ply", "a.npy", "a.npz", "a.las", "a.laz", "a.e57", "a.mat", "scene0000_00.aggregation.json"];
const CAMERAS: [&str; 4] = ["c.csv", "images.txt", "images.bin", "transforms.json"];

/// Lets `make` put each kind of file into a scan of its own. The export must refuse each scan and name the
/// file.
fn every_kind_is_refused(make: impl Fn(&Path), parts: &[&str]) {
    type Choose = fn(&Scan, &str);
    let meshes: Vec<String> = MeshFormat::ALL
        .iter()
        .flat_map(|format| format.endings)
        .map(|ending| format!("m.{ending}"))
        .collect();
    let meshes: Vec<&str> = meshes.iter().map(String::as_str).collect();
    let kinds: [(&[&str], Choose); 3] =
        [(&meshes, Scan::use_mesh), (&ANNOTATIONS, Scan::use_annotations), (&CAMERAS, Scan::use_cameras)];
    for (names, choose) in kinds {
        for name in names {
            let scan = Scan::new();
            make(&scan.file(name));
            choose(&scan, name);
            scan.refused(&[&[*name][..], parts].concat());
        }
    }
    for name in ["scene.toml", "room.obj", "cameras.csv", "Area_1/office_1/Annotations/floor_1.txt"] {
        let scan = Scan::new();
        fs::remove_file(scan.file(name)).unwrap();
        make(&scan.file(name));
        let file = name.rsplit('/').next().unwrap();
        if scan.file(name).is_dir() && file == "floor_1.txt" {
            // Anything but files in the folders of annotations is left out.
            assert!(scan.exported().contains("floor_1.txt: not a file of points, left out"));
        } else {
            scan.refused(&[file]);
        }
    }
}

#[test]
fn empty_files_are_refused() {
    every_kind_is_refused(|path| fs::write(path, b"").unwrap(), &[]);
}

#[test]
fn folders_in_place_of_files_are_refused() {
    every_kind_is_refused(|path| fs::create_dir(path).unwrap(), &[]);
}

#[test]
fn files_of_zeros_and_of_noise_are_refused() {
    every_kind_is_refused(|path| fs::write(path, [0; 5000]).unwrap(), &[]);
    let mut state = 1u32;
    let noise: Vec<u8> = (0..5000)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        })
        .collect();
    every_kind_is_refused(|path| fs::write(path, &noise).unwrap(), &[]);
}

#[cfg(unix)]
#[test]
fn links_that_lead_nowhere_are_refused() {
    let circle = |path: &Path| std::os::unix::fs::symlink(path.file_name().unwrap(), path).unwrap();
    every_kind_is_refused(circle, &[]);
    let scan = Scan::new();
    fs::remove_dir_all(scan.file("Area_1/office_1/Annotations")).unwrap();
    circle(&scan.file("Area_1/office_1/Annotations"));
    scan.refused(&["Area_1/office_1"]);
    // A texture that cannot be opened is left out; the mesh is drawn without it.
    let scan = Scan::new();
    circle(&scan.file("wall.png"));
    scan.replace("room.mtl", "newmtl floor\n", "newmtl floor\nmap_Kd wall.png\n");
    assert!(scan.exported().contains("wall.png"));
}

/// A pipe without a writer: a program that opens it waits for ever.
#[cfg(target_os = "linux")]
#[test]
fn pipes_in_place_of_files_are_refused() {
    let pipe = |path: &Path| {
        let made = Command::new("mkfifo").arg(path).status();
        assert!(made.unwrap().success(), "mkfifo belongs to every Linux");
    };
    every_kind_is_refused(pipe, &[]);
    let scan = Scan::new();
    let data_set = scan.dir.path().join("data");
    fs::create_dir(&data_set).unwrap();
    pipe(&data_set.join("manifest.json"));
    for args in
        [&["stats", text(&data_set)][..], &["sample", text(&data_set.join("manifest.json")), "-o", "x.ply"]]
    {
        assert_eq!(run(args).0, Some(1));
    }
}

/// Unreadable files. The superuser may read everything, so for it the binary runs as another user.
#[cfg(target_os = "linux")]
#[test]
fn files_that_may_not_be_read_are_refused() {
    use std::os::unix::fs::{PermissionsExt, chown};
    use std::os::unix::process::CommandExt;
    const NOBODY: u32 = 65_534;
    let allow = |path: &Path, mode| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    for name in
        ["scene.toml", "room.obj", "room.mtl", "cameras.csv", "Area_1/office_1/Annotations/floor_1.txt"]
    {
        let scan = Scan::new();
        allow(scan.dir.path(), 0o755);
        let binary = scan.dir.path().join("s3d");
        fs::copy(env!("CARGO_BIN_EXE_s3d"), &binary).unwrap();
        allow(&scan.file(name), 0);
        let out = scan.dir.path().join("home/out");
        fs::create_dir(scan.dir.path().join("home")).unwrap();
        let mut command = Command::new(&binary);
        command
            .args(["export", text(&scan.scene), "-o", text(&out)])
            .args(SMALL);
        if fs::File::open(scan.file(name)).is_ok() {
            chown(scan.dir.path().join("home"), Some(NOBODY), Some(NOBODY)).unwrap();
            command.uid(NOBODY).gid(NOBODY);
        }
        let (code, log) = wait(&mut command);
        // The export must fail: without its material library the mesh would be drawn gray.
        assert_eq!(code, Some(1), "{name}: {log}");
        assert!(log.contains(name.rsplit('/').next().unwrap()) && log.contains("ermission denied"), "{log}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn names_that_are_no_text_are_no_trouble() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let odd = OsStr::from_bytes(b"a\xff\xfe.txt");
    let scan = Scan::new();
    fs::write(scan.file("Area_1/office_1/Annotations").join(odd), "1 2 3 4 5 6\n").unwrap();
    scan.refused(&["Annotations/a", "names no instance"]);
    // The folder of the scan may have any name.
    let scan = Scan::new();
    let moved = scan.dir.path().join(OsStr::from_bytes(b"sc\xffan"));
    fs::rename(scan.file(""), &moved).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_s3d"));
    command
        .arg("export")
        .arg(moved.join("scene.toml"))
        .arg("-o")
        .arg(scan.out())
        .args(SMALL);
    let (code, log) = wait(&mut command);
    assert_eq!(code, Some(0), "{log}");
}

#[test]
fn deep_nesting_is_refused() {
    let deep = |open: &str| open.repeat(100_000);
    for (name, content) in [
        ("transforms.json", deep("[")),
        ("transforms.json", format!("{{\"frames\":{}", deep("{\"a\":"))),
        ("images.txt", deep("[")),
    ] {
        let scan = Scan::new();
        scan.write(name, content);
        scan.use_cameras(name);
        scan.refused(&[name]);
    }
    for (name, content) in [
        ("m.gltf", deep("[")),
        ("m.gltf", format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{}", deep("["))),
    ] {
        let scan = Scan::new();
        scan.write(name, content);
        scan.use_mesh(name);
        scan.refused(&[name]);
    }
    // A chain of nested nodes, as deep as a file may make it.
    let nodes: Vec<String> = (1..50_000).map(|n| format!("{{\"children\":[{n}]}}")).collect();
    let scan = Scan::new();
    let nodes = format!("{},{{}}", nodes.join(","));
    scan.write(
        "m.gltf",
        format!("{{\"asset\":{{\"version\":\"2.0\"}},\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{nodes}]}}"),
    );
    scan.use_mesh("m.gltf");
    scan.refused(&["m.gltf", "no mesh"]);
    for content in [format!("a = {}", deep("[")), format!("a = {}", deep("{a="))] {
        let scan = Scan::new();
        scan.write("scene.toml", content);
        scan.refused(&["scene.toml"]);
    }
    let scan = Scan::new();
    scan.write("scene0000_00.aggregation.json", deep("{\"segGroups\":["));
    scan.use_annotations("scene0000_00.aggregation.json");
    scan.refused(&["scene0000_00.aggregation.json"]);
}

#[test]
fn coordinates_that_are_none_are_refused() {
    for bad in ["nan", "inf", "-inf", "1e39", "1e999"] {
        let scan = Scan::new();
        scan.replace("room.obj", "v 0 0 -0\n", &format!("v {bad} 0 0\n"));
        scan.refused(&["room.obj, line", bad]);
        let scan = Scan::new();
        scan.replace("Area_1/office_1/Annotations/floor_1.txt", "0.100 ", &format!("{bad} "));
        scan.refused(&["floor_1.txt, line 1", bad]);
    }
    for bad in ["nan", "inf", "1e999", "1e8", "-1e300"] {
        let scan = Scan::new();
        scan.write("cameras.csv", format!("{UUID_A},{bad},1,1,0,0,0,1\n"));
        scan.refused(&["cameras.csv, line 1"]);
    }
}

#[test]
fn enormous_and_tiny_numbers_are_no_trouble() {
    // Finite but absurd coordinates: a mesh as large as floats allow, points as far apart and as close
    // together as floats allow.
    for (name, from, to) in [
        ("room.obj", "v 0 0 -0\n", "v -3e38 -3e38 -3e38\n"),
        ("room.obj", "v 0 0 -0\n", "v 1e-44 1e-44 -1e-44\n"),
        ("Area_1/office_1/Annotations/floor_1.txt", "0.100 ", "3e38 "),
        ("Area_1/office_1/Annotations/floor_1.txt", "0.100 ", "1e-44 "),
        ("Area_1/office_1/Annotations/table_1.txt", "0.700 ", "-3e38 "),
    ] {
        let scan = Scan::new();
        scan.replace(name, from, to);
        let out = scan.out();
        let mut args = vec!["export", text(&scan.scene), "-o", text(&out)];
        args.extend(SMALL);
        let (code, log) = run(&args);
        assert!(code == Some(0) || log.contains("room.obj") || log.contains("_1.txt"), "{name} {to}: {log}");
    }
    for (from, to) in
        [("area = 1", "area = 4294967296"), ("area = 1", "area = -1"), ("area = 1", "area = 1e9")]
    {
        let scan = Scan::new();
        scan.replace("scene.toml", from, to);
        scan.refused(&["scene.toml, line 1"]);
    }
}

#[test]
fn counts_that_a_header_claims_are_not_believed() {
    const HUGE: [&str; 3] = ["4294967294", "1000000000000", "18446744073709551615"];
    for count in HUGE {
        let head = format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\n");
        let xyz = "property float x\nproperty float y\nproperty float z\n";
        let scan = Scan::new();
        scan.write(
            "m.ply",
            format!("{head}{xyz}element face {count}\nproperty list uchar int vertex_indices\nend_header\n"),
        );
        scan.use_mesh("m.ply");
        scan.refused(&["m.ply"]);
        let scan = Scan::new();
        scan.write("a.ply", format!("{head}{xyz}property int label\nend_header\n"));
        scan.use_annotations("a.ply");
        scan.refused(&["a.ply"]);
        let mut npy =
            format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({count}, 8), }}").into_bytes();
        npy.resize(118, b' ');
        let scan = Scan::new();
        scan.write("a.npy", [&b"\x93NUMPY\x01\0\x76\0"[..], &npy].concat());
        scan.use_annotations("a.npy");
        scan.refused(&["a.npy"]);
    }
    let scan = Scan::new();
    scan.write("images.bin", u64::MAX.to_le_bytes());
    scan.use_cameras("images.bin");
    scan.refused(&["images.bin"]);
    let scan = Scan::new();
    let accessor = "{\"componentType\":5126,\"count\":9000000000000000000,\"type\":\"MAT4\"}";
    scan.write(
        "m.gltf",
        format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{{\"mesh\":0}}],\
             \"meshes\":[{{\"primitives\":[{{\"attributes\":\
             {{\"POSITION\":0}},\"indices\":0}}]}}],\"accessors\":[{accessor}],\
             \"buffers\":[{{\"byteLength\":9000000000}}]}}"
        ),
    );
    scan.use_mesh("m.gltf");
    scan.refused(&["m.gltf"]);
}
