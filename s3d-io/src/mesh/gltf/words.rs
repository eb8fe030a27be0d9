//! What the JSON of a glTF file says beside the structures of the gltf crate: the words of nodes, and where
//! features are.

use gltf::json::Root;
use gltf::json::mesh::Primitive;
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};

pub(crate) const MESH_FEATURES: &str = "EXT_mesh_features";
pub(crate) const METADATA: &str = "EXT_structural_metadata";

/// The keys of `extras`, and the properties of features, that hold a class, in the order of search, in lower
/// case.
pub(crate) const CLASS_KEYS: [&str; 8] =
    ["category", "class", "class_name", "label", "semantic", "semantic_label", "objecttype", "ifcclass"];
/// The keys of `extras`, and the properties of features, that hold the number of an object, in lower case.
pub(crate) const INSTANCE_KEYS: [&str; 6] =
    ["instance", "instance_id", "instanceid", "object_id", "objectid", "id"];
/// The property of features that holds the name of a room, in lower case.
pub(crate) const ROOM_KEYS: [&str; 1] = ["room"];

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
    pub(crate) fn object(&self) -> Option<(String, Option<i64>)> {
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

/// The accessors of attributes such as `_FEATURE_ID_0`, by mesh, primitive and name. The gltf crate forgets
/// attributes that glTF itself does not name.
#[derive(Debug, Default)]
pub(crate) struct FeatureAttributes(pub(crate) HashMap<(usize, usize, String), u32>);

impl FeatureAttributes {
    /// Finds the attributes in the JSON. Returns none if no primitive has features.
    pub(crate) fn of_document(root: &Root, text: &[u8]) -> Self {
        #[derive(Deserialize)]
        struct Meshes {
            meshes: Vec<Primitives>,
        }
        #[derive(Deserialize)]
        struct Primitives {
            primitives: Vec<Attributes>,
        }
        #[derive(Deserialize)]
        struct Attributes {
            attributes: BTreeMap<String, Value>,
        }
        let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
        if !primitives.any(|p| sets_of(p).is_some()) {
            return Self::default();
        }

        let meshes = serde_json::from_slice(text).map_or_else(|_| Vec::new(), |all: Meshes| all.meshes);
        let mut found = HashMap::new();
        for (m, mesh) in meshes.into_iter().enumerate() {
            for (p, primitive) in mesh.primitives.into_iter().enumerate() {
                let ids = primitive.attributes.into_iter();
                let ids = ids.filter(|(name, _)| name.starts_with("_FEATURE_ID_"));
                found.extend(ids.filter_map(|(name, index)| Some(((m, p, name), index_of(&index)?))));
            }
        }
        Self(found)
    }
}

/// Returns the URI of the schema, if it is beside the file.
pub(crate) fn schema_uri(root: &Root) -> Option<&str> {
    let metadata = root.extensions.as_ref()?.others.get(METADATA)?;
    metadata.get("schemaUri")?.as_str()
}

/// Returns the sets of feature ids of a primitive.
pub(crate) fn sets_of(p: &Primitive) -> Option<&Vec<Value>> {
    let features = p.extensions.as_ref()?.others.get(MESH_FEATURES)?;
    features.get("featureIds")?.as_array()
}

/// Reads an index, even if the JSON writes it as a decimal fraction.
pub(crate) fn index_of(value: &Value) -> Option<u32> {
    let number = value
        .as_u64()
        .or_else(|| value.as_f64().filter(|v| v.fract() == 0.0).map(|v| v as u64))?;
    u32::try_from(number).ok()
}
