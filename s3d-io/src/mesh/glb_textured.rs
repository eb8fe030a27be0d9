//! Writes a mesh with its textures as a GLB file.

#![expect(clippy::indexing_slicing, reason = "a writer: keys of JSON objects are its own")]

use super::glb::{F32, Glb, plain};
use super::glb_labels;
use super::gltf::linear_from_srgb;
use crate::error::Result;
use crate::fs::write_whole;
use crate::image::compression::Compression;
use crate::image::png::{Content, encode_rgb8};
use s3d_geom::glam::{Vec2, Vec3};
use s3d_geom::{FaceColor, NO_INDEX, Texture, TriMesh, Wrap};
use s3d_label::LabelTable;
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Where the colour of a face comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Paint {
    /// The texture with this number.
    Texture(u32),
    /// The colours of its vertices.
    Corners,
    /// One colour, sRGB.
    Flat([u8; 3]),
}

/// Writes a mesh with its textures as a GLB file. Textures become PNG images within the file. Faces are seen
/// from both sides, as in the images of a data set. Normals of corners are left out. The file appears whole
/// or not at all. Returns its size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io), also for a mesh of more than 4 GiB, which the format cannot hold.
pub fn write_textured_glb(path: &Path, mesh: &TriMesh) -> Result<u64> {
    write(path, mesh, None)
}

/// Writes a mesh with its textures and the labels of its faces as a GLB file, else like
/// [`write_textured_glb`]. `label_of_face` has indices into `table`.
///
/// The labels are features: each vertex has the index of its label (EXT_mesh_features, where 0 is the null
/// feature), and row N of a property table (EXT_structural_metadata) has the name, class and room of label N
/// as texts, and N itself as `instance`. Viewers that know neither show the textured mesh. [`read_mesh`]
/// gives the objects back.
///
/// # Errors
/// Like [`write_textured_glb`].
///
/// # Panics
/// If `label_of_face` has not one entry per face.
///
/// [`read_mesh`]: crate::mesh::read_mesh
pub fn write_labelled_glb(
    path: &Path,
    mesh: &TriMesh,
    label_of_face: &[u32],
    table: &LabelTable,
) -> Result<u64> {
    assert_eq!(label_of_face.len(), mesh.faces().len(), "one label per face");
    write(path, mesh, Some((label_of_face, table)))
}

fn write(path: &Path, mesh: &TriMesh, labels: Option<(&[u32], &LabelTable)>) -> Result<u64> {
    let Columns { positions, uvs, colors, labels: label_of_vertex, corners } =
        columns(mesh, labels.map(|(of_face, _)| of_face));
    write_whole(path, |w| {
        let mut glb = Glb::default();
        let position = glb.positions(&positions);
        let mut texture_coordinates = None;
        if corners.keys().any(|paint| matches!(paint, Paint::Texture(_))) {
            let downwards = uvs.iter().flat_map(|uv| [uv.x, 1.0 - uv.y]);
            let count = uvs.len() as u32;
            texture_coordinates = Some(glb.column([F32, count], "VEC2", downwards.map(f32::to_le_bytes)));
        }
        let color = corners.contains_key(&Paint::Corners).then(|| glb.colors(&colors));
        let label = labels.map(|_| glb_labels::add_ids(&mut glb, &label_of_vertex));

        let mut primitives = Vec::new();
        let mut materials = Vec::new();
        for (paint, indices) in &corners {
            let mut attributes = json!({ "POSITION": position });
            let mut material = plain();
            match paint {
                Paint::Texture(texture) => {
                    attributes["TEXCOORD_0"] = json!(texture_coordinates);
                    material["baseColorTexture"] = json!({ "index": texture });
                }
                Paint::Corners => attributes["COLOR_0"] = json!(color),
                Paint::Flat(color) => {
                    let [r, g, b] = color.map(linear_from_srgb);
                    material["baseColorFactor"] = json!([r, g, b, 1.0]);
                }
            }
            if label.is_some() {
                attributes[glb_labels::ATTRIBUTE] = json!(label);
            }
            let number = glb.indices(indices);
            let mut primitive =
                json!({ "attributes": attributes, "indices": number, "material": materials.len() });
            if label.is_some() {
                let used = indices.iter().map(|vertex| label_of_vertex[*vertex as usize]);
                primitive["extensions"] = glb_labels::of_primitive(used);
            }
            primitives.push(primitive);
            materials.push(json!({ "pbrMetallicRoughness": material, "doubleSided": true }));
        }

        let mut rest = json!({ "materials": materials });
        add_textures(&mut glb, mesh.textures(), &mut rest);
        if let Some((_, table)) = labels {
            glb_labels::add_table(&mut glb, table, &mut rest);
        }
        glb.write(w, &primitives, &[], rest)
    })
}

/// The vertices of a file, and those of the faces of each paint.
#[derive(Default)]
struct Columns {
    positions: Vec<Vec3>,
    /// (0, 0) at the bottom left.
    uvs: Vec<Vec2>,
    /// Empty if the mesh has none.
    colors: Vec<[u8; 3]>,
    /// Zeros if faces have none.
    labels: Vec<u32>,
    corners: BTreeMap<Paint, Vec<u32>>,
}

