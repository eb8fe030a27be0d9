//! The number of points per second that a footprint takes, in the order of a scan and shuffled, and the time
//! to draw the outline of a 400 m² hall.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::{Vec3, vec3};
use s3d_geom::{FootprintBuilder, FootprintOptions};
use std::hint::black_box;

fn footprint(c: &mut Criterion) {
    let n = 1_000_000;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut coordinate = || f64::from(rng.next_u32()) as f32 * (20.0 / 4_294_967_296.0);
    let shuffled: Vec<Vec3> = (0..n).map(|_| vec3(coordinate(), coordinate(), 0.0)).collect();
    let mut in_order = shuffled.clone();
    in_order.sort_by(|a, b| {
        ((a.x * 20.0) as i32, a.y)
            .partial_cmp(&((b.x * 20.0) as i32, b.y))
            .expect("numbers")
    });

    let collect = |points: &[Vec3]| {
        let mut builder = FootprintBuilder::new(FootprintOptions::default());
        points.iter().for_each(|&p| builder.add(p));
        builder
    };

    let mut group = c.benchmark_group("footprint");
    group.sample_size(10).throughput(Throughput::Elements(n));
    for (order, points) in [("in order", &in_order), ("shuffled", &shuffled)] {
        group.bench_function(format!("add, {order}"), |b| b.iter(|| collect(black_box(points))));
    }
    let builder = collect(&shuffled);
    group.bench_function("finish", |b| b.iter(|| builder.finish()));
    group.finish();
}

criterion_group!(benches, footprint);
criterion_main!(benches);
