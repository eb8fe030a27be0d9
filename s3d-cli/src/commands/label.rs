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
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) frame: FrameArgs,
    #[command(flatten)]
    pub(crate) options: LabelOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: LabelArgs) -> Outcome<()> {
    // What is told is the address of the page, or what was written.
    let ready = |told: &str| drop(print(&format!("{told}\n")));
    on_threads(args.threads, |ctx| label(args.frame.source(args.scene), &args.options, ctx, ready))
}
