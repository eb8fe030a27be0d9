//! Files that label the faces of a mesh, as data sets have them: each labels the same small room, whose right
//! answer is known. The room comes in the faces of the file of labels, or in others.

use s3d_geom::glam::{Vec3, vec3};
use s3d_geom::{PointCloud, Raster, TriMesh};
use s3d_io::Result;
use s3d_io::cloud::{AnnotatedMesh, AnnotationOptions, Annotations, NpyWriter};
use s3d_io::image::{Compression, Content, encode_rgb8};
use s3d_io::mesh::{MeshFile, UpAxis, read_mesh};
use s3d_io::scene::read_scene;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// The objects of the room, from 1: the words of annotators.
const OBJECTS: [&str; 9] =
    ["floor", "ceiling", "wall", "wall", "wall", "wall", "table", "office chair", "office chair"];

/// A square of the room: its corners, and its object, from 1.
type Square = ([Vec3; 4], usize);

/// A room of 4 × 3 × 2.6 m with a table and two chairs, Z-up, in squares of about half a metre.
fn squares() -> Vec<Square> {
    let mut all = Vec::new();
    let size = vec3(4.0, 3.0, 2.6);
    let side = |all: &mut Vec<Square>, object: usize, corner: Vec3, u: Vec3, v: Vec3| {
        let rows = [u, v].map(|edge| (edge.length() / 0.5).ceil() as u32);
        for i in 0..rows[0] {
            for j in 0..rows[1] {
                let at =
                    |i: u32, j: u32| corner + u * i as f32 / rows[0] as f32 + v * j as f32 / rows[1] as f32;
                all.push(([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], object));
            }
        }
    };

    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    side(&mut all, 1, Vec3::ZERO, x, y);
    side(&mut all, 2, z, y, x);
    side(&mut all, 3, Vec3::ZERO, z, x);
    side(&mut all, 4, y, x, z);
    side(&mut all, 5, Vec3::ZERO, y, z);
    side(&mut all, 6, x, z, y);
    for (object, corner, size) in [
        (7, vec3(1.5, 1.2, 0.7), vec3(1.0, 0.6, 0.05)),
        (8, vec3(0.6, 0.6, 0.4), vec3(0.4, 0.4, 0.05)),
        (9, vec3(3.0, 0.6, 0.4), vec3(0.4, 0.4, 0.05)),
    ] {
        let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
        side(&mut all, object, corner + z, x, y);
        side(&mut all, object, corner, y, x);
        side(&mut all, object, corner, z, x);
        side(&mut all, object, corner + y, x, z);
        side(&mut all, object, corner, y, z);
        side(&mut all, object, corner + x, z, y);
    }
    all
}

/// Writes a PLY file of the squares. `vertex` and `face` are a head and a row of further properties.
fn ply(path: &Path, vertex: (&str, &dyn Fn(usize) -> String), face: (&str, &dyn Fn(usize) -> String)) {
    let squares = squares();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}\
         element face {}\nproperty list uchar int vertex_indices\n{}end_header\n",
        4 * squares.len(),
        vertex.0,
        squares.len(),
        face.0
    );
    for (corners, object) in &squares {
        for p in corners {
            let _ = writeln!(text, "{} {} {} {}", p.x, p.y, p.z, vertex.1(*object));
        }
    }
    for (i, (_, object)) in squares.iter().enumerate() {
        let first = 4 * i;
        let _ = writeln!(text, "4 {first} {} {} {} {}", first + 1, first + 2, first + 3, face.1(*object));
    }
    fs::write(path, text).unwrap();
}

fn nothing(_: usize) -> String {
    String::new()
}

/// Writes the room as an OBJ file. In `other` faces, its squares are cut along the other diagonal and halved.
fn obj(path: &Path, other: bool) {
    let mut text = String::new();
    let mut faces = String::new();
    let mut count = 0;
    for ([a, b, c, d], _) in squares() {
        let middle = (a + c) * 0.5;
        let polygons = if other {
            vec![vec![a, b, middle], vec![b, c, middle], vec![c, d, middle], vec![d, a, middle]]
        } else {
            vec![vec![a, b, c, d]]
        };
        for polygon in polygons {
            faces.push('f');
            for p in polygon {
                count += 1;
                let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
                let _ = write!(faces, " {count}");
            }
            faces.push('\n');
        }
    }
    fs::write(path, text + &faces).unwrap();
}

fn options() -> AnnotationOptions {
    AnnotationOptions { room: "office_1".parse().ok(), ..AnnotationOptions::default() }
}

