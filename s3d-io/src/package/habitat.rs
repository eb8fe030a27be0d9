//! A scene of habitat-sim in the form of HM3D: a textured stage, a mesh whose vertices have the colours of
//! their objects, and the list of the objects.
//!
//! Source: `facebookresearch/habitat-sim` at 57ee494: `src/esp/scene/HM3DSemanticScene.cpp`,
//! `src/esp/assets/GenericSemanticMeshData.cpp`, `src/esp/metadata/managers/StageAttributesManager.cpp` and
//! `docs/pages/attributesJSON.rst`.

#![expect(clippy::indexing_slicing, reason = "a writer: the faces are those that TriMesh::new checked")]

use crate::error::Result;
use crate::fs::json::write_json;
use crate::fs::write_whole;
use crate::mesh::{MeshOut, write_glb_mesh, write_textured_glb};
use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::Path;

/// An object of a scene. Its number is its place in the list, from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HabitatObject {
    /// Its class, without commas and quotes.
    pub class: String,
    /// The number of its room, from 0.
    pub region: u32,
}

/// Which object each face of a scene belongs to.
#[derive(Clone, Copy, Debug)]
pub struct HabitatLabels<'a> {
    /// The objects.
    pub objects: &'a [HabitatObject],
    /// The number of the object of each face, from 1; 0 for a face without one.
    pub object_of_face: &'a [u32],
}

/// The largest number of objects of a scene: habitat-sim keeps their numbers in 16 bits.
pub const MOST_HABITAT_OBJECTS: usize = 65_535;

/// Writes a scene into a folder that exists: `NAME.glb`, `NAME.stage_config.json`, and if there are labels
/// `NAME.semantic.glb` and `NAME.semantic.txt`. Meshes are Y-up.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io), also for a mesh of more than 4 GiB.
///
/// # Panics
/// If `object_of_face` has not one entry per face, or names an object that is not there.
pub fn write_habitat_scene(
    folder: &Path,
    name: &str,
    mesh: &TriMesh,
    labels: Option<HabitatLabels<'_>>,
) -> Result<()> {
    let file = |ending: &str| format!("{name}.{ending}");
    let mut stage = json!({
        "render_asset": file("glb"),
        "collision_asset": file("glb"),
        // A GLB whose frame is not told is taken for one that is Z-up.
        "up": [0, 1, 0],
        "front": [0, 0, -1],
        "units_to_meters": 1.0,
        "shader_type": "flat",
    });
    write_textured_glb(&folder.join(file("glb")), mesh)?;
    if let Some(labels) = labels {
        write_semantic_mesh(&folder.join(file("semantic.glb")), mesh, labels.object_of_face)?;
        write_whole(&folder.join(file("semantic.txt")), |w| {
            writeln!(w, "HM3D Semantic Annotations")?;
            for (number, object) in (1..).zip(labels.objects) {
                let [r, g, b] = color_of(number);
                let HabitatObject { class, region } = object;
                writeln!(w, "{number},{r:02X}{g:02X}{b:02X},\"{class}\",{region}")?;
            }
            Ok(())
        })?;
        stage["semantic_asset"] = json!(file("semantic.glb"));
        stage["semantic_descriptor_filename"] = json!(file("semantic.txt"));
        stage["has_semantic_textures"] = json!(false);
    }
    write_json(&folder.join(file("stage_config.json")), &stage)?;
    Ok(())
}

/// Writes the file that habitat-sim opens: it names the folders of the scenes below its own.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
pub fn write_habitat_config(path: &Path, folders: &[String]) -> Result<u64> {
    let config: Value = json!({ "stages": { "paths": { ".json": folders } } });
    write_json(path, &config)
}

/// Returns the colour of an object. Each has another one; black stands for none.
fn color_of(object: u32) -> [u8; 3] {
    // An odd factor maps all numbers of 24 bits to each other.
    let [_, r, g, b] = (object.wrapping_mul(0x9e37_79b1) & 0xff_ffff).to_be_bytes();
    [r, g, b]
}

/// Writes a mesh with the colours of objects. A vertex between objects becomes one for each.
fn write_semantic_mesh(path: &Path, mesh: &TriMesh, object_of_face: &[u32]) -> Result<u64> {
    let mut numbers: HashMap<[u32; 2], u32> = HashMap::new();
    let mut positions: Vec<Vec3> = Vec::new();
    let mut colors = Vec::new();
    let mut faces = Vec::with_capacity(mesh.faces().len());
    assert_eq!(object_of_face.len(), mesh.faces().len(), "an object for each face");
    for (face, &object) in mesh.faces().iter().zip(object_of_face) {
        faces.push(face.map(|vertex| {
            *numbers.entry([vertex, object]).or_insert_with(|| {
                positions.push(mesh.positions()[vertex as usize]);
                colors.push(color_of(object));
                colors.len() as u32 - 1
            })
        }));
    }
    let mesh = MeshOut { positions: &positions, faces: &faces, colors: &colors, ..MeshOut::default() };
    write_glb_mesh(path, &mesh)
}

#[cfg(all(test, feature = "labels"))]
mod tests {
    use super::*;
    use crate::cloud::label_files::LabelFile;
    use crate::mesh::{MeshLabels, MeshOptions, UpAxis};
    use s3d_geom::primitives::grid;
    use std::collections::HashSet;

    #[test]
    fn objects_have_colours_of_their_own() {
        let colors: HashSet<[u8; 3]> = (0..=MOST_HABITAT_OBJECTS as u32).map(color_of).collect();
        assert_eq!(colors.len(), MOST_HABITAT_OBJECTS + 1);
        assert_eq!(color_of(0), [0; 3]);
    }

    #[test]
    fn labels_come_back_as_they_were() {
        let dir = tempfile::tempdir().unwrap();
        let mesh = TriMesh::new(grid(Vec3::ZERO, Vec3::X, Vec3::Z, [5, 4])).unwrap();
        let object_of_face: Vec<u32> = (0..40).map(|face| face % 3 + 1).collect();
        let object = |class: &str, region| HabitatObject { class: class.to_owned(), region };
        let objects = [object("wall", 1), object("chair", 0), object("wall", 0)];
        let labels = HabitatLabels { objects: &objects, object_of_face: &object_of_face };
        write_habitat_scene(dir.path(), "area_1", &mesh, Some(labels)).unwrap();

        let list = LabelFile::of(&dir.path().join("area_1.semantic.txt")).unwrap().unwrap();
        let read = list.read(UpAxis::Y, &MeshOptions::default()).unwrap();
        assert_eq!(read.warnings, [""; 0]);
        let triangles = |mesh: &TriMesh| (0..40).map(|face| mesh.triangle(face)).collect::<Vec<_>>();
        assert_eq!(triangles(&read.mesh), triangles(&mesh));
        let Some(MeshLabels::Objects { objects: found, faces, .. }) = read.labels else {
            panic!("there are labels");
        };
        for (face, object) in faces.iter().zip(&object_of_face) {
            let (found, wanted) = (&found[*face as usize], &objects[*object as usize - 1]);
            assert_eq!((found.instance, &found.class), (i64::from(*object), &wanted.class));
            assert_eq!(found.room.as_ref().unwrap().number, i64::from(wanted.region) + 1);
        }
    }
}
