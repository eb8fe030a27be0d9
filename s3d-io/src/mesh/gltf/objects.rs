//! The objects of a glTF file: features with a class; nodes such as `chair|8` in scenes of ProcTHOR, or with
//! `extras` of modellers and of tools for buildings; or else the plain names of nodes.

use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::features::FeatureObjects;
use crate::mesh::labels::{LabelledObject, MeshLabels};
use s3d_geom::NO_INDEX;
use serde::Deserialize;
use serde_json::Value;
use std::collections::HashMap;

/// The keys of `extras`, and the properties of features, that hold a class, in the order of search, in lower
/// case.
pub(crate) const CLASS_KEYS: [&str; 8] =
    ["category", "class", "class_name", "label", "semantic", "semantic_label", "objecttype", "ifcclass"];
/// The keys of `extras`, and the properties of features, that hold the number of an object, in lower case.
pub(crate) const INSTANCE_KEYS: [&str; 6] =
    ["instance", "instance_id", "instanceid", "object_id", "objectid", "id"];

/// What a node says of itself.
#[derive(Debug, Default, Deserialize)]
pub(crate) struct NodeWords {
    #[serde(default)]
    name: Value,
    #[serde(default)]
    extras: Value,
}

#[derive(Deserialize)]
struct Document {
    #[serde(default)]
    nodes: Vec<NodeWords>,
}

impl NodeWords {
    /// Reads the words of all nodes. Returns none if the nodes are not as glTF has them.
    pub(crate) fn of_document(text: &[u8]) -> Vec<Self> {
        serde_json::from_slice(text).map_or_else(|_| Vec::new(), |document: Document| document.nodes)
    }

    /// Returns whether the node says its class on purpose: in `extras`, or before a `|` of its name.
    pub(crate) fn is_labelled(&self) -> bool {
        self.of_extras(&CLASS_KEYS).and_then(Value::as_str).is_some() || self.parts_of_name().is_some()
    }

    fn of_extras(&self, keys: &[&str]) -> Option<&Value> {
        let extras = self.extras.as_object()?;
        keys.iter().find_map(|key| {
            let found = extras.iter().find(|(name, _)| name.eq_ignore_ascii_case(key));
            found.map(|(_, value)| value).filter(|value| !value.is_null())
        })
    }

    /// Cuts a name such as `chair|8`.
    fn parts_of_name(&self) -> Option<(&str, &str)> {
        let (class, rest) = self.name.as_str()?.split_once('|')?;
        Some((class.trim(), rest.trim())).filter(|(class, _)| !class.is_empty())
    }

    /// Returns the word for the node's class, and the object's number if the node has one. Returns `None` for
    /// a node without a name.
    fn object(&self) -> Option<(String, Option<i64>)> {
        let class = self.of_extras(&CLASS_KEYS).and_then(Value::as_str);
        let instance = self.of_extras(&INSTANCE_KEYS).and_then(whole);
        if let Some(class) = class {
            let of_name = self.parts_of_name().and_then(|(_, rest)| rest.parse().ok());
            return Some((class.trim().to_owned(), instance.or(of_name)));
        }
        if let Some((class, rest)) = self.parts_of_name() {
            return Some((class.to_owned(), instance.or(rest.parse().ok())));
        }

        // `Chair.001` and `chair_8` are chairs.
        let name = self.name.as_str()?;
        let word = name.trim_end_matches(|c: char| c.is_ascii_digit() || "._- #".contains(c));
        (!word.is_empty()).then(|| (word.to_owned(), instance))
    }
}

/// Returns a number from 0, which may be written as a text.
fn whole(value: &Value) -> Option<i64> {
    let number = value.as_i64().or_else(|| value.as_str()?.trim().parse().ok())?;
    Some(number).filter(|number| *number >= 0)
}

/// Returns the objects of faces: `node_of_face` has for each face the node that is its object. A feature is
/// nearer to a face than its node, so it comes first. If there are features, or some nodes say their class on
/// purpose, faces of other nodes belong to no object. Returns `None` if no feature and no node has a word.
pub(crate) fn labels_of(
    document: &GltfDocument,
    node_of_face: &[u32],
    features: &FeatureObjects,
) -> Option<MeshLabels> {
    let words = document.words();
    let some_are_labelled = !features.features.is_empty() || words.iter().any(NodeWords::is_labelled);

    // A feature or node without a number is an object of its own: the numbers of such objects follow all
    // others.
    let of_nodes = words.iter().filter_map(|node| node.object()?.1);
    let of_features = features.features.iter().filter_map(|feature| feature.instance);
    let features_from = of_nodes
        .chain(of_features)
        .max()
        .map_or(0, |most| most.saturating_add(1));
    let nodes_from = features_from.saturating_add(features.numbers);

    let mut objects: Vec<LabelledObject> = features
        .features
        .iter()
        .map(|feature| LabelledObject {
            class: feature.class.clone(),
            instance: feature
                .instance
                .unwrap_or_else(|| features_from.saturating_add(feature.number)),
            room: None,
        })
        .collect();
    let mut index: HashMap<u32, u32> = HashMap::new();
    let faces: Vec<u32> = node_of_face
        .iter()
        .enumerate()
        .map(|(face, &node)| {
            if let Some(&feature) = features.faces.get(face).filter(|feature| **feature != NO_INDEX) {
                return feature;
            }
            *index.entry(node).or_insert_with(|| {
                let said = words
                    .get(node as usize)
                    .filter(|node| node.is_labelled() || !some_are_labelled);
                let Some((class, number)) = said.and_then(NodeWords::object) else { return NO_INDEX };
                let instance = number.unwrap_or_else(|| nodes_from.saturating_add(i64::from(node)));
                objects.push(LabelledObject { class, instance, room: None });
                objects.len() as u32 - 1
            })
        })
        .collect();
    (!objects.is_empty()).then_some(MeshLabels::Objects { objects, faces, are_names: !some_are_labelled })
}
