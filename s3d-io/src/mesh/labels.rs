//! Labels that come with a mesh: numbers of its faces or vertices, or the names of its materials.

use crate::fs::quote::{count, quote};
use s3d_geom::{NO_INDEX, TriMesh};
use s3d_label::{Label, Taxonomy};
use std::collections::HashMap;

/// The number of a face or vertex that has no label.
pub const NO_LABEL: i64 = i64::MIN;

/// The part of a mesh that has labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LabelElement {
    /// Its faces.
    Face,
    /// Its vertices.
    Vertex,
}

/// A column of numbers, and what the file calls it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelColumn {
    /// The property's name as the file writes it, such as `category_id`.
    pub name: String,
    /// One number for each face or vertex of the mesh; [`NO_LABEL`] if it has none.
    pub values: Vec<i64>,
}

/// An object of a mesh, as its file names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelledObject {
    /// The word for its class, such as `office chair`. A taxonomy, or the user, says what the word means.
    pub class: String,
    /// Its number. Objects of one class, room and number are one instance. [`NO_LABEL`] if it has none.
    pub instance: i64,
    /// Its room, if the file tells it.
    pub room: Option<LabelledRoom>,
}

/// A room of a mesh, as its file tells it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelledRoom {
    /// The number among all rooms of the file, from 1.
    pub number: i64,
    /// The word for its type with its number among the rooms of this type, such as `b_2`, if the file tells
    /// types. A taxonomy says what the word means.
    pub name: Option<String>,
}

/// Labels that come with a mesh, aligned with its faces or vertices after all checks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MeshLabels {
    /// Numbers, whose meaning a table of classes tells. At least one of the two columns is there.
    Numbers {
        /// The part of the mesh that has them.
        element: LabelElement,
        /// The class of each face or vertex.
        class: Option<LabelColumn>,
        /// The object that each face or vertex belongs to.
        instance: Option<LabelColumn>,
    },
    /// Objects with words for their classes: the nodes of glTF, HM3D, Replica, ScanNet++.
    Objects {
        /// The objects that the file names.
        objects: Vec<LabelledObject>,
        /// For each face its index into `objects`, or [`NO_INDEX`] if it belongs to none.
        faces: Vec<u32>,
        /// Whether the words are the plain names of the file's parts, which may be any words.
        are_names: bool,
    },
    /// A label of the data set for each face, as the published `semantic.obj` has them. Made by
    /// [`MeshLabels::from_materials`].
    Names {
        /// The different labels, in the order in which the materials of the mesh name them.
        labels: Vec<Label>,
        /// For each face its index into `labels`, or [`NO_INDEX`] for the null label.
        faces: Vec<u32>,
    },
}

impl MeshLabels {
    /// Takes the labels of faces from the names of their materials (`usemtl chair_3_office_5_1`). Returns
    /// them with warnings about names that are no label. Returns `None` if fewer than half of the faces have
    /// such a name, or if no name is a label. The null label `<UNK>_0_<UNK>_0_0` counts as a name. Source:
    /// [`crate::formats`], "What is written".
    ///
    /// ```
    /// use s3d_geom::{Material, MeshParts, TriMesh, glam::Vec3};
    /// use s3d_io::mesh::MeshLabels;
    /// let mesh = TriMesh::new(MeshParts {
    ///     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
    ///     faces: vec![[0, 1, 2]],
    ///     materials: vec![Material { name: "chair_3_office_5_1".into(), color: [0; 3], texture: None }],
    ///     face_materials: vec![0],
    ///     ..MeshParts::default()
    /// })?;
    /// let Some((MeshLabels::Names { labels, faces }, warnings)) =
    ///     MeshLabels::from_materials(&mesh, &Default::default()) else { panic!() };
    /// assert_eq!((labels[faces[0] as usize].instance, warnings.len()), (3, 0));
    /// # Ok::<(), s3d_geom::MeshError>(())
    /// ```
    pub fn from_materials(mesh: &TriMesh, taxonomy: &Taxonomy) -> Option<(Self, Vec<String>)> {
        // For each material, whether its name is a label, and which.
        let mut labels = Vec::new();
        let mut known: HashMap<Label, u32> = HashMap::new();
        let mut is_name = Vec::new();
        let places: Vec<u32> = mesh
            .materials()
            .iter()
            .map(|material| {
                let parsed = taxonomy.parse_name(&material.name);
                is_name.push(parsed.is_ok());
                let Ok(Some(label)) = parsed else { return NO_INDEX };
                *known.entry(label).or_insert_with(|| {
                    labels.push(label);
                    labels.len() as u32 - 1
                })
            })
            .collect();

        let mut named = 0;
        let mut others = vec![0usize; places.len()];
        let mut without = 0;
        let faces: Vec<u32> = (0..mesh.faces().len() as u32)
            .map(|face| match mesh.material_of(face).map(|m| m as usize) {
                Some(m) if is_name.get(m) == Some(&true) => {
                    named += 1;
                    places.get(m).copied().unwrap_or(NO_INDEX)
                }
                Some(m) => {
                    others.get_mut(m).into_iter().for_each(|n| *n += 1);
                    NO_INDEX
                }
                None => {
                    without += 1;
                    NO_INDEX
                }
            })
            .collect();

        // Ordinary material names are no labels.
        if labels.is_empty() || 2 * named < faces.len() {
            return None;
        }

        let mut warnings = Vec::new();
        if let Some((material, _)) = mesh.materials().iter().zip(&others).find(|(_, n)| **n > 0) {
            let name = quote(material.name.as_bytes());
            let n = count(others.iter().sum(), "face");
            warnings.push(format!(
                "{n} without a label: the names of their materials are no labels, the first is {name}"
            ));
        }
        if without > 0 {
            warnings.push(format!("{} without a label: no material", count(without, "face")));
        }
        Some((Self::Names { labels, faces }, warnings))
    }

