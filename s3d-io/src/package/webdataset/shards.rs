//! Plans the shards of a WebDataset: tar archives of training samples.
//!
//! A sample is the files of one image, one after another in its shard, all with the same key. For WebDataset
//! the key is the part of the name before its first dot, folders included, and the field is the part after
//! it. The image `area_1/camera_…_office_3_frame_7` has the fields `rgb.png`, `depth.png`, …,
//! `pose.json`.

use crate::dataset::domain::Domain;
use crate::dataset::images::DatasetImage;
use crate::error::Result;
use crate::fs::json::write_json;
use crate::package::webdataset::tar::TarWriter;
use serde::Serialize;
use std::ops::Range;
use std::path::Path;

/// Returns the key of an image's sample: `area_{N}/camera_{uuid}_{room}_frame_{frame}`. It has no dot and is
/// unique in the data set.
pub fn sample_key(image: &DatasetImage) -> String {
    format!("area_{}/{}", image.area, image.stem())
}

/// Returns the name of a sample's file in the archive, `KEY.FIELD`. Fields are `rgb.png`, `normals.png`,
/// `global_xyz.exr`, `pose.json` and the like.
pub fn sample_member(key: &str, domain: Domain) -> String {
    format!("{key}.{}.{}", domain.suffix(), domain.extension())
}

/// How large shards may become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShardLimits {
    /// The largest size of a shard in bytes. A sample that is larger gets its own shard.
    pub max_bytes: u64,
    /// The largest number of samples in a shard.
    pub max_samples: usize,
}

impl Default for ShardLimits {
    /// 1 GB and 10,000 samples.
    fn default() -> Self {
        Self { max_bytes: 1_000_000_000, max_samples: 10_000 }
    }
}

/// Assigns samples to shards, in order, as many to each shard as the limits allow. `sizes` are the bytes of
/// each sample in an archive, the sum of its [`TarWriter::entry_bytes`].
///
/// # Panics
/// If `limits` allow no sample in a shard.
pub fn plan_shards(sizes: &[u64], limits: ShardLimits) -> Vec<Range<usize>> {
    assert!(limits.max_samples > 0, "a shard needs room for a sample");
    let mut shards = Vec::new();
    let mut start = 0;
    let mut bytes = TarWriter::EMPTY_BYTES;
    for (i, size) in sizes.iter().enumerate() {
        let full = i - start >= limits.max_samples || bytes.saturating_add(*size) > limits.max_bytes;
        if full && i > start {
            shards.push(start..i);
            start = i;
            bytes = TarWriter::EMPTY_BYTES;
        }
        bytes = bytes.saturating_add(*size);
    }
    if start < sizes.len() {
        shards.push(start..sizes.len());
    }
    shards
}

/// A shard in the shard list. The fields are named as in the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ShardEntry {
    /// Its file, relative to the list.
    pub url: String,
    /// How many samples it has.
    pub nsamples: usize,
    /// Its size in bytes.
    pub filesize: u64,
}

/// Writes a shard list as a `wids` index (`wids-shard-index-v1`), which gives the number of samples before a
/// shard is opened. Returns the size of the file in bytes.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn write_shard_index(path: &Path, name: &str, shards: &[ShardEntry]) -> Result<u64> {
    #[derive(Serialize)]
    struct Index<'a> {
        __kind__: &'static str,
        wids_version: u32,
        name: &'a str,
        shardlist: &'a [ShardEntry],
    }
    write_json(path, &Index { __kind__: "wids-shard-index-v1", wids_version: 1, name, shardlist: shards })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::layout::Frame;
    use proptest::prelude::*;

    #[test]
    fn keys_end_at_the_first_dot() {
        let image = DatasetImage {
            area: 3,
            uuid: "5c2959c3089c4ac5a7c5c913cc0df78d".into(),
            room: "office_5".into(),
            frame: Frame::Panorama,
            domains: vec![Domain::Rgb],
        };
        let key = sample_key(&image);
        assert_eq!(key, "area_3/camera_5c2959c3089c4ac5a7c5c913cc0df78d_office_5_frame_equirectangular");
        for domain in Domain::ALL {
            let member = sample_member(&key, domain);
            assert_eq!(member.split_once('.').unwrap().0, key);
        }
        assert!(sample_member(&key, Domain::Normal).ends_with("equirectangular.normals.png"));
        assert!(sample_member(&key, Domain::Pose).ends_with(".pose.json"));
    }

    #[test]
    fn limits_are_kept() {
        let limits = ShardLimits { max_bytes: 1024 + 100, max_samples: 3 };
        assert!(plan_shards(&[], limits).is_empty());
        assert_eq!(plan_shards(&[10; 7], limits), [0..3, 3..6, 6..7]);
        assert_eq!(plan_shards(&[60, 40, 1, 500, 60], limits), [0..2, 2..3, 3..4, 4..5]);
        assert_eq!(plan_shards(&[u64::MAX, u64::MAX], limits), [0..1, 1..2]);
    }

    proptest! {
        #[test]
        fn every_sample_is_in_one_shard(sizes in prop::collection::vec(0u64..300, 0..60), max in 1usize..9) {
            let limits = ShardLimits { max_bytes: 1024 + 500, max_samples: max };
            let shards = plan_shards(&sizes, limits);
            let all: Vec<usize> = shards.iter().cloned().flatten().collect();
            prop_assert_eq!(all, (0..sizes.len()).collect::<Vec<_>>());
            for shard in shards {
                prop_assert!(!shard.is_empty() && shard.len() <= max);
                prop_assert!(sizes[shard].iter().sum::<u64>() <= 500);
            }
        }
    }

    #[test]
    fn the_index_names_the_shards() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("shards.json");
        let shard = ShardEntry { url: "a-000000.tar".into(), nsamples: 5, filesize: 2048 };
        write_shard_index(&path, "demo", &[shard]).unwrap();
        let index: serde_json::Value = crate::fs::json::read_json(&path).unwrap();
        assert_eq!(index["__kind__"], "wids-shard-index-v1");
        assert_eq!(index["shardlist"][0]["nsamples"], 5);
    }
}
