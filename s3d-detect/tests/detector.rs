//! From an exported data set to a model, to detections, and to a table.

use s3d_dataset::{Context, DataSet, Export, ExportOptions};
use s3d_detect::boxes::iou;
use s3d_detect::features::Variant;
use s3d_detect::table::markdown;
use s3d_detect::{
    Area, CLASSES, Element, Error, Model, ParsedArea, Space, SpaceSource, TrainOptions, cross_validate,
    detect_area, read_areas,
};
use s3d_geom::Aabb;
use s3d_synth::{Building, BuildingOptions, ScanOptions};
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

/// A data set of areas 1 and 5 with two rooms and a hallway each.
static DATA: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let scenes = [1, 5].map(|area| {
        let options = BuildingOptions { texture_scale: 0.05, ..BuildingOptions::drawn(2, u64::from(area)) };
        let scene = Building::generate(&options).unwrap().build().unwrap();
        let options = ScanOptions { area, points_per_m2: 400.0, ..ScanOptions::default() };
        scene
            .write_scan(&folder.path().join(format!("scan_{area}")), &options, || true)
            .unwrap()
    });
    let small = ExportOptions { views: 0, size: 8, pano_width: 16, ..ExportOptions::default() };
    let options = ExportOptions { points_per_m2: 800.0, modalities: Vec::new(), ..small };
    Export::new(scenes)
        .options(options)
        .run(folder.path().join("data"), &Context::default())
        .unwrap();
    folder
});

fn data() -> DataSet {
    DataSet::open(&DATA.path().join("data")).unwrap()
}

fn areas() -> Vec<ParsedArea> {
    read_areas(&data(), &[1, 5], SpaceSource::Parsed, &Context::default()).unwrap()
}

fn on_threads<T: Send>(threads: usize, call: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
        .install(call)
}

fn train(areas: &[ParsedArea], seed: u64) -> Model {
    let spaces: Vec<&Space> = areas[..1].iter().flat_map(|a| &a.spaces).collect();
    Model::train(&spaces, &TrainOptions { seed, ..TrainOptions::default() }, &Context::default()).unwrap()
}

#[test]
fn the_same_seed_gives_the_same_bytes_for_any_number_of_threads() {
    let bytes = |threads, seed| {
        on_threads(threads, || {
            let areas = areas();
            let model = train(&areas, seed);
            let found = detect_area(&model, &areas[1], &Context::default()).unwrap();
            (serde_json::to_string(&model).unwrap(), serde_json::to_string(&found).unwrap())
        })
    };
    let one = bytes(1, 3);
    assert_eq!(one, bytes(3, 3));
    assert_ne!(one.0, bytes(3, 4).0);
    assert!(one.1.contains("\"class\":\"wall\""));
}

#[test]
fn models_beat_chance_and_find_what_they_learnt_from() {
    let areas = areas();
    for area in &areas {
        // Two rooms and a hallway. Every element is in a space.
        assert_eq!(area.spaces.len(), 3, "{}", area.agreement);
        assert!(area.agreement > 0.95, "{}", area.agreement);
        assert_eq!(area.spaces.iter().map(|s| s.elements.len()).sum::<usize>(), area.elements.len());
    }

    let options = TrainOptions { seed: 1, ..TrainOptions::default() };
    let table = cross_validate(&areas, &options, &Context::default()).unwrap();
    let overall = |row: &str| table.numbers(row, 0).unwrap()[CLASSES.len() + 2].unwrap();
    let names = Variant::ALL.map(Variant::name);
    assert_eq!(table.rows.iter().map(|(n, _)| &**n).take(4).collect::<Vec<_>>(), names);
    assert!(overall("Full model") > 2.0 * overall("Random scores") + 5.0, "{}", markdown(&[table]));

    let model = train(&areas, 1);
    let found = detect_area(&model, &areas[0], &Context::default()).unwrap();
    let is_found = |e: &&Element| {
        let of_class = found.iter().filter(|f| f.class == CLASSES[e.class].name());
        let mut boxes = of_class.map(|f| Aabb { min: f.min.into(), max: f.max.into() });
        boxes.any(|b| iou(&b, &e.bbox) > 0.5)
    };
    let all = areas[0].elements.len();
    let again = areas[0].elements.iter().filter(is_found).count();
    assert!(2 * again > all, "{again} of {all}");
    // Each box has a room of the area.
    assert!(found.iter().all(|f| f.area == 1 && areas[0].rooms.contains(&f.room)));
}

/// A list of rooms that is too short, as of an area made by hand.
#[test]
fn rooms_without_a_name_are_an_error_or_no_space() {
    let mut areas = areas();
    let model = train(&areas, 1);
    let rooms = areas[0].rooms.len();
    areas[0].rooms.clear();
    let told = detect_area(&model, &areas[0], &Context::default()).unwrap_err();
    assert!(
        matches!(told, Error::UnnamedRoom { area: 1, room, rooms: 0 } if (room as usize) < rooms),
        "{told}"
    );

    let mut area = Area::read(&data(), 1, &Context::default()).unwrap();
    area.rooms.clear();
    let parsed = ParsedArea::new(area, SpaceSource::Rooms);
    assert!(parsed.spaces.is_empty());
    assert_eq!(detect_area(&model, &parsed, &Context::default()).unwrap(), []);
}

#[test]
fn models_are_saved_loaded_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.json");
    let model = train(&areas(), 2);
    model.save(&path).unwrap();
    assert_eq!(Model::load(&path).unwrap(), model);

    let text = serde_json::to_string(&model).unwrap();
    let refused = |from: &str, to: &str, why: &str| {
        assert!(text.contains(from), "{from}");
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let told = Model::load(&path).unwrap_err().to_string();
        assert!(told.contains("model.json") && told.contains(why), "{told}");
    };
    refused("s3d detector", "other", "is no model");
    refused("\"version\":2", "\"version\":9", "version 9");
    refused("\"bottom_m\":[", "\"bottom_m\":[1e9,", "invalid length");
    refused("\"class\":0", "\"class\":77", "class 77");
    refused("\"weights\":[", "\"weights\":[0.5,", "finite weights");
    refused("\"unary\":[", "\"unary\":[[0,0],", "context");

    let is_file = |error: &Error| matches!(error, Error::Dataset(s3d_dataset::Error::File(_)));
    fs::write(&path, &text[..text.len() / 2]).unwrap();
    assert!(Model::load(&path).is_err_and(|e| is_file(&e)));
    assert!(Model::load(Path::new("nowhere.json")).is_err_and(|e| is_file(&e)));
}

#[test]
fn calls_that_make_no_sense_say_so() {
    let context = Context::default();
    let told = read_areas(&data(), &[2], SpaceSource::Rooms, &context)
        .unwrap_err()
        .to_string();
    assert!(told.contains("no area 2"), "{told}");

    let areas = areas();
    let told = cross_validate(&areas[..1], &TrainOptions::default(), &context)
        .unwrap_err()
        .to_string();
    assert!(told.contains("make no fold"), "{told}");
    let told = Model::train(&[], &TrainOptions::default(), &context)
        .unwrap_err()
        .to_string();
    assert!(told.contains("no annotated element"), "{told}");

    context.cancel.cancel();
    let cancelled = read_areas(&data(), &[1], SpaceSource::Rooms, &context).unwrap_err();
    assert!(matches!(cancelled, Error::Dataset(s3d_dataset::Error::Cancelled)), "{cancelled}");
}
