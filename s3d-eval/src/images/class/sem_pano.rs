//! Protocol `sem-pano`: classes of panoramas.

use crate::Evaluation;
use crate::error::{Error, Result};
use crate::images::class::classes::{Classes, ENDINGS, LIST};
use crate::images::class::confusion::{ClassScores, hohonet_scores};
use crate::images::class::panorama::{PANORAMA, PanoramaClasses};
use crate::images::latitude::{BY_LATITUDE, tables_by_latitude, weights_of_pixels};
use crate::images::predictions::{Matched, Predicted, Wanted, find};
use crate::images::read::{self, Places};
use crate::images::resample::pillow_nearest;
use crate::options::ImageKind;
use crate::tables::{Rows, tables};
use crate::task::Task;
use s3d_dataset::DataSet;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use std::cell::RefCell;
use std::path::Path;

const DEFINITION: [&str; 6] = [
    "Panoramas are evaluated at 1024 × 512 pixels. Label indices are resized by Pillow's nearest filter. A \
     prediction of the panorama's own size is sampled at the same pixels.",
    "Pixels are not evaluated if they have no label, if the panorama shows nothing there, or if its RGB \
     image is black there after Pillow's Lanczos filter to 1024 × 512.",
    "Each fold has one confusion matrix, of the pixels of all its panoramas. Areas 5a and 5b are both area \
     5.",
    "Classes without true pixels are removed from the matrix first, rows and columns: a pixel predicted as \
     such a class counts nowhere.",
    "IoU is intersection over union; accuracy is the share of a class's true pixels that were found. Both \
     are of the fold's matrix. The row `mean` is over the classes with true pixels.",
    "As in HoHoNet's test_sem.py for RGB (commit 2bbc0866).",
];

pub(crate) fn sem_pano(task: &Task<'_>) -> Result<Evaluation> {
    if task.options.images == Some(ImageKind::Views) {
        return Err(Error::PanoramasOnly { protocol: task.protocol });
    }
    let classes = Classes::of(task)?;
    let wanted = Wanted {
        domain: Domain::Semantic,
        besides: &[Domain::Rgb],
        kind: Some(ImageKind::Panoramas),
        other_kind: "sem-view evaluates views",
        endings: &ENDINGS,
        known: &[LIST],
    };
    let matched = find(task, &wanted)?;

    let units = matched.count(task, |predicted| {
        let truth = truth(task.data, predicted, &classes)?;
        compare(&truth, &predicted.file, &classes)
    })?;
    let Matched { images, notes, .. } = matched;

    let columns = ["IoU", "accuracy"];
    let mut made = tables(task, &columns, &units, |units| {
        rows(&classes, classes.sum(units.iter().map(|unit| &unit.counts)).scores())
    });
    made.extend(tables_by_latitude(task, &columns, &units, |units| {
        let mut cells = vec![0.0; classes.count * classes.count];
        for (at, weight) in units.iter().flat_map(|unit| unit.weights()) {
            cells[at] += weight;
        }
        rows(&classes, hohonet_scores(classes.count, &cells))
    }));

    let all = classes.sum(units.iter().map(|unit| &unit.counted.counts));
    let counted = [("panoramas", images.len() as u64), ("pixels", all.pixels())];
    let definition: Vec<&str> = DEFINITION.into_iter().chain([BY_LATITUDE]).collect();
    Ok(Evaluation {
        notes,
        confusion: Some(classes.table(&all)),
        ..task.evaluation(&definition, counted, made)
    })
}

fn rows(classes: &Classes<'_>, scores: ClassScores) -> Rows {
    let mean = vec![scores.mean_iou, scores.mean_accuracy];
    let by_class = scores.iou.into_iter().zip(scores.accuracy);
    let mut rows = classes.rows(by_class.map(|(iou, accuracy)| vec![iou, accuracy]));
    rows.push(("mean".to_owned(), mean));
    rows
}

/// The counts of a panorama other than 0, each with its place in the matrix.
struct Counted {
    counts: Vec<(u32, u32)>,
    /// What the pixels of each count weigh by latitude.
    weights: Vec<f64>,
}

impl Counted {
    /// Returns the place of each weight in the matrix, and the weight.
    fn weights(&self) -> impl Iterator<Item = (usize, f64)> {
        let places = self.counts.iter().map(|(at, _)| *at as usize);
        places.zip(self.weights.iter().copied())
    }
}

struct Truth {
    classes: PanoramaClasses,
    places: Places,
}

/// Returns the true classes of a panorama.
fn truth(data: &DataSet, predicted: &Predicted, classes: &Classes<'_>) -> s3d_dataset::Result<Truth> {
    let rgb = read::rgb8(data, &predicted.image, Domain::Rgb)?;
    let semantic = read::rgb8(data, &predicted.image, Domain::Semantic)?;
    let path = predicted.image.path(data.layout(), Domain::Semantic);
    let size = [semantic.width(), semantic.height()];
    if [rgb.width(), rgb.height()] != size {
        return Err(FileError::format(&path, "is of another size than the RGB image of its panorama").into());
    }

    let unknown = RefCell::new(None);
    let truth = PanoramaClasses::new(&rgb, &semantic, |index| {
        classes.of_label(index.into()).unwrap_or_else(|message| {
            unknown.replace(Some(message));
            None
        })
    });
    match unknown.into_inner() {
        Some(message) => Err(FileError::format(&path, message).into()),
        None => Ok(Truth { classes: truth, places: Places::new(size, pillow_nearest) }),
    }
}

/// Counts the prediction in a file.
fn compare(truth: &Truth, file: &Path, classes: &Classes<'_>) -> s3d_dataset::Result<Counted> {
    let places = &truth.places;
    let (size, numbers) = classes.numbers(file, places)?;
    let predicted: Vec<u8> = numbers
        .iter()
        .map(|number| classes.of_number(*number).unwrap_or(u8::MAX))
        .collect();
    let confusion = truth
        .classes
        .compare(&predicted, classes.count)
        .map_err(|at| classes.no_class(file, numbers[at], places.place(size, at)))?;

    let mut cells = vec![0.0; classes.count * classes.count];
    let pixels = truth.classes.classes.iter().zip(predicted);
    for ((truth, predicted), weight) in pixels.zip(weights_of_pixels(PANORAMA)) {
        if let Some(truth) = truth {
            cells[usize::from(*truth) * classes.count + usize::from(predicted)] += weight;
        }
    }
    let counts = confusion.counted();
    let weights = counts.iter().map(|(at, _)| cells[*at as usize]).collect();
    Ok(Counted { counts, weights })
}
