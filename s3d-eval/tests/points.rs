//! Evaluates predictions of points on an export: files, orders, folds, faults.

use s3d_dataset::options::Profile;
use s3d_dataset::profile::ProfileOptions;
use s3d_dataset::s3d_io::cloud::NpyWriter;
use s3d_dataset::{Export, ExportOptions, profile};
use s3d_eval::{Context, EvalOptions, Evaluation, Folds, Protocol, Result, Table, evaluate};
use s3d_synth::{Building, ScanOptions};
use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Exports areas 1 and 5, with the profiles of mmdetection3d and Pointcept.
pub(crate) fn data_set() -> &'static Path {
    static MADE: OnceLock<TempDir> = OnceLock::new();
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        let dir = MADE.get_or_init(|| tempfile::tempdir().unwrap()).path();
        let scan = ScanOptions { points_per_m2: 60.0, ..ScanOptions::default() };
        let scenes = [1, 5].map(|area| {
            let folder = dir.join(format!("scan {area}"));
            let scene = Building::demo()
                .build()
                .unwrap()
                .write_scan(&folder, &scan, || true)
                .unwrap();
            let text = fs::read_to_string(&scene).unwrap();
            fs::write(&scene, text.replacen("area = 1", &format!("area = {area}"), 1)).unwrap();
            // The locations of the two areas need different names.
            let cameras = folder.join("cameras.csv");
            let of_area = |line: &str| match line.split_once(',') {
                Some((uuid, rest)) if uuid.len() == 32 => format!("{}{area},{rest}\n", &uuid[1..]),
                _ => format!("{line}\n"),
            };
            let lines: String = fs::read_to_string(&cameras).unwrap().lines().map(of_area).collect();
            fs::write(&cameras, lines).unwrap();
            scene
        });
        let options = ExportOptions {
            views: 1,
            size: 32,
            pano_width: 64,
            points_per_m2: 150.0,
            ..ExportOptions::default()
        };
        let out = dir.join("data set");
        Export::new(scenes)
            .options(options)
            .run(&out, &Context::default())
            .unwrap()
            .unwrap();
        let profiles = [Profile::Mmdet3d, Profile::Pointcept];
        profile(&out, &profiles, &ProfileOptions::default(), &Context::default()).unwrap();
        out
    })
}

/// Returns the classes and the instances of the points of each room, from the profile of mmdetection3d.
pub(crate) fn rooms() -> BTreeMap<String, (Vec<i64>, Vec<i64>)> {
    let arrays = data_set().join("profiles/mmdet3d/s3dis_data");
    let numbers = |path: &Path| -> Vec<i64> {
        let bytes = fs::read(path).unwrap();
        bytes[128..]
            .as_chunks()
            .0
            .iter()
            .map(|number| i64::from_le_bytes(*number))
            .collect()
    };
    let mut rooms = BTreeMap::new();
    for entry in fs::read_dir(&arrays).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if let Some(room) = name.strip_suffix("_sem_label.npy") {
            let instances = numbers(&arrays.join(format!("{room}_ins_label.npy")));
            rooms.insert(room.to_owned(), (numbers(&path), instances));
        }
    }
    assert!(rooms.len() >= 6, "{:?}", rooms.keys());
    rooms
}

pub(crate) fn npy(kind: &str, shape: &[u64], bytes: &[u8]) -> Vec<u8> {
    let mut array = NpyWriter::new(Vec::new(), Path::new("memory"), kind, shape).unwrap();
    array.put(bytes).unwrap();
    array.into_inner().unwrap()
}

/// Marks an array as stored column by column.
fn transposed(mut array: Vec<u8>) -> Vec<u8> {
    let at = array.windows(5).position(|word| word == b"False").unwrap();
    array[at..at + 5].copy_from_slice(b"True ");
    array
}

pub(crate) fn integers(numbers: &[i64]) -> Vec<u8> {
    npy("<i8", &[numbers.len() as u64], &numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>())
}

pub(crate) fn floats(shape: &[u64], numbers: impl IntoIterator<Item = f32>) -> Vec<u8> {
    npy("<f4", shape, &numbers.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<_>>())
}

