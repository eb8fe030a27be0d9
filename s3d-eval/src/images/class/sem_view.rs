//! Protocol `sem-view`: classes of views.

use crate::Evaluation;
use crate::error::{Error, Result};
use crate::images::class::classes::{Classes, ENDINGS, LIST};
use crate::images::class::confusion::Confusion;
use crate::images::predictions::{Matched, Wanted, find};
use crate::options::ImageKind;
use crate::tables::tables;
use crate::task::Task;
use s3d_io::dataset::Domain;

const DEFINITION: [&str; 5] = [
    "Views are evaluated at their own size, at the pixels that have a label.",
    "Each fold has one confusion matrix, of the pixels of all its views.",
    "IoU is intersection over union; accuracy is the share of a class's true pixels that were found. A class \
     that neither side has is undefined, and so is the accuracy of a class that only predictions have, whose \
     IoU is 0. The row `mean` (mIoU, mean accuracy) leaves out what is undefined.",
    "The row `overall` has the frequency-weighted IoU, in which each class counts its true pixels, and the \
     pixel accuracy, the share of all pixels whose class was found.",
    "As in CMX's utils/metric.py (commit e251d860).",
];

pub(crate) fn sem_view(task: &Task<'_>) -> Result<Evaluation> {
    if task.options.images == Some(ImageKind::Panoramas) {
        return Err(Error::ViewsOnly { protocol: task.protocol });
    }
    let classes = Classes::of(task)?;
    let wanted = Wanted {
        domain: Domain::Semantic,
        besides: &[],
        kind: Some(ImageKind::Views),
        other_kind: "sem-pano evaluates panoramas",
        endings: &ENDINGS,
        known: &[LIST],
    };
    let matched = find(task, &wanted)?;

    let units = matched.count(task, |predicted| {
        let mut confusion = Confusion::new(classes.count);
        classes.pair(task.data, predicted, |pair| {
            if let Some([truth, guess]) = pair {
                confusion.count(truth.into(), guess.into());
            }
        })?;
        Ok(confusion.counted())
    })?;
    let Matched { images, notes, .. } = matched;

    let tables = tables(task, &["IoU", "accuracy"], &units, |units| {
        let scores = classes.sum(units.iter().copied()).view_scores();
        let by_class = scores.iou.into_iter().zip(scores.accuracy);
        let mut rows = classes.rows(by_class.map(|(iou, accuracy)| vec![iou, accuracy]));
        rows.push(("mean".to_owned(), vec![scores.mean_iou, scores.mean_accuracy]));
        rows.push(("overall".to_owned(), vec![scores.weighted_iou, scores.pixel_accuracy]));
        rows
    });
    let all = classes.sum(units.iter().map(|unit| &unit.counted));
    let counted = [("views", images.len() as u64), ("pixels", all.pixels())];
    Ok(Evaluation {
        notes,
        confusion: Some(classes.table(&all)),
        ..task.evaluation(&DEFINITION, counted, tables)
    })
}
