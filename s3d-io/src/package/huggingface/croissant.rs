//! The description of a data set in Croissant: `croissant.json`.

use super::HuggingfaceSet;
use super::features::{Feature, Kind, features};
use crate::error::Result;
use crate::fs::json::write_json;
use serde_json::{Map, Value, json};
use std::path::Path;

/// The terms of Croissant that the file uses, below `http://mlcommons.org/croissant/`.
const TERMS: [&str; 24] = [
    "citeAs",
    "column",
    "extract",
    "field",
    "fileProperty",
    "fileObject",
    "fileSet",
    "format",
    "includes",
    "isLiveDataset",
    "jsonPath",
    "key",
    "md5",
    "parentField",
    "path",
    "recordSet",
    "references",
    "regex",
    "repeated",
    "replace",
    "separator",
    "source",
    "subField",
    "transform",
];

/// Writes the description. Returns its size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
pub fn write_croissant(path: &Path, set: &HuggingfaceSet<'_>) -> Result<u64> {
    write_json(path, &croissant(set))
}

fn croissant(set: &HuggingfaceSet<'_>) -> Value {
    let features = features(set);
    let mut distribution = Vec::new();
    let mut records = Vec::new();
    for config in &set.configs {
        let files = format!("files-of-{}", config.name);
        distribution.push(json!({
            "@type": "cr:FileSet",
            "@id": files,
            "name": files,
            "description": format!("The {} as Parquet files, a row an image.", config.name),
            "encodingFormat": "application/x-parquet",
            "includes": HuggingfaceSet::files_of(config.name, "*").replace("*-*", "*"),
        }));
        let fields: Vec<Value> = features
            .iter()
            .map(|feature| field(config.name, &files, feature))
            .collect();
        records.push(json!({
            "@type": "cr:RecordSet",
            "@id": config.name,
            "name": config.name,
            "description": format!("The {}.", config.name),
            "field": fields,
        }));
    }

    json!({
        "@context": context(),
        "@type": "sc:Dataset",
        "name": set.name,
        "description": "Images of indoor scans that are registered to each other and to the scans.",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "version": "1.0.0",
        "distribution": distribution,
        "recordSet": records,
    })
}

/// Returns the description of a column.
fn field(config: &str, files: &str, feature: &Feature) -> Value {
    let Feature { name, kind, meaning } = feature;
    let data_type = match kind {
        Kind::Int => "sc:Integer",
        Kind::Float | Kind::Floats => "sc:Float",
        Kind::Text => "sc:Text",
        Kind::Image | Kind::Depth => "sc:ImageObject",
    };
    let transform = match kind {
        Kind::Image | Kind::Depth => json!({"transform": {"jsonPath": "bytes"}}),
        _ => json!({}),
    };
    let source = joined(json!({"fileSet": {"@id": files}, "extract": {"column": name}}), transform);
    let repeated = if *kind == Kind::Floats {
        json!({"repeated": true})
    } else {
        json!({})
    };
    let field = json!({
        "@type": "cr:Field",
        "@id": format!("{config}/{name}"),
        "name": name,
        "description": meaning,
        "dataType": data_type,
        "source": source,
    });
    joined(field, repeated)
}

/// Returns an object with the members of another one, too.
fn joined(one: Value, other: Value) -> Value {
    match (one, other) {
        (Value::Object(mut all), Value::Object(more)) => {
            all.extend(more);
            Value::Object(all)
        }
        (one, _) => one,
    }
}

/// Returns what the words of the file mean.
fn context() -> Value {
    let mut words: Map<String, Value> = TERMS
        .iter()
        .map(|term| ((*term).to_owned(), Value::String(format!("cr:{term}"))))
        .collect();
    let others = [
        ("@language", json!("en")),
        ("@vocab", json!("https://schema.org/")),
        ("conformsTo", json!("dct:conformsTo")),
        ("cr", json!("http://mlcommons.org/croissant/")),
        ("rai", json!("http://mlcommons.org/croissant/RAI/")),
        ("dct", json!("http://purl.org/dc/terms/")),
        ("sc", json!("https://schema.org/")),
        ("data", json!({"@id": "cr:data", "@type": "@json"})),
        ("examples", json!({"@id": "cr:examples", "@type": "@json"})),
        ("dataType", json!({"@id": "cr:dataType", "@type": "@vocab"})),
    ];
    words.extend(others.map(|(word, meaning)| (word.to_owned(), meaning)));
    Value::Object(words)
}
