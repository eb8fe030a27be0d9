//! Feeds any bytes to every reader of this crate. The fuzz targets (`../fuzz`) use it, and so does the test
//! of their findings.
//!
//! Each entry of [`FEEDS`] writes the bytes to one or several files in a folder of its own, and reads these
//! as an export would. It does not matter whether they can be read. Reading must end, without a panic, in
//! memory that the file's size warrants, and an error must name a file.

mod raw;

use s3d_geom::PointCloud;
use s3d_geom::glam::DAffine3;
use s3d_io::Result;
use s3d_io::camera::*;
use s3d_io::cloud::*;
use s3d_io::dataset::*;
use s3d_io::image::*;
use s3d_io::mesh::*;
use s3d_io::scene::*;
use s3d_label::Class;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Puts bytes into a folder and reads them.
pub(crate) type Feed = fn(&Path, &[u8]);

/// Every reader, by the name of its fuzz target.
pub(crate) const FEEDS: &[(&str, Feed)] = &[
    ("obj", obj),
    ("mtl", mtl),
    ("texture", texture),
    ("gltf", gltf),
    ("ply_mesh", ply_mesh),
    ("ply_cloud", ply_cloud),
    ("s3dis", s3dis),
    ("cameras", cameras),
    ("posed_cameras", posed_cameras),
    ("captures", captures),
    ("json", json),
    ("scene", scene),
    ("taxonomy", taxonomy),
    ("file_list", file_list),
    ("npy", npy),
    ("las", las),
    ("e57", e57),
    ("pcd", pcd),
    ("text_cloud", text_cloud),
    ("kitti", kitti),
    ("scannet", scannet),
    ("label_files", label_files),
    ("saved_labels", saved_labels),
    ("mat", mat),
    ("png", png),
    ("exr", exr),
    ("depth", raw::depth),
    ("raw_scan", raw::raw_scan),
];

/// Two triangles of two objects, with columns of vertices and of faces.
const LABELLED_PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                            property float z\nproperty int objectId\nelement face 2\n\
                            property list uchar int vertex_indices\nproperty int object_id\nend_header\n\
                            0 0 0 1\n1 0 0 1\n0 1 0 2\n1 1 0 2\n3 0 1 2 1\n3 1 3 2 2\n";

/// Two triangles of two segments, as Matterport3D has them.
const MATTERPORT_PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                             property float z\nelement face 2\nproperty list uchar int vertex_indices\n\
                             property int material_id\nproperty int segment_id\nproperty int category_id\n\
                             end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 7 0 4\n3 1 3 2 3 1 28\n";

/// A triangle with a texture, whose library is `m.mtl`.
const OBJ: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl wall\nf 1/1 2/1 3/1\n";

/// Checks that an error names a file in the folder and has a message.
fn check<T>(dir: &Path, result: Result<T>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(e) => {
            assert!(e.path().starts_with(dir), "{e} names no file that was read");
            assert!(!e.to_string().is_empty());
            None
        }
    }
}

fn file(dir: &Path, name: &str, data: &[u8]) -> PathBuf {
    let path = dir.join(name);
    fs::write(&path, data).expect("the folder can be written");
    path
}

/// Checks what a mesh promises: indices in range, finite corners, and columns that are empty or have one
/// entry an element.
fn check_mesh(dir: &Path, result: Result<MeshFile>) -> Option<MeshFile> {
    let file = check(dir, result)?;
    let mesh = &file.mesh;
    for f in 0..mesh.faces().len() as u32 {
        assert!(mesh.triangle(f).iter().all(|p| p.is_finite()));
        if let Some(m) = mesh.material_of(f) {
            let texture = mesh.materials()[m as usize].texture;
            assert!(texture.is_none_or(|t| (t as usize) < file.texture_files.len()));
        }
    }
    let _ = Annotations::of_mesh(&file, &numbered());
    Some(file)
}

