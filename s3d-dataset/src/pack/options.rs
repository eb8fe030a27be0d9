//! The options of each package, and the images that it holds.

use crate::error::{Result, UsageError};
use s3d_io::dataset::Domain;
use s3d_io::image::Compression;
use s3d_label::{Class, Taxonomy};
use serde::Serialize;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Options of all packages. `Default` packs all areas, beside the data set.
#[derive(Clone, Debug, Default)]
pub struct PackOptions {
    /// The package's folder, or the file of a Parquet table. `None` for a place beside the data set, named
    /// after it.
    pub output: Option<PathBuf>,
    /// Replace an earlier package at this place.
    pub overwrite: bool,
    /// The areas to pack; all if empty.
    pub areas: Vec<u32>,
}

/// A package and its options.
#[derive(Clone, Debug)]
pub enum Package {
    /// Tar shards with one sample for each image.
    Webdataset(WebdatasetOptions),
    /// Cameras, images and points in the form of COLMAP's sparse model. It holds perspective views only,
    /// since COLMAP's cameras are pinholes.
    Colmap(ColmapOptions),
    /// `transforms.json` of nerfstudio.
    Nerfstudio(NerfstudioOptions),
    /// COCO panoptic.
    Coco(CocoOptions),
    /// A table of all images.
    Parquet(ParquetOptions),
}

/// Options of [`Package::Webdataset`].
#[derive(Clone, Debug, Default)]
pub struct WebdatasetOptions {
    /// The images that are packed.
    pub images: PackedImages,
    /// The files of an image that go into its sample; `None` for all files.
    pub modalities: Option<Vec<Domain>>,
    /// The most megabytes (1,000,000 bytes) in a shard. `None` for 1000.
    pub max_size: Option<u32>,
    /// The most samples in a shard. `None` for an eighth of a series, so that eight workers have work, or for
    /// 10,000 if `max_size` is given.
    pub max_count: Option<u32>,
    /// Write one series of shards PREFIX-000000.tar for all areas, instead of area_N_views-000000.tar and
    /// area_N_panoramas-000000.tar for each area.
    pub prefix: Option<ShardPrefix>,
    /// The seed of a random order of samples. `None` sorts them by scan location.
    pub shuffle: Option<u64>,
}

/// Options of [`Package::Colmap`].
#[derive(Clone, Debug, Default)]
pub struct ColmapOptions {
    /// The number of points of each area's cloud, evenly spaced; 0 for none, `None` for 100,000.
    pub points: Option<u32>,
    /// Write cameras.bin, images.bin and points3D.bin instead of text.
    pub binary: bool,
    /// Copy the RGB images into the package, so that it can be moved. Otherwise the package points to the
    /// images of the data set.
    pub copy_images: bool,
}

/// Options of [`Package::Nerfstudio`].
#[derive(Clone, Debug, Default)]
pub struct NerfstudioOptions {
    /// The images that are packed.
    pub images: PackedImages,
    /// The number of points of each area's cloud, evenly spaced; 0 for none, `None` for 100,000.
    pub points: Option<u32>,
    /// Copy the RGB images into the package, so that it can be moved. Otherwise the package points to the
    /// images of the data set.
    pub copy_images: bool,
    /// The kind of depth files for nerfstudio. `None` writes millimetres if there is depth.
    pub depth: Option<DepthFiles>,
    /// The time that compressing image files may take.
    pub compression: Compression,
}

/// Options of [`Package::Coco`].
#[derive(Clone, Debug, Default)]
pub struct CocoOptions {
    /// The images that are packed.
    pub images: PackedImages,
    /// Stuff classes: all instances of such a class in an image form one segment. `None` for the stuff
    /// classes of the taxonomy; in S3DIS they are ceiling, floor and wall.
    pub stuff: Option<ClassList>,
    /// The time that compressing image files may take.
    pub compression: Compression,
}

/// Options of [`Package::Parquet`].
#[derive(Clone, Debug, Default)]
pub struct ParquetOptions {
    /// The images that are packed.
    pub images: PackedImages,
}

