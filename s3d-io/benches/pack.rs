//! How fast are packages written? Bytes a second into shards and out of clouds, and images a second into the
//! files of COLMAP, nerfstudio, COCO and Parquet.
//!
//! The inputs are made here with fixed seeds, so that figures can be compared between machines. Files lie in
//! a temporary folder, in the cache of the system.
#![allow(missing_docs, reason = "criterion's macros")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::glam::{DQuat, dvec3, vec3};
use s3d_geom::{Camera, PointCloud, Pose, Raster};
use s3d_io::cloud::{NpyWriter, read_point_sample, write_colored_points};
use s3d_io::dataset::{Domain, Frame, PoseFile};
use s3d_io::package::{
    CocoImage, ColmapImage, ColmapModel, ImageRow, NerfstudioCamera, NerfstudioFrame, SemanticRow, TarWriter,
    coco_categories, coco_panoptic, write_coco, write_image_index, write_nerfstudio,
};
use s3d_label::{Class, Label, LabelTable};
use std::hint::black_box;

/// How many images a package has.
const IMAGES: u64 = 2000;

fn cloud(points: usize) -> PointCloud {
    PointCloud {
        positions: (0..points)
            .map(|i| vec3(i as f32 * 0.001, (i % 77) as f32, (i % 13) as f32 * 0.2))
            .collect(),
        colors: (0..points).map(|i| [i as u8, (i / 3) as u8, 7]).collect(),
        faces: Vec::new(),
    }
}

fn poses() -> Vec<(Camera, PoseFile)> {
    let original = Pose::from_scanner(dvec3(4.0, -2.0, 1.5), DQuat::from_rotation_z(0.4));
    (0..IMAGES as u32)
        .map(|i| {
            let pose = original.turned(0.01 * f64::from(i), 0.0001 * f64::from(i));
            let camera = Camera::perspective(pose, 0.5 + 0.0002 * f64::from(i), 1080, 1080);
            let file = PoseFile::new(&camera, &original, "a1b2", "office_1_1", Frame::View(i));
            (camera, file)
        })
        .collect()
}

/// Makes a semantic image of 1080² that shows 30 instances in patches with ragged edges.
fn semantic() -> (Raster<[u8; 3]>, LabelTable) {
    let labels = (1..=30).map(|instance| Label {
        class: Class::S3DIS[instance as usize % 13],
        instance,
        room: "office_1".parse().unwrap(),
        area: 1,
    });
    let table = LabelTable::from_labels(labels).unwrap();
    let pixels = (0..1080u32 * 1080).map(|i| {
        let x = i % 1080;
        let y = i / 1080;
        let index = (x + (y * 7919) % 11) / 200 + y / 220 * 6;
        [0, 0, (index % 31) as u8]
    });
    (Raster::from_vec(1080, 1080, pixels.collect()), table)
}

fn shards(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.tar");
    let file: Vec<u8> = (0..200_000u32).map(|i| i.wrapping_mul(i) as u8).collect();
    let mut group = c.benchmark_group("pack");
    group.throughput(Throughput::Bytes(200 * file.len() as u64));
    group.bench_function("tar", |b| {
        b.iter(|| {
            let mut tar = TarWriter::create(&path).unwrap();
            (0..200).for_each(|i| tar.append(&format!("area_1/camera_{i}.rgb.png"), &file).unwrap());
            tar.finish().unwrap()
        });
    });

    let path = dir.path().join("cloud.ply");
    let bytes = write_colored_points(&path, &cloud(2_000_000), &[]).unwrap();
    group.throughput(Throughput::Bytes(bytes));
    group.bench_function("cloud, every 20th point", |b| {
        b.iter(|| read_point_sample(black_box(&path), 100_000).unwrap());
    });
}

