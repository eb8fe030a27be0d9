//! The cubes that a segment crosses.

use crate::grid::Place;
use s3d_geom::glam::DVec3;

/// Calls `visit` with each unit cube that a segment crosses, from its start to its end. Source: Amanatides and Woo 1987,
/// "A Fast Voxel Traversal Algorithm for Ray Tracing".
pub(super) fn blocks_along([start, end]: [DVec3; 2], mut visit: impl FnMut(Place)) {
    let mut at = start.floor().as_ivec3().to_array();
    let last = end.floor().as_ivec3().to_array();
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