    /// Returns whether the file says labels on purpose. Plain names of parts may be labels too.
    pub fn are_certain(&self) -> bool {
        !matches!(self, Self::Objects { are_names: true, .. })
    }

    /// Returns the part of the mesh that has labels.
    pub fn element(&self) -> LabelElement {
        match self {
            Self::Numbers { element, .. } => *element,
            Self::Objects { .. } | Self::Names { .. } => LabelElement::Face,
        }
    }

    /// Turns vertex labels into face labels. A face takes the number that two or three of its corners share,
    /// or the number of its first corner if all differ. [`NO_LABEL`] counts as a number.
    ///
    /// # Panics
    /// If the labels belong to another mesh.
    #[must_use]
    pub fn into_faces(self, mesh: &TriMesh) -> Self {
        match self {
            Self::Numbers { element: LabelElement::Vertex, class, instance } => Self::Numbers {
                element: LabelElement::Face,
                class: class.map(|column| majority_of_corners(column, mesh)),
                instance: instance.map(|column| majority_of_corners(column, mesh)),
            },
            faces => faces,
        }
    }

    /// Returns the labels as objects, and for each face its index into them, or [`NO_INDEX`]. The class of an
    /// object with a number is this number, as a word. Names have no objects.
    pub(crate) fn into_objects(self, mesh: &TriMesh) -> (Vec<LabelledObject>, Vec<u32>) {
        let (class, instance) = match self.into_faces(mesh) {
            Self::Objects { objects, faces, .. } => return (objects, faces),
            Self::Names { .. } => return (Vec::new(), vec![NO_INDEX; mesh.faces().len()]),
            Self::Numbers { class, instance, .. } => (class, instance),
        };

        let mut objects = Vec::new();
        let mut index: HashMap<(i64, i64), u32> = HashMap::new();
        let number = |column: &Option<LabelColumn>, face: usize| {
            column
                .as_ref()
                .and_then(|c| c.values.get(face).copied())
                .unwrap_or(NO_LABEL)
        };
        let faces = (0..mesh.faces().len()).map(|face| {
            let key = (number(&class, face), number(&instance, face));
            if key.0 == NO_LABEL {
                return NO_INDEX;
            }
            *index.entry(key).or_insert_with(|| {
                objects.push(LabelledObject { class: key.0.to_string(), instance: key.1, room: None });
                objects.len() as u32 - 1
            })
        });
        let faces = faces.collect();
        (objects, faces)
    }

    /// Replaces columns of faces by columns of other faces: `tags` gives for each new face the index of its
    /// old one, such as a polygon of the file, or [`NO_INDEX`] for a face without a label.
    pub(crate) fn pick_faces(&mut self, tags: &[u32]) {
        match self {
            Self::Numbers { element: LabelElement::Face, class, instance } => {
                for column in [class, instance].into_iter().flatten() {
                    column.values = picked(&column.values, tags, NO_LABEL);
                }
            }
            Self::Numbers { .. } => {}
            Self::Objects { faces, .. } | Self::Names { faces, .. } => *faces = picked(faces, tags, NO_INDEX),
        }
    }
}

/// Returns for each face the number of most of its corners, or of its first corner.
#[expect(
    clippy::indexing_slicing,
    reason = "labels of another mesh are a caller's mistake: see Panics of `into_faces`"
)]
fn majority_of_corners(column: LabelColumn, mesh: &TriMesh) -> LabelColumn {
    let values = mesh.faces().iter().map(|corners| {
        let [a, b, c] = corners.map(|vertex| column.values[vertex as usize]);
        if b == c { b } else { a }
    });
    LabelColumn { values: values.collect(), name: column.name }
}

fn picked<T: Copy>(values: &[T], tags: &[u32], missing: T) -> Vec<T> {
    tags.iter()
        .map(|&tag| values.get(tag as usize).copied().unwrap_or(missing))
        .collect()
}

