//! How many rays and pixels a second does one core render: visibility, then each modality made from it? And
//! how much faster is the visibility pass than single rays?
//!
//! Measured with a generated room of 250,000 faces, a scan-like mesh of 300,000 faces in several rooms, and
//! the real scan next to the project if it is there. `S3D_BENCH_MESH` names another OBJ file (Y up), which is
//! seen from the middle of its box.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::glam::{DVec3, dvec3};
use s3d_geom::{Camera, Pose, TriMesh};
use s3d_render::{Caster, Hits, MipMaps, Normals, Scene};
use s3d_synth::scenes::scan_like;
use std::path::Path;

fn meshes() -> Vec<(String, TriMesh, DVec3)> {
    let mut meshes = vec![
        ("room".to_owned(), s3d_synth::scenes::classroom(250_000), s3d_synth::scenes::CLASSROOM_LOCATION),
        ("scan-like".to_owned(), scan_like(300_000, 1), dvec3(3.0, 2.5, 1.5)),
    ];
    if let Some((path, location)) = common::real_scan() {
        meshes.push(("copyroom".to_owned(), common::read_obj(&path), location));
    }
    if let Ok(path) = std::env::var("S3D_BENCH_MESH") {
        let mesh = common::read_obj(Path::new(&path));
        let middle = mesh.aabb().center().as_dvec3();
        meshes.push((path, mesh, middle));
    }
    meshes
}

fn rays(c: &mut Criterion) {
    let mut group = c.benchmark_group("rays");
    group.sample_size(10);
    for (name, mesh, location) in &meshes() {
        let scene = Scene::new(mesh);
        let mut caster = Caster::new(&scene);
        let mut hits = Hits::default();

        let views = common::views(*location, 1080);
        group.throughput(Throughput::Elements(views.len() as u64 * 1080 * 1080));
        group.bench_function(BenchmarkId::new("perspective, 9 views", name), |b| {
            b.iter(|| views.iter().for_each(|v| caster.cast_into(v, 1, &mut hits)));
        });

        group.throughput(Throughput::Elements(1080 * 1080 / 36));
        group.bench_function(BenchmarkId::new("perspective, one ray at a time, every 6th", name), |b| {
            b.iter(|| s3d_render::cast_ray_by_ray(&scene, &views[0], 6));
        });
        group.throughput(Throughput::Elements(views.len() as u64 * 1080 * 1080 / 16));
        group.bench_function(BenchmarkId::new("perspective, 9 views, every 4th", name), |b| {
            b.iter(|| views.iter().for_each(|v| caster.cast_into(v, 4, &mut hits)));
        });

        let panorama = Camera::equirectangular(Pose::level(*location, 0.4), 4096);
        group.throughput(Throughput::Elements(4096 * 2048));
        group.bench_function(BenchmarkId::new("panorama", name), |b| {
            b.iter(|| caster.cast_into(&panorama, 1, &mut hits));
        });

        group.throughput(Throughput::Elements(mesh.faces().len() as u64));
        group.bench_function(BenchmarkId::new("build the scene (faces)", name), |b| {
            b.iter(|| Scene::new(mesh))
        });
    }
    group.finish();
}

fn channels(c: &mut Criterion) {
    let mut group = c.benchmark_group("channels");
    group.sample_size(20);
    for (name, mesh, location) in &meshes() {
        let scene = Scene::new(mesh);
        let mip_maps = MipMaps::new(mesh);
        let per_face: Vec<u32> = (0..mesh.faces().len() as u32).collect();
        let colors: Vec<[u8; 3]> = per_face.iter().map(|f| [*f as u8, (f >> 8) as u8, 7]).collect();

        let cameras = [
            ("1080²", common::views(*location, 1080)[0]),
            ("panorama", Camera::equirectangular(Pose::level(*location, 0.4), 4096)),
        ];

        for (what, camera) in &cameras {
            let hits = s3d_render::cast(&scene, camera);
            group.throughput(Throughput::Elements(hits.face.len() as u64));
            let id = |channel: &str| BenchmarkId::new(format!("{channel}, {what}"), name);
            group.bench_function(id("rgb"), |b| {
                b.iter(|| s3d_render::rgb_image(&scene, &mip_maps, &hits, camera))
            });
            group.bench_function(id("depth"), |b| b.iter(|| s3d_render::depth_image(&hits)));
            group.bench_function(id("flat normals"), |b| {
                b.iter(|| s3d_render::normal_image(&scene, &hits, camera, Normals::Flat));
            });
            group.bench_function(id("xyz, half"), |b| b.iter(|| s3d_render::xyz_image_half(&hits, camera)));
            group.bench_function(id("index"), |b| b.iter(|| s3d_render::index_image(&hits, &per_face)));
            group.bench_function(id("colour per face"), |b| {
                b.iter(|| s3d_render::color_per_face_image(&hits, &colors));
            });
        }
        group.bench_function(BenchmarkId::new("build the mip maps", name), |b| b.iter(|| MipMaps::new(mesh)));
    }
    group.finish();
}

criterion_group!(benches, rays, channels);
criterion_main!(benches);
