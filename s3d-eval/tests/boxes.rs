//! Evaluates files of detections on a data set.

use crate::scene;

use s3d_dataset::DataSet;
use s3d_dataset::options::Profile;
use s3d_dataset::profile::{ProfileOptions, profile};
use s3d_dataset::s3d_label::Class;
use s3d_eval::{BoxSource, Context, EvalOptions, Evaluation, Folds, Protocol, Result, evaluate};
use s3d_io::dataset::PointBox;
use scene::data_set;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const FIVE: [&str; 5] = ["table", "chair", "sofa", "bookcase", "board"];

/// Evaluates against the boxes of the annotated points, of which none is flat.
fn det(predictions: &Path, change: impl Fn(&mut EvalOptions)) -> Result<Evaluation> {
    let mut options = EvalOptions::default();
    options.boxes = Some(BoxSource::Annotations);
    change(&mut options);
    evaluate(Protocol::Det, data_set(), predictions, &options, &Context::default())
}

fn five(options: &mut EvalOptions) {
    options.classes = Some(FIVE.map(str::to_owned).to_vec());
}

fn message(predictions: &Path, change: impl Fn(&mut EvalOptions)) -> String {
    det(predictions, change).unwrap_err().to_string()
}

/// Lists the boxes of the data set itself.
fn own_boxes() -> Vec<Value> {
    let data = DataSet::open(data_set()).unwrap();
    let mut list = Vec::new();
    for area in data.areas() {
        for i in data.instances(*area).unwrap() {
            let b = i.bbox.map(f64::from);
            let mut entry = json!({"area": area, "room": i.room, "class": i.class, "score": 0.5});
            // Boxes alternate between both forms.
            if list.len() % 2 == 0 {
                entry["min"] = json!(b[..3]);
                entry["max"] = json!(b[3..]);
            } else {
                entry["center"] = json!([0, 1, 2].map(|k| (b[k] + b[k + 3]) / 2.0));
                entry["size"] = json!([0, 1, 2].map(|k| b[k + 3] - b[k]));
            }
            list.push(entry);
        }
    }
    list
}

/// Writes the boxes of the data set itself, of five classes, like mmdetection3d: a file for each room.
fn own_samples(folder: &Path) {
    let data = DataSet::open(data_set()).unwrap();
    for area in data.areas() {
        let instances = data.instances(*area).unwrap();
        let points = data.point_boxes(*area).unwrap().unwrap();
        for room in instances.iter().map(|i| &i.room) {
            let of_room = instances.iter().filter(|i| i.room == *room);
            let of_points = points.iter().filter(|i| i.room == *room);
            let corner = PointBox::corner(of_points).map(|v| v as f32);

            let mut labels = Vec::new();
            let mut boxes = Vec::new();
            for (label, b) in of_room.filter_map(|i| Some((FIVE.iter().position(|c| *c == i.class)?, i.bbox)))
            {
                let [x, y] = [0, 1].map(|k| (b[k] + b[k + 3]) / 2.0 - corner[k]);
                labels.push(label);
                boxes.push([x, y, b[2] - corner[2], b[3] - b[0], b[4] - b[1], b[5] - b[2], 0.0]);
            }
            let scores = vec![0.5; labels.len()];
            let sample =
                json!({"labels_3d": labels, "scores_3d": scores, "bboxes_3d": boxes, "box_type_3d": "Depth"});
            fs::write(folder.join(format!("Area_{area}_{room}.json")), sample.to_string()).unwrap();
        }
    }
}

fn write(folder: &Path, name: &str, value: &Value) {
    fs::write(folder.join(name), value.to_string()).unwrap();
}

/// Asserts that all classes of the truth have the score 1, and returns the number of such rows.
fn assert_perfect(evaluation: &Evaluation, mean: bool) -> usize {
    let text = evaluation.to_markdown();
    for table in &evaluation.tables {
        for row in table.rows.iter().filter(|row| mean || !row.name.starts_with("mean")) {
            assert!(row.scores.iter().all(|s| s.value == 1.0 || s.value.is_nan()), "{text}");
        }
    }
    let rows = &evaluation.tables[0].rows;
    assert!(
        rows.last()
            .is_some_and(|row| row.name == "mean" && row.scores[0].value > 0.0),
        "{text}"
    );
    rows.iter().filter(|row| row.scores[0].value == 1.0).count()
}

