//! Turns about the upright axis, and shifts along it, that make directions of walls and heights of floors
//! agree.

use super::surface::SurfacePoints;
use s3d_geom::glam::Vec3;
use std::f64::consts::TAU;

/// Bins of a whole turn.
const BINS: usize = 720;
/// Normals of walls are at least this level.
const LEVEL: f32 = 0.3;
/// A candidate agrees at least as well as this share of the best, counted from what chance does.
const LEAST_TURN: f64 = 0.2;
const MOST_TURNS: usize = 8;
/// So many of the best turns are also tried with quarters of a turn more.
const QUARTERED: usize = 2;
/// Turns that differ by less are one, radians.
const SAME_RAD: f64 = 0.02;
/// If the best turn is not better than others by this factor, walls tell nothing, and all turns are tried.
const TOLD: f64 = 1.5;
/// The number of turns then.
const ALL_TURNS: usize = 90;

/// The height of a bin, metres.
const STEP_M: f64 = 0.05;
const LEAST_SHIFT: f64 = 0.2;
const MOST_SHIFTS: usize = 8;
/// The most bins of heights: beyond it the points are no building.
const MOST_BINS: usize = 20_000;
/// Steps in which all shifts are tried where neither has floors, metres.
const BLIND_M: f64 = 0.25;
/// The least cosine of a floor's normal with the upright axis.
const FLOOR: f32 = 0.9;

