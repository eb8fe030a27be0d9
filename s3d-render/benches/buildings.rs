//! What do hidden faces cost?
//!
//! The first group times a view of 1080² and a candidate view (every 4th pixel) from the first room of a
//! building, which grows from 1 to 64 rooms of 25,000 faces behind each other. The second group times a view
//! of 3 rooms whose faces grow from 30 thousand to 10 million. `Throughput` is in pixels: in a flat curve,
//! hidden faces cost nothing.
//!
//! `S3D_BENCH_FACES` limits the faces of the second group. The default is 3 million: ten million take a
//! gigabyte, and a minute to prepare.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::glam::dvec3;
use s3d_geom::{Camera, Pose, TriMesh};
use s3d_render::{Caster, Hits, Scene};
use s3d_synth::scenes::scan_like_rooms;

/// Returns a dozen views all around.
fn views() -> Vec<Camera> {
    let level = Pose::level(dvec3(3.0, 2.5, 1.5), 0.13);
    let view =
        |k: u32| level.turned(f64::from(k) * std::f64::consts::TAU / 12.0, [0.0, -0.2, 0.1][k as usize % 3]);
    (0..12)
        .map(|k| Camera::perspective(view(k), 75f64.to_radians(), 1080, 1080))
        .collect()
}

fn bench(c: &mut Criterion, group: &str, size: usize, mesh: &TriMesh) {
    let mut group = c.benchmark_group(group);
    group.sample_size(10);
    let scene = Scene::new(mesh);
    let mut caster = Caster::new(&scene);
    let mut hits = Hits::default();
    let views = views();
    for (name, stride) in [("views", 1), ("candidates, every 4th pixel", 4)] {
        group.throughput(Throughput::Elements(views.len() as u64 * u64::from(1080 / stride).pow(2)));
        group.bench_function(BenchmarkId::new(name, size), |b| {
            b.iter(|| views.iter().for_each(|v| caster.cast_into(v, stride, &mut hits)));
        });
    }
    group.finish();
}

fn rooms(c: &mut Criterion) {
    for rooms in [1, 2, 4, 8, 16, 32, 64] {
        bench(c, "rooms", rooms as usize, &scan_like_rooms(rooms, 25_000 * rooms as usize, 1));
    }
}

fn faces(c: &mut Criterion) {
    let most = std::env::var("S3D_BENCH_FACES")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(3_000_000);
    for faces in [30_000, 100_000, 300_000, 1_000_000, 3_000_000, 10_000_000] {
        if faces <= most {
            bench(c, "faces", faces, &scan_like_rooms(3, faces, 1));
        }
    }
}

criterion_group!(benches, rooms, faces);
criterion_main!(benches);
