//! `s3d segments`: a mesh to the segments of its faces or vertices.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::{not_negative, parsed, positive};
use clap::Args;
use s3d_annotate::segments::{SegmentFileOptions, SegmentOptions, segment_file};
use s3d_io::mesh::LengthUnit;
use std::path::PathBuf;

const DEFAULT: SegmentOptions = SegmentOptions::DEFAULT;

#[derive(Debug, Args)]
pub(crate) struct SegmentsArgs {
    /// The mesh: OBJ, glTF, GLB or PLY.
    #[arg(value_name = "MESH")]
    pub(crate) mesh: PathBuf,
    /// The file of the segments: NAME.segs.json has one for each vertex, as in ScanNet; NAME.fsegs.json has
    /// one for each face, as in Matterport3D.
    #[arg(short, long, value_name = "NAME.segs.json")]
    pub(crate) output: PathBuf,
    /// The unit of the file [default: what the file says, or else metres]
    #[arg(long, value_parser = parsed::<LengthUnit>, value_name = "m|cm|mm|ft|in")]
    pub(crate) units: Option<LengthUnit>,
    /// The scale of Felzenszwalb and Huttenlocher, in m²: the larger, the larger the segments.
    #[arg(long, value_name = "M2", default_value_t = DEFAULT.scale_m2, value_parser = positive)]
    pub(crate) scale: f64,
    /// A segment smaller than this joins a neighbour, m².
    #[arg(long, value_name = "M2", default_value_t = DEFAULT.smallest_m2, value_parser = not_negative)]
    pub(crate) smallest: f64,
    /// How much colours count against shape; 0: not at all.
    #[arg(long, value_name = "WEIGHT", default_value_t = DEFAULT.color, value_parser = not_negative)]
    pub(crate) color: f64,
    /// Replace the file if it exists.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: SegmentsArgs) -> Outcome<()> {
    let segments = SegmentOptions { scale_m2: args.scale, smallest_m2: args.smallest, color: args.color };
    let options = SegmentFileOptions { segments, units: args.units, overwrite: args.overwrite };
    on_threads(args.threads, |context| segment_file(&args.mesh, &args.output, &options, context).map(drop))
}
