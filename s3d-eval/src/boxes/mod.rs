//! Detection of objects as boxes along the axes: protocol `det`.
//!
//! [`average_precision`] is the metric. It works on slices, without files.
//!
//! ```
//! use s3d_eval::boxes::{Detection, GroundTruth, Rule, average_precision};
//! use s3d_dataset::s3d_label::Class;
//!
//! let chair = [0.0, 0.0, 0.0, 0.5, 0.5, 1.0];
//! let truth = [GroundTruth { room: 0, class: Class::CHAIR, bbox: chair }];
//! let found = [Detection { room: 0, class: Class::CHAIR, score: 0.9, bbox: chair }];
//! let scores = average_precision(&truth, &found, &[Class::CHAIR, Class::SOFA], 0.5, Rule::Mmdetection3d);
//! assert_eq!((scores[0].ap, scores[0].recall), (1.0, 1.0));
//! assert!(scores[1].is_absent() && scores[1].ap.is_nan());
//! ```

mod iou;
mod precision;
mod predictions;
mod protocol;
mod room;
mod truth;

pub use iou::iou;
pub use precision::{ClassScore, mean};
pub(crate) use protocol::det;

use room::Verdict;
use s3d_label::Class;
use std::collections::BTreeMap;

/// `[xmin, ymin, zmin, xmax, ymax, zmax]`, in metres.
type Bbox = [f64; 6];
/// The score and the box of a detection, of one class in one room.
type ScoredBox = (f64, Bbox);

/// The program whose definition is followed: it says which detections are true, and what average precision
/// is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// mmdetection3d's `indoor_eval`.
    ///
    /// By descending score, each detection takes the box of its class and room with the largest IoU; the
    /// first box wins a tie. It is true if this IoU is more than the threshold and no detection has taken the
    /// box before. Average precision is the area under the curve of precision over recall, after each
    /// precision is raised to the largest at its recall or more.
    Mmdetection3d,
    /// Open3D-ML's `mAP`, with its boxes in 3D.
    ///
    /// A detection is true if its IoU with some box is the threshold or more, and if it is the detection with
    /// the largest IoU for this or another box; the first detection wins a tie, whatever the scores.
    /// Precision is sampled at the scores of at most 41 true detections, evenly by recall. Its mean is taken
    /// over every fourth of 41 samples, or over all samples if there are fewer.
    Open3dMl,
}

/// A true box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundTruth {
    /// The number of its room, whatever numbers rooms have.
    pub room: u32,
    /// The class of its object.
    pub class: Class,
    /// `[xmin, ymin, zmin, xmax, ymax, zmax]`, in metres.
    pub bbox: [f64; 6],
}

/// A box that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// The number of its room.
    pub room: u32,
    /// The predicted class.
    pub class: Class,
    /// The confidence: any finite number, larger if more certain.
    pub score: f64,
    /// `[xmin, ymin, zmin, xmax, ymax, zmax]`, in metres.
    pub bbox: [f64; 6],
}

