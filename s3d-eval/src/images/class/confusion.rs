//! Confusion matrices, and the scores that HoHoNet and CMX compute from them.

use crate::tables::mean_of_defined;

/// The number of pixels of each true class that were predicted as each class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Confusion {
    classes: usize,
    counts: Vec<u64>,
}

/// Scores of a [`Confusion`], each from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassScores {
    /// The intersection over union of each class. NaN for a class without true pixels.
    pub iou: Vec<f64>,
    /// The share of the true pixels of each class that were found. NaN for a class without true pixels.
    pub accuracy: Vec<f64>,
    /// The mean of `iou` over the classes with true pixels. NaN if there are none.
    pub mean_iou: f64,
    /// The mean of `accuracy` over the same classes.
    pub mean_accuracy: f64,
}

/// Scores of a [`Confusion`] in which no class is removed, each from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewScores {
    /// The intersection over union of each class. NaN for a class with neither true nor predicted pixels.
    pub iou: Vec<f64>,
    /// The share of the true pixels of each class that were found. NaN for a class without true pixels.
    pub accuracy: Vec<f64>,
    /// The mean of `iou` over the classes that have one. NaN if there are none.
    pub mean_iou: f64,
    /// The mean of `accuracy` over the classes that have one.
    pub mean_accuracy: f64,
    /// The mean of `iou`, in which each class counts its true pixels.
    pub weighted_iou: f64,
    /// The share of all pixels whose class was found.
    pub pixel_accuracy: f64,
}

impl Confusion {
    /// Makes an empty matrix of this number of classes.
    pub fn new(classes: usize) -> Self {
        Self { classes, counts: vec![0; classes * classes] }
    }

    /// Counts a pixel of the class `truth` that was predicted as the class `prediction`.
    ///
    /// # Panics
    /// If there is no such class.
    pub fn count(&mut self, truth: usize, prediction: usize) {
        assert!(prediction < self.classes, "{prediction} is none of {} classes", self.classes);
        self.counts[truth * self.classes + prediction] += 1;
    }

    /// Adds the counts of another matrix.
    ///
    /// # Panics
    /// If the other has another number of classes.
    pub fn add(&mut self, other: &Self) {
        assert_eq!(self.classes, other.classes, "the same classes");
        self.counts
            .iter_mut()
            .zip(&other.counts)
            .for_each(|(sum, count)| *sum += count);
    }

    /// Returns the indices of the counts other than 0, and these counts. A single image has few.
    pub(super) fn counted(&self) -> Vec<(u32, u32)> {
        let there = (0u32..).zip(&self.counts).filter(|(_, count)| **count > 0);
        there
            .map(|(at, count)| (at, u32::try_from(*count).unwrap_or(u32::MAX)))
            .collect()
    }

    /// Adds counts that [`Confusion::counted`] returned.
    pub(super) fn add_counted(&mut self, counted: &[(u32, u32)]) {
        counted
            .iter()
            .for_each(|(at, count)| self.counts[*at as usize] += u64::from(*count));
    }

    /// Returns a row of counts for each true class, by predicted class.
    pub fn rows(&self) -> Vec<Vec<u64>> {
        (0..self.classes)
            .map(|truth| self.counts[truth * self.classes..][..self.classes].to_vec())
            .collect()
    }

    /// Returns the number of pixels that were counted.
    pub fn pixels(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Returns the scores of HoHoNet's script (`test_sem.py`, "Summarize"). It removes the rows and columns
    /// of classes without true pixels first. A pixel that was predicted as one of these classes therefore
    /// counts nowhere, not even as missed.
    pub fn scores(&self) -> ClassScores {
        let cells: Vec<f64> = self.counts.iter().map(|count| *count as f64).collect();
        hohonet_scores(self.classes, &cells)
    }

    /// Returns the scores of CMX's script (`utils/metric.py`, `compute_score`), which keeps all classes.
    pub fn view_scores(&self) -> ViewScores {
        let of = |truth: usize, prediction: usize| self.counts[truth * self.classes + prediction] as f64;
        let classes = 0..self.classes;
        let found: Vec<f64> = classes.clone().map(|class| of(class, class)).collect();
        let truth: Vec<f64> = classes
            .clone()
            .map(|class| classes.clone().map(|p| of(class, p)).sum())
            .collect();
        let predicted = classes
            .clone()
            .map(|class| classes.clone().map(|t| of(t, class)).sum::<f64>());

        let iou: Vec<f64> = predicted
            .zip(&truth)
            .zip(&found)
            .map(|((predicted, truth), found)| found / (truth + predicted - found))
            .collect();
        let accuracy: Vec<f64> = found.iter().zip(&truth).map(|(found, truth)| found / truth).collect();
        let all = self.pixels() as f64;
        let there = iou.iter().zip(&truth).filter(|(_, truth)| **truth > 0.0);
        ViewScores {
            mean_iou: mean_of_defined(iou.iter().copied()),
            mean_accuracy: mean_of_defined(accuracy.iter().copied()),
            weighted_iou: if all > 0.0 {
                there.map(|(iou, truth)| iou * (truth / all)).sum()
            } else {
                f64::NAN
            },
            pixel_accuracy: found.iter().sum::<f64>() / all,
            iou,
            accuracy,
        }
    }
}

/// Returns [`Confusion::scores`] of a matrix whose cells are counts or sums of weights, with a row for each
/// true class.
pub(super) fn hohonet_scores(classes: usize, cells: &[f64]) -> ClassScores {
    let of = |truth: usize, prediction: usize| cells[truth * classes + prediction];
    let there: Vec<usize> = (0..classes)
        .filter(|&truth| (0..classes).any(|p| of(truth, p) > 0.0))
        .collect();
    let mut scores = ClassScores {
        iou: vec![f64::NAN; classes],
        accuracy: vec![f64::NAN; classes],
        mean_iou: f64::NAN,
        mean_accuracy: f64::NAN,
    };

    for &class in &there {
        let found = of(class, class);
        let truth = there.iter().map(|&other| of(class, other)).sum::<f64>();
        let predicted = there.iter().map(|&other| of(other, class)).sum::<f64>();
        scores.iou[class] = found / (truth + predicted - found);
        scores.accuracy[class] = found / truth;
    }

    scores.mean_iou = mean_over(&scores.iou, &there);
    scores.mean_accuracy = mean_over(&scores.accuracy, &there);
    scores
}

fn mean_over(values: &[f64], there: &[usize]) -> f64 {
    there.iter().map(|&c| values[c]).sum::<f64>() / there.len() as f64
}
