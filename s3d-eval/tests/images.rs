//! The protocols of images, from files to tables: a perfect prediction, known differences, and mistakes.

use s3d_dataset::{DataSet, Export, ExportOptions};
use s3d_eval::{Context, EvalOptions, Evaluation, Folds, ImageKind, Protocol, evaluate};
use s3d_geom::Raster;
use s3d_io::cloud::NpyWriter;
use s3d_io::dataset::{DatasetImage, Domain};
use s3d_io::image::{Compression, decode_gray16, decode_rgb8, encode_gray8, encode_gray16};
use s3d_label::LabelId;
use s3d_synth::{Building, ScanOptions};
use std::fs;
use std::path::{Path, PathBuf};

/// Exports areas 2 and 5 of the built-in scene, with panoramas of 160 × 80 and views of 64 × 64.
fn data_set(folder: &Path) -> PathBuf {
    let scan = ScanOptions { points_per_m2: 60.0, ..ScanOptions::default() };
    let scenes = [2, 5].map(|area| {
        let folder = folder.join(format!("scan{area}"));
        let scene = Building::demo()
            .build()
            .unwrap()
            .write_scan(&folder, &scan, || true)
            .unwrap();
        let text = fs::read_to_string(&scene).unwrap();
        assert!(text.contains("area = 1"));
        fs::write(&scene, text.replace("area = 1", &format!("area = {area}"))).unwrap();
        // The scan locations of the two areas need different names.
        let cameras = folder.join("cameras.csv");
        let lines = fs::read_to_string(&cameras).unwrap();
        let renamed = lines.lines().map(|line| format!("{area}{}\n", &line[1..]));
        fs::write(&cameras, renamed.collect::<String>()).unwrap();
        scene
    });
    let options =
        ExportOptions { views: 2, size: 64, pano_width: 160, points_per_m2: 5.0, ..ExportOptions::default() };
    let out = folder.join("dataset");
    Export::new(scenes)
        .options(options)
        .run(&out, &Context::default())
        .unwrap()
        .unwrap();
    out
}

pub(crate) fn images(data: &DataSet, kind: ImageKind) -> Vec<DatasetImage> {
    let all = data.areas().iter().flat_map(|&area| data.images(area));
    all.filter(|image| ImageKind::of(image.frame) == kind).collect()
}

/// Writes a file for each image into the folders of areas, with this ending.
pub(crate) fn predict(
    data: &DataSet,
    out: &Path,
    kind: ImageKind,
    ending: &str,
    write: impl Fn(&DatasetImage, &Path),
) {
    for image in images(data, kind) {
        let folder = out.join(format!("area_{}", image.area));
        fs::create_dir_all(&folder).unwrap();
        write(&image, &folder.join(format!("{}.{ending}", image.stem())));
    }
}

pub(crate) fn depth(data: &DataSet, image: &DatasetImage) -> Raster<u16> {
    let path = image.path(data.layout(), Domain::Depth);
    decode_gray16(&data.read(&path).unwrap(), &path).unwrap()
}

/// Returns the index of the class of each pixel, 255 for none.
pub(crate) fn classes(data: &DataSet, image: &DatasetImage) -> Raster<u8> {
    let path = image.path(data.layout(), Domain::Semantic);
    let table = data.labels().unwrap().unwrap();
    decode_rgb8(&data.read(&path).unwrap(), &path)
        .unwrap()
        .map(|[r, g, b]| {
            let class = table.class_of(LabelId(u32::from_be_bytes([0, r, g, b])));
            class.map_or(255, |class| class.index() as u8)
        })
}

pub(crate) fn write_floats(path: &Path, shape: &[u64], values: impl IntoIterator<Item = f64>) {
    let mut file = NpyWriter::create(path, "<f8", shape).unwrap();
    values
        .into_iter()
        .for_each(|value| file.put(&value.to_le_bytes()).unwrap());
    file.finish().unwrap();
}

pub(crate) fn run(protocol: Protocol, truth: &Path, predictions: &Path, options: &EvalOptions) -> Evaluation {
    evaluate(protocol, truth, predictions, options, &Context::default()).unwrap()
}

pub(crate) fn options(set: impl FnOnce(&mut EvalOptions)) -> EvalOptions {
    let mut options = EvalOptions::default();
    set(&mut options);
    options
}

