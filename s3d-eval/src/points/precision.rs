//! Average precision of instances of points.
//!
//! Source: Pointcept d74c646, `pointcept/engines/hooks/evaluator.py` (`InsSegEvaluator`), which follows
//! ScanNet's script.

use super::matching::{PredictedInstance, TrueInstance};
use super::semantic::nan_mean;

/// Instances with fewer points do not count, on both sides.
pub const LEAST_POINTS: u64 = 100;
/// The number of thresholds of the IoU.
const THRESHOLDS: usize = 10;

/// Returns the thresholds of the IoU: .5 to .9 in steps of .05, rounded like numpy's `arange`, then .25.
fn thresholds() -> [f64; THRESHOLDS] {
    let step = (0.5 + 0.05) - 0.5;
    std::array::from_fn(|i| {
        if i + 1 < THRESHOLDS {
            0.5 + i as f64 * step
        } else {
            0.25
        }
    })
}

/// The true and predicted instances of a room, matched by IoU, class by class.
#[derive(Clone, Debug, PartialEq)]
pub struct InstanceMatches(Vec<ClassMatches>);

/// The instances of a class.
#[derive(Clone, Debug, Default, PartialEq)]
struct ClassMatches {
    /// For each true instance that counts, the predictions that share points with it, and their IoU.
    truth: Vec<Vec<(usize, f64)>>,
    predicted: Vec<Candidate>,
}

/// A predicted instance that counts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    score: f64,
    /// Its largest IoU with a true instance of any size.
    best_iou: f64,
    /// The share of its points that are void or in true instances that are too small.
    ignored: f64,
}

impl InstanceMatches {
    /// Matches the instances of a room. An instance does not count if its class is not below `classes`.
    pub fn new(truth: &[TrueInstance], predicted: &[PredictedInstance], classes: usize) -> Self {
        let mut matches = vec![ClassMatches::default(); classes];
        // The index of each true instance that counts among the instances of its class.
        let mut places = Vec::with_capacity(truth.len());
        for instance in truth {
            let class = matches
                .get_mut(instance.class)
                .filter(|_| instance.points >= LEAST_POINTS);
            places.push(class.map(|class| {
                class.truth.push(Vec::new());
                class.truth.len() - 1
            }));
        }

        for instance in predicted.iter().filter(|instance| instance.points >= LEAST_POINTS) {
            let Some(class) = matches.get_mut(instance.class) else { continue };
            let mut best_iou = 0.0f64;
            let mut ignored = instance.void;
            for (at, common, iou) in instance.of_its_class(truth) {
                best_iou = best_iou.max(iou);
                match places
                    .get(at)
                    .copied()
                    .flatten()
                    .and_then(|place| class.truth.get_mut(place))
                {
                    Some(candidates) => candidates.push((class.predicted.len(), iou)),
                    None => ignored += common,
                }
            }

            let ignored = ignored as f64 / instance.points as f64;
            class
                .predicted
                .push(Candidate { score: instance.score, best_iou, ignored });
        }
        Self(matches)
    }

    /// Returns the number of true and of predicted instances of each class that count.
    pub(super) fn totals(&self) -> Vec<[u64; 2]> {
        let sizes = |class: &ClassMatches| [class.truth.len() as u64, class.predicted.len() as u64];
        self.0.iter().map(sizes).collect()
    }
}

/// The average precision of instances, from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct InstanceAp {
    /// For each class the mean over IoU .50 to .90, the value at .50, and the value at .25. NaN if no true
    /// instance of the class counts.
    pub by_class: Vec<[f64; 3]>,
    /// The means over classes, without NaN: over IoU .50 to .90, at .50, and at .25.
    pub mean: [f64; 3],
}

/// Returns the average precision over rooms, which have the same number of classes.
pub fn instance_ap(rooms: &[&InstanceMatches]) -> InstanceAp {
    let classes = rooms.iter().map(|room| room.0.len()).max().unwrap_or(0);
    let at: Vec<[f64; THRESHOLDS]> = (0..classes)
        .map(|class| thresholds().map(|threshold| class_ap(rooms, class, threshold)))
        .collect();

    let by_class: Vec<[f64; 3]> = at
        .iter()
        .map(|ap| [nan_mean(all_but_last(ap)), ap[0], ap[THRESHOLDS - 1]])
        .collect();
    let mean = [
        nan_mean(at.iter().flat_map(all_but_last)),
        nan_mean(by_class.iter().map(|ap| ap[1])),
        nan_mean(by_class.iter().map(|ap| ap[2])),
    ];
    InstanceAp { by_class, mean }
}

fn all_but_last(ap: &[f64; THRESHOLDS]) -> Vec<f64> {
    ap.iter().take(THRESHOLDS - 1).copied().collect::<Vec<f64>>()
}

