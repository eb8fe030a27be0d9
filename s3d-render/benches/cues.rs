//! How long does each cue of a view take once its hits and colours are known?
//!
//! Measured with nine views of 1080² and a panorama of 4096 × 2048 from one place, in each of the scenes of
//! [`common::shaded_scene`]. The images of [`view_images_into`] are the measure to hold them against.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::{Camera, Pose, Raster};
use s3d_render::{
    Hits, MipMaps, Modalities, Scene, Shading, TextureFilter, ViewImages, color_segment_image_into,
    corner_image_into, curvature_image_into, euclidean_depth_image_into, face_curvatures, gray_image,
    keypoint_image_into, mask_image_into, occlusion_edge_image_into, reshading_image_into,
    surface_segment_image_into, texture_edge_image_into, view_images_into,
};

/// Draws a cue of a camera's hits and colours.
type Draw<'a> = &'a mut dyn FnMut(&Camera, &Hits, &Raster<[u8; 3]>);

fn cues(c: &mut Criterion) {
    let mut group = c.benchmark_group("cues");
    group.sample_size(10);
    for name in ["scan-like", "copyroom", "office", "fine-textures"] {
        let Some((mesh, location)) = common::shaded_scene(name) else { continue };
        let scene = Scene::new(&mesh);
        let mip_maps = MipMaps::new(&mesh);
        let curvatures = face_curvatures(&mesh);
        let index: Vec<u32> = (0..mesh.faces().len() as u32).collect();
        let pretty: Vec<[u8; 3]> = index.iter().map(|f| [*f as u8, (f >> 8) as u8, 7]).collect();
        let shading = Shading {
            scene: &scene,
            mip_maps: &mip_maps,
            filter: TextureFilter::default(),
            normal_axes: s3d_geom::NormalAxes::Paper,
            index_of_face: &index,
            color_of_face: &pretty,
        };

        let panorama = Camera::equirectangular(Pose::level(location, 0.4), 4096);
        for (what, cameras) in [("9 views", common::views(location, 1080)), ("panorama", vec![panorama])] {
            let mut images = ViewImages::default();
            let shots: Vec<(Camera, Hits, Raster<[u8; 3]>)> = cameras
                .into_iter()
                .map(|camera| {
                    let hits = s3d_render::cast(&scene, &camera);
                    view_images_into(&shading, &hits, &camera, Modalities::ALL, &mut images);
                    (camera, hits, images.rgb.clone())
                })
                .collect();
            let pixels = shots.iter().map(|(_, hits, _)| hits.face.len() as u64).sum();
            group.throughput(Throughput::Elements(pixels));

            let mut bench = |cue: &str, draw: Draw<'_>| {
                group.bench_function(BenchmarkId::new(format!("{cue}, {what}"), name), |b| {
                    b.iter(|| shots.iter().for_each(|(camera, hits, rgb)| draw(camera, hits, rgb)));
                });
            };

            let mut bytes = Raster::filled(1, 1, 0u8);
            let mut numbers = Raster::filled(1, 1, 0u16);
            let mut colors = Raster::filled(1, 1, [0; 3]);

            bench("the six images of views", &mut |camera, hits, _| {
                view_images_into(&shading, hits, camera, Modalities::ALL, &mut images);
            });
            bench("depth_euclidean", &mut |camera, hits, _| {
                euclidean_depth_image_into(hits, camera, 512.0, &mut numbers);
            });
            bench("reshading", &mut |camera, hits, _| {
                reshading_image_into(&scene, hits, camera, &mut bytes);
            });
            bench("principal_curvature", &mut |camera, hits, _| {
                curvature_image_into(&scene, hits, camera, &curvatures, &mut colors);
            });
            bench("edge_occlusion", &mut |camera, hits, _| {
                occlusion_edge_image_into(&scene, hits, camera, &mut bytes);
            });
            bench("gray levels, edge_texture", &mut |camera, _, rgb| {
                texture_edge_image_into(&gray_image(rgb), camera.is_panorama(), &mut bytes);
            });
            bench("gray levels, keypoints2d", &mut |camera, _, rgb| {
                keypoint_image_into(&gray_image(rgb), camera.is_panorama(), &mut bytes);
            });
            bench("keypoints3d", &mut |camera, hits, _| {
                corner_image_into(&scene, hits, camera, &mut bytes);
            });
            bench("segment_unsup2d", &mut |camera, hits, rgb| {
                color_segment_image_into(rgb, hits, camera.is_panorama(), &mut numbers);
            });
            bench("segment_unsup25d", &mut |camera, hits, _| {
                surface_segment_image_into(&scene, hits, camera, &mut numbers);
            });
            bench("mask_valid", &mut |_, hits, _| mask_image_into(hits, &mut bytes));
        }
    }
    group.finish();
}

criterion_group!(benches, cues);
criterion_main!(benches);
