//! `s3d pack --to huggingface`: Parquet files with the images inside, a card, and Croissant's description.

use super::destination::Destination;
use super::options::HuggingfaceOptions;
use super::parquet::Rows;
use super::source::Source;
use crate::context::{Context, Progress};
use crate::error::{Result, UsageError};
use crate::parallel::map_in_order;
use s3d_io::dataset::{DatasetImage, Domain, Frame};
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::package::{
    HuggingfaceConfig, HuggingfaceSet, ImageRecord, ImageTable, ShardLimits, plan_shards, write_croissant,
    write_huggingface_card,
};
use std::path::Path;

/// The largest file: the Hub's own conversions split at 500 MB.
const FILE: ShardLimits = ShardLimits { max_bytes: 500_000_000, max_samples: 10_000 };

/// The largest row group, which is in memory at once here and at readers: `datasets` writes images in groups
/// of 100 rows.
const GROUP: ShardLimits = ShardLimits { max_bytes: 64_000_000, max_samples: 100 };

/// Writes the folder. Returns notes on how to use it.
pub(super) fn pack(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
    options: &HuggingfaceOptions,
) -> Result<Vec<String>> {
    let tables = source.tables()?;
    let mut set = HuggingfaceSet {
        name: name(&source.areas),
        classes: source.data.taxonomy.classes(),
        domains: domains(source, options)?,
        with_photographs: source.images.iter().any(|image| source.photograph(image).is_some()),
        depth_units_per_m: source.depth_units_per_m,
        configs: Vec::new(),
        tables: tables.iter().map(|(name, _)| *name).collect(),
    };

    let rows = Rows::new(source)?;
    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    for config in ["views", "panoramas"] {
        let folder = destination.path().join("data").join(config);
        let mut splits = Vec::new();
        for &area in &source.areas {
            let mut images = source.of_area(area);
            images.retain(|image| (image.frame == Frame::Panorama) == (config == "panoramas"));
            if images.is_empty() {
                continue;
            }
            create_dir(&folder)?;
            let split = format!("area_{area}");
            Files { ctx, source, set: &set, rows: &rows, progress: &progress }
                .write(&folder, &split, &images)?;
            splits.push((split, images.len()));
        }
        if !splits.is_empty() {
            set.configs.push(HuggingfaceConfig { name: config, splits });
        }
    }

    for (name, bytes) in &tables {
        write_bytes(&destination.path().join(name), bytes)?;
    }
    write_huggingface_card(&destination.path().join("README.md"), &set)?;
    write_croissant(&destination.path().join("croissant.json"), &set)?;
    Ok(notes(&set))
}

/// The name of a data set, in its card.
fn name(areas: &[u32]) -> String {
    let areas: Vec<String> = areas.iter().map(u32::to_string).collect();
    format!("Registered images of area {}", areas.join(", "))
}

/// Returns the modalities that become columns.
fn domains(source: &Source, options: &HuggingfaceOptions) -> Result<Vec<Domain>> {
    let Some(asked) = &options.modalities else {
        let is_there = |domain| source.images.iter().any(|image| image.has(domain));
        let held = Domain::ALL
            .into_iter()
            .filter(|domain| HuggingfaceSet::can_hold(*domain));
        return Ok(held.filter(|domain| is_there(*domain)).collect());
    };

    for domain in asked {
        if !HuggingfaceSet::can_hold(*domain) {
            let why = match domain {
                Domain::Pose => "poses are the columns k, rt, x, y and z, which are always there",
                _ => "`datasets` decodes no OpenEXR: depth, k and rt give the same points",
            };
            return Err(UsageError::InvalidValue {
                option: "modalities",
                value: domain.to_string(),
                why: why.to_owned(),
            }
            .into());
        }
        source.require(*domain, "the package")?;
    }
    Ok(Domain::ALL
        .into_iter()
        .filter(|domain| asked.contains(domain))
        .collect())
}

/// What the files of a split are made of.
struct Files<'a> {
    ctx: &'a Context,
    source: &'a Source,
    set: &'a HuggingfaceSet<'a>,
    rows: &'a Rows<'a>,
    progress: &'a Progress<'a>,
}

impl Files<'_> {
    /// Writes the files of a split to a folder.
    fn write(&self, folder: &Path, split: &str, images: &[&DatasetImage]) -> Result<()> {
        let sizes = map_in_order(self.ctx, images, || (), |(), image| self.bytes_of(image))?;
        let files = plan_shards(&sizes, FILE);
        for (i, range) in files.iter().enumerate() {
            let path = folder.join(format!("{split}-{i:05}-of-{:05}.parquet", files.len()));
            let mut table = ImageTable::create(&path, self.set)?;
            let (images, sizes) = (&images[range.clone()], &sizes[range.clone()]);
            for group in plan_shards(sizes, GROUP) {
                table.push(&self.records(&images[group])?)?;
            }
            table.finish()?;
        }
        Ok(())
    }

    /// Reads some images.
    fn records(&self, images: &[&DatasetImage]) -> Result<Vec<ImageRecord>> {
        map_in_order(
            self.ctx,
            images,
            || self.rows.no_counts(),
            |counts, image| {
                let files = self.set.domains.iter().map(|domain| {
                    let is_there = image.has(*domain);
                    is_there.then(|| self.source.bytes(image, *domain)).transpose()
                });
                let files = files.collect::<Result<_>>()?;
                let row = self.rows.row(image, counts)?;
                self.progress.add(1);
                Ok(ImageRecord { row, files })
            },
        )
    }

    /// Returns the number of bytes of the files of an image.
    fn bytes_of(&self, image: &DatasetImage) -> Result<u64> {
        let there = self.set.domains.iter().filter(|domain| image.has(**domain));
        there.map(|domain| self.source.byte_count(image, *domain)).sum()
    }
}

/// Returns notes on how to use the folder.
fn notes(set: &HuggingfaceSet<'_>) -> Vec<String> {
    let mut notes = Vec::new();
    for HuggingfaceConfig { name, splits } in &set.configs {
        let splits: Vec<&str> = splits.iter().map(|(split, _)| split.as_str()).collect();
        notes.push(format!("datasets.load_dataset(FOLDER, {name:?}) has the splits {}", splits.join(", ")));
    }
    notes.push(format!(
        "depth / {} are metres; 65535 is missing; README.md says what the other columns mean",
        set.depth_units_per_m
    ));
    notes
}
