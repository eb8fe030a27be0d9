//! Fits boxes to the points in a window, since a window is exact to one step only.

use crate::boxes::iou_1d;
use crate::surfel::Surfel;
use crate::surfel::index::Index;
use glam::Vec3;
use s3d_geom::Aabb;
use serde::{Deserialize, Serialize};

/// How one axis of a window becomes one of a box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// It stays as it is.
    Window,
    /// The shortest interval that holds this share of the surfels.
    Share(f32),
    /// An interval as long as things of its size, where it holds most surfels: walls, floors and other thin
    /// things.
    Densest,
    /// The longest run without a gap: things at a distance from their neighbours.
    Run,
    /// The layer before the plane around the window, up to this distance in metres: boards on walls.
    Front(f32),
}

/// The fits that [`learn`] tries.
pub const FITS: [Fit; 10] = [
    Fit::Share(1.0),
    Fit::Share(0.98),
    Fit::Share(0.95),
    Fit::Share(0.9),
    Fit::Share(0.8),
    Fit::Densest,
    Fit::Run,
    Fit::Front(0.06),
    Fit::Front(0.13),
    Fit::Window,
];

/// How far beyond a window its surfels may lie, in metres.
const BEYOND_M: f32 = 0.05;
/// The width of the bins that count surfels, in metres.
const BIN_M: f32 = 0.01;
/// Surfels on a thin thing are at most this far from its middle, in metres.
const THIN_M: f32 = 0.025;
/// The longest gap in a run, in bins: less than the width of the cell of a surfel.
const GAP_BINS: usize = 4;
/// How far around the window to look for the plane of [`Fit::Front`], in metres.
const AROUND_M: f32 = 0.2;
/// Surfels nearer to a plane than this, in metres, belong to it.
const OF_PLANE_M: f32 = 0.01;

/// Fits a box to the surfels in a window, in the frame of the space, in metres. [`Fit::Densest`] axes come
/// first, then [`Fit::Front`] axes; surfels outside of their intervals do not count for the other axes.
/// Returns `None` if the window holds no surfel, or no plane.
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
        if let Fit::Front(layer) = how {
            let [low, high] = front(index, &surfels, &grown, axis, layer)?;
            (out.min[axis], out.max[axis]) = (low, high);
            surfels.retain(|s| s.position[axis] >= low && s.position[axis] <= high);
        }
    }

    for (axis, how) in fits.into_iter().enumerate() {
        let [low, high] = match how {
            Fit::Share(share) => shortest(&surfels, &grown, axis, share)?,
            Fit::Run => run(&surfels, &grown, axis)?,
            Fit::Window | Fit::Densest | Fit::Front(_) => continue,
        };
        (out.min[axis], out.max[axis]) = (low, high);
    }

    if surfels.is_empty() { None } else { Some(out) }
}

/// Counts the surfels along an axis.
fn histogram(surfels: &[&Surfel], grown: &Aabb, axis: usize) -> Vec<u32> {
    let mut counts = vec![0; bin_of(grown.max[axis], grown.min[axis]) + 1];
    surfels
        .iter()
        .for_each(|s| counts[bin_of(s.position[axis], grown.min[axis])] += 1);
    counts
}

fn bin_of(x: f32, origin: f32) -> usize {
    ((x - origin) / BIN_M).max(0.0) as usize
}

/// Returns the ends of the surfels whose positions are in an interval along an axis; `None` if there are
/// none.
fn ends_within(surfels: &[&Surfel], axis: usize, [low, high]: [f32; 2]) -> Option<[f32; 2]> {
    let within = surfels
        .iter()
        .filter(|s| s.position[axis] >= low && s.position[axis] <= high);
    let ends = within.fold(Aabb::EMPTY, |b, s| b.union(s.extent));
    (!ends.is_empty()).then(|| [ends.min[axis], ends.max[axis]])
}

