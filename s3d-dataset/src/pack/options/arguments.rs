//! The options of all packages side by side.

use super::kind::{DepthFiles, Holds, PackageKind, PackedImages};
use super::names::{ClassList, ShardPrefix};
use super::{
    CocoOptions, ColmapOptions, HuggingfaceOptions, NerfstudioOptions, ObjectTableOptions, Package,
    ParquetOptions, SceneGraphOptions, WebdatasetOptions,
};
use crate::error::{Result, UsageError};
#[cfg(feature = "clap")]
use crate::options::words::parsed;
use s3d_io::dataset::Domain;
use s3d_io::image::Compression;

/// The options of all packages side by side, as words or arguments give them. [`package`](Self::package)
/// makes a [`Package`] from them. An option that was not given is `None` or false.
///
/// With the feature `clap` it is a group of arguments of a command line: comments of fields are help texts.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct PackageArguments {
    /// Pack perspective views only, panoramas only, or both [default: all that the package can hold]
    #[cfg_attr(feature = "clap", arg(long, value_name = "views|panoramas|all",
        value_parser = parsed::<PackedImages>, help_heading = clap::builder::Resettable::Reset))]
    pub images: Option<PackedImages>,
    /// webdataset, huggingface: the files of an image that are packed [default: all that exist]
    #[cfg_attr(feature = "clap", arg(long, value_name = "LIST", value_delimiter = ',',
        value_parser = parsed::<Domain>))]
    pub modalities: Option<Vec<Domain>>,
    /// webdataset: the largest size of a shard, in megabytes (1,000,000 bytes) [default: 1000]
    #[cfg_attr(feature = "clap", arg(long, value_name = "MB",
        value_parser = clap::value_parser!(u32).range(1..)))]
    pub max_size: Option<u32>,
    /// webdataset: the largest number of samples in a shard [default: an eighth of a series, so that eight
    /// workers have work]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..)))]
    pub max_count: Option<u32>,
    /// webdataset: one series of shards PREFIX-000000.tar for all areas, instead of area_N_views-000000.tar
    /// and area_N_panoramas-000000.tar for each
    #[cfg_attr(feature = "clap", arg(long, value_name = "PREFIX", value_parser = parsed::<ShardPrefix>))]
    pub prefix: Option<ShardPrefix>,
    /// webdataset: shuffle the samples with this seed, instead of ordering them by scan location
    #[cfg_attr(feature = "clap", arg(long, value_name = "SEED"))]
    pub shuffle: Option<u64>,
    /// colmap, nerfstudio: the number of points of each area's cloud, evenly spaced [default: 100000; 0 for
    /// none]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub points: Option<u32>,
    /// colmap: write cameras.bin, images.bin and points3D.bin instead of text
    #[cfg_attr(feature = "clap", arg(long))]
    pub binary: bool,
    /// colmap, nerfstudio: copy the RGB images into DEST, so that DEST can be moved, instead of pointing to
    /// the images in OUT
    #[cfg_attr(feature = "clap", arg(long))]
    pub copy_images: bool,
    /// nerfstudio: the depth files: new files in millimetres with 0 for missing, which is nerfstudio's
    /// default; OUT's original files, which need --depth-unit-scale-factor 0.001953125 (1/512) of ns-train,
    /// and in which missing pixels seem to be 128 m away; or none [default: millimetres]
    #[cfg_attr(feature = "clap", arg(long, value_name = "millimetres|original|none",
        value_parser = parsed::<DepthFiles>))]
    pub depth: Option<DepthFiles>,
    /// coco: the classes whose instances in an image are joined into one segment, or none [default: the stuff
    /// of the taxonomy: ceiling,floor,wall]
    #[cfg_attr(feature = "clap", arg(long, value_name = "LIST|none", value_parser = parsed::<ClassList>))]
    pub stuff: Option<ClassList>,
    /// coco, nerfstudio: compression of the image files: fast, balanced or small [default: balanced]
    #[cfg_attr(feature = "clap", arg(long, value_name = "fast|balanced|small",
        value_parser = parsed::<Compression>))]
    pub compression: Option<Compression>,
}

impl PackageArguments {
    /// Makes a package of this kind.
    ///
    /// # Errors
    /// [`UsageError::ForeignOption`] if an option is given that only another package has;
    /// [`UsageError::InvalidValue`] if a package of views is asked for panoramas.
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
            PackageKind::Huggingface => Package::Huggingface(HuggingfaceOptions { images, modalities }),
            PackageKind::Dust3r => Package::Dust3r,
            PackageKind::Wai => Package::Wai,
            PackageKind::Vggt => Package::Vggt,
            PackageKind::Pointcept => Package::Pointcept,
            PackageKind::SceneGraph => Package::SceneGraph(SceneGraphOptions { images }),
            PackageKind::Habitat => Package::Habitat,
            PackageKind::Usd => Package::Usd,
            PackageKind::Concerto => Package::Concerto,
            PackageKind::Objects => Package::Objects(ObjectTableOptions { images }),
            PackageKind::SpatialQa => Package::SpatialQa,
        })
    }

    /// Refuses options that the package does not have.
    fn check(&self, kind: PackageKind) -> Result<()> {
        use PackageKind::{Coco, Colmap, Huggingface, Nerfstudio, Webdataset};
        let with_images: Vec<PackageKind> = PackageKind::with_images().collect();
        let options: [(&'static str, bool, &[PackageKind]); 12] = [
            ("images", self.images.is_some(), &with_images),
            ("modalities", self.modalities.is_some(), &[Webdataset, Huggingface]),
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

        if kind.holds() == Holds::Views && self.images == Some(PackedImages::Panoramas) {
            let value = PackedImages::Panoramas.to_string();
            let why = format!(
                "{}'s cameras are pinholes, and panoramas are none: pack them for nerfstudio",
                kind.title()
            );
            return Err(UsageError::InvalidValue { option: "images", value, why }.into());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_label::{Class, Taxonomy};

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
        let e = panoramas
            .clone()
            .package(PackageKind::Pointcept)
            .unwrap_err()
            .to_string();
        assert!(e.starts_with("`images` belongs to webdataset and colmap and"), "{e}");
        let coco = panoramas.package(PackageKind::Coco).unwrap();
        assert_eq!(coco.images(), Some(PackedImages::Panoramas));
        assert_eq!("none".parse(), Ok(ClassList(Vec::new())));
    }

    #[test]
    fn words_are_names() {
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
