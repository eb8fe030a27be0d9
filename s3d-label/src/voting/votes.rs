//! Votes of annotated points for the labels of faces.

#![expect(
    clippy::indexing_slicing,
    clippy::expect_used,
    reason = "every point of a scan votes here: faces are a caller's (see Panics), heads point to entries"
)]

use crate::LabelId;

/// In place of an index into the entries: the list ends here.
const END: u32 = u32::MAX;

/// What is counted beside the votes themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VoteOptions {
    /// A point farther from its nearest face than this, in metres, is counted as far. It votes all the same.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "as_data::number"))]
    pub far_m: f32,
}

impl Default for VoteOptions {
    /// 5 cm: more than a scanner's noise, less than the depth of a shelf.
    fn default() -> Self {
        Self { far_m: 0.05 }
    }
}

/// The points of one label, wherever they voted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PointTally {
    /// How many there are.
    pub points: u64,
    /// How many are farther from their face than [`VoteOptions::far_m`].
    pub far: u64,
}

/// How the vote for the label of one face went. There is at least one vote.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FaceVotes {
    /// The most frequent label, the smallest of equally frequent ones.
    pub label: LabelId,
    /// Its votes, at least 1.
    pub votes: u64,
    /// The second most frequent label, the smallest of equally frequent ones; [`LabelId::NULL`] if all votes
    /// agree.
    pub runner_up: LabelId,
    /// Its votes, at most [`votes`](Self::votes); 0 if all votes agree.
    pub runner_up_votes: u64,
    /// The votes for all labels together.
    pub total: u64,
    /// How far the farthest voter is from the face, metres. Infinite if a distance was no number.
    pub farthest_m: f32,
    /// The mean distance of the voters from the face, metres. Distances are summed in whole nanometres, so
    /// that the sum is the same for any order; infinite if the sum is above 1.8·10¹⁰ m.
    pub mean_m: f32,
}

impl FaceVotes {
    /// By how many votes the label won; 0 in a tie.
    pub fn margin(&self) -> u64 {
        self.votes - self.runner_up_votes
    }

    /// The winner's share of the votes, in (0, 1].
    pub fn share(&self) -> f64 {
        self.votes as f64 / self.total as f64
    }
}

/// Counts, for each face of a mesh, the labels of the points to which it is the nearest.
///
/// Points stream through [`Votes::add`], one at a time and in any order; nothing of them is kept but counts.
/// Several counts over the same faces [`merge`](Votes::merge) into one. Every result is the same for any
/// order of points and merges. Memory: 16 bytes a face, and 16 bytes for each pair of a face and a label that
/// occurs. Source: formats.md, "What is written": voting. A [`Labeler`](crate::Labeler) finds the faces of
/// points and counts them here.
///
/// ```
/// use s3d_label::{LabelId, Votes};
///
/// let (wall, door) = (LabelId(3), LabelId(1));
/// let mut votes = Votes::new(2);
/// for (label, distance_m) in [(wall, 0.002), (door, 0.001), (wall, 0.006)] {
///     votes.add(0, label, distance_m);
/// }
/// let face = votes.of_face(0).unwrap();
/// assert_eq!((face.label, face.votes, face.runner_up, face.total), (wall, 2, door, 3));
/// assert_eq!((face.margin(), face.farthest_m, face.mean_m), (1, 0.006, 0.003));
/// assert_eq!(votes.label_of_face(), [wall, LabelId::NULL]);
/// ```
#[derive(Clone, Debug)]
pub struct Votes {
    options: VoteOptions,
    faces: Vec<Face>,
    entries: Vec<Entry>,
    /// By label index; as long as the largest index that occurred asks for.
    tallies: Vec<PointTally>,
    unlabeled: u64,
}

/// Where a face's list of entries starts, and how far its voters are.
#[derive(Clone, Copy, Debug)]
struct Face {
    /// The first entry, or [`END`].
    head: u32,
    farthest_m: f32,
    /// In whole nanometres, as their sum is the same in any order; `u64::MAX` where that is too small.
    sum_nm: u64,
}

impl Face {
    const EMPTY: Self = Self { head: END, farthest_m: 0.0, sum_nm: 0 };
}

