//! The result of a vote for each face.

use crate::{FaceVotes, LabelId, LabelTable, VoteError, VoteReport, Votes};

/// The labels of the faces of a mesh, with the votes behind them.
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
    /// Finds the winning labels.
    pub fn new(votes: Votes) -> Self {
        Self { label_of_face: votes.label_of_face(), votes }
    }

    /// Returns the label of each face of the mesh: the label with the most votes. The smallest label wins a
    /// tie. [`LabelId::NULL`] if the face has no vote.
    pub fn label_of_face(&self) -> &[LabelId] {
        &self.label_of_face
    }

    /// Returns the label of each face, and drops the votes.
    pub fn into_label_of_face(self) -> Vec<LabelId> {
        self.label_of_face
    }

    /// Returns the number of faces of the mesh, with or without votes.
    pub fn len(&self) -> usize {
        self.label_of_face.len()
    }

    /// Returns true if the mesh has no face.
    pub fn is_empty(&self) -> bool {
        self.label_of_face.is_empty()
    }

    /// Returns the result of the vote for a face: winner, runner-up, distances. Returns `None` if no point
    /// voted for the face, or if there is no such face.
    pub fn votes_of(&self, face: u32) -> Option<FaceVotes> {
        ((face as usize) < self.len())
            .then(|| self.votes.of_face(face))
            .flatten()
    }

    /// Iterates over the results of all faces, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Option<FaceVotes>> {
        (0..self.len() as u32).map(|face| self.votes.of_face(face))
    }

    /// Returns all votes, with votes for further labels, and the number of points of each label.
    pub fn votes(&self) -> &Votes {
        &self.votes
    }

    /// Sums up the votes by room and by class, for labels of `table`.
    ///
    /// # Errors
    /// [`VoteError::NoSuchLabel`] if there are votes for a label that is not in the table.
    pub fn report(&self, table: &LabelTable) -> Result<VoteReport, VoteError> {
        VoteReport::new(&self.votes, table)
    }
}
