//! Segmentation of points: classes and instances of the rooms of a data set.
//!
//! The metrics need no files. [`SemanticCounts`] is for classes; [`InstanceMatches`] with [`instance_ap`],
//! and [`RoomCoverage`] with [`coverage`], are for instances; [`panoptic_counts`] is for both. Each counts
//! one room, and the scores take any number of rooms.
//!
//! ```
//! use s3d_eval::points::{AbsentClass, SemanticCounts};
//!
//! let (truth, predicted) = ([0, 0, 1, -1], [0, 1, 1, 1]);
//! let mut counts = SemanticCounts::new(2);
//! counts.add(truth.into_iter().zip(predicted));
//! let scores = counts.scores(AbsentClass::LeftOut);
//! assert_eq!((scores.mean_iou, scores.overall_accuracy), (0.5, 2.0 / 3.0));
//! ```

mod coverage;
mod find;
mod instances;
mod labels;
mod matching;
mod panoptic;
mod precision;
mod protocols;
mod scannet;
mod semantic;
mod truth;

pub use coverage::{CoverageScores, RoomCoverage, coverage};
pub use matching::{Mask, PredictedInstance, TrueInstance, instances_of_masks, instances_of_segments};
pub use panoptic::panoptic_counts;
pub use precision::{InstanceAp, InstanceMatches, LEAST_POINTS, instance_ap};
pub(crate) use protocols::{inst_ap, inst_cov, panoptic3d, sem3d};
pub use semantic::{AbsentClass, SemanticCounts, SemanticScores};

/// The number of classes of S3DIS. Each class of a data set counts as one of them.
const CLASSES: usize = s3d_dataset::s3d_label::Class::S3DIS.len();
