//! Making a plan: areas are labelled, and the candidate views of their locations scored.

use crate::account::Account;
use crate::context::Context;
use crate::error::{Result, UsageError};
use crate::export::input::memory::SceneSource;
use crate::export::job::Job;
use crate::export::plan::{PlanFile, read_plan_file, refuse_other};
use crate::export::shard::assignment::Shard;
use crate::options::ExportOptions;
use crate::record::checked::write_checked;
use crate::record::journal::{Finished, Journal, Unit};
use crate::record::label_list::LabelList;
use crate::record::listing::remove_parts;
use crate::store::plan_file;
use crate::store::state::{OutputState, is_working_name};
use s3d_io::Error as FileError;
use s3d_io::dataset::{Domain, Layout};
use s3d_io::fs::create_dir;
use std::fs;
use std::path::Path;

/// Makes a plan of scenes in a folder, or a shard's part of one. Anything that is there already is not made
/// again.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if the folder holds something else, or a plan of another call.
pub fn plan<S: Clone + Into<SceneSource>>(
    scenes: &[S],
    folder: &Path,
    options: &ExportOptions,
    shard: Option<Shard>,
    ctx: &Context,
) -> Result<()> {
    let shard = shard.unwrap_or(Shard::ALL);
    let options = &ExportOptions {
        views: options.views,
        size: options.size,
        seed: options.seed,
        place_cameras: options.place_cameras,
        see: options.see,
        entropy_stride: options.entropy_stride,
        lenient: options.lenient,
        fill: options.fill,
        trim_strays: options.trim_strays,
        modalities: vec![Domain::Pose],
        // A plan needs no panoramas and no points.
        pano_width: 8,
        points_per_m2: f64::MIN_POSITIVE,
        ..ExportOptions::default()
    };
    let options = &options.canonical()?;

    let account = Account::new(ctx);
    let layout = Layout::new(folder);
    refuse_foreign(folder)?;

    let scenes: Vec<SceneSource> = scenes.iter().cloned().map(Into::into).collect();
    let state = OutputState::read(&layout)?;
    let job = Job::open(&scenes, &layout, &state, options, None, &account)?;
    state.refuse_links(&layout, &job.request)?;

    let path = plan_file(folder);
    if path.exists() {
        let there = read_plan_file(&path)?;
        refuse_other(folder, &there.request, &job.request)?;
    } else {
        create_dir(folder)?;
        let labels = LabelList::of(&job.inputs.table);
        write_checked(&path, &PlanFile { request: job.request.of_plan(), labels })?;
    }

    // Half-written files of a killed process. Those of shards stay: others may be writing them.
    if shard == Shard::ALL {
        remove_parts(folder, true)?;
    }
    let journal = Journal::begin(&layout, Finished::default())?;
    let areas = &job.inputs.areas;
    for (position, area) in areas.iter().enumerate() {
        ctx.check()?;
        let Some(part) = shard.within(position, areas.len()) else { continue };

        let number = area.number;

        // Work that others have done meanwhile counts too.
        let there = Finished::read(ctx, &layout)?
            .checked_where(ctx, &layout, |unit| *unit == Unit::Labels(number))?;
        there.iter().for_each(|done| journal.know(done.clone()));

        let is_ours = |unit: &Unit| match unit {
            Unit::Scores(_, uuid) => {
                position_of(&journal, number, uuid).is_some_and(|position| part.takes(position))
            }
            Unit::Labels(_) => true,
            Unit::Location(..) | Unit::Photograph(..) | Unit::Assets(_) => false,
        };

        job.plan_area(area, &layout, &journal, &account, &is_ours)?;
    }

    let done = match shard {
        Shard::ALL => "complete".to_owned(),
        shard => format!("shard {shard} is done"),
    };
    ctx.info(format_args!("{}: the plan's {done}", folder.display()));
    Ok(())
}

/// Refuses a folder that is not empty and holds no plan.
fn refuse_foreign(folder: &Path) -> Result<()> {
    let entries = match fs::read_dir(folder) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        entries => entries.map_err(|e| FileError::io(folder, "use as the folder of a plan", e))?,
    };
    if plan_file(folder).exists() {
        return Ok(());
    }
    for entry in entries {
        let name = entry.map_err(|e| FileError::io(folder, "read", e))?.file_name();
        // Another shard may be about to begin.
        if !is_working_name(&name) && !plan_file(folder).exists() {
            let entry = name.display().to_string();
            return Err(UsageError::HoldsNoPlan { folder: folder.to_owned(), entry }.into());
        }
    }
    Ok(())
}

/// The position of a location in its area, if the area's labels are done.
fn position_of(journal: &Journal, area: u32, uuid: &str) -> Option<usize> {
    let finished = journal.finished();
    finished.labels(area)?.locations.iter().position(|other| other == uuid)
}