/// Options for class numbers, with a room.
fn numbered() -> AnnotationOptions {
    let classes =
        [("2", Some(Class::FLOOR)), ("6", Some(Class::WALL)), ("19", Some(Class::CHAIR)), ("1", None)];
    AnnotationOptions {
        room: Some("office_1".parse().expect("a room")),
        classes: classes
            .into_iter()
            .map(|(key, class)| (key.to_owned(), class))
            .collect(),
        unknown_as_clutter: true,
        ..AnnotationOptions::default()
    }
}

/// Reads annotations twice: strictly, and with every fault skipped and too many points for memory.
fn annotations(dir: &Path, path: &Path) {
    let skip = AnnotationOptions { on_fault: OnFault::Skip, points_in_memory: 16, ..numbered() };
    for options in [numbered(), skip] {
        let options = AnnotationOptions { spool_dir: Some(dir.to_owned()), ..options };
        let Some(found) = check(dir, Annotations::open(&[path.to_owned()], &options)) else { continue };
        for instance in found.rooms.iter().flat_map(|r| &r.instances) {
            let mut cloud = PointCloud::default();
            if check(dir, instance.read(&mut cloud)).is_some() {
                assert_eq!(cloud.positions.len(), cloud.colors.len());
                assert!(cloud.positions.iter().all(|p| p.is_finite()));
            }
        }
    }
}

fn obj(dir: &Path, data: &[u8]) {
    let path = file(dir, "mesh.obj", data);
    for up in [UpAxis::Y, UpAxis::Z] {
        check_mesh(dir, near(&path, up));
    }
}

/// Reads a mesh as scenes do: moved near the origin if it is far from it.
fn near(path: &Path, up: UpAxis) -> Result<MeshFile> {
    read_mesh_with(path, up, &MeshOptions { origin: MeshOrigin::Near, ..MeshOptions::default() })
}

/// A library of materials, and the images that it names.
fn mtl(dir: &Path, data: &[u8]) {
    file(dir, "m.mtl", data);
    check_mesh(dir, read_mesh(&file(dir, "mesh.obj", OBJ.as_bytes()), UpAxis::Z));
}

/// An image of a material.
fn texture(dir: &Path, data: &[u8]) {
    let image = file(dir, "wall.png", data);
    file(dir, "m.mtl", b"newmtl wall\nmap_Kd wall.png\n");
    check_mesh(dir, read_mesh(&file(dir, "mesh.obj", OBJ.as_bytes()), UpAxis::Z));
    check(dir, read_picture_size(&image));
    check(dir, read_picture_turn(&image));
}

/// Binary glTF or its JSON form, by the first bytes.
fn gltf(dir: &Path, data: &[u8]) {
    let name = if data.starts_with(b"glTF") {
        "mesh.glb"
    } else {
        "mesh.gltf"
    };
    check_mesh(dir, near(&file(dir, name, data), UpAxis::Y));
}

fn ply_mesh(dir: &Path, data: &[u8]) {
    let path = file(dir, "mesh.ply", data);
    check_mesh(dir, near(&path, UpAxis::Z));
    check(dir, read_ply_point_count(&path));
}

fn ply_cloud(dir: &Path, data: &[u8]) {
    let path = file(dir, "cloud.ply", data);
    annotations(dir, &path);
    check(dir, read_point_sample(&path, 100));
}

fn s3dis(dir: &Path, data: &[u8]) {
    let path = file(dir, "chair_1.txt", data);
    for on_fault in [OnFault::Stop, OnFault::Skip] {
        let mut cloud = PointCloud::default();
        let Some(mut reader) = check(dir, PointReader::open_with(&path, on_fault)) else { return };
        while check(dir, reader.read_chunk(1000, &mut cloud)).is_some_and(|n| n > 0) {}
        assert!(cloud.positions.iter().all(|p| p.is_finite()));
    }
}

