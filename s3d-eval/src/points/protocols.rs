//! Protocols `sem3d`, `inst-ap`, `inst-cov` and `panoptic3d`: they count rooms on all threads, then score
//! classes.

use super::CLASSES;
use super::coverage::{CoverageScores, RoomCoverage, coverage};
use super::find::{LIST, find, wrong};
use super::instances::{labelled, scored, segments};
use super::labels::for_each_run;
use super::panoptic::panoptic_counts;
use super::precision::{InstanceMatches, instance_ap};
use super::semantic::{AbsentClass, SemanticCounts, nan_mean};
use super::truth::{Points, Room};
use crate::error::Result;
use crate::panoptic::{COLUMNS, ClassCounts, names_of, rows_of_panoptic, stuff_of};
use crate::tables::{Rows, Scores, Unit, tables};
use crate::task::Task;
use crate::{ConfusionTable, Evaluation, hints};
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::s3d_label::{Class, Taxonomy};
use std::path::Path;

const TRUTH: &str = "The points of a room come from its files s3dis/Area_k/ROOM/Annotations/CLASS_N.txt, \
                     sorted by name as strings, as `s3d profile` gives them to trainers.";
const OF_CLASSES: &str = "Classes are the 13 of S3DIS. A class of another taxonomy is replaced by the S3DIS \
                          class that it counts as.";

/// The results of all rooms, and notes.
struct Counted<T> {
    rooms: Vec<Unit<T>>,
    points: u64,
    notes: Vec<String>,
}

/// Calls `work` with the prediction of each room.
fn count<T: Send + Sync>(
    task: &Task<'_>,
    endings: &[&str],
    work: impl Fn(&Path, &Room, &Points) -> s3d_dataset::Result<T> + Sync,
) -> Result<Counted<T>> {
    let rooms = Room::all(task)?;
    let (paths, notes) = find(task, &rooms, endings)?;

    let progress = task.ctx.progress("evaluate", "rooms", rooms.len() as u64);
    let jobs: Vec<_> = rooms.iter().zip(&paths).collect();
    let results = map_in_order(
        task.ctx,
        &jobs,
        || (),
        |(), (room, path)| {
            let points = room.points(task)?;
            let result = work(path, room, &points)?;
            progress.add(1);
            Ok((points.count(), room.unit(result)))
        },
    )?;
    let points = results.iter().map(|(points, _)| points).sum();
    let rooms = results.into_iter().map(|(_, room)| room).collect();
    Ok(Counted { rooms, points, notes })
}

impl<T> Counted<T> {
    /// Adds a note if nothing, or a single class, is predicted. `totals` has how many of `noun` each class
    /// has in a room, in the truth and predicted.
    fn note_classes(&mut self, noun: &str, totals: impl Fn(&T) -> Vec<[u64; 2]>) {
        let mut sums = vec![[0; 2]; CLASSES];
        for room in &self.rooms {
            let of_classes = sums
                .iter_mut()
                .flatten()
                .zip(totals(&room.counted).into_iter().flatten());
            of_classes.for_each(|(sum, count)| *sum += count);
        }
        self.notes.extend(hints::of_classes(noun, &sums));
    }

    fn evaluation(self, task: &Task<'_>, definition: &[&str], scores: Scores) -> Evaluation {
        let definition = [definition, &[TRUTH, OF_CLASSES]].concat();
        let counted = [("rooms", self.rooms.len() as u64), ("points", self.points)];
        Evaluation { notes: self.notes, ..task.evaluation(&definition, counted, scores) }
    }
}

