//! Reads the same points as `clouds.rs` in forms that need no other program to be written: PCD, text,
//! SemanticKITTI and Pointcept's folders. People's files of these forms are read too, if they are there.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

mod pcd;

use crate::clouds::{contents, expected, options};
use s3d_geom::PointCloud;
use s3d_geom::glam::{DVec3, Vec3, vec3};
use s3d_io::cloud::{AnnotationOptions, Annotations, NpyWriter, OnFault};
use s3d_io::scene::read_scene;
use s3d_label::{Class, Taxonomy};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

struct Point {
    position: [f32; 3],
    color: [u8; 3],
    class: u16,
    instance: u16,
}

/// The points of the fixtures.
fn points() -> Vec<Point> {
    let point = |i: u8| Point {
        position: [0.25 * f32::from(i), -0.5 * f32::from(i), 0.125 * f32::from(i % 7)],
        color: [i, 2 * i, 255 - i],
        class: [2, 6, 19][usize::from(i % 3)],
        instance: u16::from(10 + i / 15),
    };
    (0..60).map(point).collect()
}

/// A folder with one file.
struct File {
    dir: tempfile::TempDir,
    path: PathBuf,
}

fn file(name: &str, bytes: impl AsRef<[u8]>) -> File {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(&path, bytes).unwrap();
    File { dir, path }
}

fn open(path: &Path, options: &AnnotationOptions) -> Result<Annotations, String> {
    Annotations::open(&[path.to_owned()], options).map_err(|e| e.to_string())
}

fn read(name: &str, bytes: impl AsRef<[u8]>) -> Annotations {
    open(&file(name, bytes).path, &options()).unwrap_or_else(|e| panic!("{e}"))
}

/// The message for a file that is refused. It begins with the file's path.
fn refused(name: &str, bytes: impl AsRef<[u8]>, options: &AnnotationOptions) -> String {
    let file = file(name, bytes);
    let message = open(&file.path, options).expect_err(name);
    let rest = message.strip_prefix(&file.path.display().to_string());
    rest.unwrap_or_else(|| panic!("{message}")).to_owned()
}

fn all_points(found: &Annotations) -> u64 {
    let mut cloud = PointCloud::default();
    for instance in found.rooms.iter().flat_map(|r| &r.instances) {
        instance.read(&mut cloud).unwrap();
    }
    cloud.len() as u64
}

/// The points as text, with these names before them and these words between them.
fn text(names: &str, separator: &str, end: &str) -> String {
    let mut text = names.to_owned();
    for Point { position: [x, y, z], color: [r, g, b], class, instance } in points() {
        let words = [
            format!("{x:.8}"),
            format!("{y:.8}"),
            format!("{z:.8}"),
            r.to_string(),
            g.to_string(),
            b.to_string(),
            format!("{class}.000000"),
            format!("{instance}.000000"),
        ];
        text += &(words.join(separator) + end);
    }
    text
}

#[test]
fn text_is_read_as_programs_write_it() {
    let german = text("x;y;z;r;g;b;class;instance\n", ";", "\n").replace('.', ",");
    let semicolons = text("\"x\";\"y\";\"z\";\"r\";\"g\";\"b\";\"class\";\"instance\"\r\n", ";", ";\r\n");
    let utf16: Vec<u8> = [0xfeff]
        .into_iter()
        .chain(text("x\ty\tz\tr\tg\tb\tclass\tinstance\n", "\t", "\n").encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    for (name, bytes) in [
        ("a.asc", text("//X Y Z R G B Classification Instance\n60\n", " ", "\n").into_bytes()),
        ("a.txt", text("60\n//X Y Z R G B Classification Instance\n", " ", "\n").into_bytes()),
        ("a.xyz", text("# made by hand\n# x y z r g b label instance\n\n", "\t", "\n\n").into_bytes()),
        ("a.csv", text("X,Y,Z,Red,Green,Blue,label,instance\n", ", ", "\n").into_bytes()),
        ("a.csv", text("X,Y,Z,Red,Green,Blue,label,instance,\n", ",", ",\n").into_bytes()),
        ("a.dat", text("// x y z r g b class instance\n", "  ", "\n").into_bytes()),
        ("a.csv", semicolons.into_bytes()),
        ("a.csv", german.into_bytes()),
        ("a.txt", utf16),
    ] {
        let found = read(name, &bytes);
        assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO), "{name}");
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    }

    let columns = "x y z r g b class instance".split(' ').map(str::to_owned).collect();
    let named = AnnotationOptions { columns, ..options() };
    for head in ["", "60\n", "c1 c2 c3 c4 c5 c6 c7 c8\n"] {
        let found = open(&file("a.txt", text(head, " ", "\n")).path, &named).unwrap();
        assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO));
    }
}

