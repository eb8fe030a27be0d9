//! Segments of scenes whose instances are known, and the files of segments.

use s3d_annotate::segments::{MergeTree, SegmentFileOptions, SegmentOptions, segment_faces, segment_file};
use s3d_dataset::{Context, Error};
use s3d_geom::glam::{Vec3, vec3};
use s3d_geom::primitives::{cuboid, grid};
use s3d_geom::{MeshParts, TriMesh};
use s3d_io::cloud::{AnnotationOptions, Annotations};
use s3d_label::Class;
use s3d_synth::{AnnotatedScene, Building, BuildingOptions};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// The area of each instance in each node of a tree, m².
fn shares(scene: &AnnotatedScene, segment_of_face: &[u32], tree: &MergeTree) -> Vec<BTreeMap<u32, f64>> {
    let mut shares = vec![BTreeMap::new(); tree.leaf_count() as usize];
    for (face, segment) in (0u32..).zip(segment_of_face) {
        let instance = scene.instance_of_face[face as usize];
        *shares[*segment as usize].entry(instance).or_default() += scene.mesh.area(face);
    }
    for node in tree.leaf_count()..tree.node_count() {
        let mut sum: BTreeMap<u32, f64> = BTreeMap::new();
        for child in tree.children(node).unwrap() {
            for (instance, area_m2) in &shares[child as usize] {
                *sum.entry(*instance).or_default() += area_m2;
            }
        }
        shares.push(sum);
    }
    shares
}

/// The IoU of each instance with the node that fits it best.
fn best_nodes(scene: &AnnotatedScene, shares: &[BTreeMap<u32, f64>]) -> Vec<f64> {
    let mut size_m2 = vec![0.0; scene.instances.len()];
    for (face, instance) in (0u32..).zip(&scene.instance_of_face) {
        size_m2[*instance as usize] += scene.mesh.area(face);
    }
    let mut best = vec![0f64; size_m2.len()];
    for node in shares {
        let whole: f64 = node.values().sum();
        for (instance, both) in node {
            let iou = both / (whole + size_m2[*instance as usize] - both);
            best[*instance as usize] = best[*instance as usize].max(iou);
        }
    }
    best
}

#[test]
fn segments_are_pure_and_the_tree_has_the_instances_of_a_house_of_two_storeys() {
    let options = BuildingOptions { storeys: 2, texture_scale: 0.1, ..BuildingOptions::drawn(4, 42) };
    for building in
        [Building { texture_scale: 0.1, ..Building::demo() }, Building::generate(&options).unwrap()]
    {
        let scene = building.build().unwrap();
        let found = segment_faces(&scene.mesh, &SegmentOptions::default());
        let shares = shares(&scene, &found.segment_of_face, &found.tree);

        let segments = &shares[..found.tree.leaf_count() as usize];
        let largest = |node: &BTreeMap<u32, f64>| node.values().fold(0f64, |a, b| a.max(*b));
        let purity = segments.iter().map(largest).sum::<f64>() / scene.mesh.total_area();
        assert!(purity > 0.99, "{}: {purity}", scene.title);

        let best = best_nodes(&scene, &shares);
        let mean = best.iter().sum::<f64>() / best.len() as f64;
        let found = best.iter().filter(|iou| **iou > 0.5).count();
        assert!(mean > 0.95 && found == best.len(), "{}: mean IoU {mean}, {found}", scene.title);
    }
}

#[test]
fn segments_do_not_depend_on_threads() {
    let scene = Building { texture_scale: 0.1, ..Building::demo() }.build().unwrap();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| segment_faces(&scene.mesh, &SegmentOptions::default()))
    };
    assert_eq!(on(1), on(7));
}

/// A floor of 4 × 4 m in faces of 10 cm, a red rug in its middle, and a box on the floor, turned inside out
/// if asked for.
fn room(is_turned: bool) -> TriMesh {
    let mut parts = grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0, [40, 40]);
    // Colours belong to vertices: the rug has its own.
    let is_rug = |p: Vec3| p.x > 0.99 && p.x < 2.01 && p.y > 0.99 && p.y < 2.01;
    let mut colors = Vec::new();
    let mut positions = Vec::new();
    for face in &mut parts.faces {
        let corners = face.map(|vertex| parts.positions[vertex as usize]);
        let color = if is_rug(corners.iter().sum::<Vec3>() / 3.0) {
            [160, 20, 20]
        } else {
            [120; 3]
        };
        *face = [0, 1, 2].map(|corner| positions.len() as u32 + corner);
        positions.extend(corners);
        colors.extend([color; 3]);
    }
    let mut bodies =
        MeshParts { positions, faces: parts.faces.clone(), colors: colors.clone(), ..MeshParts::default() };

    let mut chest = cuboid(vec3(3.0, 3.0, 0.0), vec3(3.5, 3.5, 0.5));
    chest.colors = vec![[90, 60, 30]; chest.positions.len()];
    if is_turned {
        chest.faces.iter_mut().step_by(2).for_each(|face| face.swap(1, 2));
    }
    bodies.append(chest);
    TriMesh::new(bodies).unwrap()
}