/// Opens annotations for a mesh file, Z-up.
fn open(mesh: &MeshFile, path: &Path, options: &AnnotationOptions) -> Result<Annotations> {
    let mesh = AnnotatedMesh { file: mesh, up: UpAxis::Z, units: None, outside_files: false };
    Annotations::open_for(&mesh, &[path.to_owned()], options)
}

/// Returns the instances by name with the number of their faces, of which no two share one.
fn faces_of(annotations: &Annotations) -> BTreeMap<String, usize> {
    let mut taken = BTreeSet::new();
    let mut found = BTreeMap::new();
    for room in &annotations.rooms {
        for instance in &room.instances {
            let mut cloud = PointCloud::default();
            instance.read(&mut cloud).unwrap();
            let faces: BTreeSet<u32> = cloud.faces.iter().copied().collect();
            assert!(!faces.is_empty(), "the points know no face");
            let name = format!("{}_{} of {}", instance.class, instance.number, room.room);
            found.insert(name, faces.len());
            for face in faces {
                assert!(taken.insert(face), "two instances have face {face}");
            }
        }
    }
    found
}

/// Checks the room: every face has its label.
fn check(annotations: &Annotations, mesh: &TriMesh, room: &str) {
    let found = faces_of(annotations);
    let names =
        ["ceiling_1", "chair_1", "chair_2", "floor_1", "table_1", "wall_1", "wall_2", "wall_3", "wall_4"];
    let expected: Vec<String> = names.iter().map(|name| format!("{name} of {room}")).collect();
    assert_eq!(found.keys().cloned().collect::<Vec<_>>(), expected);
    assert_eq!(found.values().sum::<usize>(), mesh.faces().len());
    assert_eq!(annotations.warnings, Vec::<String>::new());
    let floor = found[&format!("floor_1 of {room}")];
    assert_eq!(found[&format!("ceiling_1 of {room}")], floor);
}

/// Writes labels into a folder, and checks them for the faces of their own file, and for others.
fn labels_fit(write: impl Fn(&Path), labels: &str, options: &AnnotationOptions) {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path());
    for other in [false, true] {
        let scene = dir.path().join("room.obj");
        obj(&scene, other);
        let mesh = read_mesh(&scene, UpAxis::Z).unwrap();
        let found = open(&mesh, &dir.path().join(labels), options).unwrap();
        check(&found, &mesh.mesh, "office_1");
        // The folder that holds them is enough, if only one file in it can be meant.
        if ![".ply", ".gltf", ".glb"].iter().any(|ending| labels.ends_with(ending)) {
            check(&open(&mesh, dir.path(), options).unwrap(), &mesh.mesh, "office_1");
        }
    }
}

