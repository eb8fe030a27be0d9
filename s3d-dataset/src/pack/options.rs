//! PackedImages package is made of which images, and what belongs to each.

use crate::error::{Error, Result};
use s3d_io::dataset::Domain;
use s3d_io::image::Compression;
use s3d_label::{Class, Taxonomy};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// What is made of which images. `Default` packs all images of all areas, beside the data set.
#[derive(Clone, Debug, Default)]
pub struct PackOptions {
    /// The package's folder, of Parquet its file; `None` for a place beside the data set, named after it.
    pub output: Option<PathBuf>,
    /// Replace an earlier package there.
    pub overwrite: bool,
    /// Of these areas only; of all if empty.
    pub areas: Vec<u32>,
    /// Of which images; `None` for all that the package can hold.
    pub images: Option<PackedImages>,
    /// What belongs to some packages only.
    pub specific: SpecificOptions,
}

/// What belongs to some packages only; `None` (or false) where it was not said.
#[derive(Clone, Debug, Default)]
pub struct SpecificOptions {
    /// webdataset: which files of an image go into its sample [default: all that there are]
    pub modalities: Option<Vec<Domain>>,
    /// webdataset: megabytes (1,000,000 bytes) of a shard, at most [default: 1000]
    pub max_size: Option<u32>,
    /// webdataset: samples of a shard, at most [default: 10000]
    pub max_count: Option<u32>,
    /// webdataset: one series of shards PREFIX-000000.tar for all areas, instead of area_N_views-000000.tar
    /// and area_N_panoramas-000000.tar for each
    pub prefix: Option<ShardPrefix>,
    /// webdataset: samples in a random order that this number decides, instead of by scan location
    pub shuffle: Option<u64>,
    /// colmap, nerfstudio: points of each area's cloud, evenly spaced [default: 100000; 0 for none]
    pub points: Option<u32>,
    /// colmap: cameras.bin, images.bin and points3D.bin instead of text
    pub binary: bool,
    /// colmap, nerfstudio: copy the RGB images into DEST, which can be moved then, instead of pointing to
    /// those in OUT
    pub copy_images: bool,
    /// nerfstudio: depth written anew in millimetres with 0 for missing, as it is read by default; OUT's own
    /// files, for which ns-train's --depth-unit-scale-factor must be 0.001953125 (1/512) and missing pixels
    /// seem to be 128 m away; or none [default: millimetres]
    pub depth: Option<DepthFiles>,
    /// coco: classes of which all instances in an image are one segment, or none [default: those that the
    /// taxonomy calls stuff: ceiling,floor,wall]
    pub stuff: Option<ClassList>,
    /// coco, nerfstudio: how much time the images' files may take: fast, balanced or small [default:
    /// balanced]
    pub compression: Option<Compression>,
}

impl SpecificOptions {
    /// Refuses options that another package has.
    pub(crate) fn check(&self, kind: PackageKind) -> Result<()> {
        use PackageKind::{Coco, Colmap, Nerfstudio, Webdataset};
        let options: [(&str, bool, &[PackageKind]); 11] = [
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
                let kinds: Vec<String> = kinds.iter().map(PackageKind::to_string).collect();
                return Err(Error::Usage(format!(
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
pub enum PackageKind {
    /// Tar shards, a sample an image.
    Webdataset,
    /// Cameras, images and points as COLMAP writes a sparse model.
    Colmap,
    /// `transforms.json` of nerfstudio.
    Nerfstudio,
    /// COCO panoptic.
    Coco,
    /// A table of all images.
    Parquet,
}

impl PackageKind {
    const ALL: [(&str, Self); 5] = [
        ("webdataset", Self::Webdataset),
        ("colmap", Self::Colmap),
        ("nerfstudio", Self::Nerfstudio),
        ("coco", Self::Coco),
        ("parquet", Self::Parquet),
    ];
}

impl fmt::Display for PackageKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&Self::ALL, *self))
    }
}

impl FromStr for PackageKind {
    type Err = String;

    fn from_str(word: &str) -> std::result::Result<Self, String> {
        choice(&Self::ALL, word)
    }
}

/// PackedImages images are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackedImages {
    /// Perspective views.
    Views,
    /// Panoramas.
    Panoramas,
    /// Both.
    All,
}

impl PackedImages {
    const ALL: [(&str, Self); 3] =
        [("views", Self::Views), ("panoramas", Self::Panoramas), ("all", Self::All)];
}

impl fmt::Display for PackedImages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&Self::ALL, *self))
    }
}

