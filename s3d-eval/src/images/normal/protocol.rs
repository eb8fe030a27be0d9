//! Protocol `normal`: surface normals of views or panoramas.

use crate::error::Result;
use crate::images::latitude::{BY_LATITUDE, Sums, latitude_weights, tables_by_latitude};
use crate::images::normal::median::Medians;
use crate::images::normal::metrics::{
    AngleSums, DSINE_LIMITS, degrees, dsine_cosine, median_of_angles, omnidata_cosine, omnidata_scores,
    weighted_omnidata_scores,
};
use crate::images::predictions::{Matched, Predicted, Wanted, find};
use crate::images::read::{self, Holds};
use crate::options::ImageKind;
use crate::tables::{Rows, Scores, mean_of_defined, tables};
use crate::task::Task;
use crate::{Evaluation, hints};
use s3d_dataset::parallel::map_in_order;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use s3d_io::image::read_rgb8;
use std::iter::repeat_n;

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
     angles in degrees, and the share (0 to 1) of angles of at most (≤) 11.25, 22.5 and 30°. The table \
     has their mean over images.",
    "As in Omnidata's evaluation_metrics.py (commit f69ff3ae).",
];

pub(crate) fn normal(task: &Task<'_>) -> Result<Evaluation> {
    let wanted = Wanted {
        domain: Domain::Normal,
        besides: &[],
        kind: task.options.images,
        other_kind: "",
        endings: &["png", "npy", "npz"],
        known: &[],
    };
    let matched = find(task, &wanted)?;

    let of_axes = match matched.kind {
        ImageKind::Views => "Views: normals are in the camera's axes, as the data set stores them.",
        ImageKind::Panoramas => "Panoramas: normals are in the world's axes, as the data set stores them.",
    };
    let (mut definition, pixels, scores) = match task.variant {
        "omnidata" => omnidata(task, &matched)?,
        _ => dsine(task, &matched)?,
    };
    definition.push(of_axes);
    if matched.kind == ImageKind::Panoramas {
        definition.push(BY_LATITUDE);
        definition.push(match task.variant {
            "omnidata" => "There, the median is the least angle up to which half of the weight lies.",
            _ => "There, the median is left out.",
        });
    }
    let counted = [(matched.kind.noun(), matched.images.len() as u64), ("pixels", pixels)];
    let mut notes = matched.notes;
    notes.extend(hints::of_angles(&scores.tables));
    Ok(Evaluation { notes, ..task.evaluation(&definition, counted, scores) })
}

