//! The spaces of an area — rooms, hallways — without training, after Armeni et al., "3D Semantic Parsing of
//! Large-Scale Indoor Spaces" (CVPR 2016), section 3.
//!
//! A wall between two spaces is two dense layers of points with a gap between them: a peak, a gap and a peak
//! in the density of points along the axis that it stands across. [Dividers](dividers) found so cut the area
//! in cells; neighbouring cells with no wall where they touch are [merged](merge), and what is connected by
//! mergers is a space. Each gets a [canonical frame](frame).
//!
//! Widths, thresholds and the rule for an entrance are not public, and ours.

pub mod dividers;
pub mod frame;
pub mod merge;
pub mod rand_index;

use crate::surfel::Surfel;
use dividers::{Dividers, find_dividers};
use merge::{NO_SPACE, merge_cells};

/// The angle by which the building's walls are turned against the axes, in degrees, −45 to 45: the mean
/// direction of upright surfaces, four times round a circle. 0 where there are none.
pub fn building_angle_deg(surfels: &[Surfel]) -> f64 {
    let (mut sine, mut cosine) = (0.0, 0.0);
    for s in surfels.iter().filter(|s| s.normal.z.abs() < 0.3) {
        let angle = 4.0 * libm::atan2(f64::from(s.normal.y), f64::from(s.normal.x));
        sine += libm::sin(angle);
        cosine += libm::cos(angle);
    }
    if sine == 0.0 && cosine == 0.0 {
        0.0
    } else {
        libm::atan2(sine, cosine).to_degrees() / 4.0
    }
}

/// The spaces of an area, in whose axes its walls stand.
#[derive(Clone, Debug)]
pub struct Spaces {
    /// Where walls are.
    pub dividers: Dividers,
    /// The space of each surfel; [`NO_SPACE`] for those of cells too small to be one.
    pub of_surfel: Vec<u32>,
    /// How many spaces there are.
    pub count: u32,
}

/// Parses an area.
pub fn parse(surfels: &[Surfel]) -> Spaces {
    let dividers = find_dividers(surfels);
    let (of_surfel, count) = merge_cells(surfels, &dividers);
    debug_assert!(of_surfel.iter().all(|&s| s < count || s == NO_SPACE));
    Spaces { dividers, of_surfel, count }
}
