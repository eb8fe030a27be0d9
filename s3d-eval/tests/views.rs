//! The protocols of images on views, and the scores of panoramas that are weighted by latitude.

use crate::images::{classes, depth, images, options, predict, run, write_floats};
use crate::scene::data_set;
use s3d_dataset::DataSet;
use s3d_eval::images::{EdgeScores, class_outlines, depth_edges, latitude_weights, pillow_nearest};
use s3d_eval::{Context, EvalOptions, Evaluation, ImageKind, Protocol, evaluate};
use s3d_geom::Raster;
use s3d_io::dataset::{DatasetImage, Domain};
use s3d_io::image::{decode_rgb8, encode_gray8, encode_gray16};
use std::fs;
use std::path::Path;

const PLAIN: &str = "areas 2, 5";
const BY_LATITUDE: &str = "areas 2, 5, weighted by latitude";

fn data() -> DataSet {
    DataSet::open(data_set()).unwrap()
}

fn as_variant(variant: &str) -> EvalOptions {
    options(|o| o.variant = Some(variant.into()))
}

/// Metres, 0 where there is no depth.
fn metres(data: &DataSet, image: &DatasetImage) -> Vec<f64> {
    let of = |value: u16| {
        if value == u16::MAX {
            0.0
        } else {
            f64::from(value) / 512.0
        }
    };
    depth(data, image).pixels().iter().map(|value| of(*value)).collect()
}

/// Writes arrays of the size of the images.
fn predict_floats(data: &DataSet, out: &Path, kind: ImageKind, number: impl Fn(f64, usize) -> f64) {
    predict(data, out, kind, "npy", |image, path| {
        let size = depth(data, image);
        let values = metres(data, image)
            .into_iter()
            .enumerate()
            .map(|(at, metres)| number(metres, at));
        write_floats(path, &[size.height().into(), size.width().into()], values);
    });
}

#[track_caller]
fn assert_perfect(result: &Evaluation) {
    for table in &result.tables {
        for (column, score) in table.columns.iter().zip(table.scores()) {
            let perfect = if column.starts_with('δ') { 1.0 } else { 0.0 };
            assert!((score - perfect).abs() < 1e-6, "{}", result.to_markdown());
        }
    }
}

#[test]
fn depth_of_the_data_set_itself_is_perfect_as_marigold() {
    let dir = tempfile::tempdir().unwrap();
    let data = data();
    for (kind, tables) in [(ImageKind::Views, &[PLAIN][..]), (ImageKind::Panoramas, &[PLAIN, BY_LATITUDE])] {
        let out = dir.path().join(format!("{kind} as images"));
        predict(&data, &out, kind, "png", |image, path| {
            let from = image.path(data.layout(), Domain::Depth);
            fs::write(path, data.read(&from).unwrap()).unwrap();
        });
        for variant in ["marigold", "marigold-metric"] {
            let result = run(Protocol::Depth, data_set(), &out, &as_variant(variant));
            let titles: Vec<&str> = result.tables.iter().map(|table| table.title.as_str()).collect();
            assert_eq!(titles, tables);
            assert_eq!(result.counted[&*kind.to_string()], images(&data, kind).len() as u64);
            assert_perfect(&result);
        }

        // Up to scale and shift, negative, and in whole numbers.
        let out = dir.path().join(format!("{kind} as depth"));
        predict_floats(&data, &out, kind, |metres, _| 0.5 * metres - 7.0);
        assert_perfect(&run(Protocol::Depth, data_set(), &out, &as_variant("marigold")));
        let result = run(Protocol::Depth, data_set(), &out, &as_variant("marigold-metric"));
        assert_eq!(result.score(PLAIN, "mean", "δ < 1.25"), Some(0.0), "{}", result.to_markdown());

        let out = dir.path().join(format!("{kind} as disparity"));
        predict_floats(&data, &out, kind, |metres, _| if metres > 0.0 { 30.0 / metres + 4.0 } else { -1.0 });
        assert_perfect(&run(Protocol::Depth, data_set(), &out, &as_variant("marigold-disparity")));
        let result = run(Protocol::Depth, data_set(), &out, &as_variant("marigold"));
        assert!(result.score(PLAIN, "mean", "AbsRel").unwrap() > 0.01, "{}", result.to_markdown());
    }
}

