//! Boxes fitted to the points in a window, since a window is exact to a step alone.

use crate::detector::boxes::iou_1d;
use crate::detector::surfel::Surfel;
use crate::detector::surfel::index::Index;
use glam::Vec3;
use s3d_geom::Aabb;
use serde::{Deserialize, Serialize};

/// How one axis of a window becomes one of a box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// It stays.
    Window,
    /// The shortest interval that holds this share of the surfels.
    Share(f32),
    /// As long as things of its size are, where it holds most surfels: walls, floors, what is thin.
    Densest,
}

/// What is tried.
pub const FITS: [Fit; 7] = [
    Fit::Share(1.0),
    Fit::Share(0.98),
    Fit::Share(0.95),
    Fit::Share(0.9),
    Fit::Share(0.8),
    Fit::Densest,
    Fit::Window,
];

/// How far beyond a window its surfels may lie, in metres.
const BEYOND_M: f32 = 0.05;
/// Bins in which surfels are counted, in metres.
const BIN_M: f32 = 0.01;
/// Surfels on a thin thing lie so near to its middle, in metres.
const THIN_M: f32 = 0.025;

/// The box of a window's surfels. Axes that are [`Fit::Densest`] come first, and the surfels outside of their
/// interval do not count for the others. `None` if the window holds no surfel.
pub fn fit(index: &Index, window: &Aabb, size: Vec3, fits: [Fit; 3]) -> Option<Aabb> {
    let grown = Aabb { min: window.min - BEYOND_M, max: window.max + BEYOND_M };
    let mut surfels: Vec<&Surfel> = index.within(&grown).collect();
    let mut out = *window;
    for (axis, how) in fits.into_iter().enumerate() {
        if how == Fit::Densest {
            let [low, high] = densest(&surfels, &grown, axis, size[axis])?;
            (out.min[axis], out.max[axis]) = (low, high);
            let slack = (THIN_M - 0.5 * size[axis]).max(0.0);
            surfels.retain(|s| s.position[axis] >= low - slack && s.position[axis] <= high + slack);
        }
    }
    for (axis, how) in fits.into_iter().enumerate() {
        if let Fit::Share(share) = how {
            let [low, high] = shortest(&surfels, &grown, axis, share)?;
            (out.min[axis], out.max[axis]) = (low, high);
        }
    }
    if surfels.is_empty() { None } else { Some(out) }
}

fn histogram(surfels: &[&Surfel], grown: &Aabb, axis: usize) -> Vec<u32> {
    let bin = |x: f32| ((x - grown.min[axis]) / BIN_M).max(0.0) as usize;
    let mut counts = vec![0; bin(grown.max[axis]) + 1];
    surfels.iter().for_each(|s| counts[bin(s.position[axis])] += 1);
    counts
}

/// The interval of a length in which most surfels lie, about their mean.
fn densest(surfels: &[&Surfel], grown: &Aabb, axis: usize, length: f32) -> Option<[f32; 2]> {
    let counts = histogram(surfels, grown, axis);
    let bins = ((length / BIN_M).ceil() as usize).clamp(1, counts.len());
    let mut inside: u32 = counts[..bins].iter().sum();
    let (mut most, mut best) = (inside, 0);
    for start in 1..=counts.len() - bins {
        inside = inside + counts[start + bins - 1] - counts[start - 1];
        if inside > most {
            (most, best) = (inside, start);
        }
    }
    // A plane may lie on the border of two bins.
    let low = grown.min[axis] + (best as f32 - 0.5) * BIN_M;
    let high = low + (bins + 1) as f32 * BIN_M;
    let within = surfels.iter().filter(|s| s.position[axis] >= low && s.position[axis] <= high);
    let ends = within.fold(Aabb::EMPTY, |b, s| b.union(s.extent));
    if ends.is_empty() {
        return None;
    }
    let thin = length <= 2.0 * THIN_M;
    let middle = if thin {
        let near: Vec<f64> = surfels
            .iter()
            .map(|s| s.position[axis])
            .filter(|x| *x >= low && *x <= high)
            .map(f64::from)
            .collect();
        (near.iter().sum::<f64>() / near.len() as f64) as f32
    } else {
        0.5 * (ends.min[axis] + ends.max[axis])
    };
    Some([middle - 0.5 * length, middle + 0.5 * length])
}

