//! The number of points per second that vote, in the order of an annotated tree (instance by instance) and in
//! any order; and the cost of reading the winners.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_label::{LabelId, Votes};
use std::hint::black_box;

/// Returns the next number of a fixed pseudo-random stream.
fn next(state: &mut u64) -> u64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    *state >> 33
}

/// Returns points of instances that cover 40 faces each and share a quarter of them with the next instance.
fn points(count: usize, faces: u32) -> Vec<(u32, LabelId)> {
    let mut state = 1;
    let per_instance = count * 30 / faces as usize;
    (0..count)
        .map(|i| {
            let instance = (i / per_instance) as u32;
            let face = (instance * 30 + next(&mut state) as u32 % 40) % faces;
            (face, LabelId(1 + instance))
        })
        .collect()
}

fn vote(points: &[(u32, LabelId)], faces: u32) -> Votes {
    let mut votes = Votes::new(faces as usize);
    for &(face, label) in points {
        votes.add(face, label, 0.002);
    }
    votes
}

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("vote");
    group.sample_size(20);
    for (count, faces) in [(100_000, 2_000), (4_000_000, 160_000)] {
        let mut points = points(count, faces);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_with_input(BenchmarkId::new("by_instance", count), &points, |b, points| {
            b.iter(|| vote(black_box(points), faces));
        });

        let votes = vote(&points, faces);
        let mut state = 2;
        for i in (1..points.len()).rev() {
            points.swap(i, next(&mut state) as usize % (i + 1));
        }
        group.bench_with_input(BenchmarkId::new("any_order", count), &points, |b, points| {
            b.iter(|| vote(black_box(points), faces));
        });

        group.throughput(Throughput::Elements(u64::from(faces)));
        group.bench_with_input(BenchmarkId::new("label_of_face", faces), &votes, |b, votes| {
            b.iter(|| black_box(votes).label_of_face());
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
