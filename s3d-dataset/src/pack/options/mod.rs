//! The options of each package, and the images that it holds.

mod arguments;
mod kind;
mod names;

pub use arguments::PackageArguments;
pub use kind::{DepthFiles, PackageKind, PackedImages};
pub use names::{ClassList, ShardPrefix};

use s3d_io::dataset::Domain;
use s3d_io::image::Compression;
use std::path::PathBuf;

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
    /// A data set of Hugging Face's `datasets`: Parquet files with the images inside, and a card.
    Huggingface(HuggingfaceOptions),
    /// The views, pairs and depth that the ScanNet++ loaders of DUSt3R and MUSt3R read.
    Dust3r,
    /// Scenes of views in MapAnything's WAI format.
    Wai,
    /// The views of each room as a sequence of VGGT's training code.
    Vggt,
    /// The points of each room as a folder of Pointcept's NPY arrays.
    Pointcept,
    /// The building, rooms, objects and cameras of each area, and what is between them.
    SceneGraph(SceneGraphOptions),
    /// The meshes of each area as a scene of habitat-sim.
    Habitat,
    /// The objects and views of each area as a scene of OpenUSD.
    Usd,
    /// The rooms of [`Package::Pointcept`], their views, and which point each pixel shows.
    Concerto,
    /// A table of the objects of all images.
    Objects(ObjectTableOptions),
    /// What spatial question sets are made of, and questions with computed answers.
    SpatialQa,
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

/// Options of [`Package::Huggingface`].
#[derive(Clone, Debug, Default)]
pub struct HuggingfaceOptions {
    /// The images that are packed.
    pub images: PackedImages,
    /// The files of an image that go into its row; `None` for all PNG files and the pose.
    pub modalities: Option<Vec<Domain>>,
}

/// Options of [`Package::SceneGraph`].
#[derive(Clone, Debug, Default)]
pub struct SceneGraphOptions {
    /// The images that are its cameras.
    pub images: PackedImages,
}

/// Options of [`Package::Objects`].
#[derive(Clone, Debug, Default)]
pub struct ObjectTableOptions {
    /// The images whose objects are packed.
    pub images: PackedImages,
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
            Self::Huggingface(_) => PackageKind::Huggingface,
            Self::Dust3r => PackageKind::Dust3r,
            Self::Wai => PackageKind::Wai,
            Self::Vggt => PackageKind::Vggt,
            Self::Pointcept => PackageKind::Pointcept,
            Self::SceneGraph(_) => PackageKind::SceneGraph,
            Self::Habitat => PackageKind::Habitat,
            Self::Usd => PackageKind::Usd,
            Self::Concerto => PackageKind::Concerto,
            Self::Objects(_) => PackageKind::Objects,
            Self::SpatialQa => PackageKind::SpatialQa,
        }
    }

    /// The images that the package holds, `None` if it holds none.
    pub(crate) fn images(&self) -> Option<PackedImages> {
        match self {
            Self::Webdataset(options) => Some(options.images),
            Self::Colmap(_)
            | Self::Dust3r
            | Self::Wai
            | Self::Vggt
            | Self::Usd
            | Self::Concerto
            | Self::SpatialQa => Some(PackedImages::Views),
            Self::Nerfstudio(options) => Some(options.images),
            Self::Coco(options) => Some(options.images),
            Self::Parquet(options) => Some(options.images),
            Self::Huggingface(options) => Some(options.images),
            Self::Pointcept | Self::Habitat => None,
            Self::SceneGraph(options) => Some(options.images),
            Self::Objects(options) => Some(options.images),
        }
    }
}
