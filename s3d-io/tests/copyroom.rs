//! Tests the readers on a real scan, if it is there.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use s3d_geom::glam::{DVec3, Vec3};
use s3d_geom::{FaceColor, PointCloud};
use s3d_io::camera::read_scan_locations;
use s3d_io::cloud::{AnnotationTree, read_points};
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_io::scene::{CameraSource, read_scene};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn scan() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scans/copyroom/scene.toml");
    if path.is_file() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

#[test]
fn the_parts_of_the_scan_fit_together() {
    let Some(path) = scan() else { return };
    let scene = read_scene(&path).unwrap();
    assert_eq!((scene.area, scene.up), (1, UpAxis::Y));

    let file = read_mesh(&scene.mesh[0], scene.up).unwrap();
    let mesh = &file.mesh;
    assert_eq!(mesh.positions().len(), 16_616);
    // 391 faces repeat earlier ones, most of them turned over.
    assert_eq!(mesh.faces().len() + mesh.report().zero_area_faces + 391, 30_947);
    assert_eq!(file.warnings.len(), 2, "{:?}", file.warnings);
    assert_eq!((mesh.materials().len(), mesh.textures().len()), (1, 1));
    assert_eq!((mesh.textures()[0].image.width(), mesh.textures()[0].image.height()), (1024, 1024));
    assert!((0..mesh.faces().len() as u32).all(|f| matches!(mesh.color_of(f), FaceColor::Texture(0, ..))));
    let texture = file.texture_files[0].as_ref().unwrap();
    assert_eq!(texture.bytes, std::fs::read(scene.mesh[0].with_file_name("copyroom_0.jpg")).unwrap());
    assert_eq!(file.polygons_triangulated, 0);

    let Some(CameraSource::Listed { path, world_from_file }) = &scene.cameras else {
        panic!("{:?}", scene.cameras)
    };
    let locations = read_scan_locations(path, world_from_file).unwrap();
    assert_eq!(locations.len(), 3);
    let room = mesh.aabb();
    assert!(room.contains(locations[0].pose.location.as_vec3()), "{room:?}");

    let tree = AnnotationTree::open(&scene.annotations[0]).unwrap();
    assert!(tree.warnings.is_empty(), "{:?}", tree.warnings);
    assert_eq!(tree.rooms.len(), 1);
    assert_eq!(tree.rooms[0].room.to_string(), "copyRoom_1");
    let mut all = PointCloud::default();
    let mut instances = PointCloud::default();
    read_points(&tree.rooms[0].path.join("copyRoom_1.txt"), &mut all).unwrap();
    for instance in &tree.rooms[0].instances {
        read_points(&instance.path, &mut instances).unwrap();
    }
    assert_eq!((all.len(), instances.len()), (147_961, 147_961));
    // The points lie on the mesh, up to their noise.
    assert!(
        all.positions
            .iter()
            .all(|p| p.cmpgt(room.min - 0.02).all() && p.cmplt(room.max + 0.02).all())
    );
}

/// tobj alone, which cuts the mesh into 1,163 models, reads the same triangles in the same order, except for
/// those that are left out here.
#[test]
fn the_mesh_is_what_tobj_reads() {
    let Some(path) = scan() else { return };
    let scene = read_scene(&path).unwrap();
    let mesh = read_mesh(&scene.mesh[0], UpAxis::Z).unwrap().mesh;
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    let (models, _) = tobj::load_obj(&scene.mesh[0], &options).unwrap();

    let corner = |m: &tobj::Mesh, i: usize| {
        let v = m.indices[i] as usize * 3;
        let t = m.texcoord_indices[i] as usize * 2;
        ([m.positions[v], m.positions[v + 1], m.positions[v + 2]], [m.texcoords[t], m.texcoords[t + 1]])
    };
    let has_area = |t: &&[([f32; 3], [f32; 2])]| {
        let [a, b, c] = [t[0].0, t[1].0, t[2].0].map(|p| Vec3::from_array(p).as_dvec3());
        (b - a).cross(c - a) != DVec3::ZERO
    };

    let all: Vec<_> = models
        .iter()
        .flat_map(|m| (0..m.mesh.indices.len()).map(move |i| corner(&m.mesh, i)))
        .collect();
    let mut seen = BTreeSet::new();
    let is_new = |t: &&[([f32; 3], [f32; 2])]| {
        let mut corners = [t[0].0, t[1].0, t[2].0].map(|p| p.map(f32::to_bits));
        corners.sort_unstable();
        seen.insert(corners)
    };

    let expected: Vec<_> = all
        .chunks(3)
        .filter(has_area)
        .filter(is_new)
        .flatten()
        .copied()
        .collect();

    let parts = mesh.parts();
    let found = parts.faces.iter().flatten().zip(parts.face_uvs.iter().flatten());
    let found: Vec<_> = found
        .map(|(&v, &t)| (parts.positions[v as usize].to_array(), parts.uvs[t as usize].to_array()))
        .collect();
    assert_eq!((all.len() / 3, found.len() / 3), (30_947, 30_947 - 13 - 391));
    assert_eq!(found, expected);
}
