//! Tests what real glTF, OBJ and PLY files hold, with the smallest file for each. The same two triangles of a
//! square are written in every way that the formats have, and must be read as the same mesh. Anything that is
//! not read is refused by name, with a way out.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use s3d_geom::glam::{Vec2, Vec3, vec2, vec3};
use s3d_geom::{FaceColor, TriMesh};
use s3d_io::Result;
use s3d_io::mesh::{
    LabelColumn, LabelElement, MeshFile, MeshLabels, MeshOptions, UpAxis, read_mesh, read_mesh_with,
};
use std::fs;
use std::path::Path;

/// The corners of the square, counter-clockwise, and the vertices of its two triangles.
const CORNERS: [Vec3; 4] = [Vec3::ZERO, Vec3::X, Vec3 { x: 1.0, y: 1.0, z: 0.0 }, Vec3::Y];
const SQUARE: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn read_file(name: &str, bytes: &[u8], others: &[(&str, &[u8])]) -> Result<MeshFile> {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes) in others {
        fs::write(dir.path().join(name), bytes).unwrap();
    }
    let path = dir.path().join(name);
    fs::write(&path, bytes).unwrap();
    read_mesh(&path, UpAxis::Z)
}

/// Returns the corners of each triangle, starting with the smallest.
fn triangles(mesh: &TriMesh) -> Vec<[[i32; 3]; 3]> {
    let mut all: Vec<_> = (0..mesh.faces().len() as u32)
        .map(|f| {
            let mut corners = mesh.triangle(f).map(|p| (p * 1000.0).round().as_ivec3().to_array());
            let least = (0..3).min_by_key(|&k| corners[k]).unwrap();
            corners.rotate_left(least);
            corners
        })
        .collect();
    all.sort_unstable();
    all
}

fn square() -> Vec<[[i32; 3]; 3]> {
    triangles(&TriMesh::from_faces(CORNERS.to_vec(), SQUARE.to_vec()).unwrap())
}

