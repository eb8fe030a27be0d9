//! What does it cost on one core to write a view of 1080² pixels, and each of its images? What do S3DIS
//! text, OBJ meshes, PLY points, instances and poses cost?
//!
//! The images show a furnished room that is made here from a fixed seed: uneven walls as a scan has them,
//! seen at an angle, a texture with noise, and a few dozen instances. `Throughput` counts bytes before
//! compression; the size after it is printed once. `view` is all six images of a view, one after the other.
//! `bench/encode_peers.py` has figures of other encoders for images of a data set.
//!
//! Goal: a view in 50 ms with balanced compression; no PNG image more than 1.1 times as large as by libpng's
//! level 6 (RGB 1.15), and no OpenEXR image larger than by OpenEXR.
#![allow(clippy::print_stderr, missing_docs)]

mod room;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use half::f16;
use room::{Images, SIZE, images, noise};
use s3d_geom::glam::{DVec3, Vec3, vec3};
use s3d_geom::{Aabb, Camera, PointCloud, Pose, TriMesh};
use s3d_io::cloud::{PlyPointWriter, S3disAreaWriter};
use s3d_io::dataset::{Frame, InstanceRecord, InstanceWriter, PoseFile};
use s3d_io::image::{Compression, Content, encode_gray16, encode_rgb8, encode_xyz_float, encode_xyz_half};
use s3d_io::mesh::write_semantic_obj;
use std::hint::black_box;

