//! Protocol `sem-pano`: classes of panoramas.

use crate::error::{Error, Result};
use crate::images::confusion::Confusion;
use crate::images::panorama::PanoramaClasses;
use crate::images::predictions::{Matched, Predicted, Wanted, find};
use crate::images::read::{self, Places};
use crate::images::resample::pillow_nearest;
use crate::options::ImageKind;
use crate::tables::tables;
use crate::task::Task;
use crate::{ConfusionTable, Evaluation};
use s3d_dataset::DataSet;
use s3d_dataset::parallel::map_in_order;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use s3d_io::image::read_numbers8;
use s3d_label::{LabelId, Taxonomy};
use std::cell::Cell;
use std::fs;
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

/// The file with the class of each number of predictions.
const CLASSES: &str = "classes.txt";

pub(crate) fn sem_pano(task: &Task<'_>) -> Result<Evaluation> {
    if task.options.images == Some(ImageKind::Views) {
        return Err(Error::PanoramasOnly { protocol: task.protocol });
    }
    let Some((taxonomy, table)) = task.data.taxonomy().zip(task.data.labels()?) else {
        return Err(task.unlabelled());
    };
    let classes: Vec<Option<u8>> = (0..table.len())
        .map(|id| table.class_of(LabelId(id as u32)).map(|class| class.index() as u8))
        .collect();
    let meaning = meaning(&task.predictions.join(CLASSES), taxonomy)?;
    let wanted = Wanted {
        domain: Domain::Semantic,
        besides: &[Domain::Rgb],
        kind: Some(ImageKind::Panoramas),
        endings: &["png"],
        known: &[CLASSES],
    };
    let Matched { images, notes, .. } = find(task, &wanted)?;

    let count = taxonomy.classes().len();
    let progress = task.ctx.progress("evaluating", "panoramas", images.len() as u64);
    let units = map_in_order(
        task.ctx,
        &images,
        || (),
        |(), predicted| {
            let truth = truth(task.data, predicted, &classes)?;
            let confusion = compare(&truth, &predicted.file, &meaning, count)?;
            progress.add(1);
            Ok(predicted.unit(confusion.counted()))
        },
    )?;
    drop(progress);

    let sum = |units: &[&Vec<(u32, u32)>]| {
        let mut sum = Confusion::new(count);
        units.iter().for_each(|counted| sum.add_counted(counted));
        sum
    };
    let score = |units: &[&Vec<(u32, u32)>]| {
        let scores = sum(units).scores();
        let of_classes = taxonomy.classes().iter().zip(scores.iou).zip(scores.accuracy);
        of_classes
            .map(|((class, iou), accuracy)| (class.name().to_owned(), vec![iou, accuracy]))
            .chain([("mean".to_owned(), vec![scores.mean_iou, scores.mean_accuracy])])
            .collect()
    };

    let all = sum(&units.iter().map(|unit| &unit.counted).collect::<Vec<_>>());
    let counted = [("panoramas", images.len() as u64), ("pixels", all.pixels())];
    let tables = tables(task, &["IoU", "accuracy"], &units, score);
    let classes = taxonomy.classes().iter().map(|class| class.name().to_owned());
    let confusion = Some(ConfusionTable { classes: classes.collect(), counts: all.rows() });
    Ok(Evaluation { notes, confusion, ..task.evaluation(&DEFINITION, counted, tables) })
}

struct Truth {
    classes: PanoramaClasses,
    places: Places,
}

/// Returns the true classes of a panorama. `classes` has the class of each index.
fn truth(data: &DataSet, predicted: &Predicted, classes: &[Option<u8>]) -> s3d_dataset::Result<Truth> {
    let rgb = read::rgb8(data, &predicted.image, Domain::Rgb)?;
    let semantic = read::rgb8(data, &predicted.image, Domain::Semantic)?;
    let path = predicted.image.path(data.layout(), Domain::Semantic);
    let size = [semantic.width(), semantic.height()];
    if [rgb.width(), rgb.height()] != size {
        return Err(FileError::format(&path, "is of another size than the RGB image of its panorama").into());
    }

    let unknown = Cell::new(None);
    let truth = PanoramaClasses::new(&rgb, &semantic, |index| {
        classes.get(usize::from(index)).copied().unwrap_or_else(|| {
            unknown.set(Some(index));
            None
        })
    });
    match unknown.get() {
        Some(index) => {
            let message = format!("has the index {index}, and there are {} labels", classes.len());
            Err(FileError::format(&path, message).into())
        }
        None => Ok(Truth { classes: truth, places: Places::new(size, pillow_nearest) }),
    }
}

/// Counts the prediction in a file. `meaning` has the class of each number.
fn compare(truth: &Truth, file: &Path, meaning: &[u8], count: usize) -> s3d_dataset::Result<Confusion> {
    let Truth { classes, places } = truth;
    let image = read_numbers8(file)?;
    let size = [image.width(), image.height()];
    read::check_size(file, size, &places.sizes())?;
    let numbers = places.sample_prediction(size, image.into_vec());
    let predicted: Vec<u8> = numbers
        .iter()
        .map(|number| meaning.get(usize::from(*number)).copied().unwrap_or(u8::MAX))
        .collect();
    classes.compare(&predicted, count).map_err(|at| {
        let [x, y] = places.place(size, at);
        let message = format!(
            "has {} in column {x}, row {y}, which is evaluated: numbers of classes are below {}",
            numbers[at],
            meaning.len(),
        );
        FileError::format(file, message).into()
    })
}

/// Returns the class of each number of predictions. A file may list them, one on each line; otherwise they
/// have the order of the taxonomy.
fn meaning(path: &Path, taxonomy: &Taxonomy) -> Result<Vec<u8>> {
    let own: Vec<u8> = (0..taxonomy.classes().len()).map(|index| index as u8).collect();
    if !path.exists() {
        return Ok(own);
    }
    let text = fs::read_to_string(path).map_err(|e| FileError::io(path, "read", e))?;
    let mut meaning: Vec<u8> = Vec::new();
    for (line, name) in (1..).zip(text.lines()) {
        let class = taxonomy
            .class(name.trim())
            .map_err(|e| FileError::line(path, line, e.to_string()))?;
        if meaning.contains(&(class.index() as u8)) {
            return Err(FileError::line(path, line, format!("{class} stands there twice")).into());
        }
        meaning.push(class.index() as u8);
    }
    Ok(meaning)
}
