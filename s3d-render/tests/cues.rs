//! Cues against plain references, and in scenes whose answers are known.

use crate::room::{all_kinds, room_parts, view};
use proptest::prelude::*;
use s3d_geom::glam::{DVec3, Vec3, dvec2, vec3};
use s3d_geom::primitives::{cuboid, cylinder};
use s3d_geom::{Camera, Pose, Raster, TriMesh};
use s3d_render::{
    BORDER_UNITS, Hits, MISSING_CURVATURE, MISSING_DISTANCE, NO_FACE, Scene, border_distance_image_into,
    border_image_into, cast, color_segment_image_into, corner_image_into, curvature_image_into,
    euclidean_depth_image_into, face_curvatures, face_size_image_into, gray_image, keypoint_image_into,
    mask_image_into, occlusion_edge_image_into, reshading_image_into, surface_segment_image_into,
    texture_edge_image_into, xyz_image,
};
use s3d_synth::scenes::scan_like;

/// Returns an image that a function wrote.
fn made<T: Copy + Default>(make: impl FnOnce(&mut Raster<T>)) -> Raster<T> {
    let mut out = Raster::filled(0, 0, T::default());
    make(&mut out);
    out
}

/// A camera in the origin that looks along +Y: a pixel is a centimetre at a distance of a metre.
fn camera() -> Camera {
    Camera::pinhole(Pose::level(DVec3::ZERO, 0.0), dvec2(100.0, 100.0), dvec2(50.0, 50.0), 100, 100).unwrap()
}

/// A rectangle across +Y at a distance, by its corners (x, z).
fn board(y: f32, low: [f32; 2], high: [f32; 2]) -> Vec<Vec3> {
    let corner = |x, z| vec3(x, y, z);
    let [a, b] = [corner(low[0], low[1]), corner(high[0], low[1])];
    let [c, d] = [corner(high[0], high[1]), corner(low[0], high[1])];
    vec![a, b, c, a, c, d]
}

/// A mesh of triangles, each by its corners.
fn mesh_of(corners: Vec<Vec3>) -> TriMesh {
    let faces = (0..corners.len() as u32 / 3).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]);
    TriMesh::from_faces(corners, faces.collect()).unwrap()
}

