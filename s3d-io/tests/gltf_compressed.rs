//! Reads glTF whose geometry is compressed. Files of other programs must hold the mesh that their plain form
//! holds; `fixtures/gltf/README.md` says who wrote them.
#![cfg(feature = "gltf")]

use s3d_geom::glam::{Vec2, Vec3};
use s3d_geom::{FaceColor, TriMesh};
use s3d_io::Result;
use s3d_io::mesh::{MeshFile, UpAxis, read_mesh};
use std::fs;
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures/gltf")
        .join(name)
}

fn read(name: &str) -> MeshFile {
    read_mesh(&fixture(name), UpAxis::Y).unwrap()
}

fn read_bytes(bytes: &[u8]) -> Result<MeshFile> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.glb");
    fs::write(&path, bytes).unwrap();
    read_mesh(&path, UpAxis::Y)
}

/// Replaces text in the JSON of a `.glb` with text of the same length.
fn with_json(name: &str, from: &str, to: &str) -> Vec<u8> {
    let mut bytes = fs::read(fixture(name)).unwrap();
    let at = bytes
        .windows(from.len())
        .position(|w| w == from.as_bytes())
        .expect(from);
    let padded = format!("{to:from$}", from = from.len());
    assert_eq!(padded.len(), from.len());
    bytes[at..at + padded.len()].copy_from_slice(padded.as_bytes());
    bytes
}

/// A corner of a face with what is drawn there.
#[derive(Clone, Copy, Debug)]
struct Corner {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
    color: [f32; 3],
}

/// Returns the corners of a face, starting with the least.
fn corners(mesh: &TriMesh, face: u32) -> [Corner; 3] {
    let positions = mesh.triangle(face);
    let normals = mesh.corner_normals(face).unwrap();
    let mut corners = [0, 1, 2].map(|k| Corner {
        position: positions[k],
        normal: normals[k],
        uv: match mesh.color_of(face) {
            FaceColor::Texture(_, _, uvs) => uvs[k],
            _ => Vec2::ZERO,
        },
        color: match mesh.color_of(face) {
            FaceColor::Corners(colors) => colors[k].map(f32::from),
            _ => [0.0; 3],
        },
    });
    let key = |c: &Corner| (c.position * 100.0).round().to_array().map(|v| v as i32);
    let least = (0..3).min_by_key(|&k| key(&corners[k])).unwrap();
    corners.rotate_left(least);
    corners
}

/// Asserts that two meshes have the same faces, in any order, as exactly as 14 bits of positions are.
fn assert_same(found: &TriMesh, expected: &TriMesh, name: &str) {
    assert_eq!(found.faces().len(), expected.faces().len(), "{name}");
    let all: Vec<_> = (0..found.faces().len() as u32).map(|f| corners(found, f)).collect();
    let is_near = |a: &Corner, b: &Corner| {
        a.position.abs_diff_eq(b.position, 0.002)
            && a.normal.dot(b.normal) > 0.999
            && a.uv.abs_diff_eq(b.uv, 0.002)
            && a.color.iter().zip(b.color).all(|(a, b)| (a - b).abs() < 5.0)
    };
    for face in 0..expected.faces().len() as u32 {
        let wanted = corners(expected, face);
        let is_there = all
            .iter()
            .any(|found| found.iter().zip(&wanted).all(|(a, b)| is_near(a, b)));
        let nearest = all
            .iter()
            .min_by(|a, b| {
                let [a, b] = [a, b].map(|f| f[0].position.distance(wanted[0].position));
                a.total_cmp(&b)
            })
            .unwrap();
        assert!(is_there, "{name}, face {face}: {wanted:?}, not {nearest:?}");
    }
}

#[test]
fn meshopt_of_other_programs_is_read() {
    let plain = read("plain.glb");
    assert_eq!(plain.mesh.faces().len(), 2 * (512 + 128));
    for name in ["meshopt_ext.glb", "meshopt_khr.glb", "meshopt_floats.glb"] {
        let file = read(name);
        assert!(file.warnings.is_empty(), "{name}: {:?}", file.warnings);
        assert_same(&file.mesh, &plain.mesh, name);
    }
}

#[cfg(feature = "draco")]
#[test]
fn draco_of_other_programs_is_read() {
    let plain = read("plain.glb");
    for name in ["draco_edgebreaker.glb", "draco_sequential.glb"] {
        let file = read(name);
        assert!(file.warnings.is_empty(), "{name}: {:?}", file.warnings);
        assert_same(&file.mesh, &plain.mesh, name);
    }
}

