//! `s3d pack`: a data set to what a trainer reads.

use super::on_threads;
use crate::failure::Outcome;
use crate::pack::args::PackArgs;
use crate::pack::pack;

pub(crate) fn run(args: &PackArgs) -> Outcome<()> {
    on_threads(args.threads, || pack(args))
}
