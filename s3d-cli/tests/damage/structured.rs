//! Small exports damaged at random: `verify` finds the damage, or it changed nothing that `verify` can know.
//!
//! `S3D_DAMAGES=2000 cargo test -p s3d-cli damage::structured` tries more; `S3D_SEED` tries others.

use super::{copy, export, files};
use crate::common::list_files;
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::{Context, verify};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Numbers that look random and are the same in every run.
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

/// Replaces a file; it is not written in place, since hard links share it.
fn put(path: &Path, bytes: &[u8]) {
    fs::remove_file(path).unwrap();
    fs::write(path, bytes).unwrap();
}

/// The numbers, texts and flags of a document, by their JSON pointers.
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

/// Changes one value of a JSON file to another of its kind, or removes it. Returns a description.
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

/// Damages an export. Returns a description.
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
            // No list names the manifest: a change shows in its content alone.
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

/// The part of an export that can be known to be right or wrong.
fn what_matters(out: &Path) -> (Option<Value>, Vec<(PathBuf, Vec<u8>)>) {
    let manifest = fs::read(out.join("manifest.json")).ok();
    let manifest: Option<Value> = manifest.and_then(|bytes| serde_json::from_slice(&bytes).ok());
    // A new file in the top folder may be the user's own.
    let ours = |path: &PathBuf| path.components().count() > 1 || export().join(path).exists();
    let files = files(out)
        .into_iter()
        .filter(|(path, _)| ours(path) && path != Path::new("manifest.json"));
    (manifest, files.collect())
}

/// Puts an extreme, a double or another order into a table, and lists the files anew: the checksums are
/// right. Returns a description.
fn distort(out: &Path, random: &mut Random) -> String {
    let tables: Vec<PathBuf> = files(out)
        .into_keys()
        .filter(|path| path.extension().is_some_and(|ending| ending == "json"))
        .collect();
    // Most tables are pose files; every other kind is as likely as they are together.
    let is_pose = |path: &&PathBuf| path.parent().is_some_and(|folder| folder.ends_with("pose"));
    let (poses, others): (Vec<_>, Vec<_>) = tables.iter().partition(is_pose);
    let at = random.below(others.len() + 1);
    let name = others
        .get(at)
        .copied()
        .unwrap_or_else(|| poses[random.below(poses.len())]);

    let mut json: Value = serde_json::from_slice(&fs::read(out.join(name)).unwrap()).unwrap();
    let lists = random.below(3) > 0;
    let mut places = Vec::new();
    if lists {
        arrays(&json, "", &mut places);
    }
    if places.is_empty() {
        leaves(&json, "", &mut places);
    }
    if places.is_empty() {
        return format!("nothing in {}", name.display());
    }
    let place = places.swap_remove(random.below(places.len()));
    match json.pointer_mut(&place).unwrap() {
        Value::Array(items) => {
            let (a, b) = (random.below(items.len()), random.below(items.len()));
            match random.below(3) {
                0 => items.swap(a, b),
                1 => items.insert(b, items[a].clone()),
                _ => drop(items.remove(a)),
            }
        }
        value => {
            let extremes = [
                0.into(),
                (-1).into(),
                u32::MAX.into(),
                u64::MAX.into(),
                i64::MIN.into(),
                1e308.into(),
                (-1e-308).into(),
                Value::Null,
                "".into(),
                "../../x".into(),
            ];
            *value = extremes[random.below(extremes.len())].clone();
        }
    }
    put(&out.join(name), serde_json::to_string(&json).unwrap().as_bytes());
    list_files(out);
    format!("{place} of {}", name.display())
}

/// The lists of a document that are not empty, by their JSON pointers.
fn arrays(value: &Value, place: &str, out: &mut Vec<String>) {
    match value {
        Value::Object(map) => map
            .iter()
            .for_each(|(key, v)| arrays(v, &format!("{place}/{key}"), out)),
        Value::Array(all) => {
            if !all.is_empty() {
                out.push(place.to_owned());
            }
            all.iter()
                .enumerate()
                .for_each(|(i, v)| arrays(v, &format!("{place}/{i}"), out));
        }
        _ => {}
    }
}

#[test]
fn distorted_tables_never_end_a_report() {
    let (cases, seed) = (number_of("S3D_DAMAGES", 150), number_of("S3D_SEED", 1));
    let mut found = 0;
    for case in 0..cases {
        let mut random = Random(seed.wrapping_mul(7_000_003).wrapping_add(case));
        let (_dir, out) = copy();
        let how = distort(&out, &mut random);
        // A kind that cannot be a manifest's is refused.
        if let Ok(report) = verify(&out, &VerifyOptions { full: case % 10 == 0 }, &Context::default()) {
            found += u64::from(report.fault_count() > 0);
            let broken = report.faults.iter().find(|group| group.kind == "checks that broke off");
            assert!(broken.is_none(), "case {case} of seed {seed}, {how}: {broken:?}");
        }
    }
    assert!(2 * found > cases, "{found} of {cases} were found");
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
