//! A report is read back as `s3d_report::files` says, and compared with the files of the data set.

use crate::common;

use common::{data_set, export, files, list_files, numbers, pair, url_bytes, value};
use s3d_dataset::event::UnitKind;
use s3d_dataset::{Cancel, Context, DataSet, Event};
use s3d_geom::Raster;
use s3d_geom::glam::{DMat3, DVec3, dvec3};
use s3d_io::dataset::{DatasetImage, Domain, Frame};
use s3d_io::image::{Compression, Content, decode_gray16, decode_rgb8, decode_xyz, write_rgb8};
use s3d_report::{Error, Report, ReportOptions, report};
use serde_json::Value;
use std::f64::consts::PI;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

const SMALL: ReportOptions = ReportOptions {
    pano_width: 64,
    thumbs: 24,
    mesh_faces: 1000,
    verify: false,
    single: false,
    scores: Vec::new(),
    poster: None,
    overwrite: false,
};

fn made(out: &Path, to: &Path, options: &ReportOptions) -> Report {
    report(out, to, options, &Context::default()).unwrap()
}

fn numbers3(value: &Value) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|i| value[i].as_f64().unwrap()))
}

/// The images of the data set that a picture is made from.
struct Own {
    depth: Raster<u16>,
    label: Raster<[u8; 3]>,
    rgb: Raster<[u8; 3]>,
    xyz: Raster<[f32; 3]>,
}

impl Own {
    fn read(data: &DataSet, image: &DatasetImage) -> Self {
        let path = |domain| image.path(data.layout(), domain);
        let bytes = |domain| data.read(&path(domain)).unwrap();
        Self {
            depth: decode_gray16(&bytes(Domain::Depth), &path(Domain::Depth)).unwrap(),
            label: decode_rgb8(&bytes(Domain::Semantic), &path(Domain::Semantic)).unwrap(),
            rgb: decode_rgb8(&bytes(Domain::Rgb), &path(Domain::Rgb)).unwrap(),
            xyz: decode_xyz(&bytes(Domain::GlobalXyz), &path(Domain::GlobalXyz)).unwrap(),
        }
    }

    /// Compares some pixels of a picture with these images. `point` returns the world point of a position in
    /// the image, in pixels, at a depth.
    fn hold(&self, picture: &Value, count: u32, point: impl Fn(f64, f64, f64) -> DVec3) {
        let (of, size) = (pair(&picture["of"]), pair(&picture["size"]));
        let (depth, label) = (numbers(&picture["depth"]), numbers(&picture["label"]));
        assert_eq!([self.depth.width(), self.depth.height()], of);
        assert_eq!([depth.width(), depth.height()], size);
        assert!(size[0] < of[0], "the test is of reduced images");
        let mut seen = 0;
        for k in 0..count {
            // The pixels are spread over the image, not along a line.
            let (i, j) = ((k * 37 + 5) % size[0], (k * 23 + 3) % size[1]);
            let source = |i: u32, axis: usize| (2 * i + 1) * of[axis] / (2 * size[axis]);
            let (x, y) = (source(i, 0), source(j, 1));
            assert_eq!(depth.at(i, j), u32::from(self.depth.at(x, y)), "depth of {i}, {j}");
            let [r, g, b] = self.label.at(x, y);
            assert_eq!(label.at(i, j), u32::from_be_bytes([0, r, g, b]), "label of {i}, {j}");
            if depth.at(i, j) != 65_535 {
                let metres = f64::from(depth.at(i, j)) / 512.0;
                let found = point(f64::from(x) + 0.5, f64::from(y) + 0.5, metres);
                let own = DVec3::from_array(self.xyz.at(x, y).map(f64::from));
                // Half a step of half floats below 32 m is 8 mm; half a step of depth is 1 mm.
                assert!((found - own).abs().max_element() < 0.01, "{i}, {j}: {found} and {own}");
                seen += 1;
            }
        }
        assert!(seen > count / 2, "{seen} of {count} pixels see something");
        // Colours are means, as exact as JPEG stores them.
        let rgb = image::load_from_memory(&url_bytes(&picture["rgb"], "jpeg"))
            .unwrap()
            .to_rgb8();
        let mean = |pixels: &mut dyn Iterator<Item = [u8; 3]>| {
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for pixel in pixels {
                (0..3).for_each(|c| sum[c] += f64::from(pixel[c]));
                count += 1.0;
            }
            sum.map(|sum| sum / count)
        };
        let (theirs, ours) =
            (mean(&mut rgb.pixels().map(|p| p.0)), mean(&mut self.rgb.pixels().iter().copied()));
        assert!((0..3).all(|c| (theirs[c] - ours[c]).abs() < 3.0), "{theirs:?} and {ours:?}");
    }
}

