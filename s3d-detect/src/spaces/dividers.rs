//! Finds the planes of walls in density histograms.

use crate::surfel::{CELL_M, Surfel};

/// The width of the bins of a histogram, in metres.
const BIN_M: f32 = 0.025;
/// The widths of the gaps that filters look for, in bins: 5 to 50 cm.
const GAPS: std::ops::RangeInclusive<usize> = 2..=20;
/// The width of a peak, in bins.
const PEAK: usize = 2;
/// The least response of a filter, in m² of wall.
const LEAST_M2: f64 = 2.0;
/// The stronger one stays of two dividers nearer to each other than this, in metres.
const APART_M: f32 = 0.12;

/// A surface is level if the z of its normal is larger than this.
const LEVEL: f32 = 0.9;
/// The ceiling and the floor between two storeys have this share of the largest floor or ceiling at least.
const STOREY_SHARE: f64 = 0.3;
/// The least height of a storey, in metres.
const STOREY_M: f32 = 1.8;

/// A plane across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divider {
    /// Its place on the axis: the middle of the gap, in metres.
    pub at: f32,
    /// The width of the gap, in metres.
    pub gap: f32,
    /// The response of the filter, in m².
    pub response: f64,
}

/// Dividers across x and y, ascending.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dividers {
    /// The dividers across x, then across y.
    pub axes: [Vec<Divider>; 2],
}

/// Finds the dividers of an area.
pub fn find_dividers(surfels: &[Surfel]) -> Dividers {
    Dividers { axes: [0, 1].map(|axis| dividers_along(axis, surfels)) }
}

fn dividers_along(axis: usize, surfels: &[Surfel]) -> Vec<Divider> {
    let Histogram { origin, m2 } = Histogram::new(axis, surfels);
    strongest(&respond(&m2))
        .into_iter()
        .map(|(middle, gap, response)| Divider {
            at: origin + middle as f32 * 0.5 * BIN_M,
            gap: gap as f32 * BIN_M,
            response,
        })
        .collect()
}

/// Returns the heights between the storeys of an area, ascending; none if it has one storey. Such a height
/// lies between a ceiling and the floor above it, both of much of the size of the largest floor. Storeys
/// that begin at another height in each part of a building are not told apart.
pub fn storey_borders(surfels: &[Surfel]) -> Vec<f32> {
    let is_level = |s: &&Surfel| s.normal.z.abs() > LEVEL;
    let level: Vec<Surfel> = surfels.iter().filter(is_level).copied().collect();
    let Histogram { m2, .. } = Histogram::new(2, &level);
    let largest = m2.windows(PEAK).map(|peak| peak.iter().sum()).fold(0.0, f64::max);
    let heights = |s: &Surfel| s.position.z;
    let lowest = level.iter().map(heights).fold(f32::INFINITY, f32::min);
    let highest = level.iter().map(heights).fold(f32::NEG_INFINITY, f32::max);

    let mut borders: Vec<f32> = Vec::new();
    for divider in dividers_along(2, &level) {
        let below = borders.last().copied().unwrap_or(lowest);
        if divider.response >= STOREY_SHARE * largest
            && divider.at - below >= STOREY_M
            && highest - divider.at >= STOREY_M
        {
            borders.push(divider.at);
        }
    }
    borders
}

/// The surface of surfels along an axis, in bins of [`BIN_M`].
struct Histogram {
    /// Where the first bin begins, in metres.
    origin: f32,
    /// The surface in each bin, in m². Both ends have room for a filter.
    m2: Vec<f64>,
}

impl Histogram {
    fn new(axis: usize, surfels: &[Surfel]) -> Self {
        let ends = surfels
            .iter()
            .fold([f32::INFINITY, f32::NEG_INFINITY], |[least, most], s| {
                [least.min(s.position[axis]), most.max(s.position[axis])]
            });
        if surfels.is_empty() {
            return Self { origin: 0.0, m2: Vec::new() };
        }

        let margin = GAPS.end() + PEAK;
        let bin = |x: f32| ((x - ends[0]) / BIN_M) as usize + margin;
        let mut m2 = vec![0.0; bin(ends[1]) + margin + 1];
        // Each surfel stands for a cell of surface.
        for s in surfels {
            m2[bin(s.position[axis])] += f64::from(CELL_M * CELL_M);
        }
        Self { origin: ends[0] - margin as f32 * BIN_M, m2 }
    }
}

