//! The visibility pass compared with single exact rays, pixel by pixel: random soups, slivers, duplicates,
//! faces through and behind the camera; and whole images of a scan-like mesh and of a real scan.

use proptest::prelude::*;
use s3d_geom::glam::{DVec3, Vec3, dvec3, vec3};
use s3d_geom::{Camera, MeshParts, Pose, TriMesh};
use s3d_render::{Caster, Hits, NO_FACE, Scene, cast_ray_brute_force, cast_ray_by_ray};
use s3d_synth::scenes::scan_like;
use std::path::Path;

/// Checks that the faces are the same everywhere, and that depths differ by at most one step of the last
/// place.
fn check_same(image: &Hits, exact: &Hits) -> Result<(), String> {
    let width = exact.face.width();
    for (k, (&a, &b)) in image.face.pixels().iter().zip(exact.face.pixels()).enumerate() {
        let x = k as u32 % width;
        let y = k as u32 / width;
        if a != b {
            let t = image.depth.at(x, y);
            let u = exact.depth.at(x, y);
            return Err(format!("pixel ({x}, {y}): face {a} at {t}, not {b} at {u}"));
        }
    }
    for (a, b) in image.depth.pixels().iter().zip(exact.depth.pixels()) {
        if (a.to_bits() as i64 - b.to_bits() as i64).abs() > 1 {
            return Err(format!("a depth of {a}, not {b}"));
        }
    }
    Ok(())
}

fn check(mesh: &TriMesh, camera: &Camera, stride: u32) -> Result<(), String> {
    let scene = Scene::new(mesh);
    let image = Caster::new(&scene).cast_strided(camera, stride);
    check_same(&image, &cast_ray_by_ray(&scene, camera, stride))
}

fn corners(picks: &[[i8; 3]]) -> Vec<Vec3> {
    picks.iter().map(|p| Vec3::from(p.map(f32::from))).collect()
}

fn soup(positions: &[Vec3], picks: &[prop::sample::Index]) -> Option<TriMesh> {
    let face = |f: &[prop::sample::Index]| [0, 1, 2].map(|k| f[k].index(positions.len()) as u32);
    TriMesh::from_faces(positions.to_vec(), picks.chunks_exact(3).map(face).collect()).ok()
}

fn camera(pose: Pose, kind: u8) -> Camera {
    match kind {
        0 => Camera::perspective(pose, 1.7, 37, 23),
        1 => Camera::perspective(pose, 0.5, 90, 50),
        2 => Camera::perspective(pose, 2.9, 64, 64),
        3 => Camera::equirectangular(pose, 200),
        4 => Camera::equirectangular(pose, 260),
        5 => Camera::equirectangular(pose, 50),
        // A phone's camera; a crop far off the axis; pixels that are far from square, either way; a wide view
        // with the axis in a corner; a telephoto view.
        6 => pinhole(pose, [40.0, 43.0], [19.5, 13.0], [37, 23]),
        7 => pinhole(pose, [60.0, 60.0], [-150.0, 90.0], [50, 41]),
        8 => pinhole(pose, [900.0, 9.0], [33.0, 20.0], [64, 40]),
        9 => pinhole(pose, [3.0, 400.0], [31.0, 70.0], [64, 40]),
        10 => pinhole(pose, [2.0, 2.5], [0.0, 40.0], [64, 40]),
        _ => pinhole(pose, [90_000.0, 80_000.0], [20.0, 2000.0], [40, 40]),
    }
}

fn pinhole(pose: Pose, focal: [f64; 2], center: [f64; 2], [width, height]: [u32; 2]) -> Camera {
    Camera::pinhole(pose, focal.into(), center.into(), width, height).unwrap()
}

