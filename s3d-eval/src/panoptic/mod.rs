//! Panoptic segmentation of images: protocol `panoptic`.
//!
//! [`PanopticCounts`] is the metric. It works on slices, without files.
//!
//! ```
//! use s3d_eval::panoptic::{PanopticCounts, Segment};
//!
//! // The truth has segments 7 and 8, and 0 is void. The prediction has one segment less.
//! let (truth, found) = ([7, 7, 7, 8, 0], [1, 1, 1, 1, 1]);
//! let chair = |id| Segment { id, class: 0 };
//! let mut counts = PanopticCounts::new(2);
//! counts.add(&truth, &[chair(7), chair(8)], &found, &[chair(1)])?;
//! let score = counts.classes()[0].score();
//! assert_eq!((score.sq, score.rq), (0.75, 2.0 / 3.0));
//! # Ok::<(), s3d_eval::panoptic::SegmentFault>(())
//! ```

mod counts;
mod predictions;
mod protocol;

pub use counts::{ClassCounts, PanopticCounts, PanopticScore, Segment, SegmentFault, mean};
pub(crate) use protocol::{COLUMNS, names_of, panoptic, rows_of_panoptic, stuff_of};