/// Returns for each place, in half bins, the largest response of all gaps, and this gap. The response of a
/// filter is the smaller of its two peaks, less the mean density in the gap times the width of a peak: floors
/// and furniture, which are dense everywhere, do not count.
fn respond(histogram: &[f64]) -> Vec<(f64, usize)> {
    let mut sums = vec![0.0];
    for value in histogram {
        sums.push(sums[sums.len() - 1] + value);
    }
    let mut best = vec![(0.0, 0); 2 * histogram.len() + 1];
    for gap in GAPS {
        for start in PEAK..histogram.len().saturating_sub(gap + PEAK) {
            let end = start + gap;
            let left = sums[start] - sums[start - PEAK];
            let right = sums[end + PEAK] - sums[end];
            let between = (sums[end] - sums[start]) / gap as f64 * PEAK as f64;
            let response = left.min(right) - between;
            if response > best[start + end].0 {
                best[start + end] = (response, gap);
            }
        }
    }
    best
}

/// Returns the places with enough response, ascending, each the strongest around: (half bins, gap, response).
fn strongest(answers: &[(f64, usize)]) -> Vec<(usize, usize, f64)> {
    let mut order: Vec<usize> = (0..answers.len()).filter(|&i| answers[i].0 >= LEAST_M2).collect();
    order.sort_by(|&a, &b| answers[b].0.total_cmp(&answers[a].0).then(a.cmp(&b)));
    let apart = (2.0 * APART_M / BIN_M) as usize;
    let mut stay: Vec<usize> = Vec::new();
    for i in order {
        if stay.iter().all(|s| s.abs_diff(i) >= apart) {
            stay.push(i);
        }
    }
    stay.sort_unstable();
    stay.into_iter().map(|i| (i, answers[i].1, answers[i].0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, vec3};
    use s3d_geom::Aabb;

    #[test]
    fn two_layers_are_a_divider_and_one_layer_is_not() {
        let mut histogram = vec![1.0; 100];
        // A wall of two layers, 6 bins apart; a single layer at 70.
        (histogram[28], histogram[29]) = (5.0, 5.0);
        (histogram[36], histogram[37], histogram[70]) = (4.0, 4.0, 9.0);
        let found = strongest(&respond(&histogram));
        assert_eq!(found.len(), 1);
        let (middle, gap, response) = found[0];
        assert_eq!((middle, gap), (30 + 36, 6));
        assert!((response - (8.0 - 2.0)).abs() < 1e-9);
    }

    #[test]
    fn no_surfels_have_no_dividers() {
        assert_eq!(find_dividers(&[]), Dividers::default());
    }

    /// Makes level surfaces of 4 × 5 m, or of a part of this.
    fn levels(heights: &[(f32, f32)]) -> Vec<Surfel> {
        let mut surfels = Vec::new();
        for (z, share) in heights {
            for i in 0..(80.0 * share) as u8 {
                for j in 0..100u8 {
                    let position = CELL_M * vec3(f32::from(i), f32::from(j), 0.0) + z * Vec3::Z;
                    let extent = Aabb { min: position, max: position };
                    let normal = Vec3::Z;
                    surfels.push(Surfel {
                        position,
                        extent,
                        normal,
                        curvature: 0.0,
                        color: Vec3::ZERO,
                        room: 0,
                    });
                }
            }
        }
        surfels
    }

    #[test]
    fn storeys_lie_between_a_ceiling_and_a_floor() {
        assert!(storey_borders(&[]).is_empty());
        // Tables are thin, too, and a slab lies above a suspended ceiling.
        let storey = [(0.0, 1.0), (0.72, 0.5), (0.76, 0.5), (2.6, 1.0), (2.9, 1.0)];
        assert!(storey_borders(&levels(&storey)).is_empty());

        // A floor with a stairwell above.
        let house = [storey.as_slice(), &[(2.9, 0.8), (3.66, 0.4), (5.5, 1.0)]].concat();
        let borders = storey_borders(&levels(&house));
        assert!(borders.len() == 1 && (borders[0] - 2.75).abs() < 0.05, "{borders:?}");
    }
}
