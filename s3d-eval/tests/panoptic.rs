//! Evaluates COCO's panoptic files on a data set.

mod scene;

use s3d_dataset::pack::{ClassList, CocoOptions, PackOptions, Package, PackedImages};
use s3d_dataset::{DataSet, Export, ExportOptions, pack};
use s3d_eval::{Context, EvalOptions, Evaluation, Folds, Protocol, Result, evaluate};
use s3d_geom::Raster;
use s3d_io::fs::{read_json, write_json};
use s3d_io::image::{Compression, Content, encode_rgb8, read_rgb8};
use s3d_synth::{Building, ScanOptions};
use scene::data_set;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Packs the images of the data set itself into a folder.
fn packed(change: impl Fn(&mut CocoOptions)) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("coco");
    let mut coco = CocoOptions::default();
    change(&mut coco);
    let options = PackOptions { output: Some(out.clone()), ..PackOptions::default() };
    pack(data_set(), &Package::Coco(coco), &options, &Context::default()).unwrap();
    (folder, out)
}

fn panoptic(predictions: &Path, change: impl Fn(&mut EvalOptions)) -> Result<Evaluation> {
    let mut options = EvalOptions::default();
    change(&mut options);
    evaluate(Protocol::Panoptic, data_set(), predictions, &options, &Context::default())
}

/// Returns the error for the package after its list of annotations was changed.
fn message(package: &Path, change: impl FnOnce(&mut Value)) -> String {
    let path = package.join("panoptic.json");
    let before: Value = read_json(&path).unwrap();
    let mut value = before.clone();
    change(&mut value);
    write_json(&path, &value).unwrap();
    let error = panoptic(package, |_| ()).unwrap_err().to_string();
    write_json(&path, &before).unwrap();
    error
}

fn assert_perfect(evaluation: &Evaluation) {
    let text = evaluation.to_markdown();
    for table in &evaluation.tables {
        let scores = table.rows.iter().flat_map(|row| &row.scores);
        assert!(scores.clone().all(|s| s.value == 1.0 || s.value.is_nan()), "{text}");
        assert!(scores.filter(|s| s.value == 1.0).count() >= 3 * 10, "{text}");
    }
}

#[test]
fn a_data_set_against_itself_is_perfect() {
    let (_folder, package) = packed(|_| ());
    let evaluation = panoptic(&package, |_| ()).unwrap();
    assert_perfect(&evaluation);
    let all: Value = read_json(&package.join("panoptic.json")).unwrap();
    let count = all["annotations"].as_array().unwrap().len() as u64;
    let (views, panoramas) = (evaluation.counted["views"], evaluation.counted["panoramas"]);
    assert!(views + panoramas == count && views > 0 && panoramas > 0 && evaluation.notes.is_empty());

    // The file by its name; then only panoramas, in folds, with intervals; then one area.
    assert_perfect(&panoptic(&package.join("panoptic.json"), |_| ()).unwrap());
    let (_folder, package) = packed(|o| o.images = PackedImages::Panoramas);
    let evaluation = panoptic(&package, |o| (o.folds, o.bootstrap) = (Folds::EachArea, Some(20))).unwrap();
    assert_perfect(&evaluation);
    assert_eq!((evaluation.counted["views"], evaluation.counted["panoramas"]), (0, panoramas));
    assert_eq!((evaluation.tables.len(), evaluation.tables[0].title.as_str()), (4, "area 2"));
    assert_eq!(evaluation.tables[3].rows[15].scores[0].interval, Some([1.0, 1.0]));
    let evaluation = panoptic(&package, |o| o.folds = Folds::Areas(vec![5])).unwrap();
    assert!(evaluation.notes[0].contains("areas that are not tested"), "{:?}", evaluation.notes);
}

#[test]
fn the_stuff_classes_can_be_chosen() {
    let stuff: ClassList = "floor,door".parse().unwrap();
    let (_folder, package) = packed(|o| o.stuff = Some(stuff.clone()));
    let told = panoptic(&package, |_| ()).unwrap_err().to_string();
    assert!(
        told.contains(
            "ceiling is a thing, and by the taxonomy of the data set stuff, unless the option `stuff`"
        ),
        "{told}"
    );
    let evaluation = panoptic(&package, |o| o.stuff = Some(stuff.clone())).unwrap();
    assert_perfect(&evaluation);
    let definition = evaluation.definition.join(" ");
    assert!(definition.contains("but of floor, door all of an image is one"), "{definition}");
    let told = panoptic(&package, |o| o.stuff = Some("grass".parse().unwrap()))
        .unwrap_err()
        .to_string();
    assert!(told.contains("stuff: \"grass\" is no class"), "{told}");
}

