//! Writes packages of a data set for other programs.
//!
//! | package | what is written |
//! |---|---|
//! | WebDataset | tar archives of samples: [`TarWriter`], [`plan_shards`], [`write_shard_index`] |
//! | COLMAP | cameras, images and points as a model: [`ColmapModel`] |
//! | nerfstudio | `transforms.json`: [`write_nerfstudio`] |
//! | COCO | panoptic annotations: [`coco_panoptic`], [`write_coco`] |
//! | Parquet | a table of all images: [`write_image_index`]; of their objects: [`ObjectTable`] |
//! | DUSt3R, MUSt3R | scenes, images and pairs: [`write_dust3r`] |
//! | WAI (MapAnything) | cameras, and who sees what: [`write_wai_scene`], [`write_wai_covisibility`] |
//! | VGGT | annotation files: [`write_vggt_annotations`] |
//! | habitat-sim | scenes in the form of HM3D: [`write_habitat_scene`], [`write_habitat_config`] |
//! | OpenUSD | objects with labels, textures and cameras: [`write_usd`] |
//! | Hugging Face | tables with the images inside: [`ImageTable`]; what describes them: [`write_croissant`] |
//!
//! The same input gives the same bytes. [`dataset_images`](crate::dataset::dataset_images) lists the images;
//! this module reads none of them.
//!
//! ```
//! use s3d_io::package::TarWriter;
//!
//! # let folder = tempfile::tempdir().unwrap();
//! let mut shard = TarWriter::create(&folder.path().join("shard-000000.tar"))?;
//! shard.append("area_1/a.rgb.png", b"an image")?;
//! assert_eq!(shard.finish()?, TarWriter::EMPTY_BYTES + TarWriter::entry_bytes("area_1/a.rgb.png", 8));
//! # Ok::<(), s3d_io::Error>(())
//! ```

#[cfg(feature = "coco")]
mod coco;
#[cfg(feature = "coco")]
mod coco_instances;
#[cfg(feature = "colmap")]
mod colmap;
#[cfg(feature = "multiview")]
mod dust3r;
#[cfg(feature = "habitat")]
mod habitat;
#[cfg(feature = "huggingface")]
mod huggingface;
#[cfg(feature = "nerfstudio")]
mod nerfstudio;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(feature = "usd")]
mod usd;
#[cfg(feature = "multiview")]
mod vggt;
#[cfg(feature = "multiview")]
mod wai;
#[cfg(feature = "webdataset")]
mod webdataset;

#[cfg(feature = "parquet")]
pub use self::parquet::{ImageRow, SemanticRow, write_image_index, write_image_index_to};
#[cfg(all(feature = "parquet", feature = "dataset"))]
pub use self::parquet::{ObjectRow, ObjectTable};
#[cfg(feature = "coco")]
pub use coco::{
    CocoCategory, CocoImage, CocoSegment, UnknownLabelIndex, coco_categories, coco_panoptic, write_coco,
};
#[cfg(feature = "coco")]
pub use coco_instances::{coco_masks, write_coco_instances};
#[cfg(feature = "colmap")]
pub use colmap::{ColmapImage, ColmapModel};
#[cfg(feature = "multiview")]
pub use dust3r::{Dust3rImage, Dust3rScene, write_dust3r};
#[cfg(feature = "habitat")]
pub use habitat::{
    HabitatLabels, HabitatObject, MOST_HABITAT_OBJECTS, write_habitat_config, write_habitat_scene,
};
#[cfg(feature = "huggingface")]
pub use huggingface::{
    HuggingfaceConfig, HuggingfaceSet, ImageRecord, ImageTable, write_croissant, write_huggingface_card,
};
#[cfg(feature = "nerfstudio")]
pub use nerfstudio::{NerfstudioCamera, NerfstudioFrame, write_nerfstudio};
#[cfg(feature = "usd")]
pub use usd::{UsdCamera, UsdObject, write_usd};
#[cfg(feature = "multiview")]
pub use vggt::{VggtImage, write_vggt_annotations};
#[cfg(feature = "multiview")]
pub use wai::{WaiFrame, write_wai_covisibility, write_wai_scene, write_wai_scene_list};
#[cfg(feature = "webdataset")]
pub use webdataset::{
    ShardEntry, ShardLimits, TarWriter, plan_shards, sample_key, sample_member, write_shard_index,
};