/// The votes for one label of one face, and where the next of that face is.
#[derive(Clone, Copy, Debug)]
struct Entry {
    votes: u64,
    label: LabelId,
    next: u32,
}

impl Votes {
    /// No votes yet, for a mesh of `face_count` faces.
    pub fn new(face_count: usize) -> Self {
        Self::with_options(face_count, VoteOptions::default())
    }

    /// No votes yet, for a mesh of `face_count` faces.
    ///
    /// # Panics
    /// If `far_m` is not a number.
    pub fn with_options(face_count: usize, options: VoteOptions) -> Self {
        assert!(!options.far_m.is_nan(), "no distance is farther than {} m", options.far_m);
        Self {
            options,
            faces: vec![Face::EMPTY; face_count],
            entries: Vec::new(),
            tallies: Vec::new(),
            unlabeled: 0,
        }
    }

    /// A point with `label` votes for `face`, which is `distance_m` metres away, at least 0 (a distance that
    /// is not a number counts as infinite). A point without a label ([`LabelId::NULL`]) does not vote: it is
    /// only counted, in [`Votes::unlabeled_points`].
    ///
    /// # Panics
    /// If there is no face `face`, or above 2³² − 1 pairs of a face and a label.
    #[inline]
    pub fn add(&mut self, face: u32, label: LabelId, distance_m: f32) {
        assert!((face as usize) < self.faces.len(), "face {face} of {}", self.faces.len());
        if label.is_null() {
            self.unlabeled += 1;
            return;
        }
        let distance_m = if distance_m.is_nan() { f32::INFINITY } else { distance_m };
        let far = u64::from(distance_m > self.options.far_m);
        self.tally(label, PointTally { points: 1, far });
        let of_face = &mut self.faces[face as usize];
        of_face.farthest_m = of_face.farthest_m.max(distance_m);
        // A cast takes what is too large for a u64 to the largest one.
        of_face.sum_nm = of_face
            .sum_nm
            .saturating_add((f64::from(distance_m) * 1e9 + 0.5) as u64);
        self.count(face, label, 1);
    }

