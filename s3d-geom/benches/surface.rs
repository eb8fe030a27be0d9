//! The number of coloured points per second drawn from a textured mesh of 32 thousand faces, and from scans
//! of 300 thousand faces with three textures and with a dozen large ones, on one thread and on all. The aim
//! is 15 million per second and core.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::glam::{Vec3, vec2, vec3};
use s3d_geom::{Density, Material, MeshParts, PointCloud, Raster, SurfaceSampler, Texture, TriMesh};
use s3d_synth::scenes::scan_like;
use std::hint::black_box;

/// Returns a bumpy square of 2 × `n`² faces in cells of 10 cm, with texture coordinates in cells.
fn ground(n: u32) -> MeshParts {
    let vertices = || (0..=n).flat_map(|i| (0..=n).map(move |j| (i as f32, j as f32)));
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let faces: Vec<[u32; 3]> = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect();
    MeshParts {
        positions: vertices()
            .map(|(x, y)| vec3(x * 0.1, y * 0.1, ((x * 7.0 + y * 3.0) % 5.0) * 0.01))
            .collect(),
        uvs: vertices().map(|(x, y)| vec2(x, y)).collect(),
        face_uvs: faces.clone(),
        face_materials: vec![0; faces.len()],
        faces,
        ..MeshParts::default()
    }
}

/// Gives `parts` textures of `side`², each with a material.
fn add_textures(parts: &mut MeshParts, count: u32, side: u32) {
    for texture in 0..count {
        let pixels = (0..side * side).map(|i| [i as u8, (i >> 8) as u8, (i >> 16) as u8 ^ texture as u8]);
        let image = Raster::from_vec(side, side, pixels.collect());
        let name = format!("ground {texture}");
        parts
            .materials
            .push(Material { name: name.clone(), color: [0; 3], texture: Some(texture) });
        parts.textures.push(Texture { name, image, wrap: Default::default() });
    }
}

/// Returns 2 × 128² faces with a 2048 × 2048 texture that repeats four times.
fn textured_ground() -> TriMesh {
    let mut parts = ground(128);
    parts.uvs.iter_mut().for_each(|uv| *uv /= 32.0);
    add_textures(&mut parts, 1, 2048);
    TriMesh::new(parts).expect("a valid mesh")
}

/// Returns 301,088 faces with twelve textures of 4096 × 4096 (604 MB), in the layout of scanner software:
/// patches of 4 × 4 cells, each anywhere in any of the textures.
fn ground_of_patches() -> TriMesh {
    const CELLS: u32 = 388;
    const PATCH: u32 = 4;
    /// Patches along the side of a texture. All textures are full.
    const PATCHES: u32 = 28;

    let mut parts = ground(CELLS);
    add_textures(&mut parts, 12, 4096);
    parts.face_uvs.clear();
    parts.uvs.clear();

    let vertices = (0..=PATCH).flat_map(|i| (0..=PATCH).map(move |j| vec2(i as f32, j as f32)));
    let vertices: Vec<_> = vertices.collect();
    let patches = (CELLS / PATCH) * (CELLS / PATCH);
    // 5477 has no divisor in common with the number of places, so every patch has a place of its own.
    let place = |patch: u32| patch * 5477 % (12 * PATCHES * PATCHES);
    for patch in 0..patches {
        let place = place(patch) % (PATCHES * PATCHES);
        let corner = vec2((place % PATCHES) as f32, (place / PATCHES) as f32);
        parts
            .uvs
            .extend(vertices.iter().map(|uv| (corner + *uv / PATCH as f32) / PATCHES as f32));
    }

    for cell in 0..CELLS * CELLS {
        let i = cell / CELLS;
        let j = cell % CELLS;
        let patch = (i / PATCH) * (CELLS / PATCH) + j / PATCH;
        let at = |i: u32, j: u32| patch * (PATCH + 1) * (PATCH + 1) + i * (PATCH + 1) + j;
        let k = i % PATCH;
        let l = j % PATCH;
        parts.face_uvs.push([at(k, l), at(k + 1, l), at(k + 1, l + 1)]);
        parts.face_uvs.push([at(k, l), at(k + 1, l + 1), at(k, l + 1)]);
        let texture = place(patch) / (PATCHES * PATCHES);
        parts.face_materials[2 * cell as usize..][..2].fill(texture);
    }
    TriMesh::new(parts).expect("a valid mesh")
}

fn sample(c: &mut Criterion) {
    let textured = textured_ground();
    let mut parts = textured.clone().into_parts();
    parts.colors = parts
        .positions
        .iter()
        .map(|p: &Vec3| [p.x as u8, p.y as u8, 9])
        .collect();
    parts.face_uvs.clear();
    let vertex_colors = TriMesh::new(parts).expect("a valid mesh");
    let scan = scan_like(300_000, 1);
    let patches = ground_of_patches();
    let points = 1 << 21;

    let mut group = c.benchmark_group("surface");
    group.throughput(Throughput::Elements(points)).sample_size(20);
    for (what, mesh) in [
        ("texture", &textured),
        ("vertex colours", &vertex_colors),
        ("scan", &scan),
        ("dozen textures", &patches),
    ] {
        let sampler = SurfaceSampler::new(mesh, Density::Total(points), 1);
        for threads in [1, 0] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a thread pool");
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
