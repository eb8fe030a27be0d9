//! Packages for loaders and other programs.

#[cfg(feature = "coco")]
mod coco;
#[cfg(feature = "colmap")]
mod colmap;
#[cfg(feature = "nerfstudio")]
mod nerfstudio;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(feature = "webdataset")]
mod webdataset;

#[cfg(feature = "parquet")]
pub use self::parquet::{ImageRow, SemanticRow, write_image_index, write_image_index_to};
#[cfg(feature = "coco")]
pub use coco::{
    CocoCategory, CocoImage, CocoSegment, UnknownLabelIndex, coco_categories, coco_category_id,
    coco_panoptic, write_coco,
};
#[cfg(feature = "colmap")]
pub use colmap::{ColmapImage, write_colmap_binary, write_colmap_text};
#[cfg(feature = "nerfstudio")]
pub use nerfstudio::{NerfstudioCamera, NerfstudioFrame, write_nerfstudio};
#[cfg(feature = "webdataset")]
pub use webdataset::{
    ShardEntry, ShardLimits, TarWriter, plan_shards, sample_key, sample_member, write_shard_index,
};
