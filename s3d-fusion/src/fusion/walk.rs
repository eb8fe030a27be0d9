//! The cubes that a segment crosses.

use crate::grid::{Place, SIDE};
use s3d_geom::glam::{DVec3, Vec3};

/// Returns the largest whole numbers that are not above some numbers. Without a call, unlike the library's.
#[inline]
pub(super) fn floor(point: DVec3) -> Place {
    point.to_array().map(|k| {
        let whole = k as i32;
        whole - i32::from(k < f64::from(whole))
    })
}

/// Which unit cubes a segment crosses, for comparison with other segments.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Way {
    first: Place,
    last: Place,
    /// Whether the border along x comes before that along y, y before z, and x before z.
    order: [bool; 3],
}

impl Way {
    #[inline]
    pub(super) fn new([start, end]: [Vec3; 2]) -> Self {
        let floor = |point: Vec3| {
            point.to_array().map(|k| {
                let whole = k as i32;
                whole - i32::from(k < whole as f32)
            })
        };
        let (first, last) = (floor(start), floor(end));
        let [x, y, z] = [0, 1, 2].map(|k| match first[k] == last[k] {
            true => f32::INFINITY,
            false => (first[k].max(last[k]) as f32 - start[k]) / (end[k] - start[k]),
        });
        Self { first, last, order: [x < y, y < z, x < z] }
    }

    /// Whether the segment crosses at most one border on each axis. Then equal ways have the same cubes.
    #[inline]
    pub(super) fn is_short(&self) -> bool {
        (0..3).all(|k| self.first[k].abs_diff(self.last[k]) <= 1)
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
