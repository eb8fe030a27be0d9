//! Scores the entropies of candidate views again.

use super::images::Reference;
use super::report::Topic;
use super::views::Views;
use crate::context::Context;
use crate::error::Result;
use crate::export::views::{Kinds, Scoring, score_area};
use s3d_geom::Camera;
use s3d_io::camera::ScanLocation;
use s3d_io::dataset::DatasetImage;
use s3d_label::LabelId;

const ENTROPIES: (Topic, &str) = (Topic::Views, "entropies");

/// Scores the candidates of each location with an exact panorama pose, and compares the scores with
/// `views.json`.
pub(crate) fn check(
    ctx: &Context,
    reference: &Reference<'_>,
    area: u32,
    images: &[DatasetImage],
    cameras: &[(usize, Camera)],
    views: &Views,
) -> Result<()> {
    let labels = reference.labels;
    let Ok(table) = labels.taxonomy.table_from_names(&labels.names) else { return Ok(()) };
    if reference.mesh.label_of_face.iter().any(|l| *l as usize >= table.len()) {
        return Ok(());
    }

    let located: Vec<ScanLocation> = cameras
        .iter()
        .filter(|(_, camera)| camera.is_panorama())
        .map(|(i, camera)| ScanLocation { uuid: images[*i].uuid.clone(), pose: camera.pose, line: 0 })
        .collect();

    // Every location of a data set has the same number of candidates.
    let Some(candidates) = views.candidates_of_a_location(area) else { return Ok(()) };

    let options = &reference.manifest.options;
    let scoring = Scoring {
        area,
        views: candidates,
        size: options.size,
        stride: options.entropy_stride,
        seed: reference.manifest.seed,
    };

    let labels: Vec<LabelId> = reference.mesh.label_of_face.iter().map(|l| LabelId(*l)).collect();
    let kinds = Kinds::of(&table, &labels, &reference.mesh.file.mesh);
    let path = reference.layout.views_json(area);
    let locations: Vec<&ScanLocation> = located.iter().collect();

    score_area(ctx, &locations, reference.channels.scene, &kinds, scoring, |uuid, scores| {
        let checks = reference.report.of(ENTROPIES, &path);
        for (record, score) in views.of_location(area, uuid).zip(scores) {
            checks.check(record.entropy == score, || {
                format!(
                    "candidate {} of {uuid} has the entropy {}, and {score} when it is scored again",
                    record.candidate, record.entropy
                )
            });
        }
        Ok(())
    })
}