impl FromStr for PackedImages {
    type Err = String;

    fn from_str(word: &str) -> std::result::Result<Self, String> {
        choice(&Self::ALL, word)
    }
}

/// PackedImages depth files nerfstudio gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthFiles {
    /// Written anew: 16 bits, millimetres, 0 for missing.
    Millimetres,
    /// The data set's own.
    Original,
    /// None.
    None,
}

impl DepthFiles {
    const ALL: [(&str, Self); 3] =
        [("millimetres", Self::Millimetres), ("original", Self::Original), ("none", Self::None)];
}

impl FromStr for DepthFiles {
    type Err = String;

    fn from_str(word: &str) -> std::result::Result<Self, String> {
        choice(&Self::ALL, word)
    }
}

fn name_of<T: PartialEq>(all: &[(&'static str, T)], value: T) -> &'static str {
    all.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

fn choice<T: Copy>(all: &[(&'static str, T)], word: &str) -> std::result::Result<T, String> {
    let found = all.iter().find(|(name, _)| *name == word).map(|(_, value)| *value);
    let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    found.ok_or_else(|| format!("there are {}", names.join(", ")))
}

/// Names of classes, of whatever taxonomy the data set has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClassList(pub Vec<String>);

impl ClassList {
    /// The classes, in their order and once each.
    ///
    /// # Errors
    /// [`Error::Usage`] for a name that is none of a class.
    pub fn classes(&self, taxonomy: &Taxonomy) -> Result<Vec<Class>> {
        let class = |name: &String| taxonomy.class(name).map_err(|e| Error::Usage(format!("--stuff: {e}")));
        let mut classes = self.0.iter().map(class).collect::<Result<Vec<_>>>()?;
        classes.sort_unstable();
        classes.dedup();
        Ok(classes)
    }
}

impl FromStr for ClassList {
    type Err = String;

    /// Names of classes between commas, or `none`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        if text.trim() == "none" {
            return Ok(Self(Vec::new()));
        }
        let mut names: Vec<String> = text.split(',').map(|word| word.trim().to_owned()).collect();
        names.sort_unstable();
        names.dedup();
        if names.iter().any(String::is_empty) {
            return Err("must be names of classes between commas, or none".to_owned());
        }
        Ok(Self(names))
    }
}

/// The beginning of shards' names: it can stand in a file's name and in a brace expansion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardPrefix(String);

impl ShardPrefix {
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for ShardPrefix {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let fits = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
        if text.is_empty() || text.starts_with('.') || !text.chars().all(fits) {
            return Err("must be letters, digits, _, - and ., and not begin with a .".to_owned());
        }
        Ok(Self(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_belong_to_their_package() {
        let stuff: ClassList = "wall,floor,wall".parse().unwrap();
        assert_eq!(stuff.classes(&Taxonomy::s3dis()).unwrap(), [Class::FLOOR, Class::WALL]);
        let coco = SpecificOptions { stuff: Some(stuff), ..SpecificOptions::default() };
        coco.check(PackageKind::Coco).unwrap();
        let e = coco.check(PackageKind::Parquet).unwrap_err().to_string();
        assert_eq!(e, "--stuff is an option of --to coco only");
        let points = SpecificOptions { points: Some(0), copy_images: true, ..SpecificOptions::default() };
        points.check(PackageKind::Nerfstudio).unwrap();
        assert!(points.check(PackageKind::Webdataset).is_err());
        assert_eq!("none".parse(), Ok(ClassList(Vec::new())));
    }

    #[test]
    fn words_and_kinds() {
        for (name, kind) in PackageKind::ALL {
            assert_eq!((name.parse(), kind.to_string().as_str()), (Ok(kind), name));
        }
        assert!("{0..9}".parse::<ShardPrefix>().is_err() && "a/b".parse::<ShardPrefix>().is_err());
        assert!("wall,".parse::<ClassList>().is_err());
        let grass: ClassList = "wall,grass".parse().unwrap();
        let e = grass.classes(&Taxonomy::s3dis()).unwrap_err();
        assert!(
            e.to_string()
                .contains("--stuff: \"grass\" is no class; the classes are ceiling"),
            "{e}"
        );
        let beds: ClassList = "bed,wall".parse().unwrap();
        let nyu40 = Taxonomy::built_in("nyu40").unwrap();
        assert_eq!(
            beds.classes(&nyu40)
                .unwrap()
                .iter()
                .map(|c| c.index())
                .collect::<Vec<_>>(),
            [0, 3]
        );
    }
}
