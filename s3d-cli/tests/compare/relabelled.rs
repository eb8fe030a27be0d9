//! A chair relabelled as a table. The differences are counted again from the files by other code.

use super::common::{s3d_ok, text};
use super::exports::{whole, with_scene};
use super::{compare, count, entry};
use s3d_io::dataset::{Domain, Layout, dataset_images, read_labels};
use s3d_io::image::read_rgb8;
use s3d_label::NULL_NAME;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

const SMALL: [&str; 12] = [
    "--size",
    "40",
    "--pano-width",
    "128",
    "--views",
    "4",
    "--points-per-m2",
    "40",
    "--compression",
    "fast",
    "--modalities",
    "semantic,pose",
];

/// The built-in scene, and a copy in which a chair became a table.
fn scenes() -> (PathBuf, PathBuf) {
    static SCENES: OnceLock<TempDir> = OnceLock::new();
    let dir = SCENES.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let demo = dir.path().join("demo");
        let tiny = ["--size", "16", "--pano-width", "16", "--views", "0", "--points-per-m2", "1"];
        s3d_ok(&[&["demo", "-o", text(&demo)][..], &tiny].concat());
        let scene = demo.join("scan/scene.toml");
        let export = |name: &str| {
            let out = dir.path().join(name);
            s3d_ok(&[&["export", text(&scene), "-o", text(&out), "--keep-all"], &SMALL[..]].concat());
        };
        export("before");
        let room = demo.join("scan/Area_1/conferenceRoom_1/Annotations");
        assert!(!room.join("table_2.txt").exists());
        fs::rename(room.join("chair_3.txt"), room.join("table_2.txt")).unwrap();
        export("after");
        dir
    });
    (dir.path().join("before"), dir.path().join("after"))
}

/// Faces, m² and pixels by name in A and name in B, where the names differ.
type Recount = BTreeMap<(String, String), (u64, f64, u64)>;

/// The corners and the label of each face of `semantic.obj`, in file order.
fn faces(out: &Path) -> Vec<([[f64; 3]; 3], String)> {
    let (mut vertices, mut faces, mut name) = (Vec::new(), Vec::new(), String::new());
    for line in fs::read_to_string(out.join("area_1/3d/semantic.obj")).unwrap().lines() {
        let mut words = line.split(' ');
        match words.next().unwrap() {
            "v" => {
                let v: Vec<f64> = words.take(3).map(|word| word.parse().unwrap()).collect();
                vertices.push([v[0], v[1], v[2]]);
            }
            "usemtl" => name = words.next().unwrap().to_owned(),
            "f" => {
                let f: Vec<usize> = words.map(|word| word.parse().unwrap()).collect();
                faces.push(([f[0], f[1], f[2]].map(|i| vertices[i - 1]), name.clone()));
            }
            _ => {}
        }
    }
    faces
}

