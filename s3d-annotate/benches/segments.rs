//! Segments of meshes like a scan's, by their number of faces. 300,000 faces are a floor of a house.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_annotate::segments::{SegmentOptions, segment_faces};
use s3d_synth::scenes::scan_like;
use std::hint::black_box;

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("segments");
    group.sample_size(10);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool of one thread");
    for faces in [30_000, 300_000] {
        let mesh = scan_like(faces, 1);
        group.throughput(Throughput::Elements(faces as u64));
        group.bench_with_input(BenchmarkId::new("one thread", faces), &mesh, |b, mesh| {
            pool.install(|| b.iter(|| black_box(segment_faces(mesh, &SegmentOptions::default()))));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
