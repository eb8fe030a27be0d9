//! Compares the lists of files, and what the manifests say about how the data sets were made.

use super::comparison::{FileKindChanges, InputChange, SettingChange, Side};
use super::sides::{Sides, have_same_bytes, records};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::parallel::for_each_in_order;
use crate::record::data_set::DataSet;
use s3d_io::Error as FileError;
use s3d_io::dataset::FileRecord;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// The most names of files that are listed for a kind.
const MAX_NAMES: usize = 20;

/// Checks that every file of both data sets is there with its size, and with its checksum if `full`.
pub(crate) fn check(sides: &Sides, full: bool, ctx: &Context) -> Result<()> {
    let mut all: Vec<(Side, FileRecord)> = Vec::new();
    for (side, data) in sides.both() {
        all.extend(data.files.records().map(|record| (side, record.clone())));
    }

    let progress = ctx.progress("checking", "files", all.len() as u64);
    for_each_in_order(
        ctx,
        &all,
        || (),
        |(), (side, record)| {
            let root = sides.of(*side).layout().root();
            let checked = if full {
                record.check(root)
            } else {
                record.check_size(root)
            };
            sides.keep(*side, checked.map_err(Error::from))?;
            progress.add(1);
            Ok(())
        },
    )
}

/// Compares the files of both lists, by kind. No file is opened.
pub(crate) fn changes(sides: &Sides) -> Vec<FileKindChanges> {
    let a = records(&sides.a);
    let b = records(&sides.b);
    let paths: BTreeSet<&str> = a.keys().chain(b.keys()).copied().collect();

    let mut kinds: BTreeMap<String, FileKindChanges> = BTreeMap::new();

    for path in paths {
        let kind = kinds.entry(kind_of(path)).or_default();
        match (a.get(path), b.get(path)) {
            (Some(a), Some(b)) if have_same_bytes(a, b) => {
                kind.same += 1;
                continue;
            }
            (Some(_), Some(_)) => kind.changed += 1,
            (Some(_), None) => kind.only_a += 1,
            (None, _) => kind.only_b += 1,
        }
        if kind.first.len() < MAX_NAMES {
            kind.first.push(path.to_owned());
        }
    }

    kinds
        .into_iter()
        .map(|(kind, changes)| FileKindChanges { kind, ..changes })
        .collect()
}

/// The kind of a file: a folder of an area such as `data/rgb`, or a folder or a file of the data set.
fn kind_of(path: &str) -> String {
    let parts: Vec<&str> = path.split('/').collect();
    match parts.as_slice() {
        [area, "data" | "pano", _, _, ..] if area.starts_with("area_") => parts[1..3].join("/"),
        [area, rest, ..] if area.starts_with("area_") => (*rest).to_owned(),
        ["profiles", name, ..] => format!("profiles/{name}"),
        [first, ..] => (*first).to_owned(),
        [] => String::new(),
    }
}

/// The differences between the manifests: settings, and files of the input.
///
/// # Errors
/// Fails if options cannot be written as JSON.
pub(crate) fn made(sides: &Sides) -> Result<(Vec<SettingChange>, Vec<InputChange>)> {
    let a = settings(&sides.a)?;
    let b = settings(&sides.b)?;
    let names: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let both = names.into_iter().map(|name| SettingChange {
        name: name.clone(),
        a: a.get(name).cloned().unwrap_or_default(),
        b: b.get(name).cloned().unwrap_or_default(),
    });
    let settings = both.filter(|change| change.a != change.b).collect();

    let a = inputs(&sides.a);
    let b = inputs(&sides.b);
    let keys: BTreeSet<&(u32, String)> = a.keys().chain(b.keys()).collect();
    let both = keys.into_iter().map(|key| InputChange {
        area: key.0,
        path: key.1.clone(),
        a: a.get(key).cloned(),
        b: b.get(key).cloned(),
    });

    Ok((settings, both.filter(|change| change.a != change.b).collect()))
}

/// The settings that made a data set, by key of its manifest.
fn settings(data: &DataSet) -> Result<BTreeMap<String, Value>> {
    let manifest = &data.manifest;
    let mut all = BTreeMap::new();
    all.insert("version".to_owned(), Value::from(data.version()));
    all.insert("seed".to_owned(), Value::from(data.seed()));
    all.insert("areas".to_owned(), Value::from(data.areas()));
    all.insert("taxonomy".to_owned(), Value::from(data.taxonomy().map(|taxonomy| taxonomy.name())));
    all.insert("world coordinates from depth".to_owned(), Value::from(manifest.is_xyz_from_depth()));

    let options = serde_json::to_value(data.options())
        .map_err(|e| FileError::format(&data.layout().manifest(), e.to_string()))?;
    if let Value::Object(options) = options {
        all.extend(
            options
                .into_iter()
                .map(|(name, value)| (format!("options.{name}"), value)),
        );
    }

    for entry in &manifest.areas {
        let area = entry.area;
        all.insert(format!("area {area}: rgb"), Value::from(entry.rgb.as_str()));
        all.insert(format!("area {area}: place_cameras"), Value::from(entry.place_cameras));
        all.insert(format!("area {area}: see"), Value::from(entry.see));
        let offset = entry.offset_m.map_or(Value::Null, |offset| offset.to_vec().into());
        all.insert(format!("area {area}: offset_m"), offset);
    }

    Ok(all)
}

/// The checksums of files and folders of the input, by area and path.
fn inputs(data: &DataSet) -> BTreeMap<(u32, String), String> {
    let areas = &data.manifest.areas;
    let of = areas
        .iter()
        .flat_map(|entry| entry.inputs.iter().map(move |input| (entry.area, input)));
    of.map(|(area, input)| ((area, input.path.clone()), input.xxh3_128.to_string()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_those_of_formats_md() {
        for (path, kind) in [
            ("area_1/data/rgb/camera_a.png", "data/rgb"),
            ("area_12/pano/global_xyz/camera_a.exr", "pano/global_xyz"),
            ("area_1/3d/rgb_textures/0.png", "3d"),
            ("area_1/views.json", "views.json"),
            ("s3dis/Area_1/office_1/office_1.txt", "s3dis"),
            ("profiles/pointnet/a/b.npy", "profiles/pointnet"),
            ("statistics.md", "statistics.md"),
            ("area_1", "area_1"),
        ] {
            assert_eq!(kind_of(path), kind);
        }
    }
}
