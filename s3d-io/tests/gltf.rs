//! Reads unusual glTF: instances of meshes, extensions that hold geometry, and files that are valid but do
//! not fit the gltf crate's types. Some of them are seeds of the fuzz target too.
#![cfg(feature = "gltf")]

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use s3d_geom::glam::{Vec3, vec3};
use s3d_io::Result;
use s3d_io::mesh::{MeshFile, UpAxis, read_mesh};
use std::fs;
use std::path::Path;

fn read_bytes(name: &str, bytes: &[u8]) -> Result<MeshFile> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::write(&path, bytes).unwrap();
    read_mesh(&path, UpAxis::Z)
}

fn seed(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/gltf").join(name)).unwrap()
}

/// Makes a file with these accessors, each over its own view: bytes, component type, type, count and further
/// JSON.
fn gltf(accessors: &[(Vec<u8>, u32, &str, usize, &str)], rest: &str) -> String {
    let mut data = Vec::new();
    let mut views = Vec::new();
    let mut json = Vec::new();
    for (view, (bytes, component, kind, count, more)) in accessors.iter().enumerate() {
        data.resize(data.len().next_multiple_of(4), 0);
        let at = data.len();
        let length = bytes.len();
        data.extend(bytes);
        views.push(format!(r#"{{"buffer": 0, "byteOffset": {at}, "byteLength": {length}}}"#));
        let elements = format!(r#""type": "{kind}", "count": {count}{more}"#);
        json.push(format!(r#"{{"bufferView": {view}, "componentType": {component}, {elements}}}"#));
    }

    format!(
        r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": {}, "uri": "data:;base64,{}"}}],
        "bufferViews": [{}], "accessors": [{}], {rest}}}"#,
        data.len(),
        STANDARD.encode(&data),
        views.join(","),
        json.join(",")
    )
}

fn floats<const N: usize>(values: &[[f32; N]]) -> Vec<u8> {
    values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
}

/// A triangle in the plane z = 0.
fn triangle() -> (Vec<u8>, u32, &'static str, usize, &'static str) {
    (floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), 5126, "VEC3", 3, "")
}

const MESH: &str = r#""meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]"#;

fn instancing(attributes: &str) -> String {
    format!(
        r#"{MESH}, "nodes": [{{"mesh": 0, "translation": [10, 0, 0],
        "extensions": {{"EXT_mesh_gpu_instancing": {{"attributes": {attributes}}}}}}}]"#
    )
}

#[test]
fn instances_are_placed_by_translation_rotation_and_scale() {
    let translations = (floats(&[[0.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 7.0]]), 5126, "VEC3", 3, "");
    let scales = (floats(&[[1.0; 3], [2.0, 3.0, 1.0], [-1.0, 1.0, 1.0]]), 5126, "VEC3", 3, "");
    // No turn, a quarter turn around z, no turn; as floats, and as normalized integers of both sizes.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turns = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, half, half], [0.0, 0.0, 0.0, 1.0]];
    let bytes: Vec<u8> = turns
        .iter()
        .flatten()
        .map(|v| (v * 127.0).round() as i8 as u8)
        .collect();
    let shorts: Vec<u8> = turns
        .iter()
        .flatten()
        .flat_map(|v| ((v * 32767.0).round() as i16).to_le_bytes())
        .collect();

    let normalized = r#", "normalized": true"#;
    for turns in [
        (floats(&turns), 5126, "VEC4", 3, ""),
        (bytes, 5120, "VEC4", 3, normalized),
        (shorts, 5122, "VEC4", 3, normalized),
    ] {
        let attributes = r#"{"TRANSLATION": 1, "ROTATION": 2, "SCALE": 3, "_ID": 1}"#;
        let accessors = [triangle(), translations.clone(), turns, scales.clone()];
        let mesh = read_bytes("a.gltf", gltf(&accessors, &instancing(attributes)).as_bytes())
            .unwrap()
            .mesh;
        assert_eq!(mesh.faces().len(), 3);
        // Instances are placed in the frame of their node.
        let expected = [
            [vec3(10.0, 0.0, 0.0), vec3(11.0, 0.0, 0.0), vec3(10.0, 1.0, 0.0)],
            // Scaled first, then turned.
            [vec3(10.0, 5.0, 0.0), vec3(10.0, 7.0, 0.0), vec3(7.0, 5.0, 0.0)],
            // Mirrored. Its front stays in front.
            [vec3(10.0, 0.0, 7.0), vec3(10.0, 1.0, 7.0), vec3(9.0, 0.0, 7.0)],
        ];
        for (face, corners) in (0..).zip(expected) {
            let found = mesh.triangle(face);
            let is_near = found.iter().zip(corners).all(|(a, b)| a.abs_diff_eq(b, 1e-5));
            assert!(is_near, "{face}: {found:?}");
            assert!(mesh.normal(face).abs_diff_eq(Vec3::Z, 1e-6));
        }
    }
}

