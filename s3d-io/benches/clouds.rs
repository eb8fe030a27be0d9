//! Times reading tables of points and grouping them by instance, in points a second: all of
//! `Annotations::open`, for each kind of file, and once through a temporary file.
//!
//! The points are made here with a fixed seed: 200 instances of 8 classes in random order. Files are warm in
//! the system's cache.
#![allow(missing_docs, reason = "criterion's macros")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use s3d_io::cloud::{AnnotationOptions, Annotations};
use s3d_label::Class;
use std::hint::black_box;
use std::io::Write;
use std::path::{Path, PathBuf};

const POINTS: usize = 400_000;

struct Point {
    position: [f64; 3],
    color: [u8; 3],
    class: u8,
    instance: u16,
}

fn points() -> Vec<Point> {
    let mut state = 7u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let point = |_| {
        let position = [next() * 20.0, next() * 20.0, next() * 3.0].map(|v| (v * 1e4).round() / 1e4);
        let color = [next() * 255.0, next() * 255.0, next() * 255.0].map(|v| v as u8);
        Point { position, color, class: (next() * 8.0) as u8, instance: (next() * 25.0) as u16 }
    };
    (0..POINTS).map(point).collect()
}

/// The points as rows of x y z (float) red green blue (uchar) class (uchar) instance (ushort), little-endian.
fn rows(points: &[Point]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for p in points {
        p.position.iter().for_each(|v| bytes.extend((*v as f32).to_le_bytes()));
        bytes.extend(p.color);
        bytes.push(p.class);
        bytes.extend(p.instance.to_le_bytes());
    }
    bytes
}

fn write_ply(dir: &Path, points: &[Point], ascii: bool) -> PathBuf {
    let path = dir.join(if ascii { "ascii.ply" } else { "binary.ply" });
    let mut file = std::fs::File::create(&path).unwrap();
    let format = if ascii { "ascii" } else { "binary_little_endian" };
    write!(
        file,
        "ply\nformat {format} 1.0\nelement vertex {POINTS}\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         property uchar class\nproperty ushort instance\nend_header\n"
    )
    .unwrap();

    if ascii {
        let mut text = String::new();
        for Point { position: [x, y, z], color: [r, g, b], class, instance } in points {
            text += &format!("{x:.4} {y:.4} {z:.4} {r} {g} {b} {class} {instance}\n");
        }
        file.write_all(text.as_bytes()).unwrap();
    } else {
        file.write_all(&rows(points)).unwrap();
    }
    path
}

/// The points as text, behind a line of names.
fn write_text(dir: &Path, points: &[Point], name: &str, head: &str) -> PathBuf {
    let path = dir.join(name);
    let mut text = head.to_owned();
    for Point { position: [x, y, z], color: [r, g, b], class, instance } in points {
        text += &format!("{x:.8} {y:.8} {z:.8} {r} {g} {b} {class}.000000 {instance}.000000\n");
    }
    std::fs::write(&path, text).unwrap();
    path
}

fn write_pcd(dir: &Path, points: &[Point]) -> PathBuf {
    let path = dir.join("binary.pcd");
    let mut bytes = format!(
        "VERSION 0.7\nFIELDS x y z r g b class instance\nSIZE 4 4 4 1 1 1 1 2\nTYPE F F F U U U U U\n\
         COUNT 1 1 1 1 1 1 1 1\nWIDTH {POINTS}\nHEIGHT 1\nPOINTS {POINTS}\nDATA binary\n"
    )
    .into_bytes();
    bytes.extend(rows(points));
    std::fs::write(&path, bytes).unwrap();
    path
}

fn write_npy(dir: &Path, points: &[Point]) -> PathBuf {
    let path = dir.join("structured.npy");
    let mut header = format!(
        "{{'descr': [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('rgb', '|u1', (3,)), ('class', '|u1'), \
         ('instance', '<u2')], 'fortran_order': False, 'shape': ({POINTS},), }}"
    );

    while !(header.len() + 11).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');

    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(rows(points));
    std::fs::write(&path, bytes).unwrap();
    path
}

