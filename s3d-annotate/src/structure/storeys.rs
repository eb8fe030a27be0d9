//! Storeys: the heights of floors.

use super::scan::Scan;

/// The height of a person with room to move, metres. No floor has less above it, and storeys are farther
/// apart.
const HEADROOM_M: f64 = 1.8;

/// The range of heights in which the cells of a floor lie, metres.
const SPREAD_M: f32 = 0.1;

/// A floor is at least this large, m², …
const LEAST_M2: f64 = 1.5;

/// … and has at least this share of the largest one.
const LEAST_SHARE: f64 = 0.1;

/// Returns the heights of the floors of a building, ascending, metres.
///
/// In each column, free space of 1.8 m or more begins on something level: the floor, or a table on it.
/// Heights at which much free space begins are floors, the largest first. What lies less than 1.8 m from a
/// floor is none: table tops, landings. Space without an end above, as in a scan without ceilings, counts in
/// columns that have no other; so the outside of a roof is no floor.
pub(super) fn floors(scan: &Scan) -> Vec<f64> {
    let mut bottoms = Vec::new();
    for cell in 0..scan.grid.cells() {
        let column = scan.column(cell);
        let before = bottoms.len();
        for pair in column.windows(2) {
            if f64::from(pair[1].z - pair[0].z) >= HEADROOM_M && scan.facet(pair[0].face).is_level() {
                bottoms.push(pair[0].z);
            }
        }
        let is_open = bottoms.len() == before;
        let last = column.last().filter(|last| is_open && scan.facet(last.face).is_level());
        bottoms.extend(last.map(|last| last.z));
    }
    bottoms.sort_unstable_by(f32::total_cmp);

    let mut floors: Vec<f64> = Vec::new();
    let mut largest_m2 = 0.0;
    loop {
        // The range that holds most heights, away from the floors found so far.
        let mut best: Option<[usize; 2]> = None;
        let mut start = 0;
        for end in 0..bottoms.len() {
            while bottoms[end] - bottoms[start] > SPREAD_M {
                start += 1;
            }
            let is_near = |z: f32| floors.iter().any(|floor| (floor - f64::from(z)).abs() < HEADROOM_M);
            let is_larger = best.is_none_or(|[a, b]| end + 1 - start > b - a);
            if is_larger && !is_near(bottoms[start]) && !is_near(bottoms[end]) {
                best = Some([start, end + 1]);
            }
        }

        let Some([start, end]) = best else { break };
        let area_m2 = (end - start) as f64 * scan.grid.cell_m2();
        if area_m2 < LEAST_M2.max(LEAST_SHARE * largest_m2) {
            break;
        }
        largest_m2 = area_m2.max(largest_m2);
        floors.push(f64::from(bottoms[start.midpoint(end)]));
    }
    floors.sort_unstable_by(f64::total_cmp);
    floors
}
