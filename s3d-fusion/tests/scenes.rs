//! What is hard about scenes: thin things, steps in depth, people who walk through.

use crate::common::{Shape, circle, distance, errors, fused, fusion, lens, look, picture, room};
use s3d_geom::glam::{DVec3, Vec3, dvec3};

#[test]
fn both_sides_of_a_door_and_the_legs_of_a_table_are_kept() {
    // A door of 4 cm, and a leg of 3 × 3 cm, with cells of 1 cm.
    let door = Shape::cuboid(dvec3(-0.3, -0.02, -0.4), dvec3(0.3, 0.02, 0.4));
    let leg = Shape::cuboid(dvec3(0.6, -0.015, -0.4), dvec3(0.63, 0.015, 0.4));
    let mut shapes = room(3.0);
    shapes.extend([door, leg]);
    let poses = circle(dvec3(0.15, 0.0, 0.0), 1.4, 0.2, 8);
    let mesh = fused(&shapes, &poses, lens(240, 240, 260.0), 0.01);

    let near = |shape: Shape| {
        let is_near = move |p: &&Vec3| shape.distance(p.as_dvec3()).abs() < 0.05 && p.z.abs() < 0.3;
        mesh.positions.iter().filter(is_near).copied().collect::<Vec<_>>()
    };
    // The door's sides of 60 × 60 cm have some 3,600 crossings each.
    let [front, back] =
        [-1.0, 1.0].map(|s| near(door).iter().filter(|p| (p.y - s * 0.02).abs() < 0.003).count());
    assert!(front > 3400 && back > 3400, "{front} {back}");
    let leg_points = near(leg);
    let off: f64 = leg_points.iter().map(|p| distance(&[leg], *p)).sum::<f64>() / leg_points.len() as f64;
    assert!(leg_points.len() > 60 * 10 && off < 0.002, "{} {off}", leg_points.len());
    // At each height the leg has points on all four sides.
    for k in -5..5 {
        let height = k as f32 * 0.05;
        let ring: Vec<&Vec3> = leg_points.iter().filter(|p| (p.z - height).abs() < 0.006).collect();
        let sides = [
            ring.iter().any(|p| p.x < 0.605),
            ring.iter().any(|p| p.x > 0.625),
            ring.iter().any(|p| p.y < -0.01),
            ring.iter().any(|p| p.y > 0.01),
        ];
        assert_eq!(sides, [true; 4], "at {height} m");
    }
}

#[test]
fn a_sheet_of_no_thickness_has_both_sides_within_a_cell() {
    let sheet = Shape::cuboid(dvec3(-0.3, -0.0005, -0.4), dvec3(0.3, 0.0005, 0.4));
    // Three images see its front, and one sees its back.
    let eyes = [dvec3(-0.4, -1.2, 0.0), dvec3(0.0, -1.2, 0.3), dvec3(0.4, -1.2, 0.0), dvec3(0.2, 1.2, 0.0)];
    let mesh = fused(&[sheet], &eyes.map(|eye| look(eye, DVec3::ZERO)), lens(240, 240, 260.0), 0.01);

    let is_within = |p: &&Vec3| p.x.abs() < 0.25 && p.z.abs() < 0.35;
    let offs: Vec<f32> = mesh.positions.iter().filter(is_within).map(|p| p.y).collect();
    let most = offs.iter().fold(0.0_f32, |most, y| most.max(y.abs()));
    // A side of 50 × 70 cm has some 3,500 crossings.
    assert!(offs.len() > 6500 && most < 0.01, "{} {most}", offs.len());
}

