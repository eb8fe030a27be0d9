//! Reads files of annotated points that numpy, laspy, plyfile and pye57 wrote, and one in ScanNet's layout:
//! see fixtures/clouds/README.md.

use s3d_geom::PointCloud;
use s3d_geom::glam::{DVec3, Vec3, vec3};
use s3d_io::cloud::{AnnotationOptions, Annotations, OnFault};
use s3d_io::{Error, Result};
use s3d_label::{Class, Taxonomy};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const CLASSES: [Class; 3] = [Class::FLOOR, Class::WALL, Class::CHAIR];

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures/clouds")
        .join(name)
}

pub(crate) fn options() -> AnnotationOptions {
    let classes = [("2", Class::FLOOR), ("6", Class::WALL), ("19", Class::CHAIR)];
    AnnotationOptions {
        room: Some("office_1".parse().unwrap()),
        classes: classes
            .into_iter()
            .map(|(key, class)| (key.to_owned(), Some(class)))
            .collect(),
        ..AnnotationOptions::default()
    }
}

fn open(name: &str, options: &AnnotationOptions) -> Result<Annotations> {
    Annotations::open(&[fixture(name)], options)
}

/// The points that the fixtures' script wrote, less `offset`, by class and number.
pub(crate) fn expected(offset: DVec3) -> BTreeMap<(usize, u32), PointCloud> {
    let mut all: BTreeMap<(usize, u32), PointCloud> = BTreeMap::new();
    for i in 0..60u8 {
        let f = f32::from(i);
        let cloud = all
            .entry((CLASSES[usize::from(i % 3)].index(), u32::from(i / 15) + 1))
            .or_default();
        let position = vec3(0.25 * f, -0.5 * f, 0.125 * f32::from(i % 7));
        cloud.positions.push((position.as_dvec3() - offset).as_vec3());
        cloud.colors.push([i, 2 * i, 255 - i]);
    }
    all
}

/// The instances of the only room, with their points.
pub(crate) fn contents(annotations: &Annotations, room: &str) -> BTreeMap<(usize, u32), PointCloud> {
    assert_eq!(annotations.rooms.len(), 1, "{annotations:?}");
    assert_eq!(annotations.rooms[0].room.to_string(), room);

    let read = |i: &s3d_io::cloud::AnnotatedInstance| {
        let mut cloud = PointCloud::default();
        assert_eq!(i.read(&mut cloud).unwrap().count, 0);
        // The pose of an E57 scan is a product of rounded numbers: 0 comes out as 1e-16.
        for p in &mut cloud.positions {
            *p = Vec3::select(p.abs().cmplt(Vec3::splat(1e-12)), Vec3::ZERO, *p);
        }
        ((i.class.index(), i.number), cloud)
    };
    annotations.rooms[0].instances.iter().map(read).collect()
}

const NUMBERED: [&str; 9] = [
    "1_2_format_3.las",
    "1_2_format_2.laz",
    "1_4_format_7.las",
    "1_4_format_7.laz",
    "ascii.ply",
    "little.ply",
    "big.ply",
    "columns.npz",
    "two_scans.e57",
];

#[test]
fn every_kind_of_file_holds_the_same_points() {
    for name in NUMBERED {
        let found = open(name, &options()).unwrap();
        assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO), "{name}");
        let sources: Vec<String> = found.rooms[0].instances.iter().map(|i| i.source()).collect();
        assert!(sources[0].ends_with(&format!("{name}, instance 10 of class 2 in office_1")), "{sources:?}");
        let invalid = name == "two_scans.e57";
        assert_eq!(found.warnings.len(), usize::from(invalid), "{:?}", found.warnings);
        if invalid {
            assert!(found.warnings[0].contains("1 of 61 points are marked invalid"));
        }
    }
}

