//! `s3d label`: a page on this machine to label a scene on.

use super::on_threads;
use crate::answer::print;
use crate::args::{FrameArgs, Threads};
use crate::failure::Outcome;
use clap::Args;
use s3d_annotate::server::{LabelOptions, label};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct LabelArgs {
    /// A scene file, a mesh, or the folder of a scene, as `s3d export` takes them.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) frame: FrameArgs,
    #[command(flatten)]
    pub(crate) options: LabelOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: LabelArgs) -> Outcome<()> {
    let LabelArgs { scene, frame, options, threads } = args;
    on_threads(threads, |context| {
        // The address, or what was written. Who does not read it can read the log.
        label(frame.source(scene), &options, context, |told| drop(print(&format!("{told}\n"))))
    })
}
