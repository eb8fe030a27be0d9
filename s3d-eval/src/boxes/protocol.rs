//! Protocol `det`: judges rooms in parallel, then scores classes over rooms.

use super::precision::{ClassScore, mean};
use super::predictions::Predictions;
use super::room::{Verdict, verdicts};
use super::truth::{Classes, Room, Rooms, rooms};
use super::{Bbox, Detection, GroundTruth, Rule, ScoredBox, average_precision};
use crate::error::Result;
use crate::tables::{Rows, Unit, tables};
use crate::task::Task;
use crate::{Evaluation, Fold, hints};
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::s3d_label::Class;

/// The thresholds of the IoU.
const THRESHOLDS: [f64; 2] = [0.25, 0.5];
/// The names of the columns.
const COLUMNS: [&str; 4] = ["AP@0.25", "AR@0.25", "AP@0.50", "AR@0.50"];

const MMDETECTION3D: [&str; 5] = [
    "Detections of all rooms are pooled by class and sorted by score, the highest first. In a tie, rooms \
     come by area, type and number, and detections of a room in the order of the predictions. Each detection \
     is compared with the box of its class in its room with which its IoU is largest. It is true if that IoU \
     is more than the threshold, 0.25 or 0.50, and no detection before it was true by this box.",
    "AP is the area under precision over recall; each precision is the largest at that recall or more. AR is \
     the recall of all detections.",
    "A class of the truth without detections has AP 0. A class in neither is left out of means. For a class \
     that is only detected, AP, AR and their means are not defined.",
    "Widths in x and y of less than 0.1 mm count as 0.1 mm in the volume that two boxes share, but not in \
     the volume of each. IoU is divided by at least 1e-8 m³: a box that is flat in z is never found.",
    "As in mmdetection3d fe25f7a (mmdet3d/evaluation/functional/indoor_eval.py), but in 64 bits throughout.",
];

const OPEN3D_ML: [&str; 4] = [
    "A detection is true if its IoU with a box of its class in its room is at least the threshold, 0.25 or \
     0.50, and it has the largest IoU for that or another box, whatever its score; in a tie, the first of \
     the predictions has it. A detection whose IoU with a box is not defined, since both are flat, counts as \
     neither.",
    "AP: precision is taken at the scores of at most 41 true detections, the nearest to even steps of \
     recall, and raised to the largest precision at that recall or more. AP is the mean of every fourth of \
     41, or of all if there are fewer: a low recall does not lower it. AR is not defined.",
    "A class without true detections has AP 0, whether it is in the truth or not, and counts in means.",
    "As in Open3D-ML 5e81f52 (ml3d/metrics/mAP.py, boxes in 3D), but in 64 bits throughout, and as a share \
     of 1 instead of 100.",
];

/// The boxes of a class in a room.
struct OfClass {
    /// The number of true boxes.
    truth: u64,
    /// The score of each detection, and its verdict at each threshold.
    judged: Vec<(f64, Vec<Verdict>)>,
}

