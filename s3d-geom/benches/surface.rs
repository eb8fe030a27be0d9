//! How many coloured points a second come from a textured mesh of 32 thousand faces, and from a scan of 300
//! thousand with three textures, on one thread and on all? The aim is 15 million a second and core.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::glam::{Vec3, vec2, vec3};
use s3d_geom::{Density, Material, MeshParts, PointCloud, Raster, SurfaceSampler, Texture, TriMesh};
use s3d_synth::scenes::scan_like;
use std::hint::black_box;

/// A bumpy 12.8 m square of 2 × 128² faces under a 2048 × 2048 texture that repeats four times.
fn textured_ground() -> TriMesh {
    let n = 128u32;
    let vertices = || (0..=n).flat_map(|i| (0..=n).map(move |j| (i as f32, j as f32)));
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let faces: Vec<[u32; 3]> = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect();
    let pixels = (0..2048u32 * 2048).map(|i| [i as u8, (i >> 8) as u8, (i >> 16) as u8]).collect();
    TriMesh::new(MeshParts {
        positions: vertices()
            .map(|(x, y)| vec3(x * 0.1, y * 0.1, ((x * 7.0 + y * 3.0) % 5.0) * 0.01))
            .collect(),
        uvs: vertices().map(|(x, y)| vec2(x, y) / 32.0).collect(),
        face_uvs: faces.clone(),
        face_materials: vec![0; faces.len()],
        faces,
        materials: vec![Material { name: "ground".into(), color: [0; 3], texture: Some(0) }],
        textures: vec![Texture {
            name: "ground".into(),
            image: Raster::from_vec(2048, 2048, pixels),
            wrap: Default::default(),
        }],
        ..MeshParts::default()
    })
    .expect("a valid mesh")
}

fn sample(c: &mut Criterion) {
    let textured = textured_ground();
    let mut parts = textured.clone().into_parts();
    parts.colors = parts.positions.iter().map(|p: &Vec3| [p.x as u8, p.y as u8, 9]).collect();
    parts.face_uvs.clear();
    let vertex_colors = TriMesh::new(parts).expect("a valid mesh");
    let scan = scan_like(300_000, 1);
    let points = 1 << 21;

    let mut group = c.benchmark_group("surface");
    group.throughput(Throughput::Elements(points)).sample_size(20);
    for (what, mesh) in [("texture", &textured), ("vertex colours", &vertex_colors), ("scan", &scan)] {
        let sampler = SurfaceSampler::new(mesh, Density::Total(points), 1);
        for threads in [1, 0] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            let name = format!("{what}, {} threads", pool.current_num_threads());
            let mut cloud = PointCloud::default();
            group.bench_function(name, |b| {
                b.iter(|| pool.install(|| sampler.sample(0..points, black_box(&mut cloud))));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, sample);
criterion_main!(benches);