fn cameras(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let poses = poses();
    let images: Vec<ColmapImage> = poses
        .iter()
        .enumerate()
        .map(|(i, (camera, _))| ColmapImage {
            name: format!("camera_{i}.png"),
            width: 1080,
            height: 1080,
            k: camera.k_matrix(),
            rt: camera.pose.rt_matrix(),
        })
        .collect();

    let points = cloud(100_000);
    let mut group = c.benchmark_group("pack");
    group.throughput(Throughput::Elements(IMAGES));
    let model = ColmapModel::new(&images, &points);
    group.bench_function("colmap, text", |b| b.iter(|| model.write_text(dir.path()).unwrap()));
    group.bench_function("colmap, binary", |b| b.iter(|| model.write_binary(dir.path()).unwrap()));

    let path = dir.path().join("transforms.json");
    group.bench_function("nerfstudio", |b| {
        b.iter(|| {
            let frame = |(i, (_, pose)): (usize, &(Camera, PoseFile))| {
                NerfstudioFrame::perspective(format!("images/{i}.png"), pose, (1080, 1080))
            };
            let frames: Vec<_> = poses.iter().enumerate().map(frame).collect();
            write_nerfstudio(&path, NerfstudioCamera::Perspective, None, &frames).unwrap()
        });
    });
}

fn tables(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let (image, table) = semantic();
    let stuff = [Class::CEILING, Class::FLOOR, Class::WALL];

    let mut group = c.benchmark_group("pack");
    group.throughput(Throughput::Elements(1));
    group.bench_function("coco, an image of 1080²", |b| {
        b.iter(|| coco_panoptic(black_box(&image), &table, &stuff).unwrap());
    });

    let (_, segments) = coco_panoptic(&image, &table, &stuff).unwrap();
    let images: Vec<CocoImage> = (1..=IMAGES as u32)
        .map(|id| CocoImage {
            id,
            file_name: format!("area_1/data/rgb/camera_{id}.png"),
            width: 1080,
            height: 1080,
            segments: segments.clone(),
            masks: Default::default(),
        })
        .collect();
    group.throughput(Throughput::Elements(IMAGES));
    let path = dir.path().join("panoptic.json");
    group.bench_function("coco, the file", |b| {
        b.iter(|| {
            write_coco(&path, "bench", &images, &coco_categories(&s3d_label::Taxonomy::s3dis(), &stuff))
                .unwrap()
        });
    });

    let rows: Vec<ImageRow> = (0..IMAGES as u32)
        .map(|i| ImageRow {
            area: 1,
            camera_uuid: format!("{:032x}", i / 50),
            room: "office_1".into(),
            room_type: "office".into(),
            room_number: 1,
            frame_num: Some(i % 50),
            files: Domain::ALL.map(|d| Some(format!("area_1/data/{d}/camera_{i}.png"))),
            size: Some([1080, 1080]),
            fov_rad: Some(0.001 * f64::from(i)),
            yaw_pitch_rad: Some([0.01 * f64::from(i), -0.1]),
            location: Some([1.0, 2.0, 1.5]),
            k: Some([0.001 * f64::from(i); 9]),
            rt: Some(std::array::from_fn(|k| k as f64 + f64::from(i))),
            selection_entropy: Some(1.0),
            coverage: Some(0.9),
            semantic: Some(SemanticRow {
                shares: vec![0.07; 13],
                unlabelled: 0.0,
                entropy: 1.0,
                instances: 12,
            }),
            depth_m: Some([0.5, 2.0 + f64::from(i), 9.0]),
            photograph: None,
        })
        .collect();

    let path = dir.path().join("images.parquet");
    group.bench_function("parquet", |b| b.iter(|| write_image_index(&path, &Class::S3DIS, &rows).unwrap()));
}

/// The array of a room as loaders of S3DIS read it: seven 64-bit floats for each point.
fn npy(c: &mut Criterion) {
    const ROWS: usize = 500_000;
    let dir = tempfile::tempdir().unwrap();
    let rows: Vec<u8> = (0..7 * ROWS).flat_map(|i| (i as f64 * 0.25).to_le_bytes()).collect();
    let mut group = c.benchmark_group("npy");
    group.throughput(Throughput::Bytes(rows.len() as u64)).sample_size(10);
    group.bench_function("write", |b| {
        b.iter(|| {
            let path = dir.path().join("room.npy");
            let mut array = NpyWriter::create(&path, "<f8", &[ROWS as u64, 7]).unwrap();
            rows.chunks(1 << 16).for_each(|piece| array.put(piece).unwrap());
            array.finish().unwrap()
        });
    });
}

criterion_group!(benches, shards, cameras, tables, npy);
criterion_main!(benches);