#[test]
fn a_data_set_against_itself_is_perfect() {
    let dir = tempfile::tempdir().unwrap();
    let truth = data_set(dir.path());
    let data = DataSet::open(&truth).unwrap();

    let out = dir.path().join("classes");
    predict(&data, &out, ImageKind::Panoramas, "png", |image, path| {
        fs::write(path, encode_gray8(&classes(&data, image))).unwrap();
    });
    let folds = options(|o| {
        o.folds = Folds::EachArea;
        o.bootstrap = Some(20);
    });
    let result = run(Protocol::SemPano, &truth, &out, &folds);
    let titles: Vec<&str> = result.tables.iter().map(|table| table.title.as_str()).collect();
    let plain = ["area 2", "area 5", "all folds, pooled", "mean over folds"];
    let by_latitude = plain.map(|title| format!("{title}, weighted by latitude"));
    assert_eq!((&titles[..4], &titles[4..]), (&plain[..], &by_latitude.each_ref().map(|t| &**t)[..]));
    for table in &result.tables {
        assert!(table.scores().all(|score| score.is_nan() || score == 1.0), "{}", result.to_markdown());
        assert_eq!(table.rows.last().unwrap().scores[0].interval, Some([1.0; 2]));
        assert_eq!(table.rows.len(), 14);
    }
    assert!(result.counted["pixels"] > 100_000 * result.counted["panoramas"], "{:?}", result.counted);

    for (protocol, kind, domain, variants) in [
        (Protocol::Depth, ImageKind::Panoramas, Domain::Depth, ["hohonet", "unifuse"]),
        (Protocol::Normal, ImageKind::Panoramas, Domain::Normal, ["dsine", "omnidata"]),
        (Protocol::Normal, ImageKind::Views, Domain::Normal, ["dsine", "omnidata"]),
    ] {
        let out = dir.path().join(format!("{protocol} {kind}"));
        for image in images(&data, kind) {
            let path = image.path(data.layout(), domain);
            let folder = out.join(format!("area_{}", image.area));
            fs::create_dir_all(&folder).unwrap();
            fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
        }
        for variant in variants {
            let result = run(protocol, &truth, &out, &options(|o| o.variant = Some(variant.into())));
            let table = &result.tables[0];
            for (column, score) in table.columns.iter().zip(table.scores()) {
                let perfect = match column.chars().next().unwrap() {
                    'δ' | '≤' => 1.0,
                    '<' => 100.0,
                    _ => 0.0,
                };
                // The cosine of equal vectors is 1 to the last bit or so.
                assert!((score - perfect).abs() < 2e-6, "{variant}: {}", result.to_markdown());
            }
        }
    }
}

#[test]
fn views_are_not_held_against_panoramas() {
    let dir = tempfile::tempdir().unwrap();
    let truth = data_set(dir.path());
    let data = DataSet::open(&truth).unwrap();
    let [views, panoramas] = [ImageKind::Views, ImageKind::Panoramas].map(|kind| {
        let out = dir.path().join(kind.to_string());
        predict(&data, &out, kind, "png", |image, path| {
            fs::copy(image.path(data.layout(), Domain::Normal), path).unwrap();
        });
        out
    });
    let other = options(|o| o.against = Some(panoramas));
    let error = evaluate(Protocol::Normal, &truth, &views, &other, &Context::default()).unwrap_err();
    let told = error.to_string();
    assert!(told.contains("panoramas: these predictions are of other images"), "{told}");

    let nowhere = options(|o| o.against = Some(dir.path().join("nowhere")));
    let error = evaluate(Protocol::Normal, &truth, dir.path(), &nowhere, &Context::default()).unwrap_err();
    assert!(error.to_string().contains("nowhere: cannot read"), "{error}");

    let same = options(|o| {
        o.against = Some(views.clone());
        o.bootstrap = Some(10);
    });
    let result = run(Protocol::Normal, &truth, &views, &same);
    assert!(
        result.against.unwrap().differences[0]
            .scores()
            .all(|score| score == 0.0)
    );
    let unit = &result.units.units[0];
    assert!(unit.name.starts_with("camera_") && unit.scores[0].len() == 8, "{unit:?}");
}