/// The area by Heron's formula.
fn area(corners: [[f64; 3]; 3]) -> f64 {
    let side = |i: usize, j: usize| -> f64 {
        (0..3)
            .map(|k| (corners[i][k] - corners[j][k]).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let (a, b, c) = (side(0, 1), side(1, 2), side(2, 0));
    let s = (a + b + c) / 2.0;
    (s * (s - a) * (s - b) * (s - c)).max(0.0).sqrt()
}

fn recount(a: &Path, b: &Path) -> Recount {
    let mut all = Recount::new();
    let (faces_a, faces_b) = (faces(a), faces(b));
    assert_eq!(faces_a.len(), faces_b.len());
    for ((corners, name), (_, other)) in faces_a.into_iter().zip(faces_b) {
        if name != other {
            let counts = all.entry((name, other)).or_default();
            counts.0 += 1;
            counts.1 += area(corners);
        }
    }
    let [names_a, names_b] = [a, b].map(|out| read_labels(&Layout::new(out).labels_json()).unwrap());
    for image in dataset_images(&Layout::new(a), 1).unwrap() {
        // All candidates are kept, so the names of files are the same.
        let [one, other] =
            [a, b].map(|out| read_rgb8(&out.join(image.relative_path(Domain::Semantic))).unwrap());
        for (&p, &q) in one.pixels().iter().zip(other.pixels()) {
            let name = |names: &[String], p: [u8; 3]| match p {
                [13, 13, 13] => "nothing".to_owned(),
                [r, g, b] => names[usize::from(r) * 65_536 + usize::from(g) * 256 + usize::from(b)].clone(),
            };
            let (name, other) = (name(&names_a, p), name(&names_b, q));
            if name != other {
                all.entry((name, other)).or_default().2 += 1;
            }
        }
    }
    all
}

#[track_caller]
fn is(found: &Value, (faces, m2, pixels): (u64, f64, u64)) {
    assert_eq!((&found["faces"], &found["pixels"]), (&faces.into(), &pixels.into()), "{found}");
    assert!((found["m2"].as_f64().unwrap() - m2).abs() <= 1e-4 * m2, "{found} {m2}");
}

fn sum<'c>(counts: impl Iterator<Item = &'c (u64, f64, u64)>) -> (u64, f64, u64) {
    counts.fold((0, 0.0, 0), |sum, of| (sum.0 + of.0, sum.1 + of.1, sum.2 + of.2))
}

#[test]
fn a_chair_that_became_a_table_is_told_by_faces_surface_and_pixels() {
    let (a, b) = scenes();
    let (answer, json, code) = compare(&a, &b);
    assert_eq!((code, count(&json["unread"]), &json["areas"][0]["geometry"]), (1, 0, &"same".into()));
    let all = recount(&a, &b);
    let labels = &json["labels"];

    // Instances are numbered by class: the later chairs and the tables have other names now.
    let [names_a, names_b] = [&a, &b].map(|out| read_labels(&Layout::new(out).labels_json()).unwrap());
    let alone = |names: &[String], others: &[String]| -> BTreeSet<String> {
        names.iter().filter(|name| !others.contains(name)).cloned().collect()
    };
    let listed = |list: &Value| -> BTreeSet<String> {
        list.as_array()
            .unwrap()
            .iter()
            .map(|name| name.as_str().unwrap().to_owned())
            .collect()
    };
    let (gone, added) = (alone(&names_a, &names_b), alone(&names_b, &names_a));
    assert_eq!((listed(&labels["gone"]), listed(&labels["added"])), (gone, added));
    assert_eq!(labels["a"], labels["b"]);

    let class = |name: &str| name.split('_').next().unwrap().to_owned();
    let mut by_class: BTreeMap<(String, String), (u64, f64, u64)> = BTreeMap::new();
    for ((one, other), counts) in &all {
        let pair = by_class.entry((class(one), class(other))).or_default();
        *pair = sum([*pair, *counts].iter());
    }
    let table = by_class[&("chair".to_owned(), "table".to_owned())];
    assert!(table.0 > 10 && table.1 > 0.3 && table.2 > 10, "{table:?}");
    assert!(by_class[&("chair".to_owned(), "chair".to_owned())].0 > 10);
    assert_eq!(count(&labels["matrix"]), by_class.len());
    for pair in labels["matrix"].as_array().unwrap() {
        let key = [&pair["a"], &pair["b"]].map(|class| class.as_str().unwrap().to_owned());
        is(pair, by_class[&key.into()]);
    }
    assert_eq!((&labels["matrix"][0]["a"], &labels["matrix"][0]["b"]), (&"chair".into(), &"table".into()));
    is(&labels["changed"], sum(all.values()));
    let others = all.iter().filter(|((one, other), _)| class(one) != class(other));
    is(&labels["class_changed"], sum(others.map(|(_, counts)| counts)));
    let area = &json["areas"][0];
    assert_eq!(area["faces_changed"], labels["changed"]["faces"]);

    // What each instance lost and gained. First come the two that changed class.
    let of_both = all
        .iter()
        .filter(|((one, other), _)| class(one) == "chair" && class(other) == "table");
    let ((chair, table_name), _) = of_both.max_by_key(|(_, counts)| counts.0).unwrap();
    assert!(chair.contains("_conferenceRoom_1_") && table_name.contains("_conferenceRoom_1_"));
    let first: Vec<&str> = (0..2)
        .map(|i| labels["instances"][i]["name"].as_str().unwrap())
        .collect();
    assert!(first.contains(&&**chair) && first.contains(&&**table_name), "{first:?} {chair} {table_name}");
    let instances = labels["instances"].as_array().unwrap();
    for of in instances {
        let name = of["name"].as_str().unwrap();
        is(&of["lost"], sum(all.iter().filter(|((one, _), _)| one == name).map(|(_, c)| c)));
        is(&of["gained"], sum(all.iter().filter(|((_, other), _)| other == name).map(|(_, c)| c)));
        let others = all.iter().filter(|((one, other), _)| class(one) != class(other));
        let own = others.filter(|((one, other), _)| one == name || other == name);
        is(&of["class_changed"], sum(own.map(|(_, counts)| counts)));
    }
    let changed: BTreeSet<&str> = all.keys().flat_map(|(one, other)| [&**one, &**other]).collect();
    let changed = changed
        .into_iter()
        .filter(|name| *name != NULL_NAME && *name != "nothing");
    assert_eq!(instances.len(), changed.count().min(50));

    let semantic = entry(&json["modalities"], "modality", "semantic");
    assert_eq!(semantic["pixels_changed"], labels["changed"]["pixels"]);
    let input = &json["inputs"][0];
    assert_eq!((count(&json["inputs"]), &input["path"]), (1, &"Area_1/".into()));
    let begins = |words: &[&str]| {
        answer
            .lines()
            .any(|line| line.split_whitespace().take(words.len()).eq(words.iter().copied()))
    };
    assert!(
        begins(&["chair", "table", &table.0.to_string()]) && begins(&["chair", "another", "chair"]),
        "{answer}"
    );
    assert!(begins(&[chair.as_str()]) && begins(&[table_name.as_str()]), "{answer}");

    // In the other order, lost and gained change places.
    let (_, back, _) = compare(&b, &a);
    assert_eq!(back["labels"]["gone"], labels["added"]);
    let pair = back["labels"]["matrix"].as_array().unwrap();
    let pair = pair
        .iter()
        .find(|pair| pair["a"] == "table" && pair["b"] == "chair")
        .unwrap();
    is(pair, table);
}

#[test]
fn other_classes_are_compared_by_name() {
    let more = ["--modalities", "semantic,semantic_class,pose"];
    let nyu = with_scene("nyu40", |scene| format!("taxonomy = \"nyu40\"\n{scene}"), &more);
    let (answer, json, code) = compare(whole(), &nyu);
    assert_eq!(code, 1);
    let note = "note: classes are those of s3dis in A and of nyu40 in B; they were compared by name";
    assert!(answer.contains(note), "{answer}");
    // Floor, ceiling, wall and table have the same names in both.
    assert_eq!((count(&json["labels"]["added"]), count(&json["labels"]["gone"])), (0, 0), "{answer}");
    assert_eq!((count(&json["labels"]["matrix"]), &json["areas"][0]["geometry"]), (0, &"same".into()));
    let of = |modality: &str| entry(&json["modalities"], "modality", modality).clone();
    // The numbers of the classes differ, but the pixels mean the same.
    let class = of("semantic_class");
    assert_eq!((&class["same_pixels"], &class["changed"]), (&12.into(), &0.into()), "{answer}");
    assert_eq!(of("semantic")["changed"], 0);
    assert_eq!(of("rgb")["only_a"], 12);
}

#[test]
fn one_without_labels_is_compared_by_all_else() {
    let bare = with_scene(
        "bare",
        |scene| scene.replace("[annotations]\npath = \"Area_1\"\n", ""),
        &["--modalities", "rgb,depth,pose"],
    );
    let (answer, json, code) = compare(whole(), &bare);
    assert_eq!(code, 1);
    assert!(answer.contains("note: only A has labels"), "{answer}");
    let labels = &json["labels"];
    assert_eq!((&labels["a"], &labels["b"], count(&labels["gone"])), (&7.into(), &0.into(), 7));
    assert_eq!((count(&labels["matrix"]), &json["b"]["taxonomy"]), (0, &Value::Null));
    let of = |modality: &str| entry(&json["modalities"], "modality", modality).clone();
    assert_eq!((&of("rgb")["same"], &of("depth")["same"]), (&12.into(), &12.into()), "{answer}");
    // The poses and the names of the files name another room.
    let poses = &json["poses"];
    assert_eq!((&of("semantic")["only_a"], &poses["same_camera"]), (&12.into(), &12.into()), "{answer}");
    let (answer, json, code) = compare(&bare, &bare);
    assert_eq!((code, &json["labels"]), (0, &Value::Null), "{answer}");
}