/// There is nothing to find where a view reaches beyond its photograph.
#[test]
fn outside_of_photographs_is_void() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let scan = ScanOptions { points_per_m2: 60.0, ..ScanOptions::default() };
    let scene = Building::demo()
        .build()
        .unwrap()
        .write_scan(&at("scan"), &scan, || true)
        .unwrap();
    let with_frames = fs::read_to_string(&scene).unwrap() + "\n[frames]\npath = \"transforms.json\"\n";
    fs::write(&scene, with_frames).unwrap();

    // The view along x from a scan location reaches beyond its photograph, because of pincushion distortion.
    let pose = [[0.0, 0.0, -1.0, 14.15], [-1.0, 0.0, 0.0, 7.75], [0.0, 1.0, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0]];
    let list = json!({
        "camera_model": "OPENCV", "w": 80, "h": 60, "fl_x": 50, "fl_y": 50, "cx": 40, "cy": 30, "k1": 0.3,
        "frames": [{"file_path": "0.png", "transform_matrix": pose}],
    });
    write_json(&at("scan/transforms.json"), &list).unwrap();
    let picture = Raster::from_vec(80, 60, (0..4800u32).map(|i| [1 + (i * 37 % 251) as u8; 3]).collect());
    fs::write(at("scan/0.png"), encode_rgb8(&picture, Content::Photo, Compression::Balanced)).unwrap();

    let options =
        ExportOptions { views: 1, size: 32, pano_width: 64, points_per_m2: 5.0, ..ExportOptions::default() };
    let [out, package] = ["out", "coco"].map(at);
    Export::new([scene])
        .options(options)
        .run(&out, &Context::default())
        .unwrap()
        .unwrap();
    let photographs = DataSet::open(&out).unwrap().photographs(1).unwrap();
    assert!(photographs.len() == 1 && photographs[0].masked > 0.02, "{photographs:?}");

    let options = PackOptions { output: Some(package.clone()), ..PackOptions::default() };
    let views = CocoOptions { images: PackedImages::Views, ..CocoOptions::default() };
    pack(&out, &Package::Coco(views), &options, &Context::default()).unwrap();
    let options = EvalOptions::default();
    let evaluation = evaluate(Protocol::Panoptic, &out, &package, &options, &Context::default()).unwrap();
    let scores = evaluation.tables[0].rows.iter().flat_map(|row| &row.scores);
    assert!(scores.clone().all(|s| s.value == 1.0 || s.value.is_nan()), "{}", evaluation.to_markdown());
    assert_eq!(evaluation.score("area 1", "mean", "PQ"), Some(1.0));
}

#[test]
fn trainers_write_other_names() {
    // A flat folder with other names, no categories, and an image that is not listed.
    let (_folder, package) = packed(|o| o.images = PackedImages::Panoramas);
    let path = package.join("panoptic.json");
    let mut value: Value = read_json(&path).unwrap();
    value.as_object_mut().unwrap().remove("categories");
    for (i, annotation) in value["annotations"].as_array_mut().unwrap().iter_mut().enumerate() {
        let name = format!("{i}.png");
        let old = package.join("panoptic").join(annotation["file_name"].as_str().unwrap());
        fs::rename(old, package.join("panoptic").join(&name)).unwrap();
        annotation["file_name"] = json!(name);
    }
    write_json(&path, &value).unwrap();
    fs::copy(package.join("panoptic/0.png"), package.join("panoptic/more.png")).unwrap();
    let evaluation = panoptic(&package, |_| ()).unwrap();
    assert_perfect(&evaluation);
    assert!(evaluation.notes[0].starts_with("1 images that are not listed"), "{:?}", evaluation.notes);
}

#[test]
fn a_segment_that_is_lost_is_missed() {
    let (_folder, package) = packed(|o| o.images = PackedImages::Panoramas);
    let path = package.join("panoptic.json");
    let mut value: Value = read_json(&path).unwrap();

    // The first segment of a floor becomes void.
    let lost = |segment: &Value| segment["category_id"] == 2;
    let mut floors = 0;
    let mut segment = None;
    for annotation in value["annotations"].as_array_mut().unwrap() {
        let png = package.join("panoptic").join(annotation["file_name"].as_str().unwrap());
        let segments = annotation["segments_info"].as_array_mut().unwrap();
        floors += segments.iter().filter(|s| lost(s)).count();
        if segment.is_none() && segments.iter().any(lost) {
            segment = segments
                .iter()
                .find(|s| lost(s))
                .map(|s| s["id"].as_u64().unwrap() as u32);
            segments.retain(|s| !lost(s));
            let image = read_rgb8(&png).unwrap();
            let [r, g, b, _] = segment.unwrap().to_le_bytes();
            let erased = image.map(|p| if p == [r, g, b] { [0; 3] } else { p });
            fs::write(&png, encode_rgb8(&erased, Content::Labels, Compression::Balanced)).unwrap();
        }
    }
    write_json(&path, &value).unwrap();
    let evaluation = panoptic(&package, |_| ()).unwrap();
    let found = (floors - 1) as f64;
    let score = |column| evaluation.score("areas 2, 5", "floor", column).unwrap();
    assert_eq!((score("SQ"), score("RQ")), (1.0, found / (found + 0.5)));
    assert_eq!(evaluation.score("areas 2, 5", "mean of things", "PQ"), Some(1.0));
}

