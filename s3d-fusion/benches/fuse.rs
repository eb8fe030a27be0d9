//! The number of depth pictures per second that are fused, and the bytes for each voxel: 18 pictures of
//! 640 × 480 pixels at a location of the built-in building, cells of 1 and 2 cm, one thread and all.

// The bytes of voxels are no time, so the bench prints them itself.
#![allow(clippy::print_stderr)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::{BvhBuildParams, ray::Ray, triangle::Triangle};
use rayon::prelude::*;
use s3d_fusion::{Fusion, FusionOptions, RangeImage, RangeKind, SensorNoise};
use s3d_geom::glam::{Vec3A, dvec2};
use s3d_geom::{Lens, PhotoLens, Pose, Raster, TriMesh};
use s3d_synth::Building;
use std::time::Duration;

/// A mesh whose depth is seen by rays.
struct Room {
    mesh: TriMesh,
    bvh: Bvh2,
    triangles: Vec<Triangle>,
    poses: Vec<Pose>,
}

impl Room {
    /// The built-in building with 18 poses at its first location.
    fn new() -> Self {
        let scene = Building { texture_scale: 0.05, ..Building::demo() }
            .build()
            .expect("a building");
        let mesh = scene.mesh;
        let all: Vec<Triangle> = (0..mesh.faces().len() as u32)
            .map(|face| {
                let [v0, v1, v2] = mesh.triangle(face).map(Vec3A::from);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let bvh = build_bvh2_from_tris(&all, BvhBuildParams::medium_build(), &mut Duration::default());
        let triangles = bvh.primitive_indices.iter().map(|&i| all[i as usize]).collect();

        let turns =
            |at: Pose| (0..18).map(move |k| at.turned(f64::from(k % 6), f64::from(k / 6) * 0.6 - 0.6));
        let level = |at: s3d_geom::glam::DVec3| Pose::level(at, 0.3);
        let poses = scene
            .locations
            .iter()
            .take(1)
            .flat_map(|l| turns(level(l.position)))
            .collect();
        Self { mesh, bvh, triangles, poses }
    }

    /// The z-depth that a camera sees.
    fn depth(&self, pose: &Pose, lens: &PhotoLens) -> Raster<f32> {
        let [width, height] = lens.size();
        let turn = pose.opencv_from_world().transpose();
        let pixels = (0..width * height).into_par_iter().map(|i| {
            let pixel = dvec2(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
            let ray = lens
                .direction(pixel)
                .map_or(Vec3A::NAN, |d| (turn * (d / d.z)).as_vec3a());
            let ray = Ray::new_inf(pose.location.as_vec3().into(), ray);
            let mut hit = obvhs::ray::RayHit::none();
            let found = self
                .bvh
                .ray_traverse(ray, &mut hit, |ray, k| self.triangles[k].intersect(ray));
            if found { hit.t } else { f32::NAN }
        });
        Raster::from_vec(width, height, pixels.collect())
    }
}

fn lens() -> PhotoLens {
    let lens = Lens::new([640, 480], dvec2(525.0, 525.0), dvec2(320.0, 240.0), [0.0; 5]);
    PhotoLens::Straight(lens.expect("a lens"))
}

fn fuse(c: &mut Criterion) {
    let room = Room::new();
    let image = |pose: &Pose| {
        let depth = room.depth(pose, &lens());
        RangeImage::from_depth(*pose, lens(), RangeKind::Depth, depth, SensorNoise::STRUCTURED_LIGHT)
    };
    let images: Vec<RangeImage> = room.poses.iter().map(|pose| image(pose).expect("a picture")).collect();
    eprintln!("{} pictures of {} faces", images.len(), room.mesh.faces().len());

    let mut group = c.benchmark_group("fuse");
    group
        .throughput(Throughput::Elements(images.len() as u64))
        .sample_size(10);
    for cell_m in [0.01, 0.02] {
        for threads in [1, rayon::current_num_threads()] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("threads");
            let run = || {
                let mut fusion =
                    Fusion::new(FusionOptions { cell_m, ..FusionOptions::default() }).expect("options");
                images.iter().for_each(|image| fusion.add(image).expect("near"));
                fusion
            };
            let fusion = pool.install(run);
            let bytes = fusion.bytes() as f64;
            eprintln!(
                "{} blocks, {:.2} bytes a voxel",
                fusion.blocks(),
                bytes / (fusion.blocks() * 512) as f64
            );
            let name = BenchmarkId::new(format!("{cell_m} m"), format!("{threads} threads"));
            group.bench_function(name, |b| b.iter(|| pool.install(run).blocks()));
            let name = BenchmarkId::new(format!("{cell_m} m, mesh"), format!("{threads} threads"));
            group.bench_function(name, |b| b.iter(|| pool.install(|| fusion.mesh()).map(|m| m.faces.len())));
        }
    }
}

criterion_group!(benches, fuse);
criterion_main!(benches);
