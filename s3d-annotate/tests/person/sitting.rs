//! What a simulated person has done.

use std::collections::BTreeMap;

/// What the person has done.
#[derive(Clone, Debug)]
pub(crate) struct Sitting {
    /// The things of the scene.
    pub(crate) things: usize,
    /// The share of the surface that had the right instance after each stroke; the first entry is before any.
    pub(crate) right: Vec<f64>,
    /// The same, if a face that lies over a border is right with the instance of any of its things.
    pub(crate) either: Vec<f64>,
    /// The share of the surface in such faces.
    pub(crate) mixed: f64,
    /// The number of strokes of each kind.
    pub(crate) kinds: BTreeMap<&'static str, usize>,
    /// The share of the surface that is of the largest thing in its segment, before the work.
    pub(crate) purity_before: f64,
    /// The same of patches in the end, which are segments divided by cuts.
    pub(crate) purity_after: f64,
}

impl Sitting {
    /// The strokes until this share is right.
    pub(crate) fn strokes_to(&self, share: f64) -> Option<usize> {
        self.right.iter().position(|right| *right >= share)
    }

    /// The same, with faces over a border right by any of their things.
    pub(crate) fn strokes_to_either(&self, share: f64) -> Option<usize> {
        self.either.iter().position(|right| *right >= share)
    }
}