/// The shortest interval that holds a share of the surfels, to the ends of what they stand for.
fn shortest(surfels: &[&Surfel], grown: &Aabb, axis: usize, share: f32) -> Option<[f32; 2]> {
    let counts = histogram(surfels, grown, axis);
    let wanted = (share * surfels.len() as f32).ceil().max(1.0) as u32;
    let (mut inside, mut start) = (0, 0);
    let mut best: Option<[usize; 2]> = None;
    for (end, count) in counts.iter().enumerate() {
        inside += count;
        while inside >= wanted && inside - counts[start] >= wanted {
            inside -= counts[start];
            start += 1;
        }
        if inside >= wanted && best.is_none_or(|[a, b]| end - start < b - a) {
            best = Some([start, end]);
        }
    }
    let [start, end] = best?;
    let (low, high) = (grown.min[axis] + start as f32 * BIN_M, grown.min[axis] + (end + 1) as f32 * BIN_M);
    let within = surfels.iter().filter(|s| s.position[axis] >= low && s.position[axis] <= high);
    let ends = within.fold(Aabb::EMPTY, |b, s| b.union(s.extent));
    if ends.is_empty() { None } else { Some([ends.min[axis], ends.max[axis]]) }
}

/// For each axis what brings windows nearest to the boxes that they are for, by mean overlap on that axis:
/// axes that are best fitted by [`Fit::Densest`] are found first. `examples` have an index, a window and a
/// box each.
pub fn learn(examples: &[(&Index, Aabb, Aabb)], size: Vec3) -> [Fit; 3] {
    let mut fits = [Fit::Share(1.0); 3];
    for _ in 0..2 {
        for axis in 0..3 {
            let mut best = f32::NEG_INFINITY;
            let before = fits;
            for candidate in FITS {
                let mut tried = before;
                tried[axis] = candidate;
                let overlap = |(index, window, truth): &(&Index, Aabb, Aabb)| {
                    fit(index, window, size, tried).map_or(0.0, |b| {
                        iou_1d([b.min[axis], b.max[axis]], [truth.min[axis], truth.max[axis]])
                    })
                };
                let total: f32 = examples.iter().map(overlap).sum();
                if total > best {
                    best = total;
                    fits[axis] = candidate;
                }
            }
        }
    }
    fits
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    /// A wall at y = 1 with a floor before it and a box on the floor.
    fn room() -> Index {
        let mut surfels = Vec::new();
        let mut add = |position: Vec3| {
            let extent = Aabb { min: position - 0.02, max: position + 0.02 };
            surfels.push(Surfel {
                position,
                extent,
                normal: Vec3::Z,
                curvature: 0.0,
                color: Vec3::ZERO,
                room: 0,
            });
        };
        for i in 0..80 {
            for j in 0..50 {
                add(vec3(0.025 + 0.05 * i as f32, 1.0, 0.025 + 0.05 * j as f32));
            }
            for j in 0..20 {
                add(vec3(0.025 + 0.05 * i as f32, 0.025 + 0.05 * j as f32, 0.0));
            }
        }
        Index::new(surfels)
    }

    #[test]
    fn a_thin_thing_is_found_where_its_points_are() {
        let window = Aabb { min: vec3(0.0, 0.85, 0.0), max: vec3(4.0, 1.05, 2.5) };
        let truth = Aabb { min: vec3(0.0, 0.995, 0.0), max: vec3(4.0, 1.005, 2.5) };
        let size = truth.size();
        let index = room();
        let fits = learn(&[(&index, window, truth)], size);
        assert_eq!(fits[1], Fit::Densest);
        let found = fit(&index, &window, size, fits).unwrap();
        assert!(crate::detector::boxes::iou(&found, &truth) > 0.9, "{found:?}");
        let nowhere = Aabb { min: vec3(8.0, 8.0, 8.0), max: vec3(9.0, 9.0, 9.0) };
        assert_eq!(fit(&index, &nowhere, size, fits), None);
        assert_eq!(fit(&index, &nowhere, size, [Fit::Window; 3]), None);
    }
}
