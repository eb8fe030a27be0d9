//! One place in all modalities.

use super::images::Look;
use super::sheet::{Align, GREY, INK, SIZE, Sheet, WIDTH};
use super::{Book, Drawn, words_of};
use crate::error::Result;
use s3d_io::dataset::Frame;

/// The space between pictures, points.
const GAP: f32 = 6.0;

/// Draws the richest panorama in all modalities that it has; without panoramas, the richest view.
pub(super) fn modalities(book: &Book<'_>) -> Result<Option<Drawn>> {
    let Some(image) = book.richest_panorama().or_else(|| book.richest_view()) else { return Ok(None) };
    let looks: Vec<Look> = Look::ALL.into_iter().filter(|look| image.has(look.domain())).collect();
    let is_wide = image.frame == Frame::Panorama;
    let columns = if is_wide { 2 } else { 3 };
    let width = (WIDTH - GAP * (columns - 1) as f32) / columns as f32;
    let height = if is_wide { 0.5 * width } else { width };
    let row = height + 1.6 * SIZE + GAP;

    let mut sheet = Sheet::new(row * looks.len().div_ceil(columns) as f32 - GAP);
    for (i, look) in looks.into_iter().enumerate() {
        let (x, y) = ((i % columns) as f32 * (width + GAP), (i / columns) as f32 * row);
        sheet.picture([x, y], [width, height], book.images.picture(image, look, width)?);
        let color = if look == Look::Colors { INK } else { GREY };
        sheet.words([x + 0.5 * width, y + height + 1.2 * SIZE], Align::Middle, color, look.words());
    }
    let kind = if is_wide { "panorama" } else { "view" };
    let caption = format!(
        "A {kind} of {} (area {}) in each modality. Depth is white where it is near; coordinates are red \
         along x, green along y, blue along z.",
        words_of(&image.room),
        image.area
    );
    Ok(Some(Drawn { name: "modalities".into(), caption, sheet }))
}
