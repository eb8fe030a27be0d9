//! Damaged exports: `verify` reports the damage. Every other reader of an export refuses it, leaves it as it
//! is, and ends.
#![cfg(unix)]

mod kills;
mod structured;

use crate::common;
use common::{files, list_files, s3d_ok, text, write_scan};
use s3d_io::fs::{create_dir, write_bytes};
use serde_json::Value;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const SMALL: [&str; 10] =
    ["--size", "32", "--pano-width", "64", "--views", "3", "--points-per-m2", "60", "--compression", "fast"];

/// A folder on a disk in memory, if there is one: commands that change an export wait for the disk, which may
/// be busy.
fn folder() -> TempDir {
    let memory = Path::new("/dev/shm");
    if memory.is_dir() {
        tempfile::tempdir_in(memory)
    } else {
        tempfile::tempdir()
    }
    .unwrap()
}

/// An export of one area with depth in millimetres, made once.
fn export() -> &'static Path {
    static EXPORT: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    let (_, out) = EXPORT.get_or_init(|| {
        let dir = folder();
        let (scene, out) = (write_scan(&dir.path().join("scan"), 1), dir.path().join("out"));
        let more = ["--depth-units", "mm", "--keep-all"];
        s3d_ok(&[&["export", text(&scene), "-o", text(&out)], &SMALL[..], &more].concat());
        (dir, out)
    });
    out
}

/// A copy to damage, in a folder of its own: hard links, so a file is shared until it is replaced.
fn copy() -> (TempDir, PathBuf) {
    let dir = folder();
    let out = dir.path().join("copy");
    for path in files(export()).into_keys() {
        let to = out.join(&path);
        create_dir(to.parent().unwrap()).unwrap();
        fs::hard_link(export().join(&path), &to).unwrap();
    }
    (dir, out)
}

/// Every command that reads an export. Each writes into the folder that holds the export, or into the export.
const READERS: [&[&str]; 16] = [
    &["verify", "OUT"],
    &["stats", "OUT"],
    &["xyz", "OUT", "--overwrite", "--type", "float"],
    &["pairs", "OUT", "--samples", "64"],
    &["refine", "OUT"],
    &["figures", "OUT", "--dpi", "30"],
    &["profile", "OUT", "--to", "pointcept"],
    &["profile", "OUT", "--to", "open3d-ml"],
    &["profile", "OUT", "--to", "mmdet3d"],
    &["profile", "OUT", "--to", "pointnet"],
    &["pack", "OUT", "--to", "webdataset"],
    &["pack", "OUT", "--to", "colmap", "--copy-images"],
    &["pack", "OUT", "--to", "nerfstudio", "--copy-images"],
    &["pack", "OUT", "--to", "coco"],
    &["pack", "OUT", "--to", "parquet"],
    &["compare", "OUT", "OUT", "--full"],
];

/// Runs a command with a limit on its memory. It must end soon.
fn run(out: &Path, args: &[&str]) -> Output {
    let args = args.iter().map(|arg| if *arg == "OUT" { text(out) } else { arg });
    let mut child = Command::new("sh")
        .args(["-c", "ulimit -v 3000000; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_s3d")])
        .args(args.clone())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let until = Instant::now() + Duration::from_secs(120);
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > until {
            child.kill().unwrap();
            panic!("{:?} does not end", args.collect::<Vec<_>>());
        }
        thread::sleep(Duration::from_millis(2));
    }
    child.wait_with_output().unwrap()
}

/// The report of `s3d verify`, which must name faults.
fn verified(out: &Path) -> String {
    let said = run(out, &["verify", "OUT"]);
    let report = String::from_utf8(said.stdout).unwrap();
    assert_eq!(said.status.code(), Some(1), "{report}{}", String::from_utf8_lossy(&said.stderr));
    report
}

