//! Figures are drawn of what a data set has, the same each time, and show what is true.

use crate::common;

use common::{data_set, files};
use s3d_dataset::{Context, DataSet};
use s3d_geom::Raster;
use s3d_io::image::decode_rgb8;
use s3d_report::{Error, FiguresOptions, figures};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::TempDir;

/// A folder with a labelled `data set` and its `figures`, which are only read.
static DRAWN: LazyLock<TempDir> = LazyLock::new(|| {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    drawn(&out, &dir.path().join("figures"), &FiguresOptions::default());
    dir
});

const ALL: [&str; 6] = ["modalities", "area_1", "samples", "distributions", "examples", "classes"];

fn labelled() -> [PathBuf; 2] {
    ["data set", "figures"].map(|name| DRAWN.path().join(name))
}

fn drawn(out: &Path, to: &Path, options: &FiguresOptions) -> Value {
    figures(out, to, options, &Context::default()).unwrap();
    serde_json::from_slice(&fs::read(to.join("figures.json")).unwrap()).unwrap()
}

#[test]
fn pictures_have_as_many_pixels_an_inch_as_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let ([out, usual], few) = (labelled(), dir.path().join("few"));
    drawn(&out, &few, &FiguresOptions { dpi: 72, ..FiguresOptions::default() });
    let bytes = |folder: &Path, name: &str| fs::metadata(folder.join(format!("{name}.pdf"))).unwrap().len();
    for name in ALL {
        let [small, large] = [&few, &usual].map(|folder| png(folder, name));
        assert_eq!([small.width(), large.width()], [504, 2100], "{name}");
        let shapes = [&small, &large].map(|of| f64::from(of.height()) / f64::from(of.width()));
        assert!((shapes[0] - shapes[1]).abs() < 0.05, "{name}: {shapes:?}");
    }
    assert!(bytes(&few, "area_1") < bytes(&usual, "area_1") / 4);
    let means = [&few, &usual].map(|folder| {
        let pixels = png(folder, "area_1");
        let sum: f64 = pixels.pixels().iter().flatten().map(|c| f64::from(*c)).sum();
        sum / pixels.pixels().len() as f64 / 3.0
    });
    assert!((means[0] - means[1]).abs() < 12.0, "the same picture: {means:?}");

    for dpi in [0, 29, 1201, u32::MAX] {
        let to = dir.path().join("none");
        let options = FiguresOptions { dpi, ..FiguresOptions::default() };
        let wrong = figures(&out, &to, &options, &Context::default()).unwrap_err();
        assert!(matches!(wrong, Error::Resolution(_)) && !to.exists(), "{wrong}");
    }
}

fn png(folder: &Path, name: &str) -> Raster<[u8; 3]> {
    let path = folder.join(format!("{name}.png"));
    decode_rgb8(&fs::read(&path).unwrap(), &path).unwrap()
}

/// The share of the pixels that are about this colour.
fn share_of(picture: &Raster<[u8; 3]>, color: [u8; 3]) -> f64 {
    let is_near = |pixel: &&[u8; 3]| pixel.iter().zip(color).all(|(a, b)| a.abs_diff(b) < 6);
    picture.pixels().iter().filter(is_near).count() as f64 / picture.pixels().len() as f64
}

#[test]
fn a_data_set_has_all_figures_and_the_same_bytes_twice() {
    let dir = tempfile::tempdir().unwrap();
    let ([out, a], b) = (labelled(), dir.path().join("b"));
    let about: Value = serde_json::from_slice(&fs::read(a.join("figures.json")).unwrap()).unwrap();
    assert_eq!(about["figures"].as_object().unwrap().len(), ALL.len());
    let tex = fs::read_to_string(a.join("figures.tex")).unwrap();
    for name in ALL {
        let pdf = fs::read(a.join(format!("{name}.pdf"))).unwrap();
        assert!(pdf.starts_with(b"%PDF-") && pdf.trim_ascii_end().ends_with(b"%%EOF"), "{name}");
        assert_eq!(png(&a, name).width(), 2100, "{name}: 7 inches");
        assert!(tex.contains(&format!("{{{name}.pdf}}")), "{name}");
        assert!(tex.contains(about["figures"][name].as_str().unwrap()), "{name}");
    }

    let threads = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    threads.install(|| drawn(&out, &b, &FiguresOptions::default()));
    assert_eq!(files(&a), files(&b));

    let again = figures(&out, &b, &FiguresOptions::default(), &Context::default());
    assert!(matches!(again, Err(Error::Dataset(_))), "{again:?}");
    assert_eq!(files(&a), files(&b));
}