/// A glTF file under construction: a buffer, with views and accessors over it.
#[derive(Default)]
struct Gltf {
    data: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Gltf {
    fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.data.len().is_multiple_of(4) {
            self.data.push(0);
        }
        let at = self.data.len();
        let length = bytes.len();
        self.views
            .push(format!(r#"{{"buffer": 0, "byteOffset": {at}, "byteLength": {length}}}"#));
        self.data.extend(bytes);
        self.views.len() - 1
    }

    /// Adds an accessor over its own view. `more` is added to its JSON.
    fn accessor(&mut self, bytes: &[u8], kind: &str, component: u32, count: usize, more: &str) -> usize {
        let view = self.view(bytes);
        self.accessors.push(format!(
            r#"{{"bufferView": {view}, "componentType": {component}, "type": "{kind}",
            "count": {count}{more}}}"#
        ));
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, &format!("VEC{N}"), 5126, values.len(), "")
    }

    fn corners(&mut self) -> usize {
        self.floats(&CORNERS.map(|c| c.to_array()))
    }

    /// Returns the JSON. `uri` is the JSON of the buffer's URI.
    fn json(&self, uri: &str, rest: &str) -> String {
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": {}{uri}}}], "bufferViews": [{}],
            "accessors": [{}], {rest}}}"#,
            self.data.len(),
            self.views.join(","),
            self.accessors.join(",")
        )
    }

    fn read(&self, rest: &str) -> Result<MeshFile> {
        let uri =
            format!(r#", "uri": "data:application/gltf-buffer;base64,{}""#, STANDARD.encode(&self.data));
        read_file("a.gltf", self.json(&uri, rest).as_bytes(), &[])
    }

    fn mesh(&self, primitives: &str) -> MeshFile {
        let rest = format!(r#""meshes": [{{"primitives": [{primitives}]}}], "nodes": [{{"mesh": 0}}]"#);
        self.read(&rest).unwrap()
    }
}

#[test]
fn indices_of_8_16_and_32_bits_strips_fans_and_no_indices() {
    let list = [0u32, 1, 2, 0, 2, 3];
    let strip = [1u32, 2, 0, 3];
    let fan = [0u32, 1, 2, 3];
    for (indices, mode) in [(&list[..], 4), (&strip[..], 5), (&fan[..], 6)] {
        for (component, size) in [(5121, 1), (5123, 2), (5125, 4)] {
            let mut f = Gltf::default();
            let p = f.corners();
            let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()[..size].to_vec()).collect();
            let i = f.accessor(&bytes, "SCALAR", component, indices.len(), "");
            let file =
                f.mesh(&format!(r#"{{"attributes": {{"POSITION": {p}}}, "indices": {i}, "mode": {mode}}}"#));
            assert_eq!(triangles(&file.mesh), square(), "{component}, mode {mode}");
            assert!(file.warnings.is_empty());
        }

        let mut f = Gltf::default();
        let corners: Vec<[f32; 3]> = indices.iter().map(|&i| CORNERS[i as usize].to_array()).collect();
        let p = f.floats(&corners);
        let file = f.mesh(&format!(r#"{{"attributes": {{"POSITION": {p}}}, "mode": {mode}}}"#));
        assert_eq!(triangles(&file.mesh), square(), "no indices, mode {mode}");
    }
}

#[test]
fn sparse_and_quantized_positions() {
    // All corners are at the origin, except for three sparse ones.
    let mut f = Gltf::default();
    let places = f.view(&[1, 2, 3]);
    let values: Vec<u8> = CORNERS[1..]
        .iter()
        .flat_map(|c| c.to_array())
        .flat_map(f32::to_le_bytes)
        .collect();
    let values = f.view(&values);
    f.accessors.push(format!(
        r#"{{"componentType": 5126, "type": "VEC3", "count": 4, "sparse": {{"count": 3,
        "indices": {{"bufferView": {places}, "componentType": 5121}},
        "values": {{"bufferView": {values}}}}}}}"#
    ));
    let i = f.accessor(&[0, 1, 2, 0, 2, 3], "SCALAR", 5121, 6, "");
    let file = f.mesh(&format!(r#"{{"attributes": {{"POSITION": 0}}, "indices": {i}}}"#));
    assert_eq!(triangles(&file.mesh), square());

    // KHR_mesh_quantization: positions of 8 or 16 bits, scaled back by the node.
    for (component, normalized, whole) in [(5122u32, true, 32_767i32), (5123, false, 1000), (5120, true, 127)]
    {
        let mut f = Gltf::default();
        let size = if component == 5120 { 1 } else { 2 };
        let numbers = CORNERS
            .iter()
            .flat_map(|c| [c.x, c.y, c.z, 0.0])
            .map(|v| v as i32 * whole);
        let bytes: Vec<u8> = numbers.flat_map(|n| n.to_le_bytes()[..size].to_vec()).collect();
        let p = f.accessor(&bytes, "VEC3", component, 4, &format!(r#", "normalized": {normalized}"#));
        f.views[0] =
            f.views[0].replace("\"buffer\": 0", &format!("\"buffer\": 0, \"byteStride\": {}", 4 * size));
        let i = f.accessor(&[0, 1, 2, 0, 2, 3], "SCALAR", 5121, 6, "");
        let scale = if normalized { 1.0 } else { 1.0 / f64::from(whole) };
        let file = f
            .read(&format!(
                r#""extensionsRequired": ["KHR_mesh_quantization"], "nodes": [{{"mesh": 0, "scale": [{scale},
                {scale}, {scale}]}}],
                "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}}}, "indices": {i}}}]}}]"#
            ))
            .unwrap();
        assert_eq!(triangles(&file.mesh), square(), "{component}");
    }
}

