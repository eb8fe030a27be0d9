//! Finds exact medians of more angles than fit into memory, in two passes.

use crate::images::normal::metrics::degrees;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::ops::RangeInclusive;
use std::sync::{Mutex, PoisonError};

/// The number of steps of the first pass.
const STEPS: usize = 1 << 16;

/// Returns the step of an angle in degrees.
fn step(angle: f64) -> usize {
    ((angle * (STEPS as f64 / 180.0)) as usize).min(STEPS - 1)
}

/// The first pass: counts the angles of each fold in each step.
pub(super) struct Medians(Vec<Mutex<Vec<u64>>>);

impl Medians {
    pub(super) fn new(folds: usize) -> Self {
        Self((0..folds).map(|_| Mutex::new(vec![0; STEPS])).collect())
    }

    /// Counts the angles of an image of a fold, 0 to 180°.
    pub(super) fn count(&self, fold: usize, angles: &[f64]) {
        let mut counts = self.0[fold].lock().unwrap_or_else(PoisonError::into_inner);
        angles.iter().for_each(|angle| counts[step(*angle)] += 1);
    }

    /// Begins the second pass, which needs the cosines of the same angles.
    pub(super) fn search(self) -> Search {
        let folds: Vec<Vec<u64>> = self
            .0
            .into_iter()
            .map(|m| m.into_inner().unwrap_or_else(PoisonError::into_inner))
            .collect();
        let all = (0..STEPS)
            .map(|at| folds.iter().map(|counts| counts[at]).sum())
            .collect();
        Search(
            folds
                .into_iter()
                .chain([all])
                .map(|counts| Group::of(&counts))
                .collect(),
        )
    }
}

/// The second pass: collects the angles in the steps that hold the middle angles, for each fold and for all.
pub(super) struct Search(Vec<Group>);

struct Group {
    steps: RangeInclusive<usize>,
    /// The range of the cosines of their angles, a little wider. It spares most angles an arc cosine.
    cosines: RangeInclusive<f64>,
    /// The places of the two middle angles among the angles in these steps; `None` without angles.
    middle: Option<[u64; 2]>,
    /// The count of each angle, by its bits, which order angles from 0 on.
    angles: Mutex<BTreeMap<u64, u64>>,
}

impl Group {
    fn of(counts: &[u64]) -> Self {
        let total: u64 = counts.iter().sum();
        let Some(last) = total.checked_sub(1) else { return Self::new(0..=0, None) };
        let middle = [last / 2, total / 2];

        let mut before = 0;
        let mut first: Option<(usize, u64)> = None;
        for (at, count) in counts.iter().enumerate() {
            if first.is_none() && before + count > middle[0] {
                first = Some((at, before));
            }
            if let Some((start, below)) = first.filter(|_| before + count > middle[1]) {
                let middle = Some(middle.map(|place| place - below));
                return Self::new(start..=at, middle);
            }
            before += count;
        }
        Self::new(0..=0, None)
    }

    fn new(steps: RangeInclusive<usize>, middle: Option<[u64; 2]>) -> Self {
        // Wider, since rounding moves cosines, even beyond 1.
        let cosines = cosine_of(steps.end() + 1) - 1e-12..=cosine_of(*steps.start()) + 1e-12;
        Self { steps, cosines, middle, angles: Mutex::default() }
    }
}

fn cosine_of(step: usize) -> f64 {
    libm::cos(step as f64 * (PI / STEPS as f64))
}

impl Search {
    /// Looks at the angles of an image of a fold, given their cosines.
    pub(super) fn look(&self, fold: usize, cosines: &[f64]) {
        for group in [fold, self.0.len() - 1].into_iter().filter_map(|at| self.0.get(at)) {
            let near = cosines.iter().filter(|cosine| group.cosines.contains(cosine));
            let inside = near
                .map(|cosine| degrees(*cosine))
                .filter(|angle| group.steps.contains(&step(*angle)));
            let mut inside: Vec<u64> = inside.map(f64::to_bits).collect();
            inside.sort_unstable();
            let mut counts = group.angles.lock().unwrap_or_else(PoisonError::into_inner);
            for same in inside.chunk_by(|a, b| a == b) {
                *counts.entry(same[0]).or_default() += same.len() as u64;
            }
        }
    }

    /// Returns the median of each fold, then the median of all: the mean of both middle angles, NaN without
    /// angles.
    pub(super) fn found(self) -> Vec<f64> {
        self.0
            .into_iter()
            .map(|group| {
                let counts = group.angles.into_inner().unwrap_or_else(PoisonError::into_inner);
                let at = |place: u64| {
                    let ends = counts.iter().scan(0, |end, (bits, count)| {
                        *end += count;
                        Some((*end, *bits))
                    });
                    ends.into_iter()
                        .find(|(end, _)| *end > place)
                        .map_or(f64::NAN, |(_, bits)| f64::from_bits(bits))
                };
                group.middle.map_or(f64::NAN, |[low, high]| (at(low) + at(high)) / 2.0)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::images::median_of_angles;

    fn angles(cosines: &[f64]) -> Vec<f64> {
        cosines.iter().copied().map(degrees).collect()
    }

    #[test]
    fn medians_agree_with_sorted_angles() {
        let cosines: [&[&[f64]]; 4] = [
            &[&[0.9, 1.0 + f64::EPSILON], &[0.0, 0.0, -1.0]],
            &[&[0.5, 0.25]],
            &[],
            &[&[1.0], &[], &[1.0, -0.3, 1.0]],
        ];
        let medians = Medians::new(cosines.len());
        let each = |f: &dyn Fn(usize, &[f64])| {
            for (fold, images) in cosines.iter().enumerate() {
                images.iter().for_each(|image| f(fold, image));
            }
        };

        each(&|fold, image| medians.count(fold, &angles(image)));
        let search = medians.search();
        each(&|fold, image| search.look(fold, image));
        let found = search.found();

        let sorted = |cosines: &[f64]| median_of_angles(&mut angles(cosines)).unwrap_or(f64::NAN);
        let mut expected: Vec<f64> = cosines.iter().map(|images| sorted(&images.concat())).collect();
        expected.push(sorted(&cosines.concat().concat()));
        assert_eq!((expected[0], expected[3]), (90.0, 0.0));
        for (ours, sorted) in found.iter().zip(&expected) {
            assert!(ours == sorted || ours.is_nan() && sorted.is_nan(), "{found:?} {expected:?}");
        }
    }
}
