//! Coverage, precision and recall of instances of points.
//!
//! Source: ASIS d71c3d6, `models/ASIS/eval_iou_accuracy.py`.

use super::matching::{PredictedInstance, TrueInstance};

/// The least IoU of a right prediction.
const LEAST_IOU: f64 = 0.5;

/// The coverage of the instances of a room, by class.
#[derive(Clone, Debug, PartialEq)]
pub struct RoomCoverage(Vec<ClassCoverage>);

/// The coverage of the instances of a class.
#[derive(Clone, Debug, Default, PartialEq)]
struct ClassCoverage {
    /// The sum of the largest IoU of each true instance.
    covered: f64,
    /// The same sum, weighted by the points of the instance.
    covered_points: f64,
    /// The number of true instances, and of their points.
    truth: u64,
    points: u64,
    /// The number of right predictions, and of all.
    right: u64,
    predicted: u64,
}

impl RoomCoverage {
    /// Compares the instances of a room. Scores and void points of predictions do not matter. An instance
    /// does not count if its class is not below `classes`.
    pub fn new(truth: &[TrueInstance], predicted: &[PredictedInstance], classes: usize) -> Self {
        let mut coverage = vec![ClassCoverage::default(); classes];
        let mut best = vec![0.0f64; truth.len()];
        for instance in predicted {
            let Some(class) = coverage.get_mut(instance.class) else { continue };
            class.predicted += 1;
            let mut largest = 0.0f64;
            for (at, _, iou) in instance.of_its_class(truth) {
                largest = largest.max(iou);
                if let Some(best) = best.get_mut(at) {
                    *best = best.max(iou);
                }
            }
            class.right += u64::from(largest >= LEAST_IOU);
        }

        for (instance, best) in truth.iter().zip(best) {
            let Some(class) = coverage.get_mut(instance.class) else { continue };
            class.truth += 1;
            class.points += instance.points;
            class.covered += best;
            class.covered_points += best * instance.points as f64;
        }
        Self(coverage)
    }

    /// Returns the number of true and of predicted instances of each class.
    pub(super) fn totals(&self) -> Vec<[u64; 2]> {
        self.0.iter().map(|class| [class.truth, class.predicted]).collect()
    }
}

/// The scores of a class, or their means, from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoverageScores {
    /// The number of right predictions, divided by the number of predictions. NaN without predictions.
    pub precision: f64,
    /// The number of right predictions, divided by the number of true instances. NaN without true instances.
    pub recall: f64,
    /// The mean over rooms of the mean largest IoU of their true instances. NaN without true instances.
    pub coverage: f64,
    /// The same mean, with each instance weighted by its points.
    pub weighted_coverage: f64,
}

/// Returns the scores of each class over rooms, which have the same number of classes.
pub fn coverage(rooms: &[&RoomCoverage]) -> Vec<CoverageScores> {
    let classes = rooms.iter().map(|room| room.0.len()).max().unwrap_or(0);
    (0..classes)
        .map(|class| {
            let rooms: Vec<&ClassCoverage> = rooms.iter().filter_map(|room| room.0.get(class)).collect();
            let sum =
                |count: fn(&ClassCoverage) -> u64| rooms.iter().map(|room| count(room)).sum::<u64>() as f64;
            let mean = |score: fn(&ClassCoverage) -> f64| {
                let scores: Vec<f64> = rooms
                    .iter()
                    .filter(|room| room.truth > 0)
                    .map(|room| score(room))
                    .collect();
                scores.iter().sum::<f64>() / scores.len() as f64
            };

            let right = sum(|room| room.right);
            CoverageScores {
                precision: right / sum(|room| room.predicted),
                recall: right / sum(|room| room.truth),
                coverage: mean(|room| room.covered / room.truth as f64),
                weighted_coverage: mean(|room| room.covered_points / room.points as f64),
            }
        })
        .collect()
}

impl CoverageScores {
    /// Returns precision, recall, coverage and weighted coverage.
    pub fn to_array(self) -> [f64; 4] {
        [self.precision, self.recall, self.coverage, self.weighted_coverage]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn predicted(points: u64, common: u64) -> PredictedInstance {
        PredictedInstance { class: 0, score: 0.0, points, void: 0, overlaps: vec![(0, common)] }
    }

    #[test]
    fn an_iou_at_the_threshold_is_right() {
        let truth = [TrueInstance { class: 0, points: 200 }, TrueInstance { class: 0, points: 50 }];
        let room = RoomCoverage::new(&truth, &[predicted(250, 150), predicted(30, 10)], 2);
        let scores = coverage(&[&room]);
        let expected = [0.5, 0.5, 0.25, 0.5 * 200.0 / 250.0];
        assert_eq!(scores[0].to_array(), expected);
        assert!(scores[1].to_array().iter().all(|score| score.is_nan()));
        assert_eq!(coverage(&[&RoomCoverage::new(&truth, &[predicted(251, 150)], 1)])[0].precision, 0.0);
        assert!(coverage(&[]).is_empty());
    }
}
