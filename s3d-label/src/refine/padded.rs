//! An image with a margin, so that windows need no care at its edges.

use super::{NO_LABEL, RefineInput};
use crate::LabelId;

/// The width of the margin, pixels. No window reaches farther.
pub(super) const MARGIN: usize = 40;

/// How a pixel looks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Look {
    pub(super) color: [u8; 3],
    pub(super) normal: [i8; 3],
    /// The logarithm of the depth, 512 steps a doubling.
    pub(super) depth: u16,
}

/// The image with a margin of [`MARGIN`] pixels on all sides, which continues a panorama.
pub(super) struct Padded {
    /// Pixels in a row, the margins included.
    pub(super) width: usize,
    pub(super) looks: Vec<Look>,
    /// [`NO_LABEL`] for pixels that take no part: without a label, without a colour, and in the margin.
    pub(super) labels: Vec<u32>,
    pub(super) face_px: Vec<u8>,
    wraps: bool,
}

impl Padded {
    /// Copies an image into one with a margin.
    pub(super) fn new(input: &RefineInput<'_>) -> Self {
        let inner = input.width.max(1);
        let width = inner + 2 * MARGIN;
        let len = width * (input.labels.len() / inner + 2 * MARGIN);
        let mut padded = Self {
            width,
            looks: vec![Look::default(); len],
            labels: vec![NO_LABEL; len],
            face_px: vec![0; len],
            wraps: input.wraps,
        };

        let places = padded.inner_places();
        let pixels = input
            .labels
            .iter()
            .zip(input.colors)
            .zip(input.depth_m)
            .zip(input.normals);
        for (at, ((((label, color), depth), normal), face_px)) in places.zip(pixels.zip(input.face_px)) {
            if *label == LabelId::NULL.0 || *label == NO_LABEL || *color == [0; 3] {
                continue;
            }
            // The bits of a positive float are a logarithm, linear within a doubling.
            let look = Look { color: *color, normal: *normal, depth: (depth.to_bits() >> 14) as u16 };
            set(&mut padded.looks, at, look);
            set(&mut padded.labels, at, *label);
            set(&mut padded.face_px, at, *face_px);
        }

        let mut labels = std::mem::take(&mut padded.labels);
        let mut looks = std::mem::take(&mut padded.looks);
        let mut face_px = std::mem::take(&mut padded.face_px);
        padded.close(&mut labels);
        padded.close(&mut looks);
        padded.close(&mut face_px);
        Self { labels, looks, face_px, ..padded }
    }

    /// The places of the pixels that are not in the margin, row by row.
    pub(super) fn inner_places(&self) -> impl Iterator<Item = usize> + use<> {
        let (width, len) = (self.width, self.looks.len());
        let rows = (MARGIN * width..len.saturating_sub(MARGIN * width)).step_by(width);
        rows.flat_map(move |row| row + MARGIN..row + width - MARGIN)
    }

    /// Returns the values of the pixels that are not in the margin.
    pub(super) fn inner<T: Copy>(&self, values: &[T]) -> Vec<T> {
        self.inner_places().filter_map(|at| values.get(at).copied()).collect()
    }

    /// Copies the values of a panorama's other end into its margins. Other images have none there.
    pub(super) fn close<T: Copy>(&self, values: &mut [T]) {
        if !self.wraps {
            return;
        }
        let inner = self.width - 2 * MARGIN;
        for row in values.chunks_exact_mut(self.width) {
            for x in (0..MARGIN).chain(MARGIN + inner..self.width) {
                // Whole turns away from the place in the image.
                let from = (x + inner * MARGIN - MARGIN) % inner + MARGIN;
                if let Some(value) = row.get(from).copied() {
                    set(row, x, value);
                }
            }
        }
    }
}

/// Sets a value, if the place exists.
pub(super) fn set<T>(values: &mut [T], at: usize, value: T) {
    if let Some(place) = values.get_mut(at) {
        *place = value;
    }
}