#[test]
fn text_may_name_classes_and_have_colours_as_floats() {
    for (rgb, scale) in [("Rf Gf Bf", 255.0), ("R G B", 1.0)] {
        let mut text = format!("//X Y Z {rgb} label\n");
        for Point { position: [x, y, z], color, class, .. } in points() {
            let [r, g, b] = color.map(|v| format!("{:.8}", f64::from(v) / scale));
            let class = [(2, "floor"), (6, "wall"), (19, "chair")]
                .iter()
                .find(|(n, _)| *n == class);
            text += &format!("{x} {y} {z} {r} {g} {b} {}\n", class.unwrap().1);
        }
        let found = read("a.asc", text);
        let mut all: BTreeMap<(usize, u32), PointCloud> = BTreeMap::new();
        for ((class, _), cloud) in expected(DVec3::ZERO) {
            let one = all.entry((class, 1)).or_default();
            one.positions.extend(&cloud.positions);
            one.colors.extend(&cloud.colors);
        }
        assert_eq!(contents(&found, "office_1"), all, "{rgb}");
    }
}

#[test]
fn colours_of_16_bits_are_cut_to_8_also_with_decimals() {
    for (channel, expected) in [("65280", Some(255)), ("65280.000", Some(255)), ("255.500", None)] {
        let text = format!("X,Y,Z,Red,Green,Blue,label\n1,2,3,51200.000,0.000,{channel},floor\n");
        let text = if channel.contains('.') {
            text
        } else {
            text.replace(".000", "")
        };
        let Some(blue) = expected else {
            let message = refused("a.csv", text.replace("51200", "200"), &options());
            assert!(message.contains("line 2: `255.500` is no colour"), "{message}");
            continue;
        };
        let all = contents(&read("a.csv", text), "office_1");
        assert_eq!(all[&(Class::FLOOR.index(), 1)].colors, [[200, 0, blue]], "{channel}");
    }
}

#[test]
fn text_that_is_no_cloud_says_what_is_missing() {
    let plain = AnnotationOptions::default();
    let two = AnnotationOptions { columns: vec!["x".to_owned(), "y".to_owned()], ..plain.clone() };
    for (name, text, options, words) in [
        (
            "a.xyz",
            "1 2 3 4 5 6 7\n",
            &plain,
            ", line 1: is an ASCII cloud without names of columns: it has 7",
        ),
        ("a.csv", "1,2,3\n", &two, ", line 1: has 3 columns, and 2 are named (columns in [annotations])"),
        ("a.csv", "x,y,z\n1,2,3,4\n", &plain, ", line 2: has 4 columns, and line 1 names 3, x y z"),
        (
            "a.asc",
            "//X Y Z R G B\n1 2 3 4 5 6\n",
            &plain,
            "no column of classes; its columns are X Y Z R G B",
        ),
        ("a.pts", "1\n1 2 3 -7 4 5 6\n", &plain, "its columns are x y z intensity r g b"),
        ("a.pts", "1\n1 2 3 -7 4 5 6 7 8\n", &plain, "without names of columns: it has 9"),
        ("a.txt", "# nothing\n\n", &plain, "no line of it is a point"),
        ("a.txt", "x y z class\n1 2 3 \0\n", &plain, "line 2: is no text: it holds zero bytes"),
        ("office_1.txt", "x y z class\n3\n1 2 3 0\n", &plain, "states 3 points, and 1 are there"),
        (
            "office_1.txt",
            "x y z class\n1 2 3 wall\n1 2\n",
            &plain,
            ", line 3: 2 columns where 4 are due: `1 2`",
        ),
        ("office_1.txt", "# a\nx y z class\n# b\nx 2 3 wall\n", &plain, ", line 4: the coordinate `x` is no"),
        ("office_1.txt", "x y z class\n1 2 nan wall\n", &plain, ", line 2: the coordinates 1 2 NaN are not"),
    ] {
        let message = refused(name, text, options);
        assert!(message.contains(words), "{message}");
    }
    let endless = refused("a.txt", vec![b'1'; 300_000], &plain);
    assert!(endless.contains("line 1: a line of more than 65536 bytes"), "{endless}");
}

