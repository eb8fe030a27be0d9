//! Scales that make heights of rooms agree.

use super::surface::SurfacePoints;

/// The least cosine of a floor's normal with the upright axis.
const LEVEL: f32 = 0.9;
/// The heights of a surface are counted in so many bins.
const BINS: usize = 400;
/// So many floors, and ceilings, are looked at.
const MOST_LEVELS: usize = 3;
/// The most scales.
const MOST_SCALES: usize = 8;
/// Scales that differ by less are one.
const SAME: f64 = 0.015;

/// Scales of `a`, the likeliest first. None if a surface has not both floors and ceilings.
pub(super) fn scales(a: &SurfacePoints, b: &SurfacePoints) -> Vec<f64> {
    let [rooms_a, rooms_b] = [a, b].map(rooms);
    let mut all: Vec<(f64, f64)> = rooms_a
        .iter()
        .flat_map(|(weight_a, height_a)| {
            let of = move |(weight_b, height_b): &(f64, f64)| (weight_a * weight_b, height_b / height_a);
            rooms_b.iter().map(of)
        })
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut scales: Vec<f64> = Vec::new();
    for (_, scale) in all {
        if scales.len() < MOST_SCALES && scales.iter().all(|s| (s / scale - 1.0).abs() > SAME) {
            scales.push(scale);
        }
    }
    scales
}

/// The distances from floors to level surfaces above them, each with its weight, 0 to 1.
fn rooms(surface: &SurfacePoints) -> Vec<(f64, f64)> {
    let heights = |is_up: bool| -> Vec<f64> {
        let all = surface.points.positions.iter().zip(&surface.points.normals);
        let fits = |z: f32| z.abs() >= LEVEL && (!surface.has_sides || (z > 0.0) == is_up);
        all.filter(|(_, n)| fits(n.z)).map(|(p, _)| f64::from(p.z)).collect()
    };
    let [floors, ceilings] = [true, false].map(|is_up| levels(heights(is_up)));
    let mut rooms = Vec::new();
    for (weight, floor) in &floors {
        for (other, ceiling) in ceilings.iter().filter(|(_, ceiling)| *ceiling > *floor) {
            rooms.push((weight * other, ceiling - floor));
        }
    }
    rooms
}

/// The heights at which most of the points lie, with their shares of the fullest.
fn levels(mut heights: Vec<f64>) -> Vec<(f64, f64)> {
    let range = |heights: &[f64]| {
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
        (low, heights.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low)
    };
    let (low, high) = range(&heights);
    let step = high.max(1e-6) / BINS as f64;
    let mut found: Vec<(f64, f64)> = Vec::new();
    while found.len() < MOST_LEVELS && !heights.is_empty() {
        let mut counts = vec![0.0; BINS + 1];
        for height in &heights {
            counts[(((height - low) / step) as usize).min(BINS)] += 1.0;
        }
        let fullest = (0..=BINS).reduce(|best, next| if counts[next] > counts[best] { next } else { best });
        let middle = low + (fullest.unwrap_or(0) as f64 + 0.5) * step;
        let near: Vec<f64> = heights
            .iter()
            .copied()
            .filter(|h| (h - middle).abs() <= 1.5 * step)
            .collect();
        if near.is_empty() {
            break;
        }
        found.push((near.len() as f64, near.iter().sum::<f64>() / near.len() as f64));
        heights.retain(|h| (h - middle).abs() > 6.0 * step);
    }
    let most = found.iter().fold(0.0, |most: f64, (count, _)| most.max(*count));
    found
        .into_iter()
        .map(|(count, height)| (count / most, height))
        .collect()
}