#[test]
fn depth_that_cannot_be_aligned_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let data = data();
    predict_floats(&data, dir.path(), ImageKind::Views, |_, _| -2.5);
    let result = run(Protocol::Depth, data_set(), dir.path(), &as_variant("marigold"));
    let views = images(&data, ImageKind::Views);
    let told = format!("{} views have a single value to align", views.len());
    assert!(result.notes.iter().any(|note| note.starts_with(&told)), "{:?}", result.notes);

    // The error of the mean of the truth.
    let expected: f64 = views
        .iter()
        .map(|image| {
            let truth: Vec<f64> = metres(&data, image)
                .into_iter()
                .filter(|metres| *metres > 1e-3 && *metres < 10.0)
                .collect();
            let mean = truth.iter().sum::<f64>() / truth.len() as f64;
            truth.iter().map(|metres| (metres - mean).abs() / metres).sum::<f64>() / truth.len() as f64
        })
        .sum();
    let found = result.score(PLAIN, "mean", "AbsRel").unwrap();
    assert!((found - expected / views.len() as f64).abs() < 1e-9, "{found}, {expected}");
}

#[test]
fn boundaries_of_depth_have_their_scores() {
    let dir = tempfile::tempdir().unwrap();
    let data = data();
    // In any unit, the truth itself has what it can reach. The moved one has less.
    for kind in [ImageKind::Views, ImageKind::Panoramas] {
        let reachable: Vec<EdgeScores> = images(&data, kind)
            .iter()
            .map(|image| {
                let truth = metres(&data, image);
                depth_edges(&truth, &truth, depth(&data, image).width() as usize)
            })
            .collect();
        let expected = reachable.iter().map(|scores| scores.values[0]).sum::<f64>() / reachable.len() as f64;
        let out = dir.path().join(format!("{kind}"));
        predict_floats(&data, &out, kind, |metres, _| metres * 30.0);
        let itself = run(Protocol::DepthEdge, data_set(), &out, &EvalOptions::default());
        let found = itself.score(PLAIN, "mean", "F1").unwrap();
        assert!((found - expected).abs() < 1e-9 && found > 0.1, "{found}, {expected}");
        let incomplete = reachable.iter().filter(|scores| !scores.is_complete).count();
        let told = format!("The truth of {incomplete} {kind} lacks boundaries");
        assert_eq!(itself.notes.iter().any(|note| note.starts_with(&told)), incomplete > 0);
        for scores in reachable.iter().filter(|scores| scores.is_complete) {
            assert!(scores.values.iter().all(|value| (value - 1.0).abs() < 1e-12), "{scores:?}");
        }

        let out = dir.path().join(format!("{kind} moved"));
        predict(&data, &out, kind, "npy", |image, path| {
            let truth = depth(&data, image);
            let at = |x: u32, y: u32| f64::from(truth.at((x + 1) % truth.width(), y));
            let moved = (0..truth.height()).flat_map(|y| (0..truth.width()).map(move |x| at(x, y)));
            write_floats(path, &[truth.height().into(), truth.width().into()], moved);
        });
        let moved = run(Protocol::DepthEdge, data_set(), &out, &EvalOptions::default());
        assert!(moved.score(PLAIN, "mean", "F1").unwrap() < 0.8 * found, "{}", moved.to_markdown());
    }
}

#[test]
fn a_png_without_a_unit_may_have_any_number() {
    let dir = tempfile::tempdir().unwrap();
    let data = data();
    predict(&data, dir.path(), ImageKind::Views, "png", |_, path| {
        let ramp = Raster::from_vec(48, 48, (0..48 * 48).map(|at| 65535 - at).collect());
        fs::write(path, encode_gray16(&ramp, s3d_io::image::Compression::Fast)).unwrap();
    });
    let result = run(Protocol::Depth, data_set(), dir.path(), &as_variant("marigold-disparity"));
    assert!(result.score(PLAIN, "mean", "AbsRel").unwrap() > 0.0);
    let metric = as_variant("marigold-metric");
    let error = evaluate(Protocol::Depth, data_set(), dir.path(), &metric, &Context::default()).unwrap_err();
    assert!(error.to_string().contains("65535 (missing) in column 0, row 0"), "{error}");
}

