//! Simulated devices: what they measure, what they miss, and by how much they are off.

use s3d_geom::glam::{DVec3, Vec3, vec3};
use s3d_geom::{MeshParts, Pose, TriMesh, primitives};
use s3d_label::{Class, Room, RoomType};
use s3d_synth::building::ScanLocation;
use s3d_synth::device::{
    DepthCamera, Disturbances, LaserScan, LaserScanner, Mirror, ScanTarget, Walker, turntable_poses,
};
use s3d_synth::{AnnotatedScene, Instance};
use std::f64::consts::FRAC_PI_2;

fn scene_of(parts: MeshParts, color: [u8; 3]) -> AnnotatedScene {
    let colors = vec![color; parts.positions.len()];
    let mesh = TriMesh::new(MeshParts { colors, uvs: Vec::new(), face_uvs: Vec::new(), ..parts }).unwrap();
    let room = Room { room_type: RoomType::OFFICE, number: 1 };
    AnnotatedScene {
        instance_of_face: vec![0; mesh.faces().len()],
        instances: vec![Instance { class: Class::WALL, number: 1, room }],
        mesh,
        locations: vec![ScanLocation { uuid: "0".repeat(32), position: DVec3::ZERO, yaw_rad: 0.0 }],
        title: String::new(),
    }
}

/// A square of 20 m that the level camera at the origin looks at, `y` away.
fn wall(y: f32) -> MeshParts {
    primitives::quad([vec3(-10.0, y, -10.0), vec3(10.0, y, -10.0), vec3(10.0, y, 10.0), vec3(-10.0, y, 10.0)])
}

/// The inside of a box of 20 m × 8 m × 6 m about the origin.
fn hall(color: [u8; 3]) -> AnnotatedScene {
    let mut parts = primitives::cuboid(vec3(-10.0, -4.0, -3.0), vec3(10.0, 4.0, 3.0));
    parts.flip();
    scene_of(parts, color)
}

const WHITE: [u8; 3] = [250; 3];

fn small() -> LaserScanner {
    LaserScanner { columns: 360, rows: 150, ..LaserScanner::default() }
}

/// Only the noise of ranges.
fn exact() -> LaserScanner {
    LaserScanner {
        angle_noise_rad: 0.0,
        beam_m: 0.0,
        beam_rad: 0.0,
        noise_m: 0.0,
        noise_per_m: 0.0,
        ..small()
    }
}

fn scanned(scene: &AnnotatedScene, scanner: &LaserScanner) -> LaserScan {
    ScanTarget::new(scene)
        .laser_scan(&scene.locations[0], scanner, 0)
        .unwrap()
}

fn grid(scan: &LaserScan) -> impl Iterator<Item = (u32, u32)> + use<> {
    let [columns, rows] = scan.size();
    (0..rows).flat_map(move |row| (0..columns).map(move |column| (column, row)))
}

/// The distance of a point from the walls of [`hall`].
fn off_the_hall(p: DVec3) -> f64 {
    let gaps = DVec3::new(10.0, 4.0, 3.0) - p.abs();
    gaps.min_element().abs()
}

#[test]
fn a_laser_without_noise_measures_the_walls() {
    let mut scene = hall(WHITE);
    scene.locations[0].yaw_rad = 0.7;
    scene.locations[0].position = DVec3::new(1.0, 0.5, -0.25);
    let scan = scanned(&scene, &exact());

    let points: Vec<DVec3> = grid(&scan).filter_map(|(c, r)| scan.world_point(c, r)).collect();
    assert!(points.len() > 340 * 150, "{}", points.len());
    assert!(points.iter().all(|p| off_the_hall(*p) < 1e-4));
    // Column 0 is next to the scanner's +x, which the heading turns; azimuths grow to the left.
    let level = 89;
    let first = scan.world_point(0, level).unwrap() - scan.origin;
    let fourth = scan.world_point(90, level).unwrap() - scan.origin;
    assert!((libm::atan2(first.y, first.x) - 0.7).abs() < 0.01);
    assert!((libm::atan2(fourth.y, fourth.x) - 0.7 - FRAC_PI_2).abs() < 0.01);
    assert!(scan.world_point(0, 0).unwrap().z > 2.9);
}

