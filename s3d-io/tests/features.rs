//! Tests a build with OBJ alone: textured meshes are read, and other formats name the feature that reads
//! them. `.ci/features` runs it. If all features are built in, it tests nothing.
#![cfg(all(feature = "obj", not(any(feature = "gltf", feature = "ply"))))]

use s3d_io::mesh::{MeshFormat, UpAxis, read_mesh};
use std::fs;

/// A PNG with one pixel: 200, 100, 50.
const PNG: &[u8] = b"\x89PNG\x0d\x0a\x1a\x0a\
    \x00\x00\x00\x0dIHDR\x00\x00\x00\x01\x00\x00\x00\x01\x08\x02\x00\x00\x00\x90wS\xde\
    \x00\x00\x00\x0cIDATx\x9cc8\x91b\x04\x00\x03V\x01_\xe8\x17\x84R\x00\x00\x00\x00IEND\xaeB`\x82";

#[test]
fn a_textured_obj_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.obj");
    fs::write(
        &path,
        "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl floor\nf 1/1 2/2 3/3\n",
    )
    .unwrap();
    fs::write(folder.path().join("room.mtl"), "newmtl floor\nmap_Kd floor.png\n").unwrap();
    fs::write(folder.path().join("floor.png"), PNG).unwrap();

    let file = read_mesh(&path, UpAxis::Z).unwrap();
    assert_eq!((file.mesh.faces().len(), file.warnings), (1, vec![]));
    let texture = file.mesh.parts().materials[0].texture.expect("the floor has a texture") as usize;
    assert_eq!(file.mesh.parts().textures[texture].image.at(0, 0), [200, 100, 50]);
}

#[test]
fn other_formats_name_their_feature() {
    let folder = tempfile::tempdir().unwrap();
    for format in MeshFormat::ALL.iter().filter(|format| format.feature != "obj") {
        for ending in format.endings.iter().flat_map(|e| [e.to_string(), e.to_uppercase()]) {
            let path = folder.path().join(format!("a.{ending}"));
            fs::write(&path, "ply\n").unwrap();
            let message = read_mesh(&path, UpAxis::Z).unwrap_err().to_string();
            assert!(message.contains(&format!("cargo feature `{}`", format.feature)), "{message}");
        }
    }
}

#[cfg(all(
    feature = "cloud",
    not(any(
        feature = "las",
        feature = "e57",
        feature = "npy",
        feature = "mat",
        feature = "pcd",
        feature = "text",
        feature = "kitti"
    ))
))]
#[test]
fn annotations_of_other_formats_name_their_feature() {
    use s3d_io::cloud::Annotations;
    let folder = tempfile::tempdir().unwrap();
    let named = [("a.las", "las"), ("a.LAZ", "las"), ("a.e57", "e57"), ("a.npz", "npy"), ("a.mat", "mat")];
    let texts = [("a.pcd", "pcd"), ("a.asc", "text"), ("a.label", "kitti")];
    for (name, feature) in named
        .into_iter()
        .chain(texts)
        .chain([("a.ply", "ply"), ("b.aggregation.json", "scannet")])
    {
        let path = folder.path().join(name);
        fs::write(&path, "").unwrap();
        let message = Annotations::open(&[path], &Default::default()).unwrap_err().to_string();
        assert!(message.contains(&format!("cargo feature `{feature}`")), "{message}");
    }
}