#[test]
fn a_data_set_against_itself_is_perfect() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("boxes.json");
    fs::write(&path, json!(own_boxes()).to_string()).unwrap();
    let evaluation = det(&path, |_| ()).unwrap();
    assert!(assert_perfect(&evaluation, true) >= 10);
    let clutter = own_boxes().iter().filter(|b| b["class"] == "clutter").count() as u64;
    let boxes = own_boxes().len() as u64 - clutter;
    assert_eq!((evaluation.counted["boxes"], evaluation.counted["detections"]), (boxes, boxes));
    let [others, other_boxes] = &*evaluation.notes else { panic!("{:?}", evaluation.notes) };
    assert_eq!(*others, format!("{clutter} detections are of classes that are not evaluated."));
    assert!(other_boxes.starts_with("Perfect boxes of the sampled points"), "{other_boxes}");

    let open3d = |o: &mut EvalOptions| o.variant = Some("open3d-ml".into());
    let evaluation = det(&path, open3d).unwrap();
    assert_eq!(evaluation.tables[0].columns, ["AP@0.25", "AP@0.50"]);
    let there = det(&path, |_| ()).unwrap().tables[0]
        .rows
        .iter()
        .take(12)
        .map(|r| r.scores[0].value)
        .collect::<Vec<_>>();
    for (row, is_there) in evaluation.tables[0].rows.iter().zip(there.iter().map(|v| !v.is_nan())) {
        assert!(row.scores.iter().all(|s| s.value == f64::from(u8::from(is_there))), "{row:?}");
    }

    // A folder of lists gives the same.
    let lists = tempfile::tempdir().unwrap();
    let all = own_boxes();
    write(lists.path(), "a.json", &json!(all[..10]));
    write(lists.path(), "b.json", &json!(all[10..]));
    fs::write(lists.path().join("log.txt"), "").unwrap();
    let evaluation = det(lists.path(), |_| ()).unwrap();
    assert!(assert_perfect(&evaluation, true) >= 10);
    assert!(evaluation.notes.iter().any(|n| n.contains("log.txt")), "{:?}", evaluation.notes);
}

#[test]
fn mmdetection3d_files_of_the_data_set_are_perfect() {
    let folder = tempfile::tempdir().unwrap();
    let below = folder.path().join("preds");
    fs::create_dir(&below).unwrap();
    own_samples(&below);
    for predictions in [&below, folder.path()] {
        let evaluation = det(predictions, five).unwrap();
        assert!(assert_perfect(&evaluation, true) >= 4);
        assert_eq!(evaluation.tables[0].rows.len(), 6);
    }
    // The files have labels of five classes.
    let e = message(&below, |o| o.classes = Some(vec!["sofa".into()]));
    assert!(e.contains(": label ") && e.contains("labels count sofa"), "{e}");
    assert!(message(&below, |o| o.classes = Some(vec!["stool".into()])).contains("classes: \"stool\""));
}

/// Writes what a perfect detector would find in the arrays of the profile `mmdet3d`: a file for each room,
/// with the boxes of its points in the frame of the array.
fn samples_of_profile(arrays: &Path, folder: &Path) {
    let numbers = |path: &Path| {
        let bytes = fs::read(path).unwrap();
        let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        bytes[10 + header..].to_vec()
    };
    let paths = fs::read_dir(arrays).unwrap().map(|entry| entry.unwrap().path());
    for path in paths.filter(|path| path.to_str().unwrap().ends_with("_point.npy")) {
        let stem = path.to_str().unwrap().strip_suffix("_point.npy").unwrap();
        let of_kind = |kind: &str| numbers(Path::new(&format!("{stem}_{kind}.npy")));
        let classes = of_kind("sem_label");
        let instances = of_kind("ins_label");
        let points = numbers(&path);

        let mut found: BTreeMap<i64, (i64, [f32; 6])> = BTreeMap::new();
        let columns = classes.chunks(8).zip(instances.chunks(8)).zip(points.chunks(24));
        for ((class, instance), row) in columns {
            let [class, instance] = [class, instance].map(|b| i64::from_le_bytes(b.try_into().unwrap()));
            let at = [0, 4, 8].map(|k| f32::from_le_bytes(row[k..k + 4].try_into().unwrap()));
            let [inf, none] = [f32::INFINITY, f32::NEG_INFINITY];
            let (_, b) = found
                .entry(instance)
                .or_insert((class, [inf, inf, inf, none, none, none]));
            for k in 0..3 {
                b[k] = b[k].min(at[k]);
                b[k + 3] = b[k + 3].max(at[k]);
            }
        }

        let names = found.values().map(|(class, _)| Class::S3DIS[*class as usize].name());
        let labels = names.map(|name| FIVE.iter().position(|five| *five == name));
        let (labels, boxes): (Vec<_>, Vec<_>) = labels
            .zip(found.values())
            .filter_map(|(label, (_, b))| {
                let [x, y] = [0, 1].map(|k| (b[k] + b[k + 3]) / 2.0);
                Some((label?, [x, y, b[2], b[3] - b[0], b[4] - b[1], b[5] - b[2], 0.0]))
            })
            .unzip();
        let sample = json!({"labels_3d": labels, "scores_3d": vec![0.5; boxes.len()], "bboxes_3d": boxes});
        let name = Path::new(stem).file_name().unwrap().to_str().unwrap();
        write(folder, &format!("{name}.json"), &sample);
    }
}

