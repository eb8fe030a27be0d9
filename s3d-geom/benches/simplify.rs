//! The time to simplify meshes of growing size to 300,000 faces, which a page can show.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::simplify;
use s3d_synth::scenes::scan_like;

fn simplify_scans(c: &mut Criterion) {
    let mut group = c.benchmark_group("simplify");
    group.sample_size(10);
    for faces in [400_000, 1_600_000] {
        let mesh = scan_like(faces, 1);
        group.throughput(Throughput::Elements(mesh.faces().len() as u64));
        group.bench_with_input(BenchmarkId::new("scan", mesh.faces().len()), &mesh, |b, mesh| {
            b.iter(|| simplify(mesh, 300_000));
        });
    }
    group.finish();
}

criterion_group!(benches, simplify_scans);
criterion_main!(benches);
