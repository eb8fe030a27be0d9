//! `s3d merge`: shards to one data set.

use crate::args::Threads;
use crate::commands::on_threads;
use crate::failure::Outcome;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// The folders into which shards of the same export wrote, in any order; OUT may be one of them.
    #[arg(required = true, value_name = "SHARD")]
    pub(crate) shards: Vec<PathBuf>,
    /// The data set's folder.
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Write into an OUT that is not empty. An earlier data set there is replaced; other files stay.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: MergeArgs) -> Outcome<()> {
    on_threads(args.threads, |context| {
        s3d_dataset::merge(&args.shards, args.output, args.overwrite, context).map(drop)
    })
}
