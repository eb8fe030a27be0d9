//! Which candidate views of an area are still to be scored, and their scores.

use crate::error::{InputError, Result};
use crate::export::common::{Common, PreparedMesh};
use crate::export::views::{Kinds, Scoring, score_area};
use crate::record::journal::{Done, ScoresDone, Unit};
use crate::stage::Stage;
use crate::survey::labelled_area::LabelledArea;
use s3d_io::camera::ScanLocation;

/// The locations of an area whose candidates are ours to score and are not scored yet.
fn unscored<'p>(plan: &'p LabelledArea, common: &Common<'_>) -> Vec<&'p ScanLocation> {
    let mut todo: Vec<(Unit, &ScanLocation)> = plan
        .locations
        .iter()
        .map(|location| (Unit::Scores(plan.area, location.uuid.clone()), location))
        .collect();

    let finished = common.journal.finished();
    todo.retain(|(unit, _)| !finished.has(unit));
    drop(finished);

    // `is_ours` may lock the journal, so it is called after the lock is released.
    todo.retain(|(unit, _)| (common.is_ours)(unit));
    todo.into_iter().map(|(_, location)| location).collect()
}

/// Whether any location of an area is still to be scored.
pub(crate) fn is_unscored(plan: &LabelledArea, common: &Common<'_>) -> bool {
    !unscored(plan, common).is_empty()
}

/// Scores the candidates of the locations of an area that are ours and not scored yet.
pub(crate) fn score(plan: &LabelledArea, prepared: &PreparedMesh<'_>, common: Common<'_>) -> Result<()> {
    let ctx = common.account.ctx;
    let Common { table, options, journal, account, .. } = common;
    let number = plan.area;
    check_faces(plan, prepared)?;

    let missing = unscored(plan, &common);
    if missing.is_empty() {
        return Ok(());
    }

    let step = account.stage(Stage::Score, Some(number));
    let scoring = Scoring {
        area: number,
        views: options.views,
        size: options.size,
        stride: options.entropy_stride,
        seed: options.seed,
    };
    let kinds = Kinds::of(table, &plan.annotated.label_of_face, &prepared.file.mesh);
    score_area(ctx, &missing, &prepared.scene, &kinds, scoring, |uuid, entropies| {
        journal.write(Done::Scores(ScoresDone { area: number, location: uuid.to_owned(), entropies }))
    })?;

    step.end();
    ctx.debug(format_args!("area {number}: {} of {} locations scored", missing.len(), plan.locations.len()));
    Ok(())
}

/// Refuses labels of another mesh.
pub(crate) fn check_faces(plan: &LabelledArea, prepared: &PreparedMesh<'_>) -> Result<()> {
    let labels = plan.annotated.label_of_face.len();
    let faces = prepared.file.mesh.faces().len();
    if labels == faces {
        return Ok(());
    }
    let why = format!("{labels} faces are labelled, and the mesh has {faces}");
    Err(InputError::UnfitArea { area: plan.area, why }.into())
}
