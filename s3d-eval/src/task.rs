//! What a protocol is handed.

use crate::{EvalOptions, Evaluation, Fold, Protocol, Table};
use s3d_dataset::{Context, DataSet};
use std::path::Path;

/// What the tables of several folds are.
const OF_FOLDS: &str = "All folds, pooled: what was counted in all of them, together. Mean over folds: of each \
                        score, over the folds in which it is defined.";

/// What is to be evaluated.
#[derive(Clone, Copy)]
pub(crate) struct Task<'a> {
    pub(crate) protocol: Protocol,
    /// One of the protocol's.
    pub(crate) variant: &'static str,
    pub(crate) data: &'a DataSet,
    /// None without an area; an area is in one fold at most.
    pub(crate) folds: &'a [Fold],
    pub(crate) predictions: &'a Path,
    pub(crate) options: &'a EvalOptions,
    pub(crate) ctx: &'a Context,
}

impl Task<'_> {
    /// The evaluation with these parts; of several folds, `definition` goes on with what their tables are.
    pub(crate) fn evaluation(
        &self,
        definition: &[&str],
        counted: impl IntoIterator<Item = (&'static str, u64)>,
        tables: Vec<Table>,
    ) -> Evaluation {
        Evaluation {
            protocol: self.protocol,
            version: self.protocol.version(),
            variant: self.variant,
            definition: definition
                .iter()
                .chain((self.folds.len() > 1).then_some(&OF_FOLDS))
                .map(|&sentence| sentence.to_owned())
                .collect(),
            counted: counted.into_iter().collect(),
            tables,
            notes: Vec::new(),
        }
    }
}
