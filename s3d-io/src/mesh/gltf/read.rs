//! Reads meshes in glTF 2.0 files, `.gltf` and `.glb`.
//!
//! The gltf crate gives the JSON its types. Its import and its validation are not used. The import decodes
//! every image, wanted or not, and panics on wrong ranges. The validation panics on a wrong index, and
//! refuses harmless faults such as a missing bounding box. So every index is checked here before it is
//! followed.

use crate::error::{Error, Result};
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis, checked_mesh};
use crate::mesh::gltf::builder::Builder;
use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::features::{Features, Schema};
use crate::mesh::gltf::material::GltfLooks;
use crate::mesh::gltf::objects::labels_of;
use crate::mesh::gltf::scene::{Instance, Precision, instances};
use crate::mesh::origin::{FileFrame, largest};
use s3d_geom::MeshParts;
use s3d_geom::glam::DVec3;
use std::path::Path;

/// Reads the default scene of a glTF file, or else the first scene that has nodes, or else all nodes that
/// have no parent.
///
/// # Errors
/// Like [`crate::mesh::read_mesh_with`].
pub(crate) fn read_bytes(bytes: Vec<u8>, path: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let frame = FileFrame::new(options.origin, options.units.unwrap_or_default());
    let document = GltfDocument::read(bytes, path, options.outside_files)?;
    let mut warnings = Vec::new();
    let instances = instances(&document, Precision::OfFile, &mut warnings)?;
    let used = used_materials(&document, &instances)?;
    let looks = GltfLooks::load(&document, &used, &mut warnings)?;
    let schema = Schema::read(&document, &mut warnings);
    let features = Features::new(&document, &schema, &mut warnings);

    let build = |instances: &[Instance], offset_m: DVec3| {
        let mut builder =
            Builder::new(&document, &looks, &features, up, instances, frame.in_units(offset_m))?;
        instances.iter().try_for_each(|instance| builder.add(instance))?;
        Ok::<_, Error>(builder)
    };

    let mut offset_m = DVec3::ZERO;
    let mut builder = build(&instances, offset_m)?;
    if frame.needs_exact(largest(builder.positions())) {
        offset_m = frame.offset_m(builder.corners());
        if offset_m != DVec3::ZERO {
            // Only one mesh is in memory at a time. All warnings were given before.
            drop(builder);
            let exact = self::instances(&document, Precision::Exact, &mut Vec::new())?;
            builder = build(&exact, offset_m)?;
        }
    }

    let features = builder.features(&mut warnings);
    let labels = labels_of(&document, builder.node_of_face(), &features);
    let mut parts = builder.finish(&mut warnings);
    parts.face_tags = (0..parts.faces.len() as u32).collect();
    if parts.faces.is_empty() {
        return Err(document.fail(no_triangles(&instances, &warnings)));
    }

    let parts = MeshParts { materials: looks.materials, textures: looks.textures, ..parts };
    let mesh = checked_mesh(parts, frame, &mut warnings)
        .map_err(|source| Error::Mesh { path: path.to_owned(), source })?;

    Ok(MeshFile {
        texture_files: looks.files,
        warnings,
        companions: document.companions(),
        offset_m,
        labels,
        ..MeshFile::new(path, mesh)
    })
}

/// Returns for each material of the file whether an instance uses it.
fn used_materials(document: &GltfDocument, instances: &[Instance]) -> Result<Vec<bool>> {
    let mut used = vec![false; document.root().materials.len()];
    for instance in instances {
        let mesh = document.get(instance.mesh, "a node", "mesh")?;
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            if let Some(material) = primitive.material {
                document.get(material, &format!("mesh {}, primitive {p}", instance.mesh), "material")?;
                used.get_mut(material.value()).into_iter().for_each(|used| *used = true);
            }
        }
    }
    Ok(used)
}

fn no_triangles(instances: &[Instance], warnings: &[String]) -> String {
    let what = if instances.is_empty() { "mesh" } else { "triangle" };
    let why = if warnings.is_empty() {
        String::new()
    } else {
        format!(": {}", warnings.join("; "))
    };
    format!("has no {what} in its scene{why}")
}