#[test]
fn names_of_classes_need_no_table() {
    let options = AnnotationOptions { classes: BTreeMap::new(), ..options() };
    for name in ["structured.npy", "names.npz", "scene0000_00", "scene0000_00/scene0000_00.aggregation.json"]
    {
        let found = open(name, &options).unwrap();
        assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO), "{name}");
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        assert_eq!(found.rooms[0].instances[0].are_vertices(), name.starts_with("scene"));
    }

    // The reader's table of categories gives ScanNet's word its class; the user's table comes first.
    let classes = BTreeMap::from([("office chair".to_owned(), None)]);
    let found = open("scene0000_00", &AnnotationOptions { classes, ..options.clone() }).unwrap();
    assert_eq!(contents(&found, "office_1").len(), 8);
}

#[test]
fn words_and_numbers_mean_what_the_taxonomy_says() {
    /// The classes of a file's instances under a built-in taxonomy, each with its class of S3DIS.
    fn classes_of(
        name: &str,
        taxonomy: &str,
    ) -> std::result::Result<Vec<(&'static str, &'static str)>, String> {
        let taxonomy = Taxonomy::built_in(taxonomy).unwrap();
        let room = taxonomy.room("bedroom_1").ok();
        let options = AnnotationOptions { taxonomy, room, ..Default::default() };
        let found = open(name, &options).map_err(|e| e.to_string())?;
        assert_eq!(found.taxonomy, options.taxonomy);
        assert_eq!(found.rooms[0].room.to_string(), "bedroom_1");
        let classes: BTreeSet<Class> = found.rooms[0].instances.iter().map(|i| i.class).collect();
        Ok(classes.into_iter().map(|c| (c.name(), c.s3dis().name())).collect())
    }

    // "floor", "wall" and "office chair". The reader has a table of words for S3DIS.
    let words = [("wall", "wall"), ("floor", "floor"), ("chair", "chair")];
    assert_eq!(classes_of("scene0000_00", "scannet20").unwrap(), words);
    assert_eq!(classes_of("scene0000_00", "nyu40").unwrap(), words);
    let own = [("wall", "wall"), ("floor", "floor"), ("officeChair", "chair")];
    assert_eq!(classes_of("scene0000_00", "scannet200").unwrap(), own);

    // 2, 6 and 19 are NYU's floor, sofa and mirror. ScanNet's benchmark leaves out the last.
    for name in NUMBERED {
        let nyu = [("floor", "floor"), ("sofa", "sofa"), ("mirror", "clutter")];
        assert_eq!(classes_of(name, "nyu40").unwrap(), nyu, "{name}");
        assert_eq!(classes_of(name, "scannet20").unwrap(), nyu[..2], "{name}");
        let matterport = [("floor", "floor"), ("picture", "clutter"), ("stool", "chair")];
        assert_eq!(classes_of(name, "matterport40").unwrap(), matterport, "{name}");
        let scannet = [("chair", "chair"), ("couch", "sofa"), ("monitor", "clutter")];
        assert_eq!(classes_of(name, "scannet200").unwrap(), scannet, "{name}");
    }
}

#[test]
fn plain_arrays_are_rooms_of_s3dis_or_what_is_said() {
    let found = open("Area_1_office_1.npy", &AnnotationOptions::default()).unwrap();
    assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO));
    assert!(
        found.warnings.len() == 1 && found.warnings[0].contains("x y z r g b class instance"),
        "{:?}",
        found.warnings
    );

    let columns = "x y z r g b instance class".split(' ').map(str::to_owned).collect();
    let message =
        open("Area_1_office_1.npy", &AnnotationOptions { columns, ..Default::default() }).unwrap_err();
    assert!(message.to_string().contains("\"10\" (15 points), \"11\" (15 points)"), "{message}");

    let columns = vec!["x".to_owned()];
    let message =
        open("Area_1_office_1.npy", &AnnotationOptions { columns, ..Default::default() }).unwrap_err();
    assert!(message.to_string().contains("has 8 columns, and 1 are named"), "{message}");
}