#[test]
fn a_rug_differs_by_its_color_and_a_box_by_its_shape() {
    for is_turned in [false, true] {
        let mesh = room(is_turned);
        let found = segment_faces(&mesh, &SegmentOptions::default());
        // The floor, the rug, and the six sides of the box: windings of any direction are one surface.
        assert_eq!(found.tree.leaf_count(), 8);
        let shape_alone = SegmentOptions { color: 0.0, ..SegmentOptions::default() };
        assert_eq!(segment_faces(&mesh, &shape_alone).tree.leaf_count(), 7);

        // The box is one node, before it joins the floor.
        let sides: Vec<u32> = (2..8).collect();
        let of = |node: u32| {
            let mut segments = found.tree.segments_of(node).to_vec();
            segments.sort_unstable();
            segments
        };
        assert!((0..found.tree.node_count()).any(|node| of(node) == sides));
    }
}

#[test]
fn a_tree_names_the_same_segments_in_each_of_its_forms() {
    let tree = segment_faces(&room(false), &SegmentOptions::default()).tree;
    for node in tree.leaf_count()..tree.node_count() {
        let [a, b] = tree.children(node).unwrap();
        let parts = [tree.segments_of(a), tree.segments_of(b)].concat();
        assert_eq!(tree.segments_of(node), parts);
        assert_eq!((tree.parent(a), tree.parent(b)), (Some(node), Some(node)));
        assert!(tree.cost(node) >= tree.cost(a).max(tree.cost(b)));
    }

    assert_eq!(tree.nodes_at(0.0), (0..tree.leaf_count()).collect::<Vec<_>>());
    let root = tree.node_count() - 1;
    assert!(tree.nodes_at(f32::INFINITY).iter().all(|node| *node == root));
    let [a, b] = tree.children(root).unwrap();
    let just_below = tree.nodes_at(tree.cost(root).next_down());
    assert!(just_below.iter().all(|node| *node == a || *node == b));
}

fn write(path: &Path, text: &str) {
    std::fs::write(path, text).unwrap();
}

fn run(mesh: &Path, output: &Path) -> Result<Vec<i64>, Error> {
    segment_file(mesh, output, &SegmentFileOptions::default(), &Context::default())?;
    let document: Value = serde_json::from_slice(&std::fs::read(output).unwrap()).unwrap();
    Ok(serde_json::from_value(document["segIndices"].clone()).unwrap())
}

#[test]
fn faces_are_numbered_as_in_their_file() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("scan.obj");
    // A floor of one polygon, a face without an area, a wall, and a vertex that no face uses.
    write(
        &mesh,
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 9 9 9\n\
         f 1 2 3 4\nf 1 1 2\nf 1 6 2\nf 1 5 6\n",
    );
    assert_eq!(run(&mesh, &folder.path().join("scan.fsegs.json")).unwrap(), [0, -1, 1, 1]);
    // Vertices at the edge go with the larger of two equal surfaces, the first.
    assert_eq!(run(&mesh, &folder.path().join("scan.segs.json")).unwrap(), [0, 0, 0, 0, 1, 1, 2]);

    let fault = run(&mesh, &folder.path().join("scan.json")).unwrap_err();
    assert!(matches!(fault, Error::Usage(_)) && fault.to_string().contains("fsegs.json"), "{fault}");
    let fault = run(&mesh, &folder.path().join("scan.segs.json")).unwrap_err();
    assert!(matches!(fault, Error::Usage(_)), "an existing file stays: {fault}");
    let fault = run(&mesh, &folder.path().join("gone/scan.segs.json")).unwrap_err();
    assert!(matches!(fault, Error::File(_)), "{fault}");
}

#[test]
fn a_scan_of_scannet_is_read_with_our_segments() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mesh = room(false);
    let corners = mesh.positions().iter().zip(&mesh.parts().colors);
    let corners = corners.map(|(p, [r, g, b])| format!("{} {} {} {r} {g} {b}\n", p.x, p.y, p.z));
    let faces = mesh.faces().iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n"));
    let header = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.positions().len(),
        mesh.faces().len()
    );
    let ply = path("scene0000_00_vh_clean_2.ply");
    write(&ply, &(header + &corners.collect::<String>() + &faces.collect::<String>()));

    run(&ply, &path("scene0000_00_vh_clean_2.0.010000.segs.json")).unwrap();
    write(
        &path("scene0000_00.aggregation.json"),
        r#"{"sceneId": "scannet.scene0000_00",
            "segmentsFile": "scannet.scene0000_00_vh_clean_2.0.010000.segs.json",
            "segGroups": [{"id": 0, "objectId": 0, "segments": [0, 1], "label": "floor"},
                          {"id": 1, "objectId": 1, "segments": [2, 3, 4, 5, 6, 7], "label": "table"}]}"#,
    );
    let options =
        AnnotationOptions { room: Some("office_1".parse().unwrap()), ..AnnotationOptions::default() };
    let annotations = Annotations::open(&[folder.path().to_owned()], &options).unwrap();
    let classes: Vec<Class> = annotations.rooms[0]
        .instances
        .iter()
        .map(|instance| instance.class)
        .collect();
    assert_eq!(classes, [Class::FLOOR, Class::TABLE]);
}
