//! The survey of an area: its annotations label the faces of its mesh, and its scan locations look around.
//!
//! An export and `info` survey alike. They differ in what they do with each result, which a [`Surveyor`]
//! says.

use crate::context::Context;
use crate::error::{Error, Result};
use crate::export::input::area::AreaInput;
use crate::export::labels::annotate::{AnnotatedInstance, annotate, unannotated};
use crate::export::location::{Located, locate};
use crate::survey::annotated::Annotated;
use crate::survey::outlook::{Outlook, look_around};
use crate::useful::{Finding, label_findings, outlook_findings};
use s3d_geom::NearestFaces;
use s3d_label::{FaceLabels, LabelTable};
use s3d_render::Scene;

/// What a survey takes besides an area and its mesh.
#[derive(Clone, Copy)]
pub(crate) struct SurveyOptions<'a> {
    /// The labels of all areas.
    pub(crate) table: &'a LabelTable,
    /// Faces without a vote are filled from labelled surface within this distance, metres; `None` fills none.
    pub(crate) fill_m: Option<f64>,
    /// Annotated points farther than this from the mesh are left out, metres; `None` leaves none out.
    pub(crate) trim_m: Option<f64>,
    /// The seed of placed locations.
    pub(crate) seed: u64,
}

/// What a survey finds.
pub(crate) struct Survey {
    pub(crate) annotated: Annotated,
    /// The scan locations, with what each sees.
    pub(crate) located: Located,
    pub(crate) outlooks: Vec<Outlook>,
}

/// Whether the scan locations are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Locating {
    Wanted,
    Skipped,
}

/// Takes what a survey finds, as it is found. An error ends the survey.
pub(crate) trait Surveyor: Send {
    /// Takes an annotated instance with its points.
    fn instance(&mut self, _instance: AnnotatedInstance<'_>) -> Result<()> {
        Ok(())
    }

    /// Takes the labels of an annotated area with the votes behind them.
    fn labels(&mut self, _annotated: &Annotated, _votes: &FaceLabels) -> Result<()> {
        Ok(())
    }

    /// Weighs what looks wrong about the labels of an area, and about the number of its scan locations.
    fn label_findings(&mut self, labels: Vec<Finding>, locations: Vec<Finding>) -> Result<Locating>;

    /// Takes the reason why no location could be placed. If this returns no error, the area has none.
    fn unplaced(&mut self, why: Error) -> Result<()> {
        Err(why)
    }

    /// Weighs what looks wrong about what all scan locations see together.
    fn outlook_findings(&mut self, findings: Vec<Finding>) -> Result<()>;
}

/// Labels the faces of an area's mesh, finds its scan locations, and looks around from each. `nearest` are
/// the nearest faces of the scene's mesh; they are dropped as soon as they are not needed.
pub(crate) fn survey(
    ctx: &Context,
    area: &AreaInput,
    scene: &Scene<'_>,
    nearest: NearestFaces<'_>,
    options: SurveyOptions<'_>,
    surveyor: &mut dyn Surveyor,
) -> Result<Survey> {
    let SurveyOptions { table, fill_m, trim_m, seed } = options;

    // What is wrong with the labels is weighed before locations are placed, which may take long.
    let (annotated, locating) = if area.is_labelled {
        let (annotated, votes) =
            annotate(ctx, area, &nearest, table, [fill_m, trim_m], |instance| surveyor.instance(instance))?;
        surveyor.labels(&annotated, &votes)?;
        drop(votes);
        let labels = label_findings(scene.mesh(), &annotated, table);
        let locating = surveyor.label_findings(labels, area.count_findings(&annotated.rooms))?;
        (annotated, locating)
    } else {
        (unannotated(&nearest, table)?, Locating::Wanted)
    };

    let located = match locating {
        Locating::Skipped => Located::default(),
        Locating::Wanted => match locate(ctx, area, scene, &nearest, &annotated, table, seed) {
            Ok(located) => located,
            Err(why) => {
                surveyor.unplaced(why)?;
                Located::default()
            }
        },
    };
    drop(nearest);

    // Photographs need no locations beside them.
    let outlooks = look_around(ctx, scene, &located.locations)?;
    if !outlooks.is_empty() {
        surveyor.outlook_findings(outlook_findings(&outlooks))?;
    }
    Ok(Survey { annotated, located, outlooks })
}
