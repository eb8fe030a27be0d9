//! `s3d report`: a page that shows a data set.

use super::on_threads;
use crate::args::Threads;
use crate::failure::{Failure, Outcome};
use clap::{Args, value_parser};
use s3d_report::{Error, ReportOptions};
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
    /// Width of panoramas in the report, in pixels. Smaller panoramas keep their width. Their colours are
    /// twice as wide, up to 4096 pixels, where that shows more.
    #[arg(long, value_name = "PIXELS", default_value_t = 2048,
        value_parser = value_parser!(u32).range(16..=16_384))]
    pub(crate) pano_width: u32,
    /// Width of views in the report, in pixels. The colours of a large view are twice as wide.
    #[arg(long, value_name = "PIXELS", default_value_t = 256,
        value_parser = value_parser!(u32).range(16..=2048))]
    pub(crate) thumbs: u32,
    /// The most faces of the mesh of an area in the report. A larger mesh is simplified.
    #[arg(long, value_name = "FACES", default_value_t = 300_000,
        value_parser = value_parser!(u32).range(1000..=10_000_000))]
    pub(crate) mesh_faces: u32,
    /// Verify every pixel of the data set as well, and show the result.
    #[arg(long)]
    pub(crate) verify: bool,
    /// Write one file, to send or publish, instead of a folder. For small data sets.
    #[arg(long)]
    pub(crate) single: bool,
    /// Show the scores in a file that `s3d eval --json` wrote. May be given several times.
    #[arg(long, value_name = "SCORES.json")]
    pub(crate) scores: Vec<PathBuf>,
    /// Also draw the building from above, half in colours and half in classes: a PNG of 1600 × 1000 pixels.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) poster: Option<PathBuf>,
    /// Replace an earlier report, and an earlier poster.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

pub(crate) fn run(args: ReportArgs) -> Outcome<()> {
    let ReportArgs {
        dataset,
        against,
        output,
        pano_width,
        thumbs,
        mesh_faces,
        verify,
        single,
        scores,
        poster,
        overwrite,
        threads,
    } = args;
    let options = ReportOptions { pano_width, thumbs, mesh_faces, verify, single, scores, poster, overwrite };
    let made = on_threads(threads, |context| {
        let to = output.map_or_else(
            || s3d_dataset::store::beside(&dataset, if single { "_report.html" } else { "_report" }),
            Ok,
        )?;
        Ok(match against {
            Some(other) => s3d_report::report_against(&dataset, &other, &to, &options, context),
            None => s3d_report::report(&dataset, &to, &options, context),
        })
    })?;
    made.map(drop).map_err(failure)
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
