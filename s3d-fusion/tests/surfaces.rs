//! Meshes of analytic scenes lie on their surfaces.

use crate::common::{Shape, circle, errors, fused, lens, look};
use s3d_geom::glam::{DMat3, DVec3, dvec3};

const CELL_M: f64 = 0.02;

#[test]
fn planes_at_any_angle_are_exact() {
    for (tilt, turn) in [(0.0, 0.0), (0.3, 0.4), (0.7, -0.9), (1.2, 0.1), (-1.3, 0.2)] {
        let normal = DMat3::from_rotation_z(turn) * DMat3::from_rotation_x(tilt) * -DVec3::Y;
        let plane = Shape::Plane(dvec3(0.1, 2.0, 0.2), normal);
        let mesh = fused(&[plane], &[look(DVec3::ZERO, DVec3::Y)], lens(160, 120, 140.0), CELL_M);
        let [mean, most] = errors(&[plane], &mesh);
        assert!(mean < 0.01 * CELL_M && most < 0.05 * CELL_M, "{tilt} {turn}: {mean} {most}");
    }
}

#[test]
fn a_sphere_from_all_around_is_closed() {
    let shapes = [Shape::Sphere(dvec3(0.3, 0.0, 0.1), 0.35)];
    let mut poses = circle(DVec3::ZERO, 1.3, 0.8, 6);
    poses.extend(circle(DVec3::ZERO, 1.3, -0.8, 6));
    let mesh = fused(&shapes, &poses, lens(200, 200, 200.0), CELL_M);
    let [mean, most] = errors(&shapes, &mesh);
    assert!(mean < 0.05 * CELL_M && most < 0.5 * CELL_M, "{mean} {most}");
    assert_eq!(open_edges(&mesh.faces), 0);
}

/// The number of edges that do not have two faces in opposite directions.
fn open_edges(faces: &[[u32; 3]]) -> usize {
    let mut edges = std::collections::BTreeMap::new();
    for f in faces {
        for k in 0..3 {
            *edges.entry((f[k], f[(k + 1) % 3])).or_insert(0) += 1;
        }
    }
    edges
        .iter()
        .filter(|&(&(a, b), &n)| n != 1 || edges.get(&(b, a)) != Some(&1))
        .count()
}
