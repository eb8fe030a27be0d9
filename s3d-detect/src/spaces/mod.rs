//! Parses an area into spaces, such as rooms and hallways, without training: Armeni et al., "3D Semantic
//! Parsing of Large-Scale Indoor Spaces" (CVPR 2016), section 3.
//!
//! A wall between two spaces is two dense layers of points with a gap between them. Along the axis across the
//! wall, the density of points has a peak, a gap and a peak. [Dividers](dividers) found this way cut the area
//! into cells. Neighbouring cells are [merged](merge) if no wall stands where they touch, and cells that are
//! connected by mergers make a space. Each space gets a [canonical frame](frame).
//!
//! The same filter along Z tells [storeys](dividers::storey_borders) apart, which are parsed one by one.
//!
//! The paper does not publish the widths, the thresholds and the rule for an entrance: they are ours.

pub mod dividers;
pub mod frame;
pub mod merge;
pub mod rand_index;

pub(crate) mod parsed_area;
pub(crate) mod space;

use crate::surfel::Surfel;
use dividers::{Dividers, find_dividers, storey_borders};
use merge::{NO_SPACE, merge_cells};

/// Returns the angle of the building's walls to the axes, in degrees, −45 to 45. It is the mean direction
/// of upright surfaces, modulo a quarter turn; 0 if there are none.
pub fn building_angle_deg(surfels: &[Surfel]) -> f64 {
    let mut sine = 0.0;
    let mut cosine = 0.0;
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

/// The spaces of an area whose walls are parallel to the axes.
#[derive(Clone, Debug)]
pub struct Spaces {
    /// The planes of the walls of each storey, from below.
    pub dividers: Vec<Dividers>,
    /// The space of each surfel; [`NO_SPACE`] in cells too small to be a space.
    pub of_surfel: Vec<u32>,
    /// The number of spaces.
    pub count: u32,
}

/// Parses the surfels of an area, storey by storey.
pub fn parse(surfels: &[Surfel]) -> Spaces {
    let borders = storey_borders(surfels);
    let storey_of = |s: &Surfel| borders.partition_point(|border| *border <= s.position.z);
    let mut spaces = Spaces { dividers: Vec::new(), of_surfel: vec![NO_SPACE; surfels.len()], count: 0 };

    for storey in 0..=borders.len() {
        let places: Vec<usize> = (0..surfels.len())
            .filter(|&i| storey_of(&surfels[i]) == storey)
            .collect();
        let here: Vec<Surfel> = places.iter().map(|&i| surfels[i]).collect();
        let dividers = find_dividers(&here);
        let (of_surfel, count) = merge_cells(&here, &dividers);

        for (place, space) in places
            .into_iter()
            .zip(of_surfel)
            .filter(|(_, space)| *space != NO_SPACE)
        {
            spaces.of_surfel[place] = spaces.count + space;
        }
        spaces.dividers.push(dividers);
        spaces.count += count;
    }
    spaces
}
