//! `s3d pack`: a data set to a package that a trainer reads.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::parsed;
use clap::{Args, value_parser};
use s3d_dataset::pack::{
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
    /// The kind of package.
    #[arg(long, value_parser = parsed::<PackageKind>,
        value_name = "webdataset|colmap|nerfstudio|coco|parquet")]
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
    /// Pack perspective views only, panoramas only, or both [default: all; COLMAP has views only]
    #[arg(long, value_name = "views|panoramas|all", value_parser = parsed::<PackedImages>)]
    pub(crate) images: Option<PackedImages>,
    #[command(flatten)]
    pub(crate) threads: Threads,
    #[command(flatten, next_help_heading = "Options of single packages")]
    pub(crate) options: SpecificArgs,
}

/// The options of single packages. An option that was not given is `None` (or false).
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct SpecificArgs {
    /// webdataset: the files of an image that its sample holds [default: all that exist]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parsed::<Domain>)]
    pub(crate) modalities: Option<Vec<Domain>>,
    /// webdataset: the largest size of a shard, in megabytes (1,000,000 bytes) [default: 1000]
    #[arg(long, value_name = "MB", value_parser = value_parser!(u32).range(1..))]
    pub(crate) max_size: Option<u32>,
    /// webdataset: the largest number of samples in a shard [default: an eighth of a series, so that eight
    /// workers have work]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub(crate) max_count: Option<u32>,
    /// webdataset: one series of shards PREFIX-000000.tar for all areas, instead of area_N_views-000000.tar
    /// and area_N_panoramas-000000.tar for each
    #[arg(long, value_name = "PREFIX", value_parser = parsed::<ShardPrefix>)]
    pub(crate) prefix: Option<ShardPrefix>,
    /// webdataset: shuffle the samples with this seed, instead of ordering them by scan location
    #[arg(long, value_name = "SEED")]
    pub(crate) shuffle: Option<u64>,
    /// colmap, nerfstudio: the number of points of each area's cloud, evenly spaced [default: 100000; 0 for
    /// none]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32))]
    pub(crate) points: Option<u32>,
    /// colmap: write cameras.bin, images.bin and points3D.bin instead of text
    #[arg(long)]
    pub(crate) binary: bool,
    /// colmap, nerfstudio: copy the RGB images into DEST, so that DEST can be moved, instead of pointing to
    /// the images in OUT
    #[arg(long)]
    pub(crate) copy_images: bool,
    /// nerfstudio: the depth files: new files in millimetres with 0 for missing, which is nerfstudio's
    /// default; OUT's original files, which need --depth-unit-scale-factor 0.001953125 (1/512) of ns-train,
    /// and in which missing pixels seem to be 128 m away; or none [default: millimetres]
    #[arg(long, value_name = "millimetres|original|none", value_parser = parsed::<DepthFiles>)]
    pub(crate) depth: Option<DepthFiles>,
    /// coco: the classes whose instances in an image are joined into one segment, or none [default:
    /// ceiling,floor,wall]
    #[arg(long, value_name = "LIST|none", value_parser = parsed::<ClassList>)]
    pub(crate) stuff: Option<ClassList>,
    /// coco, nerfstudio: compression of the image files: fast, balanced or small [default: balanced]
    #[arg(long, value_name = "fast|balanced|small", value_parser = parsed::<Compression>)]
    pub(crate) compression: Option<Compression>,
}

impl SpecificArgs {
    fn arguments(self, images: Option<PackedImages>) -> PackageArguments {
        PackageArguments {
            images,
            modalities: self.modalities,
            max_size: self.max_size,
            max_count: self.max_count,
            prefix: self.prefix,
            shuffle: self.shuffle,
            points: self.points,
            binary: self.binary,
            copy_images: self.copy_images,
            depth: self.depth,
            stuff: self.stuff,
            compression: self.compression,
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
