//! Writes WebDataset: training samples in tar archives.

mod shards;
mod tar;

pub use shards::{ShardEntry, ShardLimits, plan_shards, sample_key, sample_member, write_shard_index};
pub use tar::TarWriter;
