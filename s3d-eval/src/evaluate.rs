//! The call that evaluates predictions.

use crate::error::{Error, Result};
use crate::evaluation::{Against, Units};
use crate::task::Task;
use crate::{EvalOptions, Evaluation, Protocol, boxes, images, panoptic, points};
use s3d_dataset::{Context, DataSet};
use s3d_io::Error as FileError;
use std::fs;
use std::path::Path;

/// Compares the predictions in the folder or file `predictions` with the data set in the folder `truth`.
///
/// # Errors
/// An error that [is a usage error](crate::Error::is_usage) if the options do not fit the protocol or the
/// data set. [`Unlabelled`](crate::Error::Unlabelled), [`NoRooms`](crate::Error::NoRooms) or
/// [`NoImages`](crate::Error::NoImages) if the data set has nothing to compare with.
/// [`Dataset`](crate::Error::Dataset) if a prediction is missing, double, of the wrong size or damaged, if a
/// file of the data set is damaged, or if the call is cancelled.
pub fn evaluate(
    protocol: Protocol,
    truth: &Path,
    predictions: &Path,
    options: &EvalOptions,
    ctx: &Context,
) -> Result<Evaluation> {
    options.check_of(protocol)?;
    let variant = options.variant_of(protocol)?;
    let data = DataSet::open(truth)?;
    let folds = options.folds.of(&data)?;
    let task = Task { protocol, variant, data: &data, folds: &folds, predictions, options, ctx };
    if let Some(other) = &options.against {
        // A wrong name is told before the work.
        fs::metadata(other).map_err(|e| FileError::io(other, "read", e))?;
    }

    let mut evaluation = run(&task)?;
    if let Some(predictions) = &options.against {
        let theirs = run(&Task { predictions, ..task })?;
        if names(&evaluation.units) != names(&theirs.units) {
            return Err(Error::OtherImages { against: predictions.clone() });
        }
        evaluation.against = Some(Against::new(&evaluation, theirs));
    }
    Ok(evaluation)
}

fn run(task: &Task<'_>) -> Result<Evaluation> {
    match task.protocol {
        Protocol::Det => boxes::det(task),
        Protocol::Sem3d => points::sem3d(task),
        Protocol::InstAp => points::inst_ap(task),
        Protocol::InstCov => points::inst_cov(task),
        Protocol::SemPano => images::sem_pano(task),
        Protocol::SemView => images::sem_view(task),
        Protocol::SemEdge => images::sem_edge(task),
        Protocol::Depth => images::depth(task),
        Protocol::DepthEdge => images::depth_edge(task),
        Protocol::Normal => images::normal(task),
        Protocol::Panoptic => panoptic::panoptic(task),
        Protocol::Panoptic3d => points::panoptic3d(task),
    }
}

fn names(units: &Units) -> Vec<(u32, &str)> {
    units.units.iter().map(|unit| (unit.area, &*unit.name)).collect()
}