#[test]
fn replica_has_objects_of_faces_and_a_list_of_their_classes() {
    let write = |dir: &Path| {
        let face = ("property int object_id\n", &(|o: usize| o.to_string()) as &dyn Fn(usize) -> String);
        ply(&dir.join("mesh_semantic.ply"), ("", &nothing), face);
        let objects: Vec<String> = (1..)
            .zip(OBJECTS)
            .map(|(id, class)| format!(r#"{{"id": {id}, "class_id": {id}, "class_name": "{class}"}}"#))
            .collect();
        let info = format!(r#"{{"classes": [], "objects": [{}]}}"#, objects.join(", "));
        fs::write(dir.join("info_semantic.json"), info).unwrap();
    };
    labels_fit(write, "info_semantic.json", &options());
    labels_fit(write, "mesh_semantic.ply", &options());
}

#[test]
fn replica_may_have_numbers_of_classes_alone() {
    let write = |dir: &Path| {
        let face = ("property int object_id\n", &(|o: usize| o.to_string()) as &dyn Fn(usize) -> String);
        ply(&dir.join("mesh_semantic.ply"), ("", &nothing), face);
        let info = r#"{"classes": [{"id": 7, "name": "floor"}, {"id": 8, "name": "ceiling"},
            {"id": 9, "name": "wall"}, {"id": 10, "name": "table"}, {"id": 11, "name": "chair"}],
            "id_to_label": [-1, 7, 8, 9, 9, 9, 9, 10, 11, 11]}"#;
        fs::write(dir.join("info_semantic.json"), info).unwrap();
    };
    labels_fit(write, "info_semantic.json", &options());
}

fn groups(segments_of: impl Fn(usize) -> String) -> String {
    let groups: Vec<String> = (1..)
        .zip(OBJECTS)
        .map(|(id, label)| {
            let segments = segments_of(id);
            format!(r#"{{"id": {id}, "objectId": {id}, "label": "{label}", "segments": [{segments}]}}"#)
        })
        .collect();
    format!(r#"{{"segGroups": [{}]}}"#, groups.join(", "))
}

#[test]
fn objects_of_3rscan_are_numbers_of_vertices() {
    let write = |dir: &Path| {
        let vertex = (
            "property ushort objectId\nproperty ushort globalId\n",
            &(|o: usize| format!("{o} {}", 100 + o)) as &dyn Fn(usize) -> String,
        );
        ply(&dir.join("labels.instances.annotated.v2.ply"), vertex, ("", &nothing));
        fs::write(dir.join("semseg.v2.json"), groups(|id| id.to_string())).unwrap();
    };
    labels_fit(write, "semseg.v2.json", &options());
    labels_fit(write, "labels.instances.annotated.v2.ply", &options());

    // A column that is named is meant.
    let mut by_number = AnnotationOptions { class_column: Some("globalId".into()), ..options() };
    for (class, word) in (101..).zip(OBJECTS) {
        let class_of = word.rsplit(' ').next().and_then(|word| word.parse().ok());
        by_number.classes.insert(class.to_string(), class_of);
    }
    labels_fit(write, "labels.instances.annotated.v2.ply", &by_number);
}

#[test]
fn in_scannetpp_a_vertex_in_several_groups_belongs_to_the_smallest() {
    let write = |dir: &Path| {
        ply(&dir.join("mesh_aligned_0.05.ply"), ("", &nothing), ("", &nothing));
        let segments: Vec<String> = squares().iter().flat_map(|(_, o)| vec![o.to_string(); 4]).collect();
        let segments = format!(r#"{{"segIndices": [{}]}}"#, segments.join(", "));
        fs::write(dir.join("segments.json"), segments).unwrap();
        // The table's group holds the chairs too, and is the first and the larger one.
        let with_chairs = |id: usize| if id == 7 { "7, 8, 9".to_owned() } else { id.to_string() };
        fs::write(dir.join("segments_anno.json"), groups(with_chairs)).unwrap();
    };
    labels_fit(write, "segments_anno.json", &options());
}

#[test]
fn faces_of_matterport_are_of_the_object_segment_id() {
    let write = |dir: &Path| {
        let row = |o: usize| {
            let class = ["", "2", "17", "1", "1", "1", "1", "5", "3", "3"][o];
            format!("{} {o} {class}", o / 3)
        };
        let face =
            ("property int material_id\nproperty int segment_id\nproperty int category_id\n", &row as _);
        ply(&dir.join("region.ply"), ("", &nothing), face);
    };
    let mut numbers = options();
    for (number, class) in [("1", "wall"), ("2", "floor"), ("3", "chair"), ("5", "table"), ("17", "ceiling")]
    {
        numbers.classes.insert(number.into(), class.parse().ok());
    }
    labels_fit(write, "region.ply", &numbers);
}

/// A glTF file of the room: a mesh an object, and the nodes. With colours, a texture has a pixel for each
/// object.
fn gltf(nodes: &[String], colors: Option<&[[u8; 3]; 9]>) -> String {
    let mut bytes = Vec::new();
    let mut views = Vec::new();
    let mut accessors = Vec::new();
    let mut column = |values: &[Vec<f32>]| {
        let data: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        views.push(format!(
            r#"{{"buffer": 0, "byteOffset": {}, "byteLength": {}}}"#,
            bytes.len(),
            data.len()
        ));
        bytes.extend(data);
        accessors.push(format!(
            r#"{{"bufferView": {}, "componentType": 5126, "type": "VEC{}", "count": {}}}"#,
            views.len() - 1,
            values[0].len(),
            values.len()
        ));
        accessors.len() - 1
    };

    let mut meshes = Vec::new();
    for (id, _) in (1..).zip(OBJECTS) {
        let squares = squares().into_iter().filter(|(_, object)| *object == id);
        let corners = squares.flat_map(|([a, b, c, d], _)| [a, b, c, a, c, d]);
        // The file is Y-up.
        let positions: Vec<Vec<f32>> = corners.map(|p| vec![p.x, p.z, -p.y]).collect();
        let position = column(&positions);
        let looks = colors.map_or_else(String::new, |_| {
            let uvs = vec![vec![(id as f32 - 0.5) / 9.0, 0.5]; positions.len()];
            format!(r#", "TEXCOORD_0": {}}}, "material": 0"#, column(&uvs))
        });
        let end = if colors.is_some() { "" } else { "}" };
        meshes.push(format!(r#"{{"primitives": [{{"attributes": {{"POSITION": {position}{looks}{end}}}]}}"#));
    }

    let looks = colors.map_or_else(String::new, |colors| {
        let image = Raster::from_vec(9, 1, colors.to_vec());
        let png = base64(&encode_rgb8(&image, Content::Photo, Compression::default()));
        format!(
            r#""images": [{{"uri": "data:image/png;base64,{png}"}}], "textures": [{{"source": 0}}],
            "materials": [{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0}}}}}}],"#
        )
    });
    format!(
        r#"{{"asset": {{"version": "2.0"}},
        "buffers": [{{"byteLength": {}, "uri": "data:;base64,{}"}}], {looks}
        "bufferViews": [{}], "accessors": [{}], "meshes": [{}], "nodes": [{}]}}"#,
        bytes.len(),
        base64(&bytes),
        views.join(","),
        accessors.join(","),
        meshes.join(","),
        nodes.join(",")
    )
}

