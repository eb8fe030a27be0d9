//! A room whose images are known in closed form, and cameras in it.

use s3d_geom::glam::{DVec3, Vec2, dvec2, vec3};
use s3d_geom::{Camera, MeshParts, Pose};

/// Returns a room of 4 × 4 × 3 m around (0, 0, 1.5). It has two faces a wall; the index of a face / 2 is 0
/// for the floor, 1 for the ceiling, and for the walls 2 at +Y, 3 at −Y, 4 at +X, 5 at −X. The faces are
/// wound to face inwards, and textured with (0, 0) to (1, 1) a wall.
pub(crate) fn room_parts() -> MeshParts {
    let corner = |x: f32, y: f32, z: f32| vec3(2.0 * x, 2.0 * y, 1.5 + 1.5 * z);
    let walls = [
        [corner(-1., -1., -1.), corner(1., -1., -1.), corner(1., 1., -1.), corner(-1., 1., -1.)],
        [corner(-1., 1., 1.), corner(1., 1., 1.), corner(1., -1., 1.), corner(-1., -1., 1.)],
        [corner(-1., 1., -1.), corner(1., 1., -1.), corner(1., 1., 1.), corner(-1., 1., 1.)],
        [corner(1., -1., -1.), corner(-1., -1., -1.), corner(-1., -1., 1.), corner(1., -1., 1.)],
        [corner(1., 1., -1.), corner(1., -1., -1.), corner(1., -1., 1.), corner(1., 1., 1.)],
        [corner(-1., -1., -1.), corner(-1., 1., -1.), corner(-1., 1., 1.), corner(-1., -1., 1.)],
    ];
    let quad = |w: u32| [[4 * w, 4 * w + 1, 4 * w + 2], [4 * w, 4 * w + 2, 4 * w + 3]];
    MeshParts {
        positions: walls.concat(),
        faces: (0..6).flat_map(quad).collect(),
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        face_uvs: (0..6).flat_map(|_| [[0, 1, 2], [0, 2, 3]]).collect(),
        ..MeshParts::default()
    }
}

pub(crate) const EYE: DVec3 = DVec3::new(0.25, -0.5, 1.5);

pub(crate) fn view(yaw: f64, pitch: f64) -> Camera {
    Camera::perspective(Pose::level(EYE, 0.0).turned(yaw, pitch), 90f64.to_radians(), 100, 80)
}

pub(crate) fn all_kinds(location: DVec3) -> Vec<Camera> {
    let pose = Pose::level(location, 0.4);
    vec![
        Camera::perspective(pose.turned(0.3, 0.1), 75f64.to_radians(), 333, 250),
        Camera::perspective(pose.turned(2.0, -0.9), 40f64.to_radians(), 97, 61),
        Camera::perspective(pose.turned(-1.0, 0.3), 170f64.to_radians(), 200, 120),
        Camera::perspective(pose, 1.0, 3, 2),
        Camera::pinhole(pose, dvec2(200.0, 260.0), dvec2(90.0, 201.5), 240, 320).unwrap(),
        Camera::pinhole(pose.turned(1.0, 0.2), dvec2(90.0, 30.0), dvec2(-60.0, 31.0), 97, 61).unwrap(),
        Camera::equirectangular(pose, 500),
        Camera::equirectangular(pose, 38),
    ]
}
