//! Windows that slide in steps of 0.1 m, and their linear scores from summed volumes.
//!
//! The features of a window are the shares of cells with surfaces of three directions in 4×4×4 parts, which
//! are 2×2×2 parts of the window and the 0.2 m around it; and its heights above the floor and below the
//! ceiling.

use crate::surfel::volume::{DIRECTIONS, STEP_M, Volumes};
use crate::svm::Linear;
use glam::{IVec3, Vec3, ivec3};
use s3d_geom::Aabb;

/// How far the features of a window reach around it, in cells.
const AROUND: i32 = 2;
/// The number of parts along an axis.
const PARTS: usize = 4;
/// The number of corners of parts along an axis.
const CORNERS: usize = PARTS + 1;
/// The number of bins of heights.
const HEIGHTS: usize = 16;
/// The width of a bin of heights, in cells: 0.2 m.
const CELLS_A_HEIGHT: i32 = 2;

/// The number of features of a window.
pub const WINDOW_FEATURES: usize = DIRECTIONS * PARTS * PARTS * PARTS + 2 * HEIGHTS;

/// A window, in cells from the origin of the space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Its least corner.
    pub corner: IVec3,
    /// Its size.
    pub cells: IVec3,
}

impl Window {
    /// Places a window of this size with its middle nearest to the middle of a box, within its [`reach`].
    pub fn around(b: &Aabb, cells: IVec3, volumes: &Volumes) -> Self {
        let corner = (b.center() / STEP_M - cells.as_vec3() * 0.5).round().as_ivec3();
        let [least, most] = reach(volumes, cells);
        Self { corner: corner.clamp(least, most), cells }
    }

    /// Its box in metres.
    pub fn bbox(&self) -> Aabb {
        Aabb { min: self.corner.as_vec3() * STEP_M, max: (self.corner + self.cells).as_vec3() * STEP_M }
    }
}

/// Returns the size of windows, in cells, for things of a size in metres: at least two cells, and no more
/// than the space has.
pub fn window_cells(size: Vec3, volumes: &Volumes) -> IVec3 {
    (size / STEP_M)
        .round()
        .as_ivec3()
        .max(IVec3::splat(2))
        .min(volumes.cells.max(IVec3::splat(2)))
}

/// Returns the least and the largest corner of windows of a size. Windows reach out of the space by one cell
/// at most.
pub fn reach(volumes: &Volumes, cells: IVec3) -> [IVec3; 2] {
    [IVec3::splat(-1), (volumes.cells - cells + 1).max(IVec3::splat(-1))]
}

/// Returns the corners of the parts along an axis, from the corner of the window.
fn lattice(cells: i32) -> [i32; CORNERS] {
    [-AROUND, 0, cells / 2, cells, cells + AROUND]
}

/// Returns the factor that makes a share of the count of a part: a surface through it has about as many
/// cells.
fn scale(from: IVec3, to: IVec3) -> f32 {
    let volume = (to - from).max(IVec3::ONE).as_vec3().element_product();
    1.0 / libm::cbrtf(volume * volume)
}

/// Returns the bins of the heights above the floor and below the ceiling.
fn heights(w: &Window, volumes: &Volumes) -> [usize; 2] {
    [height_bin(w.corner.z), HEIGHTS + height_bin(volumes.cells.z - w.corner.z - w.cells.z)]
}

fn height_bin(cells: i32) -> usize {
    (cells.max(0) / CELLS_A_HEIGHT).min(HEIGHTS as i32 - 1) as usize
}

/// Returns the features of a window: its parts by direction, then z, y, x; then its heights.
pub fn window_features(volumes: &Volumes, w: &Window) -> Vec<f32> {
    let mut out = vec![0.0; WINDOW_FEATURES];
    let [x, y, z] = w.cells.to_array().map(lattice);
    for (i, value) in out.iter_mut().take(DIRECTIONS * PARTS * PARTS * PARTS).enumerate() {
        let [direction, c, b, a] = [i / 64, i / 16 % 4, i / 4 % 4, i % 4];
        let from = ivec3(x[a], y[b], z[c]);
        let to = ivec3(x[a + 1], y[b + 1], z[c + 1]);
        *value = volumes.count(direction, w.corner + from, w.corner + to) * scale(from, to);
    }
    for bin in heights(w, volumes) {
        out[DIRECTIONS * PARTS * PARTS * PARTS + bin] = 1.0;
    }
    out
}

/// Returns the weight of each corner of the lattice in the score: direction, corner and weight. The weight of
/// a part counts at its eight corners.
fn corner_weights(machine: &Linear, cells: IVec3) -> Vec<(usize, [i32; 3], f32)> {
    let [x, y, z] = cells.to_array().map(lattice);
    let mut weights = Vec::new();
    for direction in 0..DIRECTIONS {
        let mut of = [0.0f32; CORNERS * CORNERS * CORNERS];
        for part in 0..PARTS * PARTS * PARTS {
            let [c, b, a] = [part / 16, part / 4 % 4, part % 4];
            let from = ivec3(x[a], y[b], z[c]);
            let to = ivec3(x[a + 1], y[b + 1], z[c + 1]);
            let weight = machine.weights[direction * 64 + part] as f32 * scale(from, to);
            for corner in 0..8usize {
                let [i, j, k] = [a + (corner & 1), b + (corner >> 1 & 1), c + (corner >> 2)];
                let sign = if corner.count_ones() % 2 == 1 { 1.0 } else { -1.0 };
                of[(k * CORNERS + j) * CORNERS + i] += sign * weight;
            }
        }

        for (place, &weight) in of.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            let [k, j, i] = [place / (CORNERS * CORNERS), place / CORNERS % CORNERS, place % CORNERS];
            weights.push((direction, [x[i], y[j], z[k]], weight));
        }
    }
    weights
}

