//! The report of a data set against another, read back by `s3d_report::files`.

use crate::common;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use common::{data_set, files, list_files, numbers, value};
use flate2::read::ZlibDecoder;
use s3d_dataset::s3d_io::dataset::{Domain, Layout, dataset_images};
use s3d_dataset::{Context, DataSet};
use s3d_io::image::{Compression, Content, read_rgb8, write_rgb8};
use s3d_report::{Error, ReportOptions, report, report_against};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;

const SMALL: ReportOptions = ReportOptions {
    pano_width: 160,
    thumbs: 80,
    mesh_faces: 1_000_000,
    verify: false,
    single: false,
    scores: Vec::new(),
    poster: None,
    overwrite: false,
};

/// Packed numbers of 32 bits.
fn unpacked(value: &Value) -> Vec<u32> {
    let stream = BASE64_STANDARD.decode(value.as_str().unwrap()).unwrap();
    let mut all = Vec::new();
    ZlibDecoder::new(&*stream).read_to_end(&mut all).unwrap();
    all.as_chunks().0.iter().map(|le| u32::from_le_bytes(*le)).collect()
}

/// A changed copy: in the mesh, a chair and all unlabelled faces become wall, and two images have other
/// pixels.
fn altered(out: &Path, to: &Path) -> (u32, u32) {
    for (path, bytes) in files(out) {
        fs::create_dir_all(to.join(&path).parent().unwrap()).unwrap();
        fs::write(to.join(&path), bytes).unwrap();
    }
    let data = DataSet::open(out).unwrap();
    let names = data.labels().unwrap().unwrap().names();
    let number = |start: &str| names.iter().position(|name| name.starts_with(start)).unwrap() as u32;
    let (chair, wall) = (number("chair_1_"), number("wall_1_"));
    let path = to.join("area_1/3d/semantic.obj");
    let text = fs::read_to_string(&path).unwrap();
    let line = |of: u32| format!("usemtl {}\n", names[of as usize]);
    assert!(text.contains(&line(chair)) && text.contains(&line(0)));
    let text = text.replace(&line(chair), &line(wall)).replace(&line(0), &line(wall));
    fs::write(&path, text).unwrap();
    let layout = Layout::new(to);
    let images = dataset_images(&layout, 1).unwrap();
    for image in [images.first().unwrap(), images.last().unwrap()] {
        for domain in [Domain::Rgb, Domain::Semantic] {
            let path = image.path(&layout, domain);
            let mut pixels = read_rgb8(&path).unwrap();
            for pixel in &mut pixels.pixels_mut()[..7] {
                *pixel = if domain == Domain::Rgb {
                    pixel.map(|c| c ^ 1)
                } else {
                    [0, 0, chair as u8]
                };
            }
            write_rgb8(&path, &pixels, Content::Photo, Compression::Fast).unwrap();
        }
    }
    // One more change, in an image that the report's pictures do not use.
    let path = images[1].path(&layout, Domain::SemanticPretty);
    let pixels = read_rgb8(&path).unwrap().map(|[r, g, b]| [r, g, b ^ 1]);
    write_rgb8(&path, &pixels, Content::Photo, Compression::Fast).unwrap();
    list_files(to);
    (chair, wall)
}