fn write_las(dir: &Path, points: &[Point], name: &str) -> PathBuf {
    let path = dir.join(name);

    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(7).unwrap();
    let header = builder.into_header().unwrap();
    let mut writer = las::Writer::from_path(&path, header).unwrap();

    for p in points {
        let [red, green, blue] = p.color.map(|c| u16::from(c) * 257);
        let point = las::Point {
            x: p.position[0],
            y: p.position[1],
            z: p.position[2],
            // Codes with a meaning of their own are not all allowed. Codes above 18 are free.
            classification: las::point::Classification::new(64 + p.class).unwrap(),
            point_source_id: p.instance,
            color: Some(las::Color { red, green, blue }),
            gps_time: Some(0.0),
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
    path
}

fn write_e57(dir: &Path, points: &[Point]) -> PathBuf {
    use e57::{Record, RecordDataType, RecordName, RecordValue};
    let path = dir.join("scan.e57");
    let mut writer = e57::E57Writer::from_file(&path, "{0}").unwrap();
    writer
        .register_extension(e57::Extension::new("ext", "http://www.example.com"))
        .unwrap();
    let own = |name: &str, max| Record {
        name: RecordName::Unknown { namespace: "ext".into(), name: name.into() },
        data_type: RecordDataType::Integer { min: 0, max },
    };
    let prototype = vec![
        Record::CARTESIAN_X_F32,
        Record::CARTESIAN_Y_F32,
        Record::CARTESIAN_Z_F32,
        Record::COLOR_RED_U8,
        Record::COLOR_GREEN_U8,
        Record::COLOR_BLUE_U8,
        own("class", 255),
        own("instance", 65_535),
    ];

    let mut scan = writer.add_pointcloud("{1}", prototype).unwrap();
    for p in points {
        let mut values: Vec<RecordValue> =
            p.position.iter().map(|v| RecordValue::Single(*v as f32)).collect();
        values.extend(p.color.iter().map(|c| RecordValue::Integer(i64::from(*c))));
        values.extend([i64::from(p.class), i64::from(p.instance)].map(RecordValue::Integer));
        scan.add_point(values).unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    path
}

/// Writes the structured array into an archive, without compression.
fn write_npz(dir: &Path, npy: &Path) -> PathBuf {
    let path = dir.join("stored.npz");
    let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    archive.start_file("points.npy", stored).unwrap();
    archive.write_all(&std::fs::read(npy).unwrap()).unwrap();
    archive.finish().unwrap();
    path
}

/// Writes a scan of ScanNet whose vertices are the points, with a segment for each class and instance.
fn write_scannet(dir: &Path, points: &[Point]) -> PathBuf {
    const NAMES: [&str; 8] = ["wall", "floor", "chair", "table", "door", "window", "couch", "bookshelf"];
    let folder = dir.join("scene0000_00");
    std::fs::create_dir(&folder).unwrap();
    std::fs::rename(write_ply(dir, points, false), folder.join("scene0000_00_vh_clean_2.ply")).unwrap();
    let segments: Vec<String> = points
        .iter()
        .map(|p| (u32::from(p.class) * 25 + u32::from(p.instance)).to_string())
        .collect();
    let segs = format!("{{\"sceneId\": \"scene0000_00\", \"segIndices\": [{}]}}", segments.join(","));

    std::fs::write(folder.join("scene0000_00_vh_clean_2.0.010000.segs.json"), segs).unwrap();

    let groups: Vec<String> = (0..200)
        .map(|i| {
            let name = NAMES[i / 25];
            format!("{{\"id\": {i}, \"objectId\": {i}, \"segments\": [{i}], \"label\": \"{name}\"}}")
        })
        .collect();
    let aggregation =
        format!("{{\"sceneId\": \"scannet.scene0000_00\", \"segGroups\": [{}]}}", groups.join(","));
    std::fs::write(folder.join("scene0000_00.aggregation.json"), aggregation).unwrap();
    folder
}

fn clouds(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let points = points();
    let scannet = write_scannet(dir.path(), &points);
    let npy = write_npy(dir.path(), &points);
    let npz = write_npz(dir.path(), &npy);

    let paths = [
        write_ply(dir.path(), &points, true),
        write_ply(dir.path(), &points, false),
        npy,
        npz,
        scannet,
        write_las(dir.path(), &points, "cloud.las"),
        write_las(dir.path(), &points, "cloud.laz"),
        write_e57(dir.path(), &points),
        write_pcd(dir.path(), &points),
        write_text(dir.path(), &points, "cloudcompare.asc", "//X Y Z R G B Classification Instance\n"),
    ];

    let classes = (0..72)
        .map(|k: usize| (k.to_string(), Some(Class::S3DIS[k % 8])))
        .collect();
    let room = Some("office_1".parse().unwrap());
    let memory = AnnotationOptions { classes, room, ..AnnotationOptions::default() };
    let spool = AnnotationOptions { points_in_memory: 0, ..memory.clone() };

    let mut group = c.benchmark_group("clouds");
    group.sample_size(10).throughput(Throughput::Elements(POINTS as u64));

    for path in &paths {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let open = |options| Annotations::open(black_box(std::slice::from_ref(path)), options).unwrap();
        group.bench_function(&name, |b| b.iter(|| open(&memory)));
        if name == "binary.ply" {
            group.bench_function(format!("{name}, temporary file"), |b| b.iter(|| open(&spool)));
        }
    }
}

criterion_group!(benches, clouds);
criterion_main!(benches);
