//! `s3d pack --to webdataset`: tar shards with one sample for each image.

use super::destination::Destination;
use super::options::{ShardPrefix, WebdatasetOptions};
use super::source::Source;
use crate::context::Context;
use crate::error::Result;
use crate::parallel::map_in_order;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use s3d_io::dataset::{DatasetImage, Domain, Frame};
use s3d_io::package::{
    ShardEntry, ShardLimits, TarWriter, plan_shards, sample_key, sample_member, write_shard_index,
};

/// The smallest number of shards in a series without limits, if it has enough samples. Each worker of a
/// loader reads its own shards.
const SHARDS: usize = 8;

/// The folder in each shard for the files that belong to all samples. Readers skip names of this form.
const META: &str = "__s3d__";

/// A shard to write: its file and its samples.
struct Shard<'a> {
    url: String,
    images: Vec<&'a DatasetImage>,
}

/// Writes the shards and their index. Returns notes on how to use them.
pub(super) fn pack(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
    options: &WebdatasetOptions,
) -> Result<Vec<String>> {
    let domains = match &options.modalities {
        Some(asked) => {
            asked.iter().try_for_each(|d| source.require(*d, "the package"))?;
            Domain::ALL.into_iter().filter(|d| asked.contains(d)).collect()
        }
        None => Domain::ALL.to_vec(),
    };

    // Every shard begins with the tables.
    let meta: Vec<(String, Vec<u8>)> = source
        .tables()?
        .into_iter()
        .map(|(name, bytes)| (format!("{META}/{name}"), bytes))
        .collect();
    let meta_bytes: u64 = meta
        .iter()
        .map(|(name, bytes)| TarWriter::entry_bytes(name, bytes.len() as u64))
        .sum();

    let plans = shards(ctx, source, options, &domains, meta_bytes)?;
    let (names, shards): (Vec<String>, Vec<Vec<Shard<'_>>>) = plans.into_iter().unzip();
    let shards: Vec<Shard<'_>> = shards.into_iter().flatten().collect();

    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let entries = map_in_order(
        ctx,
        &shards,
        || (),
        |(), shard| {
            let mut tar = TarWriter::create(&destination.path().join(&shard.url))?;
            meta.iter().try_for_each(|(name, bytes)| tar.append(name, bytes))?;
            for image in &shard.images {
                let key = sample_key(image);
                for domain in present(image, &domains) {
                    tar.append(&sample_member(&key, domain), &source.bytes(image, domain)?)?;
                }
                progress.add(1);
            }
            let filesize = tar.finish()?;
            Ok(ShardEntry { url: shard.url.clone(), nsamples: shard.images.len(), filesize })
        },
    )?;

    write_shard_index(&destination.path().join("shards.json"), "s3d", &entries)?;

    Ok(notes(&names))
}

/// Plans the shards of each series. `meta_bytes` is the size of the tables that each shard begins with.
/// Returns the name of each series, as webdataset takes it, with its shards.
fn shards<'a>(
    ctx: &Context,
    source: &'a Source,
    options: &WebdatasetOptions,
    domains: &[Domain],
    meta_bytes: u64,
) -> Result<Vec<(String, Vec<Shard<'a>>)>> {
    let most = ShardLimits::default();
    let max_bytes = options.max_size.map_or(most.max_bytes, |mb| u64::from(mb) * 1_000_000);

    let mut all = Vec::new();
    for (name, mut images) in series(source, options) {
        if let Some(seed) = options.shuffle {
            shuffle(&mut images, seed);
        }

        let sizes = map_in_order(ctx, &images, || (), |(), image| sample_bytes(source, image, domains))?;
        let max_samples = match (options.max_count, options.max_size) {
            (Some(count), _) => count as usize,
            (None, Some(_)) => most.max_samples,
            (None, None) => (images.len() / SHARDS).clamp(1, most.max_samples),
        };
        let limits = ShardLimits { max_bytes: max_bytes.saturating_sub(meta_bytes), max_samples };

        let plan = plan_shards(&sizes, limits);
        let urls = match plan.len() {
            1 => format!("{name}-000000.tar"),
            n => format!("{name}-{{000000..{:06}}}.tar", n - 1),
        };
        let shards = plan
            .into_iter()
            .enumerate()
            .map(|(i, range)| Shard { url: format!("{name}-{i:06}.tar"), images: images[range].to_vec() });
        all.push((urls, shards.collect()));
    }
    Ok(all)
}

/// Returns notes on how to use the shards of these names.
fn notes(names: &[String]) -> Vec<String> {
    let mut notes: Vec<String> = names
        .iter()
        .map(|n| format!("webdataset.WebDataset(\"{n}\")"))
        .collect();
    notes.push(
        "a sample's key is area_N/camera_UUID_ROOM_frame_J, its fields are rgb.png, depth.png, normals.png, \
         … pose.json; the number of samples of each shard is in shards.json"
            .into(),
    );
    notes.push(format!(
        "{META} in each shard holds what its numbers mean: conventions, the label table if there are labels, \
         and the taxonomy if it is not S3DIS's"
    ));
    notes.push(
        "decode(\"pil\") makes 8-bit RGB of every image: give depth.png (16 bits) and global_xyz.exr \
         decoders of their own, before it, with webdataset.autodecode.handle_extension"
            .into(),
    );
    notes
}

/// The series of shards: the views and the panoramas of each area, or one series of all images if the user
/// named a prefix.
fn series<'a>(source: &'a Source, options: &WebdatasetOptions) -> Vec<(String, Vec<&'a DatasetImage>)> {
    if let Some(prefix) = options.prefix.as_ref().map(ShardPrefix::as_str) {
        return vec![(prefix.to_owned(), source.images.iter().collect())];
    }
    let mut series = Vec::new();
    for area in &source.areas {
        let (panoramas, views): (Vec<_>, Vec<_>) = source
            .of_area(*area)
            .into_iter()
            .partition(|image| image.frame == Frame::Panorama);
        series.push((format!("area_{area}_views"), views));
        series.push((format!("area_{area}_panoramas"), panoramas));
    }
    series.retain(|(_, images)| !images.is_empty());
    series
}

/// Puts images in a random order, decided by `seed`.
fn shuffle(images: &mut [&DatasetImage], seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut drawn: Vec<(u64, &DatasetImage)> = images.iter().map(|i| (random.next_u64(), *i)).collect();
    drawn.sort_by_key(|(number, _)| *number);
    images
        .iter_mut()
        .zip(drawn)
        .for_each(|(place, (_, image))| *place = image);
}

/// The domains of an image's sample.
fn present(image: &DatasetImage, domains: &[Domain]) -> impl Iterator<Item = Domain> {
    domains.iter().copied().filter(|d| image.has(*d))
}

/// The number of bytes that a sample takes in a shard.
fn sample_bytes(source: &Source, image: &DatasetImage, domains: &[Domain]) -> Result<u64> {
    let key = sample_key(image);
    let mut bytes = 0;
    for domain in present(image, domains) {
        let size = source.byte_count(image, domain)?;
        bytes += TarWriter::entry_bytes(&sample_member(&key, domain), size);
    }
    Ok(bytes)
}
