//! `s3d eval`: predictions held against a data set.

use crate::answer::JsonArgs;
use crate::args::Threads;
use crate::commands::scores::on_threads_or;
use crate::failure::{Failure, Outcome};
use crate::values::parsed;
use clap::{Args, ValueEnum, value_parser};
use s3d_dataset::pack::ClassList;
use s3d_eval::{BoxSource, Error, EvalOptions, Folds, ImageKind, Protocol};
use std::path::PathBuf;

const PROTOCOLS: &str =
    "det|sem3d|inst-ap|inst-cov|sem-pano|sem-view|sem-edge|depth|depth-edge|normal|panoptic|panoptic3d";

#[derive(Debug, Args)]
pub(crate) struct EvalArgs {
    /// The definition of the scores.
    #[arg(value_parser = parsed::<Protocol>,
        value_name = PROTOCOLS)]
    pub(crate) protocol: Protocol,
    /// The data set's folder. Nothing in it is altered.
    #[arg(long, value_name = "OUT")]
    pub(crate) truth: PathBuf,
    /// The predictions: a folder, or a file.
    #[arg(long, value_name = "DIR")]
    pub(crate) pred: PathBuf,
    /// Other predictions in the same form: adds the difference of each score and its 95 % interval, over
    /// draws of the same rooms or images for both (1,000 draws, or --bootstrap).
    #[arg(long, value_name = "DIR")]
    pub(crate) against: Option<PathBuf>,
    /// A variant of the protocol, named after the script that it follows [default: the first in its
    /// description]
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
    /// The areas to test together: all of them, each by itself (six-fold), or the paper's three folds.
    #[arg(long, value_enum, default_value_t, value_name = "all|each|paper", hide_possible_values = true)]
    pub(crate) folds: FoldsArg,
    /// Test only these areas, together. Most published results on S3DIS are for area 5.
    #[arg(long, value_name = "N,…", value_delimiter = ',', conflicts_with = "folds")]
    pub(crate) areas: Vec<u32>,
    /// det: the classes to detect [default: the paper's 12]
    #[arg(long, value_name = "CLASS,…", value_delimiter = ',')]
    pub(crate) classes: Vec<String>,
    /// det: the points that true boxes surround: the sampled ones, which detectors are given, or those of the
    /// annotations [default: points]
    #[arg(long, value_name = "points|annotations", value_parser = parsed::<BoxSource>)]
    pub(crate) boxes: Option<BoxSource>,
    /// panoptic, panoptic3d: the stuff classes, each of which has one segment in an image or a room, or none
    /// [default: the stuff of the taxonomy: ceiling,floor,wall]
    #[arg(long, value_name = "CLASS,…|none", value_parser = parsed::<ClassList>)]
    pub(crate) stuff: Option<ClassList>,
    /// depth: scale each predicted image to the median of its truth first.
    #[arg(long)]
    pub(crate) median_scale: bool,
    /// normal, depth as marigold, depth-edge, sem-edge: the kind of images to test [default: the kind that
    /// the predictions are named after]
    #[arg(long, value_parser = parsed::<ImageKind>, value_name = "views|panoramas")]
    pub(crate) images: Option<ImageKind>,
    /// Add 95 % intervals of the scores: draw rooms (or images, where there are no rooms) N times.
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(10..=100_000))]
    pub(crate) bootstrap: Option<u32>,
    /// The source of everything random.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) json: JsonArgs,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum FoldsArg {
    #[default]
    All,
    Each,
    Paper,
}

pub(crate) fn run(args: EvalArgs) -> Outcome<()> {
    let json = args.json;
    let mut options = EvalOptions::default();
    options.variant = args.variant;
    options.folds = match args.folds {
        _ if !args.areas.is_empty() => Folds::Areas(args.areas),
        FoldsArg::All => Folds::All,
        FoldsArg::Each => Folds::EachArea,
        FoldsArg::Paper => Folds::Paper,
    };
    options.against = args.against;
    options.bootstrap = args.bootstrap;
    options.seed = args.seed;
    options.images = args.images;
    options.median_scale = args.median_scale;
    options.classes = (!args.classes.is_empty()).then_some(args.classes);
    options.boxes = args.boxes;
    options.stuff = args.stuff;

    let evaluation = on_threads_or(args.threads, failure, |context| {
        json.check_free()?;
        let evaluation = s3d_eval::evaluate(args.protocol, &args.truth, &args.pred, &options, context)?;
        json.write(&evaluation, context)?;
        Ok(evaluation)
    })?;
    json.print(&evaluation, || evaluation.to_markdown())
}

/// Translates an error of the evaluation into the words of the command line.
fn failure(error: Error) -> Failure {
    match error {
        Error::Dataset(error) => error.into(),
        Error::Classes { option, fault } => Failure::Usage(format!("--{option}: {fault}")),
        error if error.is_usage() => Failure::Usage(error.to_string()),
        error => Failure::Input(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_names_all_protocols() {
        let names: Vec<&str> = Protocol::all().map(Protocol::name).collect();
        assert_eq!(PROTOCOLS, names.join("|"));
    }
}
