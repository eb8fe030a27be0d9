//! Computes average precision from true and false detections.

use super::Rule;
use super::room::Verdict;

/// The scores of a class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassScore {
    /// Average precision, a share of 1. NaN where the definition gives none.
    pub ap: f64,
    /// The share of the true boxes that were found. NaN if there are none, and by [`Rule::Open3dMl`], which
    /// has no recall.
    pub recall: f64,
    /// The number of true boxes.
    pub truth: u64,
    /// The number of detections.
    pub detections: u64,
    /// The number of true detections.
    pub hits: u64,
}

/// The most scores at which Open3D-ML samples precision.
const SAMPLES: usize = 41;
/// Open3D-ML takes the mean of every fourth sample.
const STRIDE: usize = 4;

impl ClassScore {
    /// Scores the detections of a class with this number of true boxes. Sorts `judged` by score.
    pub(super) fn new(truth: u64, judged: &mut [(f64, Verdict)], rule: Rule) -> Self {
        judged.sort_by(|a, b| b.0.total_cmp(&a.0));
        let hits = judged.iter().filter(|(_, verdict)| *verdict == Verdict::True).count() as u64;
        let (ap, recall) = match rule {
            Rule::Mmdetection3d if truth == 0 => (f64::NAN, f64::NAN),
            Rule::Mmdetection3d => (area(truth, judged), hits as f64 / truth as f64),
            Rule::Open3dMl => (sampled(truth, judged), f64::NAN),
        };
        Self { ap, recall, truth, detections: judged.len() as u64, hits }
    }

    /// Whether the class is in neither the truth nor the detections.
    pub fn is_absent(&self) -> bool {
        self.truth == 0 && self.detections == 0
    }
}

/// Returns the means of average precision and recall over classes. By [`Rule::Mmdetection3d`], absent classes
/// do not count, and a class with detections only makes the means NaN. By [`Rule::Open3dMl`], all classes
/// count.
pub fn mean(scores: &[ClassScore], rule: Rule) -> (f64, f64) {
    let counted: Vec<_> = scores
        .iter()
        .filter(|score| rule == Rule::Open3dMl || !score.is_absent())
        .collect();
    let of = |value: fn(&ClassScore) -> f64| {
        counted.iter().map(|score| value(score)).sum::<f64>() / counted.len() as f64
    };
    (of(|score| score.ap), of(|score| score.recall))
}

/// Returns the area under precision over recall, after each precision is raised to the largest from there on.
fn area(truth: u64, judged: &[(f64, Verdict)]) -> f64 {
    let mut hits = 0u64;
    let mut precisions: Vec<(bool, f64)> = (1u64..)
        .zip(judged)
        .map(|(count, (_, verdict))| {
            let hit = *verdict == Verdict::True;
            hits += u64::from(hit);
            (hit, hits as f64 / count as f64)
        })
        .collect();

    let mut largest = 0.0f64;
    for (_, precision) in precisions.iter_mut().rev() {
        largest = largest.max(*precision);
        *precision = largest;
    }

    // Recall grows by the same amount with each hit. An empty sum is −0.
    let of_hits = precisions
        .iter()
        .filter(|(hit, _)| *hit)
        .map(|(_, precision)| precision);
    (0.0 + of_hits.sum::<f64>()) / truth as f64
}

/// Returns the mean of sampled precision, as Open3D-ML has it.
fn sampled(truth: u64, judged: &[(f64, Verdict)]) -> f64 {
    let of_hits: Vec<f64> = judged
        .iter()
        .filter(|(_, verdict)| *verdict == Verdict::True)
        .map(|(score, _)| *score)
        .collect();
    let mut precisions: Vec<f64> = thresholds(&of_hits, truth)
        .into_iter()
        .map(|threshold| precision_from(judged, threshold))
        .collect();

    let mut largest = 0.0f64;
    for precision in precisions.iter_mut().rev() {
        largest = largest.max(*precision);
        *precision = largest;
    }

    let every_fourth: Vec<f64> = precisions.iter().copied().step_by(STRIDE).collect();
    let whole = SAMPLES / STRIDE + 1;
    match precisions.len() {
        0 => 0.0,
        count if every_fourth.len() < whole => precisions.iter().sum::<f64>() / count as f64,
        _ => every_fourth.iter().sum::<f64>() / whole as f64,
    }
}

/// Selects the scores nearest to even steps of recall from the descending scores of hits.
fn thresholds(scores: &[f64], truth: u64) -> Vec<f64> {
    let mut chosen = Vec::new();
    let mut wanted = 0.0;
    for (i, score) in scores.iter().enumerate() {
        let is_last = i + 1 == scores.len();
        let left = (i + 1) as f64 / truth as f64;
        let right = if is_last { left } else { (i + 2) as f64 / truth as f64 };
        if !is_last && right - wanted < wanted - left {
            continue;
        }
        chosen.push(*score);
        wanted += 1.0 / (SAMPLES as f64 - 1.0);
    }
    chosen
}

/// Returns the share of hits among the detections with this score or more.
fn precision_from(judged: &[(f64, Verdict)], threshold: f64) -> f64 {
    let above = &judged[..judged.partition_point(|(score, _)| *score >= threshold)];
    let [hits, misses] = [Verdict::True, Verdict::False]
        .map(|wanted| above.iter().filter(|(_, verdict)| *verdict == wanted).count());
    // There is a hit, since the threshold is the score of one.
    hits as f64 / (hits + misses) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(c: char) -> Verdict {
        match c {
            't' => Verdict::True,
            'f' => Verdict::False,
            _ => Verdict::Void,
        }
    }

    fn judged(pattern: &str) -> Vec<(f64, Verdict)> {
        pattern
            .chars()
            .enumerate()
            .map(|(i, c)| (1.0 - 0.001 * i as f64, verdict(c)))
            .collect()
    }

    #[test]
    fn the_area_is_under_the_envelope() {
        // Precisions 1, 1/2, 2/3, 3/4: after the first hit the last is the largest.
        let score = ClassScore::new(4, &mut judged("tftt"), Rule::Mmdetection3d);
        assert!((score.ap - (1.0 + 0.75 + 0.75) / 4.0).abs() < 1e-15);
        assert_eq!((score.recall, score.hits), (0.75, 3));
        let nothing = ClassScore::new(4, &mut judged("ff"), Rule::Mmdetection3d).ap;
        assert!(nothing == 0.0 && nothing.is_sign_positive());
    }

    #[test]
    fn precision_is_sampled_at_hits() {
        // With few hits, the mean is over all of them, whatever the recall.
        assert_eq!(sampled(1000, &judged("t")), 1.0);
        assert!((sampled(4, &judged("tvft")) - (1.0 + 2.0 / 3.0) / 2.0).abs() < 1e-15);
        // 41 of 80 are sampled, and every fourth of these counts.
        assert_eq!(thresholds(&vec![0.5; 80], 80).len(), 41);
        assert_eq!(sampled(80, &judged(&"t".repeat(80))), 1.0);
        // 80 hits with false detections between the later 40: hit 1 and every eighth hit count.
        let half = "t".repeat(40) + &"ft".repeat(40);
        let later: f64 = [48, 56, 64, 72, 80]
            .map(|h| f64::from(h) / f64::from(2 * h - 40))
            .iter()
            .sum();
        assert!((sampled(80, &judged(&half)) - (6.0 + later) / 11.0).abs() < 1e-15);
    }
}
