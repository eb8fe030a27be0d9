//! Colours of textures and corners: in closed form, and as single pixels give them.

use crate::common;

use crate::room::{EYE, all_kinds, room_parts, view};
use s3d_geom::glam::{dvec3, vec2};
use s3d_geom::{Camera, Material, MeshParts, Pose, Raster, Texture, TriMesh, Wrap};
use s3d_render::{MipMaps, NO_FACE, Scene};

fn textured(image: Raster<[u8; 3]>, wrap: Wrap) -> TriMesh {
    let parts = room_parts();
    let materials = vec![Material { name: "paper".into(), color: [9; 3], texture: Some(0) }];
    let textures = vec![Texture { name: "paper".into(), image, wrap: [wrap; 2] }];
    TriMesh::new(MeshParts { face_materials: vec![0; 12], materials, textures, ..parts }).unwrap()
}

fn rgb(mesh: &TriMesh, camera: &Camera) -> Raster<[u8; 3]> {
    let scene = Scene::new(mesh);
    let hits = s3d_render::cast(&scene, camera);
    s3d_render::rgb_image(&scene, &MipMaps::new(mesh), &hits, camera)
}

/// Returns a chart: red grows to the right, green upwards, and blue marks the lower left.
fn chart(size: u32) -> Raster<[u8; 3]> {
    let step = 256 / size;
    let pixel = |k: u32| {
        let x = k % size;
        let y = size - 1 - k / size;
        [(x * step) as u8, (y * step) as u8, if x < size / 4 && y < size / 4 { 200 } else { 20 }]
    };
    Raster::from_vec(size, size, (0..size * size).map(pixel).collect())
}

#[test]
fn a_magnified_texture_is_bilinear() {
    let mesh = textured(chart(16), Wrap::Clamp);
    let camera = Camera::perspective(Pose::level(EYE, 0.0), 60f64.to_radians(), 300, 200);
    let image = rgb(&mesh, &camera);
    let scene = Scene::new(&mesh);
    let hits = s3d_render::cast(&scene, &camera);
    let xyz = s3d_render::xyz_image(&hits, &camera);
    for (x, y) in [(150, 100), (3, 190), (299, 0), (0, 0), (77, 13), (200, 150)] {
        assert_eq!(hits.face.at(x, y) / 2, 2);
        let [px, _, pz] = xyz.at(x, y);
        let expected = mesh.textures()[0].sample(vec2((px + 2.0) / 4.0, pz / 3.0));
        for k in 0..3 {
            assert!((f32::from(image.at(x, y)[k]) - expected[k]).abs() < 0.51, "({x}, {y}): {expected:?}");
        }
    }
    // Red grows to the right, green upwards.
    assert!(image.at(250, 100)[0] > image.at(50, 100)[0] && image.at(150, 20)[1] > image.at(150, 180)[1]);
}

fn checker(size: u32) -> Raster<[u8; 3]> {
    let pixel = |k: u32| {
        if (k % size + k / size).is_multiple_of(2) {
            [255; 3]
        } else {
            [0; 3]
        }
    };
    Raster::from_vec(size, size, (0..size * size).map(pixel).collect())
}

#[test]
fn a_distant_checkerboard_is_grey() {
    for (size, wrap) in [(1024, Wrap::Repeat), (1023, Wrap::Mirror), (777, Wrap::Clamp)] {
        let mesh = textured(checker(size), wrap);
        // A pixel covers more than 16 texels.
        for camera in [
            Camera::perspective(Pose::level(EYE, 0.3), 75f64.to_radians(), 32, 32),
            Camera::equirectangular(Pose::level(EYE, 0.3), 64),
        ] {
            for pixel in rgb(&mesh, &camera).pixels() {
                assert!(pixel.iter().all(|c| (108..=148).contains(c)), "{pixel:?}");
            }
        }
    }
}

