//! Functions that take a reader or a writer give the same results as those with a path, and their errors use
//! the given file name.

use s3d_geom::PointCloud;
use s3d_geom::glam::vec3;
use s3d_io::Error;
use s3d_io::cloud::{
    AnnotationOptions, Annotations, LabelledPoints, MatArea, MatWriter, NpyWriter, OnFault, PlyPointWriter,
    PointReader,
};
use s3d_io::mesh::{MeshOptions, UpAxis, read_mesh, read_mesh_from};
use s3d_label::Class;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

fn fixture(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(path)
}

/// Rooms, instances and all their points.
fn contents(annotations: &Annotations) -> Vec<(String, PointCloud)> {
    let mut all = Vec::new();
    for room in &annotations.rooms {
        for instance in &room.instances {
            let mut points = PointCloud::default();
            instance.read(&mut points).unwrap();
            all.push((format!("{} {}_{}", room.room, instance.class, instance.number), points));
        }
    }
    all
}

#[test]
fn annotations_of_any_format_come_from_a_reader() {
    let classes = [("2", Class::FLOOR), ("6", Class::WALL), ("19", Class::CHAIR)];
    let classes = classes.map(|(number, class)| (number.to_owned(), Some(class)));
    let options = AnnotationOptions {
        classes: classes.into(),
        room: Some("office_1".parse().unwrap()),
        ..AnnotationOptions::default()
    };
    let names =
        ["1_2_format_3.las", "1_4_format_7.laz", "ascii.ply", "big.ply", "columns.npz", "two_scans.e57"];

    for name in names {
        let path = fixture(&format!("clouds/{name}"));
        let by_path = Annotations::open(std::slice::from_ref(&path), &options).unwrap();
        let bytes = Cursor::new(fs::read(&path).unwrap());
        let by_reader = Annotations::from_reader(bytes, Path::new(name), &options).unwrap();
        assert!(!by_path.rooms.is_empty(), "{name}");
        assert_eq!(contents(&by_reader), contents(&by_path), "{name}");

        // If the points wait in a temporary file, the reader is read once more.
        let few = AnnotationOptions { points_in_memory: 1, ..options.clone() };
        let bytes = Cursor::new(fs::read(&path).unwrap());
        let spooled = Annotations::from_reader(bytes, Path::new(name), &few).unwrap();
        assert_eq!(contents(&spooled), contents(&by_path), "{name}");

        let cut = Cursor::new(fs::read(&path).unwrap()[..100].to_vec());
        let error = Annotations::from_reader(cut, Path::new(name), &options).unwrap_err();
        assert_eq!(error.path(), Path::new(name), "{error}");
    }
    let error = Annotations::from_reader(Cursor::new([]), Path::new("a.fbx"), &options).unwrap_err();
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
}

#[test]
fn a_mat_file_is_written_to_and_read_from_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pointcloud.mat");
    let positions: Vec<_> = (0..50u8).map(|i| vec3(f32::from(i), 0.5, -1.0)).collect();
    let colors = vec![[1, 2, 3]; 50];

    let mut by_path = MatWriter::create(&path, "Area_1").unwrap();
    let mut in_memory = MatWriter::new(Cursor::new(Vec::new()), Path::new("a.mat"), "Area_1").unwrap();
    by_path.room("office_1", 45).unwrap();
    by_path.object("chair_1", "chair_1_office_1_1").unwrap();
    by_path.append(&positions, &colors).unwrap();
    in_memory.room("office_1", 45).unwrap();
    in_memory.object("chair_1", "chair_1_office_1_1").unwrap();
    in_memory.append(&positions, &colors).unwrap();

    let error = in_memory.append(&[vec3(f32::NAN, 0.0, 0.0)], &[[0; 3]]).unwrap_err();
    assert_eq!(error.path(), Path::new("a.mat"));
    by_path.finish().unwrap();
    let bytes = in_memory.into_inner().unwrap().into_inner();
    assert!(bytes == fs::read(&path).unwrap(), "{} bytes", bytes.len());

    let area = MatArea::new(Cursor::new(bytes.clone()), Path::new("a.mat")).unwrap();
    let mut points = PointCloud::default();
    area.rooms[0].objects[0].read(&mut points).unwrap();
    assert_eq!((points.positions, points.colors), (positions, colors));
    let annotations =
        Annotations::from_reader(Cursor::new(bytes), Path::new("a.mat"), &Default::default()).unwrap();
    assert_eq!(annotations.rooms[0].instances[0].class, Class::CHAIR);
}

