//! Tests of spherical pictures, of masks and of pictures that meet at their borders.

use super::tests::{directions, sample};
use super::{Capture, StitchOptions, stitch};
use crate::picture::cube_map::CubeMap;
use crate::picture::cube_map::tests::{close, color_of, pose};
use crate::raster::visibility::cast;
use crate::scene::Scene;
use crate::shade::color::rgb_image;
use crate::shade::mip_maps::MipMaps;
use glam::{DMat3, DVec2, DVec3, dvec2, dvec3};
use s3d_geom::{Camera, CaptureLens, Lens, Pose, Raster, SphericalLens};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Returns the direction in OpenCV's axes through a pixel.
fn direction(lens: &CaptureLens, pixel: DVec2) -> DVec3 {
    match lens {
        CaptureLens::Straight(lens) => lens.direction(pixel).unwrap(),
        CaptureLens::Spherical(lens) => lens.direction(pixel),
    }
}

/// Takes a picture in which each direction of the world has its colour.
fn taken(lens: impl Into<CaptureLens>, own: Pose) -> Capture {
    let lens = lens.into();
    let [width, height] = lens.size();
    let world = own.opencv_from_world().transpose();
    let pixels = (0..width * height).map(|i| {
        let at = dvec2(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
        color_of(world * direction(&lens, at)).map(|c| (c + 0.5) as u8)
    });
    let image = Raster::from_vec(width, height, pixels.collect());
    Capture { image, lens, pose: own, mask: None, border_px: 0 }
}

/// A pose that is turned and tilted about all axes.
fn tilted() -> Pose {
    let turn = DMat3::from_rotation_z(1.1) * DMat3::from_rotation_y(0.6) * DMat3::from_rotation_x(1.9);
    Pose { location: pose().location, world_from_camera: turn }
}

fn whole(width: u32) -> SphericalLens {
    let pixel = TAU / f64::from(width);
    SphericalLens::new([width, width / 2], DVec2::splat(pixel)).unwrap()
}

/// The largest difference from the expected colours, and the number of directions that are not seen.
fn error(cube: &CubeMap) -> (f32, usize) {
    let mut worst = 0.0f32;
    let mut unseen = 0;
    for d in directions() {
        let (color, seen) = sample(cube, d);
        if seen == 255 {
            let off = (0..3).map(|k| (color[k] - color_of(d)[k]).abs());
            worst = off.fold(worst, f32::max);
        } else {
            unseen += 1;
        }
    }
    (worst, unseen)
}

fn stitched(captures: Vec<Capture>) -> CubeMap {
    stitch(captures, &pose(), None, &StitchOptions { size: Some(160), gains: false })
}

#[test]
fn a_tilted_sphere_has_each_colour_in_its_direction() {
    let sphere = taken(whole(512), tilted());
    let cube = stitched(vec![sphere.clone()]);
    assert_eq!(cube.coverage(), 1.0);
    let (worst, unseen) = error(&cube);
    assert!(worst < 3.0 && unseen == 0, "{worst} {unseen}");
    assert_eq!(stitch(vec![sphere.clone()], &pose(), None, &StitchOptions::default()).size(), 224);

    // With a second picture, no mask and no hole, the general way gives the same.
    let (worst, unseen) = error(&stitched(vec![sphere.clone(), taken(whole(256), pose())]));
    assert!(worst < 3.0 && unseen == 0, "{worst} {unseen}");

    // A mirrored picture and a picture upside down are far off.
    let rows: Vec<[u8; 3]> = sphere.image.rows().flat_map(|row| row.iter().rev().copied()).collect();
    let mirrored = Capture { image: Raster::from_vec(512, 256, rows), ..sphere.clone() };
    assert!(error(&stitched(vec![mirrored])).0 > 60.0);
    let pixels = sphere.image.pixels().iter().rev().copied().collect();
    let turned = Capture { image: Raster::from_vec(512, 256, pixels), ..sphere };
    assert!(error(&stitched(vec![turned])).0 > 60.0);
}

#[test]
fn a_band_leaves_the_rest_unseen() {
    // Three quarters of a turn, and 60° up and down.
    let pixel = TAU / 480.0;
    let lens = SphericalLens::new([360, 160], DVec2::splat(pixel)).unwrap();
    let cube = stitched(vec![taken(lens, tilted())]);
    let camera_from_world = tilted().opencv_from_world();
    let mut seen_count = 0;
    for d in directions() {
        let (color, seen) = sample(&cube, d);
        let at = lens.project(camera_from_world * d);
        let inside = at.cmpgt(DVec2::splat(4.0)) & at.cmplt(dvec2(356.0, 156.0));
        let outside = at.cmplt(DVec2::splat(-4.0)) | at.cmpgt(dvec2(364.0, 164.0));
        if inside.all() {
            seen_count += 1;
            assert!(seen == 255 && close(color, color_of(d), 3.0), "{d} {seen} {color:?}");
        }
        assert!(!outside.any() || seen == 0, "{d} is seen");
    }
    // The share of the sphere: ¾ of a turn, and sin 60° of the height.
    assert!((0.55..0.7).contains(&(f64::from(seen_count) / 3000.0)), "{seen_count}");
}

#[test]
fn what_the_mask_hides_is_a_hole_and_colours_nothing() {
    let mut sphere = taken(whole(512), tilted());
    let mut mask = Raster::filled(512, 256, 255u8);
    // The lower third is a tripod, in a colour of its own.
    for k in 512 * 170..512 * 256 {
        mask.pixels_mut()[k] = 0;
        sphere.image.pixels_mut()[k] = [255, 0, 255];
    }
    sphere.mask = Some(mask);
    let cube = stitched(vec![sphere]);
    let camera_from_world = tilted().opencv_from_world();
    for d in directions() {
        let (color, seen) = sample(&cube, d);
        let row = whole(512).project(camera_from_world * d).y;
        if row < 166.0 {
            assert!(seen == 255 && close(color, color_of(d), 3.0), "{d} {row}");
        }
        assert!(row < 174.0 || seen == 0, "{d} {row}");
    }

    // A straight picture has masks too.
    let lens = Lens::new([64, 64], DVec2::splat(32.0), DVec2::splat(32.0), [0.0; 5]).unwrap();
    let half = Raster::from_vec(64, 64, (0..64 * 64).map(|k| if k % 64 < 32 { 255 } else { 0 }).collect());
    let masked = Capture { mask: Some(half), ..taken(lens, pose()) };
    let cube = stitched(vec![masked]);
    let to_the_left = pose().forward() - 0.3 * pose().right();
    let to_the_right = pose().forward() + 0.3 * pose().right();
    assert_eq!((sample(&cube, to_the_left).1, sample(&cube, to_the_right).1), (255, 0));
}

#[test]
fn the_faces_of_a_cube_meet_without_a_gap() {
    let lens = Lens::new([64, 64], DVec2::splat(32.0), DVec2::splat(32.0), [0.0; 5]).unwrap();
    let turns =
        [(0.0, 0.0), (FRAC_PI_2, 0.0), (PI, 0.0), (-FRAC_PI_2, 0.0), (0.0, FRAC_PI_2), (0.0, -FRAC_PI_2)];
    let rig = Pose { location: pose().location, ..Pose::level(DVec3::ZERO, 0.7) };
    let faces: Vec<Capture> = turns
        .iter()
        .map(|(yaw, pitch)| taken(lens, rig.turned(*yaw, *pitch)))
        .collect();
    assert!(stitched(faces.clone()).coverage() < 1.0);

    let bordered: Vec<Capture> = faces.into_iter().map(Capture::with_border).collect();
    assert_eq!(bordered[0].image.width(), 66);
    let cube = stitched(bordered.clone());
    assert_eq!(cube.coverage(), 1.0);
    let (worst, unseen) = error(&cube);
    assert!(worst < 4.0 && unseen == 0, "{worst} {unseen}");

    // What is repeated at the borders tells nothing about exposure: other colours there change none.
    let mut faces = bordered;
    for face in &mut faces {
        for pixel in face.image.pixels_mut().iter_mut().take(66) {
            *pixel = [250, 9, 120];
        }
    }
    let matched = stitch(faces, &pose(), None, &StitchOptions { size: Some(160), gains: true });
    let level = rig.turned(0.2, 0.1).forward();
    let (color, _) = sample(&matched, level);
    assert!(close(color, color_of(level), 4.0), "{color:?}");
}

/// The camera stands beside the location. With the mesh, the sphere shows the same as the mesh itself.
#[test]
fn parallax_of_a_sphere_is_taken_out_with_the_mesh() {
    let mesh = s3d_synth::scenes::furnished_room(5);
    let scene = Scene::new(&mesh);
    let mip_maps = MipMaps::new(&mesh);
    let center = Pose::level(dvec3(2.2, 2.1, 1.4), 0.4);
    let beside = Pose { location: center.location + dvec3(0.12, -0.1, 0.15), ..center };

    let camera = Camera::equirectangular(beside, 1024);
    let image = rgb_image(&scene, &mip_maps, &cast(&scene, &camera), &camera);
    let sphere = Capture { image, lens: whole(1024).into(), pose: beside, mask: None, border_px: 0 };
    let view = Camera::perspective(center.turned(0.5, -0.3), 1.2, 160, 160);
    let hits = cast(&scene, &view);
    let direct = rgb_image(&scene, &mip_maps, &hits, &view);

    let error = |scene: Option<&Scene<'_>>| {
        let options = StitchOptions { size: Some(320), gains: true };
        let cube = stitch(vec![sphere.clone()], &center, scene, &options);
        let filter = crate::TextureFilter::default();
        let image =
            crate::picture_image(&cube, crate::picture::picture_color::Unseen::Nearby, &hits, &view, &filter);
        let squares = image.pixels().as_flattened().iter().zip(direct.pixels().as_flattened());
        squares.map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum::<f64>() / (3.0 * 160.0 * 160.0)
    };
    let without = error(None);
    let with = error(Some(&scene));
    assert!(with < 0.25 * without, "mean square {without} without the mesh, {with} with it");
}