pub(crate) fn npz(path: &Path, arrays: &[(&str, Vec<u8>)]) {
    let mut zip = ZipWriter::new(fs::File::create(path).unwrap());
    for (name, bytes) in arrays {
        zip.start_file(format!("{name}.npy"), SimpleFileOptions::default())
            .unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}

pub(crate) fn options(variant: Option<&str>, folds: Folds) -> EvalOptions {
    let mut options = EvalOptions::default();
    options.variant = variant.map(str::to_owned);
    options.folds = folds;
    options
}

pub(crate) fn eval(protocol: Protocol, predictions: &Path, options: &EvalOptions) -> Result<Evaluation> {
    evaluate(protocol, data_set(), predictions, options, &Context::default())
}

/// Asserts that all scores are 1, or 0 or not defined for a class that does not exist.
#[track_caller]
pub(crate) fn assert_perfect(evaluation: &Evaluation) {
    let present: Vec<&str> = ["ceiling", "floor", "wall", "door", "table", "chair"].to_vec();
    for table in &evaluation.tables {
        for row in &table.rows {
            for score in row.scores.iter().map(|score| score.value) {
                let is_one = (score - 1.0).abs() < 1e-9;
                let may_be_absent = !present.contains(&row.name.as_str());
                assert!(
                    is_one || may_be_absent && !(score > 0.0 && row.name != "mean"),
                    "{}",
                    evaluation.to_markdown()
                );
            }
        }
    }
}

/// Writes perfect predictions of classes.
fn write_classes(dir: &Path) {
    for (room, (classes, _)) in rooms() {
        fs::write(dir.join(format!("{room}.npy")), integers(&classes)).unwrap();
    }
}

#[test]
fn the_profile_of_mmdetection3d_is_a_perfect_prediction_of_classes() {
    let dir = tempfile::tempdir().unwrap();
    write_classes(dir.path());
    for variant in ["pointcept", "nanmean"] {
        for folds in [Folds::All, Folds::EachArea, Folds::Paper] {
            let evaluation = eval(Protocol::Sem3d, dir.path(), &options(Some(variant), folds)).unwrap();
            assert_perfect(&evaluation);
            let table = &evaluation.tables[0].title;
            let expected = if variant == "nanmean" { 1.0 } else { f64::NAN };
            let mean = evaluation.score(table, "mean", "IoU").unwrap();
            assert!(expected.is_nan() || mean == expected, "{mean}");
            assert!(evaluation.notes.is_empty(), "{:?}", evaluation.notes);
        }
    }
    let evaluation = eval(Protocol::Sem3d, dir.path(), &options(None, Folds::EachArea)).unwrap();
    let titles: Vec<&str> = evaluation.tables.iter().map(|table| table.title.as_str()).collect();
    assert_eq!(titles, ["area 1", "area 5", "all folds, pooled", "mean over folds"]);
    let points: usize = rooms().values().map(|(classes, _)| classes.len()).sum();
    assert_eq!(evaluation.counted["points"], points as u64);
}

/// Writes predictions of classes of which every `step`th is the next class.
fn write_worse_classes(dir: &Path, step: usize) {
    for (room, (classes, _)) in rooms() {
        let worse: Vec<i64> = (0..)
            .zip(classes)
            .map(|(i, class)| if i % step == 0 { (class + 1) % 13 } else { class })
            .collect();
        fs::write(dir.join(format!("{room}.npy")), integers(&worse)).unwrap();
    }
}

#[test]
fn the_answer_says_what_it_is_of_and_has_rooms_and_a_confusion_matrix() {
    let dir = tempfile::tempdir().unwrap();
    write_worse_classes(dir.path(), 3);
    let evaluation = eval(Protocol::Sem3d, dir.path(), &options(Some("nanmean"), Folds::EachArea)).unwrap();
    let json = serde_json::to_value(&evaluation).unwrap();
    let manifest: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(data_set().join("manifest.json")).unwrap()).unwrap();
    assert_eq!(json["truth"]["files_xxh3_128"], manifest["files"]["xxh3_128"]);
    assert_eq!(json["truth"]["areas"], serde_json::json!([[1], [5]]));
    assert_eq!(json["options"]["seed"], 0);
    assert_eq!(json["evaluator"], manifest["version"]);

    // Each count by the labels themselves.
    let mut counts = vec![vec![0; 14]; 13];
    for (classes, _) in rooms().into_values() {
        for (i, class) in classes.into_iter().enumerate() {
            let found = if i % 3 == 0 { (class + 1) % 13 } else { class };
            counts[class as usize][found as usize] += 1;
        }
    }
    assert_eq!(evaluation.confusion.as_ref().unwrap().counts, counts);

    // A room by itself scores like a data set of this room.
    assert_eq!(evaluation.units.units.len(), rooms().len());
    let overall = evaluation.units.rows.iter().position(|row| row == "overall").unwrap();
    for unit in &evaluation.units.units {
        let (classes, _) = &rooms()[&format!("Area_{}_{}", unit.area, unit.name)];
        let right = classes.len() - classes.len().div_ceil(3);
        assert_eq!(unit.scores[overall][1], right as f64 / classes.len() as f64, "{}", unit.name);
    }
}