/// Evaluates detections as boxes.
pub(crate) fn det(task: &Task<'_>) -> Result<Evaluation> {
    let rule = if task.variant == "open3d-ml" {
        Rule::Open3dMl
    } else {
        Rule::Mmdetection3d
    };
    let classes = Classes::new(task)?;
    let Rooms { list: rooms, has_point_boxes } = rooms(task, &classes)?;
    let Predictions { of_rooms, mut notes } = Predictions::read(task, &classes, &rooms)?;

    let progress = task.ctx.progress("evaluate", "rooms", rooms.len() as u64);
    let jobs: Vec<_> = rooms.iter().zip(&of_rooms).collect();
    let judged = map_in_order(
        task.ctx,
        &jobs,
        || (),
        |(), (room, found)| {
            let of_classes: Vec<OfClass> = classes
                .list
                .iter()
                .map(|class| OfClass::judge(room, found, *class, rule))
                .collect();
            progress.add(1);
            Ok(Unit { fold: room.fold, area: room.area, name: room.name.clone(), counted: of_classes })
        },
    )?;
    drop(progress);

    let columns: Vec<&str> = match rule {
        Rule::Mmdetection3d => COLUMNS.to_vec(),
        Rule::Open3dMl => vec![COLUMNS[0], COLUMNS[2]],
    };
    let tables = tables(task, &columns, &judged, |rooms| rows(rooms, &classes.list, rule));

    let of_rule = if rule == Rule::Mmdetection3d {
        &MMDETECTION3D[..]
    } else {
        &OPEN3D_ML
    };
    let source = task.options.boxes.unwrap_or_default();
    let truth = format!(
        "Truth: the box along the world axes of each instance's {}, for {}.{}",
        source.words(),
        classes.names(),
        if task.options.classes.is_none() {
            " A class of another taxonomy is replaced by the S3DIS class that it counts as."
        } else {
            ""
        }
    );
    let mut definition: Vec<&str> = vec![&truth];
    definition.extend(of_rule);

    let boxes = rooms.iter().flat_map(|room| &room.boxes);
    let flat = boxes.clone().filter(|(_, b)| (0..3).any(|k| b[k + 3] <= b[k])).count();
    if flat > 0 {
        notes.push(format!("{flat} boxes of the truth are flat: see the definition for what that means."));
    }
    if has_point_boxes {
        let [quarter, half] = ceiling(&rooms, &classes.list, rule);
        notes.push(format!(
            "Perfect boxes of the {} would reach a mean AP of {quarter:.3} at 0.25 and {half:.3} at 0.50 \
             here.",
            source.other().words()
        ));
    }
    if rule == Rule::Mmdetection3d {
        notes.extend(invented(task.folds, &judged, &classes.list));
    }
    let sides = rooms
        .iter()
        .zip(&of_rooms)
        .map(|(room, found)| (room.boxes.iter().map(|b| b.1).collect(), found.iter().map(|b| b.2).collect()));
    notes.extend(hints::of_boxes(&sides.collect::<Vec<_>>()));
    let detections = of_rooms.iter().map(|found| found.len() as u64).sum();
    let counted =
        [("rooms", rooms.len() as u64), ("boxes", boxes.count() as u64), ("detections", detections)];
    Ok(Evaluation { notes, ..task.evaluation(&definition, counted, tables) })
}

impl OfClass {
    /// Judges the detections of a class in a room.
    fn judge(room: &Room, found: &[(f64, Class, Bbox)], class: Class, rule: Rule) -> Self {
        let truth: Vec<Bbox> = room
            .boxes
            .iter()
            .filter(|(c, _)| *c == class)
            .map(|(_, bbox)| *bbox)
            .collect();
        let found: Vec<ScoredBox> = found
            .iter()
            .filter(|(_, c, _)| *c == class)
            .map(|(score, _, bbox)| (*score, *bbox))
            .collect();
        let verdicts = verdicts(&truth, &found, &THRESHOLDS, rule);
        let judged = found.iter().map(|(score, _)| *score).zip(verdicts).collect();
        Self { truth: truth.len() as u64, judged }
    }
}

/// Returns the mean average precision, at each threshold, of detections that are the boxes of the other
/// source. Classes without true boxes do not count.
fn ceiling(rooms: &[Room], classes: &[Class], rule: Rule) -> [f64; 2] {
    let of_boxes = |boxes: fn(&Room) -> &[(Class, Bbox)]| {
        (0u32..).zip(rooms).flat_map(move |(number, room)| {
            boxes(room).iter().map(move |(class, bbox)| (number, *class, *bbox))
        })
    };
    let truth: Vec<GroundTruth> = of_boxes(|room| &room.boxes)
        .map(|(room, class, bbox)| GroundTruth { room, class, bbox })
        .collect();
    let found: Vec<Detection> = of_boxes(|room| &room.other_boxes)
        .map(|(room, class, bbox)| Detection { room, class, score: 1.0, bbox })
        .collect();
    let there: Vec<Class> = classes
        .iter()
        .copied()
        .filter(|class| truth.iter().any(|t| t.class == *class))
        .collect();
    THRESHOLDS.map(|threshold| mean(&average_precision(&truth, &found, &there, threshold, rule), rule).0)
}