/// The first byte chooses one of `n` readers of small files. Returns its number and the other bytes.
fn choice(data: &[u8], n: u8) -> (u8, &[u8]) {
    data.split_first().map_or((0, data), |(first, rest)| (first % n, rest))
}

/// Lists of cameras: a CSV table, a COLMAP model as text and binary, a transforms.json, a house of
/// Matterport3D.
fn cameras(dir: &Path, data: &[u8]) {
    let (which, data) = choice(data, 5);
    let names = ["cameras.csv", "images.txt", "images.bin", "transforms.json", "a.house"];
    let name = names[usize::from(which)];
    let path = file(dir, name, data);
    if let Some(found) = check(dir, read_scan_locations(&path, &DAffine3::IDENTITY)) {
        assert!(
            found
                .iter()
                .all(|l| is_valid_uuid(&l.uuid) && l.pose.location.is_finite())
        );
    }
}

/// Cameras with intrinsics: a table, COLMAP's cameras as text and binary, a transforms.json, a trajectory,
/// XML or Matterport3D's list, a pose and intrinsics of ScanNet, intrinsics of ARKitScenes and of 3RScan.
fn posed_cameras(dir: &Path, data: &[u8]) {
    let (which, data) = choice(data, 9);
    let folder = |name: &str| {
        let folder = dir.join(name);
        fs::create_dir_all(&folder).expect("the folder can be written");
        folder
    };

    let path = match which {
        0 => file(dir, "table.csv", data),
        1 => {
            file(dir, "cameras.txt", data);
            file(dir, "images.txt", b"1 1 0 0 0 0 0 0 1 a.jpg\n")
        }
        2 => {
            let mut image = vec![1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0];
            [1f64, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
                .iter()
                .for_each(|v| image.extend(v.to_le_bytes()));
            image.extend([1, 0, 0, 0, b'a', 0, 0, 0, 0, 0, 0, 0, 0, 0]);
            file(dir, "cameras.bin", data);
            file(dir, "images.bin", &image)
        }
        3 => {
            // A keyframe of Polycam and the turn of its mesh are JSON too.
            folder("capture/keyframes/images");
            file(&folder("capture/keyframes/cameras"), "1.json", data);
            file(&dir.join("capture"), "mesh_info.json", data);
            check(dir, read_posed_cameras(&dir.join("capture"), &DAffine3::IDENTITY));
            file(dir, "transforms.json", data)
        }
        4 => file(dir, "trajectory.txt", data),
        7 => {
            file(&folder("video/wide"), "1_0.5.png", b"");
            file(&folder("video/wide_intrinsics"), "1_0.5.pincam", data);
            file(&dir.join("video"), "lowres_wide.traj", b"0.5 0 0 0 1 2 3\n");
            dir.join("video")
        }
        8 => {
            let sequence = folder("sequence");
            file(&sequence, "frame-000000.pose.txt", b"1 0 0 1\n0 0 1 2\n0 -1 0 3\n0 0 0 1\n");
            file(&sequence, "_info.txt", data);
            sequence
        }
        _ => {
            let pose = folder("pose");
            let intrinsics = folder("intrinsic").join("intrinsic_color.txt");
            let good = b"1 0 0 1\n0 0 1 2\n0 -1 0 3\n0 0 0 1\n";
            file(&pose, "0.txt", if which == 5 { data } else { good });
            fs::write(intrinsics, if which == 5 { b"9 0 4 0 9 3 0 0 1" } else { data }).expect("written");
            pose
        }
    };

    if which == 4
        && let Ok(recording) = Recording::open(&path)
    {
        for frame in &recording.frames {
            check(dir, recording.read_depth(frame));
            let _ = frame.color.read();
        }
    }

    let Some(found) = check(dir, read_posed_cameras(&path, &DAffine3::IDENTITY)) else { return };
    assert!(!found.cameras.is_empty());
    let half = GivenIntrinsics { width: Some(64), height: Some(32), optics: None };
    for camera in &found.cameras {
        let _ = camera.photo_lens([640, 480]);
    }

    for camera in &found.cameras {
        assert!(camera.pose.location.is_finite());
        for given in [GivenIntrinsics::default(), half] {
            if let Ok(camera) = camera.camera(&given) {
                let _ = (camera.fov_rad(), camera.k_matrix(), camera.project(camera.pose.location));
            }
        }
    }
}

/// A folder of raw captures: poses and intrinsics.
fn captures(dir: &Path, data: &[u8]) {
    const UUID: &str = "8eb9955b866b4b5f74abb1071416c628";
    let (which, data) = choice(data, 2);
    if which == 0 {
        check(dir, read_intrinsics(&file(dir, &format!("{UUID}_intrinsics_1.txt"), data)));
    } else {
        let path = file(dir, &format!("{UUID}_pose_1_0.txt"), data);
        check(dir, read_capture_pose(&path));
        check(dir, read_scan_locations(dir, &DAffine3::IDENTITY));
        fs::remove_file(path).expect("the folder can be written");
    }
}

/// The JSON files of a data set: a pose and a folder of poses, labels, instances, views, splits, conventions.
fn json(dir: &Path, data: &[u8]) {
    let (which, data) = choice(data, 6);
    match which {
        0 => {
            let poses = dir.join("poses");
            fs::create_dir_all(&poses).expect("the folder can be written");
            let path = file(&poses, "pose.json", data);
            if let Some(pose) = check(dir, read_pose(&path)) {
                let _ = (pose.pose(), pose.original());
            }
            check(dir, read_scan_locations(&poses, &DAffine3::IDENTITY));
        }
        1 => {
            if let Some(names) = check(dir, read_labels(&file(dir, "semantic_labels.json", data))) {
                names.iter().for_each(|name| drop(s3d_label::parse_name(name)));
            }
        }
        2 => drop(check(dir, read_instances(&file(dir, "instances.json", data)))),
        3 => {
            check(dir, read_views(&file(dir, "views.json", data)));
            check(dir, read_photographs(&file(dir, "frames.json", data)));
        }
        4 => drop(check(dir, read_splits(&file(dir, "splits.json", data)))),
        _ => drop(check(dir, read_conventions(&file(dir, "conventions.json", data)))),
    }
}

/// A scene whose files exist, so that reading gets past looking for them.
fn scene(dir: &Path, data: &[u8]) {
    fs::create_dir_all(dir.join("a")).expect("the folder can be written");
    for name in ["m.obj", "c.csv"] {
        file(dir, name, b"");
    }
    check(dir, read_scene(&file(dir, "scene.toml", data)));
}

/// A taxonomy as TOML or JSON. One that can be read is written, and must come back equal.
fn taxonomy(dir: &Path, data: &[u8]) {
    let name = if data.starts_with(b"{") {
        "classes.json"
    } else {
        "classes.toml"
    };
    let Some(found) = check(dir, read_taxonomy(&file(dir, name, data))) else { return };

    let again = dir.join("taxonomy.json");
    write_taxonomy_json(&again, &found).expect("what was read can be written");
    assert!(read_taxonomy_json(&again).is_ok_and(|read| read == found), "another taxonomy comes back");
    assert!(
        found
            .classes()
            .iter()
            .all(|class| found.class(class.name()) == Ok(*class))
    );
}

/// An array, or an archive of arrays, by the first bytes; and a folder that has the array thrice.
fn npy(dir: &Path, data: &[u8]) {
    let name = if data.starts_with(b"PK") {
        "cloud.npz"
    } else {
        "cloud.npy"
    };
    let path = file(dir, name, data);
    annotations(dir, &path);
    let folder = dir.join("office_1");
    fs::create_dir_all(&folder).expect("the folder can be written");
    for name in ["coord.npy", "segment.npy", "instance.npy"] {
        file(&folder, name, data);
    }
    annotations(dir, &folder);
    if let Ok(array) = NpyArray::open(&path) {
        numbers(array);
    }
    if let Ok(mut archive) = NpzArchive::open(&path) {
        for name in archive.names().to_vec() {
            let _ = archive.array(&name).map(numbers);
        }
    }
}

/// Reads the first numbers of an array. An archive may unpack to any number of them.
fn numbers(mut array: NpyArray<impl Read>) {
    let mut integers = Vec::new();
    let mut floats = Vec::new();
    for _ in 0..4 {
        let _ = (array.read_integers(&mut integers), array.read_floats(&mut floats));
    }
}

/// LAS or LAZ: the header tells which it is, whatever the name.
fn las(dir: &Path, data: &[u8]) {
    annotations(dir, &file(dir, "cloud.las", data));
}

fn pcd(dir: &Path, data: &[u8]) {
    annotations(dir, &file(dir, "cloud.pcd", data));
}

/// A text with names of columns or a count, without them, and as scans with poses.
fn text_cloud(dir: &Path, data: &[u8]) {
    let columns = ["x", "y", "z", "class"].map(str::to_owned).to_vec();
    for name in ["cloud.csv", "cloud.pts", "cloud.ptx"] {
        let path = file(dir, name, data);
        annotations(dir, &path);
        let named = AnnotationOptions { columns: columns.clone(), ..numbered() };
        check(dir, Annotations::open(&[path], &named));
    }
}

/// Points of SemanticKITTI, each with a label made of its own bytes.
fn kitti(dir: &Path, data: &[u8]) {
    let labels: Vec<u8> = data.iter().step_by(4).copied().collect();
    file(dir, "cloud.label", &labels);
    annotations(dir, &file(dir, "cloud.bin", data));
}

/// An E57 file. The checksums of its pages are corrected, so that their contents are read.
fn e57(dir: &Path, data: &[u8]) {
    let mut data = data.to_vec();
    let page = data
        .get(40..48)
        .map_or(0, |b| b.iter().rev().fold(0, |n, b| n << 8 | usize::from(*b)));
    let page = if (64..=1 << 20).contains(&page) { page } else { 1024 };
    for page in data.chunks_exact_mut(page) {
        let (content, sum) = page.split_at_mut(page.len() - 4);
        sum.copy_from_slice(&crc32c(content).to_be_bytes());
    }
    let path = file(dir, "cloud.e57", &data);
    annotations(dir, &path);
    if let Ok(pictures) = E57Pictures::open(&path, &DAffine3::IDENTITY) {
        let first: Vec<usize> = (0..4).collect();
        let _ = pictures.check(&first);
        let _ = pictures.read(&first);
    }
}

/// CRC-32C, Castagnoli's checksum.
fn crc32c(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0x82f6_3b78 ^ (c >> 1) } else { c >> 1 })
    })
}

