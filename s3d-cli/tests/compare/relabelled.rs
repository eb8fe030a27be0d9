//! A chair relabelled as a table, and two sofas that became one. The differences are counted again from the
//! files by other code.

use super::common::{s3d_ok, text};
use super::exports::{altered, whole, with_scene};
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
    "semantic,semantic_pretty,pose",
];

/// The built-in scene, and a copy in which a chair became a table, and two sofas one. Later chairs and tables
/// have other numbers there.
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
        let lounge = demo.join("scan/Area_1/lounge_1/Annotations");
        let sofas = ["sofa_1.txt", "sofa_2.txt"].map(|name| lounge.join(name));
        let points = sofas.each_ref().map(|path| fs::read_to_string(path).unwrap());
        fs::write(&sofas[0], points.concat()).unwrap();
        fs::remove_file(&sofas[1]).unwrap();
        export("after");
        dir
    });
    (dir.path().join("before"), dir.path().join("after"))
}

/// Faces, m² and pixels by name in A and name in B.
type Recount = BTreeMap<(String, String), (u64, f64, u64)>;

/// The class of a label.
fn class(name: &str) -> String {
    name.split('_').next().unwrap().to_owned()
}

/// Instances of A and B that share over half of the surface of both together. None has two such partners.
fn partners(all: &Recount) -> BTreeMap<&str, &str> {
    let surface = |is_of: &dyn Fn(&str, &str) -> bool| -> f64 {
        let counts = all.iter().filter(|((one, other), _)| is_of(one, other));
        counts.map(|(_, counts)| counts.1).sum()
    };
    let partners = all.keys().filter(|(a, b)| {
        let shared = surface(&|one, other| one == a && other == b);
        let united = surface(&|one, other| one == a || other == b);
        a != NULL_NAME && b != NULL_NAME && shared > united / 2.0
    });
    partners.map(|(a, b)| (a.as_str(), b.as_str())).collect()
}

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
        let counts = all.entry((name, other)).or_default();
        counts.0 += 1;
        counts.1 += area(corners);
    }
    for (labels, pixels) in images(a, b).concat() {
        all.entry(labels).or_default().2 += pixels;
    }
    all
}

