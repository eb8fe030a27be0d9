//! The pixels whose labels are open: a band along the borders between labels.

use super::NO_LABEL;
use super::padded::{Padded, set};

/// The narrowest and the widest half of the band, pixels.
const REACH_PX: [u32; 2] = [3, 24];

/// The half of the band at a border between faces, as a share of their size.
const REACH_PERCENT: u32 = 150;

/// Steps to the next pixel of a row or column, and along a diagonal: chamfer distances of thirds of a pixel.
pub(super) const STEPS: [u16; 2] = [3, 4];

/// The advantage of the projected label at a border, and how much it grows up to the end of the band. The
/// unit is a 64th of a doubling of the likelihood.
const ADVANTAGE: [u32; 2] = [60, 250];

/// Beyond this distance from a border, pixels are decided in fours at first.
const FAR_PX: u32 = 2;

/// How sure a pixel at a border is of its label at first, of 255.
const SURE_AT_BORDER: u32 = 40;

/// A pixel of the band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OpenPixel {
    /// Its place in the image with margins.
    pub(super) at: usize,
    /// The width of the half of the band that it is in, pixels.
    pub(super) reach: u8,
    /// The advantage of the projected label.
    pub(super) advantage: u16,
    /// How sure it is of the projected label at first, of 255.
    pub(super) sure: u8,
    /// Whether it is farther from the border than [`FAR_PX`].
    pub(super) is_far: bool,
}

impl OpenPixel {
    /// The place of the first pixel of the four that a far pixel is decided with, in an image of this width.
    pub(super) fn scout(&self, width: usize) -> usize {
        self.at - self.at % width % 2 - self.at / width % 2 * width
    }
}

/// How far a pixel is in the band of a border. The border that leaves most room counts, and of equal ones the
/// nearest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Room {
    /// The width that is left beyond the pixel, in thirds of a pixel. At most 0 outside of all bands.
    left: i16,
    /// Minus the distance from the border, in thirds of a pixel.
    nearness: i16,
}

impl Room {
    /// The room at a border between faces of this size.
    pub(super) fn at_border(face_px: u8) -> Self {
        let [least, most] = REACH_PX;
        let reach = (u32::from(face_px) * REACH_PERCENT / 100).clamp(least, most);
        Self { left: reach as i16 * STEPS[0] as i16 - 1, nearness: -1 }
    }

    /// The room at a pixel farther away by `step`.
    pub(super) fn beyond(self, step: u16) -> Self {
        let step = step as i16;
        if self.left <= step {
            return Self::default();
        }
        Self { left: self.left - step, nearness: self.nearness - step }
    }

    /// The pixel at this place, if it is in a band.
    pub(super) fn open_pixel(self, at: usize) -> Option<OpenPixel> {
        if self.left <= 0 {
            return None;
        }
        let distance = u32::from(self.nearness.unsigned_abs());
        let width = distance + u32::from(self.left.unsigned_abs());
        let [here, more] = ADVANTAGE;
        Some(OpenPixel {
            at,
            reach: (width / u32::from(STEPS[0])) as u8,
            advantage: (here + more * distance * distance / (width * width)) as u16,
            sure: (SURE_AT_BORDER + (255 - SURE_AT_BORDER) * distance / width) as u8,
            is_far: distance > FAR_PX * u32::from(STEPS[0]),
        })
    }
}

/// Returns the room of a pixel that has a neighbour with another label; `None` for other pixels. The largest
/// face of those that meet there counts.
pub(super) fn border(image: &Padded, at: usize) -> Option<Room> {
    let known = |at: usize| image.labels.get(at).copied().filter(|label| *label != NO_LABEL);
    let label = known(at)?;
    let neighbours = [at.wrapping_sub(1), at + 1, at.wrapping_sub(image.width), at + image.width];
    let others = neighbours
        .into_iter()
        .filter(|at| known(*at).is_some_and(|other| other != label));
    let size = |at: usize| image.face_px.get(at).copied().unwrap_or_default();
    let largest = others.map(size).max()?;
    Some(Room::at_border(largest.max(size(at))))
}

/// Finds the pixels of the band that are not in the margin, in their order.
pub(super) fn find(image: &Padded) -> Vec<OpenPixel> {
    let len = image.labels.len();
    let width = image.width;
    let mut rooms: Vec<Room> = (0..len).map(|at| border(image, at).unwrap_or_default()).collect();

    // Twice over the image: what lies before a pixel, and then what lies behind it.
    let [straight, diagonal] = STEPS;
    let steps = [(1, straight), (width, straight), (width + 1, diagonal), (width - 1, diagonal)];
    let inside = width + 1..len.saturating_sub(width + 1);
    let mut widen = |at: usize, from: usize, step: u16| {
        let reached = rooms.get(from).copied().unwrap_or_default().beyond(step);
        if let Some(room) = rooms.get_mut(at)
            && reached > *room
        {
            *room = reached;
        }
    };
    for at in inside.clone() {
        steps.iter().for_each(|(back, step)| widen(at, at - back, *step));
    }
    for at in inside.rev() {
        steps.iter().for_each(|(ahead, step)| widen(at, at + ahead, *step));
    }

    let takes_part = |at: &usize| image.labels.get(*at).is_some_and(|label| *label != NO_LABEL);
    let places = image.inner_places().filter(takes_part);
    places.filter_map(|at| rooms.get(at)?.open_pixel(at)).collect()
}

/// Returns how sure each pixel of the image is of its label at first.
pub(super) fn first_sure(image: &Padded, band: &[OpenPixel]) -> Vec<u8> {
    let mut sure = vec![u8::MAX; image.labels.len()];
    for pixel in band {
        set(&mut sure, pixel.at, pixel.sure);
    }
    image.close(&mut sure);
    sure
}