#[test]
fn differences_to_other_predictions_are_paired() {
    let [better, worse] = [5, 3].map(|step| {
        let dir = tempfile::tempdir().unwrap();
        write_worse_classes(dir.path(), step);
        dir
    });
    let against = |ours: &TempDir, theirs: &TempDir| {
        let mut options = options(None, Folds::All);
        options.against = Some(theirs.path().to_owned());
        let evaluation = eval(Protocol::Sem3d, ours.path(), &options).unwrap();
        let overall = |tables: &[Table]| tables[0].rows.last().unwrap().scores[1];
        let found = evaluation.against.as_ref().unwrap();
        let text = evaluation.to_markdown();
        assert!(text.contains("minus the scores of the other predictions"), "{text}");
        [&evaluation.tables, &found.tables, &found.differences].map(|tables| overall(tables))
    };

    // The accuracy of a room differs by little from 4/5 and 2/3, so the same rooms for both have nearly the
    // same difference. Rooms drawn for each by itself would not.
    let [ours, theirs, difference] = against(&better, &worse);
    assert_eq!(difference.value, ours.value - theirs.value);
    let [low, high] = difference.interval.unwrap();
    assert!(low <= difference.value && difference.value <= high && high - low < 1e-3, "{difference:?}");
    assert!(low > 0.13 && high < 0.14, "{difference:?}");

    let [.., reverse] = against(&worse, &better);
    assert_eq!(reverse.value, -difference.value);
    let [.., same] = against(&better, &better);
    assert_eq!((same.value, same.interval), (0.0, Some([0.0; 2])));
}

/// Reads the tree of a profile like Pointcept's preprocessing: files sorted, their classes repeated.
#[test]
fn points_have_the_order_of_pointcept_and_scores_of_classes_are_read() {
    let dir = tempfile::tempdir().unwrap();
    for area in ["Area_1", "Area_5"] {
        fs::create_dir(dir.path().join(area)).unwrap();
        for entry in fs::read_dir(data_set().join("profiles/pointcept").join(area)).unwrap() {
            let room = entry.unwrap().path();
            if !room.is_dir() {
                continue;
            }
            let annotations = fs::read_dir(room.join("Annotations")).unwrap();
            let mut files: Vec<PathBuf> = annotations.map(|entry| entry.unwrap().path()).collect();
            files.sort();
            let names = "ceiling floor wall beam column window door table chair sofa bookcase board clutter";
            let mut scores: Vec<f32> = Vec::new();
            for file in files {
                let stem = file.file_stem().unwrap().to_str().unwrap();
                let class = names.split(' ').position(|name| stem.starts_with(name)).unwrap();
                let lines = fs::read_to_string(&file).unwrap().lines().count();
                // Higher classes have the same score: the first one wins the tie.
                let row = std::array::from_fn::<f32, 13, _>(|i| f32::from(i >= class));
                scores.extend(row.repeat(lines));
            }
            let bytes = floats(&[scores.len() as u64 / 13, 13], scores);
            let name = room.file_name().unwrap().to_str().unwrap();
            match area {
                "Area_1" => {
                    npz(&dir.path().join(area).join(format!("{name}_pred.npz")), &[("logits", bytes)])
                }
                _ => fs::write(dir.path().join(format!("{area}-{name}_pred.npy")), bytes).unwrap(),
            }
        }
    }
    assert_perfect(&eval(Protocol::Sem3d, dir.path(), &options(Some("nanmean"), Folds::All)).unwrap());
}

