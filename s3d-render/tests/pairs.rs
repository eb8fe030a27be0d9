//! Pairs of images, against all images against all, and in a scene whose answers are known.

use s3d_geom::glam::{DVec3, Vec3, dvec2, dvec3, vec3};
use s3d_geom::{Camera, Pose, TriMesh};
use s3d_render::{NO_FACE, PairOptions, Scene, ViewPair, cast, cast_ray, correspondences, view_pairs};
use s3d_synth::scenes::scan_like;

/// A wall of 4 m × 2 m across +Y, 2 m ahead of the origin.
fn wall() -> TriMesh {
    let corners =
        vec![vec3(-2.0, 2.0, -1.0), vec3(2.0, 2.0, -1.0), vec3(2.0, 2.0, 1.0), vec3(-2.0, 2.0, 1.0)];
    TriMesh::from_faces(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

/// A camera that looks along +Y and sees 2 m × 2 m at 2 m, as 100 × 100 pixels for a scale of 1.
fn ahead(location: DVec3, scale: f64) -> Camera {
    let side = (100.0 * scale) as u32;
    let focal = dvec2(100.0, 100.0) * scale;
    Camera::pinhole(Pose::level(location, 0.0), focal, dvec2(50.0, 50.0) * scale, side, side).unwrap()
}

fn pair(pairs: &[Vec<ViewPair>], a: usize, b: usize) -> Option<ViewPair> {
    pairs[a].iter().find(|pair| pair.other as usize == b).copied()
}

#[test]
fn cameras_beside_each_other_share_half_of_what_they_see() {
    let mesh = wall();
    let behind = Camera::perspective(Pose::level(dvec3(0.0, 4.0, 0.0), 180f64.to_radians()), 1.0, 50, 50);
    let cameras =
        [ahead(DVec3::ZERO, 1.0), ahead(dvec3(1.0, 0.0, 0.0), 2.0), behind, ahead(dvec3(9.0, 0.0, 0.0), 1.0)];
    let pairs = view_pairs(&Scene::new(&mesh), &cameras, &PairOptions::default());

    let there = pair(&pairs, 0, 1).unwrap();
    assert!((there.overlap - 0.5).abs() < 0.03, "{there:?}");
    // Pixels of the other image are half as large, at the same depth.
    assert!((there.scale - 2.0).abs() < 1e-5 && (there.distance_m - 1.0).abs() < 1e-6);
    assert!((24.0..30.0).contains(&there.angle_deg) && there.turn_deg < 1e-3, "{there:?}");
    let back = pair(&pairs, 1, 0).unwrap();
    assert!((back.scale - 0.5).abs() < 1e-5 && (back.angle_deg - there.angle_deg).abs() < 1.0);
    // The other side of the wall is another surface, and nothing is seen from afar.
    assert!(pairs[2].is_empty() && pairs[3].is_empty(), "{pairs:?}");
}

#[test]
fn turned_cameras_at_one_place_need_no_rays() {
    let mesh = wall();
    let pose = Pose::level(DVec3::ZERO, 0.0);
    let cameras = [ahead(DVec3::ZERO, 1.0), Camera::equirectangular(pose, 200)];
    let pairs = view_pairs(&Scene::new(&mesh), &cameras, &PairOptions::default());
    assert_eq!(pair(&pairs, 0, 1).unwrap().overlap, 1.0);
    let back = pair(&pairs, 1, 0).unwrap();
    assert!((0.4..0.7).contains(&back.overlap) && back.angle_deg < 1e-3, "{back:?}");
}

#[test]
fn correspondences_are_what_single_rays_of_both_cameras_meet() {
    let mesh = wall();
    let scene = Scene::new(&mesh);
    let cameras = [ahead(DVec3::ZERO, 1.0), ahead(dvec3(1.0, 0.0, 0.0), 2.0)];
    let [here, there] = &cameras;
    let found = correspondences(&scene, [here, there], 200);
    assert_eq!(found.len(), 200);
    assert_eq!(correspondences(&scene, [here, there], usize::MAX).len(), 50 * 100, "half of the pixels");
    assert_eq!(correspondences(&scene, [here, there], 7), found[..7]);
    for c in &found {
        // The wall is 1 m to the left of the other camera, whose pixels are half as large.
        assert!((c.pixels[1] - 2.0 * (c.pixels[0] - dvec2(50.0, 0.0))).length() < 1e-3, "{c:?}");
        for eye in [here.pose.location, there.pose.location] {
            let hit = cast_ray(&scene, eye, c.point - eye).unwrap();
            assert!((hit.t - 1.0).abs() < 1e-6 && hit.face == c.face, "{c:?}");
        }
    }
    // Spread over all columns and rows that both see.
    let columns: Vec<u32> = found.iter().map(|c| c.pixels[0].x as u32).collect();
    assert!(
        (50..100)
            .step_by(10)
            .all(|from| columns.iter().filter(|x| **x / 10 == from / 10).count() > 20)
    );

    let behind = Camera::perspective(Pose::level(dvec3(0.0, 4.0, 0.0), 180f64.to_radians()), 1.0, 50, 50);
    assert!(correspondences(&scene, [here, &behind], 10).is_empty(), "the other side is another surface");

    // In an untidy scan, what lies in between hides.
    let mesh = scan_like(4000, 5);
    let scene = Scene::new(&mesh);
    let bounds = mesh.aabb();
    let middle = bounds.min.as_dvec3() + 0.5 * bounds.size().as_dvec3();
    let eyes = [dvec3(-0.4, -0.3, 0.1), dvec3(0.5, 0.2, -0.1)];
    let cameras = eyes.map(|off| Camera::equirectangular(Pose::level(middle + off, 0.3), 128));
    let found = correspondences(&scene, [&cameras[0], &cameras[1]], 1000);
    assert!(found.len() > 100, "{}", found.len());
    for c in &found {
        let eye = cameras[1].pose.location;
        assert!(cast_ray(&scene, eye, c.point - eye).unwrap().t > 1.0 - 2e-3, "{c:?}");
    }
}

/// The same for all images against all, by single rays.
fn overlap(mesh: &TriMesh, scene: &Scene<'_>, here: &Camera, there: &Camera, stride: u32) -> f64 {
    let hits = cast(scene, here);
    let rays = here.rays();
    let [mut all, mut seen] = [0, 0];
    for y in (stride / 2..here.height).step_by(stride as usize) {
        for x in (stride / 2..here.width).step_by(stride as usize) {
            let face = hits.face.at(x, y);
            if face == NO_FACE {
                continue;
            }
            all += 1;
            let point = here.pose.location + rays.at(x, y) * f64::from(hits.depth.at(x, y));
            let [from, to] = [here, there].map(|camera| point - camera.pose.location);
            let normal: Vec3 = mesh.normal(face);
            let same_side = (normal.as_dvec3().dot(from) > 0.0) == (normal.as_dvec3().dot(to) > 0.0);
            let in_frame = there.project(point).is_some_and(|(pixel, _)| {
                (0.0..f64::from(there.width)).contains(&pixel.x)
                    && (0.0..f64::from(there.height)).contains(&pixel.y)
            });
            let hit = cast_ray(scene, there.pose.location, to);
            let is_free = hit.is_none_or(|hit| hit.t * to.length() > to.length() - 1e-3);
            seen += u32::from(same_side && in_frame && is_free);
        }
    }
    f64::from(seen) / f64::from(all)
}

#[test]
fn pairs_are_those_of_all_against_all() {
    let mesh = scan_like(8000, 3);
    let scene = Scene::new(&mesh);
    let bounds = mesh.aabb();
    let size = bounds.size().as_dvec3();
    let mut cameras = Vec::new();
    for k in 0..8u32 {
        let at = |n: u32| 0.15 + 0.7 * f64::from(k * n % 11) / 10.0;
        let location = bounds.min.as_dvec3() + dvec3(at(3), at(7), 0.5) * size;
        for turn in 0..4 {
            let pose = Pose::level(location, f64::from(turn) * 1.6 + f64::from(k));
            cameras.push(Camera::perspective(pose.turned(0.0, -0.2), 1.3, 80, 60));
        }
        cameras.push(Camera::equirectangular(Pose::level(location, 0.0), 120));
    }
    let options = PairOptions { samples: 300, min_overlap: 0.05 };
    let pairs = view_pairs(&scene, &cameras, &options);

    let stride = |camera: &Camera| (f64::from(camera.width * camera.height) / 300.0).sqrt().floor() as u32;
    let mut count = 0;
    for (a, here) in cameras.iter().enumerate() {
        for (b, there) in cameras.iter().enumerate().filter(|(b, _)| *b != a) {
            let expected = overlap(&mesh, &scene, here, there, stride(here));
            let back = overlap(&mesh, &scene, there, here, stride(there));
            match pair(&pairs, a, b) {
                Some(found) => {
                    assert!(
                        (f64::from(found.overlap) - expected).abs() < 0.006,
                        "{a} {b}: {found:?} {expected}"
                    );
                    assert!(pair(&pairs, b, a).is_some());
                    count += 1;
                }
                None => assert!(expected.max(back) < 0.056, "{a} {b}: {expected} {back} are left out"),
            }
        }
        assert!(pairs[a].is_sorted_by_key(|pair| pair.other));
    }
    assert!(count > 100, "{count} pairs");
}