#[test]
fn known_differences_have_their_scores() {
    let dir = tempfile::tempdir().unwrap();
    let truth = data_set(dir.path());
    let data = DataSet::open(&truth).unwrap();

    // Distances that are 4 % too long, in an array of the size of the evaluation.
    let out = dir.path().join("depth");
    predict(&data, &out, ImageKind::Panoramas, "npy", |image, path| {
        let depth = depth(&data, image);
        let at = |i: u32| depth.at(i % 1024 * 160 / 1024, i / 1024 * 80 / 512);
        write_floats(path, &[1, 512, 1024], (0..1024 * 512).map(|i| f64::from(at(i)) / 512.0 * 1.04));
    });
    let both = options(|o| {
        o.variant = Some("unifuse".into());
        o.bootstrap = Some(50);
    });
    let result = run(Protocol::Depth, &truth, &out, &both);
    let score = |column: &str| result.score("areas 2, 5", "mean", column).unwrap();
    assert!((score("AbsRel") - 0.04).abs() < 1e-3 && score("δ < 1.25") == 1.0, "{}", result.to_markdown());
    let scaled = run(
        Protocol::Depth,
        &truth,
        &out,
        &options(|o| {
            o.variant = Some("unifuse".into());
            o.median_scale = true;
        }),
    );
    assert!(scaled.score("areas 2, 5", "mean", "AbsRel").unwrap() < 1e-3, "{}", scaled.to_markdown());
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one.install(|| run(Protocol::Depth, &truth, &out, &both)), result);

    // Half of the vectors are turned by 90°, the others are not turned.
    let out = dir.path().join("normals");
    predict(&data, &out, ImageKind::Views, "npy", |image, path| {
        let from = image.path(data.layout(), Domain::Normal);
        let normals = decode_rgb8(&data.read(&from).unwrap(), &from).unwrap();
        let turned = normals.pixels().iter().enumerate().flat_map(|(i, pixel)| {
            let [x, y, z] = pixel.map(|c| (f64::from(c) - 127.5) / 127.5);
            if i % 2 == 0 {
                [x, y, z]
            } else {
                [y, -x, 0.0].map(|c| c / x.hypot(y))
            }
        });
        write_floats(path, &[64, 64, 3], turned.collect::<Vec<_>>());
    });
    let intervals = options(|o| o.bootstrap = Some(50));
    let result = run(Protocol::Normal, &truth, &out, &intervals);
    let table = &result.tables[0];
    let share = table.rows[0].scores[3].value;
    assert!((share - 50.0).abs() < 2.0, "{}", result.to_markdown());
    assert!((table.rows[0].scores[0].value - 0.9 * (100.0 - share)).abs() < 1e-3);
    assert!(
        table.rows[0]
            .scores
            .iter()
            .all(|s| s.interval.is_some_and(|[low, high]| low <= high))
    );
    assert_eq!(one.install(|| run(Protocol::Normal, &truth, &out, &intervals)), result);

    // Every pixel is predicted as wall, in the order of a list of classes beside the predictions.
    let out = dir.path().join("classes");
    predict(&data, &out, ImageKind::Panoramas, "png", |_, path| {
        fs::write(path, encode_gray8(&Raster::filled(1024, 512, 1))).unwrap();
    });
    fs::write(out.join("classes.txt"), "ceiling\nwall\n").unwrap();
    fs::write(out.join("notes.txt"), "mine").unwrap();
    let only = options(|o| o.folds = Folds::Areas(vec![5]));
    let result = run(Protocol::SemPano, &truth, &out, &only);
    assert_eq!(result.score("area 5", "wall", "accuracy"), Some(1.0), "{}", result.to_markdown());
    assert_eq!(result.score("area 5", "floor", "IoU"), Some(0.0));
    assert!(
        result
            .score("area 5", "sofa", "IoU")
            .is_some_and(|iou| iou.is_nan() || iou == 0.0)
    );
    let notes = result.notes.join(" ");
    assert!(notes.contains("notes.txt") && !notes.contains("classes.txt"), "{notes}");
    assert!(notes.contains("areas that are not tested"), "{notes}");
}