    /// Takes over the votes of `other`, as if its points had been added here.
    ///
    /// # Panics
    /// If `other` has another number of faces or other options.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!(self.faces.len(), other.faces.len(), "votes for meshes of different size");
        assert_eq!(self.options, other.options, "votes counted under different options");
        self.unlabeled += other.unlabeled;
        for (label, &tally) in other.tallies.iter().enumerate() {
            self.tally(LabelId(label as u32), tally);
        }
        for (face, of_other) in (0u32..).zip(&other.faces) {
            let of_face = &mut self.faces[face as usize];
            of_face.farthest_m = of_face.farthest_m.max(of_other.farthest_m);
            of_face.sum_nm = of_face.sum_nm.saturating_add(of_other.sum_nm);
            for entry in other.entries_of(face) {
                self.count(face, entry.label, entry.votes);
            }
        }
    }

    fn tally(&mut self, label: LabelId, tally: PointTally) {
        if tally.points == 0 {
            return;
        }
        if self.tallies.len() <= label.index() {
            self.tallies.resize(label.index() + 1, PointTally::default());
        }
        let sum = &mut self.tallies[label.index()];
        sum.points += tally.points;
        sum.far += tally.far;
    }

    fn count(&mut self, face: u32, label: LabelId, votes: u64) {
        let head = self.faces[face as usize].head;
        let (mut before, mut at) = (END, head);
        while at != END {
            let entry = self.entries[at as usize];
            if entry.label == label {
                self.entries[at as usize].votes += votes;
                if before != END {
                    // To the front: points come instance by instance, so that the next one probably has this
                    // label.
                    self.entries[before as usize].next = entry.next;
                    self.entries[at as usize].next = head;
                    self.faces[face as usize].head = at;
                }
                return;
            }
            (before, at) = (at, entry.next);
        }
        let new = u32::try_from(self.entries.len()).ok().filter(|&i| i != END);
        self.faces[face as usize].head = new.expect("too many pairs of a face and a label");
        self.entries.push(Entry { votes, label, next: head });
    }

    fn entries_of(&self, face: u32) -> impl Iterator<Item = Entry> {
        let entry = |i: u32| (i != END).then(|| self.entries[i as usize]);
        std::iter::successors(entry(self.faces[face as usize].head), move |e| entry(e.next))
    }

    /// Number of faces, those without a vote included.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// The options that the votes are counted under.
    pub fn options(&self) -> VoteOptions {
        self.options
    }

    /// The points of `label`, over all faces.
    pub fn points_of(&self, label: LabelId) -> PointTally {
        self.tallies.get(label.index()).copied().unwrap_or_default()
    }

    /// The largest label that any point voted for, [`LabelId::NULL`] if there is no vote.
    pub fn largest_label(&self) -> LabelId {
        LabelId(self.tallies.len().saturating_sub(1) as u32)
    }

    /// Points that came without a label.
    pub fn unlabeled_points(&self) -> u64 {
        self.unlabeled
    }

    /// The labels that a face was voted, by index, each with its votes.
    ///
    /// # Panics
    /// If there is no face `face`.
    pub fn votes_of(&self, face: u32) -> Vec<(LabelId, u64)> {
        let mut votes: Vec<(LabelId, u64)> = self.entries_of(face).map(|e| (e.label, e.votes)).collect();
        votes.sort_unstable();
        votes
    }

    /// How the vote for a face went; `None` if nobody voted for the face.
    ///
    /// # Panics
    /// If there is no face `face`.
    pub fn of_face(&self, face: u32) -> Option<FaceVotes> {
        let is_before = |a: (u64, LabelId), b: (u64, LabelId)| a.0 > b.0 || (a.0 == b.0 && a.1 < b.1);
        let none = (0, LabelId::NULL);
        let (mut first, mut second, mut total) = (none, none, 0);
        for Entry { votes, label, .. } in self.entries_of(face) {
            total += votes;
            let entry = (votes, label);
            if is_before(entry, first) {
                (first, second) = (entry, first);
            } else if is_before(entry, second) {
                second = entry;
            }
        }
        let Face { farthest_m, sum_nm, .. } = self.faces[face as usize];
        let mean_m = if sum_nm == u64::MAX {
            f64::INFINITY
        } else {
            sum_nm as f64 / total as f64 * 1e-9
        };
        (total > 0).then_some(FaceVotes {
            label: first.1,
            votes: first.0,
            runner_up: second.1,
            runner_up_votes: second.0,
            total,
            farthest_m,
            mean_m: mean_m as f32,
        })
    }

    /// The label of each face: the most frequent among its votes, the smallest of equally frequent ones, and
    /// [`LabelId::NULL`] without a vote.
    pub fn label_of_face(&self) -> Vec<LabelId> {
        (0..self.faces.len() as u32)
            .map(|face| self.of_face(face).map_or(LabelId::NULL, |votes| votes.label))
            .collect()
    }
}

#[cfg(feature = "serde")]
mod as_data {
    use serde::{Deserialize, Deserializer, de::Error};