/// The pixels of each image by name in A and name in B, where their values or names differ.
fn images(a: &Path, b: &Path) -> Vec<Vec<((String, String), u64)>> {
    let [names_a, names_b] = [a, b].map(|out| read_labels(&Layout::new(out).labels_json()).unwrap());
    let mut images = Vec::new();
    for image in dataset_images(&Layout::new(a), 1).unwrap() {
        // All candidates are kept, so the names of files are the same.
        let [one, other] =
            [a, b].map(|out| read_rgb8(&out.join(image.relative_path(Domain::Semantic))).unwrap());
        let mut counts: BTreeMap<(String, String), u64> = BTreeMap::new();
        for (&p, &q) in one.pixels().iter().zip(other.pixels()) {
            let name = |names: &[String], p: [u8; 3]| match p {
                [13, 13, 13] => "nothing".to_owned(),
                [r, g, b] => names[usize::from(r) * 65_536 + usize::from(g) * 256 + usize::from(b)].clone(),
            };
            let (name, other) = (name(&names_a, p), name(&names_b, q));
            if p != q || name != other {
                *counts.entry((name, other)).or_default() += 1;
            }
        }
        images.push(counts.into_iter().collect());
    }
    images
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
fn what_changed_is_told_from_what_has_another_number() {
    let (a, b) = scenes();
    let (answer, json, code) = compare(&a, &b);
    assert_eq!((code, count(&json["unread"]), &json["areas"][0]["geometry"]), (1, 0, &"same".into()));
    let all = recount(&a, &b);
    let labels = &json["labels"];

    let partners = partners(&all);
    let is_changed = |one: &str, other: &str| {
        let is_none = [one, other].iter().any(|name| *name == NULL_NAME || *name == "nothing");
        let is_same = if is_none {
            one == other
        } else {
            partners.get(one) == Some(&other)
        };
        !is_same || class(one) != class(other)
    };
    let changed: Recount = all
        .iter()
        .filter(|((one, other), _)| is_changed(one, other))
        .map(|(labels, counts)| (labels.clone(), *counts))
        .collect();

    // Far more faces have another number than changed.
    let renumbered: BTreeSet<(&str, &str)> = partners
        .iter()
        .filter(|(one, other)| one != other && class(one) == class(other))
        .map(|(one, other)| (*one, *other))
        .collect();
    assert!(renumbered.len() > 5, "{renumbered:?}");
    let told = labels["renumbered"].as_array().unwrap();
    let name = |value: &Value| value.as_str().unwrap().to_owned();
    let mut others = (0, 0.0, 0);
    for of in told {
        let pair = (name(&of["a"]), name(&of["b"]));
        assert!(renumbered.contains(&(&pair.0, &pair.1)), "{pair:?}");
        is(of, all[&pair]);
        others = sum([others, all[&pair]].iter());
    }
    assert_eq!((told.len(), count(&labels["other_room"])), (renumbered.len(), 0));
    let line = format!("  renumbered, and not changed: {} instances, ", renumbered.len());
    assert!(answer.contains(&line), "{answer}");

    let mut by_class: BTreeMap<(String, String), (u64, f64, u64)> = BTreeMap::new();
    for ((one, other), counts) in &changed {
        let pair = by_class.entry((class(one), class(other))).or_default();
        *pair = sum([*pair, *counts].iter());
    }
    let of = |one: &str, other: &str| by_class[&(one.to_owned(), other.to_owned())];
    let (table, sofa) = (of("chair", "table"), of("sofa", "sofa"));
    assert!(table.0 > 10 && table.1 > 0.3 && table.2 > 10 && others.0 > 5 * table.0, "{table:?} {others:?}");
    assert_eq!(count(&labels["matrix"]), by_class.len());
    for pair in labels["matrix"].as_array().unwrap() {
        let key = [&pair["a"], &pair["b"]].map(|class| class.as_str().unwrap().to_owned());
        is(pair, by_class[&key.into()]);
    }
    assert_eq!((&labels["matrix"][0]["a"], &labels["matrix"][0]["b"]), (&"chair".into(), &"table".into()));
    is(&labels["changed"], sum(changed.values()));
    let other_class = changed.iter().filter(|((one, other), _)| class(one) != class(other));
    is(&labels["class_changed"], sum(other_class.map(|(_, counts)| counts)));
    assert_eq!(json["areas"][0]["faces_changed"], labels["changed"]["faces"]);

    // Both objects, and nothing else.
    let [first, second] = &labels["instances"].as_array().unwrap()[..] else { panic!("{labels:#}") };
    let (chair, table_name) = partners.iter().find(|(one, other)| class(one) != class(other)).unwrap();
    assert!(chair.starts_with("chair_3_conferenceRoom_1_") && table_name.starts_with("table_"));
    assert_eq!(
        (&first["kind"], &first["a"], &first["b"]),
        (&"class".into(), &[*chair].into(), &[*table_name].into())
    );
    let [one, two] = ["sofa_1_lounge_1_1", "sofa_2_lounge_1_1"];
    assert_eq!(
        (&second["kind"], &second["a"], &second["b"]),
        (&"merged".into(), &[one, two].into(), &[one].into())
    );
    for (of, counts) in [(first, table), (second, sofa)] {
        is(&of["relabelled"], counts);
        is(&of["lost"], (0, 0.0, 0));
        is(&of["gained"], (0, 0.0, 0));
        assert!((of["m2_a"].as_f64().unwrap() - of["m2_b"].as_f64().unwrap()).abs() < 1e-6, "{of}");
    }
    assert_eq!((&labels["gone"], &labels["added"]), (&[two].into(), &Value::Array(Vec::new())));

    // Images in which something changed, and images in which numbers alone are others.
    let images = images(&a, &b);
    let is_true =
        |of: &&Vec<((String, String), u64)>| of.iter().any(|((one, other), _)| is_changed(one, other));
    let true_images = images.iter().filter(is_true).count();
    let other_numbers = images.iter().filter(|of| !of.is_empty()).count() - true_images;
    assert!(true_images > 3 && other_numbers > 3, "{true_images} {other_numbers}");
    for modality in ["semantic", "semantic_pretty"] {
        let of = entry(&json["modalities"], "modality", modality);
        assert_eq!((&of["changed"], &of["renumbered"]), (&true_images.into(), &other_numbers.into()), "{of}");
        assert_eq!(of["pixels_changed"], labels["changed"]["pixels"]);
    }
    assert_eq!(count(&json["images"]), 2 * true_images);

    let input = &json["inputs"][0];
    assert_eq!((count(&json["inputs"]), &input["path"]), (1, &"Area_1/".into()));
    let begins = |words: &[&str]| {
        answer
            .lines()
            .any(|line| line.split_whitespace().take(words.len()).eq(words.iter().copied()))
    };
    assert!(
        begins(&["chair", "table", &table.0.to_string()]) && begins(&["sofa", "another", "sofa"]),
        "{answer}"
    );
    assert!(begins(&[chair, table_name]) && begins(&[one, "+", two, one]), "{answer}");

    // In the other order, the sofa is split.
    let (_, back, _) = compare(&b, &a);
    assert_eq!(
        (&back["labels"]["added"], &back["labels"]["instances"][1]["kind"]),
        (&[two].into(), &"split".into())
    );
    let pair = back["labels"]["matrix"].as_array().unwrap();
    let pair = pair
        .iter()
        .find(|pair| pair["a"] == "table" && pair["b"] == "chair")
        .unwrap();
    is(pair, table);
}

/// Writes the mesh of `semantic.obj` anew: its faces in other order, each in four, without those of labels
/// that start with `without`. The instances of `swapped` change their names.
fn remesh(out: &Path, swapped: [&str; 2], is_subdivided: bool, without: &str) {
    let all = faces(out);
    let [one, two] = swapped;
    let mut text = "mtllib semantic.mtl\n".to_owned();
    let mut count = 0;
    for (corners, name) in all.into_iter().rev().filter(|(_, name)| !name.starts_with(without)) {
        let name = match name.as_str() {
            name if name == one => two,
            name if name == two => one,
            other => other,
        };
        let [a, b, c] = corners;
        let middle = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| (p[k] + q[k]) / 2.0);
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        let parts = if is_subdivided {
            vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        } else {
            vec![[b, c, a]]
        };
        text += &format!("usemtl {name}\n");
        for part in parts {
            part.iter().for_each(|[x, y, z]| text += &format!("v {x} {y} {z}\n"));
            text += &format!("f {} {} {}\n", count + 1, count + 2, count + 3);
            count += 3;
        }
    }
    s3d_io::fs::write_bytes(&out.join("area_1/3d/semantic.obj"), text.as_bytes()).unwrap();
}