/// Writes perfect predictions of instances in one of the five forms.
pub(crate) fn write_instances(dir: &Path, form: usize) {
    for (room, (classes, instances)) in rooms() {
        let n = classes.len();
        let k = instances.iter().max().copied().unwrap() as usize;
        let ids: Vec<i64> = instances.iter().map(|id| id - 1).collect();
        let of_instance: Vec<i64> = (0..k)
            .map(|id| classes[ids.iter().position(|i| *i == id as i64).unwrap()])
            .collect();
        let scores = floats(&[k as u64], (0..k).map(|id| id as f32 / k as f32));
        let by_point: Vec<u8> = ids
            .iter()
            .flat_map(|id| (0..k).map(move |k| u8::from(*id == k as i64)))
            .collect();
        let one_by_one: Vec<u8> = (0..k)
            .flat_map(|k| ids.iter().map(move |id| u8::from(*id == k as i64)))
            .collect();

        let shape = |a: usize, b: usize| [a as u64, b as u64];
        let of_instance = integers(&of_instance);
        let arrays = match form {
            0 => vec![
                ("masks", npy("|b1", &shape(n, k), &by_point)),
                ("classes", of_instance),
                ("scores", scores),
            ],
            1 => vec![
                ("pred_masks", npy("|u1", &shape(k, n), &one_by_one)),
                ("pred_classes", of_instance),
                ("pred_scores", scores),
            ],
            2 => vec![
                ("pts_instance_mask", integers(&ids)),
                ("instance_labels", of_instance),
                ("instance_scores", scores),
            ],
            3 => vec![
                ("masks", transposed(npy("|b1", &shape(n, k), &one_by_one))),
                ("classes", of_instance),
                ("scores", scores),
            ],
            _ => vec![("instance", integers(&instances)), ("semantic", integers(&classes))],
        };
        npz(&dir.join(format!("{room}.npz")), &arrays);
    }
}

#[test]
fn a_data_set_is_a_perfect_prediction_of_its_instances() {
    for form in 0..4 {
        let dir = tempfile::tempdir().unwrap();
        write_instances(dir.path(), form);
        for folds in [Folds::All, Folds::EachArea] {
            let evaluation = eval(Protocol::InstAp, dir.path(), &options(None, folds)).unwrap();
            assert_perfect(&evaluation);
            assert_eq!(evaluation.score(&evaluation.tables[0].title, "mean", "AP"), Some(1.0));
        }
    }
    for form in [2, 4] {
        let dir = tempfile::tempdir().unwrap();
        write_instances(dir.path(), form);
        let evaluation = eval(Protocol::InstCov, dir.path(), &options(None, Folds::Areas(vec![5]))).unwrap();
        assert_perfect(&evaluation);
        assert_eq!(evaluation.score("area 5", "mean where defined", "weighted coverage"), Some(1.0));
        assert!(evaluation.notes[0].contains("not tested"), "{:?}", evaluation.notes);
    }
}

/// Writes predictions where every third point has the same class, another one in each room.
fn write_faulty(dir: &Path) {
    for (number, (room, (mut classes, _))) in (0..).zip(rooms()) {
        classes.iter_mut().step_by(3).for_each(|class| *class = number % 13);
        fs::write(dir.join(format!("{room}.npy")), integers(&classes)).unwrap();
    }
}

#[test]
fn intervals_hold_the_score_and_threads_change_nothing() {
    let dir = tempfile::tempdir().unwrap();
    write_faulty(dir.path());
    let mut options = options(None, Folds::EachArea);
    options.bootstrap = Some(200);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| eval(Protocol::Sem3d, dir.path(), &options).unwrap())
    };
    let evaluation = with(1);
    // NaN is not equal to itself.
    assert_eq!(serde_json::to_string(&evaluation).unwrap(), serde_json::to_string(&with(3)).unwrap());
    let overall = evaluation.tables[2].rows.last().unwrap().scores[1];
    let [low, high] = overall.interval.unwrap();
    assert!(low < overall.value && overall.value < high && high - low < 0.2, "{overall:?}");
    let [one, five, mean] = [0, 1, 3].map(|table: usize| evaluation.tables[table].rows[0].scores[0].value);
    assert!((mean - (one + five) / 2.0).abs() < 1e-12 && one != five);
}