#[test]
fn clouds_without_instance_numbers_are_told() {
    let note = "a.csv: no instance numbers, so the points of a class in a room are one instance";
    for (text, is_told) in [("x,y,z,class\n0,0,0,2\n", true), ("x,y,z,class,inst\n0,0,0,2,4\n", false)] {
        let found = open(&file("a.csv", text).path, &options()).unwrap();
        assert_eq!(found.warnings.iter().any(|told| told.contains(note)), is_told, "{:?}", found.warnings);
    }
}

#[test]
fn pts_files_may_hold_several_scans() {
    let columns = "x y z intensity r g b class".split(' ').map(str::to_owned).collect();
    let named = AnnotationOptions { columns, ..options() };
    let text = "2\n0 0 0 -100 1 2 3 2\n1 0 0 -100 1 2 3 2\n1\n2 0 0 7 1 2 3 6\n";
    let found = open(&file("a.pts", text).path, &named).unwrap();
    assert_eq!((all_points(&found), found.warnings.len()), (3, 0));
    let more = open(&file("a.pts", text.replacen('2', "1", 1)).path, &named).unwrap_err();
    assert!(more.contains(", line 4: 1 columns where 8 are due: `1`"), "{more}");
    let found = open(&file("a.pts", "1\n0 0 0 -100 1 2 3 2\n1 0 0 -100 1 2 3 2\n").path, &named).unwrap();
    assert!(found.warnings[0].contains("states 1 points, and 2 are there; all are read"));
}

/// A scan of 2 × 2 points, turned by 90° about z and shifted.
const PTX: &str = "2\n2\n10 20 30\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n\
                   1 2 3 0.5 9 8 7 2\n0 0 0 0.5 0 0 0 0\n0 0 0 0.5 0 0 0 0\n0.5 0 -1 0.5 9 8 7 6\n";

#[test]
fn scans_of_a_ptx_are_placed_by_their_poses() {
    let columns = "x y z intensity r g b class".split(' ').map(str::to_owned).collect();
    let named = AnnotationOptions { columns, ..options() };
    let found = open(&file("a.ptx", format!("{PTX}{PTX}")).path, &named).unwrap();
    let all = contents(&found, "office_1");
    let floor = [vec3(8.0, 21.0, 33.0); 2];
    assert_eq!(all[&(Class::FLOOR.index(), 1)].positions, floor);
    assert_eq!(all[&(Class::WALL.index(), 1)].positions, [vec3(10.0, 20.5, 29.0); 2]);
    assert_eq!(all[&(Class::WALL.index(), 1)].colors, [[9, 8, 7]; 2]);
    let note = "4 of 8 points are 0 0 0, rays without a return; left out";
    assert!(found.warnings.len() == 1 && found.warnings[0].contains(note), "{:?}", found.warnings);

    for (from, to, words) in [
        ("2\n2\n", "2\n900\n", "ends after 4 of 1800 points of a scan"),
        ("2\n2\n", "2\nmany\n", "line 2: `many` is no number of columns or rows"),
        ("0 1 0\n", "0 1\n", "line 4: 3 numbers of a PTX header are due: `0 1`"),
        ("20 30 1\n", "20 nan 1\n", "line 10: 4 numbers of a PTX header"),
        ("2\n2\n", "18446744073709551615\n2\n", "claims 18446744073709551615 × 2 points"),
        ("1 2 3 0.5 9", "1 2 3 0.5", "line 12: 8 columns where 7 are due"),
    ] {
        let text = PTX.replacen(from, to, 1);
        let message = refused("a.ptx", &text, &named);
        assert!(message.contains(words) || message.contains("columns, and 8 are named"), "{message}");
    }
    assert!(refused("a.ptx", &PTX[..13], &named).contains("ends in the header of a scan"));
}

/// The two files of SemanticKITTI.
fn kitti() -> [Vec<u8>; 2] {
    let points = points();
    let position = |p: &Point| {
        [p.position[0], p.position[1], p.position[2], 0.5]
            .map(f32::to_le_bytes)
            .concat()
    };
    let label = |p: &Point| (u32::from(p.instance) << 16 | u32::from(p.class)).to_le_bytes();
    [points.iter().flat_map(position).collect(), points.iter().flat_map(label).collect()]
}

