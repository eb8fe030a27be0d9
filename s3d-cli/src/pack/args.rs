//! The options of `s3d pack`: which package, and what belongs to each.

use crate::arg_values::parsed;
use crate::args::Threads;
use crate::failure::{Failure, Outcome};
use clap::{Args, value_parser};
use s3d_io::{Compression, Domain};
use s3d_label::Class;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

#[derive(Debug, Args)]
pub(crate) struct PackArgs {
    /// The data set's folder. Nothing in it is altered.
    #[arg(value_name = "OUT")]
    pub(crate) dataset: PathBuf,
    /// What to make of it.
    #[arg(long, value_parser = parsed::<Kind>, value_name = "webdataset|colmap|nerfstudio|coco|parquet")]
    pub(crate) to: Kind,
    /// The package's folder, of parquet its file [default: beside OUT: OUT_webdataset, …, OUT_images.parquet]
    #[arg(short, long, value_name = "DEST")]
    pub(crate) output: Option<PathBuf>,
    /// Replace an earlier package in DEST.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Of these areas only, such as 1,3 [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = value_parser!(u32).range(1..))]
    pub(crate) areas: Vec<u32>,
    /// Of perspective views only, of panoramas only, or of both [default: all; COLMAP has views only]
    #[arg(long, value_name = "views|panoramas|all", value_parser = parsed::<Which>)]
    pub(crate) images: Option<Which>,
    #[command(flatten)]
    pub(crate) threads: Threads,
    #[command(flatten, next_help_heading = "Options of single packages")]
    pub(crate) options: PackOptions,
}

/// What belongs to some packages only; `None` (or false) where it was not said.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct PackOptions {
    /// webdataset: which files of an image go into its sample [default: all that there are]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parsed::<Domain>)]
    pub(crate) modalities: Option<Vec<Domain>>,
    /// webdataset: megabytes (1,000,000 bytes) of a shard, at most [default: 1000]
    #[arg(long, value_name = "MB", value_parser = value_parser!(u32).range(1..))]
    pub(crate) max_size: Option<u32>,
    /// webdataset: samples of a shard, at most [default: 10000]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub(crate) max_count: Option<u32>,
    /// webdataset: one series of shards PREFIX-000000.tar for all areas, instead of area_N_views-000000.tar and
    /// area_N_panoramas-000000.tar for each
    #[arg(long, value_name = "PREFIX", value_parser = shard_prefix)]
    pub(crate) prefix: Option<String>,
    /// webdataset: samples in a random order that this number decides, instead of by scan location
    #[arg(long, value_name = "SEED")]
    pub(crate) shuffle: Option<u64>,
    /// colmap, nerfstudio: points of each area's cloud, evenly spaced [default: 100000; 0 for none]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32))]
    pub(crate) points: Option<u32>,
    /// colmap: cameras.bin, images.bin and points3D.bin instead of text
    #[arg(long)]
    pub(crate) binary: bool,
    /// colmap, nerfstudio: copy the RGB images into DEST, which can be moved then, instead of pointing to those in OUT
    #[arg(long)]
    pub(crate) copy_images: bool,
    /// nerfstudio: depth written anew in millimetres with 0 for missing, as it is read by default; OUT's own files, for
    /// which ns-train's --depth-unit-scale-factor must be 0.001953125 (1/512) and missing pixels seem to be 128 m away; or
    /// none [default: millimetres]
    #[arg(long, value_name = "millimetres|original|none", value_parser = parsed::<DepthFiles>)]
    pub(crate) depth: Option<DepthFiles>,
    /// coco: classes of which all instances in an image are one segment, or none [default: ceiling,floor,wall]
    #[arg(long, value_name = "LIST|none", value_parser = classes)]
    pub(crate) stuff: Option<ClassList>,
    /// coco, nerfstudio: how much time the images' files may take: fast, balanced or small [default: balanced]
    #[arg(long, value_name = "fast|balanced|small", value_parser = parsed::<Compression>)]
    pub(crate) compression: Option<Compression>,
}

impl PackOptions {
    /// Refuses options that another package has.
    pub(crate) fn check(&self, kind: Kind) -> Outcome<()> {
        use Kind::{Coco, Colmap, Nerfstudio, Webdataset};
        let options: [(&str, bool, &[Kind]); 11] = [
            ("--modalities", self.modalities.is_some(), &[Webdataset]),
            ("--max-size", self.max_size.is_some(), &[Webdataset]),
            ("--max-count", self.max_count.is_some(), &[Webdataset]),
            ("--prefix", self.prefix.is_some(), &[Webdataset]),
            ("--shuffle", self.shuffle.is_some(), &[Webdataset]),
            ("--points", self.points.is_some(), &[Colmap, Nerfstudio]),
            ("--binary", self.binary, &[Colmap]),
            ("--copy-images", self.copy_images, &[Colmap, Nerfstudio]),
            ("--depth", self.depth.is_some(), &[Nerfstudio]),
            ("--stuff", self.stuff.is_some(), &[Coco]),
            ("--compression", self.compression.is_some(), &[Coco, Nerfstudio]),
        ];
        for (name, given, kinds) in options {
            if given && !kinds.contains(&kind) {
                let kinds: Vec<String> = kinds.iter().map(Kind::to_string).collect();
                return Err(Failure::Call(format!(
                    "{name} is an option of --to {} only",
                    kinds.join(" and ")
                )));
            }
        }
        Ok(())
    }
}

