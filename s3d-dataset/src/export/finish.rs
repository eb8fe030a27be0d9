//! The end of an export: what is made from all areas together once every unit is done. It needs only the
//! files on the disk, the request and the journals.

use crate::context::Context;
use crate::error::{InputError, Result};
use crate::export::images::photographs::doubts;
use crate::export::views::select_requested;
use crate::profile::{self};
use crate::record::data_set::Listed;
use crate::record::journal::{Finished, LabelsDone};
use crate::record::listing;
use crate::record::manifest::{AreaEntry, Manifest};
use crate::record::request::{Request, RequestedArea};
use crate::record::tables;
use crate::record::unfinished::missing_units;
use crate::statistics::Statistics;
use crate::summary::{ImageTally, UnitTally, Unlabelled, ViewTally};
use s3d_io::Error as FileError;
use s3d_io::dataset::{Domain, FileRecord, Frame, Layout, PhotographRecord};
use s3d_io::fs::{SyncAhead, create_dir, sync_data_set, sync_file, write_json};
use s3d_label::Taxonomy;
use s3d_sample::folds;
use std::fs;
use std::path::PathBuf;

/// A larger share of pixels without a label causes a warning.
pub(crate) const MUCH_UNLABELLED: f64 = 0.02;

/// What an export has made.
pub(crate) struct Totals {
    /// The number of all files, including the manifest.
    pub(crate) files: u64,
    pub(crate) bytes: u64,
    pub(crate) locations: usize,
    /// What became of the candidate views.
    pub(crate) views: ViewTally,
    pub(crate) unlabelled: Option<Unlabelled>,
}

/// Writes the tables and the list of files. When everything is on the disk, writes the manifest that declares
/// the data set complete. The units' files, `assets` and `conventions.json` must be there. `manifest` is the
/// one that was written when the export began. `disk` is the syncing of the units' files to the disk, if it
/// has begun.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if a unit is missing.
pub(crate) fn finish(
    ctx: &Context,
    layout: &Layout,
    request: &Request,
    manifest: Manifest,
    finished: &Finished,
    disk: Option<SyncAhead>,
) -> Result<Totals> {
    let ctx = &ctx.noting();
    if let Some(unit) = missing_units(request, finished).first() {
        let what = format!("{}: {unit} missing", layout.root().display());
        return Err(InputError::Incomplete { what, remedy: "make the same call again".into() }.into());
    }

    let areas = request.numbers();
    let FinishedAreas { entries, locations, views, unlabelled } =
        finish_areas(ctx, layout, request, finished)?;

    let mut files = Vec::new();
    for done in finished.iter().filter(|done| areas.contains(&done.unit().area())) {
        files.extend_from_slice(done.files());
    }

    // A merge makes no folders for images that no shard has.
    create_image_dirs(layout, &areas, &request.options.modalities)?;
    ctx.check()?;

    let folds = folds(&areas);
    tables::write_splits(layout, &folds)?;
    tables::write_lists(ctx, layout, &areas, &folds)?;

    let taxonomy = manifest.read_taxonomy(layout, |_| Ok(()))?;
    write_profiles(ctx, layout, request, &areas, &files, &taxonomy)?;
    let of_labels = Some(&taxonomy).filter(|_| manifest.is_labelled());
    Statistics::count(layout, &areas, of_labels, |_, _| Ok(()))?.write(layout)?;

    ctx.check()?;
    let tables = listing::records(ctx, layout, &table_files(layout, &areas)?)?;
    files.extend_from_slice(&tables);
    let list = listing::write(layout, &files)?;
    let count = list.count;
    let listed = list.bytes;

    // Files reach the disk before a manifest calls them complete.
    let paths: Vec<PathBuf> = files.iter().map(|f| f.path_in(layout.root())).collect();
    disk.map_or(Ok(()), SyncAhead::end)?;
    sync_data_set(layout.root(), &paths)?;
    manifest.complete(layout, entries, list)?;
    sync_file(&layout.manifest())?;

    let own = [layout.file_list(), layout.manifest()].map(|p| fs::metadata(p).map_or(0, |found| found.len()));
    Ok(Totals { files: count + 2, bytes: listed + own.iter().sum::<u64>(), locations, views, unlabelled })
}

/// What is known of all areas once their units are done.
pub(crate) struct FinishedAreas {
    /// The manifest's.
    pub(crate) entries: Vec<AreaEntry>,
    pub(crate) locations: usize,
    pub(crate) views: ViewTally,
    pub(crate) unlabelled: Option<Unlabelled>,
}