/// Everything in a folder; an entry that is no regular file comes with its kind.
fn state(folder: &Path) -> Vec<(PathBuf, u64)> {
    let mut all = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let (path, meta) = entry.map(|e| (e.path(), e.metadata().unwrap())).unwrap();
            if meta.is_dir() {
                folders.push(path.clone());
            }
            all.push((path, if meta.is_file() { meta.len() } else { 0 }));
        }
    }
    all.sort();
    all
}

/// These readers must refuse the export with a message that contains all the words, and change nothing.
#[track_caller]
fn refuse<'a>(out: &Path, readers: impl IntoIterator<Item = &'a &'a [&'a str]>, words: &[&str]) {
    let folder = out.parent().unwrap();
    let before = state(folder);
    for args in readers {
        let said = run(out, args);
        let log = String::from_utf8_lossy(&said.stderr).into_owned() + &String::from_utf8_lossy(&said.stdout);
        assert_eq!(said.status.code(), Some(1), "{args:?} with {words:?}: {log}");
        assert!(!log.contains("panicked"), "{log}");
        for word in words {
            assert!(log.contains(word), "{args:?} should tell of {word:?}: {log}");
        }
        assert!(state(folder) == before, "{args:?} changed something");
    }
}

/// The readers of these commands.
fn readers<'a>(of: &'a [&'a str]) -> impl Iterator<Item = &'a &'static [&'static str]> {
    READERS
        .iter()
        .filter(move |args| of.iter().any(|word| args.contains(word)))
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The first file below a folder whose path ends like this.
fn first(out: &Path, folder: &str, ending: &str) -> String {
    let found = files(&out.join(folder))
        .into_keys()
        .find(|path| text(path).ends_with(ending));
    format!("{folder}/{}", text(&found.unwrap_or_else(|| panic!("no {ending} in {folder}"))))
}

fn flip(path: &Path) {
    let mut bytes = fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    write_bytes(path, &bytes).unwrap();
}

#[test]
fn a_whole_export_is_read_by_all() {
    let (_dir, out) = copy();
    for args in READERS {
        let said = run(&out, args);
        assert!(said.status.success(), "{args:?}: {}", String::from_utf8_lossy(&said.stderr));
    }
}

/// All commands use one reader of the manifest, so all report a fault in it in the same words.
#[test]
fn what_is_wrong_in_a_manifest_is_told_by_all_alike() {
    type Spoil = fn(&mut Value);
    let spoils: [(&str, Spoil); 14] = [
        ("\"zz\" is no checksum", |m| m["files"]["xxh3_128"] = "zz".into()),
        ("is no checksum", |m| {
            let sum = m["areas"][0]["inputs"][0]["xxh3_128"].as_str().unwrap().to_uppercase();
            m["areas"][0]["inputs"][0]["xxh3_128"] = format!("X{}", &sum[1..]).into();
        }),
        ("\"ell\" is none of 512 and mm", |m| m["options"]["depth_units"] = "ell".into()),
        ("\"half a\" is none of", |m| m["areas"][0]["xyz"]["type"] = "half a".into()),
        ("`size`: must be from 8", |m| m["options"]["size"] = 0.into()),
        ("area_numbers [1, 1]", |m| m["area_numbers"] = vec![1, 1].into()),
        ("area_numbers [2], and areas tells of [1]", |m| m["area_numbers"] = vec![2].into()),
        ("missing field `faces`", |m| drop(m["areas"][0].as_object_mut().unwrap().remove("faces"))),
        ("invalid type: string", |m| m["seed"] = "7".into()),
        ("no labels, and its options ask", |m| m["labels"] = 0.into()),
        ("unknown field `colour`", |m| m["options"]["colour"] = 1.into()),
        ("written by \"s4d\", not by s3d", |m| m["generator"] = "s4d".into()),
        ("tells of no files.csv", |m| drop(m.as_object_mut().unwrap().remove("files"))),
        ("did not finish", |m| m["status"] = "running".into()),
    ];
    for (words, spoil) in spoils {
        let (_dir, out) = copy();
        let path = out.join("manifest.json");
        let mut manifest = json(&path);
        spoil(&mut manifest);
        write_bytes(&path, serde_json::to_string_pretty(&manifest).unwrap().as_bytes()).unwrap();
        let report = verified(&out);
        let told = report
            .lines()
            .find(|line| line.trim_start().starts_with("manifest.json: ") && line.contains(words));
        let told = told.unwrap_or_else(|| panic!("verify should tell of {words:?}: {report}"));
        // Reports and errors put the line number of a file in different places.
        let message = told.split_once(": ").unwrap().1;
        let message = if message.starts_with("line ") {
            message.split_once(": ").unwrap().1
        } else {
            message
        };
        refuse(&out, readers(&["stats", "xyz", "profile", "pack", "compare"]), &["manifest.json", message]);
    }
}

/// The manifest says the units, and `conventions.json` must agree with it.
#[test]
fn conventions_that_are_gone_or_others_are_refused() {
    let name = "conventions.json";
    let (_dir, out) = copy();
    fs::remove_file(out.join(name)).unwrap();
    assert!(verified(&out).contains("  conventions.json: missing"));
    refuse(&out, &READERS[1..], &[name, "cannot read"]);

    let (_dir, out) = copy();
    let mut conventions = json(&out.join(name));
    assert_eq!(conventions["depth"]["units_per_m"], 1000.0);
    conventions["depth"]["units_per_m"] = 512.into();
    write_bytes(&out.join(name), conventions.to_string().as_bytes()).unwrap();
    refuse(&out, &READERS[1..], &[name, "is damaged"]);
    // As changed by a tool that also updates the list and the manifest.
    list_files(&out);
    let words = "depth units 512, normal axes paper, coordinates half; the manifest tells of depth units mm";
    assert!(verified(&out).contains(&format!("  conventions.json: {words}")));
    refuse(&out, &READERS[1..], &[name, words]);
}

#[test]
fn a_file_that_is_gone_cut_or_altered_is_refused_by_whoever_reads_it() {
    let out = export();
    let whole = |folder: &str, ending: &str| first(out, folder, ending);
    let altered = [
        (whole("area_1/data/rgb", ".png"), &["webdataset", "--copy-images"][..]),
        (whole("area_1/data/depth", ".png"), &["webdataset", "xyz", "nerfstudio", "parquet"]),
        (whole("area_1/pano/normal", ".png"), &["webdataset"]),
        (whole("area_1/data/semantic", ".png"), &["webdataset", "coco", "parquet"]),
        (whole("area_1/data/global_xyz", ".exr"), &["webdataset"]),
        (whole("area_1/data/pose", ".json"), &["webdataset", "xyz", "colmap", "nerfstudio", "parquet"]),
        ("area_1/3d/semantic.obj".to_owned(), &["stats"]),
        ("area_1/3d/rooms.json".to_owned(), &["stats"]),
        ("area_1/views.json".to_owned(), &["parquet"]),
        ("assets/semantic_labels.json".to_owned(), &["stats", "coco", "parquet"]),
        ("area_1/3d/rgb.obj".to_owned(), &["pointcept"]),
        ("s3dis/Area_1/office_1/Annotations/wall_2.txt".to_owned(), &["profile"]),
        ("files.csv".to_owned(), &["stats", "xyz", "profile", "pack"]),
    ];
    for (name, commands) in &altered {
        let (_dir, out) = copy();
        flip(&out.join(name));
        assert!(verified(&out).contains(&format!("  {name}: ")), "{name}");
        refuse(&out, readers(commands).chain(readers(&["compare"])), &[name]);
    }
    let cut = [
        ("area_1/3d/pointcloud.ply".to_owned(), &["stats", "colmap", "nerfstudio"][..]),
        (whole("area_1/pano/rgb", ".png"), &["stats", "webdataset", "coco", "parquet", "nerfstudio"]),
        ("s3dis/Area_1/Area_1_alignmentAngle.txt".to_owned(), &["pointcept"]),
    ];
    for (name, commands) in altered.iter().filter(|(name, _)| name != "files.csv").chain(&cut) {
        for gone in [true, false] {
            let (_dir, out) = copy();
            let bytes = fs::read(out.join(name)).unwrap();
            fs::remove_file(out.join(name)).unwrap();
            if !gone {
                fs::write(out.join(name), &bytes[..bytes.len() - 1]).unwrap();
            }
            assert!(verified(&out).contains(&format!("  {name}: ")), "{name}");
            refuse(&out, readers(commands).chain(readers(&["compare"])), &[name]);
        }
    }
    // The damaged export as the input of another export.
    for name in ["area_1/3d/semantic.obj".to_owned(), whole("area_1/data/pose", ".json")] {
        let (_dir, out) = copy();
        flip(&out.join(&name));
        let (area, new) = (out.join("area_1"), out.with_file_name("new"));
        let calls: [&[&str]; 2] = [&["info", text(&area)], &["export", text(&area), "-o", text(&new)]];
        refuse(&out, &calls, &[&name, "is damaged"]);
        fs::remove_file(out.join(&name)).unwrap();
        refuse(&out, &calls[..1], &[&name]);
    }
    // Files that no list names are no part of the data set: here one wall more, and one image more.
    let (_dir, out) = copy();
    let wall = out.join("s3dis/Area_1/office_1/Annotations/wall_9.txt");
    fs::write(&wall, "1 1 1 1 1 1\n").unwrap();
    refuse(&out, readers(&["profile"]), &["wall_9.txt", "files.csv does not name it"]);
}

/// Only regular files of the listed size are opened.
#[test]
fn pipes_and_files_without_end_stop_nobody_and_take_no_memory() {
    let out = export();
    let names = [
        "manifest.json",
        "files.csv",
        "conventions.json",
        "assets/semantic_labels.json",
        "area_1/views.json",
        "area_1/3d/rgb.obj",
        "area_1/3d/rgb.mtl",
        "area_1/3d/semantic.obj",
        "area_1/3d/pointcloud.ply",
        "area_1/3d/pointcloud.mat",
        "area_1/3d/instances.npz",
        "area_1/3d/votes.json",
        "splits/all.txt",
        "statistics.md",
        "s3dis/Area_1/Area_1_alignmentAngle.txt",
        "s3dis/Area_1/office_1/Annotations/wall_2.txt",
        &first(out, "area_1/data/depth", ".png"),
        &first(out, "area_1/pano/semantic", ".png"),
        &first(out, "area_1/data/global_xyz", ".exr"),
        &first(out, "area_1/data/pose", ".json"),
    ];
    for name in names {
        for pipe in [true, false] {
            let (_dir, out) = copy();
            let path = out.join(name);
            let bytes = fs::read(&path).unwrap();
            fs::remove_file(&path).unwrap();
            if pipe {
                assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
            } else {
                // A few bytes, then a hole of twelve gigabytes.
                write_bytes(&path, &bytes).unwrap();
                File::options()
                    .write(true)
                    .open(&path)
                    .unwrap()
                    .set_len(12 << 30)
                    .unwrap();
            }
            for args in READERS {
                let said = run(&out, args);
                let log = String::from_utf8_lossy(&said.stderr);
                let clean = !log.contains("panicked") && !log.contains("memory allocation");
                assert!(clean && said.status.code().is_some(), "{name} {args:?}: {log}");
                // Only `verify` reads every file.
                if args[0] == "verify" {
                    let report = String::from_utf8_lossy(&said.stdout);
                    let told = report.contains(&format!("  {name}: ")) || log.contains("no manifest.json");
                    assert!(told && !said.status.success(), "{name}: {report}{log}");
                }
            }
        }
    }
}