#[test]
fn nested_and_mirroring_nodes_and_instances() {
    let mut f = Gltf::default();
    let p = f.corners();
    let i = f.accessor(&[0, 1, 2, 0, 2, 3], "SCALAR", 5121, 6, "");

    // Four instances of the square: as it is; mirrored twice in x, so that it stays; mirrored once, so that
    // it lies beside and still faces +Z; turned by half about Z with a matrix, below a node that moves it.
    // Then a second mesh of two primitives.
    let file = f
        .read(&format!(
            r#""meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}}}, "indices": {i}}}]}},
            {{"primitives": [{{"attributes": {{"POSITION": {p}}}}}, {{"attributes": {{"POSITION": {p}}},
            "indices": {i}}}]}}],
            "nodes": [{{"scale": [-1, 1, 1], "children": [1, 2]}}, {{"mesh": 0, "scale": [-1, 1, 1],
            "translation": [-10, 0, 0]}},
            {{"mesh": 0}}, {{"translation": [30, 0, 0], "children": [4]}},
            {{"mesh": 0, "matrix": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}}, {{"mesh": 1,
            "translation": [0, 0, 9]}}],
            "scenes": [{{"nodes": [0, 3, 5]}}], "scene": 0"#
        ))
        .unwrap();

    let mesh = &file.mesh;
    let lows: Vec<Vec3> = [0, 2, 4, 6]
        .map(|f| mesh.triangle(f).into_iter().reduce(Vec3::min).unwrap())
        .to_vec();
    assert_eq!(
        lows,
        [vec3(10.0, 0.0, 0.0), vec3(-1.0, 0.0, 0.0), vec3(29.0, -1.0, 0.0), vec3(0.0, 0.0, 9.0)]
    );
    assert!((0..mesh.faces().len() as u32).all(|f| mesh.normal(f) == Vec3::Z));
    // The first primitive has four vertices and no indices: one triangle, which repeats a triangle of the
    // second primitive.
    assert_eq!((mesh.faces().len(), file.repeated_faces), (8, 1));
    assert!(file.warnings.iter().any(|w| w.contains("1 corner too many")), "{:?}", file.warnings);
}

