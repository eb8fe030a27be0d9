//! A data set of two areas, made once for all tests. They run at the same time, so a test that changes it
//! takes a copy.

use s3d_dataset::{Context, Export, ExportOptions};
use s3d_io::dataset::read_file_list;
use s3d_io::fs::{checksum_of_file, read_json, write_json};
use s3d_synth::{Building, ScanOptions};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

static OUT: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_PKG_NAME"));
    let _ = fs::remove_dir_all(&folder);
    let building = Building::demo().build().unwrap();
    let scenes = [2, 5].map(|area: u32| {
        let scan = ScanOptions { points_per_m2: 60.0, area, seed: area.into(), ..ScanOptions::default() };
        let to = folder.join(format!("scan {area}"));
        let scene = building.write_scan(&to, &scan, || true).unwrap();
        // The scan locations of the two areas need different names.
        let path = to.join("cameras.csv");
        let digit = area.to_string();
        let rows = fs::read_to_string(&path).unwrap();
        let renamed = |row: &str| digit.clone() + &row[1..];
        fs::write(&path, rows.lines().map(renamed).collect::<Vec<_>>().join("\n")).unwrap();
        scene
    });
    let options =
        ExportOptions { views: 2, size: 48, pano_width: 96, points_per_m2: 5.0, ..ExportOptions::default() };
    let out = folder.join("data set");
    Export::new(scenes)
        .options(options)
        .run(&out, &Context::default())
        .unwrap()
        .unwrap();
    out
});

/// Copies the data set to a new folder.
pub(crate) fn copy_to(folder: &Path) {
    copy_files(data_set(), folder);
}

fn copy_files(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let copy = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy_files(&path, &copy);
        } else {
            fs::copy(&path, &copy).unwrap();
        }
    }
}

/// Changes the text of a data set's `files.csv`, and the manifest so that it agrees.
pub(crate) fn change_list(root: &Path, change: impl Fn(&str) -> String) {
    let list = root.join("files.csv");
    let text = change(&fs::read_to_string(&list).unwrap());
    fs::write(&list, &text).unwrap();
    let records = read_file_list(&list).unwrap();

    let path = root.join("manifest.json");
    let mut manifest: Value = read_json(&path).unwrap();
    let files = &mut manifest["files"];
    files["count"] = records.len().into();
    files["bytes"] = records.iter().map(|record| record.bytes).sum::<u64>().into();
    files["xxh3_128"] = checksum_of_file(&list).unwrap().1.to_string().into();
    write_json(&path, &manifest).unwrap();
}

/// The folder of a labelled data set with areas 2 and 5.
pub(crate) fn data_set() -> &'static Path {
    &OUT
}
