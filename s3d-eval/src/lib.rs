//! One evaluator for results on 2D-3D-Semantic data. It gives the scores of published scripts, each by its
//! own definition, to the digit.
//!
//! # From files to scores
//!
//! [`evaluate`] compares predictions with a data set by a [`Protocol`], which is a named and versioned
//! definition. It returns an [`Evaluation`]: tables of scores, with the definition that they follow.
//! [`protocols`] explains each protocol, its source, how others differ, and the files of predictions.
//!
//! ```no_run
//! use s3d_eval::{Context, EvalOptions, Protocol, evaluate};
//!
//! let options = EvalOptions::default();
//! let (truth, predictions) = ("dataset".as_ref(), "predictions".as_ref());
//! let result = evaluate(Protocol::Sem3d, truth, predictions, &options, &Context::default())?;
//! println!("{}", result.to_markdown());
//! # Ok::<(), s3d_eval::Error>(())
//! ```
//!
//! # From values to scores
//!
//! The metrics need no files: [`boxes`], [`points`], [`images`] and [`panoptic`] have them, with values in
//! and scores out. [`bootstrap`] gives their intervals.
//!
//! ```
//! use s3d_eval::points::{AbsentClass, SemanticCounts};
//!
//! // The true and the predicted class of each point; -1 is void.
//! let mut counts = SemanticCounts::new(2);
//! counts.add([(0, 0), (0, 1), (1, 1), (-1, 1)]);
//! assert_eq!(counts.scores(AbsentClass::LeftOut).mean_iou, 0.5);
//! ```

// No content of a file may make this crate panic.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic, clippy::string_slice))]

pub mod boxes;
pub mod images;
pub mod panoptic;
pub mod points;

mod bootstrap;
mod error;
mod evaluate;
mod evaluation;
mod folder;
mod folds;
mod hints;
mod options;
mod protocol;
mod tables;
mod task;

pub use bootstrap::bootstrap;
pub use error::{ClassFault, ClassOption, Error, Result};
pub use evaluate::evaluate;
pub use evaluation::{Against, ConfusionTable, Evaluation, Row, Score, Table, Truth, UnitScores, Units};
pub use folds::{Fold, Folds};
pub use options::{BoxSource, EvalOptions, ImageKind, UnknownBoxSource, UnknownImageKind};
pub use protocol::{Protocol, UnknownProtocol};
pub use s3d_dataset::Context;

#[doc = include_str!("../docs/evaluation.md")]
pub mod protocols {}

/// The example of the README, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
