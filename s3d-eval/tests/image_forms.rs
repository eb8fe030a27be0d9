//! Predictions of images as people have them: arrays in either order of memory, channels first or last,
//! numbers or scores of classes. All forms of the same prediction have the same scores.

use crate::images::{classes, depth, images, predict, run};
use crate::scene::data_set;
use s3d_dataset::DataSet;
use s3d_eval::images::pillow_nearest;
use s3d_eval::{Context, EvalOptions, Evaluation, ImageKind, Protocol, evaluate};
use s3d_geom::Raster;
use s3d_io::dataset::{DatasetImage, Domain};
use s3d_io::image::{decode_rgb8, encode_gray8};
use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Returns the bytes that numpy writes for an array of H × W × C. `order` has the axes of the array
/// (`"cyx"` for C × H × W), which is `fortran` or not.
pub(crate) fn npy<const N: usize>(
    kind: &str,
    [height, width, channels]: [usize; 3],
    order: &str,
    fortran: bool,
    number: impl Fn(usize, usize, usize) -> [u8; N],
) -> Vec<u8> {
    let length = |axis: char| match axis {
        'y' => height,
        'x' => width,
        _ => channels,
    };
    let axes: Vec<char> = order.chars().collect();
    let shape: Vec<String> = axes.iter().map(|axis| length(*axis).to_string()).collect();
    let truth = if fortran { "True" } else { "False" };
    let text = format!("{{'descr': '{kind}', 'fortran_order': {truth}, 'shape': ({}), }}", shape.join(", "));
    let padded = (10 + text.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(padded).unwrap().to_le_bytes());
    bytes.extend(format!("{text:<width$}\n", width = padded - 1).bytes());

    let stored: Vec<char> = if fortran {
        axes.into_iter().rev().collect()
    } else {
        axes
    };
    let all: usize = stored.iter().map(|axis| length(*axis)).product();
    for at in 0..all {
        let mut place = [0; 3];
        let mut rest = at;
        for axis in stored.iter().rev() {
            place["yxc".find(*axis).unwrap()] = rest % length(*axis);
            rest /= length(*axis);
        }
        bytes.extend(number(place[0], place[1], place[2]));
    }
    bytes
}

fn write_npz(path: &Path, array: &[u8]) {
    let mut zip = ZipWriter::new(File::create(path).unwrap());
    zip.start_file("arr_0.npy", SimpleFileOptions::default()).unwrap();
    zip.write_all(array).unwrap();
    zip.finish().unwrap();
}

/// The text of an evaluation, in which scores that are not defined are equal.
fn json(evaluation: &Evaluation) -> String {
    serde_json::to_string(evaluation).unwrap()
}

fn of(protocol: Protocol, predictions: &Path) -> Evaluation {
    run(protocol, data_set(), predictions, &EvalOptions::default())
}

#[test]
fn depth_may_be_in_columns() {
    let dir = tempfile::tempdir().unwrap();
    let data = DataSet::open(data_set()).unwrap();
    let array = |image: &DatasetImage, order: &str, fortran: bool| {
        let truth = depth(&data, image);
        let sides = [truth.height(), truth.width(), 1].map(|side| side as usize);
        npy("<f4", sides, order, fortran, |y, x, _| {
            (f32::from(truth.at(x as u32, y as u32)) / 512.0).to_le_bytes()
        })
    };
    for (order, fortran) in [("yx", true), ("cyx", true), ("yxc", true), ("yx", false)] {
        for ending in ["npy", "npz"] {
            let out = dir.path().join(format!("{order} {fortran} {ending}"));
            predict(&data, &out, ImageKind::Panoramas, ending, |image, path| {
                let bytes = array(image, order, fortran);
                if ending == "npz" {
                    write_npz(path, &bytes);
                } else {
                    fs::write(path, bytes).unwrap();
                }
            });
            let result = of(Protocol::Depth, &out);
            let mae = result.score("areas 2, 5", "mean", "MAE (m)");
            assert_eq!(mae, Some(0.0), "{order} {fortran} {ending}");
        }
    }
}

#[test]
fn normals_may_have_their_channels_first() {
    let dir = tempfile::tempdir().unwrap();
    let data = DataSet::open(data_set()).unwrap();
    let mut results = Vec::new();
    for (order, fortran) in [("yxc", false), ("cyx", false), ("yxc", true), ("cyx", true)] {
        let out = dir.path().join(format!("{order} {fortran}"));
        predict(&data, &out, ImageKind::Panoramas, "npy", |image, path| {
            let from = image.path(data.layout(), Domain::Normal);
            let truth = decode_rgb8(&data.read(&from).unwrap(), &from).unwrap();
            let sides = [truth.height(), truth.width(), 3].map(|side| side as usize);
            let bytes = npy("<f8", sides, order, fortran, |y, x, c| {
                let channel = truth.at(x as u32, y as u32)[c];
                (f64::from(channel) / 127.5 - 1.0 + 0.1 * (x % 3) as f64).to_le_bytes()
            });
            fs::write(path, bytes).unwrap();
        });
        results.push(of(Protocol::Normal, &out));
    }
    let mean = results[0].score("areas 2, 5", "all pixels", "mean (°)").unwrap();
    assert!((3.0..10.0).contains(&mean), "{mean}");
    assert!(results.iter().all(|result| result.tables[0] == results[0].tables[0]));
}

