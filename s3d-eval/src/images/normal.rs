//! Protocol `normal`: surface normals of views or panoramas.

use crate::Evaluation;
use crate::error::Result;
use crate::images::median::Medians;
use crate::images::normal_metrics::{
    AngleSums, DSINE_LIMITS, degrees, dsine_cosine, median_of_angles, omnidata_cosine, omnidata_scores,
};
use crate::images::predictions::{Matched, Predicted, Wanted, find};
use crate::images::read;
use crate::options::ImageKind;
use crate::tables::{Rows, Scores, mean_of_defined, tables};
use crate::task::Task;
use s3d_dataset::parallel::map_in_order;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use s3d_io::image::read_rgb8;

const DSINE: [&str; 3] = [
    "Images are evaluated at their own size, at pixels that show a surface. The angle is between the unit \
     vectors of truth and prediction, or 90° if the prediction has no length.",
    "The pixels of all images are pooled. Scores are the mean, the median (of two middle values their mean) \
     and the root mean square of the angles in degrees, and the percentage of angles below (<) 5, 7.5, \
     11.25, 22.5 and 30°.",
    "As in DSINE's utils.py (commit ef0c2afa), which computes in 32 bits; here it is 64.",
];

const OMNIDATA: [&str; 3] = [
    "Images are evaluated at their own size, at pixels that show a surface.",
    "Scores are computed for each image: the mean and the median (of two middle values their mean) of its \
     angles in degrees, and the share (0 to 1) of angles of at most (≤) 11.25, 22.5 and 30°. The table has \
     their mean over images.",
    "As in Omnidata's evaluation_metrics.py (commit f69ff3ae).",
];

pub(crate) fn normal(task: &Task<'_>) -> Result<Evaluation> {
    let wanted = Wanted {
        domain: Domain::Normal,
        besides: &[],
        kind: task.options.images,
        endings: &["png", "npy", "npz"],
        known: &[],
    };
    let matched = find(task, &wanted)?;

    let (of_axes, noun) = match matched.kind {
        ImageKind::Views => {
            ("Views: normals are in the camera's axes, as the data set stores them.", "views")
        }
        ImageKind::Panoramas => {
            ("Panoramas: normals are in the world's axes, as the data set stores them.", "panoramas")
        }
    };
    let (mut definition, pixels, tables) = match task.variant {
        "omnidata" => omnidata(task, &matched)?,
        _ => dsine(task, &matched)?,
    };
    definition.push(of_axes);
    let counted = [(noun, matched.images.len() as u64), ("pixels", pixels)];
    Ok(Evaluation { notes: matched.notes, ..task.evaluation(&definition, counted, tables) })
}

