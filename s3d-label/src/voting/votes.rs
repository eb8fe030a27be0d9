//! Votes of annotated points for the labels of faces.

#![expect(
    clippy::indexing_slicing,
    clippy::expect_used,
    reason = "speed, since every point of a scan votes here: the caller gives valid faces (see Panics), and \
              heads are places of entries"
)]

use crate::LabelId;

/// Stands for an index into the entries at the end of a list.
const END: u32 = u32::MAX;

/// The options of a vote.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VoteOptions {
    /// A point farther than this from its nearest face, in metres, counts as far. It still votes.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "as_data::number"))]
    pub far_m: f32,
}

impl Default for VoteOptions {
    /// 5 cm: more than the noise of a scanner, less than the depth of a shelf.
    fn default() -> Self {
        Self { far_m: 0.05 }
    }
}

/// The points of a label over all faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PointTally {
    /// The number of points.
    pub points: u64,
    /// The number of points farther from their face than [`VoteOptions::far_m`].
    pub far: u64,
}

/// The result of the vote for a face. There is at least one vote.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FaceVotes {
    /// The label with the most votes. The smallest label wins a tie.
    pub label: LabelId,
    /// The number of votes for the label, at least 1.
    pub votes: u64,
    /// The label with the second most votes. The smallest label wins a tie. [`LabelId::NULL`] if all votes
    /// agree.
    pub runner_up: LabelId,
    /// The number of votes for the runner-up, at most [`votes`](Self::votes); 0 if all votes agree.
    pub runner_up_votes: u64,
    /// The number of votes for all labels together.
    pub total: u64,
    /// The distance of the farthest voter from the face, in metres. Infinite if a distance was NaN.
    pub farthest_m: f32,
    /// The mean distance of the voters from the face, in metres. Distances are summed in whole nanometres, so
    /// the order does not matter. Infinite if the sum is above 1.8·10¹⁰ m.
    pub mean_m: f32,
}

impl FaceVotes {
    /// Returns the number of votes by which the label won; 0 in a tie.
    pub fn margin(&self) -> u64 {
        self.votes - self.runner_up_votes
    }

    /// Returns the share of the votes of the winner, in (0, 1].
    pub fn share(&self) -> f64 {
        self.votes as f64 / self.total as f64
    }
}

/// Counts the votes for each face of a mesh. A point votes for its nearest face, with its label.
///
/// [`Votes::add`] takes the points one at a time, in any order, and keeps only counts. Several counts over
/// the same faces can be [merged](Votes::merge). The result does not depend on the order of points and
/// merges. Memory: 16 bytes per face, and 16 bytes for each pair of a face and a label that occurs. A
/// [`Labeler`](crate::Labeler) finds the faces of points and counts them here. Source: `s3d_io::formats`,
/// "What is written": voting.
///
/// ```
/// use s3d_label::{LabelId, Votes};
///
/// let wall = LabelId(3);
/// let door = LabelId(1);
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
    /// The points of each label, up to the largest label that occurred.
    tallies: Vec<PointTally>,
    unlabeled: u64,
}

/// The votes for a face: a list of entries, and the distances of its voters.
#[derive(Clone, Copy, Debug)]
struct Face {
    /// The first entry, or [`END`].
    head: u32,
    farthest_m: f32,
    /// The sum of the distances in whole nanometres, which is the same in any order. `u64::MAX` on overflow.
    sum_nm: u64,
}

impl Face {
    const EMPTY: Self = Self { head: END, farthest_m: 0.0, sum_nm: 0 };
}

/// The votes for one label of a face, and the place of the next entry of the face.
#[derive(Clone, Copy, Debug)]
struct Entry {
    votes: u64,
    label: LabelId,
    next: u32,
}

impl Votes {
    /// Starts without votes, for a mesh of `face_count` faces.
    pub fn new(face_count: usize) -> Self {
        Self::with_options(face_count, VoteOptions::default())
    }

    /// Starts without votes, for a mesh of `face_count` faces, with these options.
    ///
    /// # Panics
    /// If `far_m` is NaN.
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