/// Writes the tables of each area, and warns of what is odd about its images.
pub(crate) fn finish_areas(
    ctx: &Context,
    layout: &Layout,
    request: &Request,
    finished: &Finished,
) -> Result<FinishedAreas> {
    let (candidates, views) = select_requested(request, finished)?;
    let mut of_all = FinishedAreas { entries: Vec::new(), locations: 0, views, unlabelled: None };
    for requested in &request.areas {
        tables::write_views(layout, requested.area, &candidates)?;
        let Some(labels) = finished.labels(requested.area) else { continue };
        let entry = finish_area(ctx, layout, request, finished, requested, labels)?;
        of_all.locations += labels.locations.len();
        if let Some(of) = entry.unlabelled {
            *of_all.unlabelled.get_or_insert_default() += of;
        }
        of_all.entries.push(entry);
    }
    Ok(of_all)
}

/// Writes the list of an area's photographs, warns of what is odd about its images, and returns its entry in
/// the manifest.
fn finish_area(
    ctx: &Context,
    layout: &Layout,
    request: &Request,
    finished: &Finished,
    requested: &RequestedArea,
    labels: &LabelsDone,
) -> Result<AreaEntry> {
    let area = requested.area;
    let photographs: Vec<&PhotographRecord> = finished.photographs(area).map(|done| &done.record).collect();
    if !labels.photographs.is_empty() {
        write_json(&layout.frames_json(area), &photographs)?;
        ctx.warn_each(doubts(area, &photographs));
    }

    let of_photographs = finished.photographs(area).map(|done| done.tally);
    let of_locations = finished.locations(area).map(|done| done.tally);
    let tally: UnitTally = of_locations.chain(of_photographs).sum();
    let mut pixels = tally.panoramas;
    pixels += tally.views;
    warn_unlabelled(ctx, area, &pixels);

    // Pixels are counted in semantic images.
    let mut unlabelled = labels.entry.unlabelled;
    if let Some(of) = &mut unlabelled
        && request.options.modalities.contains(&Domain::Semantic)
    {
        of.without_label.pixels = Some(pixels.pixels_unlabelled);
        of.without_votes.pixels = Some(pixels.pixels_unlabelled + pixels.pixels_filled);
    }

    Ok(AreaEntry {
        unlabelled,
        warnings: labels.entry.warnings.iter().cloned().chain(ctx.take_notes()).collect(),
        points: finished.assets(area).map_or(0, |assets| assets.points),
        panoramas: tally.panoramas.images,
        views: tally.views.images,
        frames: photographs.len() as u64,
        inputs: requested.inputs.clone(),
        ..(*labels.entry).clone()
    })
}

/// Warns of a large share of pixels that show unlabelled faces.
fn warn_unlabelled(ctx: &Context, area: u32, pixels: &ImageTally) {
    if let Some(share) = pixels.share_unlabelled().filter(|share| *share > MUCH_UNLABELLED) {
        ctx.warn(format_args!(
            "area {area}: {:.0} % of the pixels show faces without a label: no annotated point is next \
             to them (the option `fill` gives them the label of the surface beside them)",
            100.0 * share
        ));
    }
}

/// Makes the folders of all images.
fn create_image_dirs(layout: &Layout, areas: &[u32], modalities: &[Domain]) -> Result<()> {
    for &domain in modalities {
        for &area in areas {
            for frame in [Frame::Panorama, Frame::View(0)] {
                create_dir(&layout.image_dir(area, frame, domain))?;
            }
        }
    }
    Ok(())
}

/// Writes the requested profiles anew: some of their files are hard links to files of the tree, which must
/// not be written to. `files` are the files of the tree, among others.
fn write_profiles(
    ctx: &Context,
    layout: &Layout,
    request: &Request,
    areas: &[u32],
    files: &[FileRecord],
    taxonomy: &Taxonomy,
) -> Result<()> {
    let wanted = &request.options.profiles;
    for profile in wanted {
        let dir = layout.profile_dir(profile.name());
        match fs::remove_dir_all(&dir) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                return Err(FileError::io(&dir, "remove", e).into());
            }
            _ => {}
        }
    }

    if wanted.is_empty() {
        return Ok(());
    }

    let files = Listed::of(layout.root(), files.iter().cloned());
    let source = profile::Source { ctx, layout, files: &files, taxonomy };
    profile::write(&source, layout, areas, wanted)
}

/// The files of a data set that no unit wrote.
fn table_files(layout: &Layout, areas: &[u32]) -> Result<Vec<PathBuf>> {
    let mut files: Vec<PathBuf> = areas.iter().map(|area| layout.views_json(*area)).collect();
    files.extend(
        areas
            .iter()
            .map(|area| layout.frames_json(*area))
            .filter(|path| path.is_file()),
    );

    for entry in layout.entries(&[]) {
        if entry == layout.manifest() || entry == layout.file_list() {
            continue;
        }
        if entry.is_dir() {
            files.extend(listing::walk(&entry)?);
        } else if entry.exists() {
            files.push(entry);
        }
    }

    Ok(files)
}
