//! Whole images: casting them at once gives the same as single rays, pixel for pixel.

use crate::common;

use s3d_geom::glam::{DVec3, Vec3, dvec3, vec3};
use s3d_geom::{Camera, Pose, TriMesh};
use s3d_render::{Hits, NO_FACE, Scene, cast, cast_ray_by_ray, cast_strided};

fn same(fast: &Hits, exact: &Hits, what: &str) {
    let pixels = fast
        .face
        .pixels()
        .iter()
        .zip(exact.face.pixels())
        .zip(fast.depth.pixels().iter().zip(exact.depth.pixels()));
    // Rounding may put a depth one step off.
    let close = |s: f32, t: f32| (i64::from(s.to_bits()) - i64::from(t.to_bits())).abs() <= 1;
    let differ = pixels
        .enumerate()
        .find(|(_, ((f, g), (s, t)))| f != g || !close(**s, **t));
    assert!(differ.is_none(), "{what}: the first pixel that differs is {differ:?}");
}

fn check(mesh: &TriMesh, cameras: &[Camera], stride: u32) {
    let scene = Scene::new(mesh);
    for camera in cameras {
        same(
            &cast_strided(&scene, camera, stride),
            &cast_ray_by_ray(&scene, camera, stride),
            &format!("{camera:?}"),
        );
    }
}

fn around(location: DVec3, size: u32) -> Vec<Camera> {
    let mut cameras = common::views(location, size);
    cameras.push(Camera::equirectangular(Pose::level(location, 0.4), 2 * size));
    cameras
}

#[test]
fn a_furnished_room() {
    let mesh = s3d_synth::scenes::classroom(20_000);
    check(&mesh, &around(s3d_synth::scenes::CLASSROOM_LOCATION, 200), 1);
    check(&mesh, &around(dvec3(0.3, 5.7, 0.9), 200), 1);
}

#[test]
fn a_real_scan() {
    #[allow(clippy::print_stderr)]
    let Some((path, location)) = common::real_scan() else {
        eprintln!("skipped: no real scan beside the project");
        return;
    };
    let mesh = common::read_obj(&path);
    check(&mesh, &around(location, 360), 1);
    check(&mesh, &around(dvec3(12.65, 11.4, 1.4), 360), 1);
    check(&mesh, &around(location, 1080), 7);
}

/// Returns cameras of all kinds: wide, narrow, tiny, upside down, and panoramas narrower than a tile.
fn odd_cameras(location: DVec3) -> Vec<Camera> {
    let pose = Pose::level(location, 0.0).turned(2.0, 0.7);
    let mut cameras = vec![
        Camera::perspective(Pose::level(location, 0.0), 175f64.to_radians(), 67, 31),
        Camera::perspective(pose, 1e-3, 33, 9),
        Camera::perspective(pose, 1e-9, 17, 17),
        Camera::perspective(pose, 1.0, 1, 1),
        Camera::perspective(pose, 1.0, 1, 70),
        Camera::perspective(pose, 1.0, 9, 2),
        Camera::perspective(pose.turned(0.0, 2.5), 1.5, 40, 40),
    ];
    cameras.extend([2, 4, 16, 20, 34, 130].map(|width| Camera::equirectangular(pose, width)));
    cameras
}

#[test]
fn odd_cameras_in_a_room() {
    let mesh = s3d_synth::scenes::classroom(2_000);
    for location in [
        s3d_synth::scenes::CLASSROOM_LOCATION,
        dvec3(4.0, 3.0, 0.0),
        dvec3(0.0, 0.0, 0.0),
        dvec3(-5.0, 1.0, 9.0),
    ] {
        for stride in [1, 2, 5, 200] {
            check(&mesh, &odd_cameras(location), stride);
        }
    }
}

#[test]
fn a_camera_on_a_face_and_just_off_it() {
    let mesh = s3d_synth::scenes::classroom(500);
    let [a, b, c] = mesh.triangle(37).map(|p| p.as_dvec3());
    let normal = (b - a).cross(c - a).normalize();
    let on = (a + b + c) / 3.0;
    for off in [0.0, 1e-15, -1e-12, 1e-9, -1e-7, 1e-4] {
        check(&mesh, &[Camera::equirectangular(Pose::level(on + normal * off, 0.1), 64)], 1);
    }
    check(&mesh, &odd_cameras(a), 1);
    check(&mesh, &odd_cameras(a.lerp(b, 0.5)), 1);
}

