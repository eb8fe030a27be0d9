//! `s3d report` and `s3d figures`: a page that shows a data set, and figures of it for print.

use super::on_threads;
use crate::args::Threads;
use crate::failure::{Failure, Outcome};
use clap::Args;
use s3d_report::{Error, FiguresOptions, ReportOptions};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// The data set's folder. Nothing in it is altered.
    #[arg(value_name = "OUT")]
    pub(crate) dataset: PathBuf,
    /// Another data set to show beside it where both differ. Nothing in it is altered.
    #[arg(long, value_name = "B")]
    pub(crate) against: Option<PathBuf>,
    /// The report's folder, or its file with --single [default: beside OUT: OUT_report]
    #[arg(short, long, value_name = "PATH")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) options: ReportOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: ReportArgs) -> Outcome<()> {
    let ReportArgs { dataset, against, output, options, threads } = args;
    let made = on_threads(threads, |context| {
        let to = output.map_or_else(
            || s3d_dataset::store::beside(&dataset, if options.single { "_report.html" } else { "_report" }),
            Ok,
        )?;
        Ok(match against {
            Some(other) => s3d_report::report_against(&dataset, &other, &to, &options, context),
            None => s3d_report::report(&dataset, &to, &options, context),
        })
    })?;
    made.map(drop).map_err(failure)
}

#[derive(Debug, Args)]
pub(crate) struct FiguresArgs {
    /// The data set's folder. Nothing in it is altered.
    #[arg(value_name = "OUT")]
    pub(crate) dataset: PathBuf,
    /// The folder of the figures [default: beside OUT: OUT_figures]
    #[arg(short, long, value_name = "PATH")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) options: FiguresOptions,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn figures(args: FiguresArgs) -> Outcome<()> {
    let FiguresArgs { dataset, output, options, threads } = args;
    let drawn = on_threads(threads, |context| {
        let to = output.map_or_else(|| s3d_dataset::store::beside(&dataset, "_figures"), Ok)?;
        Ok(s3d_report::figures(&dataset, &to, &options, context))
    })?;
    drawn.map_err(failure)
}

/// Says an error of the report in the words of the command line.
fn failure(error: Error) -> Failure {
    match error {
        Error::Dataset(error) => error.into(),
        Error::Occupied(_) => Failure::Usage(format!("{error} with -o")),
        Error::TooLarge(_) => {
            Failure::Usage(format!("{error}: leave --single out, or use --pano-width and --thumbs"))
        }
        error => Failure::Usage(error.to_string()),
    }
}
