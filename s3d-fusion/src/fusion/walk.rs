//! The cubes that a segment crosses.

use crate::grid::{Place, SIDE};
use crate::lanes::{LANES, Lanes, floor as floor_lane};
use s3d_geom::glam::DVec3;

/// Returns the largest whole numbers that are not above some numbers. Without a call, unlike the library's.
#[inline]
pub(super) fn floor(point: DVec3) -> Place {
    point.to_array().map(|k| {
        let whole = k as i32;
        whole - i32::from(k < f64::from(whole))
    })
}

/// Which unit cubes segments cross, for comparison with other segments.
pub(super) struct Ways {
    /// The first cube of each segment.
    first: [[i32; LANES]; 3],
    /// The step to the last cube, and the order of the borders between; [`LONG`] if a step is above 1.
    steps: [i32; LANES],
}

/// The steps of a segment that crosses several borders on an axis.
const LONG: i32 = -1;

impl Ways {
    /// Makes the ways of segments from the first ends to the second ones.
    #[inline(always)]
    pub(super) fn of([start, end]: &[[Lanes; 3]; 2]) -> Self {
        let (mut first, mut step) = ([[0; LANES]; 3], [[0; LANES]; 3]);
        let mut border = [[0.0; LANES]; 3];
        for axis in 0..3 {
            for lane in 0..LANES {
                let (a, b) = (start[axis][lane], end[axis][lane]);
                let cubes = [floor_lane(a), floor_lane(b)];
                first[axis][lane] = cubes[0];
                step[axis][lane] = cubes[1] - cubes[0];
                border[axis][lane] = (cubes[0].max(cubes[1]) as f32 - a) / (b - a);
            }
        }

        // Which of two borders comes first, if there are two.
        let [x, y, z] = border;
        let order = |a: f32, b: f32, steps: [i32; 2]| {
            i32::from(a < b) & i32::from(steps[0] != 0) & i32::from(steps[1] != 0)
        };
        let mut steps = [0; LANES];
        for lane in 0..LANES {
            let [i, j, k] = [step[0][lane], step[1][lane], step[2][lane]];
            let orders = order(x[lane], y[lane], [i, j])
                | order(y[lane], z[lane], [j, k]) << 1
                | order(x[lane], z[lane], [i, k]) << 2;
            let short = (i + 1) | (j + 1) << 2 | (k + 1) << 4 | orders << 6;
            let is_long = (i.abs() | j.abs() | k.abs()) > 1;
            steps[lane] = short | -i32::from(is_long);
        }
        Self { first, steps }
    }

    /// Returns the way of a segment as numbers. If it is short, segments of equal ways cross the same cubes.
    #[inline(always)]
    pub(super) fn lane(&self, lane: usize) -> [i32; 4] {
        let [x, y, z] = &self.first;
        [x[lane], y[lane], z[lane], self.steps[lane]]
    }

    /// Returns the segments whose way is not that of the one before, or is long, as bits.
    #[inline(always)]
    pub(super) fn changes(&self) -> u32 {
        let [x, y, z] = &self.first;
        let mut changes = 1;
        for lane in 1..LANES {
            let off = |column: &[i32; LANES]| column[lane] ^ column[lane - 1];
            let is_other = off(x) | off(y) | off(z) | off(&self.steps) != 0;
            changes |= u32::from(is_other | (self.steps[lane] == LONG)) << lane;
        }
        changes
    }

    /// Whether a segment crosses at most one border on each axis.
    #[inline(always)]
    pub(super) fn is_short(way: [i32; 4]) -> bool {
        way[3] != LONG
    }
}

/// Calls `visit` with each unit cube that the segments of a short way cross, like [`blocks_along`].
#[inline(always)]
pub(super) fn cubes_of(way: [i32; 4], mut visit: impl FnMut(Place)) {
    let [x, y, z, steps] = way;
    let step = [0, 2, 4].map(|shift| (steps >> shift & 3) - 1);
    let crosses = step.map(|step| step != 0);
    let [xy, yz, xz] = [6, 7, 8].map(|bit| steps >> bit & 1 == 1);
    // Whether an axis comes after the other two.
    let after = [[!xy, !xz], [xy, !yz], [yz, xz]];
    let others = [[1, 2], [0, 2], [1, 0]];
    let mut axes = [0; 3];
    for axis in (0..3).filter(|axis| crosses[*axis]) {
        let rank = |k: usize| usize::from(after[axis][k] & crosses[others[axis][k]]);
        axes[rank(0) + rank(1)] = axis;
    }

    let mut at = [x, y, z];
    visit(at);
    for axis in axes
        .into_iter()
        .take(crosses.into_iter().filter(|crosses| *crosses).count())
    {
        at[axis] += step[axis];
        visit(at);
    }
}

