//! Protocol `panoptic`: counts images on all threads, then scores classes.

use super::counts::{ClassCounts, PanopticCounts, PanopticScore, Segment, mean};
use super::predictions::{Predicted, Predictions, key};
use crate::Evaluation;
use crate::error::{ClassOption, Error, Result};
use crate::tables::{Rows, Unit, tables};
use crate::task::Task;
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::s3d_io::Error as FileError;
use s3d_dataset::s3d_io::dataset::{DatasetImage, Domain, Frame};
use s3d_dataset::s3d_io::image::{decode_rgb8, read_rgb8};
use s3d_dataset::s3d_io::package::coco_panoptic;
use s3d_dataset::s3d_label::{Class, LabelTable, Taxonomy};
use s3d_geom::Raster;
use std::collections::BTreeSet;

pub(crate) const COLUMNS: [&str; 3] = ["PQ", "SQ", "RQ"];

/// The pixel of a semantic image that shows no surface. Source: [`s3d_io::formats`], "What is written".
const MISSING: [u8; 3] = [13; 3];

const DEFINITION: [&str; 5] = [
    "A true and a predicted segment of a class match if their IoU is more than 1/2. Pixels of the predicted \
     segment that are void in the truth do not count in the union.",
    "A true segment without a match is missed. A predicted segment without a match is invented, unless more \
     than half of its pixels are void in the truth.",
    "SQ is the mean IoU of matched segments; RQ = matched / (matched + invented / 2 + missed / 2); PQ = SQ \
     · RQ. Each is a share of 1, over the segments of all images.",
    "A class without segments on either side has no scores and is left out of means.",
    "As in panopticapi 7bb4655 (panopticapi/evaluation.py), which prints 0 for such classes.",
];

/// The truth of all images.
struct Truth<'a> {
    task: &'a Task<'a>,
    table: LabelTable,
    stuff: Vec<Class>,
    /// The areas and cameras of photographs that do not fill their images.
    masked: BTreeSet<(u32, String)>,
}

/// Evaluates the panoptic segmentation of images.
pub(crate) fn panoptic(task: &Task<'_>) -> Result<Evaluation> {
    let truth = Truth::new(task)?;
    let taxonomy = truth.table.taxonomy();
    let mut predictions = Predictions::read(task.predictions, taxonomy, &truth.stuff)?;
    let (images, mut notes) = images(task, &mut predictions)?;

    let progress = task.ctx.progress("evaluate", "images", images.len() as u64);
    let counts = map_in_order(
        task.ctx,
        &images,
        || (),
        |(), (fold, image, predicted)| {
            let counts = truth.hold(image, predicted, &predictions)?;
            progress.add(1);
            Ok(Unit { fold: *fold, area: image.area, name: image.stem(), counted: counts })
        },
    )?;
    drop(progress);

    let classes = taxonomy.classes();
    let tables = tables(task, &COLUMNS, &counts, |images| rows_of_panoptic(images, classes, &truth.stuff));

    let but = match &*names_of(&truth.stuff) {
        "" => String::new(),
        stuff => format!("; each stuff class ({stuff}) has one segment in an image"),
    };
    let source = format!(
        "Truth: the labels of semantic images. Each instance is a segment{but}. Pixels without a label, or \
         outside of the photograph, are void."
    );
    let mut definition: Vec<&str> = vec![&source];
    definition.extend(DEFINITION);

    if let Some((first, count)) = predictions.unlisted {
        notes.push(format!("{count} images that are not listed were passed over, as {first}."));
    }
    let panoramas = images
        .iter()
        .filter(|(_, image, _)| image.frame == Frame::Panorama)
        .count() as u64;
    let counted = [("panoramas", panoramas), ("views", images.len() as u64 - panoramas)];
    Ok(Evaluation { notes, ..task.evaluation(&definition, counted, tables) })
}

/// Lists classes by name.
pub(crate) fn names_of(of: &[Class]) -> String {
    of.iter().map(|class| class.name()).collect::<Vec<_>>().join(", ")
}

