//! The same input and seed give the same bytes, for any number of threads.

use crate::common;
use common::{copyroom, files, s3d_ok, text, write_scan};
use s3d_io::dataset::Domain;
use std::path::Path;
use std::process::Command;

const SMALL: [&str; 8] = ["--size", "64", "--pano-width", "128", "--views", "12", "--points-per-m2", "300"];

fn export(scenes: &[&str], out: &Path, extra: &[&str]) {
    let mut args = vec!["export"];
    args.extend(scenes);
    args.extend(["-o", text(out)]);
    args.extend(SMALL);
    args.extend(extra);
    s3d_ok(&args);
}

fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    assert!(a.keys().eq(b.keys()), "other files");
    for (path, bytes) in &a {
        assert!(bytes == &b[path], "{} differs", path.display());
    }
}

#[test]
fn threads_and_repetition_change_no_byte() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    let outs = ["one", "two", "again"].map(|name| dir.path().join(name));
    for (out, threads) in outs.iter().zip(["1", "2", "2"]) {
        export(&[text(&scene)], out, &["--threads", threads]);
    }
    assert_same(&outs[0], &outs[1]);
    assert_same(&outs[0], &outs[2]);
}

#[test]
fn threads_change_no_byte_of_other_forms() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    let forms = ["--xyz", "float", "--normal-axes", "opencv", "--depth-units", "mm", "--pad-labels", "off"];
    let profiles = ["--profile", "pointcept,open3d-ml,mmdet3d,pointnet"];
    let outs = ["one", "two"].map(|name| dir.path().join(name));
    for (out, threads) in outs.iter().zip(["1", "2"]) {
        export(&[text(&scene)], out, &[&forms[..], &profiles, &["--threads", threads]].concat());
    }
    assert_same(&outs[0], &outs[1]);
    for file in
        ["pointnet/stanford_indoor3d/Area_1_office_1.npy", "open3d-ml/original_pkl/Area_1_office_1.pkl"]
    {
        assert!(outs[0].join("profiles").join(file).is_file(), "{file}");
    }
}

/// The levels are widths of vector registers. On a processor without them, all three runs are the same.
#[test]
fn instructions_change_no_byte() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    let export = |level: Option<&str>| {
        let out = dir.path().join(level.unwrap_or("any"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_s3d"));
        command
            .env_remove("S3D_SIMD")
            .envs(level.map(|level| ("S3D_SIMD", level)));
        let output = command
            .arg("export")
            .arg(&scene)
            .arg("-o")
            .arg(&out)
            .args(SMALL)
            .args(["--modalities", &Domain::ALL.map(|domain| domain.to_string()).join(",")])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        out
    };
    let any = export(None);
    for level in ["scalar", "avx2"] {
        assert_same(&any, &export(Some(level)));
    }
}

#[test]
fn a_real_scan_too() {
    let Some(scene) = copyroom() else { return };
    let dir = tempfile::tempdir().unwrap();
    let (a, b) = (dir.path().join("a"), dir.path().join("b"));
    export(&[text(&scene)], &a, &["--threads", "1"]);
    export(&[text(&scene)], &b, &["--threads", "2"]);
    assert_same(&a, &b);
}

#[test]
fn the_order_of_the_scenes_changes_no_byte() {
    let dir = tempfile::tempdir().unwrap();
    let one = write_scan(&dir.path().join("one"), 1);
    let five = write_scan(&dir.path().join("five"), 5);
    let (a, b) = (dir.path().join("a"), dir.path().join("b"));
    export(&[text(&one), text(&five)], &a, &[]);
    export(&[text(&five), text(&one)], &b, &[]);
    assert_same(&a, &b);
    let splits = std::fs::read_to_string(a.join("splits.json")).unwrap();
    assert!(splits.contains("\"fold\": 1"), "areas 1 and 5 allow fold 1: {splits}");
}

#[test]
fn another_seed_gives_other_views_and_only_keeps_the_selection() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    let [zero, seven, only] = ["zero", "seven", "only"].map(|name| dir.path().join(name));
    export(&[text(&scene)], &zero, &[]);
    export(&[text(&scene)], &seven, &["--seed", "7"]);
    export(&[text(&scene)], &only, &["--only", common::UUID_B]);
    let (zero, seven, only) = (files(&zero), files(&seven), files(&only));
    assert!(
        zero.iter()
            .any(|(path, bytes)| seven.get(path).is_some_and(|other| other != bytes))
    );
    let images = |f: &std::collections::BTreeMap<std::path::PathBuf, Vec<u8>>| {
        f.iter()
            .filter(|(p, _)| text(p).contains(common::UUID_B))
            .map(|(p, b)| (p.clone(), b.clone()))
            .collect::<Vec<_>>()
    };
    assert_eq!(images(&zero), images(&only));
    assert!(!only.keys().any(|p| text(p).contains(common::UUID_A)));
}

#[test]
fn compression_changes_sizes_and_nothing_that_is_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    let outs = ["fast", "balanced", "small"].map(|name| {
        let out = dir.path().join(name);
        export(&[text(&scene)], &out, &["--compression", name]);
        out
    });
    let [_, balanced, _] = &outs;
    let default = dir.path().join("default");
    export(&[text(&scene)], &default, &[]);
    assert_same(balanced, &default);
    let mut sizes = [0; 3];
    for path in files(balanced).keys() {
        let there = |i: usize| outs[i].join(path);
        let same = |i: usize| match path.extension().and_then(|e| e.to_str()) {
            Some("png") if text(path).contains("domain_depth") => {
                s3d_io::image::read_gray16(&there(i)).unwrap()
                    == s3d_io::image::read_gray16(&there(1)).unwrap()
            }
            Some("png") => {
                s3d_io::image::read_rgb8(&there(i)).unwrap() == s3d_io::image::read_rgb8(&there(1)).unwrap()
            }
            Some("exr") => {
                s3d_io::image::read_xyz(&there(i)).unwrap() == s3d_io::image::read_xyz(&there(1)).unwrap()
            }
            // The list has other sizes and checksums.
            _ if path.ends_with("files.csv") => true,
            // The manifest names the option.
            _ if path.ends_with("manifest.json") => {
                let manifest = std::fs::read_to_string(there(i)).unwrap();
                let name = ["fast", "balanced", "small"][i];
                manifest.contains(&format!("\"compression\": \"{name}\""))
            }
            _ => std::fs::read(there(i)).unwrap() == std::fs::read(there(1)).unwrap(),
        };
        for (i, size) in sizes.iter_mut().enumerate() {
            assert!(same(i), "{}", there(i).display());
            *size += std::fs::metadata(there(i)).unwrap().len();
        }
    }
    assert!(sizes[0] > sizes[1] && sizes[1] > sizes[2], "{sizes:?}");
}
