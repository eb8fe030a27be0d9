//! `s3d profile`: the files that point cloud loaders read, from an existing data set.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::parsed;
use clap::Args;
use s3d_dataset::options::Profile;
use s3d_dataset::profile::ProfileOptions;
use std::path::PathBuf;

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

pub(crate) fn run(args: ProfileArgs) -> Outcome<()> {
    let options = ProfileOptions { overwrite: args.overwrite };
    on_threads(Threads { threads: None }, |context| {
        s3d_dataset::profile(args.output, &args.profiles, &options, context)
    })
}
