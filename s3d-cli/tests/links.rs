//! What lies behind a link in the folder of a data set stays as it is: the call is refused before it writes.
#![cfg(unix)]

use crate::common;
use common::scan::{Scan, listing};
use common::{s3d_fails, s3d_ok, text};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// Files of somebody else, with the names that s3d would remove or replace.
fn elsewhere(scan: &Scan) -> PathBuf {
    let folder = scan.file("elsewhere");
    for name in ["mine.txt", "journal/1.jsonl", "lock", "change/new/x", "data/rgb/x.png", "pointnet/x"] {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "mine").unwrap();
    }
    folder
}

/// Calls that must be refused because of `link`, and must change nothing.
fn refused(scan: &Scan, calls: &[Vec<&str>], link: &Path) {
    let target = fs::read_link(link).unwrap();
    let before = listing(scan.dir.path());
    for args in calls {
        s3d_fails(args, 2, &[text(link), text(&target), "remove the link"]);
        assert_eq!(listing(scan.dir.path()), before, "{args:?}");
    }
}

fn with<'a>(args: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [args, more].concat()
}

#[test]
fn a_link_as_working_folder_is_refused() {
    let scan = Scan::new();
    let elsewhere = elsewhere(&scan);
    let out = scan.out();
    let export = scan.args(&out);
    let overwrite = with(&export, &["--overwrite", "--seed", "5"]);
    let shard = with(&export, &["--shard", "1/2"]);
    let plan = vec!["plan", text(&scan.scene), "-o", text(&out)];

    fs::create_dir(&out).unwrap();
    for name in [".s3d", ".s3d-previous", ".s3d-previous.part", ".s3d-trash"] {
        let link = out.join(name);
        symlink(&elsewhere, &link).unwrap();
        refused(&scan, &[export.clone(), overwrite.clone(), shard.clone()], &link);
        if name == ".s3d" {
            refused(&scan, std::slice::from_ref(&plan), &link);
        }
        fs::remove_file(&link).unwrap();
    }

    // A data set that is there, and links in `.s3d`, one of them to nowhere.
    s3d_ok(&export);
    let profile = vec!["profile", text(&out), "--to", "pointnet"];
    let xyz = vec!["xyz", text(&out), "--overwrite"];
    let calls = [overwrite, profile, xyz];
    let link = out.join(".s3d");
    symlink(&elsewhere, &link).unwrap();
    refused(&scan, &calls, &link);
    fs::remove_file(&link).unwrap();

    fs::create_dir(&link).unwrap();
    for (name, target) in [("change", elsewhere.clone()), ("lock", scan.file("nowhere"))] {
        let link = link.join(name);
        symlink(&target, &link).unwrap();
        refused(&scan, &calls, &link);
        fs::remove_file(&link).unwrap();
    }
    for args in &calls {
        s3d_ok(args);
    }
}

#[test]
fn a_link_as_folder_of_the_data_set_is_refused() {
    let scan = Scan::new();
    let elsewhere = elsewhere(&scan);
    let out = scan.out();
    let export = scan.args(&out);
    let overwrite = with(&export, &["--overwrite", "--seed", "5"]);
    let profile = vec!["profile", text(&out), "--to", "pointnet", "--overwrite"];
    let xyz = vec!["xyz", text(&out), "--overwrite"];
    s3d_ok(&export);

    for (name, calls) in [
        ("area_1", vec![&overwrite, &xyz]),
        ("area_1/data", vec![&overwrite, &xyz]),
        ("area_1/data/depth", vec![&overwrite]),
        ("s3dis/Area_1", vec![&overwrite]),
        ("profiles", vec![&overwrite, &profile]),
    ] {
        let link = out.join(name);
        let aside = scan.file("aside");
        let was_there = link.exists();
        if was_there {
            fs::rename(&link, &aside).unwrap();
        }
        // The images of a linked folder can still be read.
        symlink(if was_there { &aside } else { &elsewhere }, &link).unwrap();
        let calls: Vec<Vec<&str>> = calls.into_iter().cloned().collect();
        refused(&scan, &calls, &link);
        fs::remove_file(&link).unwrap();
        if was_there {
            fs::rename(&aside, &link).unwrap();
        }
    }
}

#[test]
fn a_link_in_a_new_folder_is_refused() {
    let scan = Scan::new();
    let elsewhere = elsewhere(&scan);
    let out = scan.out();
    let overwrite = with(&scan.args(&out), &["--overwrite", "--seed", "5"]);
    let plan = vec!["plan", text(&scan.scene), "-o", text(&out)];
    fs::create_dir(&out).unwrap();
    for name in ["area_1", "assets", "splits"] {
        let link = out.join(name);
        symlink(&elsewhere, &link).unwrap();
        refused(&scan, std::slice::from_ref(&overwrite), &link);
        fs::remove_file(&link).unwrap();
    }

    s3d_ok(&plan);
    fs::rename(out.join("area_1"), scan.file("aside")).unwrap();
    symlink(scan.file("aside"), out.join("area_1")).unwrap();
    refused(&scan, &[plan], &out.join("area_1"));
}

#[test]
fn the_output_folder_itself_may_be_a_link() {
    let scan = Scan::new();
    let real = scan.file("disk/real");
    fs::create_dir_all(&real).unwrap();
    let out = scan.file("link");
    symlink(&real, &out).unwrap();
    s3d_ok(&scan.args(&out));
    s3d_ok(&with(&scan.args(&out), &["--overwrite", "--seed", "5"]));
    s3d_ok(&["profile", text(&out), "--to", "pointnet"]);
    s3d_ok(&["verify", text(&out)]);
    assert!(out.is_symlink() && real.join("manifest.json").is_file());
}