/// The fold, the image and the prediction of an image that is evaluated.
type Job = (usize, DatasetImage, Predicted);

/// Returns the images of all folds, of the kinds that are predicted, and notes.
fn images(task: &Task<'_>, predictions: &mut Predictions) -> Result<(Vec<Job>, Vec<String>)> {
    let mut there = Vec::new();
    for (fold, areas) in task.folds.iter().enumerate() {
        let of_areas = areas.areas.iter().flat_map(|area| task.data.images(*area));
        there.extend(
            of_areas
                .filter(|image| image.has(Domain::Semantic))
                .map(|image| (fold, image)),
        );
    }

    let mut jobs = Vec::new();
    let mut missing = Vec::new();
    for (fold, image) in there {
        match predictions.of_images.remove(&key(&image)) {
            Some(predicted) => jobs.push((fold, image, predicted)),
            None => missing.push(image),
        }
    }

    let wrong = |message| Error::from(FileError::format(&predictions.json, message));
    let kinds: BTreeSet<bool> = jobs.iter().map(|(_, image, _)| is_panorama(image)).collect();
    missing.retain(|image| kinds.contains(&is_panorama(image)));
    if let Some(first) = missing.first() {
        return Err(wrong(format!(
            "has no prediction of {} of {} images of the areas and the kind that it is of, as {}",
            missing.len(),
            missing.len() + jobs.len(),
            first.relative_path(Domain::Rgb)
        )));
    }

    // All other predictions must be of other areas.
    let others = task.data.areas().iter().flat_map(|area| task.data.images(*area));
    let known: BTreeSet<_> = others
        .filter(|image| image.has(Domain::Semantic))
        .map(|i| key(&i))
        .collect();
    if let Some((_, predicted)) = predictions.of_images.iter().find(|(key, _)| !known.contains(key)) {
        let png = predicted.png.display();
        return Err(wrong(format!("the data set has no semantic image for {png}")));
    }
    if jobs.is_empty() {
        return Err(wrong("has no prediction of an image of the areas that are tested".to_owned()));
    }
    let count = predictions.of_images.len();
    let notes = (count > 0).then(|| format!("{count} predictions are of areas that are not tested."));
    Ok((jobs, notes.into_iter().collect()))
}

fn is_panorama(image: &DatasetImage) -> bool {
    image.frame == Frame::Panorama
}

impl<'a> Truth<'a> {
    fn new(task: &'a Task<'a>) -> Result<Self> {
        let Some(table) = task.data.labels()? else { return Err(task.unlabelled()) };
        let taxonomy = table.taxonomy();
        let stuff = stuff_of(task, taxonomy)?;

        let mut masked = BTreeSet::new();
        for area in task.folds.iter().flat_map(|fold| &fold.areas) {
            let photographs = task.data.photographs(*area)?.into_iter();
            masked.extend(photographs.filter(|p| p.masked > 0.0).map(|p| (*area, p.camera_uuid)));
        }
        Ok(Self { task, table, stuff, masked })
    }

    /// Reads the semantic image, with void where the photograph does not show it, like in the COCO package.
    fn semantic(&self, image: &DatasetImage) -> s3d_dataset::Result<Raster<[u8; 3]>> {
        let read = |domain| {
            let path = image.path(self.task.data.layout(), domain);
            Ok::<_, s3d_dataset::Error>(decode_rgb8(&self.task.data.read(&path)?, &path)?)
        };
        let mut semantic = read(Domain::Semantic)?;
        if image.frame == Frame::View(0) && self.masked.contains(&(image.area, image.uuid.clone())) {
            let color = read(Domain::Rgb)?;
            let pairs = semantic.pixels_mut().iter_mut().zip(color.pixels());
            pairs
                .filter(|(_, color)| **color == [0; 3])
                .for_each(|(label, _)| *label = MISSING);
        }
        Ok(semantic)
    }