#[test]
fn pictures_are_the_data_sets_own() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let to = dir.path().join("report");
    let made = made(&out, &to, &SMALL);
    assert_eq!(made.faults, []);
    assert_eq!(made.bytes, files(&to).values().map(|bytes| bytes.len() as u64).sum::<u64>());
    let data = DataSet::open(&out).unwrap();
    let images = data.images(1);
    let index = value(&to, "index");

    let locations = index["locations"].as_array().unwrap();
    assert_eq!((locations.len(), made.panoramas), (6, 6));
    for (i, location) in locations.iter().enumerate() {
        let named = |image: &&DatasetImage| image.frame == Frame::Panorama && location["uuid"] == image.uuid;
        let image = images.iter().find(named).unwrap();
        assert_eq!(location["room"], image.room);
        let (from, azimuth) = (numbers3(&location["position"]), location["azimuth_rad"].as_f64().unwrap());
        Own::read(&data, image).hold(&value(&to, &format!("pano_{i}")), 20, |x, y, distance| {
            let (lon, lat) = ((x / 160.0 - 0.5) * 2.0 * PI, (0.5 - y / 80.0) * PI);
            let a = azimuth - lon;
            from + distance * dvec3(lat.cos() * a.cos(), lat.cos() * a.sin(), lat.sin())
        });
    }

    let views = index["views"].as_array().unwrap();
    let kept: Vec<&Value> = views.iter().filter(|view| !view["picture"].is_null()).collect();
    assert_eq!((kept.len(), views.len()), (made.views, 36));
    assert!(made.views > 12, "several files");
    for view in &kept {
        let n = usize::try_from(view["picture"].as_u64().unwrap()).unwrap();
        let uuid = &locations[usize::try_from(view["location"].as_u64().unwrap()).unwrap()]["uuid"];
        let named = |image: &&DatasetImage| {
            matches!(image.frame, Frame::View(frame) if view["frame"] == frame) && *uuid == image.uuid
        };
        let image = images.iter().find(named).unwrap();
        let picture = &value(&to, &format!("views_{}", n / 12))[n % 12];
        let rows = |column: usize| {
            DVec3::from_array([0, 1, 2].map(|r| picture["camera"]["rt"][r][column].as_f64().unwrap()))
        };
        let rotation = DMat3::from_cols(rows(0), rows(1), rows(2));
        let k: Vec<f64> = (0..4).map(|i| picture["camera"]["k"][i].as_f64().unwrap()).collect();
        Own::read(&data, image).hold(picture, 20, |x, y, depth| {
            let camera = dvec3((x - k[2]) / k[0], (y - k[3]) / k[1], 1.0) * depth;
            rotation.transpose() * (camera - rows(3))
        });
        let thumb = &value(&to, &format!("thumbs_{}", n / 48))[n % 48];
        let thumb = image::load_from_memory(&url_bytes(thumb, "jpeg")).unwrap();
        assert_eq!((thumb.width(), thumb.height()), (24, 24));
        let reason = view["place"]["reason"].as_str().unwrap();
        assert!(["highest", "drawn"].contains(&reason), "{reason}");
    }
    let dropped = views.iter().filter(|view| view["picture"].is_null());
    let reasons: Vec<&str> = dropped.map(|view| view["place"]["reason"].as_str().unwrap()).collect();
    assert!(reasons.len() == 36 - made.views && reasons.iter().all(|r| ["lowest", "not_drawn"].contains(r)));

    // Pixels are counted by class in the full-size images.
    let mut pixels = 0;
    for image in &images {
        let path = image.path(data.layout(), Domain::Semantic);
        let label = decode_rgb8(&data.read(&path).unwrap(), &path).unwrap();
        pixels += label.pixels().iter().filter(|p| **p != [13; 3]).count() as u64;
    }
    let by_class = index["pixels_by_class"]
        .as_array()
        .unwrap()
        .iter()
        .map(|n| n.as_u64().unwrap())
        .sum::<u64>();
    assert_eq!(by_class + index["pixels_unlabelled"].as_u64().unwrap(), pixels);
    let rooms = index["rooms"].as_array().unwrap();
    assert_eq!(rooms.len(), 4);
    for room in rooms {
        let floor = room["floor"].as_f64().unwrap();
        assert!(floor.abs() < 0.05, "{room}");
    }
    for heights in rooms.iter().map(|room| &room["heights"]) {
        let [low, high] = [0, 1].map(|i| heights[i].as_f64().unwrap());
        assert!(low.abs() < 0.1 && (2.0..4.0).contains(&high), "{heights}");
    }
    assert_eq!(index["votes"][0]["area"], 1);
    assert!(index["areas"][0]["inputs"].is_null());
}