#[test]
fn another_mesh_of_the_same_surface_has_the_same_labels() {
    let walls = ["wall_1_office_1_1", "wall_2_office_1_1"];
    let chairs = ["chair_1_conferenceRoom_1_1", "chair_2_conferenceRoom_1_1"];
    let (furnished, _) = scenes();
    for (of, swapped, is_subdivided) in [
        (whole(), walls, false),
        (whole(), walls, true),
        (&*furnished, chairs, false),
        (&*furnished, chairs, true),
    ] {
        let (_dir, out) = altered(of, |out| remesh(out, swapped, is_subdivided, "none"));
        for (a, b) in [(of, &*out), (&*out, of)] {
            let (answer, json, code) = compare(a, b);
            let (area, labels) = (&json["areas"][0], &json["labels"]);
            assert_eq!((code, &area["geometry"]), (1, &"other".into()), "{answer}");
            assert_eq!((&area["faces_changed"], count(&labels["matrix"])), (&0.into(), 0), "{answer}");
            assert_eq!((&area["m2_only_a"], &area["m2_only_b"]), (&0.0.into(), &0.0.into()), "{answer}");
            let renumbered = labels["renumbered"].as_array().unwrap();
            let names: Vec<_> = renumbered.iter().map(|of| [&of["a"], &of["b"]]).collect();
            let [one, two] = swapped.map(Value::from);
            assert_eq!(names, [[&one, &two], [&two, &one]], "{answer}");
            let lists = ["instances", "gone", "added", "other_room"];
            assert!(lists.iter().all(|list| count(&labels[*list]) == 0), "{labels:#}");
            let note = "note: area 1: the meshes differ; faces were compared by place";
            assert!(answer.contains(note), "{answer}");
        }
    }
}

#[test]
fn surface_that_the_other_mesh_lacks_is_told() {
    let (_dir, out) = altered(whole(), |out| remesh(out, ["", ""], true, "table"));
    let (answer, json, _) = compare(whole(), &out);
    let area = &json["areas"][0];
    let table: f64 = faces(whole())
        .into_iter()
        .filter(|(_, name)| name.starts_with("table"))
        .map(|(corners, _)| self::area(corners))
        .sum();
    let near = |value: &Value| (value.as_f64().unwrap() - table).abs() < 1e-4 * table;
    assert!(table > 0.5 && near(&area["m2_only_a"]) && area["m2_only_b"] == 0.0, "{area} {table}");
    assert_eq!((&area["faces_changed"], count(&json["labels"]["matrix"])), (&0.into(), 0));
    // Its label is still there, so it is the same instance by name.
    assert_eq!(count(&json["labels"]["gone"]), 0);
    assert!(answer.contains(" m² of A and 0 m² of B are over 10 cm from the other mesh"), "{answer}");
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
    assert_eq!((&class["renumbered"], &class["changed"]), (&12.into(), &0.into()), "{answer}");
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