#[test]
fn a_floor_seen_at_an_angle_keeps_what_runs_along_it() {
    // The stripes run away from the camera and are 4 texels wide: at a grazing angle plain mip maps blur
    // them.
    let pixel = |k: u32| {
        if (k % 512 / 4).is_multiple_of(2) {
            [250; 3]
        } else {
            [10; 3]
        }
    };

    let mesh = textured(Raster::from_vec(512, 512, (0..512 * 512).map(pixel).collect()), Wrap::Clamp);
    let pose = Pose::level(dvec3(0.0, -1.9, 0.25), 0.0);
    let camera = Camera::perspective(pose, 50f64.to_radians(), 400, 400);
    let scene = Scene::new(&mesh);
    let hits = s3d_render::cast(&scene, &camera);
    let mip_maps = MipMaps::new(&mesh);

    let contrast = |max_taps: u32| {
        let filter = s3d_render::TextureFilter { max_taps };
        let image = s3d_render::rgb_image_with(&scene, &mip_maps, &hits, &camera, &filter);
        let row: Vec<u8> = (120..280)
            .filter(|&x| hits.face.at(x, 235) < 2)
            .map(|x| image.at(x, 235)[0])
            .collect();
        assert!(row.len() > 100);
        row.iter().max().unwrap() - row.iter().min().unwrap()
    };

    let sharp = contrast(8);
    let blurred = contrast(1);
    assert!(sharp > 150 && blurred < sharp / 2, "{sharp} {blurred}");
}

#[test]
fn colours_without_a_texture() {
    let mut parts = room_parts();
    parts.materials = vec![Material { name: "red".into(), color: [200, 10, 0], texture: None }];
    parts.face_materials = vec![0; 12];
    let flat = TriMesh::new(parts.clone()).unwrap();
    assert!(rgb(&flat, &view(0.2, 0.0)).pixels().iter().all(|p| *p == [200, 10, 0]));
    // The corners of each wall go from black at the bottom to white at the top.
    parts.colors = (0..24).map(|k| if k % 4 < 2 { [0; 3] } else { [255; 3] }).collect();
    let camera = view(0.0, 0.0);
    let image = rgb(&TriMesh::new(parts).unwrap(), &camera);
    for y in 20..60 {
        let z = 1.5 - 2.5 * (f64::from(y) + 0.5 - 40.0) / 50.0;
        let expected = z / 3.0 * 255.0;
        assert!((f64::from(image.at(50, y)[0]) - expected).abs() <= 0.51, "row {y}");
    }
}