#[test]
fn instances_that_cannot_be_are_refused() {
    let two = (floats(&[[0.0; 3], [1.0; 3]]), 5126, "VEC3", 2, "");
    let three = (floats(&[[0.0; 3], [1.0; 3], [2.0; 3]]), 5126, "VEC3", 3, "");
    let no_turns = (vec![0; 32], 5126, "VEC4", 2, "");
    let many = format!(
        r#"{}, "extensionsRequired": ["EXT_mesh_gpu_instancing"]"#,
        instancing(r#"{"TRANSLATION": 4}"#)
    );

    let claim = ", {\"componentType\": 5126, \"type\": \"VEC3\", \"count\": 1000000}], \"meshes\"";

    for (rest, words) in [
        (instancing(r#"{"TRANSLATION": 1, "SCALE": 2}"#), "3 of SCALE, but 2 of TRANSLATION"),
        (instancing(r#"{"TRANSLATION": 1, "ROTATION": 3}"#), "instance 0 has a transform"),
        (instancing(r#"{"TRANSLATION": 9}"#), "accessor 9, which is not there"),
        (instancing(r#"{"TRANSLATION": "x"}"#), "TRANSLATION is \"x\", no accessor"),
        (instancing(r#"{"TRANSLATION": 3}"#), "4 numbers an element, not 3"),
        (instancing("{}"), "has no attributes"),
        (many, "TRANSLATION has 1000000 elements in 0 bytes"),
    ] {
        let json = gltf(&[triangle(), two.clone(), three.clone(), no_turns.clone()], &rest);
        let json = json.replacen("], \"meshes\"", claim, 1);
        let message = read_bytes("a.gltf", json.as_bytes()).unwrap_err().to_string();
        assert!(message.contains(words) && message.contains("a.gltf"), "{words}: {message}");
    }
}

/// 2¹² nodes of 2¹³ instances each, from half a megabyte.
#[test]
fn instances_are_counted_before_there_is_memory_for_them() {
    let places = (vec![0; 12 << 13], 5126, "VEC3", 1 << 13, "");
    let node =
        r#"{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}}"#;
    let rest = format!(r#"{MESH}, "nodes": [{}]"#, vec![node; 1 << 12].join(","));
    let message = read_bytes("a.gltf", gltf(&[triangle(), places], &rest).as_bytes())
        .unwrap_err()
        .to_string();
    assert!(message.contains("16777216 are read at most"), "{message}");
}

#[test]
fn a_seed_with_instances_is_read() {
    let file = read_bytes("a.gltf", &seed("instances.gltf")).unwrap();
    assert_eq!(file.mesh.faces().len(), 8);
    assert!(file.warnings.is_empty(), "{:?}", file.warnings);
}

#[test]
fn coarser_levels_and_hidden_nodes_are_left_out() {
    let rest = format!(
        r#"{MESH}, "nodes": [
        {{"mesh": 0, "extensions": {{"MSFT_lod": {{"ids": [1, 2]}}}}}},
        {{"mesh": 0, "translation": [1, 0, 0]}},
        {{"mesh": 0, "translation": [2, 0, 0]}},
        {{"mesh": 0, "translation": [3, 0, 0], "extensions": {{"KHR_node_visibility": {{"visible": false}}}},
        "children": [4]}}, {{"mesh": 0}},
        {{"mesh": 0, "translation": [5, 0, 0],
        "extensions": {{"KHR_node_visibility": {{"visible": true}}}}}}]"#
    );
    let file = read_bytes("a.gltf", gltf(&[triangle()], &rest).as_bytes()).unwrap();
    let at: Vec<f32> = (0..file.mesh.faces().len() as u32)
        .map(|f| file.mesh.triangle(f)[0].x)
        .collect();
    assert_eq!(at, [0.0, 5.0]);

    let told = file.warnings.join("\n");
    assert!(
        told.contains("1 node and what is below left out: hidden") && told.contains("2 nodes left out"),
        "{told}"
    );
}

#[test]
fn extensions_that_have_geometry_are_refused_by_name_wherever_they_are() {
    let primitive = |e: &str| {
        format!(
            r#""meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}},
                "extensions": {{"{e}": {{}}}}}}]}}],
            "nodes": [{{"mesh": 0}}]"#
        )
    };
    let mesh = |e: &str| {
        primitive("KHR_materials_variants").replacen(
            "{\"primitives\"",
            &format!(r#"{{"extensions": {{"{e}": {{}}}}, "primitives""#),
            1,
        )
    };
    let root = |e: &str| {
        format!(r#"{MESH}, "nodes": [{{"mesh": 0}}], "extensions": {{"{e}": {{"center": [1, 2, 3]}}}}"#)
    };
    let read = |rest: &str| read_bytes("a.gltf", gltf(&[triangle()], rest).as_bytes());
    for (rest, name) in [
        (primitive("EXT_mesh_primitive_restart"), "EXT_mesh_primitive_restart"),
        (mesh("NEEDLE_progressive"), "NEEDLE_progressive"),
        (root("CESIUM_RTC"), "CESIUM_RTC"),
    ] {
        // The file lists these extensions nowhere else.
        let message = read(&rest).unwrap_err().to_string();
        assert!(
            message.contains(&format!("has the extension {name}, which changes its geometry")),
            "{message}"
        );
    }

    // Compressed geometry is no fault if there is a plain form beside it.
    assert!(
        read(&primitive("KHR_draco_mesh_compression"))
            .unwrap()
            .warnings
            .is_empty()
    );

    let file = read(&primitive("XYZ_thing")).unwrap();
    assert!(file.warnings.concat().contains("not read: XYZ_thing"), "{:?}", file.warnings);

    // Faces without data, with vertices that have some.
    let indices = r#"{"componentType": 5123, "type": "SCALAR", "count": 3}"#;
    let json = gltf(&[triangle()], &primitive("KHR_draco_mesh_compression"))
        .replacen("\"count\": 3}]", &format!("\"count\": 3}}, {indices}]"), 1)
        .replacen("\"POSITION\": 0}", "\"POSITION\": 0}, \"indices\": 1", 1);
    let message = read_bytes("a.gltf", json.as_bytes()).unwrap_err().to_string();
    let words = if cfg!(feature = "draco") {
        "its extension KHR_draco_mesh_compression names no buffer view"
    } else {
        "its faces are in the extension KHR_draco_mesh_compression"
    };
    assert!(message.contains(words), "{message}");
}

/// Anything that is neither geometry nor material nor texture stops nothing.
#[test]
fn odd_but_valid_files_are_read() {
    let plain = format!(r#"{MESH}, "nodes": [{{"mesh": 0}}]"#);
    let good = gltf(&[triangle()], &plain);
    let with = |more: &str| good.replacen("\"meshes\"", &format!("{more}, \"meshes\""), 1);
    for json in [
        with(
            r#""animations": [{"channels": [{"sampler": 0, "target": {"path": "pointer"}}],
                "samplers": []}]"#,
        ),
        with(r#""animations": 5, "cameras": [{"type": "none"}], "skins": [{}], "extras": "a text""#),
        with(r#""scene": 1, "scenes": [{"name": "nothing"}, {"nodes": [0], "extras": 7}]"#),
        // Without a default scene, the first scene with nodes counts.
        with(r#""scenes": [{"name": "nothing"}, {"nodes": [0.0]}]"#),
        with(r#""scenes": [{"name": "nothing"}]"#),
        good.replace("\"count\": 3", "\"count\": 3.0")
            .replace("5126", "5126.0")
            .replace("\"mesh\": 0", "\"mesh\": 0.0"),
        good.replace(
            "{\"mesh\": 0}",
            r#"{"mesh": 0, "extras": [1], "name": null, "camera": "x", "weights": "x"}"#,
        ),
        good.replace("\"version\": \"2.0\"", "\"version\": 2.0, \"generator\": 7"),
        format!("{good}\n  "),
    ] {
        let file = read_bytes("a.gltf", json.as_bytes()).unwrap_or_else(|e| panic!("{e}: {json}"));
        assert_eq!(file.mesh.faces().len(), 1, "{json}");
    }

    // Needed parts are checked as strictly as before. A fault has its line if the line is known.
    let fault = |json: String| read_bytes("a.gltf", json.as_bytes()).unwrap_err().to_string();
    let no_type = fault(good.replace(", \"componentType\": 5126", ""));
    assert!(
        no_type.contains("a.gltf, line 2: is no valid glTF 2.0: missing field `componentType`"),
        "{no_type}"
    );
    let both = fault(
        good.replace(", \"componentType\": 5126", "")
            .replace("\"mesh\": 0", "\"mesh\": 0, \"extras\": 7"),
    );
    assert!(both.contains("missing field `componentType`"), "{both}");

    assert!(fault(with("\"scene\": -1")).contains("expected index"));
    let nothing = fault(good.replace("\"version\": \"2.0\"", "\"version\": \"\""));
    assert!(
        nothing.contains("does not say that it is glTF 2.0: asset.version is missing or empty"),
        "{nothing}"
    );
    assert_eq!(read_bytes("a.gltf", &seed("odd.gltf")).unwrap().mesh.faces().len(), 2);
}

#[test]
fn bytes_behind_the_last_chunk_are_passed_over() {
    let mut json = gltf(&[triangle()], &format!(r#"{MESH}, "nodes": [{{"mesh": 0}}]"#)).into_bytes();
    for fill in [b' ', 0] {
        json.resize(json.len().next_multiple_of(4) + 4, fill);
        let chunk = [&(json.len() as u32).to_le_bytes()[..], b"JSON", &json].concat();
        let length = 12 + chunk.len() as u32;
        let glb = [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes(), &chunk].concat();
        for more in [&b""[..], b"\0", b"1234567", b"12345678", b"\xff\xff\xff\xffBAD\0more of it"] {
            let file = read_bytes("a.glb", &[&glb, more].concat()).unwrap();
            assert_eq!(file.mesh.faces().len(), 1, "{more:?}");
        }
    }
    assert_eq!(read_bytes("a.glb", &seed("behind.glb")).unwrap().mesh.faces().len(), 2);
}

#[test]
fn text_of_any_unicode_is_read() {
    let json = gltf(&[triangle()], &format!(r#"{MESH}, "nodes": [{{"mesh": 0}}]"#));
    let utf16 = |unit: fn(u16) -> [u8; 2]| -> Vec<u8> {
        [0xfeff].into_iter().chain(json.encode_utf16()).flat_map(unit).collect()
    };
    for bytes in
        [utf16(u16::to_le_bytes), utf16(u16::to_be_bytes), [b"\xef\xbb\xbf", json.as_bytes()].concat()]
    {
        assert_eq!(read_bytes("a.gltf", &bytes).unwrap().mesh.faces().len(), 1);
    }
}
