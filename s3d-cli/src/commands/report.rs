//! `s3d report`: a page that shows a data set.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use clap::{Args, value_parser};
use s3d_report::ReportOptions;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// The data set's folder. Nothing in it is altered.
    #[arg(value_name = "OUT")]
    pub(crate) dataset: PathBuf,
    /// The report's folder [default: beside OUT: OUT_report]
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Width of panoramas in the report, pixels; the data set's own if that is less.
    #[arg(long, value_name = "PIXELS", default_value_t = 2048,
        value_parser = value_parser!(u32).range(16..=16_384))]
    pub(crate) pano_width: u32,
    /// Width of views in the report, pixels; their colours are twice as wide where they are shown large.
    #[arg(long, value_name = "PIXELS", default_value_t = 256,
        value_parser = value_parser!(u32).range(16..=2048))]
    pub(crate) thumbs: u32,
    /// Replace an earlier report in DIR.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: ReportArgs) -> Outcome<()> {
    let ReportArgs { dataset, output, pano_width, thumbs, overwrite, threads } = args;
    let options = ReportOptions { pano_width, thumbs, overwrite };
    on_threads(threads, |context| {
        let to = output.map_or_else(|| s3d_dataset::beside(&dataset, "_report"), Ok)?;
        s3d_report::report(&dataset, &to, &options, context).map(drop)
    })
}
