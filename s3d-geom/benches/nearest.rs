//! The number of annotated points per second, 5 mm off a mesh, that find their nearest face. The mesh grows,
//! points are in the order of a scan or shuffled, and the mesh is a tidy ground or a scan. The aim is three
//! million per second and core.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::glam::vec3;
use s3d_geom::{Density, Nearest, NearestFaces, PointCloud, SurfaceSampler, TriMesh};
use s3d_synth::scenes::scan_like;

/// Returns a bumpy square of 2·n² faces, each about 10 cm large.
fn ground(n: u32) -> TriMesh {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let positions = (0..=n).flat_map(|i| (0..=n).map(move |j| (i as f32, j as f32)));
    let faces = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).flat_map(|(i, j)| {
        [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    });
    let bumpy = |(x, y): (f32, f32)| vec3(x * 0.1, y * 0.1, ((x * 7.0 + y * 3.0) % 5.0) * 0.02);
    TriMesh::from_faces(positions.map(bumpy).collect(), faces.collect()).expect("a valid mesh")
}

fn vote(c: &mut Criterion) {
    let points = 1_000_000;
    let mut group = c.benchmark_group("nearest");
    group.throughput(Throughput::Elements(points)).sample_size(10);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread pool");

    let meshes = [40, 125, 400].map(|n| ("", ground(n)));
    for (of, mesh) in meshes.into_iter().chain([("scan, ", scan_like(300_000, 1))]) {
        let faces = NearestFaces::new(&mesh);
        let mut cloud = PointCloud::default();
        SurfaceSampler::new(&mesh, Density::Total(points), 1).sample(0..points, &mut cloud);
        let mut scan = cloud.positions;
        for (p, &face) in scan.iter_mut().zip(&cloud.faces) {
            *p += mesh.normal(face) * 0.005;
        }

        // 7919 is prime and not a divisor, so every point comes once, far from the point before.
        let shuffled = (0..scan.len()).map(|i| scan[i * 7919 % scan.len()]).collect();

        for (order, points) in [("in order", scan), ("shuffled", shuffled)] {
            let mut out: Vec<Nearest> = Vec::new();
            let name = format!("{of}{order}");
            group.bench_with_input(BenchmarkId::new(name, mesh.faces().len()), &points, |b, points| {
                b.iter(|| pool.install(|| faces.nearest_many(points, &mut out)));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, vote);
criterion_main!(benches);
