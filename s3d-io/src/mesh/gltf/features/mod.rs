//! The features of a glTF file that are objects: EXT_mesh_features gives each vertex the number of a feature,
//! and a property table of EXT_structural_metadata has a row for each feature.
//!
//! Sources: the READMEs and schemas of the two extensions (CesiumGS/glTF, branches proposal-EXT_mesh_features
//! and proposal-EXT_structural_metadata), and for the bytes of a table and the meaning of its semantics
//! CesiumGS/3d-tiles, specification/Metadata.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

mod faces;
mod table;

pub(crate) use faces::{FaceFeatures, FeatureObjects, Triangles};

use crate::fs::quote::quote;
use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::features::table::{Table, names_of, tells_classes};
use crate::mesh::gltf::words::{CLASS_KEYS, MESH_FEATURES, METADATA, index_of, schema_uri, sets_of};
use gltf::json::Node;
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeMap;

const INSTANCE_FEATURES: &str = "EXT_instance_features";
/// The most properties that a warning names.
const MAX_NAMES: usize = 12;

/// The error is a sentence that names what is damaged.
type SentenceResult<T> = Result<T, String>;

/// The schema of a file's metadata: which properties there are, and what their values mean.
pub(crate) struct Schema<'a>(Option<Cow<'a, Value>>);

impl<'a> Schema<'a> {
    /// Reads the schema in the file, or beside it. A schema that cannot be read is a warning.
    pub(crate) fn read(document: &'a GltfDocument, warnings: &mut Vec<String>) -> Self {
        let root = metadata(document);
        if let Some(schema) = root.and_then(|root| root.get("schema")) {
            return Self(Some(Cow::Borrowed(schema)));
        }
        let Some(uri) = schema_uri(document.root()) else {
            if root.is_some_and(|root| root.get("propertyTables").is_some()) {
                warnings
                    .push(format!("properties of features are not read: there is no schema ({METADATA})"));
            }
            return Self(None);
        };
        let bytes = document.resource(uri);
        let schema = bytes
            .and_then(|bytes| serde_json::from_slice(&bytes).map_err(|e| format!("is no valid JSON: {e}")));
        Self(match schema {
            Ok(schema) => Some(Cow::Owned(schema)),
            Err(why) => {
                let uri = quote(uri.as_bytes());
                warnings.push(format!(
                    "properties of features are not read: the schema {uri} {why} ({METADATA})"
                ));
                None
            }
        })
    }
}

fn metadata(document: &GltfDocument) -> Option<&Value> {
    document.root().extensions.as_ref()?.others.get(METADATA)
}

/// The property tables of a file that tell classes.
pub(crate) struct Features<'a> {
    document: &'a GltfDocument,
    /// By the number of the table in the file.
    tables: BTreeMap<u32, Table<'a>>,
}

impl<'a> Features<'a> {
    /// Finds the tables. Warns of features that are no labels, and why.
    pub(crate) fn new(
        document: &'a GltfDocument,
        schema: &'a Schema<'a>,
        warnings: &mut Vec<String>,
    ) -> Self {
        let mut features = Self { document, tables: BTreeMap::new() };
        let (Some(root), Some(schema)) = (metadata(document), schema.0.as_deref()) else { return features };
        let primitives = document.root().meshes.iter().flat_map(|mesh| &mesh.primitives);
        let mut sets = primitives.filter_map(sets_of).flatten().peekable();

        if sets.peek().is_some() {
            match tables_of(document, schema, root, sets) {
                Ok(tables) => features.tables = tables,
                Err(why) => warnings.push(no_labels(&why)),
            }
        }
        warn_of_unread(document, schema, root, warnings);
        features
    }
}

/// Warns of classes that are not read: in property attributes and property textures, and of instances.
fn warn_of_unread(document: &GltfDocument, schema: &Value, root: &Value, warnings: &mut Vec<String>) {
    let has_classes = |key: &str| {
        let all = root.get(key).and_then(Value::as_array);
        all.into_iter().flatten().any(|one| tells_classes(schema, one))
    };
    for (key, what) in [("propertyAttributes", "attributes"), ("propertyTextures", "textures")] {
        if has_classes(key) {
            warnings.push(format!("classes in property {what} of {METADATA} are not read"));
        }
    }

    let of_instances = |node: &Node| {
        let extensions = node.extensions.as_ref();
        extensions.is_some_and(|e| e.others.contains_key(INSTANCE_FEATURES))
    };
    if document.root().nodes.iter().any(of_instances) && has_classes("propertyTables") {
        warnings.push(format!("classes of instances ({INSTANCE_FEATURES}) are not read"));
    }
}

/// Makes the warning that features are no labels.
fn no_labels(why: &str) -> String {
    format!("features of faces ({MESH_FEATURES}) are no labels: {why}")
}

/// Returns the tables of the sets of feature ids that tell classes.
///
/// # Errors
/// A table is damaged, or none tells classes.
fn tables_of<'a>(
    document: &'a GltfDocument,
    schema: &'a Value,
    root: &'a Value,
    sets: impl Iterator<Item = &'a Value>,
) -> SentenceResult<BTreeMap<u32, Table<'a>>> {
    let mut seen: BTreeMap<u32, Option<Table<'_>>> = BTreeMap::new();
    let mut names: Vec<&str> = Vec::new();
    for index in sets.filter_map(|set| set.get("propertyTable")) {
        let all = root.get("propertyTables").and_then(Value::as_array);
        let found = index_of(index).and_then(|i| Some((i, all?.get(i as usize)?)));
        let (i, json) = found.ok_or_else(|| format!("{METADATA} has no property table {index}"))?;
        if seen.contains_key(&i) {
            continue;
        }

        let name = json.get("name").and_then(Value::as_str);
        let name = name.map_or_else(String::new, |name| format!(" {}", quote(name.as_bytes())));
        let table = Table::new(document, schema, json, &format!("{METADATA}, property table {i}{name}"))?;
        if table.is_none() && names.len() <= MAX_NAMES {
            let more = names_of(schema, json).filter(|name| !names.contains(name));
            let more: Vec<&str> = more.take(MAX_NAMES.saturating_add(1)).collect();
            names.extend(more);
        }
        seen.insert(i, table);
    }

    let has_tables = !seen.is_empty();
    let tables: BTreeMap<_, _> = seen.into_iter().filter_map(|(i, table)| Some((i, table?))).collect();
    if !tables.is_empty() {
        return Ok(tables);
    }
    if !has_tables {
        return Err("they have no property table".into());
    }
    if names.is_empty() {
        return Err(format!("they have no properties ({METADATA})"));
    }
    let more = if names.len() > MAX_NAMES { " and others" } else { "" };
    let names: Vec<String> = names
        .iter()
        .take(MAX_NAMES)
        .map(|name| quote(name.as_bytes()))
        .collect();
    Err(format!(
        "none of their properties with texts or an enum is called {}; there are {}{more} ({METADATA})",
        CLASS_KEYS.join(", "),
        names.join(", ")
    ))
}

#[cfg(test)]
mod tests;