/// The number of kinds of cameras.
const KINDS: u8 = 12;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(160))]

    /// On a lattice, faces share edges, overlap, lie in line with the camera and contain it. Rays along the
    /// axes meet corners and edges exactly.
    #[test]
    fn lattices(
        points in prop::collection::vec(prop::array::uniform3(-3i8..=3), 3..40),
        picks in prop::collection::vec(any::<prop::sample::Index>(), 3..90),
        at in prop::array::uniform3(-6i8..=6), yaw in -3.2..3.2f64, pitch in -1.5..1.5f64,
        kind in 0u8..KINDS, turned in any::<bool>(), stride in prop::sample::select(vec![1u32, 1, 1, 3]),
    ) {
        let Some(mesh) = soup(&corners(&points), &picks) else { return Ok(()) };
        let level = Pose::level(DVec3::from(at.map(f64::from)) * 0.5, 0.0);
        let camera = camera(if turned { level.turned(yaw, pitch) } else { level }, kind);
        prop_assert_eq!(check(&mesh, &camera, stride), Ok(()));
    }

    /// Faces are anywhere, near and far, with duplicates of the other winding, and slivers at each face's
    /// edge.
    #[test]
    fn soups(
        points in prop::collection::vec(prop::array::uniform3(-3.0..3.0f32), 3..40),
        picks in prop::collection::vec(any::<prop::sample::Index>(), 3..60),
        at in prop::array::uniform3(-3.0..3.0f64), yaw in -3.2..3.2f64,
        pitch in -1.5..1.5f64, kind in 0u8..KINDS,
        scale in prop::sample::select(vec![1.0f32, 1e-3, 1e3]),
        thin in prop::sample::select(vec![1e-2f32, 1e-5, 1e-7]),
        far in prop::sample::select(vec![Vec3::ZERO, vec3(800.0, -300.0, 20.0)]),
    ) {
        let mut positions: Vec<Vec3> = points.iter().map(|p| Vec3::from(*p) * scale + far).collect();
        let n = positions.len();
        let mut faces: Vec<[u32; 3]> =
            picks.chunks_exact(3).map(|f| [0, 1, 2].map(|k| f[k].index(n) as u32)).collect();

        for k in 0..faces.len() {
            let [a, b, c] = faces[k];
            let at = |v: u32| positions[v as usize];
            let beside = at(a) + (at(c) - at(a)) * thin;
            positions.push(beside);
            let p = positions.len() as u32 - 1;
            faces.push([a, b, p]);
            if k % 3 == 0 {
                faces.push([c, b, a]);
            }
        }

        let Ok(mesh) = TriMesh::from_faces(positions, faces) else { return Ok(()) };
        let origin = far.as_dvec3() + DVec3::from(at) * f64::from(scale);
        prop_assert_eq!(check(&mesh, &camera(Pose::level(origin, 0.2).turned(yaw, pitch), kind), 1), Ok(()));
    }

    /// The camera is a hair's breadth off a face, beside a corner, or on an edge.
    #[test]
    fn very_near(
        points in prop::collection::vec(prop::array::uniform3(-3.0..3.0f32), 3..20),
        picks in prop::collection::vec(any::<prop::sample::Index>(), 3..30),
        weights in prop::array::uniform2(0.0..0.5f64), off in -9.0..-2.0f64, on in any::<bool>(),
        direction in prop::array::uniform3(-1.0..1.0f64), yaw in -3.2..3.2f64,
        pitch in -1.5..1.5f64, kind in 0u8..KINDS,
    ) {
        let positions: Vec<Vec3> = points.iter().map(|p| Vec3::from(*p)).collect();
        let Some(mesh) = soup(&positions, &picks) else { return Ok(()) };
        let [a, b, c] = mesh.triangle(0).map(|p| p.as_dvec3());
        let on_face = a + (b - a) * weights[0] + (c - a) * if on { 0.0 } else { weights[1] };
        let origin = on_face + DVec3::from(direction) * 10f64.powf(off);
        prop_assert_eq!(check(&mesh, &camera(Pose::level(origin, 0.0).turned(yaw, pitch), kind), 1), Ok(()));
    }
}

#[test]
fn the_pass_is_what_trying_every_face_gives() {
    let mesh = scan_like(2000, 11);
    let scene = Scene::new(&mesh);
    let pose = Pose::level(dvec3(3.0, 2.5, 1.5), 1.0);
    for camera in [
        Camera::perspective(pose.turned(0.4, -0.5), 1.2, 48, 40),
        Camera::equirectangular(pose, 192),
        pinhole(pose.turned(0.4, -0.5), [60.0, 45.0], [-9.5, 31.25], [48, 40]),
        pinhole(pose, [25.0, 25.0], [24.0, 12.0], [30, 40]),
        pinhole(pose.turned(0.0, 0.2), [700.0, 20.0], [60.0, 20.0], [48, 40]),
    ] {
        let hits = Caster::new(&scene).cast(&camera);
        let rays = camera.rays();
        for y in 0..camera.height {
            for x in 0..camera.width {
                let exact = cast_ray_brute_force(&mesh, pose.location, rays.at(x, y));
                assert_eq!(hits.face.at(x, y), exact.map_or(NO_FACE, |h| h.face));
                let t = exact.map_or(f64::INFINITY, |h| h.t);
                assert!(!t.is_finite() || (f64::from(hits.depth.at(x, y)) / t - 1.0).abs() < 1.2e-7);
            }
        }
    }
}

