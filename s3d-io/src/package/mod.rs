//! Packages for loaders and other programs.

mod coco;
mod colmap;
mod nerfstudio;
mod parquet;
mod webdataset;

pub use self::parquet::{ImageRow, SemanticRow, write_image_index};
pub use coco::{
    CocoCategory, CocoImage, CocoSegment, UnknownLabelIndex, coco_categories, coco_category_id,
    coco_panoptic, write_coco,
};
pub use colmap::{ColmapImage, write_colmap_binary, write_colmap_text};
pub use nerfstudio::{NerfstudioCamera, NerfstudioFrame, write_nerfstudio};
pub use webdataset::{
    ShardEntry, ShardLimits, TarWriter, plan_shards, sample_key, sample_member, write_shard_index,
};