/// Returns the scores of each of `classes`, with the detections of all rooms pooled, at one threshold of the
/// IoU. Boxes of other classes do not count. Detections with equal scores are ordered by the number of their
/// room, then by their place in the slice.
///
/// Average precision is a share of 1. For a class that [is absent](ClassScore::is_absent), or has detections
/// only, it is NaN by [`Rule::Mmdetection3d`] and 0 by [`Rule::Open3dMl`].
///
/// Source: mmdetection3d at fe25f7a, `mmdet3d/evaluation/functional/indoor_eval.py` and
/// `structures/bbox_3d/base_box3d.py`; Open3D-ML at 5e81f52, `ml3d/metrics/mAP.py`. Both compute boxes in
/// f32, and mmdetection3d its average precision, too. Everything is f64 here.
pub fn average_precision(
    truth: &[GroundTruth],
    detections: &[Detection],
    classes: &[Class],
    threshold: f64,
    rule: Rule,
) -> Vec<ClassScore> {
    classes
        .iter()
        .copied()
        .map(|class| {
            let mut rooms: BTreeMap<u32, (Vec<Bbox>, Vec<ScoredBox>)> = BTreeMap::new();
            for t in truth.iter().filter(|t| t.class == class) {
                rooms.entry(t.room).or_default().0.push(t.bbox);
            }
            for d in detections.iter().filter(|d| d.class == class) {
                rooms.entry(d.room).or_default().1.push((d.score, d.bbox));
            }

            let mut judged: Vec<(f64, Verdict)> = Vec::new();
            for (boxes, found) in rooms.values() {
                let verdicts = room::verdicts(boxes, found, &[threshold], rule);
                judged.extend(found.iter().map(|f| f.0).zip(verdicts.into_iter().flatten()));
            }
            let boxes = rooms.values().map(|(boxes, _)| boxes.len() as u64).sum();
            ClassScore::new(boxes, &mut judged, rule)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Makes a box of 1 m with its corner at x.
    fn cube(x: f64) -> [f64; 6] {
        [x, 0.0, 0.0, x + 1.0, 1.0, 1.0]
    }

    fn truth(room: u32, class: Class, x: f64) -> GroundTruth {
        GroundTruth { room, class, bbox: cube(x) }
    }

    fn found(room: u32, class: Class, x: f64, score: f64) -> Detection {
        Detection { room, class, score, bbox: cube(x) }
    }

    fn chairs(truth: &[GroundTruth], detections: &[Detection], threshold: f64, rule: Rule) -> ClassScore {
        average_precision(truth, detections, &[Class::CHAIR], threshold, rule)[0]
    }

    #[test]
    fn a_box_is_found_once() {
        let c = Class::CHAIR;
        let boxes = [truth(1, c, 0.0), truth(2, c, 0.0)];
        // Right, the same again, in another room, nowhere.
        let all =
            [found(1, c, 0.1, 0.9), found(1, c, 0.0, 0.8), found(2, c, 0.0, 0.7), found(2, c, 9.0, 0.6)];
        let score = chairs(&boxes, &all, 0.5, Rule::Mmdetection3d);
        assert_eq!((score.truth, score.detections, score.hits, score.recall), (2, 4, 2, 1.0));
        // Precision 1 up to a recall of 1/2, then 2/3.
        assert!((score.ap - (0.5 + 0.5 * 2.0 / 3.0)).abs() < 1e-15);

        // The second is nearer, and so the true one.
        let score = chairs(&boxes, &all, 0.5, Rule::Open3dMl);
        assert_eq!(score.hits, 2);
        assert!((score.ap - (2.0 / 3.0)).abs() < 1e-15 && score.recall.is_nan(), "{score:?}");
    }

    #[test]
    fn rules_differ_for_an_iou_at_the_threshold() {
        let boxes = [GroundTruth { room: 0, class: Class::CHAIR, bbox: [0.0, 0.0, 0.0, 2.0, 1.0, 1.0] }];
        let half = [found(0, Class::CHAIR, 0.0, 1.0)];
        assert_eq!(chairs(&boxes, &half, 0.5, Rule::Mmdetection3d).ap, 0.0);
        assert_eq!(chairs(&boxes, &half, 0.5f64.next_down(), Rule::Mmdetection3d).ap, 1.0);
        assert_eq!(chairs(&boxes, &half, 0.5, Rule::Open3dMl).ap, 1.0);
    }

    #[test]
    fn classes_without_boxes_or_detections() {
        let c = Class::CHAIR;
        let nothing = &[][..];
        let missed = chairs(&[truth(0, c, 0.0)], &[], 0.25, Rule::Mmdetection3d);
        assert_eq!((missed.ap, missed.recall, missed.is_absent()), (0.0, 0.0, false));
        let invented = chairs(&[], &[found(0, c, 0.0, 1.0)], 0.25, Rule::Mmdetection3d);
        assert!(invented.ap.is_nan() && invented.recall.is_nan() && !invented.is_absent());
        let absent = chairs(&[truth(0, Class::SOFA, 0.0)], nothing, 0.25, Rule::Mmdetection3d);
        assert!(absent.is_absent() && absent.ap.is_nan());
        assert_eq!(mean(&[missed, absent], Rule::Mmdetection3d), (0.0, 0.0));
        assert!(mean(&[missed, invented], Rule::Mmdetection3d).0.is_nan());
        assert_eq!(chairs(&[], nothing, 0.25, Rule::Open3dMl).ap, 0.0);
    }
}
