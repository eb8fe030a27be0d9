//! `s3d info`: what a scene holds, and what looks wrong in it.

use super::{on_threads, print};
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::positive;
use clap::Args;
use s3d_dataset::InfoOptions;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    /// The scene file, or the folder of a published area.
    #[arg(value_name = "SCENE.toml")]
    pub(crate) scene: PathBuf,
    /// Show the scan locations that export would put on the floor with this option.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub(crate) place_cameras: Option<f64>,
    /// The seed by which they would be placed.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Skip and count what is not as it should be in the annotations, as in an export with --lenient.
    #[arg(long)]
    pub(crate) lenient: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: InfoArgs) -> Outcome<()> {
    let options = InfoOptions { place_cameras: args.place_cameras, seed: args.seed, lenient: args.lenient };
    let info = on_threads(args.threads, |context| s3d_dataset::info(&args.scene, &options, context))?;
    print(&info.to_string())
}