#[test]
fn mistakes_are_refused_with_their_file() {
    let dir = tempfile::tempdir().unwrap();
    let truth = data_set(dir.path());
    let data = DataSet::open(&truth).unwrap();
    let out = dir.path().join("predictions");

    let first = images(&data, ImageKind::Panoramas).remove(0);
    let view = images(&data, ImageKind::Views).remove(0);
    let stem = first.stem();
    let file = out.join("area_2").join(format!("{stem}.png"));
    let other = |name: String| out.join("area_2").join(name);
    let all = || {
        let _ = fs::remove_dir_all(&out);
        predict(&data, &out, ImageKind::Panoramas, "png", |image, path| {
            fs::write(path, encode_gray16(&depth(&data, image), Compression::Fast)).unwrap();
        });
    };
    let refused = |protocol: Protocol, options: &EvalOptions, words: &[&str]| {
        let result = evaluate(protocol, &truth, &out, options, &Context::default());
        let message = result.unwrap_err().to_string();
        words
            .iter()
            .for_each(|word| assert!(message.contains(word), "{word}: {message}"));
    };
    let usual = EvalOptions::default();
    let of_depth = |words: &[&str]| refused(Protocol::Depth, &usual, words);

    all();
    fs::remove_file(&file).unwrap();
    fs::write(other("area.log".into()), "").unwrap();
    of_depth(&["1 of ", &stem, "of area 2", "Not read", "area.log"]);
    all();
    write_floats(&other(format!("{stem}.npy")), &[80, 160], vec![1.0; 80 * 160]);
    of_depth(&[".png: predicts the same image as ", ".npy"]);
    all();
    fs::write(&file, encode_gray16(&Raster::filled(80, 160, 9), Compression::Fast)).unwrap();
    of_depth(&[&stem, "80 × 160", "1024 × 512 or 160 × 80"]);
    all();
    fs::write(&file, encode_gray16(&Raster::filled(160, 80, u16::MAX), Compression::Fast)).unwrap();
    of_depth(&[&stem, "65535 (missing) in column 0, row "]);
    all();
    fs::rename(&file, other(format!("{stem}_domain_normals.png"))).unwrap();
    of_depth(&["is named after normals, and depth is evaluated"]);
    all();
    fs::rename(&file, other(format!("{stem}_old.png"))).unwrap();
    of_depth(&["_old.png", "names no image of area 2"]);
    all();
    fs::rename(&file, other(format!("{}.png", view.stem()))).unwrap();
    of_depth(&[&view.stem(), "is named after a view, and panoramas are evaluated"]);
    all();
    fs::remove_file(&file).unwrap();
    let npy = other(format!("{stem}.npy"));
    write_floats(&npy, &[3, 80, 160], vec![1.0; 3 * 80 * 160]);
    of_depth(&[".npy", "[3, 80, 160]", "H × W"]);
    write_floats(&npy, &[80, 160], vec![f64::NAN; 80 * 160]);
    of_depth(&[".npy: has NaN in column 0, row "]);

    all();
    let scaled = options(|o| o.median_scale = true);
    refused(Protocol::Depth, &scaled, &["no scale to the median"]);
    refused(Protocol::SemPano, &options(|o| o.images = Some(ImageKind::Views)), &["not of views"]);
    refused(Protocol::SemPano, &usual, &["16-bit gray, not 8-bit gray or with a palette"]);
    refused(Protocol::Normal, &usual, &["16-bit gray, not 8-bit RGB"]);
    fs::write(other(format!("{}.png", view.stem())), "").unwrap();
    refused(Protocol::Normal, &usual, &["after a panorama: their axes differ"]);

    all();
    fs::write(&file, encode_gray8(&Raster::filled(160, 80, 13))).unwrap();
    refused(Protocol::SemPano, &usual, &[&stem, "has 13 in column", "are below 13"]);
    fs::write(out.join("classes.txt"), "wall\nwal\n").unwrap();
    refused(Protocol::SemPano, &usual, &["classes.txt, line 2", "wal"]);
    fs::write(out.join("classes.txt"), "wall\n\nwall\n").unwrap();
    refused(Protocol::SemPano, &usual, &["classes.txt, line 2"]);

    // Colours are no unit vectors.
    let _ = fs::remove_dir_all(&out);
    predict(&data, &out, ImageKind::Views, "npy", |_, path| {
        write_floats(path, &[64, 64, 3], vec![200.0; 64 * 64 * 3]);
    });
    refused(Protocol::Normal, &usual, &["[200.0, 200.0, 200.0], no unit vector, in column "]);
}