#[test]
fn far_from_the_worlds_origin() {
    let mut parts = s3d_synth::scenes::classroom(3_000).into_parts();
    let far = vec3(1000.0, -2000.0, 300.0);
    parts.positions.iter_mut().for_each(|p| *p += far);
    let mesh = TriMesh::new(parts).unwrap();
    check(&mesh, &around(s3d_synth::scenes::CLASSROOM_LOCATION + far.as_dvec3(), 96), 1);
}

#[test]
fn coplanar_faces_and_layers_closer_than_rounding() {
    // Walls over one another: equal, mirrored, and slightly farther.
    let mut corners = Vec::new();
    for y in [2.0, 2.0, 2.000_001, 2.000_01, 2.000_04, 2.001, 1.999_999_9] {
        corners.extend([vec3(-1.0, y, -1.0), vec3(1.0, y, -0.9), vec3(0.1, y, 1.0)]);
    }
    let faces = (0..corners.len() as u32 / 3)
        .rev()
        .map(|f| [3 * f, 3 * f + 2, 3 * f + 1])
        .collect();
    let mesh = TriMesh::from_faces(corners, faces).unwrap();
    check(&mesh, &odd_cameras(dvec3(0.1, 0.3, 0.2)), 1);
    check(&mesh, &around(dvec3(0.1, 0.3, 0.2), 64), 1);
}

#[test]
fn triangles_at_random() {
    // The faces interpenetrate; some have corners at the camera, and some go through it.
    let mut state = 7u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32 * 4.0 - 2.0
    };
    for count in [1, 5, 60, 900] {
        let corners: Vec<Vec3> = (0..count * 3).map(|_| vec3(random(), random(), random())).collect();
        let at = corners[0].as_dvec3();
        let faces = (0..count).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let mesh = TriMesh::from_faces(corners, faces).unwrap();
        for location in [DVec3::ZERO, at, dvec3(0.0, -5.0, 0.0)] {
            check(&mesh, &around(location, 72), 1);
            check(&mesh, &odd_cameras(location), 1);
        }
    }
}

#[test]
fn a_closed_room_has_no_holes() {
    let mesh = s3d_synth::scenes::classroom(20_000);
    let scene = Scene::new(&mesh);
    for camera in around(s3d_synth::scenes::CLASSROOM_LOCATION, 512) {
        assert!(cast(&scene, &camera).face.pixels().iter().all(|&face| face != NO_FACE));
    }
}

#[test]
fn strides_pick_pixels_of_the_whole_image() {
    let mesh = s3d_synth::scenes::classroom(2_000);
    let scene = Scene::new(&mesh);
    let camera = Camera::perspective(Pose::level(s3d_synth::scenes::CLASSROOM_LOCATION, 0.2), 1.2, 50, 37);
    let all = cast(&scene, &camera);
    for stride in [1, 2, 3, 8, 36] {
        let some = cast_strided(&scene, &camera, stride);
        let count = |n: u32| (n - 1 - stride / 2) / stride + 1;
        assert_eq!((some.face.width(), some.face.height()), (count(50), count(37)));
        for y in 0..some.face.height() {
            for x in 0..some.face.width() {
                let i = stride / 2 + x * stride;
                let j = stride / 2 + y * stride;
                assert_eq!(some.face.at(x, y), all.face.at(i, j));
                assert_eq!(some.depth.at(x, y), all.depth.at(i, j));
            }
        }
    }
    assert!(cast_strided(&scene, &camera, 100).face.is_empty());
}

#[test]
fn a_camera_that_is_nowhere_sees_nothing() {
    let mesh = s3d_synth::scenes::classroom(500);
    let scene = Scene::new(&mesh);
    let camera = Camera::perspective(Pose::level(DVec3::NAN, 0.2), 1.2, 20, 20);
    assert!(cast(&scene, &camera).face.pixels().iter().all(|&face| face == NO_FACE));
}
