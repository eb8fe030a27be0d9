//! `s3d segments`: a mesh to the segments of its faces or vertices.

use crate::args::Threads;
use crate::commands::on_threads;
use crate::failure::Outcome;
use clap::Args;
use s3d_annotate::segments::{SegmentFileOptions, segment_file};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct SegmentsArgs {
    /// The mesh: OBJ, glTF, GLB or PLY.
    pub(crate) mesh: PathBuf,
    /// The file of the segments: NAME.segs.json has one for each vertex, as in ScanNet; NAME.fsegs.json has
    /// one for each face, as in Matterport3D.
    #[arg(short, long, value_name = "NAME.segs.json")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) options: SegmentFileOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: SegmentsArgs) -> Outcome<()> {
    let SegmentsArgs { mesh, output, options, threads } = args;
    on_threads(threads, |context| segment_file(&mesh, &output, &options, context).map(drop))
}
