//! The time to build, write and read the label table of a data set, up to ten times the published size.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_label::{Class, Label, LabelTable, Room, RoomType, number_area};
use std::hint::black_box;

/// Returns about `count` labels in a fixed random order, spread evenly over the rooms and classes of six
/// areas.
fn labels(count: u32) -> Vec<Label> {
    let mut labels = Vec::new();
    for area in 1..=6 {
        let instances = (0..count / 6).map(|i| {
            let room =
                Room { room_type: RoomType::S3DIS[(i / 13 % 11) as usize], number: 1 + i / 13 / 11 % 40 };
            (room, Class::S3DIS[(i % 13) as usize], 1 + i)
        });
        labels.extend(number_area(area, instances).unwrap().into_iter().map(|i| i.label));
    }
    let mut state = 3u64;
    for i in (1..labels.len()).rev() {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        labels.swap(i, (state >> 33) as usize % (i + 1));
    }
    labels
}

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("table");
    group.sample_size(20);
    for count in [981u32, 9_815, 98_150] {
        let labels = labels(count);
        let table = LabelTable::from_labels(labels.iter().copied()).unwrap();
        let names = table.names();

        group.throughput(Throughput::Elements(labels.len() as u64));
        group.bench_with_input(BenchmarkId::new("from_labels", count), &labels, |b, labels| {
            b.iter(|| LabelTable::from_labels(black_box(labels).iter().copied()).unwrap());
        });
        group.bench_with_input(BenchmarkId::new("names", count), &table, |b, table| {
            b.iter(|| black_box(table).names());
        });
        group.bench_with_input(BenchmarkId::new("from_names", count), &names, |b, names| {
            b.iter(|| LabelTable::from_names(black_box(names)).unwrap());
        });
        group.bench_with_input(BenchmarkId::new("id_of", count), &labels, |b, labels| {
            b.iter(|| labels.iter().filter_map(|label| table.id_of(black_box(label))).count());
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
