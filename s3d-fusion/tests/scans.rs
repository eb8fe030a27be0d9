//! Laser scans: with a grid, without one, and rays with an origin each.

use crate::common::{Shape, distance, errors, first_hit, fusion, room};
use s3d_fusion::{DecimateOptions, FusedMesh, MeshColumns, RangeImage, SensorNoise, decimate};
use s3d_geom::glam::{DQuat, DVec3, Vec3, dvec3};
use s3d_geom::{NearestFaces, Pose, TriMesh};
use std::f64::consts::{PI, TAU};

const COLUMNS: u32 = 720;
const ROWS: u32 = 300;

fn shapes() -> Vec<Shape> {
    let mut shapes = room(2.0);
    shapes.push(Shape::cuboid(dvec3(0.6, 0.5, -2.0), dvec3(1.1, 1.2, -1.2)));
    shapes
}

/// The points that a scanner on a tilted tripod sees, row by row, from 60° below to 90° above.
fn scan(pose: &Pose, shapes: &[Shape]) -> Vec<Vec3> {
    let turn = pose.opencv_from_world().transpose();
    let point = |i: u32| {
        let azimuth = PI - TAU * f64::from(i % COLUMNS) / f64::from(COLUMNS);
        let down = -0.5 * PI + (f64::from(i / COLUMNS) + 0.5) * (150_f64.to_radians() / f64::from(ROWS));
        let ray = turn * dvec3(down.cos() * azimuth.sin(), down.sin(), down.cos() * azimuth.cos());
        // One of a hundred beams does not come back.
        let range = if i % 101 == 7 {
            f64::NAN
        } else {
            first_hit(shapes, pose.location, ray)
        };
        (pose.location + ray * range).as_vec3()
    };
    (0..COLUMNS * ROWS).map(point).collect()
}

fn poses() -> [Pose; 2] {
    [(dvec3(-0.7, -0.4, -0.3), 0.3), (dvec3(0.3, -1.1, -0.4), 2.0)]
        .map(|(at, yaw)| Pose::from_scanner(at, DQuat::from_rotation_z(yaw) * DQuat::from_rotation_x(0.02)))
}

fn check(mesh: &FusedMesh) {
    let [mean, _] = errors(&shapes(), mesh);
    // Where a scanner sees past an edge and nobody sees behind it, the end of the surface is not known.
    let far = mesh
        .positions
        .iter()
        .filter(|p| distance(&shapes(), **p) > 0.03)
        .count();
    assert!(mean < 0.05 * 0.03 && far * 1000 < mesh.positions.len(), "{mean} {far}");
    // The ceiling, the floor and the top of the box are there.
    for (place, count) in
        [(dvec3(0.0, 1.0, 2.0), 300), (dvec3(-1.0, 0.0, -2.0), 300), (dvec3(0.8, 0.8, -1.2), 100)]
    {
        let near = mesh
            .positions
            .iter()
            .filter(|p| p.as_dvec3().distance(place) < 0.4)
            .count();
        assert!(near > count, "{near} at {place}");
    }
}

#[test]
fn scans_on_a_grid() {
    let mut fusion = fusion(0.03);
    for pose in poses() {
        let image =
            RangeImage::from_scan(pose, [COLUMNS, ROWS], &scan(&pose, &shapes()), &[], SensorNoise::LASER)
                .unwrap();
        assert_eq!((image.width(), image.height()), (COLUMNS, ROWS), "the scan's own grid");
        fusion.add(&image).unwrap();
    }
    check(&fusion.mesh().unwrap());
}

/// Long thin faces are left, about which distances are hard to compute.
#[test]
fn a_room_seen_from_one_place_keeps_the_bound_of_its_decimation() {
    let walls = [
        (DVec3::ZERO, DVec3::X),
        (DVec3::ZERO, DVec3::Y),
        (DVec3::ZERO, DVec3::Z),
        (dvec3(5.0, 4.0, 2.6), -DVec3::X),
        (dvec3(5.0, 4.0, 2.6), -DVec3::Y),
        (dvec3(5.0, 4.0, 2.6), -DVec3::Z),
    ];
    let mut shapes = walls.map(|(at, normal)| Shape::Plane(at, normal)).to_vec();
    shapes.push(Shape::cuboid(dvec3(3.0, 1.0, 0.0), dvec3(3.4, 1.4, 2.6)));
    let pose = Pose::from_scanner(dvec3(1.3, 2.1, 1.4), DQuat::IDENTITY);
    let points: Vec<Vec3> = scan(&pose, &shapes).into_iter().filter(|p| p.is_finite()).collect();
    let level = Pose::level(pose.location, 0.0);
    let image = RangeImage::from_points(level, &points, &[], SensorNoise::LASER).unwrap();
    let mut fusion = fusion(0.03);
    fusion.add(&image).unwrap();
    let fused = fusion.mesh().unwrap();

    let options = DecimateOptions::default();
    let columns = MeshColumns { positions: &fused.positions, faces: &fused.faces, colors: &fused.colors };
    let small = decimate(&columns, &options).unwrap();
    assert!(small.faces.len() * 4 < fused.faces.len(), "{} of {}", small.faces.len(), fused.faces.len());
    assert!(small.max_error_m <= f64::from(options.max_error_m), "{}", small.max_error_m);
    let mesh = TriMesh::from_faces(small.positions, small.faces).unwrap();
    let mut found = Vec::new();
    NearestFaces::new(&mesh).nearest_many(&fused.positions, &mut found);
    let far = found.iter().map(|n| n.distance_m).fold(0.0, f32::max);
    assert!(far <= options.max_error_m, "{far}");
}

