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
    /// Print LaTeX in the layout of the paper's tables.
    #[arg(long)]
    pub(crate) latex: bool,
}

pub(crate) fn run(args: &StatsArgs) -> Outcome<()> {
    let statistics = s3d_dataset::statistics(&args.output)?;
    if args.latex {
        print(&statistics.to_latex())
    } else {
        print(&statistics.to_markdown())
    }
}