/// Returns the average precision of a class at a threshold of the IoU.
fn class_ap(rooms: &[&InstanceMatches], class: usize, threshold: f64) -> f64 {
    let mut found = Vec::new();
    let mut missed = 0;
    let mut has_truth = false;
    let mut has_predicted = false;
    for room in rooms.iter().filter_map(|room| room.0.get(class)) {
        has_truth |= !room.truth.is_empty();
        has_predicted |= !room.predicted.is_empty();
        missed += room.decide(threshold, &mut found);
    }
    if !has_truth {
        f64::NAN
    } else if has_predicted {
        area(found, missed)
    } else {
        0.0
    }
}

impl ClassMatches {
    /// Appends the score of each prediction that counts, and whether it is right. Returns the number of true
    /// instances without a prediction.
    fn decide(&self, threshold: f64, found: &mut Vec<(f64, bool)>) -> u64 {
        let mut is_taken = vec![false; self.predicted.len()];
        let mut missed = 0;
        for candidates in &self.truth {
            let mut best: Option<f64> = None;
            for (at, iou) in candidates {
                let (Some(taken), Some(candidate)) = (is_taken.get_mut(*at), self.predicted.get(*at)) else {
                    continue;
                };
                if *taken || *iou <= threshold {
                    continue;
                }

                // Only the first is taken. Another is a duplicate here, and may be right elsewhere.
                best = Some(match best {
                    Some(score) => {
                        found.push((score.min(candidate.score), false));
                        score.max(candidate.score)
                    }
                    None => {
                        *taken = true;
                        candidate.score
                    }
                });
            }
            match best {
                Some(score) => found.push((score, true)),
                None => missed += 1,
            }
        }

        found.extend(
            self.predicted
                .iter()
                .filter(|c| c.best_iou <= threshold && c.ignored <= threshold)
                .map(|candidate| (candidate.score, false)),
        );
        missed
    }
}

/// Returns the area below precision over recall, in trapezia like ScanNet's script. Each distinct score is a
/// point of the curve, and precision 1 at recall 0 is another.
fn area(mut found: Vec<(f64, bool)>, missed: u64) -> f64 {
    found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let right = found.iter().filter(|(_, is_right)| *is_right).count() as u64;

    let mut precision = Vec::new();
    let mut recall = Vec::new();
    let mut at = 0;
    let mut right_below = 0;
    for group in found.chunk_by(|a, b| a.0 == b.0) {
        let right_here = right - right_below;
        precision.push(right_here as f64 / (found.len() - at) as f64);
        recall.push(right_here as f64 / (right + missed) as f64);
        at += group.len();
        right_below += group.iter().filter(|(_, is_right)| *is_right).count() as u64;
    }
    precision.push(1.0);
    recall.push(0.0);

    let before = recall.first().into_iter().chain(&recall);
    let after = recall.iter().skip(1).chain([&0.0]);
    let widths = before.zip(after).map(|(before, after)| 0.5 * before - 0.5 * after);
    precision
        .iter()
        .zip(widths)
        .map(|(precision, width)| precision * width)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn predicted(score: f64, points: u64, overlaps: &[(usize, u64)]) -> PredictedInstance {
        PredictedInstance { class: 0, score, points, void: 0, overlaps: overlaps.to_vec() }
    }

    #[test]
    fn an_iou_at_the_threshold_is_a_miss() {
        let truth = [TrueInstance { class: 0, points: 200 }, TrueInstance { class: 1, points: 99 }];
        // 150 of 300: exactly one half.
        let room = InstanceMatches::new(&truth, &[predicted(0.9, 250, &[(0, 150)])], 3);
        let ap = instance_ap(&[&room]);
        assert_eq!(ap.by_class[0][1..], [0.0, 1.0]);
        assert!(ap.by_class[1][0].is_nan() && ap.by_class[2][0].is_nan());
        let room = InstanceMatches::new(&truth, &[predicted(0.9, 249, &[(0, 150)])], 3);
        assert_eq!(instance_ap(&[&room]).by_class[0][1], 1.0);
        let none = InstanceMatches::new(&truth, &[], 3);
        assert_eq!(instance_ap(&[&none]).mean, [0.0; 3]);
        assert!(instance_ap(&[]).mean[0].is_nan());
    }

    #[test]
    fn a_duplicate_is_wrong_and_predictions_in_void_do_not_count() {
        let truth = [TrueInstance { class: 0, points: 100 }];
        let duplicate = [predicted(0.9, 100, &[(0, 100)]), predicted(0.8, 100, &[(0, 100)])];
        let ap = instance_ap(&[&InstanceMatches::new(&truth, &duplicate, 1)]).by_class[0][1];
        // Precision 1/2 at recall 1, 1 at 1 and at 0: half a trapezium each.
        assert_eq!(ap, 1.0);

        let surer = [predicted(0.7, 200, &[]), predicted(0.6, 100, &[(0, 100)])];
        let ap = instance_ap(&[&InstanceMatches::new(&truth, &surer, 1)]).by_class[0][1];
        assert_eq!(ap, 0.25);
        let in_void = [PredictedInstance { void: 101, ..surer[0].clone() }, surer[1].clone()];
        assert_eq!(instance_ap(&[&InstanceMatches::new(&truth, &in_void, 1)]).by_class[0][1], 1.0);
    }
}