/// ScanNet's two lists, with a zero byte between them, beside a mesh of four vertices.
fn scannet(dir: &Path, data: &[u8]) {
    const PLY: &[u8] =
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n\
        0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n0 0 1 1 2 3\n3 0 1 2\n";
    let at = data.iter().position(|&b| b == 0).unwrap_or(data.len());
    let (objects, segments) = data.split_at(at);
    let scan = dir.join("scene0000_00");
    fs::create_dir_all(&scan).expect("the folder can be written");
    file(&scan, "scene0000_00.aggregation.json", objects);
    file(&scan, "scene0000_00_vh_clean_2.0.010000.segs.json", segments.get(1..).unwrap_or_default());
    file(&scan, "scene0000_00_vh_clean_2.ply", PLY);
    annotations(dir, &scan);
}

fn mat(dir: &Path, data: &[u8]) {
    let path = file(dir, "pointcloud.mat", data);
    if let Some(area) = check(dir, MatArea::open(&path)) {
        for object in area.rooms.iter().flat_map(|r| &r.objects) {
            check(dir, object.read(&mut PointCloud::default()));
        }
    }
    annotations(dir, &path);
}

fn png(dir: &Path, data: &[u8]) {
    let path = file(dir, "image.png", data);
    let rgb = check(dir, read_rgb8(&path)).map(|image| (image.width(), image.height()));
    let gray = check(dir, read_gray16(&path)).map(|image| (image.width(), image.height()));
    let size = check(dir, read_png_size(&path));
    assert!(rgb.or(gray).is_none_or(|read| Some(read) == size));
}