/// Checks whole images, with one caster for all of them.
fn check_images(mesh: &TriMesh, location: DVec3) {
    let scene = Scene::new(mesh);
    let mut caster = Caster::new(&scene);
    let level = Pose::level(location, 0.13);

    let mut cameras: Vec<Camera> = (0..6)
        .map(|k| {
            Camera::perspective(
                level.turned(1.1 * f64::from(k), [0.0, 0.26, -0.9][k as usize % 3]),
                1.3,
                270,
                270,
            )
        })
        .collect();
    cameras.push(Camera::equirectangular(level, 512));
    cameras.push(pinhole(level, [210.0, 214.0], [171.3, 90.8], [320, 180]));
    cameras.push(pinhole(level.turned(2.0, -0.3), [400.0, 100.0], [-80.0, 300.0], [180, 320]));

    // Some cameras are a few millimetres off a surface.
    let near = mesh.triangle(7).map(|p| p.as_dvec3()).iter().sum::<DVec3>() / 3.0 + DVec3::splat(1e-3);
    cameras.push(Camera::perspective(Pose::level(near, 2.0), 1.5, 135, 135));
    cameras.push(Camera::equirectangular(Pose::level(near, 0.0), 256));

    for camera in &cameras {
        let image = caster.cast(camera);
        assert_eq!(check_same(&image, &cast_ray_by_ray(&scene, camera, 1)), Ok(()));
        let strided = caster.cast_strided(camera, 4);
        for y in 0..strided.face.height() {
            for x in 0..strided.face.width() {
                assert_eq!(strided.face.at(x, y), image.face.at(2 + 4 * x, 2 + 4 * y));
            }
        }
    }
}

#[test]
fn images_of_a_scan_like_mesh_are_exact() {
    check_images(&scan_like(60_000, 1), dvec3(3.0, 2.5, 1.5));
}

#[test]
fn images_of_a_real_scan_are_exact() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scans/copyroom/rgb.obj");
    #[allow(clippy::print_stderr)]
    let Ok(text) = std::fs::read_to_string(&path) else {
        return eprintln!("skipped: {} is not there", path.display());
    };
    let mut parts = MeshParts::default();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |k: usize| words[k].parse::<f32>().unwrap();
        match words.first() {
            Some(&"v") => parts.positions.push(vec3(number(1), -number(3), number(2))),
            Some(&"f") => {
                let corner = |k: usize| words[k].split('/').next().unwrap().parse::<u32>().unwrap() - 1;
                parts.faces.push([corner(1), corner(2), corner(3)]);
            }
            _ => {}
        }
    }
    check_images(&TriMesh::new(parts).unwrap(), dvec3(13.1, 9.65, 1.4));
}

#[test]
fn memory_that_was_used_changes_nothing() {
    let mesh = scan_like(3000, 5);
    let scene = Scene::new(&mesh);
    let pose = Pose::level(dvec3(3.0, 2.5, 1.5), 0.0);
    let cameras = [
        Camera::perspective(pose, 1.2, 100, 80),
        Camera::equirectangular(pose, 64),
        Camera::perspective(pose.turned(1.0, 0.5), 1.2, 33, 80),
        Camera::perspective(Pose::level(dvec3(f64::NAN, 0.0, 0.0), 0.0), 1.2, 33, 80),
        Camera::perspective(pose, 1.2, 100, 80),
    ];
    let mut caster = Caster::new(&scene);
    let mut hits = Hits::default();
    for camera in &cameras {
        caster.cast_into(camera, 1, &mut hits);
        assert_eq!(hits, s3d_render::cast(&scene, camera));
    }
    caster.cast_into(&cameras[0], 999, &mut hits);
    assert!(hits.face.is_empty());
}

#[test]
fn an_image_may_be_as_thin_as_it_likes() {
    // Two rows of faces, each in its own clusters. The nearer one appears around row 65,535 of the 70,000
    // rows of pixels, the farther one below it.
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    for (y, top, bottom) in [(0.1, -3.0, -3.1), (0.2, -6.4, -6.8)] {
        for k in -50i32..50 {
            let x = k as f32 * 0.01;
            let first = positions.len() as u32;
            positions.extend([vec3(x - 0.02, y, top), vec3(x + 0.02, y, top), vec3(x, y, bottom)]);
            faces.push([first, first + 1, first + 2]);
        }
    }
    let mesh = TriMesh::from_faces(positions, faces).unwrap();
    let thin = Camera::perspective(Pose::level(DVec3::ZERO, 0.0), 1e-3, 1, 70_000);
    assert_eq!(check(&mesh, &thin, 1), Ok(()));
    assert!(
        Caster::new(&Scene::new(&mesh)).cast(&thin).face.pixels()[67_100..68_900]
            .iter()
            .all(|&f| f >= 100)
    );
    let wide = Camera::perspective(Pose::level(DVec3::ZERO, 0.0), 2.0, 70_000, 1);
    assert_eq!(check(&scan_like(2000, 5), &wide, 1), Ok(()));
}