#[test]
fn a_perfect_learner_of_the_profile_is_perfect() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("data set");
    scene::copy_to(&root);
    profile(&root, &[Profile::Mmdet3d], &ProfileOptions::default(), &Context::default()).unwrap();
    let preds = folder.path().join("preds");
    fs::create_dir(&preds).unwrap();
    samples_of_profile(&root.join("profiles/mmdet3d/s3dis_data"), &preds);

    let evaluation = det(&preds, |o| {
        five(o);
        o.boxes = None;
    })
    .unwrap();
    assert_eq!(evaluation.counted["boxes"], evaluation.counted["detections"]);
    let data = DataSet::open(&root).unwrap();
    for class in FIVE {
        let boxes = data
            .areas()
            .iter()
            .flat_map(|area| data.point_boxes(*area).unwrap().unwrap());
        let boxes: Vec<PointBox> = boxes.filter(|b| b.class == class).collect();
        // The points are few, and some chairs have a single one: their boxes are flat and never found.
        let solid = boxes.iter().filter(|b| b.bbox[5] > b.bbox[2]).count();
        let recall = evaluation.score("areas 2, 5", class, "AR@0.50").unwrap();
        assert!(solid > 0 && recall == solid as f64 / boxes.len() as f64, "{class}: {recall}");
    }

    // The note tells what the other boxes reach, which is what they reach here.
    let path = folder.path().join("boxes.json");
    fs::write(&path, json!(own_boxes()).to_string()).unwrap();
    let other = det(&path, |o| {
        five(o);
        o.boxes = Some(BoxSource::Points);
    })
    .unwrap();
    let [quarter, half] =
        ["AP@0.25", "AP@0.50"].map(|column| other.score("areas 2, 5", "mean", column).unwrap());
    assert!(half < quarter, "{half} {quarter}");
    let told = format!(
        "Perfect boxes of the annotated points (instances.json) would reach a mean AP of {quarter:.3} at \
         0.25 and {half:.3} at 0.50 here."
    );
    assert!(evaluation.notes.contains(&told), "{told} {:?}", evaluation.notes);
}

#[test]
fn data_sets_without_boxes_of_their_points_are_compared_with_the_annotations() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("data set");
    scene::copy_to(&root);
    scene::change_list(&root, |list| {
        let lines = list.lines().filter(|line| !line.contains("pointcloud_boxes.json"));
        lines.map(|line| format!("{line}\n")).collect()
    });
    let path = folder.path().join("boxes.json");
    fs::write(&path, json!(own_boxes()).to_string()).unwrap();
    let preds = folder.path().join("preds");
    fs::create_dir(&preds).unwrap();
    own_samples(&preds);

    let mut options = EvalOptions::default();
    let run = |options: &EvalOptions, found: &Path| {
        evaluate(Protocol::Det, &root, found, options, &Context::default())
    };
    let error = run(&options, &path).unwrap_err();
    assert!(!error.is_usage() && error.to_string().contains("export it again"), "{error}");
    options.boxes = Some(BoxSource::Annotations);
    let evaluation = run(&options, &path).unwrap();
    assert!(assert_perfect(&evaluation, true) >= 10);
    assert!(!evaluation.notes.iter().any(|note| note.contains("would reach")), "{:?}", evaluation.notes);
    five(&mut options);
    let error = run(&options, &preds).unwrap_err().to_string();
    assert!(error.contains(".json: the data set does not tell the least corner"), "{error}");
}