/// Compares the fast image with the image of single pixels. Channels may differ by at most 1, except in a few
/// pixels where rounding decides how many samples are taken.
fn close(mesh: &TriMesh, camera: &Camera, max_taps: u32) {
    let scene = Scene::new(mesh);
    let mip_maps = MipMaps::new(mesh);
    let hits = s3d_render::cast(&scene, camera);
    let filter = s3d_render::TextureFilter { max_taps };
    let fast = s3d_render::rgb_image_with(&scene, &mip_maps, &hits, camera, &filter);
    let exact = s3d_render::rgb_image_pixel_by_pixel(&scene, &mip_maps, &hits, camera, &filter);

    let mut differ = 0;
    let mut samples_differ = 0;
    for (k, (f, e)) in fast.pixels().iter().zip(exact.pixels()).enumerate() {
        let most = (0..3).map(|c| f[c].abs_diff(e[c])).max().unwrap_or(0);
        assert!(most <= 20, "pixel {k} of {camera:?}: {f:?} for {e:?}");
        samples_differ += usize::from(most > 1);
        differ += usize::from(most > 0);
        assert_eq!(*f == [0; 3], hits.face.pixels()[k] == NO_FACE);
    }
    assert!(samples_differ <= 1 + fast.len() / 20_000, "{samples_differ} pixels of {camera:?}");

    // Single rays through the centres of pixels give the same colours.
    let mut rays_differ = 0;
    for (k, e) in exact.pixels().iter().enumerate().step_by(13) {
        let face = hits.face.pixels()[k];
        let width = camera.width as usize;
        if face == NO_FACE {
            continue;
        }
        let direction = camera.direction((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
        let color = s3d_render::rgb_of_ray(&scene, &mip_maps, camera, direction, face, &filter);
        rays_differ += usize::from((0..3).any(|c| color[c].abs_diff(e[c]) > 1));
    }
    assert!(rays_differ <= 1 + fast.len() / 20_000, "{rays_differ} rays of {camera:?}");

    // A colour is off by 0.1 at most, and so it is seldom rounded differently.
    assert!(differ * 10 <= fast.len(), "{differ} of {} pixels are rounded otherwise", fast.len());
}

#[test]
fn rgb_is_what_single_pixels_give() {
    let noise = |size: u32| {
        let pixel = |k: u32| k.wrapping_mul(0x9E37_79B1).rotate_left(k % 23).to_le_bytes();
        Raster::from_vec(size, size, (0..size * size).map(|k| std::array::from_fn(|c| pixel(k)[c])).collect())
    };

    for (size, wrap) in [
        (512, Wrap::Repeat),
        (301, Wrap::Mirror),
        (64, Wrap::Clamp),
        (5, Wrap::Repeat),
        (2, Wrap::Mirror),
        (1, Wrap::Clamp),
    ] {
        // As it is; several times over each wall and off to one side; far out.
        for (scale, shift) in [(1.0, vec2(0.0, 0.0)), (3.7, vec2(-1.3, 0.6)), (0.9, vec2(1000.25, -77.5))] {
            let mut parts = textured(noise(size), wrap).into_parts();
            parts.uvs.iter_mut().for_each(|uv| *uv = *uv * scale + shift);
            let mesh = TriMesh::new(parts).unwrap();
            for camera in all_kinds(EYE) {
                close(&mesh, &camera, 8);
            }
            close(&mesh, &all_kinds(EYE)[0], 1);
            // The eye is nearly on the floor.
            close(&mesh, &all_kinds(dvec3(-1.5, 1.0, 0.004))[0], 8);
        }
    }
}

#[test]
fn colours_of_corners_are_what_single_pixels_give() {
    let mut parts = room_parts();
    parts.colors = (0..24u32)
        .map(|k| (k * 0x35_79_13).to_le_bytes())
        .map(|[r, g, b, _]| [r, g, b])
        .collect();
    let mesh = TriMesh::new(parts).unwrap();
    for camera in all_kinds(EYE) {
        close(&mesh, &camera, 8);
    }
}

#[test]
fn rgb_of_scans_is_what_single_pixels_give() {
    let mesh = s3d_synth::scenes::scan_like(20_000, 5);
    for camera in all_kinds(dvec3(3.0, 2.5, 1.5)) {
        close(&mesh, &camera, 8);
    }
    #[allow(clippy::print_stderr)]
    let Some((path, location)) = common::real_scan() else {
        eprintln!("skipped: no real scan beside the project");
        return;
    };
    let mesh = common::read_obj(&path);
    for camera in all_kinds(location) {
        close(&mesh, &camera, 8);
    }
}

#[test]
fn an_image_that_is_used_again_is_as_a_new_one() {
    let mesh = textured(chart(64), Wrap::Clamp);
    let scene = Scene::new(&mesh);
    let mip_maps = MipMaps::new(&mesh);
    let filter = s3d_render::TextureFilter::default();
    let mut again = Raster::filled(5, 5, [9; 3]);
    for camera in all_kinds(EYE) {
        // The second time, the image of the unturned camera is overwritten.
        for camera in [camera, Camera { pose: camera.pose.turned(1.0, 0.0), ..camera }] {
            let hits = s3d_render::cast(&scene, &camera);
            s3d_render::rgb_image_into(&scene, &mip_maps, &hits, &camera, &filter, &mut again);
            assert_eq!(again, s3d_render::rgb_image(&scene, &mip_maps, &hits, &camera));
        }
    }
}
