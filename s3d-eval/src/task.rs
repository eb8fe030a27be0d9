//! The input of a protocol.

use crate::evaluation::Truth;
use crate::tables::Scores;
use crate::{Error, EvalOptions, Evaluation, Fold, Protocol};
use s3d_dataset::{Context, DataSet};
use std::path::Path;

/// The definition of the tables over several folds.
const OF_FOLDS: &str = "All folds, pooled: the counts of all folds together. Mean over folds: the mean of \
                        each score over the folds in which it is defined.";

/// An evaluation to do.
#[derive(Clone, Copy)]
pub(crate) struct Task<'a> {
    pub(crate) protocol: Protocol,
    /// A variant of the protocol.
    pub(crate) variant: &'static str,
    pub(crate) data: &'a DataSet,
    /// Each has an area, and no area is in two folds.
    pub(crate) folds: &'a [Fold],
    pub(crate) predictions: &'a Path,
    pub(crate) options: &'a EvalOptions,
    pub(crate) ctx: &'a Context,
}

impl Task<'_> {
    /// Returns the error for a data set without labels.
    pub(crate) fn unlabelled(&self) -> Error {
        Error::Unlabelled { root: self.data.layout().root().to_owned(), protocol: self.protocol }
    }

    /// Returns the error for areas without annotated rooms.
    pub(crate) fn no_rooms(&self) -> Error {
        Error::NoRooms { root: self.data.layout().root().to_owned() }
    }

    /// Returns the number of rounds of the bootstrap. A comparison with other predictions needs some.
    pub(crate) fn rounds(&self) -> u32 {
        const OF_COMPARISON: u32 = 1000;
        let least = if self.options.against.is_some() {
            OF_COMPARISON
        } else {
            0
        };
        self.options.bootstrap.unwrap_or(least)
    }

    /// Returns the evaluation with these parts. With several folds, `definition` goes on with the definition
    /// of their tables.
    pub(crate) fn evaluation(
        &self,
        definition: &[&str],
        counted: impl IntoIterator<Item = (&'static str, u64)>,
        scores: Scores,
    ) -> Evaluation {
        let areas = self.folds.iter().map(|fold| fold.areas.clone()).collect();
        Evaluation {
            protocol: self.protocol,
            version: self.protocol.version(),
            variant: self.variant,
            evaluator: env!("CARGO_PKG_VERSION"),
            truth: Truth { files_xxh3_128: self.data.checksum(), areas },
            options: self.options.clone(),
            definition: definition
                .iter()
                .chain((self.folds.len() > 1).then_some(&OF_FOLDS))
                .map(|&sentence| sentence.to_owned())
                .collect(),
            counted: counted.into_iter().collect(),
            tables: scores.tables,
            confusion: None,
            against: None,
            notes: Vec::new(),
            units: scores.units,
            rounds: scores.rounds,
        }
    }
}