/// The names of properties that hold classes, in the order of search, in upper or lower case. They are used
/// by Matterport3D (`category_id`), ScanNet and SceneNN (`label`), 3RScan (`globalId`, `NYU40`), CloudCompare
/// (`scalar_…`) and by people who write files by hand.
pub(crate) const CLASS_NAMES: [&str; 22] = [
    "label",
    "class",
    "category_id",
    "category",
    "class_id",
    "classification",
    "semantic",
    "semantic_id",
    "semantic_label",
    "semantic_class",
    "sem_label",
    "label_id",
    "class_label",
    "globalId",
    "nyu40",
    "nyu40id",
    "labels",
    "semseg",
    "scalar_label",
    "scalar_class",
    "scalar_classification",
    "scalar_semantic",
];

/// The names of properties that hold objects. Replica and Habitat use `object_id` of faces, 3RScan and
/// MultiScan `objectId`. `segment_id` is not among them: it is an object in [`MATTERPORT_NAMES`] alone.
pub(crate) const INSTANCE_NAMES: [&str; 14] = [
    "instance",
    "instance_id",
    "instance_label",
    "ins_label",
    "object_id",
    "objectId",
    "object",
    "inst",
    "inst_id",
    "instances",
    "instance_num",
    "scalar_instance",
    "scalar_instance_id",
    "scalar_object_id",
];

/// The properties of faces in Matterport3D's meshes of regions and houses: a part of the over-segmentation,
/// the object, and its class. Source: niessner/Matterport, data_organization.md and gaps/apps/mpview.
pub(crate) const MATTERPORT_NAMES: [&str; 3] = ["material_id", "segment_id", "category_id"];

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::Vec3;
    use s3d_geom::{Material, MeshParts};

    fn mesh(names: &[&str], face_materials: Vec<u32>) -> TriMesh {
        TriMesh::new(MeshParts {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            faces: [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]][..face_materials.len()].to_vec(),
            materials: names
                .iter()
                .map(|name| Material { name: (*name).into(), color: [0; 3], texture: None })
                .collect(),
            face_materials,
            ..MeshParts::default()
        })
        .unwrap()
    }

    #[test]
    fn materials_named_as_labels_are_labels() {
        let names = ["chair_3_office_5_1", "<UNK>_0_<UNK>_0_0", "wall_1_office_5_1", "default"];
        let (labels, warnings) =
            MeshLabels::from_materials(&mesh(&names, vec![2, 1, 0, 3]), &Taxonomy::s3dis()).unwrap();
        let MeshLabels::Names { labels, faces } = labels else { panic!("{labels:?}") };
        assert_eq!(
            labels.iter().map(Label::to_string).collect::<Vec<_>>(),
            ["chair_3_office_5_1", "wall_1_office_5_1"]
        );
        assert_eq!(faces, [1, NO_INDEX, 0, NO_INDEX]);
        assert_eq!(
            warnings,
            ["1 face without a label: the names of their materials are no labels, the first is `default`"]
        );
        let (_, warnings) =
            MeshLabels::from_materials(&mesh(&names, vec![2, 1, 0, NO_INDEX]), &Taxonomy::s3dis()).unwrap();
        assert_eq!(warnings, ["1 face without a label: no material"]);
    }

    #[test]
    fn ordinary_materials_are_no_labels() {
        let names = ["chair_3_office_5_1", "wood", "<UNK>_0_<UNK>_0_0"];
        assert_eq!(MeshLabels::from_materials(&mesh(&names, vec![0, 1, 1]), &Taxonomy::s3dis()), None);
        assert_eq!(MeshLabels::from_materials(&mesh(&names[1..], vec![0, 0]), &Taxonomy::s3dis()), None);
        // The null label alone labels nothing.
        assert_eq!(MeshLabels::from_materials(&mesh(&names[2..], vec![0, 0]), &Taxonomy::s3dis()), None);
    }

    #[test]
    fn faces_take_what_most_of_their_corners_have() {
        let mesh = mesh(&["m"], vec![0; 4]);
        let column =
            |name: &str, values: &[i64]| Some(LabelColumn { name: name.into(), values: values.to_vec() });
        let labels = MeshLabels::Numbers {
            element: LabelElement::Vertex,
            class: column("label", &[1, 2, 2, NO_LABEL]),
            instance: column("object", &[5, 6, 7, 8]),
        };
        let mut faces = labels.into_faces(&mesh);
        assert_eq!(
            faces,
            MeshLabels::Numbers {
                element: LabelElement::Face,
                class: column("label", &[2, 1, 1, 2]),
                instance: column("object", &[5, 5, 5, 6]),
            }
        );
        assert_eq!(faces.clone().into_faces(&mesh), faces);
        faces.pick_faces(&[3, 0, NO_INDEX]);
        let MeshLabels::Numbers { class, instance, .. } = faces else { panic!() };
        assert_eq!(class.unwrap().values, [2, 2, NO_LABEL]);
        assert_eq!(instance.unwrap().values, [6, 5, NO_LABEL]);
    }
}
