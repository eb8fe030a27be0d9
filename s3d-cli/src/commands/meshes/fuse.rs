//! `s3d fuse`: a raw scan to a mesh.

use crate::args::Threads;
use crate::commands::on_threads;
use crate::failure::Outcome;
use clap::Args;
use s3d_dataset::fuse::{FuseOptions, fuse};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct FuseArgs {
    /// Depth pictures with poses (folders of Matterport, ScanNet, ARKitScenes, 3RScan, TUM, 7-Scenes,
    /// Polycam; .sens; transforms.json with depth), or laser scans (E57, PTX; LAS, PLY, PCD or text with
    /// --origin or --trajectory).
    #[arg(required = true, value_name = "INPUT")]
    pub(crate) inputs: Vec<PathBuf>,
    /// The mesh (.ply or .glb), or a folder for it and a scene.toml that `s3d export` takes.
    #[arg(short, long, value_name = "mesh.ply")]
    pub(crate) output: PathBuf,
    /// Replace an earlier result.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) options: FuseOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: FuseArgs) -> Outcome<()> {
    let FuseArgs { inputs, output, overwrite, options, threads } = args;
    on_threads(threads, |context| fuse(&inputs, &output, &options, overwrite, context).map(drop))
}