/// A package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Webdataset,
    Colmap,
    Nerfstudio,
    Coco,
    Parquet,
}

impl Kind {
    const ALL: [(&str, Self); 5] = [
        ("webdataset", Self::Webdataset),
        ("colmap", Self::Colmap),
        ("nerfstudio", Self::Nerfstudio),
        ("coco", Self::Coco),
        ("parquet", Self::Parquet),
    ];
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&Self::ALL, *self))
    }
}

impl FromStr for Kind {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        choice(&Self::ALL, word)
    }
}

/// Which images are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Which {
    Views,
    Panoramas,
    All,
}

impl Which {
    const ALL: [(&str, Self); 3] =
        [("views", Self::Views), ("panoramas", Self::Panoramas), ("all", Self::All)];
}

impl fmt::Display for Which {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&Self::ALL, *self))
    }
}

impl FromStr for Which {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        choice(&Self::ALL, word)
    }
}

/// Which depth files nerfstudio gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DepthFiles {
    Millimetres,
    Original,
    None,
}

impl DepthFiles {
    const ALL: [(&str, Self); 3] =
        [("millimetres", Self::Millimetres), ("original", Self::Original), ("none", Self::None)];
}

impl FromStr for DepthFiles {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        choice(&Self::ALL, word)
    }
}

fn name_of<T: PartialEq>(all: &[(&'static str, T)], value: T) -> &'static str {
    all.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

fn choice<T: Copy>(all: &[(&'static str, T)], word: &str) -> Result<T, String> {
    let found = all.iter().find(|(name, _)| *name == word).map(|(_, value)| *value);
    let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    found.ok_or_else(|| format!("there are {}", names.join(", ")))
}

/// Some classes, in their order and once each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ClassList(pub(crate) Vec<Class>);

impl Default for ClassList {
    /// What rooms are made of.
    fn default() -> Self {
        Self(vec![Class::Ceiling, Class::Floor, Class::Wall])
    }
}

fn classes(text: &str) -> Result<ClassList, String> {
    if text.trim() == "none" {
        return Ok(ClassList(Vec::new()));
    }
    let parse = |word: &str| word.trim().parse::<Class>().map_err(|e| e.to_string());
    let asked = text.split(',').map(parse).collect::<Result<Vec<_>, _>>()?;
    Ok(ClassList(Class::ALL.into_iter().filter(|c| asked.contains(c)).collect()))
}

/// A prefix that can stand in a file's name and in a brace expansion.
fn shard_prefix(text: &str) -> Result<String, String> {
    let fits = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    if text.is_empty() || text.starts_with('.') || !text.chars().all(fits) {
        return Err("must be letters, digits, _, - and ., and not begin with a .".to_owned());
    }
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Cli, Command};
    use clap::Parser;

    fn parse(args: &[&str]) -> Result<PackArgs, clap::Error> {
        match Cli::try_parse_from(["s3d", "pack", "out"].iter().chain(args))?.command {
            Command::Pack(args) => Ok(args),
            _ => panic!("another command"),
        }
    }

    #[test]
    fn options_belong_to_their_package() {
        let args = parse(&["--to", "coco", "--stuff", "wall,floor,wall"]).unwrap();
        assert_eq!(args.options.stuff, Some(ClassList(vec![Class::Floor, Class::Wall])));
        args.options.check(Kind::Coco).unwrap();
        let e = args.options.check(Kind::Parquet).unwrap_err().to_string();
        assert_eq!(e, "--stuff is an option of --to coco only");
        let args = parse(&["--to", "colmap", "--points", "0", "--copy-images"]).unwrap();
        args.options.check(Kind::Nerfstudio).unwrap();
        assert!(args.options.check(Kind::Webdataset).is_err());
        assert_eq!(
            parse(&["--to", "coco", "--stuff", "none"]).unwrap().options.stuff,
            Some(ClassList(vec![]))
        );
    }

    #[test]
    fn nonsense_is_refused() {
        for bad in [
            &[] as &[&str],
            &["--to", "zip"],
            &["--to", "coco", "--stuff", "grass"],
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
        for (name, kind) in Kind::ALL {
            assert_eq!((name.parse(), kind.to_string().as_str()), (Ok(kind), name));
        }
    }
}
