//! Photographs that are panoramas, level and tilted, from a model of COLMAP.

use super::studio::*;
use crate::common::{s3d_ok, text};
use glam::{DMat3, DQuat, DVec3, dvec3};
use s3d_geom::{Camera, Pose, Raster};
use s3d_io::dataset::{Domain, Frame, Layout, dataset_images};
use s3d_io::image::{read_gray16, read_rgb8};
use s3d_render::{MipMaps, Scene, TextureFilter, cast, cast_ray, depth_image, rgb_of_ray};
use std::f64::consts::{PI, TAU};

const WIDTH: u32 = 384;

/// Returns the panorama of a camera as COLMAP defines it, four rays a pixel.
fn take_panorama(pose: &Pose) -> Raster<[u8; 3]> {
    let (scene, mip_maps) = (Scene::new(mesh()), MipMaps::new(mesh()));
    let world_from_camera = pose.opencv_from_world().transpose();
    // Gives the size of a pixel, for textures.
    let camera = Camera::equirectangular(*pose, WIDTH * 2);
    let color = |x: f64, y: f64| -> DVec3 {
        let theta = TAU * (x / f64::from(WIDTH) - 0.5);
        let phi = PI * (0.5 - y / f64::from(WIDTH / 2));
        let v = dvec3(phi.cos() * theta.sin(), -phi.sin(), phi.cos() * theta.cos());
        let direction = world_from_camera * v;
        let Some(hit) = cast_ray(&scene, pose.location, direction) else { return DVec3::ZERO };
        let rgb = rgb_of_ray(&scene, &mip_maps, &camera, direction, hit.face, &TextureFilter::default());
        DVec3::from_array(rgb.map(f64::from))
    };
    let pixel = |i: u32| {
        let (x, y) = (f64::from(i % WIDTH), f64::from(i / WIDTH));
        let samples = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
        let sum: DVec3 = samples.iter().map(|(dx, dy)| color(x + dx, y + dy)).sum();
        (sum / 4.0).to_array().map(|v| v.round() as u8)
    };
    Raster::from_vec(WIDTH, WIDTH / 2, (0..WIDTH * WIDTH / 2).map(pixel).collect())
}

/// Both are upright panoramas of the data set with all modalities. The level one keeps its pixels, and the
/// tilted one coincides with it.
#[test]
fn panoramas_of_a_colmap_model_become_upright_panoramas() {
    let project = Project::new("[frames]\npath = \"sparse/0\"\nimages = \"images\"\n");
    let level = Pose::level(poses()[1].location, 0.6);
    let mut tilted = level.turned(0.0, -0.25);
    tilted.world_from_camera *= DMat3::from_rotation_z(0.2);
    let mut images = String::new();
    for (i, (name, pose)) in [("level.png", level), ("tilted.png", tilted)].iter().enumerate() {
        let m = pose.opencv_from_world();
        let (q, t) = (DQuat::from_mat3(&m), -(m * pose.location));
        images += &format!("{} {} {} {} {} {} {} {} 1 {name}\n\n", i + 1, q.w, q.x, q.y, q.z, t.x, t.y, t.z);
        write(&project.at(&format!("images/{name}")), &take_panorama(pose));
    }
    project.write("sparse/0/images.txt", &images);
    let height = WIDTH / 2;
    let camera = format!("1 EQUIRECTANGULAR {WIDTH} {height} {WIDTH} {height}\n");
    project.write("sparse/0/cameras.txt", &camera);
    project.write("sparse/0/rigs.txt", "1 1 CAMERA 1\n");

    let (out, _) = project.export("out", &[]);
    let records = photographs(&out);
    let layout = Layout::new(&out);
    let all = dataset_images(&layout, 1).unwrap();
    assert_eq!((records.len(), all.len()), (2, 2));
    let colors: Vec<Raster<[u8; 3]>> = records
        .iter()
        .map(|record| {
            assert!(record.panorama && (record.width, record.height) == (WIDTH, height), "{record:?}");
            assert!(record.masked == 0.0 && record.seen > 0.9, "{record:?}");
            assert!(record.agreement.unwrap() > record.chance.unwrap() + 0.2, "{record:?}");
            let image = all.iter().find(|image| image.uuid == record.camera_uuid).unwrap();
            assert_eq!((image.frame, image.domains.len()), (Frame::Panorama, 5));
            let hits = cast(&Scene::new(mesh()), &Camera::equirectangular(level, WIDTH));
            let depth = read_gray16(&image.path(&layout, Domain::Depth)).unwrap();
            let expected = depth_image(&hits);
            let off = depth.pixels().iter().zip(expected.pixels());
            assert!(off.filter(|(a, b)| a.abs_diff(**b) > 1).count() < 100);
            read_rgb8(&image.path(&layout, Domain::Rgb)).unwrap()
        })
        .collect();

    let photo = read_rgb8(&project.at("images/level.png")).unwrap();
    let differ = colors[0].pixels().iter().zip(photo.pixels());
    assert_eq!(differ.filter(|(a, b)| **a != b.map(|v| v.max(1))).count(), 0);
    let off = displacements(&colors[0], &colors[1]);
    assert!(off.len() > 10 && off[off.len() / 2] < 0.1, "{off:?}");

    // Packages and half the size.
    s3d_ok(&["pack", text(&out), "--to", "nerfstudio", "-o", text(&project.at("packed")), "--images", "all"]);
    let scene = std::fs::read_to_string(project.at("scene.toml")).unwrap();
    project.write("scene.toml", &format!("{scene}width = 193\n"));
    let (half, _) = project.export("half", &[]);
    assert!(
        photographs(&half)
            .iter()
            .all(|record| (record.width, record.height) == (192, 96))
    );
}

/// A picture of another shape is none of a panorama.
#[test]
fn a_panorama_is_twice_as_wide_as_high() {
    let project = Project::new("[frames]\npath = \"sparse\"\nimages = \"images\"\n");
    project.write("sparse/images.txt", "1 1 0 0 0 0 0 0 1 a.png\n");
    project.write("sparse/cameras.txt", "1 EQUIRECTANGULAR 64 32 64 32\n");
    write(&project.at("images/a.png"), &Raster::filled(64, 48, [9; 3]));
    project.fails(&["a.png", "a panorama is twice as wide as high, not 64 × 48 pixels"]);
}