#[test]
fn points_are_written_to_and_read_from_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.ply");
    let cloud = PointCloud { positions: vec![vec3(1.0, 2.0, 3.0); 3], ..PointCloud::default() };
    let mut by_path = PlyPointWriter::create(&path, 3).unwrap();
    by_path.append(&cloud, &[7, 8, 9]).unwrap();
    by_path.finish().unwrap();
    let mut in_memory = PlyPointWriter::new(Vec::new(), Path::new("p.ply"), 3).unwrap();
    in_memory.append(&cloud, &[7, 8, 9]).unwrap();
    let bytes = in_memory.into_inner().unwrap();
    assert_eq!(bytes, fs::read(&path).unwrap());

    let mut points = Vec::new();
    let mut reader = LabelledPoints::new(Cursor::new(bytes), Path::new("p.ply")).unwrap();
    assert!(reader.read(10, &mut points).unwrap());
    assert_eq!(points.iter().map(|p| p.label).collect::<Vec<_>>(), [7, 8, 9]);
    let short = PlyPointWriter::new(Vec::new(), Path::new("p.ply"), 3)
        .unwrap()
        .into_inner()
        .unwrap_err();
    assert!(short.to_string().starts_with("p.ply: 3 points were promised"), "{short}");

    let path = folder.path().join("a.npy");
    NpyWriter::create(&path, "<u4", &[0, 2]).unwrap().finish().unwrap();
    let array = NpyWriter::new(Vec::new(), Path::new("a.npy"), "<u4", &[0, 2]).unwrap();
    assert_eq!(array.into_inner().unwrap(), fs::read(&path).unwrap());

    let text = "1 2 3 4 5 6\nno point\n7 8 9 10 11 12\n";
    let mut reader = PointReader::new(text.as_bytes(), Path::new("chair_1.txt"), OnFault::Skip);
    let mut cloud = PointCloud::default();
    while reader.read_chunk(1, &mut cloud).unwrap() > 0 {}
    assert_eq!((cloud.len(), reader.skipped()), (2, 1));
    assert!(
        reader
            .first_skipped()
            .unwrap()
            .to_string()
            .starts_with("chair_1.txt, line 2")
    );
}

#[test]
fn meshes_come_from_a_reader_with_the_files_beside_their_name() {
    let folder = tempfile::tempdir().unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n\
               3 0 1 2\n";
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    fs::write(folder.path().join("a.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    for (name, text) in [("a.ply", ply), ("a.OBJ", obj)] {
        let path = folder.path().join(name);
        let options = MeshOptions::default();
        // So far only the mesh's other files exist.
        let by_reader = read_mesh_from(text.as_bytes(), &path, UpAxis::Z, &options).unwrap();
        fs::write(&path, text).unwrap();
        let by_path = read_mesh(&path, UpAxis::Z).unwrap();
        let [a, b] = [&by_reader, &by_path].map(|file| file.mesh.parts());
        assert_eq!((&a.positions, &a.faces), (&b.positions, &b.faces), "{name}");
        assert_eq!(a.materials.first().map(|m| m.color), b.materials.first().map(|m| m.color));
        assert_eq!((by_reader.companions, by_reader.warnings), (by_path.companions, by_path.warnings));
        let error = read_mesh_from(&b"ply\n"[..], &path, UpAxis::Z, &options).unwrap_err();
        assert_eq!(error.path(), path);
    }
    let error = read_mesh_from(&b""[..], Path::new("a.fbx"), UpAxis::Z, &MeshOptions::default()).unwrap_err();
    assert!(error.to_string().contains(".fbx is not read"), "{error}");
}
