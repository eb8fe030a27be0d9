//! Counts of classes, and what HoHoNet makes of them.

/// How many pixels of each class were predicted as which.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Confusion {
    classes: usize,
    counts: Vec<u64>,
}

/// Scores of a [`Confusion`], each from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassScores {
    /// Intersection over union by class; NaN for a class without true pixels.
    pub iou: Vec<f64>,
    /// Share of a class's pixels that were found, by class; NaN for a class without true pixels.
    pub accuracy: Vec<f64>,
    /// Mean of `iou` over the classes that have true pixels; NaN without any.
    pub mean_iou: f64,
    /// Mean of `accuracy` over the same.
    pub mean_accuracy: f64,
}

impl Confusion {
    /// Of so many classes, nothing counted yet.
    pub fn new(classes: usize) -> Self {
        Self { classes, counts: vec![0; classes * classes] }
    }

    /// Counts a pixel of the class `truth` that was predicted to be of the class `prediction`.
    ///
    /// # Panics
    /// If there is no such class.
    pub fn count(&mut self, truth: usize, prediction: usize) {
        assert!(prediction < self.classes, "{prediction} is none of {} classes", self.classes);
        self.counts[truth * self.classes + prediction] += 1;
    }

    /// Adds the counts of another of as many classes.
    ///
    /// # Panics
    /// If it has another number of classes.
    pub fn add(&mut self, other: &Self) {
        assert_eq!(self.classes, other.classes, "the same classes");
        self.counts
            .iter_mut()
            .zip(&other.counts)
            .for_each(|(sum, count)| *sum += count);
    }

    /// The places that are not 0, and their counts: little of one image.
    pub(super) fn counted(&self) -> Vec<(u32, u32)> {
        let there = (0u32..).zip(&self.counts).filter(|(_, count)| **count > 0);
        there
            .map(|(at, count)| (at, u32::try_from(*count).unwrap_or(u32::MAX)))
            .collect()
    }

    /// Adds what [`Confusion::counted`] gave.
    pub(super) fn add_counted(&mut self, counted: &[(u32, u32)]) {
        counted
            .iter()
            .for_each(|(at, count)| self.counts[*at as usize] += u64::from(*count));
    }

    /// How many pixels were counted.
    pub fn pixels(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// The scores of HoHoNet's script: classes without true pixels are taken out of the matrix first, rows
    /// and columns, so that a pixel that was predicted to be of one of them counts nowhere, not even as
    /// missed. Source: HoHoNet, `test_sem.py`, "Summarize".
    pub fn scores(&self) -> ClassScores {
        let of = |truth: usize, prediction: usize| self.counts[truth * self.classes + prediction];
        let there: Vec<usize> = (0..self.classes)
            .filter(|&truth| (0..self.classes).any(|p| of(truth, p) > 0))
            .collect();
        let mut scores = ClassScores {
            iou: vec![f64::NAN; self.classes],
            accuracy: vec![f64::NAN; self.classes],
            mean_iou: f64::NAN,
            mean_accuracy: f64::NAN,
        };
        for &class in &there {
            let found = of(class, class) as f64;
            let truth = there.iter().map(|&other| of(class, other)).sum::<u64>() as f64;
            let predicted = there.iter().map(|&other| of(other, class)).sum::<u64>() as f64;
            scores.iou[class] = found / (truth + predicted - found);
            scores.accuracy[class] = found / truth;
        }
        let mean = |values: &[f64]| there.iter().map(|&c| values[c]).sum::<f64>() / there.len() as f64;
        (scores.mean_iou, scores.mean_accuracy) = (mean(&scores.iou), mean(&scores.accuracy));
        scores
    }
}
