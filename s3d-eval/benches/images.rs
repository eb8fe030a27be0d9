//! How many panoramas are evaluated in a second on one core? The aim is a thousand of 1024 × 512 in a
//! minute. The panoramas of 4096 × 2048 show the cost of decoding.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_dataset::{DataSet, Export, ExportOptions};
use s3d_eval::{Context, EvalOptions, ImageKind, Protocol, evaluate};
use s3d_geom::Raster;
use s3d_io::dataset::{Domain, Frame};
use s3d_io::image::encode_gray8;
use s3d_synth::{Building, ScanOptions};
use std::fs;
use std::hint::black_box;

fn images(criterion: &mut Criterion) {
    let dir = tempfile::tempdir().expect("a folder");
    let scan = ScanOptions { points_per_m2: 100.0, ..ScanOptions::default() };
    let building = Building::demo().build().expect("the built-in scene");
    let scene = building
        .write_scan(&dir.path().join("scan"), &scan, || true)
        .expect("a scan");
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");

    for pano_width in [1024, 4096] {
        let truth = dir.path().join(format!("{pano_width}"));
        let options =
            ExportOptions { views: 1, size: 64, pano_width, points_per_m2: 5.0, ..ExportOptions::default() };
        Export::new([&scene])
            .options(options)
            .run(&truth, &Context::default())
            .expect("an export");
        let data = DataSet::open(&truth).expect("a data set");
        let panoramas: Vec<_> = data
            .images(1)
            .into_iter()
            .filter(|image| image.frame == Frame::Panorama)
            .collect();

        for (protocol, variant, domain) in [
            (Protocol::SemPano, "hohonet", Domain::Semantic),
            (Protocol::Depth, "hohonet", Domain::Depth),
            (Protocol::Depth, "unifuse", Domain::Depth),
            (Protocol::Depth, "marigold", Domain::Depth),
            (Protocol::DepthEdge, "depth-pro", Domain::Depth),
            (Protocol::Normal, "dsine", Domain::Normal),
            (Protocol::Normal, "omnidata", Domain::Normal),
        ] {
            let predictions = dir.path().join(format!("{domain} {pano_width}"));
            fs::create_dir_all(&predictions).expect("a folder");
            for image in &panoramas {
                let from = image.path(data.layout(), domain);
                let to = predictions.join(format!("{}.png", image.stem()));
                if domain == Domain::Semantic {
                    let guess = (0..1024 * 512).map(|i| (i / 700 % 13) as u8).collect();
                    let guess = Raster::from_vec(1024, 512, guess);
                    fs::write(to, encode_gray8(&guess)).expect("a prediction");
                } else {
                    fs::copy(from, to).expect("a prediction");
                }
            }

            let mut options = EvalOptions::default();
            options.variant = Some(variant.to_owned());
            options.images = Some(ImageKind::Panoramas);
            let mut group = criterion.benchmark_group(protocol.name());
            group
                .sample_size(10)
                .throughput(Throughput::Elements(panoramas.len() as u64));
            group.bench_function(BenchmarkId::new(variant, pano_width), |bencher| {
                let run = || evaluate(protocol, &truth, &predictions, &options, &Context::default());
                bencher.iter(|| one.install(|| black_box(run().expect("scores"))));
            });
        }
    }
}

criterion_group!(benches, images);
criterion_main!(benches);
