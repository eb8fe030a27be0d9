//! What holds the JSON of a glTF file: the chunks of a `.glb`, and the version that the file is of.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::error::{Error, Result};
use crate::fs::quote::quote;
use std::ops::Range;
use std::path::Path;

/// Splits a `.glb` file into its JSON and the range of its binary chunk.
pub(super) fn split_glb<'a>(path: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], Option<Range<usize>>)> {
    let cut = || {
        Error::format(path, format!("is cut off: a .glb of {} bytes does not hold its chunks", bytes.len()))
    };
    // The file has "glTF", the version and its length, then chunks of a length, a kind and data.
    let (_, rest) = bytes.split_first_chunk::<4>().ok_or_else(cut)?;
    let (version, rest) = rest.split_first_chunk().ok_or_else(cut)?;
    match u32::from_le_bytes(*version) {
        2 => {}
        1 => return Err(old_version(path, "1.0")),
        other => {
            return Err(Error::unsupported(path, format!("is binary glTF of version {other}; 2 is read")));
        }
    }
    let (_, mut rest) = rest.split_first_chunk::<4>().ok_or_else(cut)?;

    let mut chunks = [const { None }; 2];
    // Chunks after the second belong to extensions. Anything may follow the last chunk.
    for (chunk, kind) in chunks.iter_mut().zip([*b"JSON", *b"BIN\0"]) {
        let Some((length, after)) = rest.split_first_chunk() else { break };
        let Some((found, after)) = after.split_first_chunk() else { break };
        if *found != kind {
            break;
        }

        let length = usize::try_from(u32::from_le_bytes(*length)).ok();
        let (data, after) = length.and_then(|n| after.split_at_checked(n)).ok_or_else(cut)?;
        let start = bytes.len().saturating_sub(data.len().saturating_add(after.len()));
        *chunk = Some(start..start.saturating_add(data.len()));
        rest = after;
    }

    let [json, blob] = chunks;
    let json = json.and_then(|json| bytes.get(json));
    // Some writers pad the chunk with zeros.
    let json = json.map(|json| {
        let zeros = json.iter().rev().take_while(|b| **b == 0).count();
        json.get(..json.len().saturating_sub(zeros)).unwrap_or(json)
    });
    Ok((json.ok_or_else(|| Error::format(path, "is a .glb without a JSON chunk"))?, blob))
}

/// Refuses an asset of another version than 2.
pub(super) fn check_version(path: &Path, asset: &serde_json::Value) -> Result<()> {
    match version_of(asset, "version").as_deref() {
        None | Some("") => {
            return Err(Error::format(
                path,
                "does not say that it is glTF 2.0: asset.version is missing or empty. If it is, put \
                 \"asset\": {\"version\": \"2.0\"} into its JSON",
            ));
        }
        Some(v) if v == "2" || v.starts_with("2.") => {}
        Some(v) if v.starts_with("1.") || v.starts_with("0.") => return Err(old_version(path, v)),
        Some(v) => {
            let v = quote(v.as_bytes());
            return Err(Error::unsupported(path, format!("is glTF of the version {v}; 2.0 is read")));
        }
    }
    match version_of(asset, "minVersion").as_deref() {
        Some(v) if v != "2.0" && v != "2" => {
            let v = quote(v.as_bytes());
            Err(Error::unsupported(path, format!("needs a reader of glTF {v}; 2.0 is read")))
        }
        _ => Ok(()),
    }
}

/// Returns a version of the asset. The format wants a string; a number is understood too.
fn version_of(asset: &serde_json::Value, key: &str) -> Option<String> {
    match asset.get(key)? {
        serde_json::Value::String(text) => Some(text.trim().to_owned()),
        serde_json::Value::Number(number) => Some(number.to_string()),
        _ => None,
    }
}

fn old_version(path: &Path, version: &str) -> Error {
    let way_out = "convert it, for example by importing it into Blender and exporting glTF 2.0";
    Error::unsupported(path, format!("is glTF {version}, which differs from 2.0 and is not read; {way_out}"))
}
