//! Adds label images whose borders follow the picture to a data set that exists: what an export writes if
//! `semantic_refined` and `semantic_moved` are among its modalities, byte for byte.

mod image;

use crate::context::Context;
use crate::error::{Result, UsageError};
use crate::parallel::for_each_in_order;
use crate::record::data_set::DataSet;
use crate::record::listing;
use crate::record::manifest::Manifest;
use crate::store::change::Change;
use crate::store::lock::Lock;
use image::{AreaSurface, Memory, RefinedFiles};
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, FileRecord, Frame, Layout};
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::Compression;
use s3d_render::Scene;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// What is added to each image.
const ADDED: [Domain; 2] = [Domain::SemanticRefined, Domain::SemanticMoved];

/// What must be there of each image.
const NEEDED: [Domain; 3] = [Domain::Rgb, Domain::Semantic, Domain::Pose];

/// How labels of a data set are refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct RefineOptions {
    /// Replace existing images.
    #[cfg_attr(feature = "clap", arg(long))]
    pub overwrite: bool,
    /// Compression of the image files: fast, balanced or small.
    #[cfg_attr(feature = "clap", arg(long, default_value_t, value_name = "fast|balanced|small",
        value_parser = crate::options::words::parsed::<Compression>))]
    pub compression: Compression,
}

/// Writes `semantic_refined` and `semantic_moved` of all images of the data set in the folder `root`: views,
/// panoramas and photographs. Returns the number of images.
///
/// The labels are those of the data set's mesh, and the colours those of the `rgb` files. The method is
/// [`s3d_label::refine`].
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if such images exist and are not to be replaced.
/// [`Error::File`](crate::Error::File) if there is no data set, it has no `rgb`, `semantic` or `pose`, or a
/// file is damaged. [`Error::Cancelled`](crate::Error::Cancelled) or
/// [`Error::Temporary`](crate::Error::Temporary). After an error the data set is as it was before. After a
/// kill it is too, or the same call completes the change.
pub fn refine(root: impl Into<PathBuf>, options: &RefineOptions, ctx: &Context) -> Result<usize> {
    let layout = &Layout::new(root.into());
    Manifest::require(layout)?;
    let call = format!("refine, {}", options.compression);
    // The lock keeps others from replacing the data set.
    Lock::during(ctx, layout, |completed| {
        let data = DataSet::open_in(layout)?;
        if completed.as_ref() == Some(&call) {
            ctx.info(format_args!(
                "{}: what a killed process had begun is complete",
                layout.root().display()
            ));
            return Ok(data.areas().iter().map(|area| data.images(*area).len()).sum());
        }
        make(ctx, &data, options, &call)
    })
}

fn make(ctx: &Context, data: &DataSet, options: &RefineOptions, call: &str) -> Result<usize> {
    let layout = &data.layout;
    let areas: Vec<(u32, Vec<DatasetImage>)> =
        data.areas().iter().map(|area| (*area, data.images(*area))).collect();
    let images = || areas.iter().flat_map(|(_, images)| images);
    require(ctx, data, images(), options)?;

    let folders = |layout: &Layout| -> Vec<PathBuf> {
        let kinds = [Frame::Panorama, Frame::View(0)];
        let pairs = kinds.into_iter().flat_map(|kind| ADDED.map(|domain| (kind, domain)));
        let of_area = |area: u32| {
            pairs
                .clone()
                .map(move |(kind, domain)| layout.image_dir(area, kind, domain))
        };
        data.areas().iter().flat_map(|area| of_area(*area)).collect()
    };
    let change = Change::begin(layout, &folders(layout))?;
    let staged = change.staged();
    folders(staged).iter().try_for_each(|folder| create_dir(folder))?;

    let count = images().count();
    let progress = ctx.progress("refining labels", "images", count as u64);
    let changed = Mutex::new(Vec::with_capacity(2 * count));
    for (area, images) in &areas {
        let surface = AreaSurface::read(data, *area)?;
        let scene = Scene::new(surface.mesh());
        for_each_in_order(
            ctx,
            images,
            || Memory::new(&scene),
            |memory, image| {
                let RefinedFiles { index, moved } =
                    surface.refined(data, image, options.compression, memory)?;
                for (domain, file) in [(Domain::SemanticRefined, index), (Domain::SemanticMoved, moved)] {
                    let record = FileRecord::of_bytes(layout.root(), &image.path(layout, domain), &file)?;
                    write_bytes(&record.path_in(staged.root()), &file)?;
                    changed.lock().unwrap_or_else(PoisonError::into_inner).push(record);
                }
                progress.add(1);
                Ok(())
            },
        )?;
    }
    drop(progress);

    let changed = changed.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut manifest = Manifest::read(layout)?;
    manifest.add_modalities(&ADDED);
    listing::write_changed(data, &mut manifest, changed, |_| false, staged)?;
    change.commit(call, &[])?;

    ctx.info(format_args!("{}: refined labels of {count} images", layout.root().display()));
    Ok(count)
}

/// Refuses a data set that lacks what the images are made from, or that has them already.
fn require<'i>(
    ctx: &Context,
    data: &DataSet,
    mut images: impl Iterator<Item = &'i DatasetImage> + Clone,
    options: &RefineOptions,
) -> Result<()> {
    let layout = &data.layout;
    let there = data.manifest.domains();
    if let Some(lacking) = NEEDED.into_iter().find(|domain| !there.contains(domain)) {
        let message =
            format!("its images have no {lacking}, which refined labels are made from: export it too");
        return Err(FileError::format(&layout.manifest(), message).into());
    }
    let Some(first) = images.clone().next() else {
        return Err(FileError::format(layout.root(), "no image: there are no labels to refine").into());
    };
    if there.iter().any(|domain| ADDED.contains(domain)) && !options.overwrite {
        return Err(UsageError::Exists { path: first.path(layout, ADDED[0]), note: None }.into());
    }

    // An image without one of its files would stop the work late.
    for domain in NEEDED {
        if let Some(image) = images.clone().find(|image| !image.has(domain)) {
            return Err(FileError::format(&image.path(layout, domain), "files.csv does not name it").into());
        }
    }
    let needed: Vec<PathBuf> = images
        .by_ref()
        .flat_map(|image| NEEDED.map(|domain| image.path(layout, domain)))
        .collect();
    let needed: std::collections::BTreeSet<&Path> = needed.iter().map(PathBuf::as_path).collect();
    data.files.require(ctx, |path| needed.contains(path))
}
