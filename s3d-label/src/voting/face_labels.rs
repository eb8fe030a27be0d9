//! What a vote says of each face.

use crate::{FaceVotes, LabelId, LabelTable, VoteError, VoteReport, Votes};

/// The labels of a mesh's faces, and how clearly each was voted for.
///
/// ```
/// use s3d_label::{FaceLabels, LabelId, LabelTable, Votes};
///
/// let table = LabelTable::from_labels(["chair_1_office_1_1".parse()?, "wall_1_office_1_1".parse()?])?;
/// let mut votes = Votes::new(3);
/// for (face, label) in [(0, 2), (0, 2), (0, 1), (2, 1)] {
///     votes.add(face, LabelId(label), 0.001);
/// }
/// let labels = FaceLabels::new(votes);
/// assert_eq!(labels.label_of_face(), [2, 0, 1].map(LabelId));
/// assert_eq!(labels.votes_of(0).map(|face| face.margin()), Some(1));
/// assert_eq!(labels.votes_of(1), None);
/// let report = labels.report(&table)?;
/// assert_eq!((report.total.faces, report.total.contested, report.faces_without_vote), (2, 1, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct FaceLabels {
    label_of_face: Vec<LabelId>,
    votes: Votes,
}

impl FaceLabels {
    /// The labels that win, from all votes.
    pub fn new(votes: Votes) -> Self {
        Self { label_of_face: votes.label_of_face(), votes }
    }

    /// The label of each face of the mesh: the most frequent among its votes, the smallest of equally
    /// frequent ones, and [`LabelId::NULL`] without a vote.
    pub fn label_of_face(&self) -> &[LabelId] {
        &self.label_of_face
    }

    /// The same; drops the votes.
    pub fn into_label_of_face(self) -> Vec<LabelId> {
        self.label_of_face
    }

    /// How many faces the mesh has, those without a vote included.
    pub fn len(&self) -> usize {
        self.label_of_face.len()
    }

    /// Whether the mesh has no face.
    pub fn is_empty(&self) -> bool {
        self.label_of_face.is_empty()
    }

    /// How the vote for a face went: winner, runner-up, distances. `None` if nobody voted for the face, and
    /// if there is no such face.
    pub fn votes_of(&self, face: u32) -> Option<FaceVotes> {
        ((face as usize) < self.len())
            .then(|| self.votes.of_face(face))
            .flatten()
    }

    /// The same of each face, in their order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Option<FaceVotes>> {
        (0..self.len() as u32).map(|face| self.votes.of_face(face))
    }

    /// All votes: also those for other labels than winner and runner-up, and how many points each label has.
    pub fn votes(&self) -> &Votes {
        &self.votes
    }

    /// Sums the votes up by room and by class, for labels of `table`.
    ///
    /// # Errors
    /// [`VoteError::NoSuchLabel`] if there are votes for a label that is not in the table.
    pub fn report(&self, table: &LabelTable) -> Result<VoteReport, VoteError> {
        VoteReport::new(&self.votes, table)
    }
}