#[test]
fn columns_can_be_named() {
    let point_source = AnnotationOptions { instance_column: Some("point_source_id".into()), ..options() };
    // In the 1.4 files point_source_id is 0 everywhere.
    assert_eq!(contents(&open("1_4_format_7.laz", &point_source).unwrap(), "office_1").len(), 3);
    assert_eq!(
        contents(&open("1_2_format_3.las", &point_source).unwrap(), "office_1"),
        expected(DVec3::ZERO)
    );

    let swapped = AnnotationOptions {
        class_column: Some("ext:classification".into()),
        instance_column: Some("ext:instance".into()),
        ..options()
    };
    assert_eq!(contents(&open("two_scans.e57", &swapped).unwrap(), "office_1"), expected(DVec3::ZERO));

    let rooms = AnnotationOptions { room_column: Some("instance".into()), ..options() };
    let found = open("little.ply", &rooms).unwrap();
    let names: Vec<String> = found.rooms.iter().map(|r| r.room.to_string()).collect();
    assert_eq!(names, ["office_10", "office_11", "office_12", "office_13"]);

    for (name, there) in [("1_4_format_7.las", "quality instance"), ("ascii.ply", "label instance")] {
        let gone = AnnotationOptions { class_column: Some("gone".into()), ..options() };
        let message = open(name, &gone).unwrap_err().to_string();
        assert!(
            message.contains("\"gone\" (class in [annotations])") && message.contains(there),
            "{message}"
        );
    }

    let no_label = AnnotationOptions { class_column: Some("label".into()), ..options() };
    let message = open("big.ply", &no_label).unwrap_err().to_string();
    assert!(message.contains("its columns are x y z r g b scalar_Classification object_id"), "{message}");
}

#[test]
fn classes_without_a_meaning_stop_or_are_left_out_or_are_clutter() {
    let mut known = options();
    known.classes.remove("19");
    let message = open("ascii.ply", &known).unwrap_err().to_string();
    let words = "ascii.ply: classes that are not among the 13: \"19\" (20 points).";
    assert!(message.contains(words), "{message}");

    let skip = AnnotationOptions { on_fault: OnFault::Skip, ..known.clone() };
    let found = open("ascii.ply", &skip).unwrap();
    assert_eq!(contents(&found, "office_1").len(), 8);
    assert!(
        found.warnings[0].contains("20 points of unknown classes left out: \"19\""),
        "{:?}",
        found.warnings
    );

    let clutter = AnnotationOptions { unknown_as_clutter: true, ..known };
    let found = open("ascii.ply", &clutter).unwrap();
    let all = contents(&found, "office_1");
    assert_eq!(all[&(Class::CLUTTER.index(), 4)], expected(DVec3::ZERO)[&(Class::CHAIR.index(), 4)]);
    assert!(found.warnings[0].contains("taken for clutter: \"19\""));
}

#[test]
fn rooms_must_be_known() {
    let none = AnnotationOptions { room: None, ..options() };
    let message = open("ascii.ply", &none).unwrap_err().to_string();
    assert!(message.contains("60 points are in no room: name it, as in room = \"office_1\""), "{message}");

    let columns = AnnotationOptions { room: None, room_column: Some("instance".into()), ..options() };
    let message = open("ascii.ply", &columns).unwrap_err().to_string();
    assert!(message.contains("\"10\" (15 points)") && message.contains("what type of room"), "{message}");
}

#[test]
fn offsets_are_subtracted_before_rounding_and_far_points_are_told_of() {
    let offset = DVec3::new(500_000.0, -4_000_000.0, 0.015625);
    let near = open("big.ply", &AnnotationOptions { offset_m: offset, ..options() }).unwrap();
    assert_eq!(contents(&near, "office_1"), expected(offset));
    assert!(near.warnings[0].contains("coordinates up to 4000000 m from the origin"), "{:?}", near.warnings);
}

#[test]
fn a_temporary_file_gives_what_memory_gives() {
    let spool_dir = tempfile::tempdir().unwrap();
    let spooled =
        AnnotationOptions { points_in_memory: 10, spool_dir: Some(spool_dir.path().to_owned()), ..options() };
    let found = Annotations::open(&[fixture("little.ply"), fixture("1_4_format_7.laz")], &spooled).unwrap();
    let both = contents(&found, "office_1");
    for (key, cloud) in expected(DVec3::ZERO) {
        assert_eq!(both[&key].positions, [&cloud.positions[..], &cloud.positions[..]].concat());
        assert_eq!(both[&key].colors, [&cloud.colors[..], &cloud.colors[..]].concat());
    }

    drop(found);
    assert_eq!(std::fs::read_dir(spool_dir.path()).unwrap().count(), 0);
    let gone = AnnotationOptions {
        points_in_memory: 0,
        spool_dir: Some(spool_dir.path().join("gone")),
        ..options()
    };
    assert!(matches!(open("little.ply", &gone), Err(Error::Io { .. })));
}