#[test]
fn wrong_predictions_are_refused() {
    let (_folder, package) = packed(|o| o.images = PackedImages::Panoramas);
    let first = |value: &mut Value, key: &str, new: Value| value["annotations"][0][key] = new;
    let e = message(&package, |v| first(v, "image_id", json!(2)));
    assert!(e.contains("panoptic.json: image 2: ") && e.contains("annotated twice"), "{e}");
    let e = message(&package, |v| drop(v["annotations"].as_array_mut().unwrap().remove(0)));
    assert!(e.contains("panoptic.json: has no prediction of 1 of"), "{e}");
    let e = message(&package, |v| v["annotations"] = json!([]));
    assert!(e.contains("no prediction of an image"), "{e}");
    let e = message(&package, |v| v["images"][0]["file_name"] = json!("dog.png"));
    assert!(e.contains("image 1: \"dog.png\" is no name of an image"), "{e}");
    let e = message(&package, |v| {
        let name = v["images"][0]["file_name"]
            .as_str()
            .unwrap()
            .replace("_frame_", "_frame_7");
        let name = name.replace("7equirectangular", "7");
        v["images"]
            .as_array_mut()
            .unwrap()
            .push(json!({"id": 999, "file_name": name}));
        let more = json!({"image_id": 999, "file_name": "more.png", "segments_info": []});
        v["annotations"].as_array_mut().unwrap().push(more);
    });
    assert!(e.contains("the data set has no semantic image for ") && e.contains("more.png"), "{e}");
    let e = message(&package, |v| first(v, "file_name", json!("gone.png")));
    assert!(e.contains("gone.png"), "{e}");
    let e = message(&package, |v| v["annotations"][0]["segments_info"][0]["category_id"] = json!(99));
    assert!(e.contains("category 99, which the data set has not"), "{e}");
    let e =
        message(&package, |v| drop(v["annotations"][0]["segments_info"].as_array_mut().unwrap().remove(0)));
    assert!(e.contains("which is not listed (segments are listed in") && e.contains(".png"), "{e}");
    let e = message(&package, |v| v["categories"][0]["name"] = json!("sky"));
    assert!(e.contains("category 1 is \"sky\", and of the data set ceiling"), "{e}");
    let e = message(&package, |v| v["categories"][0]["id"] = json!(40));
    assert!(e.contains("category 40 (ceiling) is none of the data set's"), "{e}");
    let e = message(&package, |v| drop(v.as_object_mut().unwrap().remove("annotations")));
    assert!(e.contains("missing field `annotations`"), "{e}");

    let value: Value = read_json(&package.join("panoptic.json")).unwrap();
    let png = package
        .join("panoptic")
        .join(value["annotations"][0]["file_name"].as_str().unwrap());
    let small = Raster::from_vec(2, 1, vec![[0; 3]; 2]);
    fs::write(&png, encode_rgb8(&small, Content::Labels, Compression::Balanced)).unwrap();
    let e = panoptic(&package, |_| ()).unwrap_err().to_string();
    assert!(e.contains("2 × 1 pixels, and the data set's image has 96 × 48"), "{e}");
    fs::copy(package.join("panoptic.json"), package.join("extra.json")).unwrap();
    fs::create_dir(package.join("extra")).unwrap();
    assert!(
        panoptic(&package, |_| ())
            .unwrap_err()
            .to_string()
            .contains("has more than one")
    );
    fs::remove_dir_all(package.join("extra")).unwrap();
    fs::remove_dir_all(package.join("panoptic")).unwrap();
    assert!(
        panoptic(&package, |_| ())
            .unwrap_err()
            .to_string()
            .contains("has no such file")
    );
    let e = panoptic(&package.join("panoptic.json"), |_| ())
        .unwrap_err()
        .to_string();
    assert!(e.contains("panoptic: missing"), "{e}");

    // Another list of stuff gives other segments.
    let (_folder, package) = packed(|o| o.stuff = Some(ClassList(vec!["wall".into()])));
    let e = panoptic(&package, |_| ()).unwrap_err().to_string();
    assert!(e.contains("ceiling is a thing, and by the taxonomy of the data set stuff"), "{e}");
}