#[test]
fn the_noise_of_ranges_grows_with_them() {
    let scene = hall(WHITE);
    let scan = scanned(&scene, &LaserScanner { angle_noise_rad: 0.0, ..small() });
    let truth = scanned(&scene, &exact());
    // At the ends of the hall 10 m away, and on its sides 4 m away.
    let deviation = |columns: &[u32]| {
        let squares: Vec<f64> = (columns.iter().flat_map(|c| (80..98).map(|r| (*c, r))))
            .map(|(c, r)| f64::from(scan.ranges.at(c, r) - truth.ranges.at(c, r)).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let far = deviation(&[0, 1, 2, 3, 176, 177, 178, 179, 180, 181, 182, 183, 356, 357, 358, 359]);
    let near = deviation(&[86, 87, 88, 89, 90, 91, 92, 93, 266, 267, 268, 269, 270, 271, 272, 273]);
    assert!((far - 0.004).abs() < 0.0006 && (near - 0.0022).abs() < 0.0004, "{far} {near}");
}

#[test]
fn a_beam_on_an_edge_gives_a_mixed_range() {
    // A board 2 m away, before a wall 5 m away.
    let board = primitives::quad([
        vec3(-1.0, 2.0, -1.0),
        vec3(0.003, 2.0, -1.0),
        vec3(0.003, 2.0, 1.0),
        vec3(-1.0, 2.0, 1.0),
    ]);
    let scene = scene_of(MeshParts::merge([wall(5.0), board]), WHITE);
    let between = |scanner: &LaserScanner| {
        let scan = scanned(&scene, scanner);
        let depths = grid(&scan).filter_map(|(c, r)| scan.world_point(c, r));
        depths
            .filter(|p| p.x.abs() < 0.1 && p.z.abs() < 0.3 && p.y > 2.1 && p.y < 4.9)
            .count()
    };
    let wide = LaserScanner { columns: 3600, beam_m: 0.01, ..exact() };
    assert_eq!(between(&LaserScanner { beam_m: 0.0, ..wide.clone() }), 0);
    assert!(between(&wide) > 3);
}

#[test]
fn dark_and_glancing_surfaces_and_the_far_return_nothing() {
    let share = |scene: &AnnotatedScene| {
        let scan = scanned(scene, &small());
        grid(&scan).filter(|(c, r)| scan.point(*c, *r).is_some()).count() as f64 / (360.0 * 150.0)
    };
    assert!(share(&hall(WHITE)) > 0.99 && share(&hall([20; 3])) < 0.01);
    let grey = share(&hall([45; 3]));
    assert!((0.2..0.95).contains(&grey), "{grey}");

    // A floor at knee height, which rays meet ever more aslant.
    let parts = primitives::grid(vec3(-60.0, -60.0, -0.5), Vec3::X * 120.0, Vec3::Y * 120.0, [1, 1]);
    let scan = scanned(&scene_of(parts, WHITE), &small());
    let farthest = grid(&scan)
        .filter_map(|(c, r)| scan.point(c, r))
        .map(|p| p.length())
        .fold(0.0, f64::max);
    assert!((5.0..30.0).contains(&farthest), "{farthest}");
}

#[test]
fn a_mirror_shows_a_ghost_and_a_person_is_in_one_scan() {
    let scene = hall(WHITE);
    let target = ScanTarget::new(&scene);
    let scan = |disturbances, number| {
        let scanner = LaserScanner { disturbances, ..exact() };
        target.laser_scan(&scene.locations[0], &scanner, number).unwrap()
    };

    // On the wall at y = 4: it shows the wall at y = −4 as if at 12.
    let half = [vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0)];
    let mirror = Mirror { middle: vec3(0.0, 3.99, 0.0), half };
    let ghost = scan(Disturbances { mirrors: vec![mirror], walker: None }, 0);
    let behind: Vec<DVec3> = grid(&ghost)
        .filter_map(|(c, r)| ghost.point(c, r))
        .filter(|p| p.y > 4.1)
        .collect();
    assert!(behind.len() > 300 && behind.iter().all(|p| (p.y - 11.98).abs() < 1e-3));

    let walker =
        Walker { numbers: 1..2, from: vec3(3.0, 1.0, -3.0), to: vec3(3.0, -1.0, -3.0), height_m: 1.8 };
    let disturbed = Disturbances { mirrors: Vec::new(), walker: Some(walker) };
    let inside = |scan: &LaserScan| {
        let points = grid(scan).filter_map(|(c, r)| scan.point(c, r));
        points.filter(|p| off_the_hall(*p) > 0.1).collect::<Vec<_>>()
    };
    assert!(inside(&scan(disturbed.clone(), 0)).is_empty() && inside(&scan(disturbed.clone(), 2)).is_empty());
    let person = inside(&scan(disturbed, 1));
    assert!(person.len() > 50 && person.iter().all(|p| (p.x - 3.0).abs() < 0.3 && p.z < -1.1), "{person:?}");
}

fn level() -> Pose {
    Pose::level(DVec3::ZERO, 0.0)
}

#[test]
fn depths_are_off_as_published() {
    // Khoshelham and Oude Elberink 2012: 1.4 mm times the square of the depth.
    for (depth, expected) in [(1.0, 0.0014), (3.0, 0.0128)] {
        let scene = scene_of(wall(depth), WHITE);
        let camera = DepthCamera { aside_px: 0.0, ..DepthCamera::default() };
        let picture = ScanTarget::new(&scene).depth_picture(&level(), &camera, 0).unwrap();
        let off: Vec<f64> = picture.depth.pixels().iter().map(|d| f64::from(d - depth)).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let deviation = (off.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / off.len() as f64).sqrt();
        // The steps of disparities add to it.
        assert!(
            (0.9..1.35).contains(&(deviation / expected)) && mean.abs() < 0.5 * expected,
            "{mean} {deviation}"
        );

        let mut levels: Vec<u64> = picture
            .depth
            .pixels()
            .iter()
            .map(|d| (d / 0.0002).round() as u64)
            .collect();
        levels.sort_unstable();
        levels.dedup();
        assert!((3..12).contains(&levels.len()), "{levels:?}");

        // The mean of many measurements is better.
        let many = DepthCamera { frames: 16, aside_px: 0.0, ..DepthCamera::default() };
        let picture = ScanTarget::new(&scene).depth_picture(&level(), &many, 0).unwrap();
        let squares = picture.depth.pixels().iter().map(|d| f64::from(d - depth).powi(2));
        assert!((squares.sum::<f64>() / off.len() as f64).sqrt() < 0.4 * deviation);
    }
}

#[test]
fn the_projector_throws_a_shadow_beside_an_edge() {
    // A board 1 m away before a wall 3 m away. The projector is 7.5 cm to the right, so the shadow is on the
    // left of the board, 15 cm wide on the wall.
    let board = primitives::quad([
        vec3(-0.2, 1.0, -0.2),
        vec3(0.2, 1.0, -0.2),
        vec3(0.2, 1.0, 0.2),
        vec3(-0.2, 1.0, 0.2),
    ]);
    let scene = scene_of(MeshParts::merge([wall(3.0), board]), WHITE);
    let camera = DepthCamera { aside_px: 0.0, ..DepthCamera::default() };
    let picture = ScanTarget::new(&scene).depth_picture(&level(), &camera, 0).unwrap();
    let holes: Vec<u32> = (0..640).filter(|x| picture.depth.at(*x, 240).is_nan()).collect();
    // The left edge is at 320 − 0.2 · 525 = 215, the shadow 0.15 / 3 · 525 = 26 pixels wide.
    assert!(holes.len().abs_diff(26) <= 1 && holes[0].abs_diff(189) <= 1, "{holes:?}");
    assert!(holes[holes.len() - 1].abs_diff(214) <= 1);
    assert!(picture.colors.pixels().iter().all(|c| *c == WHITE));
}

#[test]
fn depths_end_at_the_range_and_on_dark_and_glancing_surfaces() {
    let count = |parts, color| {
        let scene = scene_of(parts, color);
        let camera = DepthCamera::default().scaled(0.25);
        let picture = ScanTarget::new(&scene).depth_picture(&level(), &camera, 0).unwrap();
        picture.depth.pixels().iter().filter(|d| d.is_finite()).count()
    };
    let all = 160 * 120;
    assert_eq!(count(wall(2.0), WHITE), all);
    assert_eq!((count(wall(0.4), WHITE), count(wall(4.2), WHITE), count(wall(2.0), [8; 3])), (0, 0, 0));
    // A wall along the view.
    let aside = primitives::quad([
        vec3(0.1, 9.0, -3.0),
        vec3(0.1, 0.0, -3.0),
        vec3(0.1, 0.0, 3.0),
        vec3(0.1, 9.0, 3.0),
    ]);
    let seen = count(aside, WHITE);
    assert!(seen < all / 10, "{seen}");
}

#[test]
fn threads_and_order_change_nothing() {
    let scene = hall(WHITE);
    let target = ScanTarget::new(&scene);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let laser = scanned(&scene, &LaserScanner { columns: 90, rows: 40, ..small() });
            let camera = DepthCamera::turntable().scaled(0.05);
            let picture = target.depth_picture(&level(), &camera, 5).unwrap();
            let bits = |pixels: &[f32]| pixels.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            (bits(laser.ranges.pixels()), bits(picture.depth.pixels()), laser.colors, picture.colors)
        })
    };
    assert!(with(1) == with(2));

    let of = |seed, number| {
        let scanner = LaserScanner { columns: 30, rows: 20, seed, ..small() };
        target.laser_scan(&scene.locations[0], &scanner, number).unwrap().ranges
    };
    assert!(of(1, 0) != of(2, 0) && of(1, 0) != of(1, 1));
}