#[test]
fn colours_of_hm3d_are_objects_and_regions_are_rooms() {
    let colors: [[u8; 3]; 9] = std::array::from_fn(|i| [i as u8 * 25, 10, 200 - i as u8]);
    let nodes: Vec<String> = (0..9).map(|mesh| format!(r#"{{"mesh": {mesh}}}"#)).collect();
    let write = |dir: &Path| {
        fs::write(dir.join("00800-a.semantic.glb"), gltf(&nodes, Some(&colors))).unwrap();
        let mut list = "HM3D Semantic Annotations\n".to_owned();
        for (id, (word, [r, g, b])) in (1..).zip(OBJECTS.iter().zip(colors)) {
            let _ = writeln!(list, "{id},{r:02X}{g:02X}{b:02X},\"{word}\",0");
        }
        fs::write(dir.join("00800-a.semantic.txt"), list).unwrap();
    };
    labels_fit(write, "00800-a.semantic.txt", &options());
    labels_fit(write, "00800-a.semantic.glb", &options());
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |chunk: &[u8]| {
        let bits = chunk
            .iter()
            .chain(&[0; 2])
            .take(3)
            .fold(0, |bits, b| bits << 8 | u32::from(*b));
        let all = [18, 12, 6, 0].map(|shift| char::from(DIGITS[(bits >> shift & 63) as usize]));
        all.into_iter()
            .take(chunk.len() + 1)
            .chain("==".chars())
            .take(4)
            .collect::<String>()
    };
    bytes.chunks(3).map(digits).collect()
}

#[test]
fn nodes_of_gltf_name_objects_in_several_ways() {
    let ways: [fn(usize, &str) -> String; 4] = [
        |id, word| format!(r#""name": "{word}|{id}""#),
        |id, word| format!(r#""name": "n{id}", "extras": {{"Category": "{word}", "id": "{id}"}}"#),
        |_, word| format!(r#""extras": {{"class": "{word}"}}"#),
        |id, word| format!(r#""name": "{}.00{id}""#, word.replace(' ', "_").to_uppercase()),
    ];
    for way in ways {
        let node = |(id, word)| format!(r#"{{"mesh": {}, {}}}"#, id - 1, way(id, word));
        let nodes: Vec<String> = (1..).zip(OBJECTS).map(node).collect();
        let write = |dir: &Path| fs::write(dir.join("house.gltf"), gltf(&nodes, None)).unwrap();
        labels_fit(write, "house.gltf", &options());
    }
}

#[test]
fn a_node_belongs_to_the_object_above_it() {
    let mut nodes: Vec<String> = (0..9)
        .map(|mesh| format!(r#"{{"mesh": {mesh}, "name": "Cube.{mesh}"}}"#))
        .collect();
    for (id, word) in OBJECTS.iter().enumerate() {
        nodes.push(format!(r#"{{"name": "{word}|{id}", "children": [{id}]}}"#));
    }
    let write = |dir: &Path| fs::write(dir.join("house.gltf"), gltf(&nodes, None)).unwrap();
    labels_fit(write, "house.gltf", &options());
}

#[test]
fn numbers_are_of_vertices_or_of_faces_of_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let scene = dir.path().join("room.obj");
    obj(&scene, false);
    // The file has a face without area in front, which is left out.
    let text = fs::read_to_string(&scene).unwrap().replacen("\nf ", "\nf 1 1 2\nf ", 1);
    fs::write(&scene, text).unwrap();
    let mesh = read_mesh(&scene, UpAxis::Z).unwrap();
    assert_eq!(mesh.source_faces[..3], [1, 1, 2]);

    let mut classes = options();
    for (number, word) in (0..).zip(["floor", "ceiling", "wall", "table", "chair"]) {
        classes.classes.insert(number.to_string(), word.parse().ok());
    }
    let number = |object: usize| [0, 0, 1, 2, 2, 2, 2, 3, 4, 4][object];
    let of_faces: Vec<i64> = std::iter::once(3)
        .chain(squares().iter().map(|(_, o)| number(*o)))
        .collect();
    let of_vertices: Vec<i64> = squares().iter().flat_map(|(_, o)| [number(*o); 4]).collect();

    for numbers in [of_faces, of_vertices] {
        let lines = |ending: &str| numbers.iter().map(|n| format!("{n}{ending}\n")).collect::<String>();
        let npy = dir.path().join("labels.npy");
        let mut writer = NpyWriter::create(&npy, "<i8", &[numbers.len() as u64]).unwrap();
        writer
            .put(&numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>())
            .unwrap();
        writer.finish().unwrap();
        for (name, text) in
            [("labels.txt", lines("")), ("floats.txt", lines(".000000")), ("labels.npy", String::new())]
        {
            let path = dir.path().join(name);
            if !text.is_empty() {
                fs::write(&path, text).unwrap();
            }
            let found = faces_of(&open(&mesh, &path, &classes).unwrap());
            let names: Vec<&str> = found.keys().map(String::as_str).collect();
            let expected = ["ceiling_1", "chair_1", "floor_1", "table_1", "wall_1"];
            assert_eq!(names, expected.map(|name| format!("{name} of office_1")), "{name}");
            assert_eq!(found.values().sum::<usize>(), mesh.mesh.faces().len(), "{name}");
        }
    }

    let path = dir.path().join("short.txt");
    fs::write(&path, "0\n1\n2\n").unwrap();
    let message = open(&mesh, &path, &classes).unwrap_err().to_string();
    assert!(message.contains("short.txt: has 3 numbers, the mesh's file has"), "{message}");
    fs::write(&path, "0\n1\nchair\n").unwrap();
    let message = open(&mesh, &path, &classes).unwrap_err().to_string();
    assert!(message.contains("short.txt, line 3: `chair` is no class"), "{message}");
}

#[test]
fn lists_that_do_not_fit_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let scene = dir.path().join("room.obj");
    obj(&scene, false);
    let mesh = read_mesh(&scene, UpAxis::Z).unwrap();
    for (name, text, words) in [
        ("info_semantic.json", r#"{"id_to_label": [0], "classes": []}"#, "mesh_semantic.ply"),
        ("segments_anno.json", r#"{"segGroups": []}"#, "segments.json, as in ScanNet++"),
        ("a.semantic.txt", "HM3D Semantic Annotations\n1,39EB3C,\"floor\",0\n", "a.semantic.glb"),
    ] {
        let path = dir.path().join(name);
        fs::write(&path, text).unwrap();
        let message = open(&mesh, &path, &options()).unwrap_err().to_string();
        assert!(message.contains(name) && message.contains(words), "{message}");
    }

    let segments = dir.path().join("segments_anno.json");
    fs::write(dir.path().join("segments.json"), r#"{"segIndices": [1, 2]}"#).unwrap();
    ply(&dir.path().join("mesh_aligned_0.05.ply"), ("", &nothing), ("", &nothing));
    let message = open(&mesh, &segments, &options()).unwrap_err().to_string();
    assert!(message.contains("segments.json: has segments for 2 vertices"), "{message}");
}

/// Scans as people have them, each with a scene file.
#[test]
#[allow(clippy::print_stderr, reason = "a skipped test says so")]
fn rooms_from_the_field_have_every_label() {
    let field = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/hard-inputs/field");
    if !field.is_dir() {
        eprintln!("skipped: {} is not there", field.display());
        return;
    }
    for name in ["01-matterport-region", "02-replica", "04-3rscan", "05-hm3d", "22-gltf-node-names"] {
        let scene = read_scene(&field.join(name).join("scene.toml")).unwrap();
        let file = read_mesh(&scene.mesh[0], scene.up).unwrap();
        let found = if scene.annotations.is_empty() {
            Annotations::of_mesh(&file, &scene.annotation_options)
        } else {
            let mesh = AnnotatedMesh { file: &file, up: scene.up, units: None, outside_files: false };
            Annotations::open_for(&mesh, &scene.annotations, &scene.annotation_options)
        };
        check(&found.unwrap(), &file.mesh, "office_1");
    }
}
