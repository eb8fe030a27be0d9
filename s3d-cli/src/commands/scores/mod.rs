//! Scores of predictions, and the baseline that makes predictions.

pub(crate) mod detect;
pub(crate) mod eval;

use crate::args::Threads;
use crate::commands::on_threads;
use crate::failure::{Failure, Outcome};
use s3d_dataset::Context;

/// Makes a call that has its own type of error. `failure` translates such an error into the words of the
/// command line.
fn on_threads_or<T: Send, E: Send>(
    threads: Threads,
    failure: fn(E) -> Failure,
    call: impl FnOnce(&Context) -> Result<T, E> + Send,
) -> Outcome<T> {
    on_threads(threads, |context| Ok(call(context)))?.map_err(failure)
}