#[test]
fn vertex_colours_of_every_type() {
    let linear = [[1.0f32, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.5]];
    for alpha in [false, true] {
        let kind = if alpha { "VEC4" } else { "VEC3" };
        let width = if alpha { 4 } else { 3 };
        for component in [5121u32, 5123, 5126] {
            let mut f = Gltf::default();
            let p = f.corners();
            let i = f.accessor(&[0, 1, 2, 0, 2, 3], "SCALAR", 5121, 6, "");
            let numbers = linear
                .iter()
                .flat_map(|c| [c[0], c[1], c[2], 0.25].into_iter().take(width));
            let bytes: Vec<u8> = numbers
                .flat_map(|v| match component {
                    5121 => vec![(v * 255.0).round() as u8],
                    5123 => ((v * 65_535.0).round() as u16).to_le_bytes().to_vec(),
                    _ => v.to_le_bytes().to_vec(),
                })
                .collect();
            let more = if component == 5126 {
                ""
            } else {
                r#", "normalized": true"#
            };

            let c = f.accessor(&bytes, kind, component, 4, more);
            let file =
                f.mesh(&format!(r#"{{"attributes": {{"POSITION": {p}, "COLOR_0": {c}}}, "indices": {i}}}"#));
            // Half of the light is 188 in sRGB.
            assert_eq!(
                file.mesh.parts().colors,
                [[255, 0, 0], [0, 255, 0], [0, 0, 255], [188; 3]],
                "{kind} of {component}"
            );
        }
    }
}

#[test]
fn buffers_beside_the_file_and_in_it() {
    let mut f = Gltf::default();
    let p = f.corners();
    let i = f.accessor(&[0, 1, 2, 0, 2, 3], "SCALAR", 5121, 6, "");
    let rest = format!(
        r#""meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}}}, "indices": {i}}}]}}],
        "nodes": [{{"mesh": 0}}]"#
    );

    let beside: [(&str, &[u8]); 1] = [("öl & 100% wood.bin", &f.data)];
    for uri in ["%C3%B6l%20&%20100%25%20wood.bin", "öl & 100% wood.bin"] {
        let json = f.json(&format!(r#", "uri": "{uri}""#), &rest);
        let file = read_file("a.gltf", json.as_bytes(), &beside).unwrap();
        assert_eq!(triangles(&file.mesh), square());
        assert!(file.companions.len() == 1 && file.companions[0].ends_with(beside[0].0));
    }

    let mut json = f.json("", &rest);
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let mut glb = b"glTF".to_vec();
    let words = [2, (28 + json.len() + f.data.len()) as u32, json.len() as u32].map(u32::to_le_bytes);
    glb.extend(words.concat());
    glb.extend([b"JSON", json.as_bytes(), &(f.data.len() as u32).to_le_bytes(), b"BIN\0", &f.data].concat());
    let file = read_file("A.GLB", &glb, &[]).unwrap();
    assert_eq!(triangles(&file.mesh), square());
    assert!(file.warnings.is_empty(), "{:?}", file.warnings);
}

/// An extension that is not read is refused by name if a file requires it. The message says what to do.
#[test]
fn compression_is_refused_by_name_with_the_way_out() {
    let refused = |json: String| read_file("a.gltf", json.as_bytes(), &[]).unwrap_err().to_string();
    for (extension, words) in [
        ("KHR_texture_basisu", "gltf-transform ktxdecompress"),
        ("EXT_texture_avif", "gltf-transform png"),
        ("XYZ_new", "export without it"),
    ] {
        let message =
            refused(format!(r#"{{"asset": {{"version": "2.0"}}, "extensionsRequired": ["{extension}"]}}"#));
        assert!(message.contains(&format!("extension {extension}, which is not read; ")), "{message}");
        assert!(message.contains(words), "{message}");
    }

    // The extension is used, but not required. The vertices are nowhere else.
    let message = refused(
        r#"{"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_draco_mesh_compression"],
        "nodes": [{"mesh": 0}],
        "accessors": [{"componentType": 5126, "type": "VEC3", "count": 3}], "meshes": [{"primitives": [
        {"attributes": {"POSITION": 0}, "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0,
        "attributes": {}}}}]}]}"#
            .into(),
    );
    let words = if cfg!(feature = "draco") {
        "KHR_draco_mesh_compression points to buffer view 0, which is not there"
    } else {
        "KHR_draco_mesh_compression, which is not read; export without Draco"
    };
    assert!(message.contains(words), "{message}");

    // A buffer stands for compressed data, but its view is not compressed.
    let message = refused(
        r#"{"asset": {"version": "2.0"}, "extensionsUsed": ["EXT_meshopt_compression"],
        "nodes": [{"mesh": 0}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": 36, "extensions": {"EXT_meshopt_compression": {"fallback": true}}}]}"#
            .into(),
    );
    assert!(message.contains("takes 36 bytes from 0, but buffer 0 has 0"), "{message}");
}

#[test]
fn textures_of_extensions_are_replaced_with_a_warning() {
    let mut f = Gltf::default();
    let p = f.corners();
    let i = f.accessor(&[0, 1, 2, 0, 2, 3], "SCALAR", 5121, 6, "");
    let uv = f.floats(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    for (extension, way_out) in
        [("KHR_texture_basisu", "ktxdecompress"), ("EXT_texture_avif", "gltf-transform png")]
    {
        let file = f
            .read(&format!(
                r#""extensionsUsed": ["{extension}"], "images": [{{"uri": "a.ktx2"}}],
                "textures": [{{"extensions": {{"{extension}": {{"source": 0}}}}}}],
                "materials": [{{"name": "wall", "pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0}},
                "baseColorFactor": [1, 0, 0, 1]}}}}],
                "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}, "TEXCOORD_0": {uv}}},
                "indices": {i}, "material": 0}}]}}],
                "nodes": [{{"mesh": 0}}]"#
            ))
            .unwrap();
        assert!(matches!(file.mesh.color_of(0), FaceColor::Flat([255, 0, 0])));
        let told = &file.warnings[0];
        assert!(told.contains("`wall`") && told.contains(extension) && told.contains(way_out), "{told}");
    }
}

