//! `s3d pack`: a data set to a package that a trainer reads.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::parsed;
use clap::{Args, value_parser};
use s3d_dataset::pack::{PackOptions, PackageArguments, PackageKind};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct PackArgs {
    /// The data set's folder. Nothing in it is altered.
    #[arg(value_name = "OUT")]
    pub(crate) dataset: PathBuf,
    /// The kind of package.
    #[arg(long, value_parser = parsed::<PackageKind>,
        value_name = PackageKind::WORDS)]
    pub(crate) to: PackageKind,
    /// The package's folder, or its file for parquet [default: beside OUT: OUT_webdataset, …,
    /// OUT_images.parquet]
    #[arg(short, long, value_name = "DEST")]
    pub(crate) output: Option<PathBuf>,
    /// Replace an earlier package in DEST.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Pack only these areas, such as 1,3 [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = value_parser!(u32).range(1..))]
    pub(crate) areas: Vec<u32>,
    #[command(flatten)]
    pub(crate) threads: Threads,
    #[command(flatten, next_help_heading = "Options of single packages")]
    pub(crate) options: PackageArguments,
}

pub(crate) fn run(args: PackArgs) -> Outcome<()> {
    let package = args.options.package(args.to)?;
    let options = PackOptions { output: args.output, overwrite: args.overwrite, areas: args.areas };
    on_threads(args.threads, |context| {
        s3d_dataset::pack(&args.dataset, &package, &options, context).map(drop)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};
    use clap::Parser;

    fn parse(args: &[&str]) -> Result<PackArgs, clap::Error> {
        match Cli::try_parse_from(["s3d", "pack", "out"].iter().chain(args))?.command {
            Command::Pack(args) => Ok(args),
            _ => panic!("another command"),
        }
    }

    #[test]
    fn words_become_options() {
        let args = parse(&["--to", "coco", "--stuff", "wall,floor,wall"]).unwrap();
        assert_eq!(args.options.stuff, "floor,wall".parse().ok());
        let args = parse(&["--to", "colmap", "--points", "0", "--copy-images"]).unwrap();
        assert_eq!((args.options.points, args.options.copy_images), (Some(0), true));
    }

    #[test]
    fn nonsense_is_refused() {
        for bad in [
            &[] as &[&str],
            &["--to", "zip"],
            &["--to", "coco", "--stuff", "wall,,floor"],
            &["--to", "webdataset", "--prefix", "a/b"],
            &["--to", "webdataset", "--prefix", "{0..9}"],
            &["--to", "webdataset", "--max-count", "0"],
            &["--to", "webdataset", "--modalities", "smell"],
            &["--to", "colmap", "--areas", "0"],
            &["--to", "colmap", "--points", "-1"],
            &["--to", "nerfstudio", "--depth", "inches"],
        ] {
            assert!(parse(bad).is_err(), "{bad:?}");
        }
    }
}
