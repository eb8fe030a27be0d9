//! The number of faces of 4, 6, 20 and 500 corners that are cut into triangles per second. Meshes of
//! modelling programs have tens of thousands of such faces, most of them quads.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::glam::{Vec3, vec3};
use s3d_geom::triangulate_face;
use std::hint::black_box;

/// Returns a tilted star with every other corner drawn in, or a square for four corners.
fn face(corners: u32) -> Vec<Vec3> {
    let at = |i: u32| {
        let (s, c) = libm::sincos(f64::from(i) / f64::from(corners) * std::f64::consts::TAU);
        let r = if corners > 4 && i % 2 == 1 { 0.5 } else { 1.0 };
        vec3((r * c) as f32, (r * s) as f32, (0.3 * r * c) as f32)
    };
    (0..corners).map(at).collect()
}

fn triangulate(c: &mut Criterion) {
    let mut group = c.benchmark_group("polygon");
    group.throughput(Throughput::Elements(1));
    for corners in [4, 6, 20, 500] {
        let face = face(corners);
        group.bench_with_input(BenchmarkId::new("triangulate_face", corners), &face, |b, face| {
            b.iter(|| triangulate_face(black_box(face)));
        });
    }
    group.finish();
}

criterion_group!(benches, triangulate);
criterion_main!(benches);