#[test]
fn textures_in_webp_are_read_and_written_as_png() {
    let mut webp = std::io::Cursor::new(Vec::new());
    let image = image::RgbImage::from_pixel(2, 2, image::Rgb([9, 80, 200]));
    image.write_to(&mut webp, image::ImageFormat::WebP).unwrap();
    let webp = STANDARD.encode(webp.into_inner());

    let mut f = Gltf::default();
    let p = f.corners();
    let i = f.accessor(&[0, 1, 2, 0, 2, 3], "SCALAR", 5121, 6, "");
    let uv = f.floats(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    let file = f
        .read(&format!(
            r#""extensionsUsed": ["EXT_texture_webp"], "extensionsRequired": ["EXT_texture_webp"],
            "images": [{{"uri": "data:image/webp;base64,{webp}"}}],
            "textures": [{{"extensions": {{"EXT_texture_webp": {{"source": 0}}}}}}],
            "materials": [{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0}}}}}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}, "TEXCOORD_0": {uv}}},
            "indices": {i}, "material": 0}}]}}],
            "nodes": [{{"mesh": 0}}]"#
        ))
        .unwrap();
    let FaceColor::Texture(_, texture, _) = file.mesh.color_of(0) else { panic!() };
    assert_eq!(texture.image.pixels(), [[9, 80, 200]; 4]);
    assert_eq!((file.texture_files, file.warnings), (vec![None], vec![]));
}

#[test]
fn texture_transforms_and_sets() {
    let png = {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let image = image::RgbImage::from_pixel(1, 1, image::Rgb([9, 8, 7]));
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };

    let mut f = Gltf::default();
    let p = f.corners();
    let i = f.accessor(&[0, 1, 2, 0, 2, 3], "SCALAR", 5121, 6, "");
    // 16-bit normalized coordinates, in the second set.
    let uv: Vec<u8> = [[0u16, 0], [65_535, 0], [65_535, 65_535], [0, 65_535]]
        .as_flattened()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let uv = f.accessor(&uv, "VEC2", 5123, 4, r#", "normalized": true"#);
    let view = f.view(&png);
    let file = f
        .read(&format!(
            r#""images": [{{"bufferView": {view}, "mimeType": "image/png"}}], "textures": [{{"source": 0}}],
            "extensionsUsed": ["KHR_texture_transform"], "extensionsRequired": ["KHR_texture_transform"],
            "materials": [{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0, "texCoord": 0,
            "extensions":
            {{"KHR_texture_transform": {{"texCoord": 1, "offset": [0.25, 0.5], "scale": [0.5,
            0.25]}}}}}}}}}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}, "TEXCOORD_1": {uv}}},
            "indices": {i}, "material": 0}}]}}],
            "nodes": [{{"mesh": 0}}]"#
        ))
        .unwrap();

    let FaceColor::Texture(0, texture, uvs) = file.mesh.color_of(0) else { panic!("{:?}", file.warnings) };
    assert_eq!(texture.image.pixels(), [[9, 8, 7]]);
    let expected: [Vec2; 3] = [vec2(0.25, 0.5), vec2(0.75, 0.5), vec2(0.75, 0.25)];
    assert!(uvs.iter().zip(expected).all(|(a, b)| a.abs_diff_eq(b, 1e-6)), "{uvs:?}");
}