/// The rows of classes, then others.
fn rows<const N: usize>(
    classes: impl IntoIterator<Item = [f64; N]>,
    others: impl IntoIterator<Item = (&'static str, [f64; N])>,
) -> Rows {
    let classes = Class::S3DIS.into_iter().map(Class::name).zip(classes);
    classes
        .chain(others)
        .map(|(name, scores)| (name.to_owned(), scores.to_vec()))
        .collect()
}

/// Semantic segmentation of points.
pub(crate) fn sem3d(task: &Task<'_>) -> Result<Evaluation> {
    let mut counted = count(task, &["npy", "npz"], |path, room, points| {
        let mut counts = SemanticCounts::new(CLASSES);
        for_each_run(path, room, points, task.ctx, |instance, labels| {
            counts.add_run(instance.class, labels)
        })?;
        Ok(counts)
    })?;
    counted.note_classes("points", |of| {
        let sides = of.truth().into_iter().zip(of.predicted());
        sides.map(|(truth, predicted)| [truth, predicted]).collect()
    });

    let (absent, of_absent) = match task.variant {
        "nanmean" => (
            AbsentClass::LeftOut,
            "A class on neither side is left out of mIoU, and a class that the truth lacks is left out of \
             mAcc, as in mmdetection3d fe25f7a (seg_eval.py) and Open3D-ML 5e81f52 (semseg_metric.py).",
        ),
        _ => (
            AbsentClass::Zero,
            "1e-10 is added to every denominator, so a class on neither side counts as 0 in mIoU and mAcc, \
             as in Pointcept d74c646 (engines/test.py, tools/test_s3dis_6fold.py).",
        ),
    };

    let tables = tables(task, &["IoU", "accuracy"], &counted.rooms, |rooms| {
        let scores = SemanticCounts::sum(CLASSES, rooms.iter().copied()).scores(absent);
        let classes = scores
            .iou
            .iter()
            .zip(&scores.accuracy)
            .map(|(iou, accuracy)| [*iou, *accuracy]);
        let mean = [scores.mean_iou, scores.mean_accuracy];
        rows(classes, [("mean", mean), ("overall", [f64::NAN, scores.overall_accuracy])])
    });

    let definition = [
        "Points are counted by class and summed over rooms: true points, predicted points, and points that \
         are both.",
        "IoU = both / (truth + predicted - both); accuracy = both / truth; overall accuracy = right points \
         / all.",
        "mIoU and mAcc (the row mean) are means over classes.",
        of_absent,
        "A point predicted as -1 is wrong and belongs to no class.",
    ];
    let sum = SemanticCounts::sum(CLASSES, counted.rooms.iter().map(|room| &room.counted));
    let classes = Class::S3DIS.map(|class| class.name().to_owned()).to_vec();
    let confusion = Some(ConfusionTable { classes, counts: sum.rows() });
    Ok(Evaluation { confusion, ..counted.evaluation(task, &definition, tables) })
}

/// Average precision of instances of points.
pub(crate) fn inst_ap(task: &Task<'_>) -> Result<Evaluation> {
    let mut counted = count(task, &["npz", LIST], |path, room, points| {
        let (truth, predicted) = scored(path, room, points, task.ctx)?;
        Ok(InstanceMatches::new(&truth, &predicted, CLASSES))
    })?;
    counted.note_classes("instances of 100 points or more", InstanceMatches::totals);

    let tables = tables(task, &["AP", "AP50", "AP25"], &counted.rooms, |rooms| {
        let mut ap = instance_ap(rooms);
        // There are no classes if no room of a fold was drawn.
        ap.by_class.resize(CLASSES, [f64::NAN; 3]);
        rows(ap.by_class, [("mean", ap.mean)])
    });

    let definition = [
        "Instances of fewer than 100 points do not count on either side.",
        "True instances are matched in their order. Each takes the first free prediction of its class with \
         an IoU greater than the threshold. For each further such prediction, the one of the two with the \
         lower score is wrong.",
        "A prediction without a true instance above the threshold is wrong, unless the share of its points \
         that are void, or belong to true instances of its class that are too small, is greater than the \
         threshold. S3DIS's points are never void.",
        "Predictions of all rooms are sorted by score, equal scores together. The area below precision over \
         recall is a sum of trapezoids, from precision 1 at recall 0.",
        "AP is the mean over IoU .50 to .90 in steps of .05 (nine thresholds: .95 is not among them). AP50 \
         and AP25 are the areas at .50 and .25.",
        "A class without a true instance that counts is not defined and left out of the mean. A class \
         without predictions has 0.",
        "Source: Pointcept d74c646, engines/hooks/evaluator.py (InsSegEvaluator), after ScanNet's script.",
    ];
    Ok(counted.evaluation(task, &definition, tables))
}

/// Coverage of instances of points.
pub(crate) fn inst_cov(task: &Task<'_>) -> Result<Evaluation> {
    let mut counted = count(task, &["npz"], |path, room, points| {
        let (truth, predicted) = segments(path, room, points, task.ctx)?;
        Ok(RoomCoverage::new(&truth, &predicted, CLASSES))
    })?;
    counted.note_classes("instances", RoomCoverage::totals);

    let columns = ["precision", "recall", "coverage", "weighted coverage"];
    let tables = tables(task, &columns, &counted.rooms, |rooms| {
        let mut classes: Vec<_> = coverage(rooms).into_iter().map(CoverageScores::to_array).collect();
        // There are no classes if no room of a fold was drawn.
        classes.resize(CLASSES, [f64::NAN; 4]);
        let mean =
            std::array::from_fn(|i| classes.iter().map(|class| class[i]).sum::<f64>() / CLASSES as f64);
        let defined = std::array::from_fn(|i| nan_mean(classes.iter().map(|class| class[i])));
        rows(classes, [("mean", mean), ("mean where defined", defined)])
    });

    let definition = [
        "The class of a predicted instance is the class of most of its points, in a tie the lowest number. \
         Points of instance -1 are in no instance.",
        "A prediction is right if its largest IoU with a true instance of its class is 0.5 or more; several \
         predictions may be right by the same instance. Precision = right / predicted, recall = right / \
         true, over all rooms.",
        "The coverage of a room is the mean, over its true instances, of the largest IoU with a prediction \
         of their class; for weighted coverage, instances are weighted by their points. The score is the \
         mean over rooms with such instances.",
        "mPrec, mRec, mCov and mWCov (the row mean) are means over the 13 classes. They are not defined if a \
         class is not; the row below leaves such classes out.",
        "Source: ASIS d71c3d6, models/ASIS/eval_iou_accuracy.py, on all points of a room, each once.",
    ];
    Ok(counted.evaluation(task, &definition, tables))
}

/// Panoptic quality of points.
pub(crate) fn panoptic3d(task: &Task<'_>) -> Result<Evaluation> {
    let stuff = stuff_of(task, &Taxonomy::s3dis())?;
    let of_stuff: Vec<usize> = stuff.iter().map(|class| class.index()).collect();
    let mut counted = count(task, &["npz"], |path, room, points| {
        let (truth, predicted) = labelled(path, room, points, task.ctx)?;
        let truth = (0..).zip(&truth).flat_map(|(instance, of)| {
            std::iter::repeat_n((of.class as i64, instance), usize::try_from(of.points).unwrap_or(usize::MAX))
        });
        panoptic_counts(truth, predicted, &of_stuff, CLASSES).map_err(|e| wrong(path, e.to_string()))
    })?;
    counted.note_classes("segments", |of| {
        let total = |class: &ClassCounts| [class.missed, class.invented].map(|count| class.matched + count);
        of.classes().iter().map(total).collect()
    });

    let tables =
        tables(task, &COLUMNS, &counted.rooms, |rooms| rows_of_panoptic(rooms, &Class::S3DIS, &stuff));

    let source = match &*names_of(&stuff) {
        "" => "Each instance of a room is a segment.".to_owned(),
        stuff => {
            format!("Each instance of a room is a segment; each stuff class ({stuff}) has one in a room.")
        }
    };
    let definition = [
        &source,
        "A predicted point of a stuff class belongs to the segment of its class, whatever its instance. The \
         other points of an instance are a segment with the class of most of them, in a tie the lowest \
         number. Points without a class, and of things without an instance, are in no segment.",
        "A true and a predicted segment of a class match if their IoU is more than 1/2, over all points of a \
         room. No segment is too small to count.",
        "SQ is the mean IoU of matched segments; RQ = matched / (matched + invented / 2 + missed / 2); PQ = \
         SQ · RQ. Each is a share of 1, over the segments of all rooms.",
        "A class without segments on either side has no scores and is left out of means.",
        "As in superpoint_transformer eb959b6 (src/metrics/panoptic.py, PanopticQuality3D), room by room.",
    ];
    Ok(counted.evaluation(task, &definition, tables))
}
