//! `s3d align`: where a mesh or cloud lies in the frame of another one.

use crate::answer::print;
use crate::args::Threads;
use crate::commands::on_threads;
use crate::failure::{Failure, Outcome};
use clap::Args;
use s3d_dataset::AlignOptions;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct AlignArgs {
    /// Two meshes or clouds that show some of the same building, of any format that is read.
    #[arg(num_args = 2, required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    options: AlignOptions,
    #[command(flatten)]
    threads: Threads,
}

pub(crate) fn run(args: AlignArgs) -> Outcome<()> {
    let AlignArgs { files, options, threads } = args;
    let report = on_threads(threads, |context| s3d_dataset::align(&files[0], &files[1], &options, context))?;
    print(&report.toml())?;
    report
        .doubt
        .map_or(Ok(()), |doubt| Err(Failure::Answer(format!("{doubt} --nth"))))
}
