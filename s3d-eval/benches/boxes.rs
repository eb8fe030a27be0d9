//! How long do the metrics of `det` and `panoptic` take, without files? There are as many boxes as in S3DIS,
//! with ten detections each, and a panorama of the published size.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use s3d_eval::boxes::{Detection, GroundTruth, Rule, average_precision};
use s3d_eval::panoptic::{PanopticCounts, Segment};
use s3d_label::Class;
use std::hint::black_box;

/// The number of rooms.
const ROOMS: u32 = 272;
/// The number of boxes in a room.
const BOXES: usize = 36;
/// The number of detections of a box.
const COPIES: usize = 10;

fn boxes() -> (Vec<GroundTruth>, Vec<Detection>) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut truth = Vec::new();
    let mut detections = Vec::new();
    for room in 0..ROOMS {
        for i in 0..BOXES {
            let class = Class::S3DIS[i % 12];
            let low: [f64; 3] = std::array::from_fn(|_| rng.random_range(0.0..8.0));
            let size: [f64; 3] = std::array::from_fn(|_| rng.random_range(0.2..2.0));
            let bbox =
                |by: f64| std::array::from_fn(|k| if k < 3 { low[k] + by } else { low[k - 3] + size[k - 3] });
            truth.push(GroundTruth { room, class, bbox: bbox(0.0) });
            for _ in 0..COPIES {
                let score = rng.random();
                let by = rng.random_range(-0.5..0.2);
                detections.push(Detection { room, class, score, bbox: bbox(by) });
            }
        }
    }
    (truth, detections)
}

fn det(c: &mut Criterion) {
    let mut group = c.benchmark_group("det");
    let (truth, detections) = boxes();
    group
        .sample_size(10)
        .throughput(Throughput::Elements(detections.len() as u64));
    for rule in [Rule::Mmdetection3d, Rule::Open3dMl] {
        group.bench_function(BenchmarkId::from_parameter(format!("{rule:?}")), |b| {
            b.iter(|| average_precision(black_box(&truth), &detections, &Class::S3DIS[..12], 0.5, rule));
        });
    }
    group.finish();
}

fn panoptic(c: &mut Criterion) {
    let mut group = c.benchmark_group("panoptic");
    let [width, height] = [4096u32, 2048];

    // 128 rectangles, and the same ones moved to the side. Every third row is moved further, for short runs.
    let id = |x: u32, y: u32| 1 + x / 256 + 16 * (y / 256);
    let pixels = |shift: u32| -> Vec<u32> {
        let place = |at: u32| ((at + shift * (1 + at / width % 3)) % width, at / width);
        (0..width * height)
            .map(|at| {
                let (x, y) = place(at);
                id(x, y)
            })
            .collect()
    };
    let segments: Vec<Segment> = (1..=128).map(|id| Segment { id, class: id as usize % 13 }).collect();
    let [truth, predicted] = [0, 20].map(pixels);

    group
        .sample_size(10)
        .throughput(Throughput::Elements(u64::from(width * height)));
    group.bench_function("panorama", |b| {
        b.iter(|| {
            let mut counts = PanopticCounts::new(13);
            counts.add(black_box(&truth), &segments, &predicted, &segments).unwrap();
            counts
        });
    });
    group.finish();
}

criterion_group!(benches, det, panoptic);
criterion_main!(benches);
