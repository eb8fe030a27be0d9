//! Reduces the JSON of a glTF file to the parts that are read.
//!
//! The types of the gltf crate are stricter than the format in places, and one odd value anywhere stops them:
//! an animation channel without a node, `extras` that is no object, 1.0 for 1. A file that they refuse is
//! read again with only the parts that geometry, materials and textures need.

use serde_json::{Map, Number, Value, json};

/// The part of a value that is kept.
enum Keep {
    /// All of it.
    All,
    /// The value, if it is a string.
    Text,
    /// The named members of an object, each reduced in its turn.
    Members(&'static [(&'static str, Keep)]),
    /// Like [`Keep::Members`], for each element of a list.
    Each(&'static [(&'static str, Keep)]),
}

use Keep::{All, Each, Members, Text};

const SPARSE: &[(&str, Keep)] = &[
    ("count", All),
    ("indices", Members(&[("bufferView", All), ("byteOffset", All), ("componentType", All)])),
    ("values", Members(&[("bufferView", All), ("byteOffset", All)])),
];

const TEXTURE: Keep = Members(&[
    ("index", All),
    ("texCoord", All),
    (
        "extensions",
        Members(&[(
            "KHR_texture_transform",
            Members(&[("offset", All), ("rotation", All), ("scale", All), ("texCoord", All)]),
        )]),
    ),
]);

const ROOT: &[(&str, Keep)] = &[
    (
        "accessors",
        Each(&[
            ("bufferView", All),
            ("byteOffset", All),
            ("componentType", All),
            ("count", All),
            ("normalized", All),
            ("sparse", Members(SPARSE)),
            ("type", All),
        ]),
    ),
    ("buffers", Each(&[("byteLength", All), ("extensions", All), ("uri", All)])),
    (
        "bufferViews",
        Each(&[
            ("buffer", All),
            ("byteLength", All),
            ("byteOffset", All),
            ("byteStride", All),
            ("extensions", All),
        ]),
    ),
    ("extensions", Members(&[("CESIUM_RTC", All), ("EXT_structural_metadata", All)])),
    ("extensionsUsed", All),
    ("images", Each(&[("bufferView", All), ("mimeType", Text), ("name", Text), ("uri", All)])),
    (
        "materials",
        Each(&[
            (
                "extensions",
                Members(&[(
                    "KHR_materials_pbrSpecularGlossiness",
                    Members(&[("diffuseFactor", All), ("diffuseTexture", TEXTURE)]),
                )]),
            ),
            ("name", Text),
            ("pbrMetallicRoughness", Members(&[("baseColorFactor", All), ("baseColorTexture", TEXTURE)])),
        ]),
    ),
    (
        "meshes",
        Each(&[
            ("extensions", All),
            ("name", Text),
            (
                "primitives",
                Each(&[
                    ("attributes", All),
                    ("extensions", All),
                    ("indices", All),
                    ("material", All),
                    ("mode", All),
                    ("targets", Each(&[])),
                ]),
            ),
        ]),
    ),
    (
        "nodes",
        Each(&[
            ("children", All),
            ("extensions", All),
            ("matrix", All),
            ("mesh", All),
            ("rotation", All),
            ("scale", All),
            ("skin", All),
            ("translation", All),
        ]),
    ),
    ("samplers", Each(&[("wrapS", All), ("wrapT", All)])),
    ("scene", All),
    ("scenes", Each(&[("nodes", All)])),
    ("textures", Each(&[("extensions", All), ("sampler", All), ("source", All)])),
];

/// Returns the parts of a document that geometry, materials and textures need, with whole numbers written as
/// such. The result calls itself glTF 2.0, whatever the asset says.
pub(crate) fn needed(document: Value) -> Value {
    let mut root = match Members(ROOT).of(document) {
        Some(Value::Object(root)) => root,
        _ => Map::new(),
    };
    root.insert("asset".to_owned(), json!({"version": "2.0"}));
    for scene in root
        .get_mut("scenes")
        .and_then(Value::as_array_mut)
        .into_iter()
        .flatten()
    {
        if let Value::Object(scene) = scene {
            scene.entry("nodes").or_insert_with(|| json!([]));
        }
    }
    Value::Object(root)
}

impl Keep {
    /// Reduces a value. Returns `None` if nothing is left.
    fn of(&self, value: Value) -> Option<Value> {
        match (self, value) {
            (_, Value::Null) => None,
            (All, value) => Some(whole(value)),
            (Text, value) => Some(value).filter(Value::is_string),
            (Members(members), Value::Object(mut object)) => {
                let kept = members
                    .iter()
                    .filter_map(|(name, keep)| Some(((*name).to_owned(), keep.of(object.remove(*name)?)?)));
                Some(Value::Object(kept.collect()))
            }
            // A value of a wrong kind is a fault, which the types report.
            (Members(_), value) => Some(value),
            (Each(members), Value::Array(list)) => {
                let kept = list.into_iter().map(|e| Members(members).of(e).unwrap_or_default());
                Some(Value::Array(kept.collect()))
            }
            (Each(_), value) => Some(value),
        }
    }
}

/// Writes numbers such as 1.0 as whole numbers.
fn whole(value: Value) -> Value {
    match value {
        Value::Number(number) => {
            // Whole numbers up to 2^53 are exact. −0.0 keeps its sign.
            let float = number
                .as_f64()
                .filter(|v| number.is_f64() && v.fract() == 0.0 && v.abs() < 9e15);
            match float {
                Some(v) if v > 0.0 || v == 0.0 && v.is_sign_positive() => Number::from(v as u64).into(),
                Some(v) if v < 0.0 => Number::from(v as i64).into(),
                _ => number.into(),
            }
        }
        Value::Array(list) => list.into_iter().map(whole).collect(),
        Value::Object(object) => object.into_iter().map(|(name, value)| (name, whole(value))).collect(),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_needed_is_gone() {
        let document = json!({
            "asset": {"version": "2.0", "extras": 7},
            "animations": [{"channels": [{"sampler": 0, "target": {"path": "pointer"}}]}],
            "cameras": "none", "extras": [1], "scene": 0.0, "scenes": [{"name": "empty", "extras": "x"}],
            "nodes": [
                {"mesh": 1.0, "camera": "x", "name": 5, "translation": [-1.0, 0.5, 2.0], "children": null},
                {}],
            "meshes": [{"primitives": [
                {"attributes": {"POSITION": 2.0}, "targets": [{"POSITION": "x"}], "extras": 1}]}],
        });
        let expected = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}],
            "nodes": [{"mesh": 1, "translation": [-1, 0.5, 2]}, {}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 2}, "targets": [{}]}]}],
        });
        assert_eq!(needed(document), expected);
        assert_eq!(needed(json!([])), json!({"asset": {"version": "2.0"}}));
    }

    #[test]
    fn numbers_stay_what_they_are() {
        let numbers = json!([1.0, -3.0, 0.0, 0.5, 1e300, 18446744073709551615u64]);
        let kept = whole(numbers).to_string();
        assert_eq!(kept, "[1,-3,0,0.5,1e+300,18446744073709551615]");
        assert!(whole(json!(-0.0)).as_f64().is_some_and(f64::is_sign_negative));
    }
}