/// A ball around the origin: the faces of an octahedron, cut into triangles.
fn ball(radius: f32, cuts: u32) -> TriMesh {
    let mut corners = Vec::new();
    for n in 0..8 {
        let sign = |bit: u32| if n >> bit & 1 == 0 { 1.0f32 } else { -1.0 };
        let [x, y, z] = [sign(0) * Vec3::X, sign(1) * Vec3::Y, sign(2) * Vec3::Z];
        let is_turned = sign(0) * sign(1) * sign(2) < 0.0;
        let at =
            |i: u32, j: u32| (x * (cuts - i - j) as f32 + y * i as f32 + z * j as f32).normalize() * radius;
        let mut add = |triangle: [Vec3; 3]| {
            let [a, b, c] = triangle;
            corners.extend(if is_turned { [a, c, b] } else { [a, b, c] });
        };
        for i in 0..cuts {
            for j in 0..cuts - i {
                add([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 1 < cuts {
                    add([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    mesh_of(corners)
}

#[test]
fn distances_are_from_the_camera_to_the_points() {
    let mesh = scan_like(30_000, 3);
    let scene = Scene::new(&mesh);
    for camera in all_kinds(DVec3::new(3.0, 2.5, 1.5)) {
        let hits = cast(&scene, &camera);
        let points = xyz_image(&hits, &camera);
        let mask = made(|out| mask_image_into(&hits, out));
        for units in [512.0, 1000.0] {
            let distance = made(|out| euclidean_depth_image_into(&hits, &camera, units, out));
            for (at, face) in hits.face.pixels().iter().enumerate() {
                let found = distance.pixels()[at];
                assert_eq!(mask.pixels()[at], if *face == NO_FACE { 0 } else { 255 });
                if *face == NO_FACE {
                    assert_eq!(found, 65_535);
                    continue;
                }
                let point = DVec3::from_array(points.pixels()[at].map(f64::from));
                let expected = (point - camera.pose.location).length() * units;
                // Points are rounded to 32 bits.
                assert!((f64::from(found) - expected).abs() < 0.5 + 2e-3, "{found} for {expected}");
            }
        }
    }
}

#[test]
fn a_lamp_at_the_camera_lights_by_angle_and_distance() {
    let mesh = mesh_of(board(2.0, [-9.0, -9.0], [9.0, 9.0]));
    let scene = Scene::new(&mesh);
    let camera = camera();
    let hits = cast(&scene, &camera);
    let light = made(|out| reshading_image_into(&scene, &hits, &camera, out));
    for (x, y) in [(50, 50), (0, 0), (99, 20), (3, 77)] {
        let offset = dvec2(f64::from(x) - 49.5, f64::from(y) - 49.5) / 100.0;
        let length = (1.0 + offset.length_squared()).sqrt();
        let d = 2.0 * length;
        let expected = 255.0 * f64::min(1.0, 2.5 / length * 8.0 / (8.0 + d * d));
        assert!((f64::from(light.at(x, y)) - expected).abs() <= 0.51, "{x} {y}");
    }

    // From behind it is as bright, and nothing is black.
    let behind = Camera { pose: Pose::level(DVec3::new(0.0, 4.0, 0.0), std::f64::consts::PI), ..camera };
    let hits = cast(&scene, &behind);
    assert!(made(|out| reshading_image_into(&scene, &hits, &behind, out)).at(50, 50) > 200);
    let away = Camera { pose: Pose::level(DVec3::new(0.0, 4.0, 0.0), 0.0), ..camera };
    let hits = cast(&scene, &away);
    assert_eq!(made(|out| reshading_image_into(&scene, &hits, &away, out)).pixels(), [0; 10_000]);
}

#[test]
fn curvatures_of_balls_columns_and_planes() {
    for radius in [0.2f32, 0.5] {
        let curvatures = face_curvatures(&ball(radius, (radius * 200.0) as u32));
        let mean =
            |k: usize| curvatures.iter().map(|c| f64::from(c[k])).sum::<f64>() / curvatures.len() as f64;
        let expected = 1.0 / f64::from(radius);
        for k in [0, 1] {
            assert!((mean(k) / expected - 1.0).abs() < 0.1, "{} for {expected}", mean(k));
        }
        assert!(
            curvatures
                .iter()
                .all(|[larger, smaller]| larger >= smaller && *smaller > 0.0)
        );
    }

    // The mantle of a column is bent one way. Its ends are flat, away from their rims.
    let radius = 0.3;
    let column = TriMesh::new(cylinder(Vec3::ZERO, radius, 1.0, 360)).unwrap();
    let mut seen = 0;
    for (face, [larger, smaller]) in (0..).zip(face_curvatures(&column)) {
        let middle = column.triangle(face).iter().sum::<Vec3>() / 3.0;
        let normal = column.normal(face);
        if normal.z.abs() < 0.1 && (0.1..0.9).contains(&middle.z) {
            assert!((larger * radius - 1.0).abs() < 0.05 && smaller.abs() < 1e-3, "{larger} {smaller}");
            seen += 1;
        }
    }
    assert!(seen > 100);
    // The middles of the faces of a box are more than 5 cm from its edges.
    let flat = face_curvatures(&TriMesh::new(cuboid(Vec3::ZERO, Vec3::ONE)).unwrap());
    assert_eq!(flat, [[0.0; 2]; 12]);
}

#[test]
fn curvatures_are_those_of_the_side_that_is_seen() {
    let mesh = ball(0.25, 50);
    let scene = Scene::new(&mesh);
    let curvatures = face_curvatures(&mesh);
    let image = |camera: &Camera| {
        let hits = cast(&scene, camera);
        made(|out| curvature_image_into(&scene, &hits, camera, &curvatures, out))
    };
    let outside = image(&Camera { pose: Pose::level(DVec3::new(0.0, -1.0, 0.0), 0.0), ..camera() });
    let inside = image(&camera());
    // 127 · (1 + 0.03 · 4) = 142, and as much below.
    let [r, g, b] = outside.at(50, 50);
    assert!((140..=146).contains(&r) && (138..=144).contains(&g) && b == 0, "{r} {g}");
    let [r, g, b] = inside.at(50, 50);
    assert!((110..=116).contains(&r) && (108..=114).contains(&g) && b == 0, "{r} {g}");
    assert_eq!(outside.at(0, 0), MISSING_CURVATURE);
}

#[test]
fn a_board_before_a_wall_has_an_edge_all_around() {
    let mut corners = board(3.0, [-9.0, -9.0], [9.0, 9.0]);
    corners.extend(board(2.0, [-0.4, -0.4], [0.4, 0.4]));
    let mesh = mesh_of(corners);
    let scene = Scene::new(&mesh);
    let hits = cast(&scene, &camera());
    let edges = made(|out| occlusion_edge_image_into(&scene, &hits, &camera(), out));
    // The board covers the pixels 30 to 69 both ways.
    for y in 0..100 {
        for x in 0..100 {
            let is_board = |v: u32| (30..70).contains(&v);
            let is_end = |v: u32| v == 30 || v == 69;
            let expected = is_board(x) && is_board(y) && (is_end(x) || is_end(y));
            assert_eq!(edges.at(x, y) == 255, expected, "({x}, {y})");
        }
    }
}

#[test]
fn what_touches_has_no_occlusion_edge() {
    // The walls of the room have corners of their own.
    let mesh = TriMesh::new(room_parts()).unwrap();
    let scene = Scene::new(&mesh);
    let mut cameras = vec![view(0.4, 0.0), view(2.0, -0.6), view(-1.0, 0.5)];
    cameras.push(Camera::equirectangular(Pose::level(DVec3::new(0.25, -0.5, 1.5), 0.3), 200));
    for camera in cameras {
        let hits = cast(&scene, &camera);
        let edges = made(|out| occlusion_edge_image_into(&scene, &hits, &camera, out));
        assert!(edges.pixels().iter().all(|edge| *edge == 0));
    }
}

#[test]
fn a_panorama_sees_edges_across_its_seam() {
    // Boards behind the camera, where the seam is: the nearer one ends at it.
    let mut corners = board(-3.0, [-9.0, -9.0], [9.0, 9.0]);
    corners.extend(board(-2.0, [0.0, -9.0], [2.0, 9.0]));
    let mesh = mesh_of(corners);
    let scene = Scene::new(&mesh);
    let camera = Camera::equirectangular(Pose::level(DVec3::ZERO, 0.0), 400);
    let hits = cast(&scene, &camera);
    let edges = made(|out| occlusion_edge_image_into(&scene, &hits, &camera, out));
    let borders = made(|out| border_image_into(&hits, &[1, 1, 2, 2], true, out));
    let of_view = made(|out| border_image_into(&hits, &[1, 1, 2, 2], false, out));
    assert_ne!(hits.face.at(0, 100), hits.face.at(399, 100));
    let near = if hits.depth.at(0, 100) < hits.depth.at(399, 100) {
        0
    } else {
        399
    };
    assert_eq!((edges.at(near, 100), edges.at(399 - near, 100)), (255, 0));
    assert_eq!([borders.at(0, 100), borders.at(399, 100)], [255; 2]);
    assert_eq!([of_view.at(0, 100), of_view.at(399, 100)], [0; 2]);
}

/// Hits whose faces are given.
fn hits_of(width: u32, height: u32, faces: Vec<u32>) -> Hits {
    let depth = faces
        .iter()
        .map(|face| if *face == NO_FACE { f32::INFINITY } else { 1.0 });
    Hits {
        depth: Raster::from_vec(width, height, depth.collect()),
        face: Raster::from_vec(width, height, faces),
    }
}

proptest! {
    #[test]
    fn borders_have_another_object_beside_them(
        faces in prop::collection::vec(prop::sample::select(vec![0, 1, 2, 3, NO_FACE]), 7 * 5),
        wraps: bool,
    ) {
        let object = [4, 4, 9, 0];
        let borders = made(|out| border_image_into(&hits_of(7, 5, faces.clone()), &object, wraps, out));
        let at = |x: i32, y: i32| {
            let x = if wraps { x.rem_euclid(7) } else { x };
            let is_inside = (0..7).contains(&x) && (0..5).contains(&y);
            is_inside.then(|| faces[(7 * y + x) as usize]).filter(|face| *face != NO_FACE)
        };
        for (x, y) in (0..5).flat_map(|y| (0..7).map(move |x| (x, y))) {
            let beside = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(dx, dy)| at(x + dx, y + dy));
            let expected = at(x, y).is_some_and(|face| {
                beside.into_iter().flatten().any(|other| object[other as usize] != object[face as usize])
            });
            prop_assert_eq!(borders.at(x as u32, y as u32) == 255, expected);
        }
    }

    #[test]
    fn distances_to_borders_are_the_smallest(
        (width, height) in (1u32..24, 1u32..24),
        share in 1usize..60,
        seed: u64,
        wraps: bool,
    ) {
        let mut state = seed | 1;
        let borders = Raster::from_vec(width, height, (0..width * height).map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            if ((state >> 33) as usize).is_multiple_of(share) { 255 } else { 0 }
        }).collect());
        let found = made(|out| border_distance_image_into(&borders, wraps, out));
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let squares = (0..height).flat_map(|v| (0..width).map(move |u| (u, v)));
            let squares = squares.filter(|(u, v)| borders.at(*u, *v) != 0).map(|(u, v)| {
                let across = u.abs_diff(x);
                let across = if wraps { across.min(width - across) } else { across };
                across.pow(2) + v.abs_diff(y).pow(2)
            });
            let expected = squares.min().map_or(f64::from(MISSING_DISTANCE - 1), |square| {
                (f64::from(square).sqrt() * BORDER_UNITS).round()
            });
            prop_assert_eq!(f64::from(found.at(x, y)), expected, "({}, {})", x, y);
        }
    }

    #[test]
    fn edges_and_keypoints_of_colours_are_those_of_plain_sums(
        (width, height) in (1u32..20, 1u32..20),
        bytes in prop::collection::vec(any::<u8>(), 400),
        wraps: bool,
    ) {
        let gray = Raster::from_vec(width, height, bytes[..(width * height) as usize].to_vec());
        let level = |x: i32, y: i32| {
            let (w, h) = (width as i32, height as i32);
            let x = if wraps { x.rem_euclid(w) } else { x.clamp(0, w - 1) };
            f64::from(gray.at(x as u32, y.clamp(0, h - 1) as u32)) / 255.0
        };
        let edges = made(|out| texture_edge_image_into(&gray, wraps, out));
        let keypoints = made(|out| keypoint_image_into(&gray, wraps, out));
        for (x, y) in (0..height as i32).flat_map(|y| (0..width as i32).map(move |x| (x, y))) {
            let edge = 255.0 * 4.0 * plain_magnitude(&level, x, y);
            let found = f64::from(edges.at(x as u32, y as u32));
            // Blurred levels are rounded to 1/65,280.
            prop_assert!((found - edge.min(255.0)).abs() < 0.52, "({}, {}): {} for {}", x, y, found, edge);

            let response = 2048.0 * plain_response(&level, x / 2 * 2, y / 2 * 2).max(0.0).sqrt();
            let found = f64::from(keypoints.at(x as u32, y as u32));
            let is_near = (found - response.min(255.0)).abs() < 0.6;
            prop_assert!(is_near, "({}, {}): {} for {}", x, y, found, response);
        }
    }
}

/// The Sobel magnitude of levels after a binomial blur.
fn plain_magnitude(level: &impl Fn(i32, i32) -> f64, x: i32, y: i32) -> f64 {
    const BLUR: [f64; 9] = [1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0];
    let blurred = |x: i32, y: i32| {
        let terms = (0..9).flat_map(|j| (0..9).map(move |i| (i, j)));
        let term = |(i, j): (i32, i32)| BLUR[i as usize] * BLUR[j as usize] * level(x + i - 4, y + j - 4);
        terms.map(term).sum::<f64>() / 65_536.0
    };
    let smooth = |dx: i32, dy: i32, along: (i32, i32)| {
        [-1, 0, 1]
            .map(|n: i32| f64::from(2 - n.abs()) / 4.0 * blurred(x + dx + n * along.0, y + dy + n * along.1))
            .iter()
            .sum::<f64>()
    };
    let h = smooth(1, 0, (0, 1)) - smooth(-1, 0, (0, 1));
    let v = smooth(0, 1, (1, 0)) - smooth(0, -1, (1, 0));
    ((h * h + v * v) / 2.0).sqrt()
}

/// The largest determinant of the filters of SURF's first octave.
fn plain_response(level: &impl Fn(i32, i32) -> f64, x: i32, y: i32) -> f64 {
    let sum = |columns: std::ops::Range<i32>, rows: std::ops::Range<i32>| {
        rows.flat_map(|v| columns.clone().map(move |u| (u, v)))
            .map(|(u, v)| level(x + u, y + v))
            .sum::<f64>()
    };
    let of_lobe = |lobe: i32| {
        let (half, third) = (3 * lobe / 2, lobe / 2);
        let xx = sum(-half..half + 1, 1 - lobe..lobe) - 3.0 * sum(-third..third + 1, 1 - lobe..lobe);
        let yy = sum(1 - lobe..lobe, -half..half + 1) - 3.0 * sum(1 - lobe..lobe, -third..third + 1);
        let xy = sum(-lobe..0, -lobe..0) + sum(1..lobe + 1, 1..lobe + 1)
            - sum(1..lobe + 1, -lobe..0)
            - sum(-lobe..0, 1..lobe + 1);
        (xx * yy - 0.81 * xy * xy) / f64::from(9 * lobe * lobe).powi(2)
    };
    [3, 5, 7, 9].map(of_lobe).into_iter().fold(0.0, f64::max)
}

#[test]
fn gray_levels_are_those_of_pillow() {
    let colors = vec![[255, 255, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255], [10, 20, 30], [0, 0, 0]];
    assert_eq!(gray_image(&Raster::from_vec(6, 1, colors)).pixels(), [255, 76, 150, 29, 18, 0]);
}

#[test]
fn corners_are_where_three_walls_meet() {
    let mesh = TriMesh::new(cuboid(Vec3::ZERO, Vec3::ONE)).unwrap();
    let scene = Scene::new(&mesh);
    // The corner of a box, from its diagonal.
    let eye = DVec3::splat(1.0) + DVec3::new(1.0, 1.0, 1.0) * 0.8;
    let pose = Pose::level(eye, 0.0).turned(3.0 * std::f64::consts::FRAC_PI_4, -0.615_479_7);
    let camera = Camera::perspective(pose, 1.4, 200, 200);
    let hits = cast(&scene, &camera);
    let image = made(|out| corner_image_into(&scene, &hits, &camera, out));
    assert_ne!(hits.face.at(100, 100), NO_FACE);
    assert!(image.at(100, 100) > 200, "{}", image.at(100, 100));
    // Nothing is a corner at an edge or on a wall far from it.
    let (mut seen, mut zero) = (0, 0);
    let points = xyz_image(&hits, &camera);
    for (at, point) in points
        .pixels()
        .iter()
        .enumerate()
        .filter(|(at, _)| hits.face.pixels()[*at] != NO_FACE)
    {
        let near = [Vec3::ONE, vec3(0.0, 1.0, 1.0), vec3(1.0, 0.0, 1.0), vec3(1.0, 1.0, 0.0)];
        if near
            .iter()
            .all(|corner| corner.distance(Vec3::from_array(*point)) > 0.3)
        {
            seen += 1;
            zero += usize::from(image.pixels()[at] == 0);
        }
    }
    assert!(seen > 1000 && zero == seen, "{zero} of {seen}");
}

#[test]
fn segments_are_areas_of_a_colour_and_join_across_the_seam() {
    let colors = Raster::from_vec(
        60,
        40,
        (0..2400)
            .map(|at| {
                // A band in the middle, and a little noise.
                let noise = (at * 7919 % 5) as u8;
                if (20..40).contains(&(at % 60)) {
                    [200, noise, 10]
                } else {
                    [noise, 90, 90]
                }
            })
            .collect(),
    );
    let hits = hits_of(60, 40, (0..2400).map(|at| if at == 61 { NO_FACE } else { 0 }).collect());
    let of_view = made(|out| color_segment_image_into(&colors, &hits, false, out));
    let of_panorama = made(|out| color_segment_image_into(&colors, &hits, true, out));
    assert_eq!([5, 30, 55].map(|x| of_view.at(x, 9)), [1, 2, 3]);
    assert_eq!([5, 30, 55].map(|x| of_panorama.at(x, 9)), [1, 2, 1]);
    assert_eq!(of_view.at(1, 1), 0, "what sees nothing is in no segment");
    assert_eq!(of_view.pixels().iter().filter(|number| **number == 0).count(), 1);
    assert_eq!(of_view.pixels().iter().max(), Some(&3));
}

#[test]
fn segments_of_surfaces_are_the_walls() {
    let mesh = TriMesh::new(room_parts()).unwrap();
    let scene = Scene::new(&mesh);
    let camera = view(0.0, 0.0);
    let hits = cast(&scene, &camera);
    let image = made(|out| surface_segment_image_into(&scene, &hits, &camera, out));
    // One segment for each wall, as far as 2 × 2 pixels have one.
    let mut of_wall = std::collections::BTreeMap::<u32, std::collections::BTreeMap<u16, u32>>::new();
    for (face, number) in hits.face.pixels().iter().zip(image.pixels()) {
        *of_wall.entry(face / 2).or_default().entry(*number).or_default() += 1;
    }
    let largest: Vec<u16> = of_wall
        .values()
        .filter_map(|n| n.iter().max_by_key(|n| n.1))
        .map(|n| *n.0)
        .collect();
    assert_eq!(of_wall.len(), 5);
    assert_eq!(largest.iter().collect::<std::collections::BTreeSet<_>>().len(), 5);
    assert_eq!(image.pixels().iter().max(), Some(&5));
}

#[test]
fn faces_have_the_size_of_what_they_cover() {
    // Two halves of a square of 40 pixels: the whole faces count, also where the image ends.
    let mesh = mesh_of(board(2.0, [-0.4, -0.4], [0.4, 0.4]));
    let scene = Scene::new(&mesh);
    let sizes = |camera: &Camera| {
        let hits = cast(&scene, camera);
        let sizes = made(|out| face_size_image_into(&scene, &hits, camera, out));
        let seen = hits.face.pixels().iter().map(|face| *face != NO_FACE);
        assert!(sizes.pixels().iter().map(|size| *size > 0).eq(seen));
        sizes.at(camera.width / 2, camera.height / 2)
    };
    let of_half = |side: f64| (side / 2f64.sqrt()).round() as u8;
    assert_eq!(sizes(&camera()), of_half(40.0));

    // Twice as far away half as large; seen aslant, narrower by the cosine.
    let away = Pose::level(DVec3::new(0.0, -2.0, 0.0), 0.0);
    assert_eq!(sizes(&Camera { pose: away, ..camera() }), of_half(20.0));
    let aside = Pose::look_at(DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0), DVec3::Z).unwrap();
    let aslant = 0.5f64.sqrt().sqrt() * 40.0 / 2f64.sqrt();
    assert!(sizes(&Camera { pose: aside, ..camera() }).abs_diff(of_half(aslant)) <= 1);

    // A panorama has as many pixels for a radian as the pinhole for its tangent.
    let turn = (100.0 * std::f64::consts::TAU).round() as u32 / 2 * 2;
    assert!(
        sizes(&Camera::equirectangular(Pose::level(DVec3::ZERO, 0.0), turn)).abs_diff(of_half(40.0)) <= 1
    );
}