/// The definition, the number of pixels, and the scores.
type Parts = (Vec<&'static str>, u64, Scores);

fn omnidata(task: &Task<'_>, matched: &Matched) -> Result<Parts> {
    let progress = task.ctx.progress("evaluating", "images", matched.images.len() as u64);
    let units = map_in_order(task.ctx, &matched.images, Found::default, |found, predicted| {
        found.read(task, predicted, omnidata_cosine)?;
        found.turn_to_degrees();
        let weighted = (matched.kind == ImageKind::Panoramas).then(|| {
            let mut pairs: Vec<(f64, f64)> = found.values.iter().copied().zip(found.weights()).collect();
            weighted_omnidata_scores(&mut pairs)
        });
        progress.add(1);
        let pixels = found.values.len() as u64;
        let scores = [omnidata_scores(&mut found.values), weighted.flatten()];
        Ok(predicted.unit((pixels, scores)))
    })?;

    let columns = ["mean (°)", "median (°)", "≤ 11.25°", "≤ 22.5°", "≤ 30°"];
    let mut made = tables(task, &columns, &units, |units| mean_scores(units, 0));
    if matched.kind == ImageKind::Panoramas {
        made.extend(tables_by_latitude(task, &columns, &units, |units| mean_scores(units, 1)));
    }
    Ok((OMNIDATA.to_vec(), units.iter().map(|unit| unit.counted.0).sum(), made))
}

fn mean_scores(units: &[&(u64, [Option<[f64; 5]>; 2])], by: usize) -> Rows {
    let there = units.iter().filter_map(|unit| unit.1[by]);
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
    /// With intervals, the number of its angles in each of [`STEPS`] steps.
    steps: Vec<u32>,
    /// The sums of a panorama, weighted by latitude: of angles, of their squares, and of those below each
    /// limit.
    weighted: Sums<7>,
}

/// The number of steps of the histograms that give the medians of the bootstrap.
const STEPS: usize = 900;

fn dsine(task: &Task<'_>, matched: &Matched) -> Result<Parts> {
    let images = &matched.images;
    let with_intervals = task.rounds() > 0;
    let medians = Medians::new(task.folds.len());
    let progress = task.ctx.progress("evaluating", "images", 2 * images.len() as u64);
    let by_latitude = matched.kind == ImageKind::Panoramas;
    let units = map_in_order(task.ctx, images, Found::default, |found, predicted| {
        found.read(task, predicted, dsine_cosine)?;
        found.turn_to_degrees();
        let angles = &found.values;
        medians.count(predicted.fold, angles);
        let mut steps = vec![0; if with_intervals { STEPS } else { 0 }];
        if with_intervals {
            angles
                .iter()
                .for_each(|angle| steps[((angle * 5.0) as usize).min(STEPS - 1)] += 1);
        }
        let mut weighted = Sums::EMPTY;
        if by_latitude {
            for (&angle, weight) in angles.iter().zip(found.weights()) {
                let [a, b, c, d, e] = DSINE_LIMITS.map(|limit| f64::from(u8::from(angle < limit)));
                weighted.add(weight, &[angle, angle * angle, a, b, c, d, e]);
            }
        }
        progress.add(1);
        let sums = AngleSums::of(angles);
        let median = median_of_angles(&mut found.values).unwrap_or(f64::NAN);
        Ok(predicted.unit(Angles { sums, median, steps, weighted }))
    })?;

    // The angles do not fit into memory, so that the second pass reads the images again.
    let search = medians.search();
    map_in_order(task.ctx, images, Found::default, |found, predicted| {
        found.read(task, predicted, dsine_cosine)?;
        search.look(predicted.fold, &found.values);
        progress.add(1);
        Ok(())
    })?;
    drop(progress);
    let medians = search.found();

    let below = DSINE_LIMITS.map(|limit| format!("< {limit}° (%)"));
    let columns: Vec<&str> = ["mean (°)", "median (°)", "RMSE (°)"]
        .into_iter()
        .chain(below.iter().map(String::as_str))
        .collect();
    let mut made = tables(task, &columns, &units, pooled_scores);
    // Medians of steps are for intervals only.
    for (table, median) in made.tables.iter_mut().zip(of_tables(&medians)) {
        table.rows[0].scores[1].value = median;
    }

    if by_latitude {
        made.extend(tables_by_latitude(task, &columns, &units, weighted_scores));
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

/// Returns the scores by latitude. The median has none: it would need all angles and their weights.
fn weighted_scores(units: &[&Angles]) -> Rows {
    let mut sums = Sums::EMPTY;
    units.iter().for_each(|unit| sums.add_sums(&unit.weighted));
    let [mean, square, below @ ..] = sums.means();
    let scores = [mean, f64::NAN, square.sqrt()]
        .into_iter()
        .chain(below.map(|share| 100.0 * share));
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

/// The cosines of an image or its angles, row by row, at the pixels where its truth shows something.
#[derive(Default)]
struct Found {
    values: Vec<f64>,
    /// The number of these pixels in each row.
    of_rows: Vec<usize>,
}

impl Found {
    /// Replaces cosines by angles.
    fn turn_to_degrees(&mut self) {
        self.values.iter_mut().for_each(|value| *value = degrees(*value));
    }

    /// Returns what each of the pixels counts by latitude.
    fn weights(&self) -> impl Iterator<Item = f64> {
        let weights = latitude_weights(self.of_rows.len() as u32);
        let of_rows = weights.into_iter().zip(&self.of_rows);
        of_rows.flat_map(|(weight, pixels)| repeat_n(weight, *pixels))
    }

    /// Replaces its content by the cosines of an image.
    fn read(
        &mut self,
        task: &Task<'_>,
        predicted: &Predicted,
        cosine: impl Fn([f64; 3], [f64; 3]) -> f64,
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
        self.values.clear();
        self.values.reserve(image.len());
        self.of_rows.clear();
        self.of_rows.extend(
            image
                .rows()
                .map(|row| row.iter().filter(|pixel| **pixel != MISSING).count()),
        );

        if read::is_png(file) {
            let prediction = read_rgb8(file)?;
            read::check_size(file, [prediction.width(), prediction.height()], &[size])?;
            for (at, truth) in truth {
                let pixel = prediction.pixels()[at];
                if pixel == MISSING {
                    return wrong(at, "128, 128, 128 (missing)".to_owned());
                }
                self.values.push(cosine(decoded(*truth), decoded(pixel)));
            }
            return Ok(());
        }

        let (_, values) = read::array(file, &[size], Holds::Floats(3))?;
        let vectors = values.as_chunks::<3>().0;
        for (at, truth) in truth {
            let vector = vectors[at];
            // The vectors of networks have lengths of about 1, and colours from 0 to 255 are no vectors.
            let square: f64 = vector.iter().map(|c| c * c).sum();
            if square.is_nan() || square > 4.0 {
                return wrong(at, format!("{vector:?}, no unit vector,"));
            }
            self.values.push(cosine(decoded(*truth), vector));
        }
        Ok(())
    }
}
