//! `s3d verify`: whether a data set is what its manifest and its own files say.

use super::on_threads;
use crate::answer::print;
use crate::args::Threads;
use crate::failure::{Failure, Outcome};
use clap::Args;
use s3d_dataset::Error;
use s3d_dataset::error::TemporaryError;
use s3d_dataset::verify::VerifyOptions;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Also score all candidate views again, and compare the S3DIS tree and pointcloud.mat with the point
    /// cloud. Every pixel of every image is compared in either case.
    #[arg(long)]
    pub(crate) full: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: VerifyArgs) -> Outcome<()> {
    let options = VerifyOptions { full: args.full };
    let report = on_threads(args.threads, |context| s3d_dataset::verify(&args.output, &options, context))?;
    print(&report.to_string())?;
    let root = args.output.display();
    match (report.unread.clone(), report.fault_count()) {
        (Some(what), _) => Err(Error::from(TemporaryError::Changed { what }).into()),
        (None, 0) => Ok(()),
        (None, 1) => Err(Failure::Answer(format!("{root}: 1 fault"))),
        (None, n) => Err(Failure::Answer(format!("{root}: {n} faults"))),
    }
}