/// Returns the interval of a length that holds most surfels, about their mean.
fn densest(surfels: &[&Surfel], grown: &Aabb, axis: usize, length: f32) -> Option<[f32; 2]> {
    let counts = histogram(surfels, grown, axis);
    let bins = ((length / BIN_M).ceil() as usize).clamp(1, counts.len());
    let mut inside: u32 = counts[..bins].iter().sum();
    let mut most = inside;
    let mut best = 0;
    for start in 1..=counts.len() - bins {
        inside = inside + counts[start + bins - 1] - counts[start - 1];
        if inside > most {
            most = inside;
            best = start;
        }
    }

    // A plane may lie on the border of two bins.
    let low = grown.min[axis] + (best as f32 - 0.5) * BIN_M;
    let high = low + (bins + 1) as f32 * BIN_M;
    let [first, last] = ends_within(surfels, axis, [low, high])?;
    let is_thin = length <= 2.0 * THIN_M;
    let middle = if is_thin {
        let near: Vec<f64> = surfels
            .iter()
            .map(|s| s.position[axis])
            .filter(|x| *x >= low && *x <= high)
            .map(f64::from)
            .collect();
        (near.iter().sum::<f64>() / near.len() as f64) as f32
    } else {
        0.5 * (first + last)
    };
    Some([middle - 0.5 * length, middle + 0.5 * length])
}

/// Returns the shortest interval that holds a share of the surfels, up to the ends of their extents.
fn shortest(surfels: &[&Surfel], grown: &Aabb, axis: usize, share: f32) -> Option<[f32; 2]> {
    let counts = histogram(surfels, grown, axis);
    let wanted = (share * surfels.len() as f32).ceil().max(1.0) as u32;

    let mut inside = 0;
    let mut start = 0;
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
    let low = grown.min[axis] + start as f32 * BIN_M;
    let high = grown.min[axis] + (end + 1) as f32 * BIN_M;
    ends_within(surfels, axis, [low, high])
}

/// Returns the longest run of bins that surfels reach into, up to the ends of their extents. The first run
/// wins a tie.
fn run(surfels: &[&Surfel], grown: &Aabb, axis: usize) -> Option<[f32; 2]> {
    let origin = grown.min[axis];
    let mut covered = vec![false; bin_of(grown.max[axis], origin) + 1];
    for s in surfels {
        let last = bin_of(s.extent.max[axis], origin).min(covered.len() - 1);
        covered[bin_of(s.extent.min[axis], origin).min(last)..=last].fill(true);
    }

    let mut best: Option<[usize; 2]> = None;
    let mut now: Option<[usize; 2]> = None;
    for at in (0..covered.len()).filter(|&i| covered[i]) {
        let start = now
            .filter(|[_, end]| at - end <= GAP_BINS + 1)
            .map_or(at, |[start, _]| start);
        now = Some([start, at]);
        if best.is_none_or(|[a, b]| at - start > b - a) {
            best = now;
        }
    }

    let [start, end] = best?;
    let low = grown.min[axis] + start as f32 * BIN_M;
    let high = grown.min[axis] + (end + 1) as f32 * BIN_M;
    ends_within(surfels, axis, [low, high])
}

/// Returns the interval from the near side of a plane to the end of the surfels before it, at most `layer`
/// metres from it. The plane is the densest one of the surfels around the window. Before it is the side with
/// most of the surfels in the window.
fn front(index: &Index, surfels: &[&Surfel], grown: &Aabb, axis: usize, layer: f32) -> Option<[f32; 2]> {
    let mut wide = Aabb { min: grown.min - AROUND_M, max: grown.max + AROUND_M };
    (wide.min[axis], wide.max[axis]) = (grown.min[axis], grown.max[axis]);
    let around: Vec<&Surfel> = index.within(&wide).filter(|s| !grown.contains(s.position)).collect();
    let [low, high] = densest(&around, &wide, axis, OF_PLANE_M)?;
    let plane = 0.5 * (low + high);

    let off = |s: &&&Surfel| {
        let off = s.position[axis] - plane;
        (OF_PLANE_M..=layer).contains(&off.abs()).then_some(off)
    };
    let above = surfels
        .iter()
        .filter_map(|s| off(&s))
        .fold(0i64, |sum, off| sum + off.signum() as i64);
    let before = surfels
        .iter()
        .filter(|s| off(s).is_some_and(|o| (o > 0.0) == (above > 0)));
    let ends = before.fold(Aabb::EMPTY, |b, s| b.union(s.extent));
    if above == 0 || ends.is_empty() {
        return None;
    }

    Some(if above > 0 {
        [plane + OF_PLANE_M, ends.max[axis].min(plane + layer)]
    } else {
        [ends.min[axis].max(plane - layer), plane - OF_PLANE_M]
    })
}