/// The definition, the number of pixels, and the scores.
type Parts = (Vec<&'static str>, u64, Scores);

fn omnidata(task: &Task<'_>, matched: &Matched) -> Result<Parts> {
    let progress = task.ctx.progress("evaluating", "images", matched.images.len() as u64);
    let units = map_in_order(task.ctx, &matched.images, Vec::new, |angles, predicted| {
        cosines(task, predicted, omnidata_cosine, angles)?;
        angles.iter_mut().for_each(|angle| *angle = degrees(*angle));
        progress.add(1);
        Ok(predicted.unit((angles.len() as u64, omnidata_scores(angles))))
    })?;

    let columns = ["mean (°)", "median (°)", "≤ 11.25°", "≤ 22.5°", "≤ 30°"];
    let made = tables(task, &columns, &units, mean_scores);
    Ok((OMNIDATA.to_vec(), units.iter().map(|unit| unit.counted.0).sum(), made))
}

fn mean_scores(units: &[&(u64, Option<[f64; 5]>)]) -> Rows {
    let there = units.iter().filter_map(|unit| unit.1);
    let mut sums = [0.0; 5];
    there
        .clone()
        .for_each(|scores| sums.iter_mut().zip(scores).for_each(|(sum, v)| *sum += v));
    let count = there.count() as f64;
    vec![("mean".to_owned(), sums.map(|sum| sum / count).to_vec())]
}

/// The angles of an image.
struct Angles {
    sums: AngleSums,
    median: f64,
    /// With intervals, the number of angles in each of [`STEPS`] steps.
    steps: Vec<u32>,
}

/// The number of steps of the histograms that give the medians of the bootstrap.
const STEPS: usize = 900;

fn dsine(task: &Task<'_>, matched: &Matched) -> Result<Parts> {
    let images = &matched.images;
    let with_intervals = task.options.bootstrap.is_some();
    let medians = Medians::new(task.folds.len());
    let progress = task.ctx.progress("evaluating", "images", 2 * images.len() as u64);
    let units = map_in_order(task.ctx, images, Vec::new, |angles, predicted| {
        cosines(task, predicted, dsine_cosine, angles)?;
        angles.iter_mut().for_each(|angle| *angle = degrees(*angle));
        medians.count(predicted.fold, angles);
        let mut steps = vec![0; if with_intervals { STEPS } else { 0 }];
        if with_intervals {
            angles
                .iter()
                .for_each(|angle| steps[((angle * 5.0) as usize).min(STEPS - 1)] += 1);
        }
        progress.add(1);
        let sums = AngleSums::of(angles);
        Ok(predicted.unit(Angles { sums, median: median_of_angles(angles).unwrap_or(f64::NAN), steps }))
    })?;

    // The angles do not fit into memory, so that the second pass reads the images again.
    let search = medians.search();
    map_in_order(task.ctx, images, Vec::new, |found, predicted| {
        cosines(task, predicted, dsine_cosine, found)?;
        search.look(predicted.fold, found);
        progress.add(1);
        Ok(())
    })?;
    drop(progress);
    let medians = search.found();

    let below = DSINE_LIMITS.map(|limit| format!("< {limit}° (%)"));
    let columns = ["mean (°)", "median (°)", "RMSE (°)"]
        .into_iter()
        .chain(below.iter().map(String::as_str));
    let mut made = tables(task, &columns.collect::<Vec<_>>(), &units, pooled_scores);
    // Medians of steps are for intervals only.
    for (table, median) in made.tables.iter_mut().zip(of_tables(&medians)) {
        table.rows[0].scores[1].value = median;
    }

    let mut definition = DSINE.to_vec();
    if with_intervals {
        definition.push("Intervals of medians are computed from angles in steps of 0.2°.");
    }
    Ok((definition, units.iter().map(|unit| unit.counted.sums.pixels).sum(), made))
}

fn pooled_scores(images: &[&Angles]) -> Rows {
    let mut sums = AngleSums::default();
    let mut steps = vec![0u64; STEPS];
    for image in images {
        sums.add(&image.sums);
        steps
            .iter_mut()
            .zip(&image.steps)
            .for_each(|(sum, n)| *sum += u64::from(*n));
    }
    let median = match images {
        [image] => image.median,
        _ => median_of_steps(&steps),
    };
    let ([mean, rmse], below) = sums.mean_rmse_below();
    let scores = [mean, median, rmse].into_iter().chain(below);
    vec![("all pixels".to_owned(), scores.collect())]
}

/// Returns medians in the order of tables: of folds, of all, and the mean over folds. `medians` has the first
/// two. A single fold has the first table only.
fn of_tables(medians: &[f64]) -> Vec<f64> {
    let [folds @ .., _] = medians else { return Vec::new() };
    let mean = mean_of_defined(folds.iter().copied());
    medians.iter().copied().chain([mean]).collect()
}

/// Returns the angle below which half of the angles are, as if they were spread evenly within each step.
fn median_of_steps(steps: &[u64]) -> f64 {
    let half = steps.iter().sum::<u64>() as f64 / 2.0;
    let mut below = 0.0;
    for (step, &count) in steps.iter().enumerate().filter(|(_, count)| **count > 0) {
        if below + count as f64 >= half {
            return (step as f64 + (half - below) / count as f64) * 180.0 / steps.len() as f64;
        }
        below += count as f64;
    }
    f64::NAN
}

/// Replaces the content of `found` by the cosines of an image, at the pixels where its truth shows something.
fn cosines(
    task: &Task<'_>,
    predicted: &Predicted,
    cosine: impl Fn([f64; 3], [f64; 3]) -> f64,
    found: &mut Vec<f64>,
) -> s3d_dataset::Result<()> {
    /// The pixel that shows nothing.
    const MISSING: [u8; 3] = [128; 3];
    let channels: [f64; 256] = std::array::from_fn(|channel| (channel as f64 - 127.5) / 127.5);
    let decoded = |pixel: [u8; 3]| pixel.map(|channel| channels[usize::from(channel)]);
    let image = read::rgb8(task.data, &predicted.image, Domain::Normal)?;
    let size = [image.width(), image.height()];
    let file = &predicted.file;
    let wrong = |at: usize, what: String| {
        let [x, y] = [at % size[0] as usize, at / size[0] as usize];
        let message = format!("has {what} in column {x}, row {y}, which is evaluated");
        Err(FileError::format(file, message).into())
    };
    let truth = image
        .pixels()
        .iter()
        .enumerate()
        .filter(|(_, pixel)| **pixel != MISSING);
    found.clear();
    found.reserve(image.len());

    if read::is_png(file) {
        let prediction = read_rgb8(file)?;
        read::check_size(file, [prediction.width(), prediction.height()], &[size])?;
        for (at, truth) in truth {
            let pixel = prediction.pixels()[at];
            if pixel == MISSING {
                return wrong(at, "128, 128, 128 (missing)".to_owned());
            }
            found.push(cosine(decoded(*truth), decoded(pixel)));
        }
        return Ok(());
    }

    let (_, values) = read::floats(file, &[size], 3)?;
    let vectors = values.as_chunks::<3>().0;
    for (at, truth) in truth {
        let vector = vectors[at];
        // The vectors of networks have lengths of about 1, and colours from 0 to 255 are no vectors.
        let square: f64 = vector.iter().map(|c| c * c).sum();
        if square.is_nan() || square > 4.0 {
            return wrong(at, format!("{vector:?}, no unit vector,"));
        }
        found.push(cosine(decoded(*truth), vector));
    }
    Ok(())
}
