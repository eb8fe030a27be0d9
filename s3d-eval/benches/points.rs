//! How many points are evaluated in a second, from text files of the truth and NPY or NPZ files of
//! predictions, and in memory?

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use s3d_dataset::s3d_io::cloud::NpyWriter;
use s3d_dataset::{DataSet, Export, ExportOptions};
use s3d_eval::points::{InstanceMatches, PredictedInstance, SemanticCounts, TrueInstance, instance_ap};
use s3d_eval::{Context, EvalOptions, Protocol, evaluate};
use s3d_synth::{Building, ScanOptions};
use std::fs;
use std::hint::black_box;
use std::io::Write;
use std::path::Path;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Exports the built-in scene with millions of points.
fn data_set(dir: &Path) -> DataSet {
    let scan = ScanOptions { points_per_m2: 60.0, ..ScanOptions::default() };
    let scene = Building::demo()
        .build()
        .unwrap()
        .write_scan(&dir.join("scan"), &scan, || true)
        .unwrap();
    let options = ExportOptions {
        views: 1,
        size: 32,
        pano_width: 64,
        points_per_m2: 8000.0,
        ..ExportOptions::default()
    };
    let out = dir.join("data set");
    Export::new([scene])
        .options(options)
        .run(&out, &Context::default())
        .unwrap()
        .unwrap();
    DataSet::open(&out).unwrap()
}

fn npy(kind: &str, shape: &[u64], bytes: &[u8]) -> Vec<u8> {
    let mut array = NpyWriter::new(Vec::new(), Path::new("memory"), kind, shape).unwrap();
    array.put(bytes).unwrap();
    array.into_inner().unwrap()
}

fn npz(path: &Path, arrays: &[(&str, Vec<u8>)]) {
    let mut zip = ZipWriter::new(fs::File::create(path).unwrap());
    let options = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Stored)
        .large_file(true);
    for (name, bytes) in arrays {
        zip.start_file(format!("{name}.npy"), options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}

/// Writes predictions in four forms, and returns the number of points.
fn write_predictions(dir: &Path, data: &DataSet) -> u64 {
    let ctx = Context::default();
    for form in ["labels", "logits", "masks", "segments"] {
        fs::create_dir(dir.join(form)).unwrap();
    }
    let mut points = 0;
    for room in data.tree_rooms(1).unwrap() {
        let mut labels = Vec::new();
        let mut ids = Vec::new();
        let mut classes = Vec::new();
        for (id, instance) in (0i64..).zip(&room.instances) {
            let count = data.point_count(instance, &ctx).unwrap() as usize;
            let class = instance.class.index() as i64;
            labels.extend(class.to_le_bytes().repeat(count));
            ids.extend(id.to_le_bytes().repeat(count));
            classes.extend(class.to_le_bytes());
        }

        let [n, k] = [labels.len() / 8, classes.len() / 8];
        points += n as u64;
        let of_points = npy("<i8", &[n as u64], &labels);
        let logits: Vec<u8> = labels
            .as_chunks::<8>()
            .0
            .iter()
            .flat_map(|class| (0..13).map(move |i| f32::from(i == class[0])))
            .flat_map(f32::to_le_bytes)
            .collect();
        let masks: Vec<u8> = ids
            .as_chunks::<8>()
            .0
            .iter()
            .flat_map(|id| (0..k).map(move |k| u8::from(k as i64 == i64::from_le_bytes(*id))))
            .collect();
        let scores = npy("<f4", &[k as u64], &0.5f32.to_le_bytes().repeat(k));

        let name = format!("Area_1_{}", room.name);
        fs::write(dir.join(format!("labels/{name}.npy")), &of_points).unwrap();
        fs::write(dir.join(format!("logits/{name}.npy")), npy("<f4", &[n as u64, 13], &logits)).unwrap();
        npz(
            &dir.join(format!("masks/{name}.npz")),
            &[
                ("masks", npy("|b1", &[n as u64, k as u64], &masks)),
                ("classes", npy("<i8", &[k as u64], &classes)),
                ("scores", scores),
            ],
        );
        npz(
            &dir.join(format!("segments/{name}.npz")),
            &[("instance", npy("<i8", &[n as u64], &ids)), ("semantic", of_points)],
        );
    }
    points
}

fn files(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let data = data_set(dir.path());
    let points = write_predictions(dir.path(), &data);
    for (protocol, form) in [
        (Protocol::Sem3d, "labels"),
        (Protocol::Sem3d, "logits"),
        (Protocol::InstAp, "masks"),
        (Protocol::InstCov, "segments"),
    ] {
        let mut group = c.benchmark_group(protocol.name());
        group.sample_size(10).throughput(Throughput::Elements(points));
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let root = data.layout().root();
            group.bench_function(format!("{form}, {threads} threads"), |b| {
                b.iter(|| {
                    pool.install(|| {
                        let options = EvalOptions::default();
                        evaluate(protocol, root, &dir.path().join(form), &options, &Context::default())
                            .unwrap()
                    })
                });
            });
        }
        group.finish();
    }
}

fn memory(c: &mut Criterion) {
    let mut group = c.benchmark_group("in memory");
    let points: Vec<(i64, i64)> = (0..1_000_000).map(|i| (i / 9000 % 13, i / 7000 % 13)).collect();
    group.throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("classes", |b| {
        b.iter(|| {
            let mut counts = SemanticCounts::new(13);
            counts.add(black_box(&points).iter().copied());
            counts
        });
    });

    let truth: Vec<TrueInstance> = (0..60).map(|i| TrueInstance { class: i % 13, points: 1000 }).collect();
    let predicted = (0..120usize).map(|i| PredictedInstance {
        class: i % 13,
        score: (i * 37 % 101) as f64,
        points: 1000,
        void: 0,
        overlaps: vec![(i % 60, 800), ((i + 1) % 60, 100)],
    });
    let room = InstanceMatches::new(&truth, &predicted.collect::<Vec<_>>(), 13);
    let rooms = vec![&room; 68];
    group.throughput(Throughput::Elements(68));
    group.bench_function("average precision of 68 rooms", |b| b.iter(|| instance_ap(black_box(&rooms))));
    group.finish();
}

criterion_group!(benches, memory, files);
criterion_main!(benches);
