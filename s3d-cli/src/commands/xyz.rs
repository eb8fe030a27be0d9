//! `s3d xyz`: the world coordinates of a data set's images, from depth and pose.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::{parsed, stored_xyz};
use clap::Args;
use s3d_dataset::xyz::XyzOptions;
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

pub(crate) fn run(args: XyzArgs) -> Outcome<()> {
    let options = XyzOptions { xyz: args.xyz, overwrite: args.overwrite, compression: args.compression };
    on_threads(args.threads, |context| s3d_dataset::xyz(args.output, &options, context).map(drop))
}
