//! Finds the images of a data set that see the same surface.

use crate::context::Context;
use crate::error::{Result, UsageError};
use crate::parallel::map_in_order;
use crate::record::data_set::DataSet;
use crate::record::listing;
use crate::record::manifest::Manifest;
use crate::store::change::Change;
use crate::store::lock::Lock;
use s3d_geom::Camera;
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, FileRecord, Frame, Layout, PairColumns, write_pairs};
use s3d_io::fs::create_dir;
use s3d_render::{PairFinder, PairOptions, Scene, ViewPair};
use std::path::PathBuf;

/// How pairs of a data set are found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct PairsOptions {
    /// Leave out a pair unless one of its images sees at least this share of the other's points.
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE", default_value_t = 0.05))]
    pub min_overlap: f64,
    /// Ask for about as many pixels of an image, on a grid.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = 400))]
    pub samples: u32,
    /// Replace existing pairs.
    #[cfg_attr(feature = "clap", arg(long))]
    pub overwrite: bool,
}

impl Default for PairsOptions {
    fn default() -> Self {
        let PairOptions { samples, min_overlap } = PairOptions::default();
        Self { min_overlap, samples, overwrite: false }
    }
}

/// Writes `area_N/pairs.npz` for each area of the data set in the folder `root`: the views, panoramas and
/// photographs that see the same surface. Returns the number of pairs, each counted once.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) for options out of range, or if pairs exist and are not to be
/// replaced. [`Error::File`](crate::Error::File) if there is no data set, no image has a pose, or a mesh or a
/// pose is damaged. [`Error::Cancelled`](crate::Error::Cancelled) or
/// [`Error::Temporary`](crate::Error::Temporary). After an error the data set is as it was before. After a
/// kill it is too, or the same call completes the change.
pub fn pairs(root: impl Into<PathBuf>, options: &PairsOptions, ctx: &Context) -> Result<u64> {
    for (option, fits, range) in [
        ("min_overlap", (0.0..=1.0).contains(&options.min_overlap), "from 0 to 1"),
        ("samples", (16..=1 << 20).contains(&options.samples), "from 16 to 1048576"),
    ] {
        if !fits {
            return Err(UsageError::OutOfRange { option, range: range.to_owned() }.into());
        }
    }

    find(&Layout::new(root.into()), options, false, ctx)
}

/// Does what [`pairs`](fn@pairs) does by default, unless the data set has pairs.
///
/// # Errors
/// As [`pairs`](fn@pairs).
pub fn missing_pairs(root: impl Into<PathBuf>, ctx: &Context) -> Result<u64> {
    find(&Layout::new(root.into()), &PairsOptions::default(), true, ctx)
}

/// `keeps`: pairs that are there are kept.
fn find(layout: &Layout, options: &PairsOptions, keeps: bool, ctx: &Context) -> Result<u64> {
    Manifest::require(layout)?;
    let call = format!("pairs {} {}", options.min_overlap, options.samples);
    // The lock keeps others from replacing the data set.
    Lock::during(ctx, layout, |completed| {
        let data = DataSet::open_in(layout)?;
        let areas = data.manifest.area_numbers.iter();
        let are_there = areas.clone().all(|area| layout.pairs_npz(*area).exists());
        if completed.as_ref() == Some(&call) {
            ctx.info(format_args!(
                "{}: what a killed process had begun is complete",
                layout.root().display()
            ));
        } else if !(keeps && are_there) {
            make(ctx, &data, options, &call)?;
        }
        areas
            .map(|area| Ok(s3d_io::dataset::read_pairs(&layout.pairs_npz(*area))?.other.len() as u64 / 2))
            .sum()
    })
}

fn make(ctx: &Context, data: &DataSet, options: &PairsOptions, call: &str) -> Result<()> {
    let layout = &data.layout;
    let paths: Vec<PathBuf> = data
        .manifest
        .area_numbers
        .iter()
        .map(|area| layout.pairs_npz(*area))
        .collect();
    if let Some(path) = paths.iter().find(|path| path.exists() && !options.overwrite) {
        return Err(UsageError::Exists { path: path.clone(), note: None }.into());
    }

    let areas = data.manifest.area_numbers.iter();
    let folders: Vec<PathBuf> = areas.map(|area| layout.area_dir(*area)).collect();
    let change = Change::begin(layout, &folders)?;
    let staged = change.staged();
    let mut changed = Vec::new();
    for area in &data.manifest.area_numbers {
        let found = of_images(ctx, data, *area, &data.images(*area), options)?;
        let path = staged.pairs_npz(*area);
        create_dir(&staged.area_dir(*area))?;
        write_pairs(&path, &found)?;
        changed.push(FileRecord::of_file(staged.root(), &path)?);
        ctx.info(format_args!(
            "area {area}: {} pairs of {} images",
            found.other.len() / 2,
            found.images.len()
        ));
    }

    let mut manifest = Manifest::read(layout)?;
    listing::write_changed(data, &mut manifest, changed, |_| false, staged)?;
    change.commit(call, &[])
}

/// Finds the pairs of images of an area.
pub(crate) fn of_images(
    ctx: &Context,
    data: &DataSet,
    area: u32,
    images: &[DatasetImage],
    options: &PairsOptions,
) -> Result<PairColumns> {
    let cameras = images.iter().map(|image| {
        ctx.check()?;
        camera_of(data, image)
    });
    let cameras: Vec<Camera> = cameras.collect::<Result<_>>()?;
    let Some(file) = data.mesh(area)? else {
        return Err(
            FileError::format(&data.layout.rgb_obj(area), "there is no mesh: finish the export").into()
        );
    };

    let scene = Scene::new(&file.mesh);
    let progress = ctx.progress("pairing", "images", images.len() as u64);
    let options = PairOptions { samples: options.samples, min_overlap: options.min_overlap };
    let finder = PairFinder::new(&scene, &cameras, &options);
    let all: Vec<usize> = (0..images.len()).collect();
    let seen = map_in_order(
        ctx,
        &all,
        || (),
        |(), image| {
            let seen = finder.seen_by_others(*image);
            progress.add(1);
            Ok(seen)
        },
    )?;
    Ok(columns(images, &finder.pairs(seen)))
}

/// Returns the camera of an image.
fn camera_of(data: &DataSet, image: &DatasetImage) -> Result<Camera> {
    if !image.has(Domain::Pose) {
        let message = "this image has no pose: export poses, too";
        return Err(FileError::format(&image.path(&data.layout, Domain::Pose), message).into());
    }
    let options = &data.manifest.options;
    let size = match (data.size_of(image)?, image.frame) {
        (Some((width, height)), _) => [width, height],
        (None, Frame::View(_)) => [options.size; 2],
        (None, Frame::Panorama) => [options.pano_width, options.pano_width / 2],
    };
    data.camera(image, &data.pose(image)?, size)
}

/// Returns pairs as they are written.
fn columns(images: &[DatasetImage], rows: &[Vec<ViewPair>]) -> PairColumns {
    let mut columns = PairColumns { start: vec![0], ..PairColumns::default() };
    for (image, row) in images.iter().zip(rows) {
        columns.images.push(image.pair_name());
        for pair in row {
            columns.other.push(pair.other);
            columns.overlap.push(pair.overlap);
            columns.angle_deg.push(pair.angle_deg);
            columns.scale.push(pair.scale);
            columns.distance_m.push(pair.distance_m);
            columns.turn_deg.push(pair.turn_deg);
        }
        columns.start.push(columns.other.len() as u64);
    }
    columns
}
