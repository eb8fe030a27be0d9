//! A scene that is made in memory.

use s3d_dataset::ExportOptions;
use s3d_dataset::export::MemoryScene;
use s3d_geom::glam::{Vec3, dvec3, vec3};
use s3d_geom::{PointCloud, Pose, TriMesh};
use s3d_io::camera::ScanLocation;
use s3d_io::cloud::{AnnotatedPoints, Annotations};
use s3d_label::Class;

/// An export that takes little time.
pub(crate) fn options(seed: u64) -> ExportOptions {
    ExportOptions {
        seed,
        views: 4,
        size: 96,
        pano_width: 192,
        points_per_m2: 40.0,
        ..ExportOptions::default()
    }
}

/// A room of 4 × 3 × 2.5 m with coloured corners, its points by wall, and one location in it.
pub(crate) fn memory_scene() -> MemoryScene {
    scene_of(|p| p, |p| p)
}

/// The same, its mesh and its points moved.
pub(crate) fn scene_of(mesh_at: impl Fn(Vec3) -> Vec3, points_at: impl Fn(Vec3) -> Vec3) -> MemoryScene {
    let corner = |i: u32| vec3((i & 1) as f32 * 4.0, (i >> 1 & 1) as f32 * 3.0, (i >> 2) as f32 * 2.5);
    let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let positions = (0..8).map(|i| mesh_at(corner(i))).collect::<Vec<Vec3>>();
    let mut parts = TriMesh::from_faces(positions, faces).unwrap().into_parts();
    parts.colors = (0..8).map(|i| [30 * i, 200, 100]).collect();
    let mesh = TriMesh::new(parts).unwrap();
    let classes = [Class::FLOOR, Class::CEILING, Class::WALL, Class::WALL, Class::WALL, Class::WALL];
    let instances = classes.iter().enumerate().map(|(i, &class)| {
        let [a, b, _, d] = quads[i].map(corner);
        let at = |u: u32, v: u32| points_at(a + (b - a) * (u as f32 / 20.0) + (d - a) * (v as f32 / 20.0));
        let positions = (0..=20)
            .flat_map(|u| (0..=20).map(move |v| (u, v)))
            .map(|(u, v)| at(u, v))
            .collect();
        let points = PointCloud { positions, ..PointCloud::default() };
        let number = if class == Class::WALL { i as u32 - 1 } else { 1 };
        AnnotatedPoints { room: "office_1".parse().unwrap(), class, number, points }
    });
    let annotations = Annotations::from_points(instances).unwrap();
    let pose = Pose::level(dvec3(2.0, 1.5, 1.4), 0.3);
    let locations = vec![ScanLocation { uuid: "a".repeat(32), pose, line: 0 }];
    MemoryScene { area: 2, mesh, annotations: Some(annotations), locations }
}