#[test]
fn without_labels_there_is_no_semantic_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), false);
    let to = dir.path().join("figures");
    let about = drawn(&out, &to, &FiguresOptions::default());
    assert_eq!(about["figures"].as_object().unwrap().len(), ALL.len() - 1, "none of classes");
    // Its half is the paper's white.
    let area = png(&to, "area_1");
    let right = (0..area.height()).flat_map(|y| (1060..2100).map(move |x| [x, y]));
    assert!(right.into_iter().all(|[x, y]| area.at(x, y) == [255; 3]));
}

#[test]
fn detections_are_drawn_beside_the_true_boxes() {
    let dir = tempfile::tempdir().unwrap();
    let [out, _] = labelled();
    let instances = DataSet::open(&out).unwrap().instances(1).unwrap();
    let of = |class: &str| instances.iter().filter(|i| i.class == class).count();
    let found: Vec<Value> = instances
        .iter()
        .filter(|i| i.class == "chair")
        .map(|i| {
            let [a, b, c, d, e, f] = i.bbox;
            let (low, high) = ([a, b, c], [d, e, f]);
            json!({"area": 1, "room": i.room, "class": "chair", "score": 0.5, "min": low, "max": high})
        })
        .collect();
    assert!(found.len() == of("chair") && found.len() > 4);

    let list = dir.path().join("found.json");
    let draw = |list: &Path, to: &str| {
        let options = FiguresOptions {
            detections: Some(list.to_owned()),
            overwrite: true,
            ..FiguresOptions::default()
        };
        figures(&out, &dir.path().join(to), &options, &Context::default())
    };
    fs::write(&list, serde_json::to_vec(&found).unwrap()).unwrap();
    draw(&list, "all").unwrap();
    let all = png(&dir.path().join("all"), "detections_1");
    // Found are exactly the true ones: both sides have the same lines.
    let shift = 1062.5;
    let differs = (0..all.height() / 2)
        .flat_map(|y| (10..1000).map(move |x| [x, y]))
        .filter(|[x, y]| {
            let beside = (f64::from(*x) + shift) as u32;
            let [a, b] = [all.at(*x, *y), all.at(beside, *y)];
            a.iter().zip(b).any(|(a, b)| a.abs_diff(b) > 120)
        });
    assert!(differs.count() < 500);

    // More than there are of a class are left out, from the lowest scores on.
    let mut more = found.clone();
    for i in 0..50 {
        let x = f64::from(i) * 0.1;
        more.push(
            json!({"area": 1, "class": "chair", "score": 0.1, "min": [x, 0, 0], "max": [x + 0.5, 5, 1]}),
        );
    }
    fs::write(&list, serde_json::to_vec(&more).unwrap()).unwrap();
    draw(&list, "more").unwrap();
    assert_eq!(files(&dir.path().join("all")), files(&dir.path().join("more")));

    fs::write(&list, "[{\"area\": 1}]").unwrap();
    let wrong = draw(&list, "wrong").unwrap_err().to_string();
    assert!(wrong.contains("found.json") && wrong.contains("class"), "{wrong}");
    let endless = r#"[{"area": 1, "class": "chair", "score": 0, "min": [0, 0, 0], "max": [1, 1, 1e999]}]"#;
    fs::write(&list, endless).unwrap();
    assert!(draw(&list, "wrong").is_err());
    assert!(!dir.path().join("wrong").exists());
}

#[test]
fn what_is_drawn_of_labels_has_the_colours_of_the_page() {
    let [_, to] = labelled();
    let legend = png(&to, "area_1");
    let modalities = png(&to, "modalities");
    // The box of the first class in the legend: ceilings, which the panorama shows too.
    let y = legend.height() - (8.0 * 1.6 * 300.0 / 72.0) as u32 - 20;
    let ceiling = (0..legend.height() - y)
        .map(|dy| legend.at(10, y + dy - 10))
        .find(|c| *c != [255; 3])
        .unwrap();
    assert!(share_of(&modalities, ceiling) > 0.01, "{ceiling:?}");
}

#[test]
fn nothing_to_draw_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let wrong = figures(dir.path(), &dir.path().join("f"), &FiguresOptions::default(), &Context::default());
    assert!(matches!(wrong, Err(Error::Dataset(_))), "{wrong:?}");
    assert!(!dir.path().join("f").exists());
}