#[test]
fn classes_of_views_have_their_scores() {
    let dir = tempfile::tempdir().unwrap();
    let data = data();
    let out = dir.path().join("perfect");
    predict(&data, &out, ImageKind::Views, "png", |image, path| {
        fs::write(path, encode_gray8(&classes(&data, image))).unwrap();
    });
    let folds = options(|o| {
        o.folds = s3d_eval::Folds::EachArea;
        o.bootstrap = Some(20);
    });
    let result = run(Protocol::SemView, data_set(), &out, &folds);
    assert_eq!((result.tables.len(), result.variant), (4, "cmx"));
    for table in &result.tables {
        let is_perfect = |score: f64| score.is_nan() || (score - 1.0).abs() < 1e-12;
        assert!(table.scores().all(is_perfect), "{}", result.to_markdown());
        assert_eq!(table.rows[13].scores[0].interval, Some([1.0; 2]));
        assert_eq!(table.rows[14].scores[1].interval, Some([1.0; 2]));
    }

    // Everything is wall but every third column, which is a class that the scene may lack.
    let out = dir.path().join("walls");
    let guess = |x: usize| if x.is_multiple_of(3) { 9 } else { 2 };
    predict(&data, &out, ImageKind::Views, "png", |_, path| {
        let guesses = (0..48 * 48).map(|at| guess(at % 48)).collect();
        fs::write(path, encode_gray8(&Raster::from_vec(48, 48, guesses))).unwrap();
    });
    let result = run(Protocol::SemView, data_set(), &out, &EvalOptions::default());
    let mut counts = [[0.0f64; 13]; 13];
    for image in images(&data, ImageKind::Views) {
        let truth = classes(&data, &image);
        for (at, class) in truth.pixels().iter().enumerate().filter(|(_, class)| **class < 255) {
            counts[usize::from(*class)][guess(at % 48) as usize] += 1.0;
        }
    }
    let all: f64 = counts.iter().flatten().sum();
    assert_eq!(result.counted["pixels"] as f64, all);
    let mut ious = Vec::new();
    let mut weighted = 0.0;
    for class in 0..13 {
        let truth: f64 = counts[class].iter().sum();
        let predicted: f64 = counts.iter().map(|row| row[class]).sum();
        let iou = counts[class][class] / (truth + predicted - counts[class][class]);
        if !iou.is_nan() {
            ious.push(iou);
            weighted += iou * truth / all;
        }
    }
    let mean = ious.iter().sum::<f64>() / ious.len() as f64;
    let right = (counts[2][2] + counts[9][9]) / all;
    for (row, column, expected) in
        [("mean", "IoU", mean), ("overall", "IoU", weighted), ("overall", "accuracy", right)]
    {
        let found = result.score(PLAIN, row, column).unwrap();
        assert!((found - expected).abs() < 1e-12 && found > 0.0, "{row} {column}: {found}, {expected}");
    }
}