/// Calls `visit` with each unit cube that a segment crosses, from its start to its end. Source: Amanatides
/// and Woo 1987, "A Fast Voxel Traversal Algorithm for Ray Tracing".
pub(super) fn blocks_along([start, end]: [DVec3; 2], mut visit: impl FnMut(Place)) {
    let mut at = floor(start);
    let last = floor(end);
    let way = end - start;
    let step = way.to_array().map(|w| if w > 0.0 { 1 } else { -1 });
    let each = way.to_array().map(|w| (1.0 / w).abs());
    let mut next = [0, 1, 2].map(|k| {
        let border = f64::from(at[k]) + if step[k] > 0 { 1.0 } else { 0.0 };
        if way[k] == 0.0 {
            f64::INFINITY
        } else {
            (border - start[k]) / way[k]
        }
    });

    let count: i64 = [0, 1, 2]
        .map(|k| i64::from(last[k]) - i64::from(at[k]))
        .iter()
        .map(|d| d.abs())
        .sum();
    visit(at);
    for _ in 0..count {
        // Along the axis whose border is next. An axis that has arrived goes no further.
        let left = |k: &usize| at[*k] != last[*k];
        let Some(k) = (0..3).filter(left).min_by(|a, b| next[*a].total_cmp(&next[*b])) else { return };
        at[k] += step[k];
        next[k] += each[k];
        visit(at);
    }
}

/// Calls `visit` with the voxels beside a segment, slice by slice along its main axis, as far as the slices
/// are in a block that starts at `first`. With `around` = 0 it is the nearest voxel of each slice, with the
/// share 1. With 1 they are the four around the segment, with shares that add up to 1.
pub(super) fn slices_along(
    [start, end]: [DVec3; 2],
    first: Place,
    around: i32,
    mut visit: impl FnMut(Place, f32),
) {
    let way = end - start;
    let size = way.abs();
    let main = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let others = [(main + 1) % 3, (main + 2) % 3];
    let (low, high) = (start[main].min(end[main]), start[main].max(end[main]));
    let from = (low.ceil() as i32).max(first[main]);
    let to = (high.ceil() as i32).min(first[main] + SIDE);

    for slice in from..to {
        let at = start + way * ((f64::from(slice) - start[main]) / way[main]);
        let mut voxel = [slice; 3];
        if around == 0 {
            others.iter().for_each(|k| voxel[*k] = at[*k].round() as i32);
            visit(voxel, 1.0);
            continue;
        }
        let low = others.map(|k| at[k].floor());
        let off = [0, 1].map(|k| (at[others[k]] - low[k]) as f32);
        for corner in 0..4 {
            let step = [corner & 1, corner >> 1];
            (0..2).for_each(|k| voxel[others[k]] = low[k] as i32 + step[k]);
            let share = |k: usize| if step[k] == 1 { off[k] } else { 1.0 - off[k] };
            visit(voxel, share(0) * share(1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::dvec3;

    #[test]
    fn segments_of_equal_short_ways_cross_the_same_cubes() {
        let mut state = 3_u64;
        let mut number = |most: f32| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 40) as f32 / (1 << 24) as f32 - 0.5) * 2.0 * most
        };
        let mut cubes_by_way = std::collections::BTreeMap::new();
        let (mut short, mut again) = (0, 0);
        for _ in 0..20_000 {
            let start = [0; 3].map(|_: i32| [0; LANES].map(|_: i32| number(1.5)));
            let end = start.map(|axis| axis.map(|from| from + number(1.2)));
            let ways = Ways::of(&[start, end]);
            for lane in (0..LANES).filter(|lane| Ways::is_short(ways.lane(*lane))) {
                let at =
                    |ends: &[Lanes; 3]| DVec3::from_array([0, 1, 2].map(|k: usize| ends[k][lane].into()));
                let mut cubes = Vec::new();
                blocks_along([at(&start), at(&end)], |cube| cubes.push(cube));
                let mut of_way = Vec::new();
                cubes_of(ways.lane(lane), |cube| of_way.push(cube));
                assert_eq!(of_way, cubes, "{:?}", ways.lane(lane));
                short += 1;
                if let Some(known) = cubes_by_way.insert(ways.lane(lane), cubes.clone()) {
                    again += 1;
                    assert_eq!(known, cubes, "{:?}", ways.lane(lane));
                }
            }
        }
        assert!(short > 100_000 && again > 50_000, "{short} {again}");
    }

    #[test]
    fn all_cubes_of_a_segment_and_no_other() {
        for (a, b) in [
            (dvec3(0.5, 0.5, 0.5), dvec3(3.7, -2.2, 0.9)),
            (dvec3(-1.2, 4.0, 2.0), dvec3(-1.2, 4.0, -3.0)),
            (dvec3(0.1, 0.2, 0.3), dvec3(0.2, 0.2, 0.3)),
        ] {
            let mut walked = Vec::new();
            blocks_along([a, b], |place| walked.push(place));
            let mut sampled: Vec<Place> = (0..=100_000)
                .map(|i| (a + (b - a) * f64::from(i) / 1e5).floor().as_ivec3().to_array())
                .collect();
            sampled.dedup();
            assert_eq!(walked, sampled);
        }
    }
}
