//! `s3d xyz`, `profile`, `pairs`, `refine`: files that are added to an existing data set.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::{parsed, stored_xyz};
use clap::Args;
use s3d_dataset::options::Profile;
use s3d_dataset::profile::ProfileOptions;
use s3d_dataset::xyz::XyzOptions;
use s3d_dataset::{PairsOptions, RefineOptions};
use s3d_io::dataset::XyzType;
use s3d_io::image::Compression;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct XyzArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// The stored numbers: half floats or 32-bit floats.
    #[arg(long = "type", default_value = "half", value_parser = stored_xyz, value_name = "half|float")]
    pub(crate) xyz: XyzType,
    /// Replace existing coordinates, although they may be more exact.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Compression of the image files: fast, balanced or small.
    #[arg(long, default_value_t, value_parser = parsed::<Compression>, value_name = "fast|balanced|small")]
    pub(crate) compression: Compression,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn xyz(args: XyzArgs) -> Outcome<()> {
    let options = XyzOptions { xyz: args.xyz, overwrite: args.overwrite, compression: args.compression };
    on_threads(args.threads, |context| s3d_dataset::xyz(args.output, &options, context).map(drop))
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
    /// Replace what is in OUT/profiles/NAME.
    #[arg(long)]
    pub(crate) overwrite: bool,
}

pub(crate) fn profile(args: ProfileArgs) -> Outcome<()> {
    let options = ProfileOptions { overwrite: args.overwrite };
    on_threads(Threads { threads: None }, |context| {
        s3d_dataset::profile(args.output, &args.profiles, &options, context)
    })
}

#[derive(Debug, Args)]
pub(crate) struct PairsArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) options: PairsOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn pairs(args: PairsArgs) -> Outcome<()> {
    on_threads(args.threads, |context| s3d_dataset::pairs(args.output, &args.options, context).map(drop))
}

#[derive(Debug, Args)]
pub(crate) struct RefineArgs {
    /// The data set's folder.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) options: RefineOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn refine(args: RefineArgs) -> Outcome<()> {
    on_threads(args.threads, |context| s3d_dataset::refine(args.output, &args.options, context).map(drop))
}
