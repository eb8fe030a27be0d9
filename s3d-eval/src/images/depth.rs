//! Protocol `depth`: distances of panoramas.

use crate::Evaluation;
use crate::error::{Error, Result};
use crate::images::depth_metrics::{DEPTH_COLUMNS, DepthScores, hohonet_depth, unifuse_depth};
use crate::images::predictions::{Matched, Predicted, Wanted, find};
use crate::images::read::{self, Places};
use crate::images::resample::{opencv_nearest, pillow_nearest};
use crate::options::ImageKind;
use crate::tables::tables;
use crate::task::Task;
use s3d_dataset::parallel::map_in_order;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use s3d_io::image::read_gray16;

const HOHONET: [&str; 5] = [
    "Panoramas are evaluated at 1024 × 512 pixels. Each takes the panorama's pixel at its centre, as in \
     scikit-image and Pillow. A prediction of the panorama's own size is sampled at the same pixels.",
    "Pixels whose true distance exists and is above 0 are evaluated. Truth and prediction are first clamped \
     to 0.01 m to 10 m.",
    "Scores are computed for each panorama; the table has their mean over panoramas.",
    "δ is the larger of prediction ÷ truth and truth ÷ prediction. Logarithms are decimal.",
    "As in HoHoNet's test_depth.py (commit 2bbc0866), which has no SqRel and computes in 32 bits; here it is \
     64.",
];

const UNIFUSE: [&str; 6] = [
    "Panoramas are evaluated at 1024 × 512 pixels. Each takes the panorama's pixel at its upper left corner, \
     as in OpenCV. A prediction of the panorama's own size is sampled at the same pixels.",
    "Pixels whose true distance is above 0 and at most 10 m are evaluated. Truth and prediction are raised \
     to at least 0.1 m.",
    "A fault of the script is kept: where a prediction is beyond 10 m, the truth becomes 10 m and the \
     prediction stays.",
    "Scores are computed for each panorama; the table has their mean over panoramas.",
    "δ is the larger of prediction ÷ truth and truth ÷ prediction. Logarithms are decimal.",
    "As in UniFuse's metrics.py (commit 5da3a4e6).",
];

const MEDIAN_SCALE: &str = "The predictions of each panorama are scaled so that the median of its evaluated \
     pixels is the truth's median. Of two middle values the lower is the median.";

pub(crate) fn depth(task: &Task<'_>) -> Result<Evaluation> {
    let median_scale = task.options.median_scale;
    let is_unifuse = task.variant == "unifuse";
    if median_scale && !is_unifuse {
        return Err(Error::NoMedianScale { variant: task.variant });
    }
    if task.options.images == Some(ImageKind::Views) {
        return Err(Error::PanoramasOnly { protocol: task.protocol });
    }

    let wanted = Wanted {
        domain: Domain::Depth,
        besides: &[],
        kind: Some(ImageKind::Panoramas),
        endings: &["png", "npy", "npz"],
        known: &[],
    };
    let Matched { images, mut notes, .. } = find(task, &wanted)?;

    let progress = task.ctx.progress("evaluating", "panoramas", images.len() as u64);
    let units = map_in_order(
        task.ctx,
        &images,
        || (),
        |(), predicted| {
            let nearest = if is_unifuse { opencv_nearest } else { pillow_nearest };
            let farthest = if is_unifuse { 10.0 } else { f64::INFINITY };
            let (truth, prediction) = both(task, predicted, nearest, farthest)?;
            progress.add(1);
            let scores = if is_unifuse {
                unifuse_depth(&truth, &prediction, median_scale)
            } else {
                hohonet_depth(&truth, &prediction)
            };
            Ok(predicted.unit(scores))
        },
    )?;
    drop(progress);

    let empty = units.iter().filter(|unit| unit.counted.pixels == 0).count();
    if empty > 0 {
        notes.push(format!(
            "{empty} panoramas without a pixel to evaluate were left out; in the script they make all scores \
             NaN."
        ));
    }
    let replaced: u64 = units.iter().map(|unit| unit.counted.replaced).sum();
    if replaced > 0 {
        notes.push(format!(
            "{replaced} pixels were predicted beyond 10 m and compared with 10 m instead of their truth."
        ));
    }

    let tables = tables(task, &DEPTH_COLUMNS, &units, |units| vec![("mean".to_owned(), mean(units))]);
    let pixels = units.iter().map(|unit| unit.counted.pixels).sum();
    let counted = [("panoramas", images.len() as u64), ("pixels", pixels)];
    let mut definition = if is_unifuse { UNIFUSE.to_vec() } else { HOHONET.to_vec() };
    if median_scale {
        definition.insert(3, MEDIAN_SCALE);
    }
    Ok(Evaluation { notes, ..task.evaluation(&definition, counted, tables) })
}

/// Returns the means of scores over the images that have any.
fn mean(units: &[&DepthScores]) -> Vec<f64> {
    let there = units.iter().filter(|scores| scores.pixels > 0);
    let mut sums = [0.0; DEPTH_COLUMNS.len()];
    there
        .clone()
        .for_each(|scores| sums.iter_mut().zip(scores.values).for_each(|(sum, v)| *sum += v));
    let count = there.count() as f64;
    sums.map(|sum| sum / count).to_vec()
}

/// Returns truth and prediction in metres at the pixels of the evaluation. Missing truth is 0. Refuses a file
/// without a prediction where the truth is above 0 and at most `farthest`.
fn both(
    task: &Task<'_>,
    predicted: &Predicted,
    nearest: fn(u32, u32) -> Vec<u32>,
    farthest: f64,
) -> s3d_dataset::Result<(Vec<f64>, Vec<f64>)> {
    let units = task.data.options().depth_units;
    let image = read::gray16(task.data, &predicted.image, Domain::Depth)?;
    let places = Places::new([image.width(), image.height()], nearest);

    let truth: Vec<f64> = places
        .sample(image.pixels())
        .into_iter()
        .map(|value| units.metres(value).unwrap_or(0.0))
        .collect();

    let file = &predicted.file;
    let (size, prediction) = if read::is_png(file) {
        let image = read_gray16(file)?;
        let size = [image.width(), image.height()];
        read::check_size(file, size, &places.sizes())?;
        let values = places.sample_prediction(size, image.into_vec());
        let metres = values.into_iter().map(|value| units.metres(value).unwrap_or(f64::NAN));
        (size, metres.collect())
    } else {
        let (size, values) = read::floats(file, &places.sizes(), 1)?;
        (size, places.sample_prediction(size, values))
    };

    let wrong =
        |(truth, prediction): (&f64, &f64)| *truth > 0.0 && *truth <= farthest && !prediction.is_finite();
    if let Some(at) = truth.iter().zip(&prediction).position(wrong) {
        let [x, y] = places.place(size, at);
        let found = if read::is_png(file) {
            "65535 (missing)".to_owned()
        } else {
            prediction[at].to_string()
        };
        let message = format!("has {found} in column {x}, row {y}, which is evaluated: predict every pixel");
        return Err(FileError::format(file, message).into());
    }
    Ok((truth, prediction))
}