/// Returns a note on the classes that are detected in a fold without true boxes of them.
fn invented(folds: &[Fold], rooms: &[Unit<Vec<OfClass>>], classes: &[Class]) -> Option<String> {
    let names: Vec<String> = folds
        .iter()
        .enumerate()
        .flat_map(|(i, fold)| {
            let of_fold = rooms
                .iter()
                .filter(move |room| room.fold == i)
                .map(|room| &room.counted);
            let names = (0..classes.len())
                .filter(|class| {
                    let of_class = of_fold.clone().map(|of| &of[*class]);
                    of_class.clone().all(|of| of.truth == 0)
                        && of_class.clone().any(|of| !of.judged.is_empty())
                })
                .map(|class| classes[class].name());
            names.map(|name| format!("{name} in {}", fold.name)).collect::<Vec<_>>()
        })
        .collect();
    let told = "Detected, but not in the truth, so that means are not defined there";
    (!names.is_empty()).then(|| format!("{told}: {}.", names.join(", ")))
}

/// Returns the rows of classes, then the means over structural, movable and all classes.
fn rows(rooms: &[&Vec<OfClass>], classes: &[Class], rule: Rule) -> Rows {
    let of_class = |class: usize, threshold: usize| {
        let of_rooms = rooms.iter().map(|room| &room[class]);
        let truth = of_rooms.clone().map(|of| of.truth).sum();
        let mut judged: Vec<(f64, Verdict)> = of_rooms
            .flat_map(|of| of.judged.iter().map(|(s, verdicts)| (*s, verdicts[threshold])))
            .collect();
        ClassScore::new(truth, &mut judged, rule)
    };
    let scores: Vec<[ClassScore; 2]> = (0..classes.len())
        .map(|class| [0, 1].map(|threshold| of_class(class, threshold)))
        .collect();

    let of_row = |of: &[ClassScore; 2]| columns(of.map(|score| (score.ap, score.recall)), rule);
    let mut rows: Rows = classes
        .iter()
        .zip(&scores)
        .map(|(class, of)| (class.name().to_owned(), of_row(of)))
        .collect();

    let mean_of = |wanted: &dyn Fn(Class) -> bool| {
        let chosen = |threshold: usize| -> Vec<ClassScore> {
            classes
                .iter()
                .zip(&scores)
                .filter(|(c, _)| wanted(**c))
                .map(|(_, of)| of[threshold])
                .collect()
        };
        columns([0, 1].map(|threshold| mean(&chosen(threshold), rule)), rule)
    };
    let has_both_kinds =
        classes.iter().any(|c| is_structural(*c)) && !classes.iter().all(|c| is_structural(*c));
    if has_both_kinds {
        rows.push(("mean of structural".to_owned(), mean_of(&is_structural)));
        rows.push(("mean of movable".to_owned(), mean_of(&|class| !is_structural(class))));
    }
    rows.push(("mean".to_owned(), mean_of(&|_| true)));
    rows
}

fn columns(pairs: [(f64, f64); 2], rule: Rule) -> Vec<f64> {
    match rule {
        Rule::Mmdetection3d => pairs.into_iter().flat_map(|(ap, recall)| [ap, recall]).collect(),
        Rule::Open3dMl => pairs.into_iter().map(|(ap, _)| ap).collect::<Vec<f64>>(),
    }
}

/// Whether a building is made of things of a class, rather than furnished with them.
fn is_structural(class: Class) -> bool {
    class.s3dis() <= Class::DOOR
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_class(truth: u64, found: bool) -> OfClass {
        OfClass { truth, judged: vec![(0.5, vec![Verdict::False; 2]); found.into()] }
    }

    #[test]
    fn classes_without_true_boxes_are_noted() {
        let folds = [5, 2].map(|area| Fold { name: format!("area {area}"), areas: vec![area] });
        let room = |fold, counted| Unit { fold, area: 1, name: "office_1".to_owned(), counted };
        let rooms = vec![
            room(0, vec![of_class(1, true), of_class(0, true)]),
            room(0, vec![of_class(0, true), of_class(0, false)]),
            room(1, vec![of_class(0, false), of_class(1, true)]),
        ];
        let told = invented(&folds, &rooms, &[Class::BEAM, Class::SOFA]).unwrap();
        assert!(told.ends_with("not defined there: sofa in area 5."), "{told}");
        assert!(invented(&folds, &rooms[2..], &[Class::BEAM, Class::SOFA]).is_none());
    }
}