#[test]
fn points_without_a_grid() {
    let mut fusion = fusion(0.03);
    for pose in poses() {
        let mut points: Vec<Vec3> = scan(&pose, &shapes()).into_iter().filter(|p| p.is_finite()).collect();
        // In no order.
        points.sort_by(|a, b| (a.x * 7919.0).fract().total_cmp(&(b.x * 7919.0).fract()));
        let colors: Vec<[u8; 3]> = points
            .iter()
            .map(|p| if p.z < -1.9 { [200, 10, 10] } else { [9, 9, 200] })
            .collect();
        let level = Pose::level(pose.location, 0.0);
        let image = RangeImage::from_points(level, &points, &colors, SensorNoise::LASER).unwrap();
        let pixel = TAU / f64::from(image.width());
        assert!((0.5..2.0).contains(&(pixel / (TAU / f64::from(COLUMNS)))), "{} columns", image.width());
        fusion.add(&image).unwrap();
    }
    let mesh = fusion.mesh().unwrap();
    check(&mesh);
    let is_floor = |p: &Vec3| p.z < -1.95;
    let red = mesh
        .positions
        .iter()
        .zip(&mesh.colors)
        .filter(|(p, c)| is_floor(p) && c[0] == 200)
        .count();
    assert!(red * 10 > mesh.positions.iter().filter(|p| is_floor(p)).count() * 9);
}

#[test]
fn a_scan_whose_columns_are_no_columns_is_taken_as_points() {
    let [pose, _] = poses();
    let mut points = scan(&pose, &shapes());
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    let image = RangeImage::from_scan(pose, [COLUMNS, ROWS], &points, &[], SensorNoise::LASER).unwrap();
    assert_ne!((image.width(), image.height()), (COLUMNS, ROWS));
}

/// A scanner walks through the room, and somebody stands there for the first half of its way.
#[test]
fn rays_with_an_origin_each_carve_what_they_pass() {
    let empty = room(1.5);
    let mut visited = empty.clone();
    visited.push(Shape::cuboid(dvec3(0.4, 0.4, -1.5), dvec3(0.7, 0.7, 0.2)));
    let count = 160_000_u32;
    let ray = |i: u32| {
        // A spiral of directions, and a way through the room.
        let t = f64::from(i) / f64::from(count);
        let origin = dvec3(-1.0 + 1.6 * t, -0.6, 0.3 * (6.0 * t).sin());
        let up = 2.0 * (f64::from(i) * 0.754_877_666).fract() - 1.0;
        let azimuth = TAU * (f64::from(i) * 0.569_840_291).fract();
        let flat = (1.0 - up * up).sqrt();
        let direction = dvec3(flat * azimuth.cos(), flat * azimuth.sin(), up);
        let shapes = if t < 0.3 { &visited } else { &empty };
        [origin, origin + direction * first_hit(shapes, origin, direction)].map(|p: DVec3| p.as_vec3())
    };
    let rays: Vec<[Vec3; 2]> = (0..count).map(ray).collect();
    let (origins, points): (Vec<Vec3>, Vec<Vec3>) = rays.iter().map(|[a, b]| (*a, *b)).unzip();
    let mut fusion = fusion(0.04);
    fusion.add_rays(&origins, &points, &[], SensorNoise::LASER).unwrap();
    let mesh = fusion.mesh().unwrap();
    let left = mesh.positions.iter().filter(|p| distance(&empty, **p) > 0.1).count();
    assert!(left * 500 < mesh.positions.len(), "{left} of {}", mesh.positions.len());
    let [mean, _] = errors(&empty, &mesh);
    assert!(mean < 0.05 * 0.04, "{mean}");
    // Six walls of 3 × 3 m have 75 × 75 cells each, and few are missing.
    assert!(mesh.faces.len() > 6 * 75 * 75 * 2 * 8 / 10, "{}", mesh.faces.len());
}
