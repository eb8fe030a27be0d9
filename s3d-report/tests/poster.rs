//! Posters are drawn, also of exports that did not finish, and their classes have the page's colours.

use crate::common;

use common::{data_set, export};
use s3d_dataset::event::UnitKind;
use s3d_dataset::{Cancel, Context, DataSet, Event};
use s3d_geom::Raster;
use s3d_io::image::decode_rgb8;
use s3d_report::{Error, ReportOptions, poster, report};
use serde::Deserialize;
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
struct Golden {
    names: Vec<String>,
    colors: Vec<[u8; 3]>,
}

fn drawn(out: &Path, to: &Path) -> Raster<[u8; 3]> {
    poster(out, to, true, &Context::default()).unwrap();
    decode_rgb8(&fs::read(to).unwrap(), to).unwrap()
}

/// The share of the pixels of the right half that are one of these colours, darker and with some gray.
fn share_of(picture: &Raster<[u8; 3]>, colors: &[[u8; 3]]) -> f64 {
    let is_one = |pixel: [f64; 3]| {
        colors.iter().any(|color| {
            let class = color.map(f64::from);
            let mean = |v: [f64; 3]| v.iter().sum::<f64>() / 3.0;
            let around = |v: [f64; 3]| v.map(|c| c - mean(v));
            let (class, pixel) = (around(class), around(pixel));
            let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            // How strong the colour of the class is, and what is left then.
            let strength = dot(class, pixel) / dot(class, class).max(1.0);
            let rest = [0, 1, 2].map(|i| pixel[i] - strength * class[i]);
            (0.3..0.7).contains(&strength) && dot(rest, rest).sqrt() < 2.0
        })
    };
    let (mut found, mut all) = (0, 0);
    for y in 0..picture.height() {
        for x in picture.width() / 2 + 3..picture.width() {
            let pixel = picture.at(x, y);
            if pixel != picture.at(0, 0) {
                all += 1;
                found += u32::from(is_one(pixel.map(f64::from)));
            }
        }
    }
    assert!(all > 100_000, "{all}");
    f64::from(found) / f64::from(all)
}

/// Exports until `stop` becomes true. Returns the folder of the data set.
fn unfinished(folder: &Path, stop: fn(&Event<'_>) -> bool) -> PathBuf {
    let (export, out) = (export(folder, true), folder.join("data set"));
    let cancel = Cancel::default();
    let theirs = cancel.clone();
    let context = Context::default()
        .cancelled_by(cancel)
        .observed_by(move |event: &Event<'_>| {
            if stop(event) {
                theirs.cancel();
            }
        });
    assert!(matches!(export.run(&out, &context), Err(s3d_dataset::Error::Cancelled)));
    out
}

#[test]
fn classes_have_the_colours_of_the_page() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let picture = drawn(&out, &dir.path().join("poster.png"));
    assert_eq!((picture.width(), picture.height()), (1600, 1000));

    let data = DataSet::open(&out).unwrap();
    let taxonomy = data.taxonomy().unwrap();
    let names: Vec<&str> = taxonomy.classes().iter().map(|class| class.name()).collect();
    let own: Vec<[u8; 3]> = taxonomy.classes().iter().map(|class| taxonomy.color(*class)).collect();
    let golden: Vec<Golden> = serde_json::from_str(include_str!("palette.json")).unwrap();
    let golden = golden.into_iter().find(|golden| golden.names == names).unwrap();
    let (pages, owns) = (share_of(&picture, &golden.colors), share_of(&picture, &own));
    assert!(pages > 0.8 && owns < 0.1, "the page's {pages}, the taxonomy's {owns}");

    // Labels that are damaged are told, and colours are drawn alone.
    let votes = data.layout().votes_npz(1);
    fs::write(&votes, "no votes").unwrap();
    let to = dir.path().join("colors.png");
    let context = Context::default();
    poster(&out, &to, false, &context).unwrap();
    assert_eq!(context.warnings(), 1);
    let plain = decode_rgb8(&fs::read(&to).unwrap(), &to).unwrap();
    let is_left_the_same = plain.rows().zip(picture.rows()).all(|(a, b)| a[..790] == b[..790]);
    assert!(is_left_the_same && plain.at(800, 10) != [255; 3]);
}

#[test]
fn an_export_that_did_not_finish_has_a_poster_once_there_is_a_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let is_mesh = |event: &Event<'_>| matches!(event, Event::UnitFinished { unit: UnitKind::Assets, .. });
    let out = unfinished(dir.path(), is_mesh);
    assert!(DataSet::open(&out).is_err());
    let to = dir.path().join("poster.png");
    let picture = drawn(&out, &to);

    // It is the picture of the complete data set.
    export(dir.path(), true)
        .run(&out, &Context::default())
        .unwrap()
        .unwrap();
    assert!(drawn(&out, &to) == picture);

    let other = tempfile::tempdir().unwrap();
    let is_label = |event: &Event<'_>| matches!(event, Event::UnitFinished { unit: UnitKind::Labels, .. });
    let out = unfinished(other.path(), is_label);
    let to = other.path().join("poster.png");
    let error = poster(&out, &to, false, &Context::default()).unwrap_err();
    assert!(matches!(error, Error::NoMesh { is_finished: false, .. }), "{error}");
    assert!(error.to_string().ends_with("yet: the export did not finish") && !to.exists(), "{error}");
}

#[test]
fn a_poster_appears_with_its_report_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), false);
    let [to, place] = ["report", "poster.png"].map(|name| dir.path().join(name));
    let options =
        ReportOptions { pano_width: 32, thumbs: 16, poster: Some(place.clone()), ..ReportOptions::default() };

    // The report ends early.
    let cancel = Cancel::default();
    let theirs = cancel.clone();
    let cancelled = Context::default()
        .cancelled_by(cancel)
        .observed_by(move |event: &Event<'_>| {
            if matches!(event, Event::TaskAdvanced { .. }) {
                theirs.cancel();
            }
        });
    let error = report(&out, &to, &options, &cancelled).unwrap_err();
    assert!(matches!(error, Error::Dataset(s3d_dataset::Error::Cancelled)), "{error}");
    assert!(!to.exists() && !place.exists());

    report(&out, &to, &options, &Context::default()).unwrap();
    let made = fs::read(&place).unwrap();
    let alone = dir.path().join("alone.png");
    poster(&out, &alone, false, &Context::default()).unwrap();
    assert_eq!(made, fs::read(&alone).unwrap());

    // In the report it would go with an earlier report.
    let within = ReportOptions { poster: Some(to.join("poster.png")), overwrite: true, ..options };
    let error = report(&out, &to, &within, &Context::default()).unwrap_err();
    assert!(matches!(error, Error::PosterInReport(_)), "{error}");
    assert!(to.join("index.html").exists());
}