#[test]
fn what_is_shown_first_is_small_and_colours_are_sharp_where_that_shows_more() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let to = dir.path().join("report");
    let jpeg = |url: &Value| image::load_from_memory(&url_bytes(url, "jpeg")).unwrap();

    // Panoramas of 160 pixels; 80 would be a half, and 53 are a third.
    for (pano_width, sharp) in [(40, Some([80, 40])), (80, Some([160, 80])), (160, None)] {
        made(&out, &to, &ReportOptions { pano_width, overwrite: true, ..SMALL });
        let index = value(&to, "index");
        let small = value(&to, "panos_0");
        for (i, location) in index["locations"].as_array().unwrap().iter().enumerate() {
            let look = location["look_deg"].as_f64().unwrap();
            assert!((-180.0..180.0).contains(&look) && look % 15.0 == 0.0, "{look}");
            let small = jpeg(&small[i]);
            assert_eq!((small.width(), small.height()), (48.min(pano_width), 24.min(pano_width / 2)));

            let picture = value(&to, &format!("pano_{i}"));
            assert_eq!(pair(&picture["size"]), [pano_width, pano_width / 2]);
            let file = to.join(format!("data/sharp_{i}.js"));
            assert_eq!((picture.get("sharp").map(pair), file.exists()), (sharp, sharp.is_some()));
            if let Some(sharp) = sharp {
                let colors = jpeg(&value(&to, &format!("sharp_{i}")));
                assert_eq!([colors.width(), colors.height()], sharp);
            }
        }
    }
    let first = value(&to, "first");
    assert_eq!(first["name"], "data set");
    let parts = ["meshes", "panoramas", "views", "plan"];
    assert!(parts.iter().all(|part| first["parts"][part] == true), "{first}");
    assert!(["against", "scores"].iter().all(|part| first["parts"][part] == false), "{first}");
    assert_eq!(first["outline"].as_array().unwrap().len(), 4);

    // Grey images lose nothing when they are halved.
    let data = DataSet::open(&out).unwrap();
    for image in data.images(1).iter().filter(|image| image.frame == Frame::Panorama) {
        let path = image.path(data.layout(), Domain::Rgb);
        let gray = Raster::filled(160, 80, [90; 3]);
        write_rgb8(&path, &gray, Content::Photo, Compression::Fast).unwrap();
    }
    list_files(&out);
    made(&out, &to, &ReportOptions { pano_width: 80, overwrite: true, ..SMALL });
    assert!(value(&to, "pano_0").get("sharp").is_none() && !to.join("data/sharp_0.js").exists());
}

