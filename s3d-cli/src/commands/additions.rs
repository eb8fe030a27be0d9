//! `s3d xyz`, `profile`, `pairs`, `refine`: files that are added to an existing data set.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::parsed;
use clap::Args;
use s3d_dataset::options::Profile;
use s3d_dataset::profile::ProfileOptions;
use s3d_dataset::xyz::XyzOptions;
use s3d_dataset::{PairsOptions, RefineOptions};
use std::path::PathBuf;

/// The arguments of a command that adds files to a data set.
#[derive(Debug, Args)]
pub(crate) struct AddArgs<T: Args> {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) options: T,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn xyz(args: AddArgs<XyzOptions>) -> Outcome<()> {
    on_threads(args.threads, |context| s3d_dataset::xyz(args.output, &args.options, context).map(drop))
}

pub(crate) fn pairs(args: AddArgs<PairsOptions>) -> Outcome<()> {
    on_threads(args.threads, |context| s3d_dataset::pairs(args.output, &args.options, context).map(drop))
}

pub(crate) fn refine(args: AddArgs<RefineOptions>) -> Outcome<()> {
    on_threads(args.threads, |context| s3d_dataset::refine(args.output, &args.options, context).map(drop))
}

#[derive(Debug, Args)]
pub(crate) struct ProfileArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// The loader to write for; may be repeated.
    #[arg(long = "to", required = true, value_delimiter = ',', value_parser = parsed::<Profile>,
        value_name = "pointcept|open3d-ml|mmdet3d|pointnet")]
    pub(crate) profiles: Vec<Profile>,
    #[command(flatten)]
    pub(crate) options: ProfileOptions,
}

pub(crate) fn profile(args: ProfileArgs) -> Outcome<()> {
    on_threads(Threads { threads: None }, |context| {
        s3d_dataset::profile(args.output, &args.profiles, &args.options, context)
    })
}
