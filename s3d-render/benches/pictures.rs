//! How long does the RGB image of a view take from pictures, and how long does it take to make a location's
//! cube map?
//!
//! Measured with nine views of 1080² and a panorama of 4096 × 2048, from a cube map of 2,176² pixels a
//! face with and without holes. The cube map is made from 18 captures of 1280 × 1024 pixels, from a sky box
//! of 1,024² and from a panorama of 4096 × 2048.

mod common;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use s3d_geom::glam::{DVec2, dvec2};
use s3d_geom::{Camera, Lens, Pose, Raster};
use s3d_render::{
    Capture, CubeMap, Hits, MipMaps, Scene, SkyBoxTurn, StitchOptions, TextureFilter, Unseen,
    picture_image_into, stitch,
};

fn picture(width: u32, height: u32) -> Raster<[u8; 3]> {
    let pixel = |k: u32| {
        let x = k % width;
        let y = k / width;
        let grain = (x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77)) >> 27;
        [(100 + grain) as u8, (x / 8 % 200) as u8, (y / 8 % 200 + grain) as u8]
    };
    Raster::from_vec(width, height, (0..width * height).map(pixel).collect())
}

fn captures(pose: &Pose) -> Vec<Capture> {
    let distortion = [0.11, -0.23, 0.0012, -0.0007, 0.05];
    let lens =
        Lens::new([1280, 1024], DVec2::splat(1075.7), dvec2(636.9, 515.0), distortion).expect("a lens");
    let image = picture(1280, 1024);
    (0..18u32)
        .map(|k| {
            let own = pose
                .turned(-f64::from(k % 6) * std::f64::consts::FRAC_PI_3, [0.85, 0.0, -0.85][k as usize / 6]);
            let pose = Pose { location: own.location + 0.04 * own.forward(), ..own };
            Capture { image: image.clone(), lens: lens.into(), pose, mask: None, border_px: 0 }
        })
        .collect()
}

fn pictures(c: &mut Criterion) {
    let mesh = s3d_synth::scenes::classroom(285_000);
    let scene = Scene::new(&mesh);
    let mip_maps = MipMaps::new(&mesh);
    let pose = Pose::level(s3d_synth::scenes::CLASSROOM_LOCATION, 0.13);
    let mut group = c.benchmark_group("pictures");
    group.sample_size(10);

    let sky = picture(1024, 1024);
    let panorama = picture(4096, 2048);
    let shots = captures(&pose);
    group.bench_function("cube map from a sky box", |b| {
        b.iter(|| CubeMap::from_sky_box([&sky; 6], SkyBoxTurn::Detect, &pose, None));
    });
    group.bench_function("cube map from a panorama", |b| {
        b.iter(|| CubeMap::from_equirectangular(&panorama, 0.0, &pose, None));
    });
    let options = StitchOptions::default();
    group.bench_function("cube map from 18 captures, with their mip maps", |b| {
        b.iter(|| stitch(shots.clone(), &pose, None, &options));
    });
    group.bench_function("the same with parallax", |b| {
        b.iter(|| stitch(shots.clone(), &pose, Some(&scene), &options));
    });

    let whole = CubeMap::from_sky_box([&picture(2144, 2144); 6], SkyBoxTurn::Front, &pose, None);
    let holes = stitch(shots, &pose, None, &options);
    assert!(whole.coverage() == 1.0 && holes.coverage() < 1.0);
    let views = common::views(pose.location, 1080);
    for (what, cameras) in [("9 views", views), ("panorama", vec![Camera::equirectangular(pose, 4096)])] {
        let shots: Vec<(Camera, Hits)> = cameras
            .into_iter()
            .map(|camera| (camera, s3d_render::cast(&scene, &camera)))
            .collect();
        group.throughput(Throughput::Elements(shots.iter().map(|(_, hits)| hits.face.len() as u64).sum()));

        let mut out = Raster::filled(1, 1, [0; 3]);
        let filter = TextureFilter::default();
        for (name, cube, unseen) in [
            ("whole cube map", &whole, Unseen::Nearby),
            ("holes, filled", &holes, Unseen::Nearby),
            ("holes, the mesh", &holes, Unseen::Mesh(&scene, &mip_maps)),
        ] {
            group.bench_function(format!("rgb, {what}, {name}"), |b| {
                b.iter(|| {
                    for (camera, hits) in &shots {
                        picture_image_into(cube, unseen, hits, camera, &filter, &mut out);
                    }
                });
            });
        }

        group.bench_function(format!("rgb, {what}, textures"), |b| {
            b.iter(|| {
                for (camera, hits) in &shots {
                    s3d_render::rgb_image_into(&scene, &mip_maps, hits, camera, &filter, &mut out);
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, pictures);
criterion_main!(benches);