/// Gives each vertex with a texture coordinate and a label a vertex of its own.
fn columns(mesh: &TriMesh, label_of_face: Option<&[u32]>) -> Columns {
    let parts = mesh.parts();
    let mut columns = Columns::default();
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
    for (face, corners) in (0..).zip(mesh.faces()) {
        let paint = match mesh.color_of(face) {
            FaceColor::Texture(texture, ..) => Paint::Texture(texture),
            FaceColor::Corners(_) => Paint::Corners,
            FaceColor::Flat(color) => Paint::Flat(color),
        };
        let uvs = match paint {
            Paint::Texture(_) => parts.face_uvs.get(face as usize).copied(),
            _ => None,
        };
        let label = label_of_face.map_or(0, |labels| labels[face as usize]);
        let of_paint = columns.corners.entry(paint).or_default();
        for (vertex, uv) in corners.iter().zip(uvs.unwrap_or([NO_INDEX; 3])) {
            let number = *numbers.entry([*vertex, uv, label]).or_insert_with(|| {
                columns.labels.push(label);
                columns.positions.extend(parts.positions.get(*vertex as usize));
                columns.colors.extend(parts.colors.get(*vertex as usize));
                columns
                    .uvs
                    .push(parts.uvs.get(uv as usize).copied().unwrap_or_default());
                columns.uvs.len() as u32 - 1
            });
            of_paint.push(number);
        }
    }
    columns
}

/// Adds textures, how they go on beyond their edges, and their images. All are numbered as in the mesh.
fn add_textures(glb: &mut Glb, textures: &[Texture], rest: &mut Value) {
    if textures.is_empty() {
        return;
    }
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    };
    let sampler = |texture: &Texture| {
        let [s, t] = texture.wrap.map(wrap);
        json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": s, "wrapT": t })
    };
    let mut image = |texture: &Texture| {
        let png = encode_rgb8(&texture.image, Content::Photo, Compression::default());
        let view = glb.view(None, |all| all.extend(png));
        json!({ "name": texture.name, "mimeType": "image/png", "bufferView": view })
    };
    rest["images"] = textures.iter().map(&mut image).collect();
    rest["samplers"] = textures.iter().map(sampler).collect();
    let of_both = |i| json!({ "source": i, "sampler": i });
    rest["textures"] = (0..textures.len()).map(of_both).collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{UpAxis, read_mesh};
    use s3d_geom::{Material, MeshParts, Raster};

    /// Two faces with a texture, one with colours of its vertices.
    fn mesh(colors: Vec<[u8; 3]>) -> TriMesh {
        let pixels = (0..12).map(|i| [i, 200 - i, 7 * i]).collect();
        let texture = Texture {
            name: "wall.jpg".into(),
            image: Raster::from_vec(4, 3, pixels),
            wrap: [Wrap::Mirror, Wrap::Clamp],
        };
        let material = |texture| Material { name: "m".into(), color: [9, 130, 255], texture };
        TriMesh::new(MeshParts {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, 0.25), Vec3::Z],
            faces: vec![[0, 1, 2], [0, 2, 3], [1, 2, 3]],
            colors,
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::new(0.25, 0.75), Vec2::new(-0.5, 2.0)],
            face_uvs: vec![[0, 1, 2], [3, 2, 1], [NO_INDEX; 3]],
            materials: vec![material(Some(0)), material(None)],
            face_materials: vec![0, 0, 1],
            textures: vec![texture],
            ..MeshParts::default()
        })
        .unwrap()
    }

    #[test]
    fn textures_and_colours_come_back_as_they_were() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.glb");
        for colors in [Vec::new(), vec![[0, 1, 2], [3, 127, 128], [254, 255, 9], [10, 11, 12]]] {
            let mesh = mesh(colors);
            write_textured_glb(&path, &mesh).unwrap();
            let read = read_mesh(&path, UpAxis::Y).unwrap();
            assert_eq!(read.warnings, [""; 0]);
            let read = read.mesh;
            assert_eq!(read.faces().len(), 3);
            for face in 0..3 {
                assert_eq!(read.triangle(face), mesh.triangle(face));
                match (read.color_of(face), mesh.color_of(face)) {
                    (FaceColor::Texture(_, a, uv), FaceColor::Texture(_, b, wanted)) => {
                        assert_eq!((&a.image, a.wrap), (&b.image, b.wrap));
                        assert_eq!(uv, wanted);
                    }
                    (FaceColor::Corners(a), FaceColor::Corners(b)) => assert_eq!(a, b),
                    (FaceColor::Flat(a), FaceColor::Flat(b)) => assert_eq!(a, b),
                    // Colours of vertices hold for all faces of a file that reads them.
                    (FaceColor::Corners(a), FaceColor::Flat(b)) => assert_eq!(a, [b; 3]),
                    other => panic!("{other:?}"),
                }
            }
        }
    }
}
