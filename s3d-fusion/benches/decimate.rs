//! The time to decimate walls with noise and untidy scans of growing size under the default bound.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_fusion::{DecimateOptions, MeshColumns, decimate};
use s3d_geom::glam::Vec3;
use s3d_geom::{MeshParts, primitives::grid};
use s3d_synth::scenes::scan_like;

/// A wall in cells of 1 cm with 2 mm of noise.
fn wall(faces: usize) -> MeshParts {
    let cells = (faces as f32 / 2.0).sqrt() as u32;
    let size = 0.01 * cells as f32;
    let mut wall = grid(Vec3::ZERO, Vec3::X * size, Vec3::Z * size, [cells, cells]);
    let mut state = 1u32;
    for p in &mut wall.positions {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        p.y += 0.002 * (2.0 * (state >> 8) as f32 / (1 << 24) as f32 - 1.0);
    }
    wall
}

fn decimate_meshes(c: &mut Criterion) {
    let mut group = c.benchmark_group("decimate");
    group.sample_size(10);
    for faces in [500_000, 2_000_000] {
        let (wall, scan) = (wall(faces), scan_like(faces, 1));
        let meshes =
            [("wall", &wall.positions[..], &wall.faces[..]), ("scan", scan.positions(), scan.faces())];
        for (name, positions, faces) in meshes {
            let mesh = MeshColumns { positions, faces, colors: &[] };
            group.throughput(Throughput::Elements(faces.len() as u64));
            group.bench_with_input(BenchmarkId::new(name, faces.len()), &mesh, |b, mesh| {
                b.iter(|| decimate(mesh, &DecimateOptions::default()));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, decimate_meshes);
criterion_main!(benches);