fn exr(dir: &Path, data: &[u8]) {
    check(dir, read_xyz(&file(dir, "image.exr", data)));
}

/// A list of files. One that can be read must be written byte for byte.
fn file_list(dir: &Path, data: &[u8]) {
    if let Some(records) = check(dir, read_file_list(&file(dir, "files.csv", data))) {
        let again = dir.join("again.csv");
        write_file_list(&again, &records).expect("what was read can be written");
        assert!(fs::read(again).is_ok_and(|written| written == data));
    }
}

/// The archive of a folder of labels, and the texts of all its arrays.
fn saved_labels(dir: &Path, data: &[u8]) {
    let path = file(dir, LABELS_FILE, data);
    check(dir, SavedLabels::read(dir));
    if let Some(mut archive) = check(dir, NpzArchive::open(&path)) {
        for name in archive.names().to_vec() {
            check(dir, archive.texts(&name));
        }
    }
}

/// Lists that label a mesh: of HM3D, Replica, 3RScan, ScanNet++, and of one number a vertex or face.
fn label_files(dir: &Path, data: &[u8]) {
    for mesh in ["mesh_semantic.ply", "labels.instances.ply", "mesh_aligned.ply", "mesh.ply"] {
        file(dir, mesh, LABELLED_PLY.as_bytes());
    }
    // A triangle in the colour 39EB3C.
    file(
        dir,
        "a.semantic.glb",
        br#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 36, "uri":
        "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}], "bufferViews": [{"buffer": 0,
        "byteLength": 36}], "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3",
        "count": 3}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.0409, 0.8308, 0.0452, 1]}}],
        "nodes": [{"mesh": 0}]}"#,
    );
    for mesh in ["a.ply", "region0.ply", "region1.ply"] {
        file(dir, mesh, MATTERPORT_PLY.as_bytes());
    }
    let scene = read_mesh(&dir.join("mesh.ply"), UpAxis::Z).expect("a mesh");
    let mesh = AnnotatedMesh { file: &scene, up: UpAxis::Z, units: None, outside_files: false };

    let names = [
        "a.house",
        "region0.semseg.json",
        "a.semantic.txt",
        "info_semantic.json",
        "semseg.v2.json",
        "numbers.txt",
        "numbers.npy",
    ];
    let mut lists: Vec<PathBuf> = names.iter().map(|name| file(dir, name, data)).collect();
    // ScanNet++ has segments beside its groups. The bytes are both in turn.
    let groups = br#"{"segGroups": [{"objectId": 1, "label": "chair", "segments": [1, 2]}]}"#;
    lists.push(file(dir, "segments_anno.json", groups));
    file(dir, "segments.json", data);
    // Matterport3D has segments beside its groups, and a house beside the mesh of a region.
    file(dir, "region1.semseg.json", groups);
    lists.push(dir.join("region1.semseg.json"));
    for region in ["region0.fsegs.json", "region1.fsegs.json"] {
        file(dir, region, data);
    }
    let region = read_mesh(&dir.join("region0.ply"), UpAxis::Z).expect("a mesh");
    let _ = check(dir, Annotations::of_mesh(&region, &numbered()));
    for list in &lists {
        let _ = check(dir, Annotations::open_for(&mesh, std::slice::from_ref(list), &numbered()));
    }
    fs::remove_file(dir.join("segments.json")).expect("the folder can be written");
}