#[test]
fn bytes_do_not_depend_on_threads_and_earlier_reports_are_replaced_when_asked() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let to = dir.path().join("report");
    let on = |threads, to: &Path| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| made(&out, to, &SMALL))
    };
    on(1, &to);
    on(3, &dir.path().join("other"));
    let first = files(&to);
    assert!(first == files(&dir.path().join("other")));

    let again = report(&out, &to, &SMALL, &Context::default()).unwrap_err();
    assert!(matches!(&again, Error::Dataset(_)) && again.to_string().contains("`overwrite`"), "{again}");
    assert!(first == files(&to));
    let larger = ReportOptions { thumbs: 32, overwrite: true, ..SMALL };
    made(&out, &to, &larger);
    assert!(first != files(&to));
    // Files of others stay, and so does the data set.
    let strange = dir.path().join("thesis");
    fs::create_dir(&strange).unwrap();
    fs::write(strange.join("chapter.tex"), "").unwrap();
    for place in [&strange, &out.join("report")] {
        let e = report(&out, place, &larger, &Context::default()).unwrap_err();
        assert!(matches!(e, Error::Dataset(s3d_dataset::Error::Usage(_))), "{e}");
    }
    assert_eq!(files(&strange).len(), 1);
}

#[test]
fn what_is_missing_or_damaged_is_told_and_the_rest_is_shown() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let data = DataSet::open(&out).unwrap();
    let images = data.images(1);
    let panorama = images.iter().find(|image| image.frame == Frame::Panorama).unwrap();
    let view = images.iter().find(|image| image.frame == Frame::View(0)).unwrap();
    let gone = panorama.path(data.layout(), Domain::Depth);
    fs::remove_file(&gone).unwrap();
    let flipped = view.path(data.layout(), Domain::Semantic);
    let mut bytes = fs::read(&flipped).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&flipped, bytes).unwrap();
    fs::write(data.layout().rooms_json(1), "[").unwrap();

    let to = dir.path().join("report");
    let context = Context::default();
    let made = report(&out, &to, &SMALL, &context).unwrap();
    let told: Vec<&str> = made.faults.iter().map(|fault| fault.path.as_str()).collect();
    let mut expected = [
        panorama.relative_path(Domain::Depth),
        view.relative_path(Domain::Semantic),
        "area_1/3d/rooms.json".into(),
    ];
    expected.sort();
    assert_eq!(told, expected);
    assert_eq!(context.warnings(), 3);
    assert!(
        made.faults
            .iter()
            .all(|fault| !fault.message.is_empty() && !fault.message.contains("data set/"))
    );
    let missing = DataSet::open(&out).unwrap().missing(&context).unwrap();
    // The third file has its size, so its fault shows only when it is read.
    assert_eq!(missing.len(), 2);
    for fault in made.faults.iter().filter(|fault| missing.contains_key(&fault.path)) {
        assert!(missing[&fault.path] == fault.message && !fault.message.contains(&fault.path), "{fault:?}");
        assert!(!fault.message.starts_with([':', ' ']), "{fault:?}");
    }
    let index = value(&to, "index");
    assert_eq!(index["faults"].as_array().unwrap().len(), 3);
    assert!(index["rooms"].as_array().unwrap().is_empty());
    let at = index["locations"]
        .as_array()
        .unwrap()
        .iter()
        .position(|l| l["uuid"] == panorama.uuid)
        .unwrap();
    let picture = value(&to, &format!("pano_{at}"));
    assert!(picture["depth"].is_null() && picture["rgb"].is_string() && picture["label"].is_string());

    // Without its list of files, a data set cannot be checked.
    fs::remove_file(out.join("files.csv")).unwrap();
    let e = report(&out, &dir.path().join("none"), &SMALL, &context)
        .unwrap_err()
        .to_string();
    assert!(e.contains("files.csv") && !dir.path().join("none").exists(), "{e}");
}

