//! `s3d compare`: what differs between two data sets.

use super::on_threads;
use crate::answer::JsonArgs;
use crate::args::Threads;
use crate::failure::{Failure, Outcome};
use clap::Args;
use s3d_dataset::compare::CompareOptions;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// The folder of a data set.
    #[arg(value_name = "A")]
    pub(crate) a: PathBuf,
    /// The folder of the data set to hold against it. Nothing in either is altered.
    #[arg(value_name = "B")]
    pub(crate) b: PathBuf,
    #[command(flatten)]
    pub(crate) json: JsonArgs,
    /// Besides, read every file of both and hold it against its checksum. Otherwise files to which both lists
    /// give the same checksum are not read.
    #[arg(long)]
    pub(crate) full: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: CompareArgs) -> Outcome<()> {
    let CompareArgs { a, b, json, full, threads } = args;
    let options = CompareOptions { full };
    let comparison = on_threads(threads, |context| {
        json.check_free()?;
        let comparison = s3d_dataset::compare(&a, &b, &options, context)?;
        json.write(&comparison, context)?;
        Ok(comparison)
    })?;
    json.print(&comparison, || comparison.to_string())?;
    if comparison.is_equal() {
        return Ok(());
    }
    let unread = if comparison.unread.is_empty() {
        ""
    } else {
        ", or could not be compared"
    };
    Err(Failure::Answer(format!("the data sets differ{unread}")))
}