#[test]
fn folds_and_intervals() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("boxes.json");
    // Area 2 is found, area 5 is not; one box is nowhere.
    let mut boxes = own_boxes();
    boxes.retain(|b| b["area"] == 2);
    let mut nowhere = boxes[0].clone();
    nowhere["class"] = json!("chair");
    nowhere["score"] = json!(0.25);
    nowhere["min"] = json!([90, 90, 90]);
    nowhere["max"] = json!([91, 91, 91]);
    boxes.push(nowhere);
    fs::write(&path, json!(boxes).to_string()).unwrap();

    let run = |o: &mut EvalOptions| {
        o.folds = Folds::Paper;
        o.bootstrap = Some(50);
    };
    let evaluation = det(&path, run).unwrap();
    let titles: Vec<&str> = evaluation.tables.iter().map(|t| t.title.as_str()).collect();
    assert_eq!(titles, ["area 5", "area 2", "all folds, pooled", "mean over folds"]);
    let score = |table: &str| evaluation.score(table, "wall", "AR@0.50").unwrap();
    assert_eq!((score("area 5"), score("area 2"), score("mean over folds")), (0.0, 1.0, 0.5));
    let walls = |area: Option<u32>| {
        own_boxes()
            .iter()
            .filter(|b| b["class"] == "wall" && area.is_none_or(|a| b["area"] == a))
            .count() as f64
    };
    assert_eq!(score("all folds, pooled"), walls(Some(2)) / walls(None));
    for table in &evaluation.tables {
        for row in table.rows.iter().filter(|row| !row.scores[0].value.is_nan()) {
            let [low, high] = row.scores[0].interval.unwrap();
            assert!(low <= row.scores[0].value && row.scores[0].value <= high, "{} {row:?}", table.title);
        }
    }

    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let again = one.install(|| det(&path, run).unwrap());
    assert_eq!(again.to_markdown(), evaluation.to_markdown());
    // With one area, the boxes in other areas are noted.
    let evaluation = det(&path, |o| o.folds = Folds::Areas(vec![5])).unwrap();
    assert_eq!(evaluation.counted["detections"], 0);
    assert!(evaluation.notes[0].contains("areas that are not tested"), "{:?}", evaluation.notes);
}

#[test]
fn wrong_lists_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("boxes.json");
    let good = own_boxes().remove(0);
    let with = |key: &str, value: Value| {
        let mut entry = good.clone();
        entry[key] = value;
        fs::write(&path, json!([good, entry]).to_string()).unwrap();
        let e = message(&path, |_| ());
        assert!(e.contains("boxes.json") && e.contains(": box 2: "), "{e}");
        e
    };
    assert!(with("area", json!(9)).contains("no area 9"));
    assert!(with("room", json!("office_99")).contains("no room \"office_99\""));
    assert!(with("class", json!("chiar")).contains("\"chiar\" is no class"));
    assert!(with("score", json!("high")).contains("invalid type"));
    assert!(with("size", json!([1, 1, 1])).contains("min and max, or center and size"));
    assert!(with("max", json!([-1e3, 0, 0])).contains("ends before it begins"));
    assert!(with("max", json!([1, 2])).contains("invalid length"));

    fs::write(&path, "[{\"score\": NaN}]").unwrap();
    assert!(message(&path, |_| ()).contains("boxes.json, line 1"));
    fs::write(&path, "{}").unwrap();
    let e = message(&path, |_| ());
    assert!(e.contains("missing field `labels_3d`") && e.contains("detections are a JSON file with"), "{e}");
    fs::remove_file(&path).unwrap();
    assert!(message(folder.path(), |_| ()).contains("has no JSON file"));
    fs::write(folder.path().join("results.pkl"), "").unwrap();
    assert!(message(folder.path(), |_| ()).contains("results.pkl: pickles are not read"));
    assert!(message(&folder.path().join("gone"), |_| ()).contains("gone"));
}

#[test]
fn wrong_files_of_mmdetection3d_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    own_samples(folder.path());
    let mut files: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    files.sort();
    let path = &files[0];
    let text = fs::read_to_string(path).unwrap();
    let name = path.file_name().unwrap().to_str().unwrap();
    let damaged = |value: Value| {
        fs::write(path, value.to_string()).unwrap();
        let e = message(folder.path(), five);
        fs::write(path, &text).unwrap();
        assert!(e.contains(name), "{e}");
        e
    };

    let sample = |row: Value| json!({"labels_3d": [0], "scores_3d": [1.0], "bboxes_3d": [row]});
    assert!(damaged(sample(json!([1, 2, 0, 1, 1, 1, 0.5]))).contains("box 1: it is turned"));
    assert!(damaged(sample(json!([1, 2, 0, 1, 1]))).contains("5 numbers instead of 7"));
    assert!(damaged(sample(json!([1, 2, 0, 1, -1, 1]))).contains("its size is negative"));
    let mut value = sample(json!([1, 2, 0, 1, 1, 1]));
    value["box_type_3d"] = json!("LiDAR");
    assert!(damaged(value.clone()).contains("box_type_3d is \"LiDAR\""));
    value["scores_3d"] = json!([]);
    value["box_type_3d"] = json!("Depth");
    assert!(damaged(value).contains("[1, 0, 1] labels_3d, scores_3d, bboxes_3d"));
    assert!(damaged(json!([])).contains("is a list of boxes"));

    fs::remove_file(path).unwrap();
    assert!(message(folder.path(), five).contains(&format!("{name}: missing, as are 1 of")));
    fs::write(folder.path().join("office_1.json"), sample(json!([1, 2, 0, 1, 1, 1])).to_string()).unwrap();
    assert!(message(folder.path(), five).contains("office_1.json: a room's file is called Area_N_ROOM.json"));
}
