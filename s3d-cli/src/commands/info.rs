//! `s3d info`: what a scene holds, and what looks wrong in it.

use super::on_threads;
use crate::answer::print;
use crate::args::{FrameArgs, Threads};
use crate::failure::Outcome;
use crate::values::positive;
use clap::Args;
use s3d_dataset::info::InfoOptions;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    /// A scene file, a mesh, or a folder: of a data set, of a published area, or of one scene of ScanNet,
    /// ScanNet++, HM3D, Replica, 3RScan or ARKitScenes.
    #[arg(value_name = "SCENE.toml")]
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) frame: FrameArgs,
    /// Place scan locations on the floor of every room instead of reading them: at least this far apart
    /// within a room, 1.5 m high, clear of walls and objects.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub(crate) place_cameras: Option<f64>,
    /// Place as few scan locations as see this share of the visible surface, instead of reading them
    /// [default if there are none to read: 0.95]
    #[arg(long, value_name = "SHARE", value_parser = positive, conflicts_with = "place_cameras")]
    pub(crate) see: Option<f64>,
    /// The seed of the placing of scan locations.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Skip and count faults in the annotations, like an export with --lenient.
    #[arg(long)]
    pub(crate) lenient: bool,
    /// Write the scene.toml that the folder of another data set amounts to into this folder, and no more.
    #[arg(long)]
    pub(crate) scene_toml: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: InfoArgs) -> Outcome<()> {
    let options = InfoOptions {
        place_cameras: args.place_cameras,
        see: args.see,
        seed: args.seed,
        lenient: args.lenient,
    };
    if args.scene_toml {
        let path = s3d_dataset::info::write_scene_toml(&args.scene)?;
        return print(&format!("{}\n", path.display()));
    }
    if s3d_dataset::info::is_data_set(&args.scene) {
        let info =
            on_threads(args.threads, |context| s3d_dataset::info::data_set_info(&args.scene, context))?;
        return print(&info.to_string());
    }
    let scene = args.frame.source(args.scene);
    let info = on_threads(args.threads, |context| s3d_dataset::info(scene, &options, context))?;
    print(&info.to_string())
}
