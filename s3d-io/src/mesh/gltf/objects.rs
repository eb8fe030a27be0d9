//! The objects of a glTF file: features with a class; nodes such as `chair|8` in scenes of ProcTHOR, or with
//! `extras` of modellers and of tools for buildings; or else the plain names of nodes.

use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::features::FeatureObjects;
use crate::mesh::gltf::words::NodeWords;
use crate::mesh::labels::{LabelledObject, LabelledRoom, MeshLabels};
use s3d_geom::NO_INDEX;
use std::collections::HashMap;

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

    // Rooms are numbered in the order of their first features.
    let mut rooms: HashMap<&str, i64> = HashMap::new();
    let mut objects: Vec<LabelledObject> = Vec::new();
    for feature in &features.features {
        let room = feature.room.as_deref().map(|name| {
            let next = rooms.len() as i64 + 1;
            LabelledRoom { number: *rooms.entry(name).or_insert(next), name: Some(name.to_owned()) }
        });
        let instance = feature
            .instance
            .unwrap_or_else(|| features_from.saturating_add(feature.number));
        objects.push(LabelledObject { class: feature.class.clone(), instance, room });
    }
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
