//! Rectangles of pixels.

use glam::{DVec2, dvec2};
use std::ops::Range;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelBox {
    /// The first column.
    pub x: u32,
    /// The first row.
    pub y: u32,
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
}

impl PixelBox {
    /// Returns the columns.
    pub fn columns(&self) -> Range<u32> {
        self.x..self.x + self.width
    }

    /// Returns the rows.
    pub fn rows(&self) -> Range<u32> {
        self.y..self.y + self.height
    }

    /// Returns whether the box has no pixel.
    pub fn is_empty(&self) -> bool {
        self.width == 0 || self.height == 0
    }

    /// Returns the part of the box whose pixels lie between two points of the image, in whole or in part.
    pub(crate) fn between(&self, low: DVec2, high: DVec2) -> Option<Self> {
        let least = dvec2(f64::from(self.x), f64::from(self.y));
        let most = least + dvec2(f64::from(self.width), f64::from(self.height));
        let low = low.floor().clamp(least, most);
        let high = high.ceil().clamp(least, most);
        let size = high - low;
        let found = Self { x: low.x as u32, y: low.y as u32, width: size.x as u32, height: size.y as u32 };
        (size.min_element() > 0.0).then_some(found)
    }

    /// Widens a box by some pixels.
    pub(crate) fn add(bounds: &mut Option<Self>, columns: &Range<u32>, rows: &Range<u32>) {
        let (old_columns, old_rows) =
            bounds.map_or((columns.clone(), rows.clone()), |old| (old.columns(), old.rows()));
        let x = old_columns.start.min(columns.start);
        let y = old_rows.start.min(rows.start);
        let width = old_columns.end.max(columns.end) - x;
        let height = old_rows.end.max(rows.end) - y;
        *bounds = Some(Self { x, y, width, height });
    }
}
