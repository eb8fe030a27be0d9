//! Where rooms and instances are, in cells.

use glam::Vec3;
use std::collections::HashSet;

/// The width of the squares of a floor plan, metres.
const SQUARE_M: f32 = 0.2;
/// The edge of the cubes of an instance, metres.
const CUBE_M: f32 = 0.05;
/// Rooms of one storey share at least this part of the lower one's height.
const SAME_STOREY: f32 = 0.5;

/// Where a room is.
#[derive(Default)]
pub(super) struct RoomExtent {
    /// The squares that its points stand in. Once it is finished, those at its rim are left out: neighbours
    /// share a wall.
    squares: HashSet<[i32; 2]>,
    /// Its lowest and its highest point.
    heights: Option<[f32; 2]>,
}

impl RoomExtent {
    pub(super) fn add(&mut self, point: Vec3) {
        self.squares
            .insert([point.x, point.y].map(|v| (v / SQUARE_M).floor() as i32));
        let [low, high] = self.heights.unwrap_or([point.z; 2]);
        self.heights = Some([low.min(point.z), high.max(point.z)]);
    }

    /// Leaves out the rim, after all points. A room that is nothing but rim stays whole.
    pub(super) fn finish(&mut self) {
        let is_within = |[x, y]: [i32; 2]| {
            let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y]));
            around.into_iter().all(|square| self.squares.contains(&square))
        };
        let within: HashSet<[i32; 2]> = self.squares.iter().copied().filter(|s| is_within(*s)).collect();
        if !within.is_empty() {
            self.squares = within;
        }
    }

    /// The share of the smaller one's floor plan that lies in the other, on the same storey.
    pub(super) fn share_in(&self, other: &Self) -> f64 {
        let (Some([low_a, high_a]), Some([low_b, high_b])) = (self.heights, other.heights) else {
            return 0.0;
        };
        let shared_m = high_a.min(high_b) - low_a.max(low_b);
        let least_m = (high_a - low_a).min(high_b - low_b);
        if shared_m < SAME_STOREY * least_m {
            return 0.0;
        }
        let (small, large) = by_size(&self.squares, &other.squares);
        small.intersection(large).count() as f64 / small.len().max(1) as f64
    }

    pub(super) fn join(&mut self, other: Self) {
        self.squares.extend(other.squares);
        self.heights = match (self.heights, other.heights) {
            (Some([low, high]), Some([l, h])) => Some([low.min(l), high.max(h)]),
            (one, none) => one.or(none),
        };
    }
}

/// Where an instance is.
#[derive(Default)]
pub(super) struct InstanceExtent(HashSet<[i32; 3]>);

impl InstanceExtent {
    pub(super) fn add(&mut self, point: Vec3) {
        self.0.insert((point / CUBE_M).floor().as_ivec3().to_array());
    }

    /// The shares of the smaller one that are near the other, and that are where the other is. A surface at
    /// the rim of cubes may be in either of two.
    pub(super) fn shares_on(&self, other: &Self) -> [f64; 2] {
        let (small, large) = by_size(&self.0, &other.0);
        let is_near = |[x, y, z]: [i32; 3]| {
            let mut around = (x - 1..=x + 1)
                .flat_map(|x| (y - 1..=y + 1).flat_map(move |y| (z - 1..=z + 1).map(move |z| [x, y, z])));
            around.any(|cube| large.contains(&cube))
        };
        let near = small.iter().filter(|cube| is_near(**cube)).count();
        let on = small.intersection(large).count();
        [near, on].map(|count| count as f64 / small.len().max(1) as f64)
    }

    pub(super) fn join(&mut self, other: Self) {
        self.0.extend(other.0);
    }
}

/// The smaller one of two sets, and the other.
fn by_size<'a, T>(a: &'a HashSet<T>, b: &'a HashSet<T>) -> (&'a HashSet<T>, &'a HashSet<T>) {
    if a.len() <= b.len() { (a, b) } else { (b, a) }
}