    /// Formats other than JSON have numbers that are none.
    pub(super) fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
        let number = f32::deserialize(deserializer)?;
        if number.is_nan() {
            Err(D::Error::custom("a distance that is not a number"))
        } else {
            Ok(number)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// The plain way: every vote in a map, every face's labels looked through.
    fn reference(face_count: usize, points: &[(u32, u32)]) -> Vec<LabelId> {
        let mut counts: Vec<BTreeMap<u32, u64>> = vec![BTreeMap::new(); face_count];
        for &(face, label) in points.iter().filter(|(_, label)| *label != 0) {
            *counts[face as usize].entry(label).or_default() += 1;
        }
        let most = |labels: &BTreeMap<u32, u64>| {
            let most = labels.values().copied().max()?;
            labels
                .iter()
                .find(|(_, count)| **count == most)
                .map(|(label, _)| *label)
        };
        counts.iter().map(|labels| LabelId(most(labels).unwrap_or(0))).collect()
    }

    fn votes(face_count: usize, points: &[(u32, u32)]) -> Votes {
        let mut votes = Votes::new(face_count);
        for &(face, label) in points {
            // Distances that no f32 sums without rounding.
            votes.add(face, LabelId(label), 0.1 + 0.013 * (label + 7 * face) as f32);
        }
        votes
    }

    #[test]
    fn the_most_frequent_label_wins_and_the_smaller_of_two() {
        let votes = votes(5, &[(0, 9), (0, 4), (0, 9), (1, 7), (1, 3), (3, 2), (3, 0), (3, 0), (4, 0)]);
        assert_eq!(votes.label_of_face(), [9, 3, 0, 2, 0].map(LabelId));
        let face = votes.of_face(0).unwrap();
        assert_eq!((face.label, face.votes, face.total), (LabelId(9), 2, 3));
        assert_eq!((face.runner_up, face.runner_up_votes, face.margin()), (LabelId(4), 1, 1));
        assert_eq!(face.share(), 2.0 / 3.0);
        let alone = votes.of_face(3).unwrap();
        assert_eq!((alone.runner_up, alone.runner_up_votes, alone.margin()), (LabelId::NULL, 0, 1));
        assert_eq!(votes.of_face(2), None);
        assert_eq!(votes.votes_of(1), [(LabelId(3), 1), (LabelId(7), 1)]);
        assert_eq!(votes.unlabeled_points(), 3);
        assert_eq!(votes.largest_label(), LabelId(9));
    }

    #[test]
    fn far_points_are_counted_by_their_label_and_vote() {
        let mut votes = Votes::with_options(1, VoteOptions { far_m: 0.1 });
        for distance_m in [0.0, 0.1, 0.100001, f32::INFINITY, f32::NAN] {
            votes.add(0, LabelId(2), distance_m);
        }
        votes.add(0, LabelId(1), 0.05);
        assert_eq!(votes.points_of(LabelId(2)), PointTally { points: 5, far: 3 });
        assert_eq!(votes.points_of(LabelId(1)), PointTally { points: 1, far: 0 });
        assert_eq!(votes.points_of(LabelId(7)), PointTally::default());
        assert_eq!(votes.label_of_face(), [LabelId(2)]);
    }

    #[test]
    fn distances_are_those_of_all_voters_of_a_face() {
        let mut votes = Votes::new(3);
        for (face, label, distance_m) in [(0, 1, 0.25), (0, 2, 0.5), (0, 0, 9.0), (0, 1, 0.0), (1, 1, 1e30)] {
            votes.add(face, LabelId(label), distance_m);
        }
        votes.add(1, LabelId(2), 3.0);
        votes.add(2, LabelId(2), f32::NAN);
        let distances = |face| votes.of_face(face).map(|f| (f.farthest_m, f.mean_m)).unwrap();
        assert_eq!(distances(0), (0.5, 0.25));
        assert_eq!(distances(1), (1e30, f32::INFINITY));
        assert_eq!(distances(2), (f32::INFINITY, f32::INFINITY));
    }

    #[test]
    #[should_panic(expected = "face 3 of 3")]
    fn a_face_out_of_range_is_a_callers_mistake() {
        Votes::new(3).add(3, LabelId(1), 0.0);
    }

    #[test]
    #[should_panic(expected = "different size")]
    fn votes_for_different_meshes_do_not_merge() {
        Votes::new(3).merge(&Votes::new(2));
    }

    proptest! {
        #[test]
        fn agrees_with_the_reference_in_any_order_and_split(
            points in prop::collection::vec((0u32..6, 0u32..5), 0..200),
            turn in 0usize..200,
            cut in 0usize..200,
        ) {
            let expected = reference(6, &points);
            let whole = votes(6, &points);
            prop_assert_eq!(whole.label_of_face(), expected.clone());

            let mut other = points.clone();
            other.rotate_left(turn % points.len().max(1));
            other.reverse();
            let (front, back) = other.split_at(cut.min(other.len()));
            let mut merged = votes(6, front);
            merged.merge(&votes(6, back));
            prop_assert_eq!(merged.label_of_face(), expected);
            prop_assert_eq!(merged.unlabeled_points(), whole.unlabeled_points());
            prop_assert_eq!(merged.largest_label(), whole.largest_label());
            for label in (0..5).map(LabelId) {
                prop_assert_eq!(merged.points_of(label), whole.points_of(label));
            }
            for face in 0..6 {
                prop_assert_eq!(merged.votes_of(face), whole.votes_of(face));
                prop_assert_eq!(merged.of_face(face), whole.of_face(face));
            }
            prop_assert!(merged.entries.len() <= 6 * 4);
        }
    }
}