#[test]
fn boundaries_of_classes_have_their_scores() {
    let dir = tempfile::tempdir().unwrap();
    let data = data();
    for kind in [ImageKind::Views, ImageKind::Panoramas] {
        let out = dir.path().join(format!("{kind}"));
        predict(&data, &out, kind, "png", |image, path| {
            fs::write(path, encode_gray8(&classes(&data, image))).unwrap();
        });
        let result = run(Protocol::SemEdge, data_set(), &out, &EvalOptions::default());
        let table = &result.tables[0];
        assert!(table.scores().all(|score| score.is_nan() || score == 1.0), "{}", result.to_markdown());
        assert_eq!((table.title.as_str(), table.rows.len()), (PLAIN, 14));
        assert_eq!(result.score(PLAIN, "mean", "F"), Some(1.0));
        assert_eq!(result.counted[&*kind.to_string()], images(&data, kind).len() as u64);

        // Moved by three pixels, where one is near enough: each class's mean over the images that have it.
        let out = dir.path().join(format!("{kind} moved"));
        let moved = |truth: &Raster<u8>| {
            let [width, height] = [truth.width(), truth.height()];
            let at = |x: u32, y: u32| truth.at((x + 3) % width, y);
            let pixels = (0..height).flat_map(|y| (0..width).map(move |x| at(x, y)));
            let known = pixels.map(|class| if class == 255 { 0 } else { class });
            Raster::from_vec(width, height, known.collect())
        };
        predict(&data, &out, kind, "png", |image, path| {
            fs::write(path, encode_gray8(&moved(&classes(&data, image)))).unwrap();
        });
        let result = run(Protocol::SemEdge, data_set(), &out, &EvalOptions::default());
        let mut of_walls = Vec::new();
        for image in images(&data, kind) {
            let truth = classes(&data, &image);
            let guess = moved(&truth);
            let there = truth.pixels().iter().map(|class| (*class < 255).then_some(*class));
            let there: Vec<Option<u8>> = there.collect();
            let guesses: Vec<Option<u8>> = there
                .iter()
                .zip(guess.pixels())
                .map(|(class, guess)| class.map(|_| *guess))
                .collect();
            let scores = class_outlines(&there, &guesses, [truth.width(), truth.height()]);
            of_walls.extend(
                scores
                    .into_iter()
                    .filter(|(class, _)| *class == 2)
                    .map(|(_, scores)| scores[0]),
            );
        }
        let mean = of_walls.iter().sum::<f64>() / of_walls.len() as f64;
        let found = result.score(PLAIN, "wall", "F").unwrap();
        assert!((found - mean).abs() < 1e-12 && found < 0.9, "{found}, {mean}");
    }
}

#[test]
fn mistakes_of_kinds_name_the_way_out() {
    let dir = tempfile::tempdir().unwrap();
    let data = data();
    let out = dir.path();
    let refused = |protocol: Protocol, options: &EvalOptions, words: &[&str]| {
        let error = evaluate(protocol, data_set(), out, options, &Context::default()).unwrap_err();
        let message = error.to_string();
        words
            .iter()
            .for_each(|word| assert!(message.contains(word), "{word}: {message}"));
        error.is_usage()
    };
    let all = |image: u8| {
        predict(&data, out, ImageKind::Views, "png", |_, path| {
            fs::write(path, encode_gray8(&Raster::filled(48, 48, image))).unwrap();
        });
    };
    let usual = EvalOptions::default();
    let of = |kind| options(|o| o.images = Some(kind));

    all(13);
    refused(Protocol::SemView, &usual, &["has 13 in column", "are below 13"]);
    assert!(refused(Protocol::SemView, &of(ImageKind::Panoramas), &["sem-view is of views"]));
    assert!(refused(Protocol::Depth, &of(ImageKind::Views), &["hohonet", "marigold-disparity"]));
    refused(Protocol::Depth, &usual, &["is named after a view", "depth as marigold"]);
    refused(Protocol::SemPano, &usual, &["is named after a view", "sem-view evaluates views"]);
    let mut panoramas = as_variant("marigold");
    panoramas.images = Some(ImageKind::Panoramas);
    refused(Protocol::Depth, &panoramas, &["is named after a view, and panoramas are evaluated"]);
    panoramas.median_scale = true;
    assert!(refused(Protocol::Depth, &panoramas, &["marigold has no scale to the median"]));

    let first = images(&data, ImageKind::Views).remove(0);
    let file = out
        .join(format!("area_{}", first.area))
        .join(format!("{}.png", first.stem()));
    fs::write(&file, encode_gray8(&Raster::filled(96, 48, 0))).unwrap();
    refused(Protocol::SemView, &usual, &[&first.stem(), "is 96 × 48 pixels, and should be 48 × 48"]);
    fs::remove_file(&file).unwrap();
    let panorama = images(&data, ImageKind::Panoramas).remove(0);
    fs::write(out.join(format!("{}.png", panorama.stem())), "").unwrap();
    refused(Protocol::SemView, &usual, &["is named after a panorama", "sem-pano evaluates panoramas"]);
}