/// Angles by which `a` may be turned, radians, the likeliest first.
pub(super) fn turns(a: &SurfacePoints, b: &SurfacePoints) -> Vec<f64> {
    // Without sides, half a turn changes nothing, and all directions are counted twice.
    let is_two_sided = !(a.has_sides && b.has_sides);
    let [of_a, of_b] = [a, b].map(|s| directions(&s.points.normals, is_two_sided));
    let agreement: Vec<f64> = (0..BINS)
        .map(|turn| (0..BINS).map(|i| of_a[i] * of_b[(i + turn) % BINS]).sum())
        .collect();
    let mean = agreement.iter().sum::<f64>() / BINS as f64;
    let best = agreement.iter().fold(0.0, |best: f64, v| best.max(*v));
    if best <= TOLD * mean {
        return (0..ALL_TURNS).map(|i| i as f64 * TAU / ALL_TURNS as f64).collect();
    }

    let at = |i: usize| agreement[i % BINS] - mean;
    let mut found: Vec<(f64, f64)> = (0..BINS)
        .filter(|&i| at(i) >= LEAST_TURN * (best - mean))
        .filter(|&i| (1..=6).all(|k| at(i) > at(i + k) && at(i) >= at(i + BINS - k)))
        .map(|i| (at(i), (i as f64 + vertex(at(i + BINS - 1), at(i), at(i + 1))) * TAU / BINS as f64))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(MOST_TURNS);

    // Most buildings have walls in four directions, even where one part shows them on one side alone.
    let best: Vec<f64> = found.iter().map(|(_, turn)| *turn).collect();
    let mut turns = best.clone();
    for quarter in 1..4 {
        let more = best
            .iter()
            .take(QUARTERED)
            .map(|turn| (turn + f64::from(quarter) * TAU / 4.0) % TAU);
        for turn in more {
            let between = |other: f64| (turn - other + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
            if turns.iter().all(|other| between(*other).abs() > SAME_RAD) {
                turns.push(turn);
            }
        }
    }
    turns
}

/// How many normals of walls look into each direction.
fn directions(normals: &[Vec3], is_two_sided: bool) -> Vec<f64> {
    let mut counts = vec![0.0; BINS];
    for n in normals.iter().filter(|n| n.z.abs() <= LEVEL) {
        let turn = libm::atan2(f64::from(n.y), f64::from(n.x)) / TAU;
        let bin = ((turn.rem_euclid(1.0) * BINS as f64) as usize).min(BINS - 1);
        counts[bin] += 1.0;
        if is_two_sided {
            counts[(bin + BINS / 2) % BINS] += 1.0;
        }
    }
    smooth_ring(&counts)
}

/// Each value with those around it, in a ring.
fn smooth_ring(values: &[f64]) -> Vec<f64> {
    let weights = [1.0, 0.8, 0.4, 0.1];
    let count = values.len();
    let sum = |i: usize| {
        let sides = (1..4).map(|k| weights[k] * (values[(i + k) % count] + values[(i + count - k) % count]));
        values[i] + sides.sum::<f64>()
    };
    (0..count).map(sum).collect()
}

/// Where the parabola through three values at −1, 0 and 1 is highest; at most half a step away.
pub(super) fn vertex(before: f64, at: f64, after: f64) -> f64 {
    let bend = before - 2.0 * at + after;
    if bend >= 0.0 {
        return 0.0;
    }
    (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
}

/// Shifts of `a` along the upright axis, metres, the likeliest first.
pub(super) fn shifts(a: &SurfacePoints, b: &SurfacePoints) -> Vec<f64> {
    let is_two_sided = !(a.has_sides && b.has_sides);
    let ranges = [a, b].map(|s| {
        let z = || s.points.positions.iter().map(|p| f64::from(p.z));
        [z().fold(f64::INFINITY, f64::min), z().fold(f64::NEG_INFINITY, f64::max)]
    });
    let [low_a, low_b] = ranges.map(|[low, _]| low);
    let counts = ranges.map(|[low, high]| ((high - low) / STEP_M) as usize + 8);
    if counts.iter().any(|count| *count > MOST_BINS) {
        return vec![0.0];
    }
    let [of_a, of_b] = [(a, low_a, counts[0]), (b, low_b, counts[1])]
        .map(|(s, low, count)| heights(s, low, count, is_two_sided));

    // Bin i of `a` on bin i + shift − the last of `a`.
    let total = counts[0] + counts[1];
    let agreement: Vec<f64> = (0..total).map(|shift| agree(&of_a, &of_b, shift)).collect();
    let best = agreement.iter().fold(0.0, |best: f64, v| best.max(*v));
    let shift_m = |at: f64| low_b - low_a + (at - counts[0] as f64) * STEP_M;
    if best <= 0.0 {
        let every = (BLIND_M / STEP_M) as usize;
        return (0..total).step_by(every).map(|at| shift_m(at as f64)).collect();
    }

    let at = |i: usize| agreement.get(i).copied().unwrap_or(0.0);
    let mut found: Vec<(f64, f64)> = (1..total)
        .filter(|&i| at(i) >= LEAST_SHIFT * best && at(i) > at(i + 1) && at(i) >= at(i - 1))
        .map(|i| (at(i), shift_m(i as f64 + vertex(at(i - 1), at(i), at(i + 1)))))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(MOST_SHIFTS);
    found.into_iter().map(|(_, shift)| shift).collect()
}

/// Floors and ceilings by height; ceilings apart, unless sides are unknown.
fn heights(s: &SurfacePoints, low: f64, count: usize, is_two_sided: bool) -> [Vec<f64>; 2] {
    let mut all = [vec![0.0; count], vec![0.0; count]];
    for (p, n) in s.points.positions.iter().zip(&s.points.normals) {
        if n.z.abs() >= FLOOR {
            let kind = usize::from(n.z < 0.0 && !is_two_sided);
            // Shared by two bins.
            let at = (f64::from(p.z) - low) / STEP_M + 2.0;
            let (bin, part) = (at as usize, at.fract());
            all[kind][bin.min(count - 1)] += 1.0 - part;
            all[kind][(bin + 1).min(count - 1)] += part;
        }
    }
    all
}

fn agree(of_a: &[Vec<f64>; 2], of_b: &[Vec<f64>; 2], shift: usize) -> f64 {
    let count = of_a[0].len();
    let mut sum = 0.0;
    for (a, b) in of_a.iter().zip(of_b) {
        let first = count.saturating_sub(shift);
        for (i, value) in a.iter().enumerate().skip(first) {
            // What both have counts: a wide floor does not drown the others.
            let Some(other) = b.get(i + shift - count) else { break };
            sum += value.min(*other);
        }
    }
    sum
}
