//! Protocol `depth-edge`: boundaries in depth.

use crate::Evaluation;
use crate::error::Result;
use crate::images::depth::edge_metrics::{EdgeScores, depth_edges};
use crate::images::depth::files::{Both, Form, both};
use crate::images::depth::protocol::mean;
use crate::images::predictions::{Matched, Wanted, find};
use crate::images::read::Places;
use crate::tables::tables;
use crate::task::Task;
use s3d_io::dataset::Domain;

const DEFINITION: [&str; 5] = [
    "Images are evaluated at their own size. A boundary is a pixel and its neighbour of which one is farther \
     than the other by more than a limit. There are 10 limits, ratios from 1.05 to 1.25, and four \
     directions: the nearer pixel is right, left, below or above. Neighbours of which one has no true depth \
     are left out.",
    "A predicted boundary is right if the truth has it at the same place, in the same direction. Precision \
     and recall at a limit are means over directions; a direction without boundaries has 0. F1 is their \
     harmonic mean.",
    "The scores of an image are means over limits, in which each limit counts its ratio. The table has their \
     mean over images.",
    "Depth is scale-invariant here: predictions may be in any unit, but not shifted. Depths below 0.000001 \
     are raised to it.",
    "As in Depth Pro's boundary_metrics.py (commit 9efe5c1d), SI_boundary_F1.",
];

pub(crate) fn depth_edge(task: &Task<'_>) -> Result<Evaluation> {
    let wanted = Wanted {
        domain: Domain::Depth,
        besides: &[],
        kind: task.options.images,
        other_kind: "",
        endings: &["png", "npy", "npz"],
        known: &[],
    };
    let matched = find(task, &wanted)?;

    let form = Form { places: Places::all, is_metric: true, is_evaluated: |truth| truth > 0.0 };
    let units = matched.count(task, |predicted| {
        let Both { size, truth, prediction } = both(task, predicted, &form)?;
        Ok(depth_edges(&truth, &prediction, size[0] as usize))
    })?;
    let Matched { images, kind, mut notes } = matched;

    let incomplete = units.iter().filter(|unit| !unit.counted.is_complete).count();
    if incomplete > 0 {
        notes.push(format!(
            "The truth of {incomplete} {} lacks boundaries in a direction at a limit, so that nothing \
             reaches 1 there, as in the script.",
            kind.noun()
        ));
    }
    let made = tables(task, &["F1", "precision", "recall"], &units, |units: &[&EdgeScores]| {
        vec![("mean".to_owned(), mean(units.iter().map(|scores| &scores.values[..]), 3))]
    });
    let counted = [(kind.noun(), images.len() as u64)];
    Ok(Evaluation { notes, ..task.evaluation(&DEFINITION, counted, made) })
}
