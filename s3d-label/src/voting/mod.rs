//! Votes of labelled points for the faces of a mesh.

mod corners;
mod disputes;
mod face_labels;
mod fill;
mod labeler;
mod report;
mod votes;

pub use disputes::{ClassDispute, DisputedPatch, Disputes};
pub use face_labels::FaceLabels;
pub use fill::fill_labels;
pub use labeler::{Labeler, Stray, VoteError, vote};
pub use report::{VoteReport, VoteRow};
pub use votes::{FaceVotes, PointTally, VoteOptions, Votes};