/// The options of all packages side by side, as words or arguments give them. [`package`](Self::package)
/// makes a [`Package`] from them. An option that was not given is `None` or false.
#[derive(Clone, Debug, Default)]
pub struct PackageArguments {
    /// For all packages but COLMAP.
    pub images: Option<PackedImages>,
    /// For WebDataset.
    pub modalities: Option<Vec<Domain>>,
    /// For WebDataset.
    pub max_size: Option<u32>,
    /// For WebDataset.
    pub max_count: Option<u32>,
    /// For WebDataset.
    pub prefix: Option<ShardPrefix>,
    /// For WebDataset.
    pub shuffle: Option<u64>,
    /// For COLMAP and nerfstudio.
    pub points: Option<u32>,
    /// For COLMAP.
    pub binary: bool,
    /// For COLMAP and nerfstudio.
    pub copy_images: bool,
    /// For nerfstudio.
    pub depth: Option<DepthFiles>,
    /// For COCO.
    pub stuff: Option<ClassList>,
    /// For COCO and nerfstudio.
    pub compression: Option<Compression>,
}

impl PackageArguments {
    /// Makes a package of this kind.
    ///
    /// # Errors
    /// [`UsageError::ForeignOption`] if an option is given that only another package has;
    /// [`UsageError::InvalidValue`] if COLMAP is asked for panoramas.
    pub fn package(self, kind: PackageKind) -> Result<Package> {
        self.check(kind)?;
        let Self { modalities, max_size, max_count, prefix, shuffle, points, .. } = self;
        let Self { binary, copy_images, depth, stuff, .. } = self;
        let images = self.images.unwrap_or_default();
        let compression = self.compression.unwrap_or_default();

        Ok(match kind {
            PackageKind::Webdataset => Package::Webdataset(WebdatasetOptions {
                images,
                modalities,
                max_size,
                max_count,
                prefix,
                shuffle,
            }),
            PackageKind::Colmap => Package::Colmap(ColmapOptions { points, binary, copy_images }),
            PackageKind::Nerfstudio => {
                Package::Nerfstudio(NerfstudioOptions { images, points, copy_images, depth, compression })
            }
            PackageKind::Coco => Package::Coco(CocoOptions { images, stuff, compression }),
            PackageKind::Parquet => Package::Parquet(ParquetOptions { images }),
        })
    }

    /// Refuses options that the package does not have.
    fn check(&self, kind: PackageKind) -> Result<()> {
        use PackageKind::{Coco, Colmap, Nerfstudio, Webdataset};
        let options: [(&'static str, bool, &[PackageKind]); 11] = [
            ("modalities", self.modalities.is_some(), &[Webdataset]),
            ("max_size", self.max_size.is_some(), &[Webdataset]),
            ("max_count", self.max_count.is_some(), &[Webdataset]),
            ("prefix", self.prefix.is_some(), &[Webdataset]),
            ("shuffle", self.shuffle.is_some(), &[Webdataset]),
            ("points", self.points.is_some(), &[Colmap, Nerfstudio]),
            ("binary", self.binary, &[Colmap]),
            ("copy_images", self.copy_images, &[Colmap, Nerfstudio]),
            ("depth", self.depth.is_some(), &[Nerfstudio]),
            ("stuff", self.stuff.is_some(), &[Coco]),
            ("compression", self.compression.is_some(), &[Coco, Nerfstudio]),
        ];

        for (option, given, kinds) in options {
            if given && !kinds.contains(&kind) {
                let packages = kinds.iter().map(|kind| kind.name()).collect();
                return Err(UsageError::ForeignOption { option, packages }.into());
            }
        }

        if kind == Colmap && self.images == Some(PackedImages::Panoramas) {
            let value = PackedImages::Panoramas.to_string();
            let why =
                "COLMAP's cameras are pinholes, and panoramas are none: pack them for nerfstudio".to_owned();
            return Err(UsageError::InvalidValue { option: "images", value, why }.into());
        }
        Ok(())
    }
}

impl Package {
    /// The kind of the package.
    pub fn kind(&self) -> PackageKind {
        match self {
            Self::Webdataset(_) => PackageKind::Webdataset,
            Self::Colmap(_) => PackageKind::Colmap,
            Self::Nerfstudio(_) => PackageKind::Nerfstudio,
            Self::Coco(_) => PackageKind::Coco,
            Self::Parquet(_) => PackageKind::Parquet,
        }
    }