/// All fixtures, as they are opened: files, and the folder of a scan.
fn all() -> Vec<PathBuf> {
    let others = ["structured.npy", "Area_1_office_1.npy", "names.npz", "scene0000_00"];
    NUMBERED.iter().chain(&others).map(|name| fixture(name)).collect()
}

/// Opens a damaged copy of a file. It gives points, or an error that names it.
fn open_damaged(original: &Path, bytes: &[u8], what: &str) {
    let dir = tempfile::tempdir().unwrap();
    let name = original.file_name().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    for on_fault in [OnFault::Stop, OnFault::Skip] {
        let options = AnnotationOptions { on_fault, unknown_as_clutter: true, ..options() };
        if let Err(e) = Annotations::open(std::slice::from_ref(&path), &options) {
            assert!(e.to_string().contains(dir.path().to_str().unwrap()), "{what}: {e}");
        }
    }
}

#[test]
fn files_that_are_cut_short_are_errors() {
    for path in all().iter().filter(|p| p.is_file()) {
        let bytes = std::fs::read(path).unwrap();
        for length in (0..bytes.len() - 1).step_by(bytes.len() / 15 + 1) {
            let dir = tempfile::tempdir().unwrap();
            let cut = dir.path().join(path.file_name().unwrap());
            std::fs::write(&cut, &bytes[..length]).unwrap();
            let result = Annotations::open(std::slice::from_ref(&cut), &options());
            assert!(result.is_err(), "{} of {length} bytes", cut.display());
            open_damaged(path, &bytes[..length], "cut");
        }
    }
}

#[test]
fn damaged_files_are_errors_or_other_points() {
    let mut state = 7u64;
    let mut next = |n: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for path in all().iter().filter(|p| p.is_file()) {
        let bytes = std::fs::read(path).unwrap();
        for turn in 0..60 {
            let mut damaged = bytes.clone();
            // Half of the damage goes to the header, where it has the most effect.
            for _ in 0..1 + turn % 4 {
                let end = if turn % 2 == 0 {
                    bytes.len().min(400)
                } else {
                    bytes.len()
                };
                damaged[next(end)] = [0, 1, 0x7f, 0xff][next(4)];
            }
            open_damaged(path, &damaged, &format!("{} turn {turn}", path.display()));
        }
    }
}

#[test]
fn what_is_no_annotation_says_what_is_read() {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes, words) in [
        ("points.foo", &b"no point"[..], "points.foo: is no kind of annotations that is read: "),
        ("points.bar", b"\x89HDF\r\n", "(it is HDF5: MATLAB's files are read if they end in .mat)"),
        ("points.txt.gz", b"\x1f\x8b\x08", "(it is compressed by gzip: unpack it first)"),
        ("points.zst", b"\x28\xb5\x2f\xfd", "(it is compressed by zstd: unpack it first)"),
        ("points.parquet", b"PAR1", "(it is Parquet: save its columns as .npy, .ply or text)"),
        ("points.drc", b"DRACO", "(it is points that Draco compressed: draco_decoder writes them as .ply)"),
        ("points.foo", b"1 2 3", "is an ASCII cloud without names of columns: it has 3, as in `1 2 3`"),
    ] {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let message = Annotations::open(&[path], &AnnotationOptions::default())
            .unwrap_err()
            .to_string();
        assert!(message.contains(words), "{message}");
        assert!(message.contains(".laz") || message.contains("columns = [\"x\""), "{message}");
    }
    let missing = Annotations::open(&[dir.path().join("a.laz")], &AnnotationOptions::default());

    assert!(matches!(missing, Err(Error::Io { .. })));
    for name in [
        "a.las",
        "a.laz",
        "a.ply",
        "a.npy",
        "a.npz",
        "a.e57",
        "a.pcd",
        "a.csv",
        "a.ptx",
        "a.bin",
        "a.label",
        "a.aggregation.json",
    ] {
        let path = dir.path().join(name);
        std::fs::write(&path, b"nonsense, and much of it, but no points").unwrap();
        let message = Annotations::open(&[path], &options()).unwrap_err().to_string();
        assert!(message.contains(name), "{message}");
    }
}

