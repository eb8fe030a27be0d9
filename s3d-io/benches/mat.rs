//! How many points a second go into `pointcloud.mat`, and come out of it? 40 objects of 50,000 points, as an
//! export writes them (with boxes and voxels).

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::PointCloud;
use s3d_geom::glam::{Vec3, vec3};
use s3d_io::cloud::{MatArea, MatWriter};
use std::hint::black_box;
use std::path::Path;

const OBJECTS: u32 = 40;
const POINTS: usize = 50_000;

fn cloud() -> PointCloud {
    let mut cloud = PointCloud::default();
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 16_777_216.0
    };
    for _ in 0..POINTS {
        cloud
            .positions
            .push(vec3(random(), random(), random()) * vec3(4.0, 0.1, 3.0) + Vec3::splat(7.0));
        cloud.colors.push([(255.0 * random()) as u8; 3]);
    }
    cloud
}

fn write(path: &Path, cloud: &PointCloud) {
    let mut mat = MatWriter::create(path, "Area_1").unwrap();
    mat.room("office_1", 0).unwrap();
    for i in 1..=OBJECTS {
        mat.object(&format!("wall_{i}"), &format!("wall_{i}_office_1_1"))
            .unwrap();
        mat.append(&cloud.positions, &cloud.colors).unwrap();
    }
    mat.finish().unwrap();
}

fn benches(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("pointcloud.mat");
    let cloud = cloud();
    let mut group = c.benchmark_group("pointcloud.mat");
    group.throughput(Throughput::Elements(u64::from(OBJECTS) * POINTS as u64));
    group.sample_size(10);
    group.bench_function("write", |b| b.iter(|| write(&path, black_box(&cloud))));
    write(&path, &cloud);
    group.bench_function("read", |b| {
        b.iter(|| {
            let mut out = PointCloud::default();
            for object in MatArea::open(&path).unwrap().rooms.iter().flat_map(|r| &r.objects) {
                out.clear();
                object.read(&mut out).unwrap();
                black_box(&out);
            }
        });
    });
    group.finish();
}

criterion_group!(mat, benches);
criterion_main!(mat);