    /// The images that the package holds.
    pub(crate) fn images(&self) -> PackedImages {
        match self {
            Self::Webdataset(options) => options.images,
            Self::Colmap(_) => PackedImages::Views,
            Self::Nerfstudio(options) => options.images,
            Self::Coco(options) => options.images,
            Self::Parquet(options) => options.images,
        }
    }
}

/// A kind of package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackageKind {
    /// [`Package::Webdataset`].
    Webdataset,
    /// [`Package::Colmap`].
    Colmap,
    /// [`Package::Nerfstudio`].
    Nerfstudio,
    /// [`Package::Coco`].
    Coco,
    /// [`Package::Parquet`].
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

    /// The name, which `FromStr` reads.
    pub fn name(self) -> &'static str {
        name_of(&Self::ALL, self)
    }
}

impl fmt::Display for PackageKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for PackageKind {
    type Err = String;

    fn from_str(word: &str) -> std::result::Result<Self, String> {
        choice(&Self::ALL, word)
    }
}

/// The images that a package holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PackedImages {
    /// Perspective views.
    Views,
    /// Panoramas.
    Panoramas,
    /// Views and panoramas.
    #[default]
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

/// The depth files of a nerfstudio package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthFiles {
    /// New files: 16 bits, millimetres, 0 if missing.
    Millimetres,
    /// The files of the data set. nerfstudio must be given their unit, and missing pixels appear 128 m away.
    Original,
    /// No depth files.
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

/// The name of a value; empty if it has none.
fn name_of<T: PartialEq>(all: &[(&'static str, T)], value: T) -> &'static str {
    all.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

/// The value with this name. The error lists all names.
fn choice<T: Copy>(all: &[(&'static str, T)], word: &str) -> std::result::Result<T, String> {
    let found = all.iter().find(|(name, _)| *name == word).map(|(_, value)| *value);
    let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    found.ok_or_else(|| format!("there are {}", names.join(", ")))
}

/// Names of classes, from any taxonomy.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ClassList(pub Vec<String>);

impl ClassList {
    /// The classes in the taxonomy's order, without duplicates.
    ///
    /// # Errors
    /// [`UsageError::InvalidValue`] if no class has a name.
    pub fn classes(&self, taxonomy: &Taxonomy) -> Result<Vec<Class>> {
        let mut classes = Vec::with_capacity(self.0.len());
        for name in &self.0 {
            let class = taxonomy.class(name).map_err(|e| UsageError::InvalidValue {
                option: "stuff",
                value: name.clone(),
                why: e.to_string(),
            })?;
            classes.push(class);
        }
        classes.sort_unstable();
        classes.dedup();
        Ok(classes)
    }
}

impl FromStr for ClassList {
    type Err = String;

    /// Reads names of classes between commas, or `none`.
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

/// The prefix of shards' names. It fits into a file name and a brace expansion.
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
        let has_other = text.contains(|c: char| !c.is_ascii_alphanumeric() && !"_-.".contains(c));
        if text.is_empty() || text.starts_with('.') || has_other {
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
        let coco = PackageArguments { stuff: Some(stuff), ..PackageArguments::default() };
        assert!(matches!(coco.clone().package(PackageKind::Coco), Ok(Package::Coco(_))));
        let e = coco.package(PackageKind::Parquet).unwrap_err().to_string();
        assert_eq!(e, "`stuff` belongs to coco only");

        let points = PackageArguments { points: Some(0), copy_images: true, ..PackageArguments::default() };
        points.clone().package(PackageKind::Nerfstudio).unwrap();
        assert!(points.package(PackageKind::Webdataset).is_err());

        let panoramas = PackageArguments { images: Some(PackedImages::Panoramas), ..Default::default() };
        assert!(panoramas.clone().package(PackageKind::Colmap).is_err());
        assert_eq!(panoramas.package(PackageKind::Coco).unwrap().images(), PackedImages::Panoramas);
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
                .contains("`stuff = grass`: \"grass\" is no class; the classes are ceiling"),
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