#[test]
fn cameras_stand_where_people_put_them() {
    let location = ScanLocation { uuid: String::new(), position: DVec3::new(1.0, 2.0, 1.5), yaw_rad: 0.4 };
    let stops = turntable_poses(&location);
    let heading = Pose::level(location.position, 0.4).forward();
    let first = stops.iter().find(|s| (s.camera, s.yaw) == (1, 0)).unwrap();
    assert!(first.pose.forward().abs_diff_eq(heading, 1e-12));
    for stop in &stops {
        assert!(stop.pose.location.distance(location.position) < 0.1);
        let pitch = libm::asin(stop.pose.forward().z).to_degrees();
        assert!((pitch - [33.0, 0.0, -33.0][stop.camera as usize]).abs() < 1e-9);
    }

    let scene = hall(WHITE);
    let target = ScanTarget::new(&scene);
    let near_a_wall = ScanLocation { position: DVec3::new(0.0, 3.3, 0.0), ..location };
    let path = target.hand_held_poses(&near_a_wall, 40);
    assert!(path.len() == 40 && path.iter().all(|p| p.location.y < 3.55 && p.location.z.abs() < 0.2));
    assert!(path.iter().all(|p| p.forward().z.abs() < 0.7));
}

#[test]
fn numbers_out_of_range_are_refused() {
    let scene = hall(WHITE);
    let target = ScanTarget::new(&scene);
    let laser = |scanner| {
        target
            .laser_scan(&scene.locations[0], &scanner, 0)
            .unwrap_err()
            .to_string()
    };
    assert!(laser(LaserScanner { columns: 0, ..small() }).starts_with("the number of columns is 0"));
    assert!(
        laser(LaserScanner { elevation_rad: [0.5, 0.2], ..small() }).contains("the highest elevation is 0.2")
    );
    assert!(laser(LaserScanner { noise_m: f32::NAN, ..small() }).contains("the noise of ranges is NaN"));
    let camera = |camera| target.depth_picture(&level(), &camera, 0).unwrap_err().to_string();
    assert!(
        camera(DepthCamera { frames: 0, ..DepthCamera::default() })
            .contains("the number of measurements is 0")
    );
    assert!(
        camera(DepthCamera { range_m: [2.0, 1.0], ..DepthCamera::default() })
            .contains("the largest depth is 1")
    );
}
