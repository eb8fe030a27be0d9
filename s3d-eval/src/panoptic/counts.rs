//! Matches segments, and computes the scores of panopticapi.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use thiserror::Error;

/// The number of the pixels that are in no segment.
const VOID: u32 = 0;

/// A segment of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Its number in the image, other than 0.
    pub id: u32,
    /// The index of its class.
    pub class: usize,
}

/// Why pixels and segments of an image do not fit together.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum SegmentFault {
    /// Pixels have a number that no segment has.
    #[error("{pixels} pixels are of segment {id}, which is not listed")]
    Unlisted {
        /// The number.
        id: u32,
        /// How many pixels have it.
        pixels: u64,
    },
    /// A segment has no pixels.
    #[error("segment {0} is listed, and no pixel is of it")]
    Empty(u32),
    /// Two segments have the same number.
    #[error("segment {0} is listed twice")]
    Double(u32),
    /// A segment has the number of void.
    #[error("a segment has the number 0, which is void")]
    Void,
    /// A segment has a class that does not exist.
    #[error("segment {id} is of class {class}, and there are {classes}")]
    Class {
        /// The segment.
        id: u32,
        /// Its class.
        class: usize,
        /// The number of classes.
        classes: usize,
    },
    /// Truth and prediction have different numbers of pixels.
    #[error("{predicted} pixels are predicted of {truth}")]
    Size {
        /// The pixels of the truth.
        truth: usize,
        /// The pixels of the prediction.
        predicted: usize,
    },
}

/// The segments of a class, counted: matched (true positives), invented (false positives) and missed (false
/// negatives).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassCounts {
    /// The pairs of a true and a predicted segment whose IoU is more than 1/2.
    pub matched: u64,
    /// The predicted segments without a match that are not mostly void.
    pub invented: u64,
    /// The true segments without a match.
    pub missed: u64,
    /// The sum of the IoU of the pairs.
    pub iou: f64,
}

/// Panoptic, segmentation and recognition quality, each from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanopticScore {
    /// `sq · rq`.
    pub pq: f64,
    /// The mean IoU of matched segments; 0 if there are none.
    pub sq: f64,
    /// The number of matched segments, divided by its sum with half of the invented and half of the missed
    /// ones.
    pub rq: f64,
}

impl PanopticScore {
    /// The score of a class without segments.
    const NONE: Self = Self { pq: f64::NAN, sq: f64::NAN, rq: f64::NAN };
}

impl ClassCounts {
    /// Whether no segment of the class counts on either side.
    pub fn is_absent(&self) -> bool {
        self.matched + self.invented + self.missed == 0
    }

    /// Returns the scores; all are NaN if the class [is absent](Self::is_absent).
    pub fn score(&self) -> PanopticScore {
        if self.is_absent() {
            return PanopticScore::NONE;
        }
        let matched = self.matched as f64;
        let all = matched + 0.5 * self.invented as f64 + 0.5 * self.missed as f64;
        let sq = if self.matched == 0 { 0.0 } else { self.iou / matched };
        PanopticScore { pq: self.iou / all, sq, rq: matched / all }
    }

    fn add(&mut self, other: &Self) {
        self.matched += other.matched;
        self.invented += other.invented;
        self.missed += other.missed;
        self.iou += other.iou;
    }
}

/// Returns the means of the scores of classes. Absent classes do not count; if all are absent, the means are
/// NaN.
pub fn mean<'a>(classes: impl IntoIterator<Item = &'a ClassCounts>) -> PanopticScore {
    let scores: Vec<PanopticScore> = classes
        .into_iter()
        .filter(|class| !class.is_absent())
        .map(ClassCounts::score)
        .collect();
    let of = |value: fn(&PanopticScore) -> f64| scores.iter().map(value).sum::<f64>() / scores.len() as f64;
    PanopticScore { pq: of(|s| s.pq), sq: of(|s| s.sq), rq: of(|s| s.rq) }
}

/// The segments of images, counted by class like panopticapi does. The counts of images can be added.
///
/// Source: panopticapi at 7bb4655, `panopticapi/evaluation.py`. Its crowds are left out, since our data sets
/// have none.
#[derive(Clone, Debug, PartialEq)]
pub struct PanopticCounts(Vec<ClassCounts>);

/// The class and the number of pixels of each segment of one side of an image, by the number of the segment.
type Sized = BTreeMap<u32, (usize, u64)>;