    /// Adds the vote of a point with `label` for `face`. The face is `distance_m` metres away, at least 0;
    /// NaN counts as infinite. A point without a label ([`LabelId::NULL`]) does not vote and is only counted,
    /// in [`Votes::unlabeled_points`].
    ///
    /// # Panics
    /// If there is no face `face`, or if there are more than 2³² − 1 pairs of a face and a label.
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
        // The cast saturates.
        of_face.sum_nm = of_face
            .sum_nm
            .saturating_add((f64::from(distance_m) * 1e9 + 0.5) as u64);
        self.count(face, label, 1);
    }

    /// Adds the votes of `other`, as if its points had been added here.
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
        let mut before = END;
        let mut at = head;
        while at != END {
            let entry = self.entries[at as usize];
            if entry.label == label {
                self.entries[at as usize].votes += votes;
                if before != END {
                    // Move the entry to the front. Points come instance by instance, so the next one probably
                    // has this label.
                    self.entries[before as usize].next = entry.next;
                    self.entries[at as usize].next = head;
                    self.faces[face as usize].head = at;
                }
                return;
            }
            before = at;
            at = entry.next;
        }

        let new = u32::try_from(self.entries.len()).ok().filter(|&i| i != END);
        self.faces[face as usize].head = new.expect("too many pairs of a face and a label");
        self.entries.push(Entry { votes, label, next: head });
    }

    fn entries_of(&self, face: u32) -> impl Iterator<Item = Entry> {
        let entry = |i: u32| (i != END).then(|| self.entries[i as usize]);
        std::iter::successors(entry(self.faces[face as usize].head), move |e| entry(e.next))
    }

    /// Returns the number of faces, with or without votes.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Returns the options of the vote.
    pub fn options(&self) -> VoteOptions {
        self.options
    }

    /// Returns the points of `label`, over all faces.
    pub fn points_of(&self, label: LabelId) -> PointTally {
        self.tallies.get(label.index()).copied().unwrap_or_default()
    }

    /// Returns the largest label with a vote, or [`LabelId::NULL`] if there is no vote.
    pub fn largest_label(&self) -> LabelId {
        LabelId(self.tallies.len().saturating_sub(1) as u32)
    }

    /// Returns the number of points without a label.
    pub fn unlabeled_points(&self) -> u64 {
        self.unlabeled
    }

    /// Returns the labels with votes for a face, ascending, each with its number of votes.
    ///
    /// # Panics
    /// If there is no face `face`.
    pub fn votes_of(&self, face: u32) -> Vec<(LabelId, u64)> {
        let mut votes: Vec<(LabelId, u64)> = self.entries_of(face).map(|e| (e.label, e.votes)).collect();
        votes.sort_unstable();
        votes
    }

    /// Returns the result of the vote for a face, or `None` if no point voted for it.
    ///
    /// # Panics
    /// If there is no face `face`.
    pub fn of_face(&self, face: u32) -> Option<FaceVotes> {
        let mut first = (0, LabelId::NULL);
        let mut second = (0, LabelId::NULL);
        let mut total = 0;
        for Entry { votes, label, .. } in self.entries_of(face) {
            total += votes;
            let entry = (votes, label);
            if is_before(entry, first) {
                second = first;
                first = entry;
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

    /// Returns the label of each face: the label with the most votes. The smallest label wins a tie.
    /// [`LabelId::NULL`] if the face has no vote.
    pub fn label_of_face(&self) -> Vec<LabelId> {
        (0..self.faces.len() as u32)
            .map(|face| self.of_face(face).map_or(LabelId::NULL, |votes| votes.label))
            .collect()
    }
}

fn is_before(a: (u64, LabelId), b: (u64, LabelId)) -> bool {
    a.0 > b.0 || (a.0 == b.0 && a.1 < b.1)
}

#[cfg(feature = "serde")]
mod as_data {
    use serde::{Deserialize, Deserializer, de::Error};

    /// Reads a number that is not NaN, which formats other than JSON can hold.
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

    fn most_frequent(labels: &BTreeMap<u32, u64>) -> Option<u32> {
        let most = labels.values().copied().max()?;
        labels
            .iter()
            .find(|(_, count)| **count == most)
            .map(|(label, _)| *label)
    }

    /// The plain reference: a map of all votes for each face.
    fn reference(face_count: usize, points: &[(u32, u32)]) -> Vec<LabelId> {
        let mut counts: Vec<BTreeMap<u32, u64>> = vec![BTreeMap::new(); face_count];
        for &(face, label) in points.iter().filter(|(_, label)| *label != 0) {
            *counts[face as usize].entry(label).or_default() += 1;
        }
        counts
            .iter()
            .map(|labels| LabelId(most_frequent(labels).unwrap_or(0)))
            .collect()
    }

    fn votes(face_count: usize, points: &[(u32, u32)]) -> Votes {
        let mut votes = Votes::new(face_count);
        for &(face, label) in points {
            // An `f32` cannot sum these distances without rounding.
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
