//! `s3d plan`: labels and scores, for the shards of an export.

use super::on_threads;
use crate::args::PlanArgs;
use crate::failure::Outcome;
use crate::pipeline::deal::Shard;
use crate::pipeline::plan::make;

pub(crate) fn run(args: &PlanArgs) -> Outcome<()> {
    let options = args.export_options();
    let shard = args.shard.unwrap_or(Shard::ALL);
    on_threads(args.threads, || make(&args.scenes, &args.output, &options, shard))
}