#[test]
fn points_and_labels_of_kitti_find_each_other() {
    let [bin, label] = kitti();
    let mut black = expected(DVec3::ZERO);
    black.values_mut().for_each(|cloud| cloud.colors.fill([0; 3]));
    for [points, labels] in [["a.bin", "a.label"], ["00/velodyne/000001.bin", "00/labels/000001.label"]] {
        let first = file(points, &bin);
        let second = first.dir.path().join(labels);
        fs::create_dir_all(second.parent().unwrap()).unwrap();
        let missing = open(&first.path, &options()).unwrap_err();
        assert!(missing.contains("its labels are missing: neither "), "{missing}");
        fs::write(&second, &label).unwrap();
        for named in [&first.path, &second] {
            let found = open(named, &options()).unwrap();
            assert_eq!(contents(&found, "office_1"), black, "{}", named.display());
            assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        }

        fs::write(&second, &label[..label.len() - 4]).unwrap();
        let message = open(&second, &options()).unwrap_err();
        assert!(
            message.contains("960 bytes of points, 16 each, and ") && message.contains("236"),
            "{message}"
        );
        assert!(message.contains(points) && message.contains(labels), "{message}");
    }

    let lone = refused("a.label", &label, &options());
    assert!(lone.contains("its points are missing: neither ") && lone.contains("a.bin"), "{lone}");
    let folder = file("00/velodyne/1.bin", &bin);
    fs::create_dir_all(folder.dir.path().join("00/labels")).unwrap();
    let message = open(&folder.dir.path().join("00"), &options()).unwrap_err();
    assert!(message.contains("is a sequence of SemanticKITTI"), "{message}");
}

#[test]
fn numbers_of_kitti_are_those_of_s3dis_and_no_instance_is_zero() {
    let label: Vec<u8> = [7u32, 2, 2 | 5 << 16].iter().flat_map(|l| l.to_le_bytes()).collect();
    let bin: Vec<u8> = (0..12u8).flat_map(|v| f32::from(v).to_le_bytes()).collect();
    let file = file("office_2.bin", &bin);
    fs::write(file.path.with_extension("label"), label).unwrap();
    let found = open(&file.path, &AnnotationOptions::default()).unwrap();
    let sources: Vec<String> = found.rooms[0].instances.iter().map(|i| i.source()).collect();
    let ends = ["the wall of office_2", "instance 5 of class 2 in office_2", "the table of office_2"];
    assert!(sources.iter().zip(ends).all(|(s, end)| s.ends_with(end)), "{sources:?}");
    assert!(found.warnings[0].contains("class numbers are taken for S3DIS's"), "{:?}", found.warnings);
}

/// Writes an array of rows.
fn npy(path: &Path, kind: &str, columns: u64, bytes: &[u8], size: usize) {
    let rows = (bytes.len() / size) as u64 / columns;
    let mut file = NpyWriter::create(path, kind, &[rows, columns]).unwrap();
    file.put(bytes).unwrap();
    file.finish().unwrap();
}

fn pointcept(dir: &Path) {
    fs::create_dir_all(dir).unwrap();
    let points = points();
    let coord: Vec<u8> = points
        .iter()
        .flat_map(|p| p.position.map(f32::to_le_bytes).concat())
        .collect();
    let color: Vec<u8> = points.iter().flat_map(|p| p.color).collect();
    // S3DIS's floor, wall and chair, and a point without a label.
    let number = |class: u16| {
        [(2, 1i16), (6, 2), (19, 8)]
            .iter()
            .find(|(c, _)| *c == class)
            .unwrap()
            .1
    };
    let segment: Vec<u8> = points.iter().flat_map(|p| number(p.class).to_le_bytes()).collect();
    let instance: Vec<u8> = points.iter().flat_map(|p| p.instance.to_le_bytes()).collect();
    npy(&dir.join("coord.npy"), "<f4", 3, &coord, 4);
    npy(&dir.join("color.npy"), "|u1", 3, &color, 1);
    npy(&dir.join("normal.npy"), "<f4", 3, &coord, 4);
    npy(&dir.join("segment.npy"), "<i2", 1, &segment, 2);
    npy(&dir.join("instance.npy"), "<i2", 1, &instance, 2);
}