/// Returns the fit of each axis that brings windows nearest to their true boxes, by the mean overlap along
/// this axis. Each axis is chosen twice, so that the second time knows the others. `examples` have an index,
/// a window and a true box each.
pub fn learn(examples: &[(&Index, Aabb, Aabb)], size: Vec3) -> [Fit; 3] {
    let mut fits = [Fit::Share(1.0); 3];
    for _ in 0..2 {
        for axis in 0..3 {
            let mut best = f32::NEG_INFINITY;
            let before = fits;
            for candidate in FITS {
                let mut tried = before;
                tried[axis] = candidate;
                let total: f32 = examples
                    .iter()
                    .map(|(index, window, truth)| {
                        fit(index, window, size, tried).map_or(0.0, |b| {
                            iou_1d([b.min[axis], b.max[axis]], [truth.min[axis], truth.max[axis]])
                        })
                    })
                    .sum();
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

    fn surfel_at(position: Vec3) -> Surfel {
        let extent = Aabb { min: position - 0.02, max: position + 0.02 };
        Surfel { position, extent, normal: Vec3::Z, curvature: 0.0, color: Vec3::ZERO, room: 0 }
    }

    /// Makes a wall at y = 1 with a floor before it.
    fn room() -> Index {
        let mut surfels = Vec::new();
        for i in 0..80 {
            for j in 0..50 {
                surfels.push(surfel_at(vec3(0.025 + 0.05 * i as f32, 1.0, 0.025 + 0.05 * j as f32)));
            }
            for j in 0..20 {
                surfels.push(surfel_at(vec3(0.025 + 0.05 * i as f32, 0.025 + 0.05 * j as f32, 0.0)));
            }
        }
        Index::new(surfels)
    }

    fn is_hidden(p: Vec3) -> bool {
        p.y > 0.99 && (1.0..3.0).contains(&p.x) && (1.0..2.0).contains(&p.z)
    }

    #[test]
    fn fits_find_thin_things_boards_and_runs() {
        let window = Aabb { min: vec3(0.0, 0.85, 0.0), max: vec3(4.0, 1.05, 2.5) };
        let truth = Aabb { min: vec3(0.0, 0.995, 0.0), max: vec3(4.0, 1.005, 2.5) };
        let size = truth.size();
        let index = room();
        let fits = learn(&[(&index, window, truth)], size);
        assert_eq!(fits[1], Fit::Densest);
        let found = fit(&index, &window, size, fits).unwrap();
        assert!(crate::boxes::iou(&found, &truth) > 0.9, "{found:?}");

        // A board of 2.5 cm, 1 cm off the wall, whose edges are not seen: the wall tells where its back is.
        let mut surfels = index.surfels().to_vec();
        let hidden: Vec<Surfel> = surfels.iter().filter(|s| is_hidden(s.position)).copied().collect();
        surfels.retain(|s| !is_hidden(s.position));
        surfels.extend(hidden.iter().map(|s| {
            let position = s.position.with_y(0.965);
            let half = vec3(0.02, 0.001, 0.02);
            Surfel { position, extent: Aabb { min: position - half, max: position + half }, ..*s }
        }));
        let truth = Aabb { min: vec3(1.005, 0.964, 1.005), max: vec3(2.995, 0.99, 1.995) };
        let window = Aabb { min: vec3(0.9, 0.9, 1.0), max: vec3(2.9, 1.1, 2.0) };
        let index = Index::new(surfels);
        let fits = learn(&[(&index, window, truth)], truth.size());
        assert!(matches!(fits[1], Fit::Front(_)), "{fits:?}");
        let found = fit(&index, &window, truth.size(), fits).unwrap();
        assert!(crate::boxes::iou(&found, &truth) > 0.85, "{found:?} {fits:?}");

        // A run ends at a gap.
        let some: Vec<&Surfel> = [0.1, 0.15, 0.2, 0.4, 0.45]
            .into_iter()
            .filter_map(|x| {
                index
                    .surfels()
                    .iter()
                    .find(|s| s.position.z == 0.0 && (s.position.x - x).abs() < 0.03)
            })
            .collect();
        let found = run(&some, &Aabb { min: Vec3::ZERO, max: Vec3::ONE }, 0).unwrap();
        assert!((found[1] - found[0] - 0.14).abs() < 0.02 && found[1] < 0.3, "{found:?}");

        let nowhere = Aabb { min: vec3(8.0, 8.0, 8.0), max: vec3(9.0, 9.0, 9.0) };
        assert_eq!(fit(&index, &nowhere, size, fits), None);
        assert_eq!(fit(&index, &nowhere, size, [Fit::Window; 3]), None);
    }
}
