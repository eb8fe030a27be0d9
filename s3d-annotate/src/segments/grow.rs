//! Joins faces to segments.

use super::borders::Border;
use super::looks::Looks;
use rayon::prelude::*;
use s3d_geom::segment_graph;

/// Joins faces to segments by [`segment_graph`]. `differences` has one entry a border. Returns the segment of
/// each face, and the number of segments.
pub(super) fn grow(
    looks: &Looks,
    borders: &[Border],
    differences: &[f32],
    scale_m2: f64,
    smallest_m2: f64,
) -> (Vec<u32>, usize) {
    let order = ascending(differences);
    let edges = order
        .iter()
        .map(|&border| (borders[border as usize].faces, differences[border as usize]));
    segment_graph(looks.area_m2.clone(), edges, scale_m2, smallest_m2).numbered()
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
