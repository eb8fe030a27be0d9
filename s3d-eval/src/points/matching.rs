//! True and predicted instances of a room, and the points that they share.

use std::collections::{BTreeMap, HashMap};

/// The true instances with which a prediction shares points: the index of each, and the number of shared
/// points.
pub(super) type Overlaps = Vec<(usize, u64)>;

/// An annotated instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrueInstance {
    /// Its class, from 0.
    pub class: usize,
    /// The number of its points.
    pub points: u64,
}

/// A predicted instance.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictedInstance {
    /// Its class, from 0.
    pub class: usize,
    /// The confidence: larger if more certain, and not NaN.
    pub score: f64,
    /// The number of its points.
    pub points: u64,
    /// The number of its points that are void, which means without a true class.
    pub void: u64,
    /// The true instances with which it shares points, whatever their class. Each has its index in the list
    /// of true instances, which occurs once, and the number of shared points.
    pub overlaps: Vec<(usize, u64)>,
}

impl PredictedInstance {
    /// Returns the true instances of its class with which it shares points: index, shared points and IoU.
    pub(super) fn of_its_class<'a>(
        &'a self,
        truth: &'a [TrueInstance],
    ) -> impl Iterator<Item = (usize, u64, f64)> + 'a {
        self.overlaps.iter().filter_map(|(at, common)| {
            let instance = truth
                .get(*at)
                .filter(|instance| instance.class == self.class && *common > 0)?;
            let union = (instance.points + self.points).saturating_sub(*common);
            Some((*at, *common, *common as f64 / union as f64))
        })
    }
}

/// A predicted instance as a mask over the points of a room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mask<'a> {
    /// Its class, from 0.
    pub class: usize,
    /// The confidence: larger if more certain, and not NaN.
    pub score: f64,
    /// Whether each point is in it.
    pub inside: &'a [bool],
}

/// Returns the true and the predicted instances of a room whose predictions are masks, which may overlap.
///
/// `truth` has the class (from 0, negative if void) and the instance (negative for none) of each point. A
/// true instance has the class of its first point, and is left out if this point is void. Points beyond the
/// shorter slice do not count.
pub fn instances_of_masks(
    truth: &[(i64, i64)],
    masks: &[Mask<'_>],
) -> (Vec<TrueInstance>, Vec<PredictedInstance>) {
    let (instances, places) = true_instances(truth);
    let predicted = masks.iter().map(|mask| {
        let mut points = 0;
        let mut void = 0;
        let mut overlaps = Vec::new();
        let inside = truth
            .iter()
            .zip(&places)
            .zip(mask.inside)
            .filter(|(_, inside)| **inside);
        for (((class, _), place), _) in inside {
            points += 1;
            void += u64::from(*class < 0);
            place.iter().for_each(|at| count(&mut overlaps, *at, 1));
        }
        PredictedInstance { class: mask.class, score: mask.score, points, void, overlaps: merged(overlaps) }
    });
    let predicted = predicted.collect();
    (instances, predicted)
}

/// Returns the true and the predicted instances of a room whose predictions have an instance for each point.
///
/// Both sides have the class and the instance of each point, negative for none. A predicted instance has the
/// class of most of its points, and the score 0; the lowest class wins a tie. The rest is like in
/// [`instances_of_masks`].
pub fn instances_of_segments(
    truth: &[(i64, i64)],
    predicted: &[(i64, i64)],
) -> (Vec<TrueInstance>, Vec<PredictedInstance>) {
    let (instances, places) = true_instances(truth);
    let mut segments = Segments::default();
    for (place, (class, instance)) in places.iter().zip(predicted) {
        segments.add(*place, *class, *instance);
    }
    (instances, segments.finish())
}

/// Returns the true instances, ordered by number, and the index of the instance of each point.
fn true_instances(truth: &[(i64, i64)]) -> (Vec<TrueInstance>, Vec<Option<usize>>) {
    let mut first: BTreeMap<i64, (i64, u64)> = BTreeMap::new();
    for (class, instance) in truth.iter().filter(|(_, instance)| *instance >= 0) {
        first.entry(*instance).or_insert((*class, 0)).1 += 1;
    }

    let mut instances = Vec::new();
    let mut places = HashMap::new();
    for (instance, (class, points)) in first {
        if let Ok(class) = usize::try_from(class) {
            places.insert(instance, instances.len());
            instances.push(TrueInstance { class, points });
        }
    }
    let of_points = truth
        .iter()
        .map(|(_, instance)| places.get(instance).copied())
        .collect();
    (instances, of_points)
}

/// Counts the points of predicted instances, where each point has an instance.
#[derive(Default)]
pub(super) struct Segments {
    /// The index of each instance in `segments`.
    places: HashMap<i64, usize>,
    /// The points of each instance by class, and the points shared with true instances. Ordered by first
    /// point.
    segments: Vec<(BTreeMap<usize, u64>, Overlaps)>,
}

impl Segments {
    /// Counts a point with its true instance, and its predicted class and instance, negative for none.
    pub(super) fn add(&mut self, truth: Option<usize>, class: i64, instance: i64) {
        if instance < 0 {
            return;
        }
        let next = self.segments.len();
        let place = *self.places.entry(instance).or_insert(next);
        if place == next {
            self.segments.push(Default::default());
        }
        let Some((classes, overlaps)) = self.segments.get_mut(place) else { return };
        *classes.entry(usize::try_from(class).unwrap_or(usize::MAX)).or_default() += 1;
        truth.iter().for_each(|at| count(overlaps, *at, 1));
    }

    /// Returns the predicted instances.
    pub(super) fn finish(self) -> Vec<PredictedInstance> {
        self.segments
            .into_iter()
            .map(|(classes, overlaps)| {
                let most = classes.values().max().copied();
                let class = classes
                    .iter()
                    .find(|(_, points)| Some(**points) == most)
                    .map_or(0, |(class, _)| *class);
                let points = classes.values().sum();
                PredictedInstance { class, score: 0.0, points, void: 0, overlaps: merged(overlaps) }
            })
            .collect()
    }
}

/// Adds points that are shared with a true instance.
pub(super) fn count(overlaps: &mut Overlaps, at: usize, points: u64) {
    match overlaps.last_mut() {
        Some((last, common)) if *last == at => *common += points,
        _ => overlaps.push((at, points)),
    }
}

/// Merges the entries of each true instance.
fn merged(mut overlaps: Overlaps) -> Overlaps {
    overlaps.sort_unstable();
    overlaps.dedup_by(|next, kept| {
        let is_same = next.0 == kept.0;
        kept.1 += if is_same { next.1 } else { 0 };
        is_same
    });
    overlaps
}