    /// Counts an image.
    fn hold(
        &self,
        image: &DatasetImage,
        predicted: &Predicted,
        predictions: &Predictions,
    ) -> s3d_dataset::Result<PanopticCounts> {
        let taxonomy = self.table.taxonomy();
        let path = image.path(self.task.data.layout(), Domain::Semantic);
        let (panoptic, segments) = coco_panoptic(&self.semantic(image)?, &self.table, &self.stuff)
            .map_err(|e| FileError::format(&path, e.to_string()))?;
        let segments: Vec<Segment> = segments
            .iter()
            .filter_map(|s| Some(Segment { id: s.id, class: class_of(s.category_id, taxonomy)? }))
            .collect();

        let found = predicted.segments.iter().map(|s| {
            let class = class_of(s.category_id, taxonomy).ok_or_else(|| {
                let png = predicted.png.display();
                let message = format!(
                    "segment {} of {png} is of category {}, which the data set has not",
                    s.id, s.category_id
                );
                FileError::format(&predictions.json, message)
            })?;
            Ok(Segment { id: s.id, class })
        });
        let found: Vec<Segment> = found.collect::<Result<_, FileError>>()?;
        let png = read_rgb8(&predicted.png)?;
        let [size, due] = [&png, &panoptic].map(|image| [image.width(), image.height()]);
        let wrong = |message: String| FileError::format(&predicted.png, message);
        if size != due {
            let message = format!(
                "{} × {} pixels, and the data set's image has {} × {}",
                size[0], size[1], due[0], due[1]
            );
            return Err(wrong(message).into());
        }

        let mut counts = PanopticCounts::new(taxonomy.classes().len());
        counts
            .add(&ids(&panoptic), &segments, &ids(&png), &found)
            .map_err(|e| wrong(format!("{e} (segments are listed in {})", predictions.json.display())))?;
        Ok(counts)
    }
}

fn class_of(id: u32, taxonomy: &Taxonomy) -> Option<usize> {
    taxonomy.classes().iter().position(|class| taxonomy.id(*class) == id)
}

/// Returns the number of the segment of each pixel.
fn ids(image: &Raster<[u8; 3]>) -> Vec<u32> {
    image
        .pixels()
        .iter()
        .map(|[r, g, b]| u32::from_le_bytes([*r, *g, *b, 0]))
        .collect()
}

/// Returns the stuff classes: those that the option names, in their order and once each, or the taxonomy's.
pub(crate) fn stuff_of(task: &Task<'_>, taxonomy: &Taxonomy) -> Result<Vec<Class>> {
    let Some(list) = &task.options.stuff else {
        let classes = taxonomy.classes().iter().copied();
        return Ok(classes.filter(|class| taxonomy.is_stuff(*class)).collect());
    };
    let mut classes = list
        .0
        .iter()
        .map(|name| {
            taxonomy
                .class(name)
                .map_err(|e| Error::Classes { option: ClassOption::Stuff, fault: e.into() })
        })
        .collect::<Result<Vec<_>>>()?;
    classes.sort_unstable();
    classes.dedup();
    Ok(classes)
}

/// Returns the rows of classes, then the means over things, stuff and all.
pub(crate) fn rows_of_panoptic(images: &[&PanopticCounts], classes: &[Class], stuff: &[Class]) -> Rows {
    let mut sum = PanopticCounts::new(classes.len());
    images.iter().for_each(|counts| sum.add_counts(counts));
    let counts = classes.iter().zip(sum.classes());
    let mut rows: Rows = counts
        .clone()
        .map(|(class, of)| row(class.name(), of.score()))
        .collect();

    let of_kind = |is_stuff: bool| {
        let of = counts.clone().filter(|(class, _)| stuff.contains(class) == is_stuff);
        mean(of.map(|(_, counts)| counts).collect::<Vec<&ClassCounts>>())
    };
    rows.push(row("mean of things", of_kind(false)));
    rows.push(row("mean of stuff", of_kind(true)));
    rows.push(row("mean", mean(sum.classes())));
    rows
}

fn row(name: &str, score: PanopticScore) -> (String, Vec<f64>) {
    (name.to_owned(), vec![score.pq, score.sq, score.rq])
}
