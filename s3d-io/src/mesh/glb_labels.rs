//! Labels of faces in a GLB file: features of EXT_mesh_features, and their table by EXT_structural_metadata.
//!
//! Sources: the READMEs and schemas of the two extensions (CesiumGS/glTF, branches proposal-EXT_mesh_features
//! and proposal-EXT_structural_metadata), and for the bytes of a table CesiumGS/3d-tiles,
//! specification/Metadata.

#![expect(clippy::indexing_slicing, reason = "a writer: keys of JSON objects are its own")]

use super::glb::{F32, Glb};
use super::gltf::words::{MESH_FEATURES, METADATA};
use s3d_label::{LabelId, LabelTable};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// The attribute that has the label of a vertex.
pub(super) const ATTRIBUTE: &str = "_FEATURE_ID_0";

/// The name of the table's class in the schema.
const CLASS: &str = "object";

/// Adds the labels of vertices. Returns the number of their column. They are floats, for glTF has no vertices
/// with whole numbers of 32 bits.
pub(super) fn add_ids(glb: &mut Glb, labels: &[u32]) -> usize {
    let numbers = labels.iter().map(|label| (*label as f32).to_le_bytes());
    glb.column([F32, labels.len() as u32], "SCALAR", numbers)
}

/// Returns what a primitive says of its labels: their column is [`ATTRIBUTE`], and label 0 is none.
pub(super) fn of_primitive(labels: impl Iterator<Item = u32>) -> Value {
    let used: BTreeSet<u32> = labels.filter(|label| *label != 0).collect();
    let ids = json!({
        "featureCount": used.len(), "nullFeatureId": 0, "attribute": 0, "propertyTable": 0, "label": "object"
    });
    json!({ MESH_FEATURES: { "featureIds": [ids] } })
}

/// Adds the table of labels: row N is label N.
pub(super) fn add_table(glb: &mut Glb, table: &LabelTable, rest: &mut Value) {
    let ids: Vec<LabelId> = (0..table.len() as u32).map(LabelId).collect();
    let text = |of: &dyn Fn(LabelId) -> Option<String>| -> Vec<String> {
        ids.iter().map(|id| of(*id).unwrap_or_default()).collect()
    };
    let label = |id| table.get(id);
    let columns = [
        (
            "name",
            "the label of the data set: class_instance_roomtype_room_area",
            text(&|id| Some(table.name_of(id))),
        ),
        ("class", "the class", text(&|id| Some(label(id)?.class.to_string()))),
        ("room", "the room", text(&|id| Some(label(id)?.room.to_string()))),
    ];

    let mut properties = json!({
        "instance": {
            "description": "the index of the label in assets/semantic_labels.json",
            "type": "SCALAR", "componentType": "UINT32", "required": true
        }
    });
    let numbers = glb.aligned_view(ids.iter().flat_map(|id| id.0.to_le_bytes()));
    let mut values = json!({ "instance": { "values": numbers } });
    for (name, description, texts) in columns {
        properties[name] = json!({ "description": description, "type": "STRING", "required": true });
        values[name] = add_texts(glb, &texts);
    }

    let schema = json!({ "id": "s3d", "classes": { CLASS: { "name": CLASS, "properties": properties } } });
    let rows = json!({ "name": "labels", "class": CLASS, "count": ids.len(), "properties": values });
    rest["extensionsUsed"] = json!([MESH_FEATURES, METADATA]);
    rest["extensions"] = json!({ METADATA: { "schema": schema, "propertyTables": [rows] } });
}

/// Adds a column of texts: their bytes one after the other, and where each begins.
fn add_texts(glb: &mut Glb, texts: &[String]) -> Value {
    let values = glb.aligned_view(texts.iter().flat_map(|text| text.bytes()));
    let mut ends = vec![0_u32];
    ends.extend(texts.iter().scan(0, |end, text| {
        *end += text.len() as u32;
        Some(*end)
    }));
    let offsets = glb.aligned_view(ends.iter().flat_map(|end| end.to_le_bytes()));
    json!({ "values": values, "stringOffsets": offsets, "stringOffsetType": "UINT32" })
}

#[cfg(test)]
mod tests {
    use crate::cloud::{AnnotationOptions, Annotations};
    use crate::mesh::{MeshLabels, UpAxis, read_mesh, write_labelled_glb};
    use s3d_geom::glam::{Vec2, Vec3};
    use s3d_geom::{FaceColor, Material, MeshParts, NO_INDEX, Raster, Texture, TriMesh, Wrap};
    use s3d_label::LabelTable;

    fn mesh() -> TriMesh {
        let image = Raster::from_vec(4, 3, (0..12).map(|i| [i, 200 - i, 7 * i]).collect());
        let texture = Texture { name: "wall.jpg".into(), image, wrap: [Wrap::Repeat; 2] };
        let material = |texture| Material { name: "m".into(), color: [9, 130, 255], texture };
        TriMesh::new(MeshParts {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, 0.25), Vec3::Z],
            faces: vec![[0, 1, 2], [0, 2, 3], [1, 2, 3], [0, 3, 1]],
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::new(0.25, 0.75)],
            face_uvs: vec![[0, 1, 2], [2, 2, 1], [0, 0, 1], [NO_INDEX; 3]],
            materials: vec![material(Some(0)), material(None)],
            face_materials: vec![0, 0, 0, 1],
            textures: vec![texture],
            ..MeshParts::default()
        })
        .unwrap()
    }

    #[test]
    fn labels_and_textures_come_back_as_they_were() {
        let names = ["<UNK>_0_<UNK>_0_0", "chair_1_office_5_1", "chair_2_office_6_1", "wall_1_hallway_1_1"];
        let table = LabelTable::from_names(&names.map(String::from)).unwrap();
        let mesh = mesh();
        // The faces of the texture share vertices, and have three labels and none.
        let label_of_face = [3, 1, 0, 2];
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("semantic.glb");
        write_labelled_glb(&path, &mesh, &label_of_face, &table).unwrap();

        let read = read_mesh(&path, UpAxis::Y).unwrap();
        assert_eq!(read.warnings, [""; 0]);
        let Some(MeshLabels::Objects { objects, faces, are_names }) = &read.labels else {
            panic!("{:?}", read.labels)
        };
        assert!(!are_names);
        for (face, label) in (0..4).zip(label_of_face) {
            // Faces are in the order of their materials.
            assert_eq!(read.mesh.triangle(face), mesh.triangle(face));
            match objects.get(faces[face as usize] as usize) {
                None => assert_eq!(label, 0),
                Some(object) => {
                    let expected = table.get(s3d_label::LabelId(label)).unwrap();
                    assert_eq!(object.class, expected.class.to_string());
                    let room = object.room.as_ref().and_then(|room| room.name.clone());
                    assert_eq!(room, Some(expected.room.to_string()));
                }
            }
        }
        let annotations = Annotations::of_mesh(&read, &AnnotationOptions::default()).unwrap();
        let rooms: Vec<String> = annotations.rooms.iter().map(|room| room.room.to_string()).collect();
        assert_eq!(rooms, ["hallway_1", "office_5", "office_6"]);
        assert!(matches!(read.mesh.color_of(0), FaceColor::Texture(..)));
        assert!(matches!(read.mesh.color_of(3), FaceColor::Flat([9, 130, 255])));
    }
}
