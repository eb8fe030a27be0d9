//! Segmentation of points: classes and instances of the rooms of a data set.
//!
//! The metrics need no files: [`SemanticCounts`] for classes; for instances [`InstanceMatches`] with
//! [`instance_ap`], and [`RoomCoverage`] with [`coverage`]. Counts of rooms add up, so that rooms may be
//! counted one after another.
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
mod precision;
mod protocols;
mod semantic;
mod truth;

pub use coverage::{CoverageScores, RoomCoverage, coverage};
pub use matching::{Mask, PredictedInstance, TrueInstance, instances_of_masks, instances_of_segments};
pub use precision::{InstanceAp, InstanceMatches, LEAST_POINTS, instance_ap};
pub(crate) use protocols::{inst_ap, inst_cov, sem3d};
pub use semantic::{AbsentClass, SemanticCounts, SemanticScores};

/// S3DIS's classes, which every class of a data set counts as.
const CLASSES: usize = s3d_dataset::s3d_label::Class::S3DIS.len();