#[test]
fn where_images_disagree_a_surface_is_one_that_an_image_saw() {
    // Three images see a sheet, and one says that it is 5.5 cm farther away.
    let sheet_at = |y: f64| [Shape::cuboid(dvec3(-0.3, y, -0.4), dvec3(0.3, y + 0.001, 0.4))];
    let eyes = [dvec3(-0.4, -1.2, 0.0), dvec3(0.0, -1.2, 0.3), dvec3(0.4, -1.2, 0.0), dvec3(0.2, -1.2, 0.0)];
    let mut fusion = fusion(0.01);
    for (eye, y) in eyes.into_iter().zip([0.0, 0.0, 0.0, 0.055]) {
        let picture = picture(&sheet_at(y), look(eye, DVec3::ZERO), lens(240, 240, 260.0));
        fusion.add(&picture).unwrap();
    }
    let mesh = fusion.mesh().unwrap();

    let is_within = |p: &&Vec3| p.x.abs() < 0.25 && p.z.abs() < 0.35;
    let between = |low: f32, high: f32| {
        mesh.positions
            .iter()
            .filter(is_within)
            .filter(|p| p.y > low && p.y < high)
            .count()
    };
    for seen in [0.0, 0.055] {
        assert!(
            between(seen - 0.005, seen + 0.005) > 3300,
            "at {seen}: {}",
            between(seen - 0.005, seen + 0.005)
        );
    }
    assert_eq!(between(0.006, 0.049), 0);
}

#[test]
fn a_step_in_depth_is_not_bridged() {
    let near = Shape::cuboid(dvec3(-1.0, 1.0, -1.0), dvec3(0.0, 1.1, 1.0));
    let wall = Shape::Plane(dvec3(0.0, 1.6, 0.0), -DVec3::Y);
    let poses = [look(DVec3::ZERO, DVec3::Y), look(dvec3(0.1, 0.0, 0.1), dvec3(0.1, 1.0, 0.0))];
    let mesh = fused(&[near, wall], &poses, lens(200, 160, 160.0), 0.02);
    let between = mesh.positions.iter().filter(|p| p.y > 1.15 && p.y < 1.55).count();
    assert_eq!(between, 0);
    assert!(mesh.positions.iter().any(|p| p.y < 1.05) && mesh.positions.iter().any(|p| p.y > 1.59));
}

#[test]
fn who_walks_through_one_image_of_three_vanishes() {
    let empty = room(2.0);
    let mut visited = empty.clone();
    let person = Shape::cuboid(dvec3(-0.2, 0.6, -2.0), dvec3(0.2, 0.9, -0.2));
    visited.push(person);
    let poses = [-0.4, 0.0, 0.4].map(|x| look(dvec3(x, -1.5, 0.2), dvec3(0.0, 1.0, -0.5)));
    // Whenever the person comes, also first, when nothing is known of the place.
    for when in 0..3 {
        let mut fusion = fusion(0.03);
        for (i, pose) in poses.iter().enumerate() {
            let shapes = if i == when { &visited } else { &empty };
            fusion.add(&picture(shapes, *pose, lens(200, 160, 150.0))).unwrap();
        }
        let mesh = fusion.mesh().unwrap();
        // Whoever comes last may leave feet: images before saw the floor some blocks behind them, where no
        // voxels were. A block is 24 cm here, and the person 1.8 m.
        let left = mesh.positions.iter().filter(|p| distance(&empty, **p) > 0.15);
        let highest = left.map(|p| p.z).fold(f32::NEG_INFINITY, f32::max);
        let allowed = if when == 2 { -0.8 } else { f32::NEG_INFINITY };
        assert!(highest <= allowed, "the person came with image {when}: left up to {highest}");
        // The room behind is there.
        assert!(
            mesh.positions
                .iter()
                .any(|p| (p.y - 2.0).abs() < 0.01 && p.x.abs() < 0.1)
        );
    }
}

#[test]
fn a_room_with_a_tilted_box_is_near_its_surfaces() {
    let turn = s3d_geom::glam::DMat3::from_rotation_z(0.4) * s3d_geom::glam::DMat3::from_rotation_x(0.2);
    let mut shapes = room(2.0);
    shapes.push(Shape::Cuboid(DVec3::ZERO, dvec3(0.4, 0.3, 0.2), turn));
    let mut poses = circle(DVec3::ZERO, 1.3, 0.8, 6);
    poses.extend(circle(DVec3::ZERO, 1.3, -0.8, 6));
    let mesh = fused(&shapes, &poses, lens(200, 200, 160.0), 0.02);
    let [mean, most] = errors(&shapes, &mesh);
    assert!(mean < 0.05 * 0.02 && most < 0.03, "{mean} {most}");
}