#[test]
fn without_labels_there_is_all_that_needs_none() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), false);
    let to = dir.path().join("report");
    let made = made(&out, &to, &SMALL);
    assert_eq!((made.faults.len(), made.panoramas), (0, 6));
    let index = value(&to, "index");
    for none in ["classes", "labels", "rooms", "votes", "pixels_by_class"] {
        assert!(index[none].as_array().unwrap().is_empty(), "{none}");
    }
    assert!(index["data_set"]["taxonomy"].is_null());
    let picture = value(&to, "pano_0");
    assert!(picture["label"].is_null() && picture["depth"].is_string());
}

#[test]
fn an_export_that_did_not_finish_is_shown_as_far_as_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let (export, out) = (export(dir.path(), true), dir.path().join("data set"));
    // Cancelled when two scan locations have their images.
    let cancel = Cancel::default();
    let (theirs, done) = (cancel.clone(), AtomicU32::new(0));
    let context = Context::default()
        .cancelled_by(cancel)
        .observed_by(move |event: &Event<'_>| {
            let is_location = matches!(event, Event::UnitFinished { unit: UnitKind::Location, .. });
            if is_location && done.fetch_add(1, Ordering::Relaxed) == 1 {
                theirs.cancel();
            }
        });
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(matches!(one.install(|| export.run(&out, &context)), Err(s3d_dataset::Error::Cancelled)));
    let to = dir.path().join("report");
    let context = Context::default();
    let made = report(&out, &to, &SMALL, &context).unwrap();
    assert_eq!((made.faults.len(), made.panoramas), (0, 2), "{:?}", made.faults);
    assert!(context.warnings() > 0);
    let index = value(&to, "index");
    let missing = index["data_set"]["missing_yet"].as_array().unwrap();
    assert!(
        missing
            .iter()
            .any(|m| m == "area 1: 4 scan locations have no images yet"),
        "{missing:?}"
    );
    assert!(index["rooms"].as_array().unwrap().len() == 4 && index["views"].as_array().unwrap().len() > 2);
    assert!(value(&to, "pano_0")["rgb"].is_string());

    // After the export was resumed, nothing is missing.
    export.run(&out, &Context::default()).unwrap().unwrap();
    assert_eq!(
        report(&out, &to, &ReportOptions { overwrite: true, ..SMALL }, &context)
            .unwrap()
            .panoramas,
        6
    );
    assert!(value(&to, "index")["data_set"]["missing_yet"].is_null());
    let nothing = dir.path().join("nothing");
    let e = report(&nothing, &dir.path().join("none"), &SMALL, &context)
        .unwrap_err()
        .to_string();
    assert!(e.contains("manifest.json"), "{e}");
}

