//! An annotated cloud takes no memory for its points. The test runs in a process of its own, whose peak
//! memory the system reports.
#![allow(clippy::print_stderr, reason = "says why it measures nothing")]

use s3d_geom::Aabb;
use s3d_io::Error;
use s3d_io::cloud::{AnnotationOptions, Annotations, InstanceReader, PointPasses};
use s3d_io::dataset::{InstanceRecord, InstanceWriter, read_instances};
use s3d_label::Class;
use std::fs::{self, File};
use std::io::{BufWriter, Write};

/// The largest memory of this process so far, in bytes. Returns `None` if the system does not report it.
fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(1024 * line.trim().trim_end_matches(" kB").parse::<u64>().ok()?)
}

#[test]
fn a_cloud_of_one_instance_is_boxed_and_voxelised_in_little_memory() {
    const POINTS: u32 = 3_000_000;
    const BLOCK: usize = 1 << 16;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("office_1.ply");
    let mut file = BufWriter::new(File::create(&path).unwrap());
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\nelement vertex {POINTS}\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar class\nend_header\n"
    )
    .unwrap();
    for i in 0..POINTS {
        for coordinate in [i % 1000, i % 777, i / 5000] {
            file.write_all(&(coordinate as f32).to_le_bytes()).unwrap();
        }
        file.write_all(&[7]).unwrap();
    }
    file.into_inner().unwrap().flush().unwrap();

    let before = peak();
    let options = AnnotationOptions {
        classes: [("7".to_owned(), Some(Class::FLOOR))].into(),
        points_in_memory: 100_000,
        spool_dir: Some(dir.path().to_owned()),
        ..AnnotationOptions::default()
    };
    let area = Annotations::open(std::slice::from_ref(&path), &options).unwrap();
    let instance = &area.rooms[0].instances[0];

    let mut bbox = Aabb::EMPTY;
    let mut reader = InstanceReader::new(BLOCK);
    let (mut points, _) = reader
        .read(instance, None, |block, _| {
            bbox = bbox.union(Aabb::from_points(block.positions.iter().copied()));
            Ok::<(), Error>(())
        })
        .unwrap();
    assert_eq!(points.len(), u64::from(POINTS));
    assert_eq!(bbox.to_array(), [0.0, 0.0, 0.0, 999.0, 776.0, 599.0]);

    let json = dir.path().join("i.json");
    let npz = dir.path().join("i.npz");
    let mut writer = InstanceWriter::create(&json, &npz).unwrap();
    let record = InstanceRecord {
        label: "floor_1_office_1_1",
        label_index: 1,
        class: "floor",
        room: "office_1",
        bbox,
    };
    writer.push(&record, &mut points).unwrap();
    writer.finish().unwrap();
    let entry = &read_instances(&json).unwrap()[0];
    assert_eq!(entry.points, u64::from(POINTS));
    assert_eq!(entry.points_per_voxel.iter().sum::<u32>(), POINTS);
    assert!(fs::metadata(&npz).unwrap().len() > 4 * u64::from(POINTS));

    let (Some(before), Some(after)) = (before, peak()) else {
        eprintln!("not measured: the system reports no peak memory");
        return;
    };
    // Blocks and waiting indices of voxels take about 20 MB. The positions alone are 36 MB; with colours,
    // voxels and the copies for grouping they are 100 MB.
    let more = (after - before) >> 20;
    assert!(more < 32, "{more} MiB for {POINTS} points in blocks of {BLOCK}");
}
