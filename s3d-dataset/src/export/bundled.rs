//! An export that ends in a package: its images go into bundles, and are packed from there.

use crate::context::Context;
use crate::error::Result;
use crate::export::finish::finish_areas;
use crate::export::input::memory::SceneSource;
use crate::export::job::Job;
use crate::export::plan::Plan;
use crate::export::run::{Run, Target};
use crate::options::ExportOptions;
use crate::record::data_set::DataSet;
use crate::store::lock::Sharing;
use crate::summary::Summary;
use s3d_io::Error as FileError;
use std::path::Path;

/// A package that is made from what is exported.
pub(crate) struct PackageJob<'a, P> {
    /// Whether it needs the mesh besides images.
    pub(crate) with_meshes: bool,
    /// Where it will lie.
    pub(crate) place: &'a Path,
    /// Packs the data set.
    pub(crate) pack: P,
}

/// Makes the images of scenes in the folder of `target`, each location's in one file, and packs them. What
/// `pack` returns is called at the end: it moves the package to its place, and returns the number of its
/// files and their bytes.
///
/// `target` is a folder for this work alone: an equal call goes on there, and any other call begins anew.
pub(crate) fn export_bundled<F: FnOnce() -> Result<(u64, u64)>>(
    scenes: &[SceneSource],
    target: &Target<'_>,
    options: &ExportOptions,
    plan: Option<&Plan>,
    package: PackageJob<'_, impl FnOnce(DataSet) -> Result<F>>,
    ctx: &Context,
) -> Result<Summary> {
    let PackageJob { with_meshes, place, pack } = package;
    let run = Run::new(ctx, target);
    let layout = run.layout();
    let state = run.look()?;
    let job = Job::open(scenes, layout, &state, options, plan, &run.account)?;
    let job = job.bundled(with_meshes);
    if !state.is_begun() {
        // The bundles and the package are on the disk at the same time.
        job.judge_space(ctx, layout, 2.0)?;
    }

    let manifest = job.manifest();
    let begun = run.begin(&state, &job.request, &manifest, Sharing::Alone)?;
    let Some(session) = begun else {
        let message = "holds a complete data set: remove the folder";
        return Err(FileError::format(layout.root(), message).into());
    };

    let made = job.run(layout, &session.journal, &run.account).and_then(|()| {
        let areas = finish_areas(ctx, layout, &job.request, &session.journal.finished())?;
        Ok((areas, pack(DataSet::open_unfinished_in(ctx, layout)?)?))
    });
    let (areas, finish) = session.end(ctx, made)?;
    let (files, bytes) = finish()?;

    run.account.set_files(files, bytes);
    let place = place.display().to_string();
    let count = job.request.areas.len();
    Ok(run
        .account
        .summarize(&place, count, areas.locations, areas.views, areas.unlabelled))
}