/// Scores all windows of a size whose bottoms are within `bottom` metres above the origin. Returns the `most`
/// highest that no neighbour, one step away along any axes, beats: the highest score first.
pub fn best_windows(
    volumes: &Volumes,
    machine: &Linear,
    cells: IVec3,
    bottom: [f32; 2],
    most: usize,
) -> Vec<(Window, f32)> {
    let [mut least, mut last] = reach(volumes, cells);
    least.z = least.z.max((bottom[0] / STEP_M).floor() as i32);
    last.z = last.z.min((bottom[1] / STEP_M).ceil() as i32);
    let count = last - least + 1;
    if count.cmple(IVec3::ZERO).any() {
        return Vec::new();
    }

    let scores = score_map(volumes, machine, cells, least, count);
    let [nx, ny, nz] = count.to_array().map(|n| n as usize);
    let mut found: Vec<(Window, f32)> = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let score = scores[(z * ny + y) * nx + x];
                if !is_beaten(&scores, [nx, ny, nz], [x, y, z]) {
                    let corner = least + ivec3(x as i32, y as i32, z as i32);
                    found.push((Window { corner, cells }, score));
                }
            }
        }
    }

    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found.truncate(most);
    found
}

/// Whether a window at `place` has a neighbour that scores more, or that scores as much and comes first.
fn is_beaten(scores: &[f32], [nx, ny, nz]: [usize; 3], place: [usize; 3]) -> bool {
    let [x, y, z] = place;
    let score = scores[(z * ny + y) * nx + x];
    for k in around(z, nz) {
        for j in around(y, ny) {
            for i in around(x, nx) {
                let other = scores[(k * ny + j) * nx + i];
                if other > score || (other == score && (k, j, i) < (z, y, x)) {
                    return true;
                }
            }
        }
    }
    false
}

fn around(i: usize, n: usize) -> std::ops::Range<usize> {
    i.saturating_sub(1)..(i + 2).min(n)
}

/// Returns the scores of `count` windows along each axis, from corner `least` on, with x fastest.
fn score_map(volumes: &Volumes, machine: &Linear, cells: IVec3, least: IVec3, count: IVec3) -> Vec<f32> {
    let weights = corner_weights(machine, cells);
    let [nx, ny] = [count.x as usize, count.y as usize];
    let mut scores = vec![0.0f32; nx * ny * count.z as usize];
    for (row, scores) in scores.chunks_exact_mut(nx).enumerate() {
        let corner = least + ivec3(0, (row % ny) as i32, (row / ny) as i32);
        let [low, high] = heights(&Window { corner, cells }, volumes);
        let of_height = |bin: usize| machine.weights[DIRECTIONS * 64 + bin];
        scores.fill((machine.bias + of_height(low) + of_height(high)) as f32);
        for &(direction, [x, y, z], weight) in &weights {
            debug_assert!(volumes.holds(corner + ivec3(x, y, z)));
            let run = volumes.run(direction, [corner.x + x, corner.y + y, corner.z + z], nx);
            scores
                .iter_mut()
                .zip(run)
                .for_each(|(score, &sum)| *score += weight * sum);
        }
    }
    scores
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfel::Surfel;
    use glam::vec3;

    #[test]
    fn maps_hold_the_scores_of_single_windows() {
        let surfels: Vec<Surfel> = (0..600u32)
            .map(|i| {
                let r = |k: u32| (i.wrapping_mul(k) % 997) as f32 / 997.0;
                let position = vec3(2.3 * r(7919), 1.6 * r(104_729), 1.9 * r(1_299_709));
                let extent = Aabb { min: position, max: position };
                let normal = [Vec3::X, Vec3::Y, Vec3::Z][i as usize % 3];
                Surfel { position, extent, normal, curvature: 0.0, color: Vec3::ZERO, room: 0 }
            })
            .collect();
        let volumes = Volumes::new(&surfels, vec3(2.3, 1.6, 1.9));
        let weights = (0..WINDOW_FEATURES)
            .map(|i| f64::from(i as u32 * 37 % 101) / 50.0 - 1.0)
            .collect();
        let machine = Linear { weights, bias: 0.25 };

        for cells in [ivec3(5, 4, 3), ivec3(2, 16, 19), ivec3(23, 2, 2)] {
            let [least, last] = reach(&volumes, cells);
            let scores = score_map(&volumes, &machine, cells, least, last - least + 1);
            let mut i = 0;
            for z in least.z..=last.z {
                for y in least.y..=last.y {
                    for x in least.x..=last.x {
                        let row = window_features(&volumes, &Window { corner: ivec3(x, y, z), cells });
                        let plain = machine.bias
                            + row
                                .iter()
                                .zip(&machine.weights)
                                .map(|(&v, w)| f64::from(v) * w)
                                .sum::<f64>();
                        assert!(
                            (f64::from(scores[i]) - plain).abs() < 2e-3,
                            "{x} {y} {z}: {} {plain}",
                            scores[i]
                        );
                        i += 1;
                    }
                }
            }
            assert_eq!(i, scores.len());

            let best = best_windows(&volumes, &machine, cells, [-1.0, 9.0], 3);
            let top = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            assert_eq!(best[0].1, top);
        }
    }
}