#[test]
fn what_differs_is_in_the_report_and_the_rest_as_without() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let other = dir.path().join("other");
    let (chair, wall) = altered(&out, &other);
    let ctx = Context::default();
    let [plain, to, again] = ["plain", "to", "again"].map(|name| dir.path().join(name));
    report(&out, &plain, &SMALL, &ctx).unwrap();
    let made = report_against(&out, &other, &to, &SMALL, &ctx).unwrap();
    let written = files(&to);
    assert_eq!(made.bytes, written.values().map(|bytes| bytes.len() as u64).sum::<u64>());

    // The bytes are the same for any number of threads.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one.install(|| report_against(&out, &other, &again, &SMALL, &ctx))
        .unwrap();
    assert!(files(&again) == written);
    // The report of the data set alone has the same files, except those that name the other data set.
    for (path, bytes) in files(&plain) {
        let names_it = path.ends_with("index.js") || path.ends_with("first.js");
        assert!(names_it || written[&path] == bytes, "{}", path.display());
    }
    assert_eq!(
        (&value(&plain, "index")["against"], &value(&to, "index")["against"]),
        (&Value::Null, &"other".into())
    );

    let index = value(&to, "index");
    let compared = value(&to, "compare");
    let comparison = &compared["comparison"];
    let names = DataSet::open(&out).unwrap().labels().unwrap().unwrap().names();
    assert_eq!(
        (&comparison["a"]["folder"], &comparison["b"]["folder"]),
        (&"data set".into(), &"other".into())
    );
    assert_eq!(compared["labels"], index["labels"]);

    // A panorama and a view differ in the labels that are shown.
    let pretty = comparison["modalities"].as_array().unwrap().iter();
    assert_eq!(
        pretty
            .filter(|of| of["modality"] == "semantic_pretty" && of["changed"] == 1)
            .count(),
        1
    );
    let pictures = compared["pictures"].as_array().unwrap();
    assert_eq!((pictures.len(), &compared["faults"]), (2, &json!([])));
    let layout = Layout::new(&other);
    let images = dataset_images(&layout, 1).unwrap();
    for (k, entry) in pictures.iter().enumerate() {
        assert_eq!(entry["is_there"], true);
        assert_eq!(entry["pixels"]["rgb"]["pixels_changed"], 7);
        let picture = value(&to, &format!("other_{k}"));
        let own = match (&entry["picture"], &entry["pano"]) {
            (Value::Null, location) => value(&to, &format!("pano_{location}")),
            (number, Value::Null) => {
                let number = number.as_u64().unwrap() as usize;
                value(&to, &format!("views_{}", number / 12))[number % 12].clone()
            }
            both => panic!("{both:?}"),
        };
        assert_eq!((&picture["of"], &picture["size"]), (&own["of"], &own["size"]));
        assert_ne!(picture["label"], own["label"]);
        assert!(picture["face"].is_null());
        // The picture is not reduced, so it has the labels of the image file.
        let image = if entry["pano"].is_null() {
            images.first()
        } else {
            images.last()
        };
        let image = image.unwrap();
        let file = read_rgb8(&image.path(&layout, Domain::Semantic)).unwrap();
        let own_file = read_rgb8(&image.path(&Layout::new(&out), Domain::Semantic)).unwrap();
        let mut counted: BTreeMap<[&str; 2], u64> = BTreeMap::new();
        for (a, b) in own_file.pixels().iter().zip(file.pixels()).filter(|(a, b)| a != b) {
            let class = |[r, g, b]: [u8; 3]| match [r, g, b] {
                [13, 13, 13] => "<nothing>",
                _ => names[u32::from_be_bytes([0, r, g, b]) as usize]
                    .split('_')
                    .next()
                    .unwrap(),
            };
            *counted.entry([class(*a), class(*b)]).or_default() += 1;
        }
        let matrix = &comparison["labels"]["matrix"];
        let told = entry["classes"].as_array().unwrap().iter().map(|of| {
            let pair = &matrix[of[0].as_u64().unwrap() as usize];
            (["a", "b"].map(|side| pair[side].as_str().unwrap()), of[1].as_u64().unwrap())
        });
        assert_eq!(told.collect::<BTreeMap<_, _>>(), counted);
        assert!(!counted.is_empty());
        assert_eq!(numbers(&picture["label"]), file.map(|[r, g, b]| u32::from_be_bytes([0, r, g, b])));
    }

    assert_eq!(compared["changed_faces"], json!([1]));
    let changed = value(&to, "changed_1");
    let (face, a, b) = (unpacked(&changed["face"]), unpacked(&changed["a"]), unpacked(&changed["b"]));
    let data = DataSet::open(&out).unwrap();
    let votes = data.face_votes(1).unwrap().unwrap();
    let of = |label: u32| {
        (0..)
            .zip(&votes.label)
            .filter(move |(_, l)| **l == label)
            .map(|(f, _)| f)
    };
    let (chairs, none): (Vec<u32>, Vec<u32>) = (of(chair).collect(), of(0).collect());
    assert!(chairs.len() > 10 && none.len() > 10);
    let mut all = [&chairs[..], &none].concat();
    all.sort_unstable();
    assert_eq!((&face, changed["faces"].as_u64()), (&all, Some(all.len() as u64)));
    assert!(face.iter().zip(&a).all(|(face, a)| *a == votes.label[*face as usize]));
    assert!(a.len() == face.len() && b.len() == face.len() && b.iter().all(|label| *label == wall));
    assert_eq!(comparison["labels"]["matrix"][0]["faces"].as_u64().unwrap() as usize, none.len());

    // Connected patches of the changed faces of both instances, found from face to face; the report has the
    // 300 largest.
    let mesh = data.mesh(1).unwrap().unwrap().mesh;
    let mut patches: Vec<(f64, u32, usize)> = Vec::new();
    for (label, mut left) in [(chair, chairs), (0, none)] {
        while let Some(first) = left.pop() {
            let mut patch = vec![first];
            for place in 0.. {
                let Some(corners) = patch.get(place).map(|face| mesh.triangle(*face)) else { break };
                let meets =
                    |face: &mut u32| mesh.triangle(*face).iter().any(|corner| corners.contains(corner));
                patch.extend(left.extract_if(.., meets));
            }
            patches.push((patch.iter().map(|face| mesh.area(*face)).sum(), label, patch.len()));
        }
    }
    patches.sort_by(|x, y| y.0.total_cmp(&x.0));
    patches.truncate(300);
    let told = changed["patches"].as_array().unwrap();
    assert_eq!(told.len(), patches.len());
    assert!(told.iter().any(|patch| patch["a"] == 0) && told.iter().any(|patch| patch["a"] == chair));
    for (patch, (m2, ..)) in told.iter().zip(&patches) {
        assert!(
            (patch["m2"].as_f64().unwrap() - m2).abs() <= 1e-9 * m2 && patch["b"] == wall,
            "{patch}, {m2}"
        );
        let center = [0, 1, 2].map(|axis| patch["center"][axis].as_f64().unwrap());
        let is_there = |face: &u32| {
            let corners = mesh.triangle(*face).map(|corner| corner.as_dvec3().to_array());
            votes.label[*face as usize] == patch["a"]
                && (0..3).all(|c| (corners.iter().map(|p| p[c]).sum::<f64>() / 3.0 - center[c]).abs() < 1e-6)
        };
        assert!(face.iter().any(is_there), "{patch}");
    }
    let mut counted: Vec<(u32, usize)> = patches.iter().map(|(_, label, faces)| (*label, *faces)).collect();
    let number = |patch: &Value, of: &str| patch[of].as_u64().unwrap();
    let mut found: Vec<(u32, usize)> = told
        .iter()
        .map(|patch| (number(patch, "a") as u32, number(patch, "faces") as usize))
        .collect();
    counted.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, counted);
}

#[test]
fn the_same_data_and_those_that_cannot_be_compared() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), false);
    let ctx = Context::default();
    let to = dir.path().join("to");
    report_against(&out, &out, &to, &SMALL, &ctx).unwrap();
    let compared = value(&to, "compare");
    assert_eq!((&compared["comparison"]["equal"], &compared["pictures"]), (&true.into(), &json!([])));
    assert!(!to.join("data/other_0.js").exists() && !to.join("data/changed_1.js").exists());

    let to = dir.path().join("more");
    let e = report_against(&out, &dir.path().join("none"), &to, &SMALL, &ctx).unwrap_err();
    assert!(e.to_string().contains("none"), "{e}");
    let other = dir.path().join("copy");
    for (path, bytes) in files(&out) {
        fs::create_dir_all(other.join(&path).parent().unwrap()).unwrap();
        fs::write(other.join(&path), bytes).unwrap();
    }
    let e = report_against(&out, &other, &other.join("report"), &SMALL, &ctx).unwrap_err();
    assert!(
        matches!(e, Error::Dataset(s3d_dataset::Error::Usage(_))) && e.to_string().contains("in one another"),
        "{e}"
    );
    assert!(!to.exists() && !other.join("report").exists());
}