#[test]
fn one_file_has_all_of_it() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), false);
    let (folder, file) = (dir.path().join("report"), dir.path().join("report.html"));
    made(&out, &folder, &SMALL);
    let single = ReportOptions { single: true, ..SMALL };
    let report_of_one = made(&out, &file, &single);
    let page = fs::read_to_string(&file).unwrap();
    assert_eq!((&report_of_one.page, report_of_one.bytes), (&file, page.len() as u64));
    // The page has the same values, ahead of the program that reads them.
    let (before, program) = page.rsplit_once("<script>").unwrap();
    assert!(program.contains("s3dReport"));
    let mut found = 0;
    for element in before.split("<script type=\"application/json\" data-key=\"").skip(1) {
        let (key, rest) = element.split_once("\">").unwrap();
        let text = rest.split("</script>").next().unwrap();
        assert_eq!(serde_json::from_str::<Value>(text).unwrap(), value(&folder, key), "{key}");
        found += 1;
    }
    assert_eq!(found, fs::read_dir(folder.join("data")).unwrap().count());

    let again = report(&out, &file, &single, &Context::default())
        .unwrap_err()
        .to_string();
    assert!(again.contains("`overwrite`"), "{again}");
    made(&out, &file, &ReportOptions { overwrite: true, ..single.clone() });
    assert_eq!(fs::read_to_string(&file).unwrap(), page);
    let letter = dir.path().join("letter.html");
    fs::write(&letter, "<!doctype html>Dear all").unwrap();
    for place in [letter.clone(), out.join("report.html"), folder.clone()] {
        let options = ReportOptions { overwrite: true, ..single.clone() };
        let e = report(&out, &place, &options, &Context::default()).unwrap_err();
        let is_usage = matches!(e, Error::Occupied(_) | Error::Dataset(s3d_dataset::Error::Usage(_)));
        assert!(is_usage, "{e}");
    }
    assert_eq!(fs::read_to_string(&letter).unwrap(), "<!doctype html>Dear all");
}

#[test]
fn what_verify_finds_is_told_if_it_is_asked() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), false);
    let verified = |to: &str| {
        let to = dir.path().join(to);
        made(&out, &to, &ReportOptions { verify: true, ..SMALL });
        value(&to, "index")["verified"].clone()
    };
    let good = verified("good");
    assert!(good["checks"].as_u64().unwrap() > 1000 && good["faults"].as_array().unwrap().is_empty());

    let data = DataSet::open(&out).unwrap();
    let image = data
        .images(1)
        .into_iter()
        .find(|image| image.frame == Frame::View(0))
        .unwrap();
    let path = image.relative_path(Domain::Normal);
    fs::write(out.join(&path), b"no image").unwrap();
    let found = verified("bad");
    let faults = found["faults"].as_array().unwrap();
    assert!(
        faults
            .iter()
            .any(|group| group["first"][0][0] == *path && group["count"] == 1),
        "{found}"
    );
}

#[test]
fn scores_are_shown_and_must_be_of_this_data_set() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let data = DataSet::open(&out).unwrap();
    let scores = |checksum: &str| {
        serde_json::json!({
            "protocol": "sem3d", "version": 1, "variant": "pointcept", "evaluator": "0.2.0",
            "truth": {"files_xxh3_128": checksum, "areas": [[1]]},
            "options": {"seed": 0}, "definition": ["A sentence."], "counted": {"rooms": 1},
            "tables": [{"title": "area 1", "columns": ["IoU"], "rows": [
                {"name": "mean", "scores": [{"value": 0.5, "interval": [0.25, null]}]},
            ]}],
            "confusion": {"classes": ["wall"], "counts": [[5, 1]]},
            "units": {"columns": ["IoU"], "rows": ["mean"], "units": [
                {"area": 1, "name": "office_1", "scores": [[null]]},
            ]},
            "notes": [],
        })
    };
    let path = dir.path().join("ours.json");
    let options = ReportOptions { scores: vec![path.clone()], ..SMALL };
    let to = dir.path().join("report");

    fs::write(&path, scores("0").to_string()).unwrap();
    let error = report(&out, &to, &options, &Context::default()).unwrap_err();
    assert!(matches!(error, Error::OtherDataSet(_)) && !to.exists(), "{error}");
    fs::write(&path, "{}").unwrap();
    let error = report(&out, &to, &options, &Context::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("ours.json") && error.contains("protocol"), "{error}");

    let expected = scores(&data.checksum());
    fs::write(&path, expected.to_string()).unwrap();
    made(&out, &to, &options);
    assert_eq!(value(&to, "index")["scores"], 1);
    let shown = value(&to, "scores_0");
    assert_eq!(shown["name"], "ours");
    for member in ["tables", "confusion", "units", "counted"] {
        assert_eq!(shown[member], expected[member], "{member}");
    }
}