/// A value of a wrong kind lets only the needed parts of the JSON be read.
#[test]
fn odd_files_are_read_too() {
    let mut files = vec![with_json("meshopt_khr.glb", r#""generator":"gltfpack 1.3""#, r#""generator":7"#)];
    if cfg!(feature = "draco") {
        let generator = r#""generator":"glTF-Transform v4.5.1""#;
        files.push(with_json("draco_edgebreaker.glb", generator, r#""generator":7"#));
    }
    for bytes in files {
        let file = read_bytes(&bytes).unwrap();
        assert_eq!((file.mesh.faces().len(), file.warnings), (2 * (512 + 128), vec![]));
    }
}

#[test]
fn damaged_meshopt_is_an_error_with_file_and_primitive() {
    let fault = |from: &str, to: &str| {
        read_bytes(&with_json("meshopt_ext.glb", from, to))
            .unwrap_err()
            .to_string()
    };
    let mode = fault(r#""mode":"TRIANGLES""#, r#""mode":"INDICES""#);
    for words in ["a.glb", "mesh 0, primitive 0, indices", "buffer view", "data are damaged"] {
        assert!(mode.contains(words), "{words}: {mode}");
    }
    let unknown = fault(r#""mode":"TRIANGLES""#, r#""mode":"STRIPS""#);
    assert!(unknown.contains("in the mode `STRIPS` with the filter `NONE`"), "{unknown}");

    let claim = fault(r#""mode":"TRIANGLES","count":1920"#, r#""mode":"TRIANGLES","count":9120"#);
    assert!(claim.contains("a.glb") && claim.contains("data are damaged"), "{claim}");
}

#[test]
fn a_claim_takes_no_memory() {
    let view = |more: &str| {
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}}],
            "buffers": [{{"byteLength": 3, "uri": "data:;base64,oAAA"}}, {{"byteLength": 36,
            "extensions": {{"KHR_meshopt_compression": {{"fallback": true}}}}}}],
            "bufferViews": [{{"buffer": 1, "byteLength": 36, "extensions": {{"KHR_meshopt_compression":
            {{"buffer": 0, "mode": "ATTRIBUTES", {more}}}}}}}]}}"#
        );
        read_bytes(json.as_bytes()).unwrap_err().to_string()
    };
    for (more, words) in [
        (
            r#""byteLength": 3, "byteStride": 12, "count": 9000000000000"#,
            "would unpack to 108000000000000 bytes",
        ),
        (r#""byteLength": 3, "byteStride": 18446744073709551615, "count": 9"#, "would unpack to"),
        (r#""byteLength": 4, "byteStride": 12, "count": 3"#, "takes 4 bytes from 0, but buffer 0 has 3"),
        (r#""byteLength": 3, "byteOffset": 9, "byteStride": 12, "count": 3"#, "takes 3 bytes from 9"),
        (r#""byteLength": 3, "byteStride": 12"#, "has no count"),
        (r#""byteLength": 3, "byteStride": 12, "count": 3"#, "data are damaged (KHR_meshopt_compression)"),
        (r#""byteLength": 3, "byteStride": 12, "count": 3, "filter": "COLOR""#, "with the filter `COLOR`"),
    ] {
        let message = view(more);
        let who = "mesh 0, primitive 0, POSITION: accessor 0: buffer view 0 ";
        assert!(message.contains(words) && message.contains(who), "{words}: {message}");
    }
}

#[cfg(feature = "draco")]
#[test]
fn damaged_draco_is_an_error_with_file_and_primitive() {
    let whole = fs::read(fixture("draco_edgebreaker.glb")).unwrap();
    let at = whole.windows(5).position(|w| w == b"DRACO").unwrap();
    let mut damaged = whole.clone();
    damaged[at] = b'X';
    let message = read_bytes(&damaged).unwrap_err().to_string();
    for words in ["a.glb", "mesh 0 `wave`, primitive 0: its extension KHR_draco_mesh_compression is damaged"]
    {
        assert!(message.contains(words), "{words}: {message}");
    }

    // Any byte may be another: the file is read or refused.
    for name in ["draco_edgebreaker.glb", "draco_sequential.glb"] {
        let whole = fs::read(fixture(name)).unwrap();
        let first = whole.windows(5).position(|w| w == b"DRACO").unwrap();
        for at in (first..whole.len()).step_by(29).chain(first..first + 60) {
            for byte in [0, 0xff] {
                let mut damaged = whole.clone();
                damaged[at] = byte;
                let _ = read_bytes(&damaged);
            }
        }
    }
}

#[cfg(feature = "draco")]
#[test]
fn claims_beside_draco_must_fit() {
    let fault = |from: &str, to: &str| {
        let bytes = with_json("draco_edgebreaker.glb", from, to);
        read_bytes(&bytes).unwrap_err().to_string()
    };
    let none = fault(r#""NORMAL":1,"TEXCOORD_0":2}}"#, r#""NORMAL":9,"TEXCOORD_0":2}}"#);
    assert!(none.contains("has no attribute 9 for NORMAL"), "{none}");
    let count = fault(r#""count":1536"#, r#""count":1533"#);
    assert!(count.contains("has 1536 elements of corners, but the accessor has 1533"), "{count}");
}

#[cfg(not(feature = "draco"))]
#[test]
fn without_its_feature_draco_is_refused_with_the_way_out() {
    let message = read_mesh(&fixture("draco_edgebreaker.glb"), UpAxis::Y)
        .unwrap_err()
        .to_string();
    assert!(message.contains("export without Draco"), "{message}");
}