/// A score of a class, of which several are equal.
fn score(image: &DatasetImage, y: usize, x: usize, class: usize) -> f32 {
    let seed = image.stem().len() + 7 * y + 3 * x;
    (seed * (class + 5) % 11) as f32 - 5.0
}

fn guess(image: &DatasetImage, y: usize, x: usize, classes: usize) -> u8 {
    let scores = (0..classes).map(|class| score(image, y, x, class));
    let best = scores.clone().fold(f32::MIN, f32::max);
    scores.into_iter().position(|score| score == best).unwrap() as u8
}

#[test]
fn classes_may_be_numbers_or_scores() {
    let dir = tempfile::tempdir().unwrap();
    let data = DataSet::open(data_set()).unwrap();
    let with = |name: &str, ending: &str, bytes: &dyn Fn(&DatasetImage, [usize; 2]) -> Vec<u8>| {
        let out = dir.path().join(name);
        predict(&data, &out, ImageKind::Panoramas, ending, |image, path| {
            let truth = classes(&data, image);
            let bytes = bytes(image, [truth.height(), truth.width()].map(|side| side as usize));
            if ending == "npz" {
                write_npz(path, &bytes);
            } else {
                fs::write(path, bytes).unwrap();
            }
        });
        of(Protocol::SemPano, &out)
    };

    let of_images = with("png", "png", &|image, [height, width]| {
        let guesses = (0..height * width)
            .map(|at| guess(image, at / width, at % width, 13))
            .collect();
        encode_gray8(&Raster::from_vec(width as u32, height as u32, guesses))
    });
    assert!(of_images.tables[0].rows.iter().any(|row| row.scores[0].value > 0.0));
    for fortran in [false, true] {
        let numbers = with(&format!("numbers {fortran}"), "npy", &|image, [height, width]| {
            npy("<i8", [height, width, 1], "yx", fortran, |y, x, _| {
                i64::from(guess(image, y, x, 13)).to_le_bytes()
            })
        });
        assert_eq!(json(&numbers), json(&of_images), "{fortran}");
        for (order, ending) in [("yxc", "npz"), ("cyx", "npy")] {
            let scores = with(&format!("{order} {fortran}"), ending, &|image, [height, width]| {
                npy("<f4", [height, width, 13], order, fortran, |y, x, c| score(image, y, x, c).to_le_bytes())
            });
            assert_eq!(json(&scores), json(&of_images), "{order} {fortran}");
        }
    }

    // With a list of classes, there are as many scores as lines.
    let out = dir.path().join("yxc false");
    fs::write(out.join("classes.txt"), "wall\nfloor\n").unwrap();
    let refused = |words: &[&str]| {
        let result =
            evaluate(Protocol::SemPano, data_set(), &out, &EvalOptions::default(), &Context::default());
        let message = result.unwrap_err().to_string();
        words
            .iter()
            .for_each(|word| assert!(message.contains(word), "{word}: {message}"));
    };
    refused(&["48, 96, 13]", "H × W × 2 or 2 × H × W floats"]);
    let first = images(&data, ImageKind::Panoramas).remove(0);
    let folder = out.join(format!("area_{}", first.area));
    fs::remove_file(folder.join(format!("{}.npz", first.stem()))).unwrap();
    let file = folder.join(format!("{}.npy", first.stem()));

    let two = |value: f64| {
        npy("<f8", [48, 96, 2], "cyx", true, |y, x, c| {
            if [y, x, c] == [30, 40, 1] { value } else { 0.5 }.to_le_bytes()
        })
    };
    fs::write(&file, two(f64::NAN)).unwrap();
    refused(&[&first.stem(), "has NaN in column 40, row 30, which is evaluated"]);
    fs::write(&file, npy("<i4", [48, 96, 1], "yx", false, |_, _, _| (-1i32).to_le_bytes())).unwrap();
    refused(&[&first.stem(), "has -1 in column ", "are below 2"]);
    fs::write(&file, npy("<f4", [48, 96, 1], "yx", false, |_, _, _| 1f32.to_le_bytes())).unwrap();
    refused(&["[48, 96]", "H × W whole numbers"]);
    fs::write(&file, npy("|u1", [96, 48, 1], "yx", false, |_, _, _| [0])).unwrap();
    refused(&["48 × 96", "1024 × 512 or 96 × 48"]);
}

#[test]
fn an_array_may_have_the_size_of_the_evaluation() {
    let dir = tempfile::tempdir().unwrap();
    let data = DataSet::open(data_set()).unwrap();
    predict(&data, dir.path(), ImageKind::Panoramas, "npy", |image, path| {
        let truth = classes(&data, image);
        let [columns, rows] = [(96, 1024), (48, 512)].map(|(from, to)| pillow_nearest(from, to));
        let bytes = npy("|u1", [512, 1024, 1], "yx", true, |y, x, _| [truth.at(columns[x], rows[y])]);
        fs::write(path, bytes).unwrap();
    });
    let result = of(Protocol::SemPano, dir.path());
    assert_eq!(result.score("areas 2, 5", "mean", "IoU"), Some(1.0), "{}", result.to_markdown());
}
