//! Decides which detections of a room are true.

use super::{Bbox, Rule, ScoredBox, iou};

/// The verdict on a detection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    True,
    False,
    /// Neither, since its IoU with a box is not defined.
    Void,
}

/// Returns the verdicts on each detection of one class in one room, by threshold.
pub(super) fn verdicts(
    truth: &[Bbox],
    found: &[ScoredBox],
    thresholds: &[f64],
    rule: Rule,
) -> Vec<Vec<Verdict>> {
    match rule {
        Rule::Mmdetection3d => greedy(truth, found, thresholds),
        Rule::Open3dMl => best_of_boxes(truth, found, thresholds),
    }
}

fn greedy(truth: &[Bbox], found: &[ScoredBox], thresholds: &[f64]) -> Vec<Vec<Verdict>> {
    let mut verdicts = vec![vec![Verdict::False; thresholds.len()]; found.len()];
    let mut taken = vec![vec![false; truth.len()]; thresholds.len()];
    let mut order: Vec<usize> = (0..found.len()).collect();
    order.sort_by(|a, b| found[*b].0.total_cmp(&found[*a].0));

    for d in order {
        let ious = truth
            .iter()
            .map(|t| iou(&found[d].1, t, Rule::Mmdetection3d))
            .enumerate();
        let best = ious.reduce(|best, next| if next.1 > best.1 { next } else { best });
        let Some((at, largest)) = best else { continue };

        for ((verdict, taken), threshold) in verdicts[d].iter_mut().zip(&mut taken).zip(thresholds) {
            if largest > *threshold && !std::mem::replace(&mut taken[at], true) {
                *verdict = Verdict::True;
            }
        }
    }
    verdicts
}

fn best_of_boxes(truth: &[Bbox], found: &[ScoredBox], thresholds: &[f64]) -> Vec<Vec<Verdict>> {
    let ious: Vec<Vec<f64>> = truth
        .iter()
        .map(|bbox| found.iter().map(|(_, of)| iou(of, bbox, Rule::Open3dMl)).collect())
        .collect();

    // The best detection of each box has the largest IoU, or the first IoU that is NaN, like numpy's argmax.
    let mut is_best = vec![false; found.len()];
    for of_box in &ious {
        let best = of_box.iter().enumerate().reduce(|best, next| {
            if next.1 > best.1 || (next.1.is_nan() && !best.1.is_nan()) {
                next
            } else {
                best
            }
        });
        best.into_iter().for_each(|(d, _)| is_best[d] = true);
    }

    let verdict = |d: usize, threshold: f64| {
        if ious.iter().any(|of_box| of_box[d] >= threshold) {
            return if is_best[d] { Verdict::True } else { Verdict::False };
        }
        if ious.iter().any(|of_box| of_box[d].is_nan()) {
            Verdict::Void
        } else {
            Verdict::False
        }
    };
    (0..found.len())
        .map(|d| thresholds.iter().map(|threshold| verdict(d, *threshold)).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use Verdict::{False, True, Void};

    const ONE: [f64; 6] = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    const MOVED: [f64; 6] = [0.5, 0.0, 0.0, 1.5, 1.0, 1.0];

    #[test]
    fn the_detection_with_the_higher_score_takes_the_box() {
        // IoU of 1/3 and 1: at 0.25 the higher score takes the box, at 0.5 the other.
        let found = [(0.5, ONE), (0.9, MOVED)];
        let at = |rule| verdicts(&[ONE], &found, &[0.25, 0.5], rule);
        assert_eq!(at(Rule::Mmdetection3d), [[False, True], [True, False]]);
        assert_eq!(at(Rule::Open3dMl), [[True, True], [False, False]]);
        // The first wins a tie.
        let ties = verdicts(&[ONE], &[(0.5, ONE), (0.5, ONE)], &[0.5], Rule::Mmdetection3d);
        assert_eq!(ties, [[True], [False]]);
    }

    #[test]
    fn open3d_takes_the_best_of_any_box() {
        // The last detection is the best of no box; the first is the best of the far box, which it does not
        // touch.
        let far = [9.0, 9.0, 9.0, 10.0, 10.0, 10.0];
        let found = [(0.9, MOVED), (0.8, ONE), (0.7, ONE)];
        let boxes = verdicts(&[ONE, far], &found, &[0.25], Rule::Open3dMl);
        assert_eq!(boxes, [[True], [True], [False]]);
        let flat = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
        assert_eq!(verdicts(&[flat], &[(0.5, flat), (0.5, ONE)], &[0.5], Rule::Open3dMl), [[Void], [False]]);
        assert_eq!(verdicts(&[], &[(0.5, ONE)], &[0.5], Rule::Open3dMl), [[False]]);
    }
}