fn encode(c: &mut Criterion) {
    let Images { photo, depth, normals, labels, pretty, xyz: floats } = images();
    let halves = floats.map(|p| p.map(f16::from_f32));
    let mut group = c.benchmark_group("encode");
    group.sample_size(20);

    let n = photo.len();
    type Encode<'a> = &'a dyn Fn(Compression) -> Vec<u8>;
    let images: [(&str, usize, Encode<'_>); 7] = [
        ("rgb_png", 3 * n, &|c| encode_rgb8(&photo, Content::Photo, c)),
        ("depth_png", 2 * n, &|c| encode_gray16(&depth, c)),
        ("normal_png", 3 * n, &|c| encode_rgb8(&normals, Content::Normals, c)),
        ("semantic_png", 3 * n, &|c| encode_rgb8(&labels, Content::Labels, c)),
        ("semantic_pretty_png", 3 * n, &|c| encode_rgb8(&pretty, Content::Labels, c)),
        ("xyz_half_exr", 6 * n, &|c| encode_xyz_half(&halves, c)),
        ("xyz_float_exr", 12 * n, &|c| encode_xyz_float(&floats, c)),
    ];
    let of_a_view = &images[..6];

    for compression in Compression::ALL {
        for (name, bytes, encode) in images {
            eprintln!("{name}, {compression}: {bytes} bytes become {}", encode(compression).len());
            group.throughput(Throughput::Bytes(bytes as u64));
            group.bench_function(format!("{name}/{compression}"), |b| {
                b.iter(|| black_box(encode(compression)))
            });
        }
        let bytes: usize = of_a_view.iter().map(|(_, bytes, _)| bytes).sum();
        group.throughput(Throughput::Bytes(bytes as u64));
        group.bench_function(format!("view/{compression}"), |b| {
            b.iter(|| {
                of_a_view
                    .iter()
                    .map(|(_, _, encode)| black_box(encode(compression)).len())
                    .sum::<usize>()
            });
        });
    }
    group.finish();
}

/// Points per second into the files of a room and an instance.
fn s3dis(c: &mut Criterion) {
    let n = 200_000;
    let positions: Vec<Vec3> = (0..n)
        .map(|i| vec3(noise(i, 1) * 20.0, noise(i, 2) * 20.0, noise(i, 3) * 2.0))
        .collect();
    let colors: Vec<[u8; 3]> = (0..n).map(|i| [i as u8, (i >> 8) as u8, 200]).collect();
    let mut group = c.benchmark_group("s3dis");
    group.sample_size(20).throughput(Throughput::Elements(u64::from(n)));
    group.bench_function("room_and_instance", |b| {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let area = S3disAreaWriter::create(dir.path()).expect("the folder");
        b.iter(|| {
            let mut room = area.room("office_1").expect("the room");
            let mut chair = room.instance("chair", 1).expect("the file");
            chair.append(&positions, &colors).expect("the points");
            chair.finish().expect("the name");
            room.finish().expect("the name")
        });
    });
    group.finish();
}

/// Faces per second into `semantic.obj`.
fn obj(c: &mut Criterion) {
    let side = 300;
    let positions = (0..side * side)
        .map(|i| vec3((i % side) as f32 * 0.021, (i / side) as f32 * 0.019, noise(i, 0) * 0.01))
        .collect();
    let faces: Vec<[u32; 3]> = (0..(side - 1) * (side - 1))
        .map(|i| (i / (side - 1)) * side + i % (side - 1))
        .flat_map(|v| [[v, v + 1, v + side], [v + 1, v + side + 1, v + side]])
        .collect();

    let mesh = TriMesh::from_faces(positions, faces).expect("a mesh");
    let names: Vec<String> = (0..50).map(|i| format!("chair_{i}_office_5_1")).collect();
    let labels: Vec<u32> = (0..mesh.faces().len() as u32).map(|f| f / 97 % 50).collect();

    let mut group = c.benchmark_group("obj");
    group
        .sample_size(10)
        .throughput(Throughput::Elements(labels.len() as u64));
    group.bench_function("semantic_obj", |b| {
        let dir = tempfile::tempdir().expect("a temporary folder");
        b.iter(|| write_semantic_obj(dir.path(), &mesh, &labels, &names).expect("the files"));
    });
    group.finish();
}

/// Points per second into `pointcloud.ply`.
fn ply(c: &mut Criterion) {
    let n = 200_000u32;
    let cloud = PointCloud {
        positions: (0..n).map(|i| vec3(noise(i, 1), noise(i, 2), noise(i, 3))).collect(),
        colors: (0..n).map(|i| [i as u8, (i >> 8) as u8, 200]).collect(),
        faces: (0..n).collect(),
    };
    let labels: Vec<u32> = (0..n).map(|i| i / 4096).collect();
    let mut group = c.benchmark_group("ply");
    group.sample_size(20).throughput(Throughput::Elements(u64::from(n)));
    group.bench_function("points", |b| {
        let dir = tempfile::tempdir().expect("a temporary folder");
        b.iter(|| {
            let mut file = PlyPointWriter::create(&dir.path().join("c.ply"), u64::from(n)).expect("the file");
            file.append(&cloud, &labels).expect("the points");
            file.finish().expect("the name")
        });
    });
    group.finish();
}

/// Points per second into `instances.json` and `instances.npz`, for 100 instances of 10,000.
fn instances(c: &mut Criterion) {
    let points: Vec<Vec3> = (0..10_000u32)
        .map(|i| vec3((i % 97) as f32, (i % 89) as f32, (i % 83) as f32) * 0.01)
        .collect();
    let bbox = Aabb::from_points(points.iter().copied());

    let mut group = c.benchmark_group("instances");
    group.sample_size(10).throughput(Throughput::Elements(1_000_000));
    group.bench_function("json_and_npz", |b| {
        let dir = tempfile::tempdir().expect("a temporary folder");
        b.iter(|| {
            let json = dir.path().join("i.json");
            let npz = dir.path().join("i.npz");
            let mut writer = InstanceWriter::create(&json, &npz).expect("the files");
            for label_index in 0..100 {
                let record = InstanceRecord {
                    label: "chair_1_office_1_1",
                    label_index,
                    class: "chair",
                    room: "office_1",
                    bbox,
                };
                writer.push(&record, &mut &points[..]).expect("the instance");
            }
            writer.finish().expect("the names")
        });
    });
    group.finish();
}

/// Pose files per second.
fn pose(c: &mut Criterion) {
    let original = Pose::level(DVec3::new(3.0, 2.0, 1.5), 0.3);
    let camera = Camera::perspective(original.turned(0.4, -0.1), 1.1, SIZE, SIZE);
    let mut group = c.benchmark_group("pose");
    group.throughput(Throughput::Elements(1));
    group.bench_function("json", |b| {
        let uuid = "5c2959c3089c4ac5a7c5c913cc0df78d";
        b.iter(|| {
            PoseFile::new(black_box(&camera), &original, uuid, "office_5_3", Frame::View(41)).to_json()
        });
    });
    group.finish();
}

criterion_group!(benches, encode, s3dis, obj, ply, instances, pose);
criterion_main!(benches);
