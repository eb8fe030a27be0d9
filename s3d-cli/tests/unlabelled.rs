//! Scenes without labels: a scene file without annotations, and a mesh alone.

use crate::common;
use common::scan::{SMALL, Scan, run};
use common::{files, s3d, s3d_fails, s3d_ok, text, write_scan};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A scan whose scene file has no annotations.
fn unlabelled() -> Scan {
    let scan = Scan::new();
    scan.replace("scene.toml", "[annotations]\npath = \"Area_1\"\n", "");
    scan
}

fn export(scene: &Path, out: &Path, more: &[&str]) -> String {
    let mut args = vec!["export", text(scene), "-o", text(out)];
    args.extend(SMALL);
    args.extend(more);
    s3d_ok(&args)
}

fn manifest(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(out.join("manifest.json")).unwrap()).unwrap()
}

fn uuids(out: &Path) -> Vec<String> {
    let views: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("area_1/views.json")).unwrap()).unwrap();
    let mut uuids: Vec<String> = views
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v["camera_uuid"].as_str().unwrap().to_owned())
        .collect();
    uuids.dedup();
    uuids
}

/// The images of a data set except the poses, by name without their room.
fn images(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let is_image = |path: &PathBuf| text(path).contains("_domain_") && !text(path).ends_with(".json");
    let all = files(out).into_iter().filter(|(path, _)| is_image(path));
    all.map(|(path, bytes)| (text(&path).replace("office_1", "").replace("unknown_1", ""), bytes))
        .collect()
}

#[test]
fn all_but_the_labels_is_as_with_them() {
    let (labelled, scan) = (Scan::new(), unlabelled());
    let (with, without) = (labelled.out(), scan.out());
    // Without labels views have other scores, so all are kept.
    export(&labelled.scene, &with, &["--keep-all"]);
    export(&scan.scene, &without, &["--keep-all"]);
    let (mut with_images, without_images) = (images(&with), images(&without));
    with_images.retain(|path, _| !path.contains("/semantic"));
    assert!(without_images.len() >= 2 * 4 * 4 && with_images == without_images);
    let there: Vec<String> = files(&without).keys().map(|path| text(path).to_owned()).collect();
    for label in ["semantic", "instance", "rooms.json", "votes.json", "s3dis", "pointcloud.mat"] {
        assert!(!there.iter().any(|path| path.contains(label)), "{label} is there: {there:?}");
    }
    for file in ["area_1/3d/pointcloud.ply", "area_1/3d/rgb.obj", "splits.json", "statistics.md"] {
        assert!(there.iter().any(|path| path == file), "{file} is not there");
    }
    let manifest = manifest(&without);
    assert_eq!((&manifest["labels"], &manifest["labels_padded_to"]), (&0.into(), &0.into()));
    assert!(
        fs::read_to_string(without.join("statistics.md"))
            .unwrap()
            .contains("There are no labels.")
    );

    assert!(s3d_ok(&["verify", text(&without), "--full"]).is_empty());
    let stats = String::from_utf8(s3d(&["stats", text(&without)]).stdout).unwrap();
    assert!(stats.contains("regular images") && !stats.contains("beam"), "{stats}");
    let info = String::from_utf8(s3d(&["info", text(&scan.scene)]).stdout).unwrap();
    assert!(info.contains("annotations: none") && info.contains("unknown_1"), "{info}");
}

#[test]
fn views_are_selected_by_what_they_show_of_the_geometry() {
    let scan = unlabelled();
    let out = scan.out();
    let log = export(&scan.scene, &out, &[]);
    assert!(log.contains("selected 4 of 6 candidate views"), "{log}");
    let views: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("area_1/views.json")).unwrap()).unwrap();
    let entropies: Vec<f64> = views
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v["entropy"].as_f64().unwrap())
        .collect();
    assert!(entropies.iter().all(|e| (0.0..=26f64.ln()).contains(e)));
    assert!(entropies.iter().any(|e| *e > 0.5), "{entropies:?}");
    // `verify` computes the scores again: they are the same, and a changed score is found.
    fs::write(
        out.join("area_1/views.json"),
        fs::read_to_string(out.join("area_1/views.json")).unwrap().replacen(
            "\"entropy\": 1.",
            "\"entropy\": 2.",
            1,
        ),
    )
    .unwrap();
    let (code, log) = run(&["verify", text(&out), "--full"]);
    assert_eq!(code, Some(1), "{log}");
}

#[test]
fn what_needs_labels_says_so_before_work_begins() {
    let scan = unlabelled();
    let out = scan.out();
    let mut args = vec!["export", text(&scan.scene), "-o", text(&out)];
    args.extend(SMALL);
    for (option, value) in [("--profile", "pointnet"), ("--modalities", "semantic,semantic_pretty")] {
        let args = [&args[..], &[option, value]].concat();
        s3d_fails(&args, 2, &[option, "the scene has none"]);
        assert!(!out.exists());
    }
    export(&scan.scene, &out, &[]);
    let before = files(&out);
    s3d_fails(&["profile", text(&out), "--to", "pointnet"], 1, &["profiles need labels"]);
    let package = scan.dir.path().join("package");
    s3d_fails(&["pack", text(&out), "--to", "coco", "-o", text(&package)], 1, &["COCO needs labels"]);
    assert!(!package.exists() && files(&out) == before);
    s3d_fails(&["pack", text(&out), "--to", "pointcept", "-o", text(&package)], 1, &["need labels"]);
    assert!(!package.exists() && files(&out) == before);
    for kind in ["webdataset", "nerfstudio", "colmap", "huggingface", "dust3r", "wai", "vggt"] {
        let package = scan.dir.path().join(kind);
        s3d_ok(&["pack", text(&out), "--to", kind, "-o", text(&package)]);
    }
    let package = scan.dir.path().join("index.parquet");
    s3d_ok(&["pack", text(&out), "--to", "parquet", "-o", text(&package)]);
    assert!(package.is_file());

    // An unlabelled scene cannot be exported together with a labelled one.
    let other = write_scan(&scan.dir.path().join("other"), 2);
    let both = scan.dir.path().join("both");
    let args = ["export", text(&scan.scene), text(&other), "-o", text(&both)];
    s3d_fails(&args, 1, &["has labels", "has none", "data sets of their own"]);
}

