//! Views of each type of room.

use super::images::Look;
use super::sheet::{Align, INK, SIZE, Sheet, WIDTH};
use super::{Book, Drawn, words_of};
use crate::error::Result;
use s3d_io::dataset::DatasetImage;
use std::collections::BTreeMap;

const GAP: f32 = 4.0;
/// The most types of rooms: a page is not higher.
const ROWS: usize = 6;
const LOOKS: [Look; 4] = [Look::Colors, Look::Classes, Look::Normals, Look::Depth];

/// Draws the richest view of each type of room, in four modalities. Types with the richest views come first.
pub(super) fn examples(book: &Book<'_>) -> Result<Option<Drawn>> {
    let looks: Vec<Look> = LOOKS
        .into_iter()
        .filter(|look| book.views.iter().any(|(view, _)| view.has(look.domain())))
        .collect();
    let mut richest: BTreeMap<&str, (&DatasetImage, f64)> = BTreeMap::new();
    for (view, record) in book
        .views
        .iter()
        .filter(|(view, _)| looks.iter().all(|l| view.has(l.domain())))
    {
        let kind = view.room.rsplit_once('_').map_or(view.room.as_str(), |(kind, _)| kind);
        let best = richest.entry(kind).or_insert((view, record.entropy));
        if record.entropy > best.1 {
            *best = (view, record.entropy);
        }
    }
    let mut rows: Vec<_> = richest.into_iter().collect();
    rows.sort_by(|(_, (_, a)), (_, (_, b))| b.total_cmp(a));
    rows.truncate(ROWS);
    if rows.is_empty() || looks.is_empty() {
        return Ok(None);
    }

    // Two rooms side by side.
    let across = 2 * looks.len();
    let side = (WIDTH - GAP * across as f32) / across as f32;
    let row = side + 1.6 * SIZE + GAP;
    let mut sheet = Sheet::new(row * rows.len().div_ceil(2) as f32 - GAP);
    for (i, (kind, (view, _))) in rows.into_iter().enumerate() {
        let left = (i % 2) as f32 * (0.5 * WIDTH + 0.5 * GAP);
        let y = (i / 2) as f32 * row;
        for (k, look) in looks.iter().enumerate() {
            let at = [left + k as f32 * (side + GAP), y];
            sheet.picture(at, [side; 2], book.images.picture(view, *look, side)?);
        }
        sheet.words([left, y + side + 1.2 * SIZE], Align::Left, INK, &words_of(kind));
    }
    let caption = "A view of each type of room: colours, classes, surface normals, depth.".into();
    Ok(Some(Drawn { name: "examples".into(), caption, sheet }))
}