#[test]
fn folders_of_arrays_are_rooms() {
    let dir = tempfile::tempdir().unwrap();
    let room = dir.path().join("Area_1-office_1");
    pointcept(&room);
    // One room, and a folder of rooms.
    for path in [&room, dir.path()] {
        let found = open(path, &AnnotationOptions::default()).unwrap();
        assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO));
        assert!(found.warnings.len() == 1, "{:?}", found.warnings);
        assert!(found.warnings[0].contains("places in the list of s3dis's classes"), "{:?}", found.warnings);
    }
    pointcept(&dir.path().join("Area_1-office_2"));
    let both = open(dir.path(), &AnnotationOptions::default()).unwrap();
    assert_eq!((both.rooms.len(), both.warnings.len()), (2, 1));

    // -1 is no label, whatever the classes are called.
    let segment: Vec<u8> = (0..60)
        .flat_map(|i| if i == 0 { -1i16 } else { 1 }.to_le_bytes())
        .collect();
    npy(&room.join("segment.npy"), "<i2", 1, &segment, 2);
    assert_eq!(all_points(&open(&room, &AnnotationOptions::default()).unwrap()), 59);
    let classes = [("1".to_owned(), Some(Class::WALL))].into();
    let named = AnnotationOptions { classes, ..AnnotationOptions::default() };
    assert_eq!(all_points(&open(&room, &named).unwrap()), 59);

    npy(&room.join("segment.npy"), "<i2", 1, &segment[..100], 2);
    let message = open(&room, &AnnotationOptions::default()).unwrap_err();
    assert!(message.contains("segment.npy has 50 rows, and coord.npy 60"), "{message}");
}

#[test]
fn arrays_of_scannet_have_places_in_its_benchmarks() {
    let dir = tempfile::tempdir().unwrap();
    npy(&dir.path().join("coord.npy"), "<f4", 3, &[0; 24], 4);
    npy(&dir.path().join("segment20.npy"), "<i2", 1, &[2, 0, 4, 0], 2);
    npy(&dir.path().join("segment200.npy"), "<i2", 1, &[1, 0, 0, 0], 2);
    for (taxonomy, expected) in [("scannet20", ["cabinet", "chair"]), ("scannet200", ["wall", "chair"])] {
        let taxonomy = Taxonomy::built_in(taxonomy).unwrap();
        let room = taxonomy.room("bedroom_1").ok();
        let options = AnnotationOptions { taxonomy, room, ..AnnotationOptions::default() };
        let found = open(dir.path(), &options).unwrap();
        let mut names: Vec<&str> = found.rooms[0].instances.iter().map(|i| i.class.name()).collect();
        names.sort_unstable_by_key(|name| *name == "chair");
        assert_eq!(names, expected);
    }
}

/// The labelled files of people, each with the same room: see its README.
#[test]
fn files_of_people_hold_their_room() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/hard-inputs/field");
    if !folder.is_dir() {
        eprintln!("skipped: {} is not there", folder.display());
        return;
    }
    for name in ["06-pcd", "07-cloudcompare-ascii", "10-semantickitti", "16-s3dis-control-char"] {
        let scene = read_scene(&folder.join(name).join("scene.toml")).unwrap();
        let found = Annotations::open(&scene.annotations, &scene.annotation_options).unwrap();
        assert_eq!(found.rooms.len(), 1, "{name}");
        let mut classes: BTreeMap<&str, usize> = BTreeMap::new();
        for instance in &found.rooms[0].instances {
            *classes.entry(instance.class.name()).or_default() += 1;
        }
        let expected = [("ceiling", 1), ("chair", 2), ("floor", 1), ("table", 1), ("wall", 4)];
        assert!(classes.into_iter().eq(expected), "{name}");
        assert_eq!(all_points(&found), 4368, "{name}");
        assert_eq!(found.rooms[0].room.to_string(), "office_1");
    }
}

#[test]
fn a_text_near_the_origin_of_a_far_frame_keeps_its_digits() {
    let text = "x y z class\n500000.125 5400000.0625 3 2\n";
    let offset_m = DVec3::new(500_000.0, 5_400_000.0, 0.0);
    let found = open(&file("a.xyz", text).path, &AnnotationOptions { offset_m, ..options() }).unwrap();
    let mut cloud = PointCloud::default();
    found.rooms[0].instances[0].read(&mut cloud).unwrap();
    assert_eq!(cloud.positions, [Vec3::new(0.125, 0.0625, 3.0)]);
}
