//! A data set whose export did not finish: its finished part, and the units of work that it still lacks.

use crate::context::Context;
use crate::error::Result;
use crate::record::data_set::{DataSet, Listed, Unfinished};
use crate::record::journal::{Finished, Unit};
use crate::record::listing;
use crate::record::manifest::{AreaEntry, Manifest};
use crate::record::request::{Request, read_request};
use crate::summary::UnitTally;
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use std::path::PathBuf;

impl DataSet {
    /// Opens a data set like [`DataSet::open`], but also one whose export did not finish. That one has the
    /// files of its finished units, as its journals list them, and no tables over all units.
    pub(crate) fn open_unfinished_in(ctx: &Context, layout: &Layout) -> Result<Self> {
        let Some(mut manifest) = Manifest::read_running(layout)? else { return Self::open_in(layout) };
        let Some(request) = read_request(layout)? else {
            let message = "the export did not finish, and what it was to be is not known";
            return Err(FileError::format(&layout.manifest(), message).into());
        };

        let finished = Finished::read(ctx, layout)?;

        let assets: Vec<PathBuf> = listing::walk(&layout.assets_dir())?;
        let views = request.numbers().into_iter().map(|area| layout.views_json(area));
        let views: Vec<PathBuf> = views.filter(|path| path.is_file()).collect();
        let begun_with = [assets, vec![layout.conventions()], views].concat();
        let begun_with = listing::records(ctx, layout, &begun_with)?;
        let of_units = finished.iter().flat_map(|done| done.files().iter().cloned());
        let mut files = Listed::of(layout.root(), of_units.chain(begun_with));
        for area in request.numbers() {
            files.open_bundles(&layout.bundles_dir(area))?;
        }

        manifest.areas = request
            .numbers()
            .into_iter()
            .filter_map(|area| entry(&finished, area))
            .collect();
        let photographs = request
            .numbers()
            .into_iter()
            .map(|area| {
                let records = finished.photographs(area).map(|done| done.record.clone());
                (area, records.collect())
            })
            .collect();

        let taxonomy = manifest.read_taxonomy(layout, |_| Ok(()))?;
        let unfinished = Unfinished { photographs, missing: sentences(&request, &finished) };
        let unfinished = Some(unfinished);
        Ok(Self { layout: layout.clone(), manifest, files, taxonomy, unfinished })
    }
}

/// Returns the known units that a request still lacks. The units of an area's locations are known once its
/// labels are done.
pub(crate) fn missing_units(request: &Request, finished: &Finished) -> Vec<Unit> {
    let mut missing = Vec::new();
    for area in request.numbers() {
        let Some(labels) = finished.labels(area) else {
            missing.push(Unit::Labels(area));
            continue;
        };
        for uuid in &labels.locations {
            missing.push(Unit::Scores(area, uuid.clone()));
            if is_chosen(request, uuid) {
                missing.push(Unit::Location(area, uuid.clone()));
            }
        }
        let photographs = labels.photographs.iter().filter(|uuid| is_chosen(request, uuid));
        missing.extend(photographs.map(|uuid| Unit::Photograph(area, uuid.clone())));
        missing.push(Unit::Assets(area));
    }

    missing.retain(|unit| !finished.has(unit));
    missing
}

/// Returns whether a location's images were asked for.
pub(crate) fn is_chosen(request: &Request, uuid: &str) -> bool {
    let only = &request.options.only;
    only.is_empty() || only.iter().any(|o| o == uuid)
}

/// Returns the manifest's entry for a labelled area, so far.
fn entry(finished: &Finished, area: u32) -> Option<AreaEntry> {
    let of_photographs = finished.photographs(area).map(|done| done.tally);
    let of_locations = finished.locations(area).map(|done| done.tally);
    let tally: UnitTally = of_locations.chain(of_photographs).sum();
    Some(AreaEntry {
        points: finished.assets(area).map_or(0, |assets| assets.points),
        panoramas: tally.panoramas.images,
        views: tally.views.images,
        frames: finished.photographs(area).count() as u64,
        ..(*finished.labels(area)?.entry).clone()
    })
}

/// Returns what is missing, a sentence each.
fn sentences(request: &Request, finished: &Finished) -> Vec<String> {
    let missing = missing_units(request, finished);
    let mut sentences = Vec::new();
    for area in request.numbers() {
        if count(&missing, area, |unit| matches!(unit, Unit::Labels(_))) > 0 {
            sentences.push(format!("area {area} has neither labels nor images yet"));
            continue;
        }

        for (n, what) in [
            (
                count(&missing, area, |unit| matches!(unit, Unit::Location(..))),
                "scan locations have no images yet",
            ),
            (
                count(&missing, area, |unit| matches!(unit, Unit::Photograph(..))),
                "photographs are no views yet",
            ),
        ] {
            if n > 0 {
                sentences.push(format!("area {area}: {n} {what}"));
            }
        }

        if count(&missing, area, |unit| matches!(unit, Unit::Assets(_))) > 0 {
            sentences.push(format!("area {area} has neither meshes nor points yet"));
        }
    }

    sentences.push("lists of views, statistics and folds are made at the end".to_owned());
    sentences
}

/// Returns the number of an area's units of one kind.
fn count(units: &[Unit], area: u32, is: fn(&Unit) -> bool) -> usize {
    units.iter().filter(|unit| unit.area() == area && is(unit)).count()
}
