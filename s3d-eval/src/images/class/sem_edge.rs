//! Protocol `sem-edge`: boundaries of classes.

use crate::Evaluation;
use crate::error::Result;
use crate::images::class::classes::{Classes, ENDINGS, LIST};
use crate::images::class::outline_metrics::class_outlines;
use crate::images::predictions::{Matched, Predicted, Wanted, find};
use crate::tables::{Rows, mean_of_defined, tables};
use crate::task::Task;
use s3d_io::dataset::Domain;

const DEFINITION: [&str; 5] = [
    "Images are evaluated at their own size, at the pixels that have a label. The others have no class on \
     either side.",
    "A pixel is on the boundary of a class if it has the class and one of its neighbours at the right, \
     below, and below at the right has not, or the other way round.",
    "A predicted boundary pixel is right if the truth has one of the class at most ⌈0.008 · diagonal⌉ \
     pixels away; a true one is found in the same way. Precision and recall are shares of these; F is their \
     harmonic mean. If only one side has boundaries, F is 0; if neither has, 1.",
    "Scores of a class are means over the images in which truth or prediction has it; the row `mean` is over \
     classes.",
    "F is as in DAVIS 2017's metrics.py (commit ac7c43fc), db_eval_boundary, of the mask of each class.",
];

/// The scores of the classes that an image has.
type Scores = Vec<(u8, [f64; 3])>;

pub(crate) fn sem_edge(task: &Task<'_>) -> Result<Evaluation> {
    let classes = Classes::of(task)?;
    let wanted = Wanted {
        domain: Domain::Semantic,
        besides: &[],
        kind: task.options.images,
        other_kind: "",
        endings: &ENDINGS,
        known: &[LIST],
    };
    let matched = find(task, &wanted)?;

    let units = matched.count(task, |predicted| compare(task, predicted, &classes))?;
    let Matched { images, kind, notes } = matched;

    let columns = ["F", "precision", "recall"];
    let tables = tables(task, &columns, &units, |units| rows(&classes, units));
    let counted = [(kind.noun(), images.len() as u64)];
    Ok(Evaluation { notes, ..task.evaluation(&DEFINITION, counted, tables) })
}

fn rows(classes: &Classes<'_>, units: &[&Scores]) -> Rows {
    let mut sums = vec![([0.0; 3], 0.0); classes.count];
    for (class, scores) in units.iter().copied().flatten() {
        let (sum, count) = &mut sums[usize::from(*class)];
        sum.iter_mut().zip(scores).for_each(|(sum, score)| *sum += score);
        *count += 1.0;
    }
    let means: Vec<[f64; 3]> = sums
        .into_iter()
        .map(|(sum, count)| sum.map(|sum| sum / count))
        .collect();
    let over_classes = [0, 1, 2].map(|at| mean_of_defined(means.iter().map(|mean| mean[at])));
    let mut rows = classes.rows(means.into_iter().map(|mean| mean.to_vec()));
    rows.push(("mean".to_owned(), over_classes.to_vec()));
    rows
}

fn compare(task: &Task<'_>, predicted: &Predicted, classes: &Classes<'_>) -> s3d_dataset::Result<Scores> {
    let mut truth = Vec::new();
    let mut guesses = Vec::new();
    let size = classes.pair(task.data, predicted, |pair| {
        truth.push(pair.map(|[class, _]| class));
        guesses.push(pair.map(|[_, guess]| guess));
    })?;
    Ok(class_outlines(&truth, &guesses, size))
}