impl PanopticCounts {
    /// Makes empty counts of this number of classes.
    pub fn new(classes: usize) -> Self {
        Self(vec![ClassCounts::default(); classes])
    }

    /// Returns the counts of each class.
    pub fn classes(&self) -> &[ClassCounts] {
        &self.0
    }

    /// Adds other counts.
    ///
    /// # Panics
    /// If the other has another number of classes.
    pub fn add_counts(&mut self, other: &Self) {
        assert_eq!(self.0.len(), other.0.len(), "the same classes");
        self.0
            .iter_mut()
            .zip(&other.0)
            .for_each(|(sum, counts)| sum.add(counts));
    }

    /// Counts an image. `truth` and `predicted` have the number of the segment of each pixel, 0 for void.
    ///
    /// Two segments of a class match if their IoU is more than 1/2. Pixels of the predicted segment that are
    /// void in the truth do not count. A predicted segment without a match is invented, unless more than half
    /// of its pixels are void in the truth.
    ///
    /// # Errors
    /// [`SegmentFault`] if pixels and segments do not fit together; the truth is checked first. Then nothing
    /// was counted.
    pub fn add(
        &mut self,
        truth: &[u32],
        segments: &[Segment],
        predicted: &[u32],
        found: &[Segment],
    ) -> Result<(), SegmentFault> {
        if truth.len() != predicted.len() {
            return Err(SegmentFault::Size { truth: truth.len(), predicted: predicted.len() });
        }

        let shared = shared(truth, predicted);
        let classes = self.0.len();
        let truth = sized(segments, classes, shared.iter().map(|((truth, _), n)| (*truth, *n)))?;
        let found = sized(found, classes, shared.iter().map(|((_, id), n)| (*id, *n)))?;
        let void: BTreeMap<u32, u64> = shared
            .range((VOID, 0)..=(VOID, u32::MAX))
            .map(|((_, id), n)| (*id, *n))
            .collect();
        let void_of = |id: u32| void.get(&id).copied().unwrap_or(0);

        let mut matched_truth = BTreeSet::new();
        let mut matched_found = BTreeSet::new();
        for ((true_id, id), both) in &shared {
            let pair = truth.get(true_id).zip(found.get(id));
            let Some(((class, true_area), (of, area))) = pair else { continue };
            let union = area + true_area - both - void_of(*id);
            if class == of && 2 * both > union {
                self.0[*class].matched += 1;
                self.0[*class].iou += *both as f64 / union as f64;
                matched_truth.insert(*true_id);
                matched_found.insert(*id);
            }
        }

        for (_, (class, _)) in truth.iter().filter(|(id, _)| !matched_truth.contains(id)) {
            self.0[*class].missed += 1;
        }
        for (id, (class, area)) in found.iter().filter(|(id, _)| !matched_found.contains(id)) {
            self.0[*class].invented += u64::from(2 * void_of(*id) <= *area);
        }
        Ok(())
    }
}

/// Returns the number of pixels that each true segment shares with each predicted segment.
fn shared(truth: &[u32], predicted: &[u32]) -> BTreeMap<(u32, u32), u64> {
    let mut counts: HashMap<(u32, u32), u64> = HashMap::new();
    let mut at = 0;
    // Most pixels have the numbers of their neighbour.
    while let (Some(a), Some(b)) = (truth.get(at), predicted.get(at)) {
        let same = truth[at..]
            .iter()
            .zip(&predicted[at..])
            .take_while(|pair| *pair == (a, b))
            .count();
        *counts.entry((*a, *b)).or_default() += same as u64;
        at += same;
    }
    counts.into_iter().collect()
}