/// laspy reads such files too: the points do not need the missing records.
#[test]
fn headers_that_miscount_their_records_do_not_hide_the_points() {
    for name in ["1_2_format_3.las", "1_2_format_2.laz", "1_4_format_7.las", "1_4_format_7.laz"] {
        let good = std::fs::read(fixture(name)).unwrap();
        let records = u32::from_le_bytes(*good[100..].first_chunk().unwrap());
        let extended = [&u64::MAX.to_le_bytes()[..], &3u32.to_le_bytes()].concat();
        let far = [&good.len().to_le_bytes()[..], &1u32.to_le_bytes()].concat();
        let more = [records + 1, records + 500, u32::MAX].map(|n| (100, n.to_le_bytes().to_vec()));
        let is_1_4 = good[25] == 4;
        let beyond = [(235, extended), (235, far)].into_iter().filter(|_| is_1_4);

        for (at, bytes) in more.into_iter().chain(beyond) {
            let mut bad = good.clone();
            bad[at..at + bytes.len()].copy_from_slice(&bytes);
            let read = Annotations::from_reader(std::io::Cursor::new(bad), Path::new(name), &options());
            let found = read.unwrap_or_else(|e| panic!("{e}: {at} {bytes:?}"));
            assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO), "{name}");
            let there = if at == 100 {
                format!("and {records} are there")
            } else {
                "where none are".into()
            };
            assert!(found.warnings.len() == 1 && found.warnings[0].contains(&there), "{:?}", found.warnings);
        }
    }
}

#[test]
fn points_that_an_early_laszip_compressed_are_called_so() {
    let name = "1_2_format_2.laz";
    let mut bytes = std::fs::read(fixture(name)).unwrap();
    let record = bytes.windows(14).position(|w| w == b"laszip encoded").unwrap() - 2;
    assert_eq!(bytes[record + 54], 2, "points in chunks");
    bytes[record + 54] = 1;
    let read = Annotations::from_reader(std::io::Cursor::new(bytes), Path::new(name), &options());
    let message = read.unwrap_err().to_string();
    assert!(message.contains("is compressed point by point, as LASzip did before version 2"), "{message}");
}

#[test]
fn classes_that_five_bits_may_have_cut_are_told_of() {
    for (name, words) in [("1_2_format_3.las", "2 points have the class 31"), ("1_4_format_7.las", "")] {
        let mut bytes = std::fs::read(fixture(name)).unwrap();
        let start = u32::from_le_bytes(*bytes[96..].first_chunk().unwrap()) as usize;
        let record = usize::from(u16::from_le_bytes(*bytes[105..].first_chunk().unwrap()));
        for i in 0..2 {
            bytes[start + i * record + if words.is_empty() { 16 } else { 15 }] = 31;
        }
        let mut known = options();
        let open = |options: &AnnotationOptions| {
            let bytes = std::io::Cursor::new(bytes.clone());
            Annotations::from_reader(bytes, Path::new(name), options)
                .unwrap()
                .warnings
        };
        let warnings = open(&AnnotationOptions { unknown_as_clutter: true, ..known.clone() });
        let told = warnings.iter().any(|w| w.contains("class 31, the largest"));
        assert_eq!(told, !words.is_empty(), "{name}: {warnings:?}");
        assert!(!told || warnings.iter().any(|w| w.contains(words)), "{warnings:?}");
        known.classes.insert("31".to_owned(), Some(Class::TABLE));
        assert!(open(&known).is_empty());
    }
}
