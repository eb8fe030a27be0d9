//! `s3d stats`: the tables of statistics of a data set, counted from its files.

use crate::answer::print;
use crate::failure::Outcome;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct StatsArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
}

pub(crate) fn run(args: &StatsArgs) -> Outcome<()> {
    print(&s3d_dataset::statistics(&args.output)?.to_markdown())
}
