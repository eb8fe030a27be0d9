//! An example of each class.

use super::sheet::{Align, INK, SIZE, Sheet, WIDTH};
use super::{Book, Drawn};
use crate::error::Result;
use rayon::prelude::*;
use s3d_io::dataset::{DatasetImage, Domain};

const GAP: f32 = 4.0;
/// Pictures side by side.
const ACROSS: usize = 7;
/// The most views that are looked at, evenly spread over all.
const VIEWS: usize = 120;
/// The share of a view's pixels from which on more of a class makes no better example.
const ENOUGH: f64 = 0.3;

/// Draws a view for each class: of those in which it has [`ENOUGH`] of the pixels the richest, or else the
/// one with the most. All that is of other classes is pale.
pub(super) fn classes(book: &Book<'_>) -> Result<Option<Drawn>> {
    let views: Vec<(&DatasetImage, f64)> = book
        .views
        .iter()
        .filter(|(view, _)| [Domain::Rgb, Domain::Semantic].iter().all(|domain| view.has(*domain)))
        .map(|(view, record)| (view, record.entropy))
        .collect();
    let few: Vec<_> = views.iter().step_by(views.len().div_ceil(VIEWS).max(1)).collect();
    let shares = few.par_iter().map(|(view, _)| book.images.shares_of_classes(view));
    let shares = shares.collect::<Result<Vec<Vec<f64>>>>()?;

    let mut examples: Vec<(&str, usize, &DatasetImage)> = Vec::new();
    for (class, (name, _)) in book.images.classes().into_iter().enumerate() {
        let of_views = few.iter().zip(&shares).map(|((view, entropy), shares)| {
            let share = shares.get(class).copied().unwrap_or_default();
            (share.min(ENOUGH), *entropy, *view)
        });
        let best = of_views
            .filter(|(share, ..)| *share > 0.0)
            .max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        examples.extend(best.map(|(.., view)| (name, class, view)));
    }
    if examples.is_empty() {
        return Ok(None);
    }

    let side = (WIDTH - GAP * (ACROSS - 1) as f32) / ACROSS as f32;
    let row = side + 1.6 * SIZE + GAP;
    let mut sheet = Sheet::new(row * examples.len().div_ceil(ACROSS) as f32 - GAP);
    for (i, (name, class, view)) in examples.into_iter().enumerate() {
        let at = [(i % ACROSS) as f32 * (side + GAP), (i / ACROSS) as f32 * row];
        sheet.picture(at, [side; 2], book.images.picture_of_class(view, class, side)?);
        sheet.words([at[0] + 0.5 * side, at[1] + side + 1.2 * SIZE], Align::Middle, INK, name);
    }
    let caption = "An example of each class, in a view that shows much of it. All else is pale.".into();
    Ok(Some(Drawn { name: "classes".into(), caption, sheet }))
}
