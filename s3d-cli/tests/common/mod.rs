//! Shared by the tests of the command line: runs the real binary and writes a small scan for it.
#![allow(dead_code)]

pub(crate) mod scan;

use s3d_io::dataset::{FileRecord, Layout, write_file_list};
use s3d_io::fs::write_bytes;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Runs `s3d` with these arguments.
pub(crate) fn s3d(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_s3d"))
        .args(args)
        .output()
        .expect("the binary starts")
}

/// Runs `s3d`, which must succeed; returns its log.
pub(crate) fn s3d_ok(args: &[&str]) -> String {
    let out = s3d(args);
    let log = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success(), "s3d {args:?} failed: {log}");
    log
}

/// Runs `s3d`, which must fail with this exit code, without a panic, and with a message that contains every
/// one of these parts.
pub(crate) fn s3d_fails(args: &[&str], code: i32, parts: &[&str]) {
    let out = s3d(args);
    let log = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(code), "s3d {args:?}: {log}");
    assert!(!log.contains("panicked"), "{log}");
    for part in parts {
        assert!(log.contains(part), "s3d {args:?} should tell of {part:?}, but says: {log}");
    }
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("a path that is text")
}

pub(crate) const UUID_A: &str = "00112233445566778899aabbccddeeff";
pub(crate) const UUID_B: &str = "ffeeddccbbaa99887766554433221100";

/// A closed room of 4 × 3 × 2.5 m with a table in it, its annotation and two scan locations, all in `dir`.
/// Returns the scene file.
pub(crate) fn write_scan(dir: &Path, area: u32) -> PathBuf {
    fs::create_dir_all(dir).unwrap();
    let mut obj = String::from("mtllib room.mtl\n");
    let mut corners = 0;
    let mut annotations: BTreeMap<&str, String> = BTreeMap::new();
    // A quad o, o + u, o + u + v, o + v in world coordinates, counter-clockwise as seen from inside. The file
    // is Y-up.
    let mut quad = |name: &'static str, o: [f64; 3], u: [f64; 3], v: [f64; 3]| {
        let at = |s: f64, t: f64| -> [f64; 3] { std::array::from_fn(|k| o[k] + s * u[k] + t * v[k]) };
        let _ = writeln!(obj, "usemtl {}", name.split('_').next().unwrap());
        for (s, t) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            let [x, y, z] = at(s, t);
            let _ = writeln!(obj, "v {x} {z} {}\nvt {s} {t}", -y);
        }
        let c = corners;
        let _ = writeln!(obj, "f {0}/{0} {1}/{1} {2}/{2} {3}/{3}", c + 1, c + 2, c + 3, c + 4);
        corners += 4;
        let points = annotations.entry(name).or_default();
        for i in 0..20 {
            for j in 0..20 {
                let [x, y, z] = at((f64::from(i) + 0.5) / 20.0, (f64::from(j) + 0.5) / 20.0);
                let _ = writeln!(points, "{x:.3} {y:.3} {z:.3} {} {} 128", 10 * i, 10 * j);
            }
        }
    };
    let (x, y, z) = (4.0, 3.0, 2.5);
    quad("floor_1", [0.0, 0.0, 0.0], [x, 0.0, 0.0], [0.0, y, 0.0]);
    quad("ceiling_1", [0.0, 0.0, z], [0.0, y, 0.0], [x, 0.0, 0.0]);
    quad("wall_1", [0.0, 0.0, 0.0], [0.0, 0.0, z], [x, 0.0, 0.0]);
    quad("wall_2", [0.0, y, 0.0], [x, 0.0, 0.0], [0.0, 0.0, z]);
    quad("wall_3", [0.0, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]);
    quad("wall_4", [x, 0.0, 0.0], [0.0, 0.0, z], [0.0, y, 0.0]);
    quad("table_1", [1.0, 2.0, 0.7], [1.2, 0.0, 0.0], [0.0, 0.6, 0.0]);
    fs::write(dir.join("room.obj"), obj).unwrap();
    fs::write(
        dir.join("room.mtl"),
        "newmtl floor\nKd 0.5 0.4 0.3\nnewmtl ceiling\nKd 0.9 0.9 0.9\nnewmtl wall\nKd 0.8 0.8 0.7\n\
         newmtl table\nKd 0.6 0.3 0.1\n",
    )
    .unwrap();
    let folder = dir.join(format!("Area_{area}/office_1/Annotations"));
    fs::create_dir_all(&folder).unwrap();
    for (name, points) in annotations {
        fs::write(folder.join(format!("{name}.txt")), points).unwrap();
    }
    let (a, b) = if area == 1 {
        (UUID_A.to_owned(), UUID_B.to_owned())
    } else {
        uuids_of(area)
    };
    fs::write(
        dir.join("cameras.csv"),
        format!("{a},2.0,1.2,1.5,0,0,0,1\n{b},3.0,0.8,1.4,0,0,0.5,0.8660254\n"),
    )
    .unwrap();
    let scene = dir.join("scene.toml");
    fs::write(
        &scene,
        format!(
            "area = {area}\n[mesh]\npath = \"room.obj\"\nup = \"y\"\n[annotations]\npath = \"Area_{area}\"\n\
             [cameras]\npath = \"cameras.csv\"\n"
        ),
    )
    .unwrap();
    scene
}

fn uuids_of(area: u32) -> (String, String) {
    (format!("{area:032x}"), format!("{:032x}", area + 1000))
}

/// Every file below `dir`, by its path relative to it.
pub(crate) fn files(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                all.insert(path.strip_prefix(dir).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    all
}

/// Writes the list of files anew, and its entry in the manifest, as a tool would that knew of both and made
/// the fault.
pub(crate) fn list_files(out: &Path) {
    let layout = Layout::new(out);
    let ours = |path: &PathBuf| {
        let at = out.join(path);
        !path.starts_with("scan") && at != layout.manifest() && at != layout.file_list()
    };
    let paths = files(out).into_keys().filter(ours);
    let records: Vec<FileRecord> = paths
        .map(|path| FileRecord::of_file(out, &out.join(path)).unwrap())
        .collect();
    let (_, sum) = write_file_list(&layout.file_list(), &records).unwrap();
    let bytes: u64 = records.iter().map(|r| r.bytes).sum();
    let mut manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(layout.manifest()).unwrap()).unwrap();
    manifest["files"] = serde_json::json!({
        "list": "files.csv", "count": records.len(), "bytes": bytes, "xxh3_128": sum.to_string()
    });
    // As in data sets of earlier versions, the manifest has no checksum of itself.
    manifest.as_object_mut().unwrap().remove("xxh3_128");
    write_bytes(&layout.manifest(), manifest.to_string().as_bytes()).unwrap();
}

/// The real scan beside the checkout, if it is there.
#[allow(clippy::print_stderr, reason = "a test that is skipped says so")]
pub(crate) fn copyroom() -> Option<PathBuf> {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scans/copyroom/scene.toml");
    if scene.exists() {
        return Some(scene);
    }
    eprintln!("skipped: {} is not there", scene.display());
    None
}
