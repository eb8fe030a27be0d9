//! The number of candidate views drawn per second: is one random stream per view affordable?

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_sample::{CANDIDATES_PER_LOCATION, ViewDistribution, draw_view};
use std::hint::black_box;

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("view");
    let dist = ViewDistribution::default();
    for locations in [1u64, 100] {
        let uuids: Vec<String> = (0..locations)
            .map(|i| format!("{:032x}", i * 0x9e37_79b9_7f4a))
            .collect();
        group.throughput(Throughput::Elements(locations * u64::from(CANDIDATES_PER_LOCATION)));
        group.bench_with_input(BenchmarkId::new("draw", locations), &uuids, |b, uuids| {
            b.iter(|| {
                for uuid in uuids {
                    for number in 0..CANDIDATES_PER_LOCATION {
                        black_box(draw_view(&dist, 42, black_box(uuid), number));
                    }
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