#[test]
fn wrong_predictions_are_refused_with_their_file() {
    let rooms = rooms();
    let (room, (classes, _)) = rooms.first_key_value().unwrap();
    let n = classes.len() as u64;
    let message = |protocol, prepare: &dyn Fn(&Path)| {
        let dir = tempfile::tempdir().unwrap();
        write_classes(dir.path());
        prepare(dir.path());
        eval(protocol, dir.path(), &EvalOptions::default())
            .unwrap_err()
            .to_string()
    };

    let file = format!("{room}.npy");
    let written =
        |bytes: Vec<u8>| message(Protocol::Sem3d, &|dir| fs::write(dir.join(&file), &bytes).unwrap());
    let mut beyond = classes.clone();
    beyond[7] = 13;
    let mut nan = vec![0.0; classes.len() * 13];
    nan[13 * 5 + 2] = f32::NAN;
    for (bytes, words) in [
        (integers(&classes[1..]), "in the order of `s3d profile`"),
        (integers(&beyond), "13 at point 7 is no class"),
        (floats(&[n], classes.iter().map(|class| *class as f32)), "astype(numpy.int64)"),
        (floats(&[n, 13], nan), "NaN at point 5"),
        (floats(&[n, 12], vec![0.0; classes.len() * 12]), "N × 13"),
        (integers(classes)[..500].to_vec(), "cut short"),
        (b"no array".to_vec(), "no NPY"),
    ] {
        let message = written(bytes);
        assert!(message.contains(words) && message.contains(room), "{words}: {message}");
    }

    let gone = message(Protocol::Sem3d, &|dir| {
        fs::rename(dir.join(format!("{room}.npy")), dir.join(format!("{room}x.npy"))).unwrap();
    });
    assert!(gone.contains("no prediction of 1 of") && gone.contains(&format!("{room}x.npy")), "{gone}");
    let double = message(Protocol::Sem3d, &|dir| {
        fs::copy(dir.join(format!("{room}.npy")), dir.join(format!("{room}_pred.npy"))).unwrap();
    });
    assert!(double.contains("second prediction"), "{double}");
    let e = eval(Protocol::Sem3d, &data_set().join("manifest.json"), &EvalOptions::default()).unwrap_err();
    assert!(e.to_string().contains("a folder with a file a room"), "{e}");

    let dir = tempfile::tempdir().unwrap();
    write_classes(dir.path());
    fs::write(dir.path().join("Area_5.pth"), "").unwrap();
    let evaluation = eval(Protocol::Sem3d, dir.path(), &EvalOptions::default()).unwrap();
    assert!(evaluation.notes[0].contains("Area_5.pth"), "{:?}", evaluation.notes);
}

#[test]
fn wrong_instances_are_refused_with_their_file() {
    let rooms = rooms();
    let (room, (classes, instances)) = rooms.first_key_value().unwrap();
    let n = classes.len();
    let masks = || ("masks", npy("|u1", &[n as u64, 1], &vec![1; n]));
    let ids = || ("instance", integers(instances));
    let score = || ("scores", floats(&[1], [0.5]));
    let class = || ("classes", integers(&[2]));
    for (protocol, arrays, words) in [
        (Protocol::InstAp, vec![masks(), score()], "no array classes"),
        (Protocol::InstAp, vec![masks(), class()], "no array scores"),
        (Protocol::InstAp, vec![score(), class()], "no array instance"),
        (Protocol::InstAp, vec![masks(), ids(), score(), class()], "both masks and instance"),
        (Protocol::InstAp, vec![masks(), score(), ("classes", integers(&[13]))], "13 is no class"),
        (Protocol::InstAp, vec![masks(), score(), ("classes", integers(&[2, 2]))], "1 scores for 2 classes"),
        (Protocol::InstAp, vec![masks(), ("scores", floats(&[1], [f32::NAN])), class()], "NaN is no score"),
        (Protocol::InstAp, vec![ids(), score(), class()], "has the instance"),
        (
            Protocol::InstAp,
            vec![("masks", npy("|u1", &[n as u64 - 1, 1], &vec![1; n - 1])), score(), class()],
            "N × 1 or 1 × N",
        ),
        (Protocol::InstCov, vec![masks(), score(), class()], "may overlap"),
        (Protocol::InstCov, vec![ids()], "no array classes"),
        (Protocol::InstCov, vec![ids(), ("semantic", integers(&vec![-1; n]))], "-1 at point 0"),
        (Protocol::InstCov, vec![("instance", integers(&instances[1..])), class()], "N is due"),
        (Protocol::InstCov, vec![("instance", integers(&vec![-2; n])), class()], "-1 stands for no instance"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        write_instances(dir.path(), 2);
        npz(&dir.path().join(format!("{room}.npz")), &arrays);
        let message = eval(protocol, dir.path(), &EvalOptions::default())
            .unwrap_err()
            .to_string();
        assert!(message.contains(words) && message.contains(room), "{words}: {message}");
    }
}
