//! Rooms of a storey: its free space, cut at doors.

use super::distance::distances;
use super::scan::Scan;
use super::storey::Storey;
use s3d_geom::DisjointSets;

/// Half of the width of the widest door without a lintel, metres.
const WIDEST_DOOR_M: f64 = 0.68;

/// A passage is a door if it is narrower than this share of the widest place on either side.
const NARROW: f64 = 0.75;

/// A room has a place this far from all walls, metres.
const LEAST_RADIUS_M: f64 = 0.35;

/// No part of a room is narrower than twice this, metres.
const CORE_M: f64 = 0.2;

/// The size of the smallest room, m².
const LEAST_M2: f64 = 0.9;

/// The least share of a room's cells that have a floor.
const LEAST_FLOOR: f64 = 0.3;

/// The least share of the rim of a room without a ceiling that walls take.
const LEAST_WALLS: f64 = 0.3;

/// Returns the room of each cell, from 1, or 0; and the number of rooms.
///
/// Free space is flooded from its widest places outwards, as watersheds of the distance to the nearest wall
/// are (Vincent and Soille, "Watersheds in digital spaces", 1991; for rooms, Bormann et al., "Room
/// segmentation: survey, implementation, and analysis", 2016). Where two basins meet in a passage that is
/// narrow for both, a door line parts them. Elsewhere they join.
pub(super) fn rooms(scan: &Scan, storey: &Storey) -> (Vec<u32>, u32) {
    let step_m = scan.grid.step_m;
    let distance = distances(&scan.grid, |cell| !storey.is_free[cell]);
    let mut order: Vec<u32> = (0..distance.len() as u32)
        .filter(|cell| storey.is_free[*cell as usize])
        .collect();
    order.sort_by(|a, b| distance[*b as usize].total_cmp(&distance[*a as usize]).then(a.cmp(b)));

    let mut basins = Basins::default();
    let mut basin_of = vec![u32::MAX; distance.len()];
    for cell in order {
        let cell = cell as usize;
        let here_m = f64::from(distance[cell]) * step_m;
        let reached: Vec<usize> = around(scan, cell).filter(|next| basin_of[*next] != u32::MAX).collect();
        // The way up leads to the basin.
        let up = reached
            .iter()
            .reduce(|a, b| if distance[*b] > distance[*a] { b } else { a });
        let Some(&up) = up else {
            basin_of[cell] = basins.add(here_m);
            continue;
        };
        basin_of[cell] = basins.sets.root(basin_of[up]);
        let roots = reached.iter().map(|next| basins.sets.root(basin_of[*next]));
        let mut meeting: Vec<u32> = roots.collect();
        meeting.sort_unstable_by(|a, b| basins.by_peak(*a, *b));
        meeting.dedup();
        let Some((&first, others)) = meeting.split_first() else { continue };
        for &other in others {
            let lower_m = basins.peak_m[other as usize];
            let is_door = here_m <= WIDEST_DOOR_M && here_m < NARROW * lower_m && lower_m >= LEAST_RADIUS_M;
            if !is_door {
                basins.sets.join(first, other);
            }
        }
    }

    for basin in &mut basin_of {
        *basin = if *basin == u32::MAX {
            u32::MAX
        } else {
            basins.sets.root(*basin)
        };
    }
    cut_strips(scan, &distance, &mut basin_of);

    // What is too small, or has no floor, is no room.
    let mut tally = vec![Tally::default(); basins.peak_m.len()];
    for cell in 0..distance.len() {
        if basin_of[cell] == u32::MAX {
            continue;
        }
        let tally = &mut tally[basin_of[cell] as usize];
        tally.cells += 1;
        tally.floor += usize::from(storey.has_floor[cell]);
        tally.ceiling += usize::from(storey.top_m[cell].is_finite());
        if distance[cell] <= 1.0 {
            tally.rim += 1;
            let is_wall = |next: usize| !storey.is_free[next] && !scan.column(next).is_empty();
            tally.walls += usize::from(scan.grid.beside(cell).any(is_wall));
        }
    }
    let mut number = vec![0; tally.len()];
    let mut count = 0;
    for (basin, tally) in tally.iter().enumerate() {
        let is_large =
            tally.cells as f64 * scan.grid.cell_m2() >= LEAST_M2 && basins.peak_m[basin] >= LEAST_RADIUS_M;
        let share = |part: usize, whole: usize| part as f64 / whole as f64;
        let is_enclosed =
            share(tally.ceiling, tally.cells) > 0.5 || share(tally.walls, tally.rim) > LEAST_WALLS;
        if is_large && is_enclosed && share(tally.floor, tally.cells) > LEAST_FLOOR {
            count += 1;
            number[basin] = count;
        }
    }
    let rooms = basin_of.into_iter();
    (
        rooms
            .map(|basin| number.get(basin as usize).copied().unwrap_or(0))
            .collect(),
        count,
    )
}

/// Takes strips that hang on a basin from it, such as the inside of a wall with a leak. What is left is near
/// a wide place of the same basin.
fn cut_strips(scan: &Scan, distance: &[f32], basin_of: &mut [u32]) {
    let is_core = |cell: usize| f64::from(distance[cell]) * scan.grid.step_m >= CORE_M;
    let mut is_kept: Vec<bool> = (0..basin_of.len()).map(is_core).collect();
    let mut ring: Vec<usize> = (0..is_kept.len()).filter(|cell| is_kept[*cell]).collect();
    // As many steps lead from the core of a corner to its end.
    for _ in 0..(2.0 * CORE_M / scan.grid.step_m) as usize {
        let mut next = Vec::new();
        for cell in ring {
            for beside in scan.grid.beside(cell) {
                if !is_kept[beside] && basin_of[beside] == basin_of[cell] {
                    is_kept[beside] = true;
                    next.push(beside);
                }
            }
        }
        ring = next;
    }
    for (basin, is_kept) in basin_of.iter_mut().zip(is_kept) {
        if !is_kept {
            *basin = u32::MAX;
        }
    }
}

/// What a basin has, in cells.
#[derive(Clone, Copy, Default)]
struct Tally {
    cells: usize,
    floor: usize,
    ceiling: usize,
    /// Beside cells that are not free.
    rim: usize,
    /// The part of the rim that is beside a wall.
    walls: usize,
}

/// The cells that share an edge or a corner with a cell.
fn around(scan: &Scan, cell: usize) -> impl Iterator<Item = usize> {
    let width = scan.grid.width as isize;
    let [x, y] = scan.grid.place(cell).map(|v| v as isize);
    let height = scan.grid.height as isize;
    let steps = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
    steps.into_iter().filter_map(move |(dx, dy)| {
        let (x, y) = (x + dx, y + dy);
        let is_in = x >= 0 && y >= 0 && x < width && y < height;
        is_in.then_some((y * width + x) as usize)
    })
}

/// Basins that join, each with the distance from walls at its widest place, metres. The root of joined
/// basins has the widest.
#[derive(Default)]
struct Basins {
    sets: DisjointSets,
    peak_m: Vec<f64>,
}

impl Basins {
    fn add(&mut self, peak_m: f64) -> u32 {
        self.peak_m.push(peak_m);
        self.sets.add()
    }

    /// Orders basins, the widest first.
    fn by_peak(&self, a: u32, b: u32) -> std::cmp::Ordering {
        self.peak_m[b as usize]
            .total_cmp(&self.peak_m[a as usize])
            .then(a.cmp(&b))
    }
}
