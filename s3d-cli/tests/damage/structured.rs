//! Whole small exports, damaged at random: `verify` finds it, or nothing changed that it could know of.
//!
//! `S3D_DAMAGES=2000 cargo test -p s3d-cli damage::structured` tries more; `S3D_SEED` others.

use super::{copy, export, files};
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::{Context, verify};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// What nothing else in a data set tells: of how it was made.
const TOLD_BY_THE_MANIFEST_ALONE: [&str; 9] = [
    "/version",
    "/options/lenient",
    "/options/compression",
    "/options/entropy_stride",
    "/options/points_per_m2",
    "/areas/0/faces_left_out",
    "/areas/0/place_cameras",
    "/areas/0/inputs",
    "/areas/0/rgb",
];

/// Numbers that look random and are always the same.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, n: usize) -> usize {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n.max(1) as u64) as usize
    }
}

pub(crate) fn number_of(variable: &str, otherwise: u64) -> u64 {
    std::env::var(variable).map_or(otherwise, |text| text.parse().expect("a number"))
}

/// A file that is written anew: others have second names of it.
fn put(path: &Path, bytes: &[u8]) {
    fs::remove_file(path).unwrap();
    fs::write(path, bytes).unwrap();
}

/// The numbers, texts and flags of a document, by their places.
fn leaves(value: &Value, place: &str, out: &mut Vec<String>) {
    match value {
        Value::Object(map) => map
            .iter()
            .for_each(|(key, v)| leaves(v, &format!("{place}/{key}"), out)),
        Value::Array(all) => all
            .iter()
            .enumerate()
            .for_each(|(i, v)| leaves(v, &format!("{place}/{i}"), out)),
        _ => out.push(place.to_owned()),
    }
}

/// Changes one value of a JSON file to another of its kind, or removes it. Says which.
fn change_value(path: &Path, random: &mut Random) -> String {
    let mut json: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    let mut places = Vec::new();
    leaves(&json, "", &mut places);
    let place = places.swap_remove(random.below(places.len()));
    let value = json.pointer_mut(&place).unwrap();
    *value = match &*value {
        Value::Bool(flag) => (!flag).into(),
        Value::String(text) if random.below(2) == 0 => format!("{text}0").into(),
        Value::String(_) => ["half", "float", "512", "mm", "area", "off", "rgb"][random.below(7)].into(),
        Value::Number(n) if n.is_u64() => {
            let n = n.as_u64().unwrap();
            [n + 1, n.saturating_sub(1), 2 * n + 1, 0, n ^ (1 << random.below(40))][random.below(5)].into()
        }
        Value::Number(n) => (n.as_f64().unwrap() * [1.0 + 1e-15, -1.0, 1.1, 0.0][random.below(4)]).into(),
        _ => 1.into(),
    };
    put(path, serde_json::to_string_pretty(&json).unwrap().as_bytes());
    place
}

/// Damages an export, and says how.
fn damage(out: &Path, random: &mut Random) -> String {
    let all: Vec<PathBuf> = files(out).into_keys().collect();
    let pick = |random: &mut Random| out.join(&all[random.below(all.len())]);
    let (path, other) = (pick(random), pick(random));
    let mut bytes = fs::read(&path).unwrap();
    let at = random.below(bytes.len());
    let how = match random.below(9) {
        0 if !bytes.is_empty() => {
            bytes[at] ^= 1 << random.below(8);
            put(&path, &bytes);
            "a bit flipped"
        }
        1 if !bytes.is_empty() => {
            put(&path, &bytes[..at]);
            "cut"
        }
        2 => {
            bytes.insert(at, b' ');
            put(&path, &bytes);
            "a blank inserted"
        }
        3 => {
            fs::remove_file(&path).unwrap();
            "removed"
        }
        4 => {
            put(&path, &fs::read(&other).unwrap());
            put(&other, &bytes);
            "swapped with another"
        }
        5 => {
            let name = format!("{}x", path.file_name().unwrap().to_str().unwrap());
            fs::write(path.with_file_name(name), &bytes).unwrap();
            "copied to another name"
        }
        6 => {
            put(&path, &fs::read(&other).unwrap());
            "replaced by another"
        }
        _ => {
            let json: Vec<&PathBuf> = all
                .iter()
                .filter(|p| p.extension().is_some_and(|e| e == "json"))
                .collect();
            // Of the manifest nothing but its content tells.
            let name = if random.below(3) > 0 {
                Path::new("manifest.json")
            } else {
                json[random.below(json.len())]
            };
            return format!("{} of {} changed", change_value(&out.join(name), random), name.display());
        }
    };
    format!("{}: {how}", path.display())
}

/// What of an export can be known to be right or wrong.
fn what_matters(out: &Path) -> (Option<Value>, Vec<(PathBuf, Vec<u8>)>) {
    let manifest = fs::read(out.join("manifest.json")).ok();
    let mut manifest: Option<Value> = manifest.and_then(|bytes| serde_json::from_slice(&bytes).ok());
    for place in TOLD_BY_THE_MANIFEST_ALONE {
        if let Some(value) = manifest.as_mut().and_then(|m| m.pointer_mut(place)) {
            *value = Value::Null;
        }
    }
    // A copy beside the tables is somebody's own.
    let ours = |path: &PathBuf| path.components().count() > 1 || export().join(path).exists();
    let files = files(out)
        .into_iter()
        .filter(|(path, _)| ours(path) && path != Path::new("manifest.json"));
    (manifest, files.collect())
}

#[test]
fn structured_damage_is_found() {
    let whole = what_matters(export());
    let (cases, seed) = (number_of("S3D_DAMAGES", 150), number_of("S3D_SEED", 1));
    let mut found = 0;
    for case in 0..cases {
        let mut random = Random(seed.wrapping_mul(1_000_003).wrapping_add(case));
        let (_dir, out) = copy();
        let how = damage(&out, &mut random);
        let faults = match verify(&out, &VerifyOptions::default(), &Context::default()) {
            Ok(report) => report.fault_count(),
            Err(_) => 1,
        };
        found += u64::from(faults > 0);
        assert!(faults > 0 || what_matters(&out) == whole, "case {case} of seed {seed} is not found: {how}");
    }
    assert!(2 * found > cases, "{found} of {cases} were found");
}
