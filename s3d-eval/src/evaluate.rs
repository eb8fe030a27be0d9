//! The call that evaluates.

use crate::task::Task;
use crate::{EvalOptions, Evaluation, Protocol, boxes, images, panoptic, points};
use s3d_dataset::{Context, DataSet, Result};
use std::path::Path;

/// Holds the predictions in the folder or file `predictions` against the data set in the folder `truth`.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if the options do not fit the protocol or the data set;
/// [`Error::Input`](crate::Error::Input) if the data set lacks what the protocol needs;
/// [`Error::File`](crate::Error::File) if a prediction is missing, double, of the wrong size or damaged, or a
/// file of the data set is; [`Error::Cancelled`](crate::Error::Cancelled).
pub fn evaluate(
    protocol: Protocol,
    truth: &Path,
    predictions: &Path,
    options: &EvalOptions,
    ctx: &Context,
) -> Result<Evaluation> {
    let variant = options.variant_of(protocol)?;
    let data = DataSet::open(truth)?;
    let folds = options.folds.of(&data)?;
    let task = Task { protocol, variant, data: &data, folds: &folds, predictions, options, ctx };
    match protocol {
        Protocol::Det => boxes::det(&task),
        Protocol::Sem3d => points::sem3d(&task),
        Protocol::InstAp => points::inst_ap(&task),
        Protocol::InstCov => points::inst_cov(&task),
        Protocol::SemPano => images::sem_pano(&task),
        Protocol::Depth => images::depth(&task),
        Protocol::Normal => images::normal(&task),
        Protocol::Panoptic => panoptic::panoptic(&task),
    }
}
