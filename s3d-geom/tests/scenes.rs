//! Meshes as users have them: rooms with textures, and one as untidy as a scan.

use s3d_geom::glam::Vec3;
use s3d_geom::primitives::{cuboid, quad};
use s3d_geom::{
    Density, FaceColor, Material, MeshParts, NO_INDEX, NearestFaces, PointCloud, SurfaceSampler, TriMesh,
    nearest_brute_force,
};
use s3d_synth::scenes::{furnished_room, scan_like};

#[test]
fn parts_keep_their_attributes_when_they_are_merged() {
    let textured = furnished_room(7).into_parts();
    let mut colored = quad([Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y]);
    colored.colors = vec![[1; 3], [2; 3], [3; 3], [4; 3]];
    colored.face_uvs = vec![];
    colored.uvs = vec![];
    colored.normals = vec![Vec3::Z];
    colored.face_normals = vec![[0; 3]; 2];
    colored.face_tags = vec![4; 2];

    let mut plain = cuboid(Vec3::ZERO, Vec3::ONE);
    plain.materials = vec![Material { name: "plain".into(), color: [9; 3], texture: None }];
    plain.face_materials = vec![0; 12];

    let [n, m] = [textured.faces.len() as u32, colored.faces.len() as u32];
    let all = MeshParts::merge([textured.clone(), colored.clone(), plain, textured.clone()]);
    let tag = |f: u32| all.face_tags[f as usize];
    assert_eq!([tag(n - 1), tag(n), tag(n + 1), tag(n + m)], [NO_INDEX, 4, 4, NO_INDEX]);
    let all = TriMesh::new(all).unwrap();
    assert_eq!(all.faces().len() as u32, 2 * n + m + 12);

    let first = TriMesh::new(textured).unwrap();
    for f in 0..n {
        for g in [f, n + m + 12 + f] {
            assert_eq!(all.triangle(g), first.triangle(f));
            match (first.color_of(f), all.color_of(g)) {
                (FaceColor::Texture(_, a, uvs), FaceColor::Texture(_, b, same)) => {
                    assert_eq!((a, uvs), (b, same));
                }
                (FaceColor::Flat(a), FaceColor::Corners(b)) => assert_eq!([a; 3], b),
                other => panic!("{other:?}"),
            }
        }
    }
    assert!(matches!(all.color_of(n + 1), FaceColor::Corners([[1, ..], [3, ..], [4, ..]])));
    assert_eq!(all.corner_normals(n), Some([Vec3::Z; 3]));
    assert_eq!(all.corner_normals(n + m), None);
    assert!(all.material_of(n).is_none() && all.material_of(n + m).is_some());
}

#[test]
fn a_mesh_without_such_faces_is_as_it_was() {
    let mesh = furnished_room(1);
    let before = mesh.faces().to_vec();
    let (mesh, repeated) = mesh.without_repeated_faces();
    assert_eq!((repeated, mesh.faces()), (0, &before[..]));
}

/// Returns points on the faces of a mesh, moved off by up to twice `off` metres. Every 37th is far off, and
/// every 101st is NaN.
fn around(mesh: &TriMesh, points: u64, off: f32) -> Vec<Vec3> {
    let mut cloud = PointCloud::default();
    SurfaceSampler::new(mesh, Density::Total(points), 3).sample(0..points, &mut cloud);
    let moved = cloud
        .positions
        .iter()
        .zip(&cloud.faces)
        .enumerate()
        .map(|(i, (&p, &face))| {
            let p = p + mesh.normal(face) * (off * ((i % 5) as f32 - 2.0));
            match i {
                _ if i % 101 == 100 => Vec3::NAN,
                _ if i % 37 == 36 => p * 3.0 - 5.0,
                _ => p,
            }
        });
    moved.collect()
}

#[test]
fn a_scan_in_any_order() {
    let m = scan_like(2500, 5);
    let faces = NearestFaces::new(&m);
    let mut in_order = Vec::new();
    let mut shuffled = Vec::new();
    for off in [0.0, 0.0025, 0.3] {
        let points = around(&m, 3001, off);
        faces.nearest_many(&points, &mut in_order);
        for (&p, found) in points.iter().zip(&in_order).filter(|(p, _)| p.is_finite()) {
            assert_eq!(*found, nearest_brute_force(&m, p), "at {p}");
        }

        // 1009 is prime and not a divisor, so every point comes once.
        let order: Vec<usize> = (0..points.len()).map(|i| i * 1009 % points.len()).collect();
        let mixed: Vec<Vec3> = order.iter().map(|&i| points[i]).collect();
        faces.nearest_many(&mixed, &mut shuffled);
        for (&i, found) in order.iter().zip(&shuffled) {
            assert_eq!(found.face, in_order[i].face);
            assert_eq!(found.distance_m, in_order[i].distance_m);
        }
    }
}
