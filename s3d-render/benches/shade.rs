//! How long do the images of a view take once its hits are known: each modality alone, and all six?
//!
//! Measured with nine views of 1080² and a panorama of 4096 × 2048 from one place, in each of the scenes of
//! [`common::shaded_scene`].

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::{Camera, Pose, Raster};
use s3d_render::{Hits, MipMaps, Modalities, Normals, Scene, Shading, TextureFilter, ViewImages};
use std::hint::black_box;

fn shade(c: &mut Criterion) {
    let mut group = c.benchmark_group("shade");
    group.sample_size(10);
    for name in ["scan-like", "copyroom", "office", "fine-textures"] {
        let Some((mesh, location)) = common::shaded_scene(name) else { continue };
        let scene = Scene::new(&mesh);
        let mip_maps = MipMaps::new(&mesh);
        let index: Vec<u32> = (0..mesh.faces().len() as u32).collect();
        let pretty: Vec<[u8; 3]> = index.iter().map(|f| [*f as u8, (f >> 8) as u8, 7]).collect();
        let panorama = Camera::equirectangular(Pose::level(location, 0.4), 4096);

        for (what, cameras) in [("9 views", common::views(location, 1080)), ("panorama", vec![panorama])] {
            let shots: Vec<(Camera, Hits)> = cameras
                .into_iter()
                .map(|camera| (camera, s3d_render::cast(&scene, &camera)))
                .collect();
            group
                .throughput(Throughput::Elements(shots.iter().map(|(_, hits)| hits.face.len() as u64).sum()));

            let mut bench = |channel: &str, shade: &mut dyn FnMut(&Camera, &Hits)| {
                group.bench_function(BenchmarkId::new(format!("{channel}, {what}"), name), |b| {
                    b.iter(|| shots.iter().for_each(|(camera, hits)| shade(camera, hits)));
                });
            };

            // The images are reused: getting the pages of new ones from the system takes longer than making
            // some of them.
            let filter = TextureFilter::default();
            let mut rgb = Raster::filled(1, 1, [0; 3]);
            let mut normal = rgb.clone();
            let mut semantic = rgb.clone();
            let mut colored = rgb.clone();
            let mut depth = Raster::filled(1, 1, 0);
            let class: Vec<u8> = index.iter().map(|i| (i % 13) as u8).collect();
            let mut classes = Raster::filled(1, 1, 0);
            let mut xyz = s3d_render::xyz_image_half(&shots[0].1, &shots[0].0);
            let mut images = ViewImages::default();

            let shading = Shading {
                scene: &scene,
                mip_maps: &mip_maps,
                filter,
                normal_axes: s3d_geom::NormalAxes::Paper,
                index_of_face: &index,
                color_of_face: &pretty,
            };

            bench("rgb", &mut |c, h| {
                s3d_render::rgb_image_into(&scene, &mip_maps, h, c, &filter, &mut rgb);
            });

            bench("depth", &mut |_, h| s3d_render::depth_image_into(h, &mut depth));

            bench("normal", &mut |c, h| {
                s3d_render::normal_image_into(
                    &scene,
                    h,
                    c,
                    Normals::Flat,
                    s3d_geom::NormalAxes::Paper,
                    &mut normal,
                );
            });

            bench("semantic", &mut |_, h| s3d_render::index_image_into(h, &index, &mut semantic));
            bench("class", &mut |_, h| s3d_render::byte_per_face_image_into(h, &class, 255, &mut classes));
            bench("pretty", &mut |_, h| s3d_render::color_per_face_image_into(h, &pretty, &mut colored));

            let faces = Modalities { faces: true, ..Modalities::default() };
            bench("normal, semantic and pretty at once", &mut |c, h| {
                s3d_render::view_images_into(&shading, h, c, faces, &mut images);
            });

            bench("xyz half", &mut |c, h| s3d_render::xyz_image_half_into(h, c, &mut xyz));
            bench("all six", &mut |c, h| {
                s3d_render::view_images_into(&shading, h, c, Modalities::ALL, &mut images);
            });

            bench("all six, new images", &mut |c, h| {
                drop(black_box(s3d_render::rgb_image(&scene, &mip_maps, h, c)));
                drop(black_box(s3d_render::depth_image(h)));
                drop(black_box(s3d_render::normal_image(&scene, h, c, Normals::Flat)));
                drop(black_box(s3d_render::index_image(h, &index)));
                drop(black_box(s3d_render::color_per_face_image(h, &pretty)));
                drop(black_box(s3d_render::xyz_image_half(h, c)));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, shade);
criterion_main!(benches);
