//! `s3d merge`: shards to one data set.

use super::on_threads;
use crate::args::MergeArgs;
use crate::failure::Outcome;
use crate::pipeline::{Target, merge};
use s3d_io::Layout;

pub(crate) fn run(args: MergeArgs) -> Outcome<()> {
    let target = Target { layout: Layout::new(args.output), overwrite: args.overwrite, allowed: &[] };
    on_threads(args.threads, || merge(&args.shards, &target))
}
