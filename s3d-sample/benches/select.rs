//! The cost of scoring and selecting the views of a location, an area, and the published data set (1,413
//! locations with 72 candidates each).

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_sample::{Pool, PoolItem, Selection, entropy, select, select_pooled};
use std::hint::black_box;

/// Returns histograms of views that see 1 to 9 classes, from a fixed stream of pseudo-random numbers.
fn histograms(count: usize) -> Vec<[u64; 13]> {
    let mut state = 5u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        state >> 40
    };
    (0..count)
        .map(|_| {
            let mut histogram = [0; 13];
            for _ in 0..1 + next() % 9 {
                histogram[(next() % 13) as usize] += next() % 300_000;
            }
            histogram
        })
        .collect()
}

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("select");
    group.sample_size(20);
    for locations in [1usize, 200, 1413] {
        let histograms = histograms(locations * 72);
        let scores: Vec<f64> = histograms.iter().map(|h| entropy(h)).collect();
        let uuids: Vec<String> = (0..locations as u64)
            .map(|i| format!("{:032x}", i * 0x9e37_79b9_7f4a))
            .collect();
        let items: Vec<PoolItem<'_>> = (0..scores.len())
            .map(|i| PoolItem {
                area: (i / 72 % 6) as u32 + 1,
                location: &uuids[i / 72],
                view: (i % 72) as u32,
                score: scores[i],
            })
            .collect();
        let options = Selection::default();

        group.throughput(Throughput::Elements(scores.len() as u64));
        group.bench_with_input(BenchmarkId::new("entropy", locations), &histograms, |b, histograms| {
            b.iter(|| black_box(histograms).iter().map(|h| entropy(h)).sum::<f64>());
        });
        group.bench_with_input(BenchmarkId::new("one_pool", locations), &scores, |b, scores| {
            b.iter(|| select(black_box(scores), &options, 42));
        });

        for pool in [Pool::Dataset, Pool::Location] {
            let id = BenchmarkId::new(format!("pooled_by_{pool}"), locations);
            group.bench_with_input(id, &items, |b, items| {
                b.iter(|| select_pooled(black_box(items), pool, &options, 42));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