#[test]
fn obj_files_of_every_dialect() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    for (name, obj) in [
        ("plain", format!("{vertices}f 1 2 3\nf 1 3 4\n")),
        ("one polygon", format!("{vertices}f 1 2 3 4\n")),
        ("negative indices", format!("{vertices}f -4 -3 -2\nv 9 9 9\nf -5 -3 -2\n")),
        (
            "mark, CR LF, tabs, continuation",
            format!("\u{feff}{vertices}f 1\t2 \\\r\n  3\r\nf 1 3 4")
                .replace('\n', "\r\n")
                .replace("\r\r", "\r"),
        ),
        ("CR alone", format!("{vertices}f 1 2 3\nf 1 3 4\n").replace('\n', "\r")),
        ("faces before vertices", format!("f 1 2 3\nf 1 3 4\n{vertices}")),
        (
            "groups, comments, smoothing",
            format!("# a\no x y\n{vertices}g a b\ns off\nf 1 2 3 # c\n#f 1 2 4\nf 1 3 4\n"),
        ),
        ("four coordinates", format!("{vertices}f 1 2 3\nf 1 3 4\n").replace("v 1 1 0", "v 2 2 0 2")),
        (
            "normals and coordinates",
            format!("{vertices}vn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3//1\nf 1//1 3/1 4\n"),
        ),
    ] {
        let file = read_file("a b.obj", obj.as_bytes(), &[]).unwrap();
        let mut expected = square();
        if name == "negative indices" {
            // The second face follows another vertex, so −5 is the first vertex again.
            expected = triangles(&file.mesh);
            assert_eq!(file.mesh.faces(), [[0, 1, 2], [0, 2, 3]], "{name}");
        }
        if name == "one polygon" {
            assert_eq!(file.mesh.total_area(), 1.0);
            expected = triangles(&file.mesh);
        }
        assert_eq!(triangles(&file.mesh), expected, "{name}");
        assert!(file.warnings.is_empty(), "{name}: {:?}", file.warnings);
    }
}

#[test]
fn obj_materials_repeated_spaced_and_missing() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n";
    let obj = format!(
        "mtllib my scan (1).mtl\n{vertices}usemtl dark oak\nf 1 2 3\nusemtl wall\nf 1 3 4\n\
         usemtl dark oak\nf 1 2 5\nusemtl gone\nf 1 4 5\n"
    );
    let library: (&str, &[u8]) = ("my scan (1).mtl", b"newmtl dark oak\nKd 1 0 0\nnewmtl wall\nKd 0 1 0\n");

    let file = read_file("a.obj", obj.as_bytes(), &[library]).unwrap();
    let names: Vec<&str> = file.mesh.materials().iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["dark oak", "wall", "gone"]);
    let of = |f| file.mesh.material_of(f).unwrap();
    assert_eq!([of(0), of(1), of(2), of(3)], [0, 1, 0, 2]);
    assert!(matches!(file.mesh.color_of(2), FaceColor::Flat([255, 0, 0])));
    assert_eq!(file.warnings, ["1 material in no library and drawn gray, the first is `gone`"]);

    // The mesh is read even without the library.
    let file = read_file("a.obj", obj.as_bytes(), &[]).unwrap();
    assert_eq!(file.mesh.faces().len(), 4);
    assert!(file.warnings[0].contains("my scan (1).mtl"), "{:?}", file.warnings);
    // Ordinary materials are no labels.
    assert_eq!(MeshLabels::from_materials(&file.mesh, &Default::default()), None);
}