/// Returns the segments with their numbers of pixels. Each pixel must belong to one of them, or to void.
fn sized(
    segments: &[Segment],
    classes: usize,
    pixels: impl Iterator<Item = (u32, u64)>,
) -> Result<Sized, SegmentFault> {
    let mut sized = Sized::new();
    for Segment { id, class } in segments.iter().copied() {
        if id == VOID {
            return Err(SegmentFault::Void);
        }
        if class >= classes {
            return Err(SegmentFault::Class { id, class, classes });
        }
        if sized.insert(id, (class, 0)).is_some() {
            return Err(SegmentFault::Double(id));
        }
    }

    let mut unlisted: BTreeMap<u32, u64> = BTreeMap::new();
    for (id, count) in pixels.filter(|(id, _)| *id != VOID) {
        *sized
            .get_mut(&id)
            .map_or_else(|| unlisted.entry(id).or_default(), |(_, area)| area) += count;
    }

    if let Some((id, pixels)) = unlisted.pop_first() {
        return Err(SegmentFault::Unlisted { id, pixels });
    }
    match sized.iter().find(|(_, (_, area))| *area == 0) {
        Some((id, _)) => Err(SegmentFault::Empty(*id)),
        None => Ok(sized),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(list: &[(u32, usize)]) -> Vec<Segment> {
        list.iter().map(|&(id, class)| Segment { id, class }).collect()
    }

    fn counted(truth: &[u32], segments: &[(u32, usize)], predicted: &[u32], class: usize) -> Vec<[u64; 3]> {
        let mut counts = PanopticCounts::new(2);
        counts.add(truth, &of(segments), predicted, &of(&[(5, class)])).unwrap();
        counts
            .classes()
            .iter()
            .map(|c| [c.matched, c.invented, c.missed])
            .collect()
    }

    #[test]
    fn half_is_not_enough_and_void_does_not_count() {
        // An IoU of 2/4, and of 2/3 with a void pixel.
        assert_eq!(counted(&[1, 1, 1, 2], &[(1, 0), (2, 1)], &[0, 5, 5, 5], 0), [[0, 1, 1], [0, 0, 1]]);
        assert_eq!(counted(&[1, 1, 1, 0], &[(1, 0)], &[0, 5, 5, 5], 0), [[1, 0, 0], [0; 3]]);
        // Another class; then half void, which counts, and more than half, which does not.
        assert_eq!(counted(&[1, 1], &[(1, 0)], &[5, 5], 1), [[0, 0, 1], [0, 1, 0]]);
        assert_eq!(counted(&[1, 1, 1, 0], &[(1, 0)], &[0, 0, 5, 5], 0), [[0, 1, 1], [0; 3]]);
        assert_eq!(counted(&[1, 1, 0, 0], &[(1, 0)], &[0, 5, 5, 5], 1), [[0, 0, 1], [0; 3]]);
        assert_eq!(counted(&[0, 0], &[], &[5, 0], 0), [[0; 3]; 2]);
    }

    #[test]
    fn means_leave_out_absent_classes() {
        let mut counts = PanopticCounts::new(3);
        counts
            .add(&[1, 1, 2, 2], &of(&[(1, 0), (2, 1)]), &[1, 1, 3, 0], &of(&[(1, 0), (3, 0)]))
            .unwrap();
        let scores: Vec<_> = counts.classes().iter().map(ClassCounts::score).collect();
        assert_eq!((scores[0].pq, scores[0].sq, scores[0].rq), (2.0 / 3.0, 1.0, 2.0 / 3.0));
        assert_eq!((scores[1].pq, scores[1].sq), (0.0, 0.0));
        assert!(scores[2].pq.is_nan());
        assert_eq!(mean(counts.classes()).pq, 1.0 / 3.0);
        assert!(mean(&[]).rq.is_nan());

        let mut twice = counts.clone();
        twice.add_counts(&counts);
        assert_eq!((twice.classes()[0].matched, twice.classes()[0].score()), (2, scores[0]));
    }

    fn fault_of(truth: &[u32], predicted: &[u32], found: &[(u32, usize)]) -> SegmentFault {
        let mut counts = PanopticCounts::new(2);
        let fault = counts.add(truth, &of(&[(1, 0)]), predicted, &of(found)).unwrap_err();
        assert_eq!(counts, PanopticCounts::new(2));
        fault
    }

    #[test]
    fn faults_are_found() {
        assert_eq!(fault_of(&[1, 1], &[4, 4], &[]), SegmentFault::Unlisted { id: 4, pixels: 2 });
        assert_eq!(fault_of(&[1, 1], &[4, 4], &[(4, 0), (5, 0)]), SegmentFault::Empty(5));
        assert_eq!(fault_of(&[1, 1], &[4, 4], &[(4, 0), (4, 1)]), SegmentFault::Double(4));
        assert_eq!(fault_of(&[1, 1], &[4, 4], &[(0, 0)]), SegmentFault::Void);
        assert_eq!(
            fault_of(&[1, 1], &[4, 4], &[(4, 2)]),
            SegmentFault::Class { id: 4, class: 2, classes: 2 }
        );
        assert_eq!(fault_of(&[1], &[4, 4], &[(4, 0)]), SegmentFault::Size { truth: 1, predicted: 2 });
        assert_eq!(fault_of(&[0], &[0], &[]), SegmentFault::Empty(1));
    }
}
