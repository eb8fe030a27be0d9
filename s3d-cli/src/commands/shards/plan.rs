//! `s3d plan`: labels and scores, for the shards of an export.

use crate::args::{Allow, Placing, Scenes, Threads};
use crate::commands::on_threads;
use crate::failure::Outcome;
use crate::values::{parsed, positive};
use clap::{Args, value_parser};
use s3d_dataset::ExportOptions;
use s3d_dataset::export::Shard;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    pub(crate) scenes: Scenes,
    /// The plan's folder. A second call makes only what is missing in it.
    #[arg(short, long, value_name = "PLAN")]
    pub(crate) output: PathBuf,
    /// Make one of N parts of the plan, such as 2/4. The parts may be made anywhere, in any order.
    #[arg(long, value_name = "i/N", value_parser = parsed::<Shard>)]
    pub(crate) shard: Option<Shard>,
    /// The number of candidate views at each scan location.
    #[arg(long, value_name = "N", default_value_t = 72, value_parser = value_parser!(u32).range(0..=100_000))]
    views: u32,
    /// Width and height of a view in pixels.
    #[arg(long, value_name = "PX", default_value_t = 1080,
        value_parser = value_parser!(u32).range(8..=16_384))]
    size: u32,
    /// The source of everything random.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    placing: Placing,
    /// Count the classes of a candidate view on every Nth pixel of both axes.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = value_parser!(u32).range(1..=64))]
    entropy_stride: u32,
    /// Skip and count faults in the annotations.
    #[arg(long)]
    lenient: bool,
    /// Give each face without a vote of an annotated point the label of the surface next to it, if that
    /// surface is no farther than this.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    fill: Option<f64>,
    #[command(flatten)]
    allow: Allow,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: PlanArgs) -> Outcome<()> {
    let options = ExportOptions {
        views: args.views,
        size: args.size,
        seed: args.seed,
        place_cameras: args.placing.place_cameras,
        see: args.placing.see,
        entropy_stride: args.entropy_stride,
        lenient: args.lenient,
        fill: args.fill,
        allow: args.allow.allow,
        ..ExportOptions::default()
    };
    on_threads(args.threads, |context| {
        s3d_dataset::plan(&args.scenes.sources(), &args.output, &options, args.shard, context)
    })
}
