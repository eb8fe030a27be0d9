//! The number of points per second that are sorted into the voxels of their instance, from a chair to the
//! floor of a hall.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use s3d_geom::Voxels;
use s3d_geom::glam::{Vec3, vec3};
use std::hint::black_box;

fn voxelise(c: &mut Criterion) {
    let mut group = c.benchmark_group("voxel");
    for n in [10_000, 1_000_000] {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut coordinate = || (rng.next_u32() >> 8) as f32 * 1e-6;
        let points: Vec<Vec3> = (0..n).map(|_| vec3(coordinate(), coordinate(), coordinate())).collect();
        group.throughput(Throughput::Elements(n));
        group.bench_with_input(BenchmarkId::new("from_points", n), &points, |b, points| {
            b.iter(|| Voxels::from_points(black_box(points)));
        });
    }
    group.finish();
}

criterion_group!(benches, voxelise);
criterion_main!(benches);
