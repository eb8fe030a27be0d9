//! Semantic segmentation: points by true and predicted class, and their scores.

/// The number of points of each true class that were predicted as each class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SemanticCounts {
    classes: usize,
    /// A row for each true class: the predicted classes, then the points that were predicted as no class.
    counts: Vec<u64>,
}

/// The scores of a class that neither the truth nor the predictions have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AbsentClass {
    /// IoU and accuracy are 0 and count in the means, since 1e-10 is added to each denominator. Source:
    /// Pointcept d74c646, `pointcept/engines/test.py`.
    Zero,
    /// IoU and accuracy are NaN and left out of the means. The accuracy of a class that only the truth lacks
    /// is NaN, too. Sources: mmdetection3d fe25f7a, `mmdet3d/evaluation/functional/seg_eval.py`; Open3D-ML
    /// 5e81f52, `ml3d/torch/modules/metrics/semseg_metric.py`, which has no overall accuracy.
    LeftOut,
}

/// The scores of a semantic segmentation, from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct SemanticScores {
    /// The intersection over union of each class.
    pub iou: Vec<f64>,
    /// The share of the true points of each class that were found.
    pub accuracy: Vec<f64>,
    /// The mean of `iou`, called mIoU.
    pub mean_iou: f64,
    /// The mean of `accuracy`, called mAcc.
    pub mean_accuracy: f64,
    /// The share of right points among all points that are not void, called OA.
    pub overall_accuracy: f64,
}

impl SemanticCounts {
    /// Makes empty counts of this number of classes.
    pub fn new(classes: usize) -> Self {
        Self { classes, counts: vec![0; classes * (classes + 1)] }
    }

    /// Counts points by their true and predicted classes, from 0. A point whose true class does not exist,
    /// such as -1, is void and does not count. A point whose predicted class does not exist is wrong.
    pub fn add(&mut self, points: impl IntoIterator<Item = (i64, i64)>) {
        for (truth, predicted) in points {
            if let Some(class) = usize::try_from(truth).ok().filter(|class| *class < self.classes) {
                self.add_run(class, &[predicted]);
            }
        }
    }

    /// Counts points of one true class.
    pub(super) fn add_run(&mut self, class: usize, predicted: &[i64]) {
        let none = self.classes;
        let Some(row) = self.counts.chunks_exact_mut(none + 1).nth(class) else { return };
        for label in predicted {
            let at = usize::try_from(*label).map_or(none, |label| label.min(none));
            row[at] += 1;
        }
    }

    /// Returns the sum of counts, which have the same number of classes.
    pub fn sum<'a>(classes: usize, counts: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut sum = Self::new(classes);
        for counts in counts {
            sum.counts
                .iter_mut()
                .zip(&counts.counts)
                .for_each(|(sum, count)| *sum += count);
        }
        sum
    }

    /// Returns a row of counts for each true class: by predicted class, then the points that were predicted
    /// as no class.
    pub fn rows(&self) -> Vec<Vec<u64>> {
        self.counts
            .chunks_exact(self.classes + 1)
            .map(<[u64]>::to_vec)
            .collect()
    }

    /// Returns the number of points of each true class.
    pub fn truth(&self) -> Vec<u64> {
        self.rows().iter().map(|row| row.iter().sum()).collect()
    }

    /// Returns the number of points of each predicted class.
    pub fn predicted(&self) -> Vec<u64> {
        let rows = self.rows();
        (0..self.classes)
            .map(|class| rows.iter().map(|row| row[class]).sum())
            .collect()
    }

    /// Returns the scores of these counts.
    pub fn scores(&self, absent: AbsentClass) -> SemanticScores {
        let rows = self.rows();
        let both = || rows.iter().enumerate().map(|(class, row)| row[class]);
        let [truth, predicted] = [self.truth(), self.predicted()];
        let iou: Vec<f64> = both()
            .zip(truth.iter().zip(&predicted))
            .map(|(both, (t, p))| share(both, t + p - both, absent))
            .collect();
        let accuracy: Vec<f64> = both()
            .zip(&truth)
            .map(|(both, truth)| share(both, *truth, absent))
            .collect();
        SemanticScores {
            mean_iou: nan_mean(iou.iter().copied()),
            mean_accuracy: nan_mean(accuracy.iter().copied()),
            overall_accuracy: share(both().sum(), truth.iter().sum(), absent),
            iou,
            accuracy,
        }
    }
}

fn share(part: u64, whole: u64, absent: AbsentClass) -> f64 {
    match absent {
        AbsentClass::Zero => part as f64 / (whole as f64 + 1e-10),
        AbsentClass::LeftOut => part as f64 / whole as f64,
    }
}

/// Returns the mean of the values that are not NaN; NaN if there are none.
pub(super) fn nan_mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sum = 0.0;
    let mut count = 0u32;
    for value in values.into_iter().filter(|value| !value.is_nan()) {
        sum += value;
        count += 1;
    }
    sum / f64::from(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absent_classes_are_zero_or_left_out() {
        let mut counts = SemanticCounts::new(3);
        counts.add([(0, 0), (0, 1), (1, 1), (-1, 0), (7, 1), (1, -1)]);
        assert_eq!((counts.truth(), counts.predicted()), (vec![2, 2, 0], vec![1, 2, 0]));
        assert_eq!(counts.rows(), [[1, 1, 0, 0], [0, 1, 0, 1], [0; 4]]);
        let zero = counts.scores(AbsentClass::Zero);
        assert!((zero.mean_iou - (0.5 + 1.0 / 3.0) / 3.0).abs() < 1e-9 && zero.iou[2] == 0.0, "{zero:?}");
        let left_out = counts.scores(AbsentClass::LeftOut);
        assert_eq!(left_out.mean_iou, (0.5 + 1.0 / 3.0) / 2.0);
        assert!(left_out.iou[2].is_nan() && left_out.overall_accuracy == 0.5);
        assert!(SemanticCounts::new(3).scores(AbsentClass::LeftOut).mean_iou.is_nan());
        assert_eq!(SemanticCounts::new(3).scores(AbsentClass::Zero).overall_accuracy, 0.0);
    }
}