/// Returns the mean of values, each with what it counts.
fn mean(values: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let [sum, weight] = values
        .into_iter()
        .fold([0.0; 2], |[sum, all], (value, weight)| [sum + weight * value, all + weight]);
    sum / weight
}

#[test]
fn depth_of_panoramas_is_weighted_by_latitude() {
    let dir = tempfile::tempdir().unwrap();
    let data = data();
    // Metres are wrong above the middle only.
    let factor = |at: usize| 1.0 + 0.4 * (24.0 - (at / 96) as f64).max(0.0) / 24.0;
    predict_floats(&data, dir.path(), ImageKind::Panoramas, |metres, at| metres * factor(at));
    let panoramas = images(&data, ImageKind::Panoramas);
    let check = |variant: &str, expected: [f64; 2]| {
        let result = run(Protocol::Depth, data_set(), dir.path(), &as_variant(variant));
        for (title, expected) in [PLAIN, BY_LATITUDE].into_iter().zip(expected) {
            let found = result.score(title, "mean", "AbsRel").unwrap();
            let expected = expected / panoramas.len() as f64;
            assert!((found - expected).abs() < 1e-12, "{variant}, {title}: {found}, {expected}");
        }
        assert!(expected[1] < 0.9 * expected[0], "{expected:?}");
    };

    let weights = latitude_weights(48);
    let error = |truth: f64, at: usize| (truth * factor(at)).min(10.0) / truth - 1.0;
    let mut expected = [0.0; 2];
    for image in &panoramas {
        let truth = metres(&data, image);
        let there = || {
            truth
                .iter()
                .enumerate()
                .filter(|(_, truth)| **truth > 1e-3 && **truth < 10.0)
        };
        expected[0] += mean(there().map(|(at, truth)| (error(*truth, at), 1.0)));
        expected[1] += mean(there().map(|(at, truth)| (error(*truth, at), weights[at / 96])));
    }
    check("marigold-metric", expected);

    let weights = latitude_weights(512);
    let [columns, rows] = [(96, 1024), (48, 512)].map(|(from, to)| pillow_nearest(from, to));
    let mut expected = [0.0; 2];
    for image in &panoramas {
        let truth = metres(&data, image);
        let mut errors = Vec::new();
        for (row, weight) in rows.iter().zip(&weights) {
            for column in &columns {
                let at = (row * 96 + column) as usize;
                if truth[at] > 0.0 {
                    let [truth, prediction] =
                        [truth[at], truth[at] * factor(at)].map(|v| v.clamp(0.01, 10.0));
                    errors.push(((truth - prediction).abs() / truth, *weight));
                }
            }
        }
        expected[0] += mean(errors.iter().map(|(error, _)| (*error, 1.0)));
        expected[1] += mean(errors);
    }
    check("hohonet", expected);

    let result = run(Protocol::Depth, data_set(), dir.path(), &as_variant("unifuse"));
    let [plain, weighted] = [PLAIN, BY_LATITUDE].map(|title| result.score(title, "mean", "AbsRel").unwrap());
    assert!(weighted < 0.9 * plain, "{plain} {weighted}");
}

