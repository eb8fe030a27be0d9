//! `s3d pack`: a data set to what a trainer reads.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::parsed;
use clap::{Args, value_parser};
use s3d_dataset::{
    ClassList, DepthFiles, PackOptions, PackageArguments, PackageKind, PackedImages, ShardPrefix,
};
use s3d_io::dataset::Domain;
use s3d_io::image::Compression;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct PackArgs {
    /// The data set's folder. Nothing in it is altered.
    #[arg(value_name = "OUT")]
    pub(crate) dataset: PathBuf,
    /// What to make of it.
    #[arg(long, value_parser = parsed::<PackageKind>,
        value_name = "webdataset|colmap|nerfstudio|coco|parquet")]
    pub(crate) to: PackageKind,
    /// The package's folder, of parquet its file [default: beside OUT: OUT_webdataset, …,
    /// OUT_images.parquet]
    #[arg(short, long, value_name = "DEST")]
    pub(crate) output: Option<PathBuf>,
    /// Replace an earlier package in DEST.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Of these areas only, such as 1,3 [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = value_parser!(u32).range(1..))]
    pub(crate) areas: Vec<u32>,
    /// Of perspective views only, of panoramas only, or of both [default: all; COLMAP has views only]
    #[arg(long, value_name = "views|panoramas|all", value_parser = parsed::<PackedImages>)]
    pub(crate) images: Option<PackedImages>,
    #[command(flatten)]
    pub(crate) threads: Threads,
    #[command(flatten, next_help_heading = "Options of single packages")]
    pub(crate) options: SpecificArgs,
}

/// What belongs to some packages only; `None` (or false) where it was not said.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct SpecificArgs {
    /// webdataset: which files of an image go into its sample [default: all that there are]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parsed::<Domain>)]
    pub(crate) modalities: Option<Vec<Domain>>,
    /// webdataset: megabytes (1,000,000 bytes) of a shard, at most [default: 1000]
    #[arg(long, value_name = "MB", value_parser = value_parser!(u32).range(1..))]
    pub(crate) max_size: Option<u32>,
    /// webdataset: samples of a shard, at most [default: an eighth of a series, so that eight workers have
    /// work]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub(crate) max_count: Option<u32>,
    /// webdataset: one series of shards PREFIX-000000.tar for all areas, instead of area_N_views-000000.tar
    /// and area_N_panoramas-000000.tar for each
    #[arg(long, value_name = "PREFIX", value_parser = parsed::<ShardPrefix>)]
    pub(crate) prefix: Option<ShardPrefix>,
    /// webdataset: samples in a random order that this number decides, instead of by scan location
    #[arg(long, value_name = "SEED")]
    pub(crate) shuffle: Option<u64>,
    /// colmap, nerfstudio: points of each area's cloud, evenly spaced [default: 100000; 0 for none]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32))]
    pub(crate) points: Option<u32>,
    /// colmap: cameras.bin, images.bin and points3D.bin instead of text
    #[arg(long)]
    pub(crate) binary: bool,
    /// colmap, nerfstudio: copy the RGB images into DEST, which can be moved then, instead of pointing to
    /// those in OUT
    #[arg(long)]
    pub(crate) copy_images: bool,
    /// nerfstudio: depth written anew in millimetres with 0 for missing, as it is read by default; OUT's own
    /// files, for which ns-train's --depth-unit-scale-factor must be 0.001953125 (1/512) and missing pixels
    /// seem to be 128 m away; or none [default: millimetres]
    #[arg(long, value_name = "millimetres|original|none", value_parser = parsed::<DepthFiles>)]
    pub(crate) depth: Option<DepthFiles>,
    /// coco: classes of which all instances in an image are one segment, or none [default:
    /// ceiling,floor,wall]
    #[arg(long, value_name = "LIST|none", value_parser = parsed::<ClassList>)]
    pub(crate) stuff: Option<ClassList>,
    /// coco, nerfstudio: how much time the images' files may take: fast, balanced or small [default:
    /// balanced]
    #[arg(long, value_name = "fast|balanced|small", value_parser = parsed::<Compression>)]
    pub(crate) compression: Option<Compression>,
}

impl SpecificArgs {
    fn arguments(self, images: Option<PackedImages>) -> PackageArguments {
        let Self { modalities, max_size, max_count, prefix, shuffle, points, .. } = self;
        let Self { binary, copy_images, depth, stuff, compression, .. } = self;
        PackageArguments {
            images,
            modalities,
            max_size,
            max_count,
            prefix,
            shuffle,
            points,
            binary,
            copy_images,
            depth,
            stuff,
            compression,
        }
    }
}

pub(crate) fn run(args: PackArgs) -> Outcome<()> {
    let package = args.options.arguments(args.images).package(args.to)?;
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
        let options = args.options.arguments(None);
        assert_eq!(options.stuff, "floor,wall".parse().ok());
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
