//! One evaluator for results on 2D-3D-Semantic data: what eight scripts of others count, each by its own
//! definition, to the digit.
//!
//! [`evaluate`] holds predictions against a data set by a [`Protocol`], a named and versioned definition, and
//! returns an [`Evaluation`]: tables of scores, with the definition that they follow. `docs/evaluation.md`
//! explains each protocol with its source, where others differ, and the files that predictions come in.
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

// What a file holds must not make it panic.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic, clippy::string_slice))]

pub mod boxes;
pub mod detector;
pub mod images;
pub mod panoptic;
pub mod points;

mod bootstrap;
mod evaluate;
mod evaluation;
mod folder;
mod folds;
mod options;
mod protocol;
mod tables;
mod task;

pub use bootstrap::bootstrap;
pub use evaluate::evaluate;
pub use evaluation::{Evaluation, Row, Score, Table};
pub use folds::{Fold, Folds};
pub use options::{EvalOptions, ImageKind};
pub use protocol::{Protocol, UnknownProtocol};
pub use s3d_dataset::{Context, Error, Result};

#[doc = include_str!("../docs/evaluation.md")]
pub mod protocols {}

/// The README's example, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
