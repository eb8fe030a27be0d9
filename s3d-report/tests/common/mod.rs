//! Makes data sets for tests, and reads reports back.

// Not every test file uses all of it.
#![allow(dead_code)]

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use s3d_dataset::s3d_io::dataset::{FileRecord, Layout, write_file_list};
use s3d_dataset::{Context, Export, ExportOptions};
use s3d_geom::Raster;
use s3d_io::image::decode_rgb8;
use s3d_synth::{Building, ScanOptions};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A quick export of the built-in scene.
pub(crate) fn data_set(folder: &Path, labelled: bool) -> PathBuf {
    let out = folder.join("data set");
    export(folder, labelled)
        .run(&out, &Context::default())
        .unwrap()
        .unwrap();
    out
}

/// That export, before it runs.
pub(crate) fn export(folder: &Path, labelled: bool) -> Export {
    let scan = ScanOptions { points_per_m2: 60.0, ..ScanOptions::default() };
    let scene = Building::demo()
        .build()
        .unwrap()
        .write_scan(&folder.join("scan"), &scan, || true)
        .unwrap();
    if !labelled {
        let text = fs::read_to_string(&scene).unwrap();
        let (before, rest) = text.split_once("[annotations]").unwrap();
        let after = rest
            .split_once("\n[")
            .map_or(String::new(), |(_, after)| format!("[{after}"));
        fs::write(&scene, format!("{before}{after}")).unwrap();
    }
    let options =
        ExportOptions { views: 6, size: 80, pano_width: 160, points_per_m2: 5.0, ..ExportOptions::default() };
    Export::new([scene]).options(options)
}

/// The value of a file `data/KEY.js`.
pub(crate) fn value(report: &Path, key: &str) -> Value {
    let script = fs::read_to_string(report.join("data").join(format!("{key}.js"))).unwrap();
    let rest = script.strip_prefix(&format!("s3dReport(\"{key}\",")).unwrap();
    let text: String = serde_json::from_str(rest.strip_suffix(");\n").unwrap()).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The bytes of a `data:` URL.
pub(crate) fn url_bytes(url: &Value, kind: &str) -> Vec<u8> {
    let base64 = url
        .as_str()
        .unwrap()
        .strip_prefix(&format!("data:image/{kind};base64,"))
        .unwrap();
    BASE64_STANDARD.decode(base64).unwrap()
}

/// The numbers of an image of 24 bits.
pub(crate) fn numbers(url: &Value) -> Raster<u32> {
    let image = decode_rgb8(&url_bytes(url, "png"), "url".as_ref()).unwrap();
    image.map(|[r, g, b]| u32::from_be_bytes([0, r, g, b]))
}

pub(crate) fn pair(value: &Value) -> [u32; 2] {
    [0, 1].map(|i| u32::try_from(value[i].as_u64().unwrap()).unwrap())
}

/// Every file of a folder.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in fs::read_dir(&at).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// Writes the lists of a data set anew.
pub(crate) fn list_files(out: &Path) {
    let layout = Layout::new(out);
    let paths = files(out).into_keys().map(|path| out.join(path));
    let listed = paths.filter(|path| *path != layout.manifest() && *path != layout.file_list());
    let records: Vec<FileRecord> = listed.map(|path| FileRecord::of_file(out, &path).unwrap()).collect();
    let (_, sum) = write_file_list(&layout.file_list(), &records).unwrap();
    let bytes: u64 = records.iter().map(|record| record.bytes).sum();
    let mut manifest: Value = serde_json::from_slice(&fs::read(layout.manifest()).unwrap()).unwrap();
    manifest["files"] = json!({
        "list": "files.csv", "count": records.len(), "bytes": bytes, "xxh3_128": sum.to_string()
    });
    fs::write(layout.manifest(), manifest.to_string()).unwrap();
}