#[cfg(test)]
pub(crate) fn read(path: &Path, up: UpAxis) -> Result<MeshFile> {
    read_bytes(crate::fs::open::read_file(path)?, path, up, &MeshOptions::default())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::image::texture::tests::two_pixels;
    use base64::Engine;
    use base64::engine::general_purpose::STANDARD;
    use s3d_geom::glam::{Vec3, vec2, vec3};
    use s3d_geom::{DEFAULT_COLOR, FaceColor, NO_INDEX, Wrap};
    use std::fs;

    /// A file under construction: accessors over one buffer, and the rest of the JSON.
    #[derive(Default)]
    pub(crate) struct Fixture {
        pub(crate) data: Vec<u8>,
        views: Vec<String>,
        pub(crate) accessors: Vec<String>,
    }

    impl Fixture {
        pub(crate) fn view(&mut self, bytes: Vec<u8>) -> usize {
            let offset = self.data.len();
            let length = bytes.len();
            self.data.extend(bytes);
            self.views
                .push(format!(r#"{{"buffer": 0, "byteOffset": {offset}, "byteLength": {length}}}"#));
            self.views.len() - 1
        }

        pub(crate) fn accessor(&mut self, bytes: Vec<u8>, kind: &str, component: u32, count: usize) -> usize {
            let view = self.view(bytes);
            let normalized = if kind == "VEC3" && component == 5121 {
                r#", "normalized": true"#
            } else {
                ""
            };
            self.accessors.push(format!(
                r#"{{"bufferView": {view}, "componentType": {component}, "type": "{kind}",
                "count": {count}{normalized}}}"#
            ));
            self.accessors.len() - 1
        }

        pub(crate) fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
            let bytes = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
            self.accessor(bytes, if N == 2 { "VEC2" } else { "VEC3" }, 5126, values.len())
        }

        pub(crate) fn indices(&mut self, values: &[u16]) -> usize {
            self.accessor(values.iter().flat_map(|v| v.to_le_bytes()).collect(), "SCALAR", 5123, values.len())
        }

        /// A right triangle in the plane z = 0 that faces +Z.
        fn triangle(&mut self) -> usize {
            self.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        }

        pub(crate) fn json(&self, rest: &str) -> String {
            format!(
                r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": {},
                "uri": "data:;base64,{}"}}],
                "bufferViews": [{}], "accessors": [{}], {rest}}}"#,
                self.data.len(),
                STANDARD.encode(&self.data),
                self.views.join(","),
                self.accessors.join(",")
            )
        }

        /// Reads the file, Z-up, so that coordinates stay.
        pub(crate) fn read(&self, rest: &str) -> Result<MeshFile> {
            let dir = tempfile::tempdir().unwrap();
            fs::write(dir.path().join("two words.png"), two_pixels([255, 188, 0], [0, 0, 255])).unwrap();
            let path = dir.path().join("a.gltf");
            fs::write(&path, self.json(rest)).unwrap();
            super::read(&path, UpAxis::Z)
        }

        fn error(&self, rest: &str) -> String {
            self.read(rest).unwrap_err().to_string()
        }

        /// Reads the file, whatever number stands for one of its numbers.
        pub(crate) fn read_with_every_number_changed(&self, rest: &str) {
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join("a.gltf");
            let json = self.json(rest);
            let is_part = |c: char| c.is_ascii_digit();

            let mut at = 0;
            while let Some(start) = json[at..].find(is_part).map(|n| at + n) {
                let end = json[start..].find(|c| !is_part(c)).map_or(json.len(), |n| start + n);
                at = end;
                // Digits in names and data stay.
                if !json[..start].ends_with([' ', '[', ',']) {
                    continue;
                }
                for other in [
                    "0",
                    "1",
                    "3",
                    "99",
                    "4294967295",
                    "4294967296",
                    "18446744073709551615",
                    "-1",
                    "0.5",
                    "1e40",
                ] {
                    let changed = format!("{}{other}{}", &json[..start], &json[end..]);
                    fs::write(&path, changed).unwrap();
                    let _ = super::read(&path, UpAxis::Z);
                }
            }
        }
    }

    #[test]
    fn nodes_place_meshes_and_mirrors_keep_fronts_in_front() {
        let mut f = Fixture::default();
        let p = f.triangle();
        let n = f.floats(&[[0.0, 0.0, 2.0]; 3]);
        let file = f
            .read(&format!(
                r#""meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}, "NORMAL": {n}}}}}]}}],
                "nodes": [{{"mesh": 0, "translation": [5, 0, 0], "children": [1, 2]}},
                {{"mesh": 0, "scale": [-2, 1, 1]}},
                {{"mesh": 0, "rotation": [0, 0.70710678, 0, 0.70710678], "translation": [0, 0, 1]}},
                {{"mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 9,9,9,1]}}],
                "scenes": [{{"nodes": [0]}}], "scene": 0"#
            ))
            .unwrap();

        let mesh = &file.mesh;
        assert_eq!(mesh.faces().len(), 3);
        assert_eq!(mesh.triangle(0), [vec3(5.0, 0.0, 0.0), vec3(6.0, 0.0, 0.0), vec3(5.0, 1.0, 0.0)]);
        assert_eq!(mesh.triangle(1), [vec3(5.0, 0.0, 0.0), vec3(5.0, 1.0, 0.0), vec3(3.0, 0.0, 0.0)]);
        for (face, normal) in [(0, Vec3::Z), (1, Vec3::Z), (2, Vec3::X)] {
            assert!(mesh.normal(face).abs_diff_eq(normal, 1e-6), "{face}: {}", mesh.normal(face));
            assert!(mesh.corner_normals(face).unwrap()[0].abs_diff_eq(normal, 1e-6));
        }
        assert!(mesh.triangle(2)[1].abs_diff_eq(vec3(5.0, 0.0, 0.0), 1e-6), "{}", mesh.triangle(2)[1]);
        assert!(mesh.triangle(2)[0].abs_diff_eq(vec3(5.0, 0.0, 1.0), 1e-6));
    }

    #[test]
    fn without_a_scene_all_roots_count_and_y_is_up() {
        let mut f = Fixture::default();
        let p = f.triangle();
        let json = f.json(&format!(
            r#""meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}}}}}]}}],
            "nodes": [{{"children": [1]}}, {{"mesh": 0}}, {{"mesh": 0}}]"#
        ));
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.gltf");
        fs::write(&path, json).unwrap();
        let mesh = super::read(&path, UpAxis::Y).unwrap().mesh;
        assert_eq!(mesh.faces().len(), 2);
        assert_eq!(mesh.triangle(0)[2], Vec3::Z);
        assert_eq!(mesh.normal(0), -Vec3::Y);
    }

    #[test]
    fn strips_fans_and_shared_vertices() {
        let mut f = Fixture::default();
        let p = f.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
        let strip = f.indices(&[0, 1, 2, 3]);
        let fan = f.indices(&[0, 1, 3, 2]);
        let points = f.indices(&[0]);
        let list = f.accessor(vec![0, 1, 3, 2], "SCALAR", 5121, 4);
        let primitive = |indices: usize, mode: u32| {
            format!(r#"{{"attributes": {{"POSITION": {p}}}, "indices": {indices}, "mode": {mode}}}"#)
        };
        let primitives =
            [primitive(strip, 5), primitive(fan, 6), primitive(list, 4), primitive(points, 0)].join(",");

        let file = f
            .read(&format!(r#""meshes": [{{"primitives": [{primitives}]}}], "nodes": [{{"mesh": 0}}]"#))
            .unwrap();
        assert_eq!(file.mesh.positions().len(), 4);
        assert_eq!(file.mesh.faces(), [[0, 1, 2], [1, 3, 2], [1, 3, 0], [3, 2, 0], [0, 1, 3]]);
        assert!((0..5).all(|i| file.mesh.normal(i) == Vec3::Z));
        let told = file.warnings.join("\n");
        assert!(
            told.contains("1 primitive without triangles") && told.contains("1 corner too many"),
            "{told}"
        );
    }

    const IMAGES: &str = r#""images": [{"uri": "two%20words.png"}, {"uri": "gone.jpg"}],
        "samplers": [{"wrapS": 33071, "wrapT": 33648}],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1},
        {"extensions": {"KHR_texture_basisu": {"source": 0}}}]"#;

    fn textured(i: u32, more: &str) -> String {
        format!(
            r#"{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": {i}{more}}},
                    "baseColorFactor": [1, 1, 1, 1]}}}}"#
        )
    }

    #[test]
    fn textures_factors_and_fallbacks() {
        let mut f = Fixture::default();
        let p = f.triangle();
        let uv = f.floats(&[[0.0, 0.0], [1.0, 0.0], [0.0, 0.75]]);
        let materials = [
            textured(0, ""),
            textured(0, "").replace("[1, 1, 1, 1]", "[0.5, 1, 0, 1]"),
            textured(1, "").replace("[1, 1, 1, 1]", "[0.5, 0, 0, 1]"),
            textured(2, ""),
            textured(0, r#", "texCoord": 1"#),
            textured(
                0,
                r#", "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2,
            1]}}"#,
            ),
            r#"{"name": "old", "extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0, 1,
            0, 1]}}}"#
                .into(),
        ];
        let primitive = |m: usize| {
            format!(r#"{{"attributes": {{"POSITION": {p}, "TEXCOORD_0": {uv}}}, "material": {m}}}"#)
        };

        let primitives: Vec<String> = (0..materials.len()).map(primitive).collect();
        let file = f
            .read(&format!(
                r#"{IMAGES}, "materials": [{}], "meshes": [{{"primitives": [{}]}}],
                "nodes": [{{"mesh": 0}}]"#,
                materials.join(","),
                primitives.join(",")
            ))
            .unwrap();

        let mesh = &file.mesh;
        let FaceColor::Texture(0, texture, uvs) = mesh.color_of(0) else { panic!("{:?}", mesh.color_of(0)) };
        assert_eq!((texture.name.as_str(), texture.wrap), ("two words.png", [Wrap::Clamp, Wrap::Mirror]));
        assert_eq!(uvs, [vec2(0.0, 1.0), vec2(1.0, 1.0), vec2(0.0, 0.25)]);
        assert_eq!(file.texture_files[0].as_ref().unwrap().extension, "png");
        let FaceColor::Texture(1, texture, _) = mesh.color_of(1) else { panic!("{:?}", mesh.color_of(1)) };
        assert_eq!(texture.image.pixels(), [[188, 188, 0], [0, 0, 0]]);
        assert_eq!(file.texture_files[1], None);
        assert!(matches!(mesh.color_of(2), FaceColor::Flat([188, 0, 0])));
        assert!(matches!(mesh.color_of(3), FaceColor::Flat([255, 255, 255])));
        assert!(matches!(mesh.color_of(4), FaceColor::Flat([255, 255, 255])));
        let FaceColor::Texture(0, _, uvs) = mesh.color_of(5) else { panic!("{:?}", mesh.color_of(5)) };
        assert_eq!(uvs[1], vec2(2.5, 1.0));
        assert!(matches!(mesh.color_of(6), FaceColor::Flat([0, 255, 0])));
        assert_eq!(mesh.materials()[6].name, "old");

        let told = file.warnings.join("\n");
        for words in [
            "`gone.jpg` cannot be read",
            "only one for the extension KHR_texture_basisu",
            "1 primitive without the coordinates",
        ] {
            assert!(told.contains(words), "{told}");
        }
    }

    #[test]
    fn vertex_colours_are_light() {
        let mut f = Fixture::default();
        let p = f.triangle();
        let c = f.accessor(vec![255, 0, 128, 0, 0, 0, 255, 255, 255], "VEC3", 5121, 3);
        let file = f
            .read(&format!(
                r#""materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [0.5, 1, 1, 1]}}}}],
                "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}, "COLOR_0": {c}}}}},
                {{"attributes": {{"POSITION": {p}, "COLOR_0": {c}}}, "material": 0}},
                {{"attributes": {{"POSITION": {p}}}, "material": 0}},
                {{"attributes": {{"POSITION": {p}}}}}]}}],
                "nodes": [{{"mesh": 0}}]"#
            ))
            .unwrap();
        let corners = |face| match file.mesh.color_of(face) {
            FaceColor::Corners(c) => c,
            other => panic!("{other:?}"),
        };
        assert_eq!(corners(0), [[255, 0, 188], [0; 3], [255; 3]]);
        assert_eq!(corners(1), [[188, 0, 188], [0; 3], [188, 255, 255]]);
        assert_eq!(corners(2), [[188, 255, 255]; 3]);
        assert_eq!(corners(3), [DEFAULT_COLOR; 3]);
        assert_eq!(file.mesh.material_of(3), None);
        assert_eq!(file.mesh.parts().face_materials, [NO_INDEX, 0, 0, NO_INDEX]);
    }

    fn mesh_of(primitive: &str) -> String {
        format!(
            r#"{IMAGES},
                    "materials": [{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0}}}}}}],
                    "meshes": [{{"name": "box", "primitives": [{{{primitive}}}]}}], "nodes": [{{"mesh": 0}}]"#
        )
    }

    #[test]
    fn every_wrong_index_and_number_is_named() {
        let mut f = Fixture::default();
        let p = f.triangle();
        let bad = f.floats(&[[0.0; 3], [f32::INFINITY, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let uv = f.floats(&[[0.0; 2]; 2]);
        let i = f.indices(&[0, 1, 2]);
        let beyond = f.indices(&[0, 1, 3]);
        for (primitive, words) in [
            (
                format!(r#""attributes": {{"POSITION": {p}}}, "indices": {beyond}"#),
                "mesh 0 `box`, primitive 0: index 3, but there are 3",
            ),
            (
                format!(r#""attributes": {{"POSITION": {bad}}}, "indices": {i}"#),
                "vertex 1 is not finite: [inf, 0, 0]",
            ),
            (
                format!(r#""attributes": {{"POSITION": {p}, "NORMAL": 99}}"#),
                "primitive 0 points to accessor 99",
            ),
            (r#""attributes": {"POSITION": 99}"#.into(), "points to accessor 99"),
            (format!(r#""attributes": {{"POSITION": {p}}}, "indices": 99"#), "points to accessor 99"),
            (format!(r#""attributes": {{"POSITION": {p}}}, "material": 99"#), "points to material 99"),
            (format!(r#""attributes": {{"POSITION": {p}}}, "mode": 9"#), "unknown mode"),
            (format!(r#""attributes": {{"POSITION": {uv}}}"#), "2 numbers an element, not 3"),
            (
                format!(r#""attributes": {{"POSITION": {p}, "TEXCOORD_0": {uv}}}, "material": 0"#),
                "2 elements of TEXCOORD_0 for 3 vertices",
            ),
            (format!(r#""attributes": {{"POSITION": {p}}}, "indices": {p}"#), "single unsigned integers"),
            (r#""attributes": {"NORMAL": 0}"#.into(), "no triangle in its scene"),
        ] {
            let message = f.error(&mesh_of(&primitive));
            assert!(message.contains(words), "{words}: {message}");
        }
        // A vertex that no triangle uses may have any coordinates.
        let two = f.indices(&[0, 2, 2, 2, 0, 0]);
        assert!(
            f.error(&mesh_of(&format!(r#""attributes": {{"POSITION": {bad}}}, "indices": {two}"#)))
                .contains("no face with an area")
        );
    }

    #[test]
    fn scenes_that_are_no_trees_are_refused() {
        let f = Fixture::default();
        for (rest, words) in [
            (
                r#""scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"children": [1]}, {"children": [0]}]"#,
                "node 0 is in the scene twice",
            ),
            (r#""nodes": [{"children": [0]}]"#, "no mesh in its scene"),
            (
                r#""scenes": [{"nodes": [0, 1]}], "nodes": [{"children": [2]}, {"children": [2]}, {}]"#,
                "node 2 is in the scene twice",
            ),
            (r#""scene": 4, "scenes": []"#, "the file points to scene 4"),
            (r#""nodes": [{"children": [7]}]"#, "the scene points to node 7"),
            (r#""nodes": [{"mesh": 7}]"#, "a node points to mesh 7"),
            (r#""nodes": [{"rotation": [0, 0, 0, 0]}]"#, "node 0 has a transform"),
            (r#""nodes": [{"scale": [1e39, 1, 1]}]"#, "line 3: is no valid glTF 2.0: number out of range"),
        ] {
            let message = f.error(rest);
            assert!(message.contains(words), "{words}: {message}");
        }
    }

    #[test]
    fn vertices_that_only_an_extension_has_are_refused_by_its_name() {
        let mut f = Fixture::default();
        f.accessors
            .push(r#"{"componentType": 5126, "type": "VEC3", "count": 3}"#.into());
        let message = f.error(
            r#""meshes": [{"primitives": [{"attributes": {"POSITION": 0},
            "extensions": {"KHR_draco_mesh_compression": {}}}]}],
            "nodes": [{"mesh": 0}]"#,
        );
        assert!(message.contains("extension KHR_draco_mesh_compression"), "{message}");
    }

    /// Any number in a file may be replaced by another: the file is read or refused.
    #[test]
    fn wrong_numbers_anywhere_do_no_harm() {
        let mut f = Fixture::default();
        let p = f.triangle();
        let uv = f.floats(&[[0.0; 2]; 3]);
        let i = f.indices(&[0, 1, 2]);
        let rest = format!(
            r#"{IMAGES}, "materials": [{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0,
            "texCoord": 0}}}}}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {p}, "TEXCOORD_0": {uv}, "NORMAL": {p},
            "COLOR_0": {p}}},
            "indices": {i}, "material": 0, "mode": 4}}]}}], "nodes": [{{"mesh": 0, "skin": 0}}],
            "scenes": [{{"nodes": [0]}}], "scene": 0"#
        );

        assert!(f.read(&rest).is_ok());
        f.read_with_every_number_changed(&rest);
    }
}
