//! Felzenszwalb and Huttenlocher's segmentation of a graph. Source: "Efficient Graph-Based Image
//! Segmentation", IJCV 59(2), 2004.

use super::borders::Border;
use super::forest::Forest;
use super::looks::Looks;
use rayon::prelude::*;

/// Joins faces to segments. `differences` has one entry a border. Returns the segment of each face, and the
/// number of segments.
///
/// Borders are taken from the smallest difference on. Two sets of faces are joined if the border between them
/// differs no more than each differs within itself, plus an allowance of `scale_m2` divided by its area. A
/// set smaller than `smallest_m2` then joins the neighbour from which it differs least.
pub(super) fn grow(
    looks: &Looks,
    borders: &[Border],
    differences: &[f32],
    scale_m2: f64,
    smallest_m2: f64,
) -> (Vec<u32>, usize) {
    let order = ascending(differences);

    let mut sets = Forest::new(looks.area_m2.len());
    let mut area_m2 = looks.area_m2.clone();
    // The largest difference within a set, over the borders by which it was joined.
    let mut within = vec![0f32; area_m2.len()];
    for &border in &order {
        let [a, b] = borders[border as usize].faces.map(|face| sets.root(face));
        let difference = differences[border as usize];
        let allows = |set: u32| {
            f64::from(difference) <= f64::from(within[set as usize]) + scale_m2 / area_m2[set as usize]
        };
        if a != b && allows(a) && allows(b) {
            sets.join(a, b);
            area_m2[a as usize] += area_m2[b as usize];
            within[a as usize] = difference;
        }
    }

    for &border in &order {
        let [a, b] = borders[border as usize].faces.map(|face| sets.root(face));
        if a != b && area_m2[a as usize].min(area_m2[b as usize]) < smallest_m2 {
            sets.join(a, b);
            area_m2[a as usize] += area_m2[b as usize];
        }
    }
    sets.numbered()
}

/// Returns the places of numbers that are at least 0, from the smallest number on; equal ones in their order.
fn ascending(numbers: &[f32]) -> Vec<u32> {
    // Bits of numbers that are not negative have the order of the numbers.
    let mut keys: Vec<u64> = numbers
        .iter()
        .zip(0u64..)
        .map(|(x, place)| u64::from(x.to_bits()) << 32 | place)
        .collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}