#[test]
fn classes_and_normals_of_panoramas_are_weighted_by_latitude() {
    let dir = tempfile::tempdir().unwrap();
    let data = data();
    let panoramas = images(&data, ImageKind::Panoramas);

    // All is wall, so that its IoU is the share of walls.
    let out = dir.path().join("walls");
    predict(&data, &out, ImageKind::Panoramas, "png", |_, path| {
        fs::write(path, encode_gray8(&Raster::filled(1024, 512, 2))).unwrap();
    });
    let result = run(Protocol::SemPano, data_set(), &out, &EvalOptions::default());
    let titles: Vec<&str> = result.tables.iter().map(|table| table.title.as_str()).collect();
    assert_eq!(titles, [PLAIN, BY_LATITUDE]);
    let weights = latitude_weights(512);
    let mut shares = [Vec::new(), Vec::new()];
    for image in &panoramas {
        let read = |domain: Domain| {
            let path = image.path(data.layout(), domain);
            decode_rgb8(&data.read(&path).unwrap(), &path).unwrap()
        };
        let table = data.labels().unwrap().unwrap();
        let class = |index: u16| {
            let class = table.class_of(s3d_label::LabelId(index.into()));
            class.map(|class| class.index() as u8)
        };
        let truth =
            s3d_eval::images::PanoramaClasses::new(&read(Domain::Rgb), &read(Domain::Semantic), class);
        for (at, class) in truth.classes.iter().enumerate() {
            if let Some(class) = class {
                let is_wall = f64::from(u8::from(*class == 2));
                shares[0].push((is_wall, 1.0));
                shares[1].push((is_wall, weights[at / 1024]));
            }
        }
    }
    let shares = shares.map(mean);
    assert!((shares[0] - shares[1]).abs() > 0.01, "{shares:?}");
    for (title, share) in [PLAIN, BY_LATITUDE].into_iter().zip(shares) {
        let found = result.score(title, "wall", "IoU").unwrap();
        assert!((found - share).abs() < 1e-9, "{title}: {found}, {share}");
        assert_eq!(result.score(title, "wall", "accuracy"), Some(1.0));
    }

    // Vectors above the middle are turned by 90°.
    let out = dir.path().join("normals");
    predict(&data, &out, ImageKind::Panoramas, "npy", |image, path| {
        let from = image.path(data.layout(), Domain::Normal);
        let normals = decode_rgb8(&data.read(&from).unwrap(), &from).unwrap();
        let turned = normals.pixels().iter().enumerate().flat_map(|(at, pixel)| {
            let [x, y, z] = pixel.map(|c| f64::from(c) / 127.5 - 1.0);
            if at / 96 >= 16 {
                [x, y, z]
            } else if x.abs() > 0.1 {
                [y, -x, 0.0].map(|c| c / x.hypot(y))
            } else {
                [0.0, z, -y].map(|c| c / y.hypot(z))
            }
        });
        write_floats(path, &[48, 96, 3], turned.collect::<Vec<_>>());
    });
    let weights = latitude_weights(48);
    let mut turned = Vec::new();
    let mut of_images = Vec::new();
    for image in &panoramas {
        let from = image.path(data.layout(), Domain::Normal);
        let normals = decode_rgb8(&data.read(&from).unwrap(), &from).unwrap();
        let shown = normals
            .pixels()
            .iter()
            .enumerate()
            .filter(|(_, pixel)| **pixel != [128; 3]);
        let of_image: Vec<(f64, f64)> = shown
            .map(|(at, _)| (f64::from(u8::from(at / 96 < 16)), weights[at / 96]))
            .collect();
        of_images.push((mean(of_image.iter().copied()), 1.0));
        turned.extend(of_image);
    }
    let dsine = run(Protocol::Normal, data_set(), &out, &EvalOptions::default());
    let found = dsine.score(BY_LATITUDE, "all pixels", "mean (°)").unwrap();
    assert!((found - 90.0 * mean(turned.iter().copied())).abs() < 1e-3, "{}", dsine.to_markdown());
    let plain = dsine.score(PLAIN, "all pixels", "mean (°)").unwrap();
    assert!(plain > 1.2 * found, "{plain} {found}");
    let below = dsine.score(BY_LATITUDE, "all pixels", "< 5° (%)").unwrap();
    assert!((below - 100.0 * (1.0 - mean(turned))).abs() < 1e-9);
    assert!(dsine.score(BY_LATITUDE, "all pixels", "median (°)").unwrap().is_nan());
    let omnidata = run(Protocol::Normal, data_set(), &out, &as_variant("omnidata"));
    let found = omnidata.score(BY_LATITUDE, "mean", "≤ 30°").unwrap();
    assert!((found - (1.0 - mean(of_images))).abs() < 1e-9, "{}", omnidata.to_markdown());
    assert!(omnidata.score(BY_LATITUDE, "mean", "median (°)").unwrap() < 1e-3);
}