/// The published areas have labels as the names of materials, which alternate.
#[test]
fn a_published_semantic_obj_has_labels() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n";
    let obj = format!(
        "mtllib semantic.mtl\n{vertices}usemtl chair_3_office_5_1\nf 1 2 3\n\
         usemtl <UNK>_0_<UNK>_0_0\nf 1 3 4\n\
         usemtl wall_10_hallway_2_1\nf 1 1 2\nf 1 2 5\nusemtl chair_3_office_5_1\nf 1 4 5\n"
    );
    let file = read_file("semantic.obj", obj.as_bytes(), &[]).unwrap();
    let (labels, warnings) = MeshLabels::from_materials(&file.mesh, &Default::default()).unwrap();
    let MeshLabels::Names { labels, faces } = labels else { panic!("{labels:?}") };
    let names: Vec<String> = labels.iter().map(ToString::to_string).collect();
    assert_eq!(names, ["chair_3_office_5_1", "wall_10_hallway_2_1"]);
    // The face without area is left out with its label.
    assert_eq!(faces, [0, u32::MAX, 1, 0]);
    assert!(warnings.is_empty());
}

/// PLY meshes that other libraries wrote with the columns of known data sets. The README beside them tells
/// how they were made.
#[test]
fn ply_files_of_other_libraries_with_the_columns_of_data_sets() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/ply");
    let faces: Vec<i64> = (0..12).collect();
    let halves = |f: fn(i64) -> i64| faces.iter().map(|&i| f(i / 2)).collect::<Vec<i64>>();
    let of_faces = LabelElement::Face;
    type Labels = Option<(LabelElement, [Option<(&'static str, Vec<i64>)>; 2])>;
    let expected: [(&str, Labels); 6] = [
        (
            "matterport_region.ply",
            Some((of_faces, [Some(("category_id", halves(|i| i - 1))), Some(("segment_id", faces.clone()))])),
        ),
        ("replica_semantic.ply", Some((of_faces, [None, Some(("object_id", halves(|i| i * 10)))]))),
        (
            "scannet_labels.ply",
            Some((LabelElement::Vertex, [Some(("label", vec![1, 1, 1, 1, 2, 2, 2, 40])), None])),
        ),
        ("trimesh_face_labels.ply", Some((of_faces, [Some(("label", halves(|i| i))), None]))),
        ("open3d_ascii.ply", None),
        ("open3d_binary.ply", None),
    ];

    for (name, expected) in expected {
        let file = read_mesh(&folder.join(name), UpAxis::Z).unwrap();
        let mesh = &file.mesh;
        assert_eq!((mesh.positions().len(), mesh.faces().len()), (8, 12), "{name}");
        assert!((mesh.total_area() - 2.0 * (6.0 + 7.5 + 5.0)).abs() < 1e-5, "{name}");
        // All sides face outwards, and the colours belong to the corners.
        assert!((0..12).all(|f| {
            let middle: Vec3 = mesh.triangle(f).iter().sum::<Vec3>() / 3.0;
            mesh.normal(f).dot(middle - vec3(1.5, 1.0, 1.25)) > 0.0
        }));
        for (position, color) in mesh.positions().iter().zip(&mesh.parts().colors) {
            let expected = (*position / vec3(3.0, 2.0, 2.5) * 255.0).as_u8vec3().to_array();
            assert_eq!(*color, expected, "{name}");
        }

        let found = file.labels.as_ref().map(|labels| match labels {
            MeshLabels::Numbers { element, class, instance } => {
                let column = |c: &Option<LabelColumn>| c.clone().map(|c| (c.name, c.values));
                (*element, [column(class), column(instance)])
            }
            names => panic!("{names:?}"),
        });
        let expected = expected.map(|(e, columns)| (e, columns.map(|c| c.map(|(n, v)| (n.to_owned(), v)))));
        assert_eq!(found, expected, "{name}");
        assert!(file.warnings.is_empty(), "{name}: {:?}", file.warnings);
    }

    // The parts of the over-segmentation can be asked for.
    let options = MeshOptions { instance_column: Some("material_id".into()), ..MeshOptions::default() };
    let file = read_mesh_with(&folder.join("matterport_region.ply"), UpAxis::Z, &options).unwrap();
    let Some(MeshLabels::Numbers { instance: Some(instance), class: Some(_), .. }) = file.labels else {
        panic!()
    };
    assert_eq!(instance.values, [0; 12]);
}