#[test]
fn the_same_bytes_for_threads_shards_and_a_plan() {
    let scan = unlabelled();
    let whole = scan.out();
    export(&scan.scene, &whole, &["--threads", "1"]);
    let expected = files(&whole);
    let two = scan.dir.path().join("two");
    export(&scan.scene, &two, &["--threads", "2"]);
    assert!(files(&two) == expected);
    let plan = scan.dir.path().join("plan");
    s3d_ok(&["plan", text(&scan.scene), "-o", text(&plan), "--size", "32", "--views", "3"]);
    let parts: Vec<PathBuf> = (1..=2).map(|i| scan.dir.path().join(format!("part_{i}"))).collect();
    for (i, part) in (1..).zip(&parts) {
        export(&scan.scene, part, &["--shard", &format!("{i}/2"), "--plan", text(&plan)]);
    }
    let merged = scan.dir.path().join("merged");
    s3d_ok(&["merge", text(&parts[0]), text(&parts[1]), "-o", text(&merged)]);
    assert!(files(&merged) == expected);
    // It can be an input like any other area.
    let again = scan.dir.path().join("again");
    let log = export(&whole.join("area_1"), &again, &[]);
    assert!(log.contains("so that there are no labels") && uuids(&again) == uuids(&whole), "{log}");
}

#[test]
fn a_mesh_alone_is_enough() {
    let scan = Scan::new();
    let (mesh, out) = (scan.file("room.obj"), scan.out());
    let log = export(&mesh, &out, &[]);
    assert!(log.contains("+Y is taken for up") && log.contains("scan locations placed"), "{log}");
    assert!(s3d_ok(&["verify", text(&out), "--full"]).is_empty());
    let manifest = manifest(&out);
    let area = &manifest["areas"][0];
    assert_eq!((&area["area"], &area["see"]), (&1.into(), &0.95.into()));
    let seen = &area["surface_seen"];
    let [one, visible] = [&seen["seen_m2"][0], &seen["visible_m2"]].map(|v| v.as_f64().unwrap());
    assert!(one >= 0.95 * visible && visible > 40.0, "{seen}");

    // The request is remembered: the same call has nothing to do, and another axis or share is another data
    // set.
    assert!(export(&mesh, &out, &[]).contains("nothing to do"));
    let mut args = vec!["export", text(&mesh), "-o", text(&out)];
    args.extend(SMALL);
    let with = |more: &[&'static str]| [&args[..], more].concat();
    s3d_fails(&with(&["--up", "z", "--see", "0.5"]), 2, &["to see 0.95 of the surface there, to see 0.5"]);
    s3d_fails(&with(&["--see", "0.9", "--place-cameras", "2"]), 2, &["cannot be used with"]);
    s3d_fails(&with(&["--see", "1.5"]), 2, &["see: must be above 0, and at most 1"]);

    // A pattern of names instead, for two files that are one area.
    let text_of_mesh = fs::read_to_string(&mesh).unwrap();
    let (walls, table) = text_of_mesh.split_once("usemtl table").unwrap();
    scan.write("walls.obj", walls);
    let own: Vec<String> = table
        .replace("f 25/25 26/26 27/27 28/28", "f 1/1 2/2 3/3 4/4")
        .lines()
        .map(String::from)
        .collect();
    scan.write("table.obj", format!("mtllib room.mtl\nusemtl table{}", own.join("\n")));
    let joined = scan.dir.path().join("joined");
    let (walls, table) = (scan.file("walls.obj"), scan.file("table.obj"));
    let mut args = vec!["export", text(&walls), text(&table), "-o", text(&joined), "--place-cameras", "1"];
    args.extend(SMALL);
    s3d_ok(&args);
    let faces = |out: &Path| self::manifest(out)["areas"][0]["faces"].clone();
    assert_eq!(faces(&joined), faces(&out));
    assert!(uuids(&joined).len() > 2);
}

#[test]
fn a_wrong_axis_writes_no_black_images() {
    let scan = Scan::new();
    let (mesh, out) = (scan.file("room.obj"), scan.out());
    // The mesh is upside down and has no floor: nobody can stand on the back of a ceiling.
    let turned: String = fs::read_to_string(&mesh)
        .unwrap()
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => format!("f {}\n", corners.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        })
        .collect();
    scan.write("inside_out.obj", turned);
    let inside_out = scan.file("inside_out.obj");
    let mut args = vec!["export", text(&inside_out), "-o", text(&out)];
    args.extend(SMALL);
    s3d_fails(&args, 1, &["no place for a scan location inside", "inside out"]);
    let info = String::from_utf8(s3d(&["info", text(&mesh)]).stdout).unwrap();
    assert!(info.contains("+Y is taken for up") && info.contains("can be seen from somewhere"), "{info}");
}
