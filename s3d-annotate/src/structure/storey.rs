//! A storey on the plan: what is under a ceiling, what stands up to it, and where there is a floor.

use super::distance::distances;
use super::scan::{OVERHEAD, Scan};
use std::ops::Range;

/// Ceilings are at least so far above the floor, metres.
const LOWEST_CEILING_M: f64 = 1.7;

/// A ceiling goes on over walls and holes up to this distance, metres.
const CEILING_REACH_M: f64 = 1.0;

/// A ceiling in one piece is at least this large, m²; less is the top of a window's recess or of a door. …
const LEAST_CEILING_M2: f64 = 0.8;

/// … Heights of neighbouring cells of a piece differ by no more than this, metres.
const EVEN_M: f32 = 0.1;

/// What is so much lower than the ceiling around it is none, metres.
const LOWER_M: f32 = 0.2;

/// Gaps in what a scan saw are closed if they are at most twice as wide, metres.
const GAP_M: f64 = 0.3;

/// Holes in what a scan saw are filled up to this size, m².
const HOLE_M2: f64 = 3.0;

/// The height of most doors, metres.
const DOOR_M: f64 = 2.15;

/// The share of the heights between doors and ceiling that a wall fills at least.
const FILLED: f64 = 0.6;

/// The share of them that is in one of the cells.
const PART: f64 = 0.25;

/// A lintel over an opening wider than this is a beam in a room, metres.
const WIDEST_DOOR_M: f64 = 1.6;

/// The height of a layer of cells, metres.
const LAYER_M: f64 = 0.05;

/// A storey. Columns are by cell of the plan.
pub(super) struct Storey {
    /// The height of its floor, metres.
    pub(super) floor_m: f64,
    /// The lowest height that belongs to it, metres.
    pub(super) low_m: f64,
    /// The height below which all of it lies, metres; infinite for the last storey.
    pub(super) high_m: f64,
    /// The height of the next floor, metres; infinite for the last storey.
    pub(super) above_m: f64,
    /// The height of the ceiling, of the nearest one, or of the tops of walls in a scan without ceilings,
    /// metres. Not a number if nothing is high enough.
    pub(super) ceiling_m: Vec<f32>,
    /// The highest level face of the cell: its height in the middle of the cell, metres, or not a number.
    pub(super) top_m: Vec<f32>,
    /// Whether there is a floor.
    pub(super) has_floor: Vec<bool>,
    /// Whether there is free space between walls.
    pub(super) is_free: Vec<bool>,
}

/// The direction in which fronts of faces look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fronts {
    /// Into rooms, as the winding says.
    Inside,
    /// Out of rooms: each face is turned.
    Outside,
    /// Nobody knows.
    Mixed,
}

impl Fronts {
    /// Returns whether a face looks along a direction, if its dot product with the normal is `dot`.
    pub(super) fn look(self, dot: f64) -> bool {
        match self {
            Self::Inside => dot > 0.0,
            Self::Outside => dot < 0.0,
            Self::Mixed => true,
        }
    }

    /// Finds the direction from the largest floor, which is seen from above, and leaves out of `floors` what
    /// is seen from below: a ceiling over floor that was not scanned.
    pub(super) fn find(scan: &Scan, floors: &mut Vec<f64>) -> Self {
        let share_up = |floor_m: f64| {
            let on = scan
                .facets
                .iter()
                .filter(|facet| facet.is_level() && (facet.middle.z - floor_m).abs() < 0.05);
            let [mut up_m2, mut all_m2] = [0.0; 2];
            for facet in on {
                up_m2 += if facet.normal.z > 0.0 { facet.area_m2 } else { 0.0 };
                all_m2 += facet.area_m2;
            }
            (up_m2 / f64::max(all_m2, f64::MIN_POSITIVE), all_m2)
        };
        let shares: Vec<(f64, f64)> = floors.iter().map(|floor| share_up(*floor)).collect();
        let largest = shares.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let fronts = match largest {
            Some((share, _)) if *share > 0.9 => Self::Inside,
            Some((share, _)) if *share < 0.1 => Self::Outside,
            _ => Self::Mixed,
        };
        let mut shares = shares.into_iter();
        floors.retain(|_| shares.next().is_some_and(|(share, _)| fronts.look(share - 0.5)));
        fronts
    }
}

impl Storey {
    /// Looks at the storey of a floor, or at several as if they were one. `floors` are the heights of all
    /// floors, ascending, metres, and `places` the floors in the storey.
    pub(super) fn new(scan: &Scan, floors: &[f64], places: Range<usize>, fronts: Fronts) -> Self {
        let cells = scan.grid.cells();
        let floor_m = floors[places.start];
        let above_m = floors.get(places.end).copied().unwrap_or(f64::INFINITY);
        let mut storey = Self {
            floor_m,
            low_m: floor_m - if places.start > 0 { 0.08 } else { 0.6 },
            high_m: above_m - 0.05,
            above_m,
            ceiling_m: vec![f32::NAN; cells],
            top_m: vec![f32::NAN; cells],
            has_floor: vec![false; cells],
            is_free: Vec::new(),
        };

        // Layers count from the floor; the last one holds all above it.
        let mut layers = vec![0u128; cells];
        let mut is_seen = vec![false; cells];
        let mut highest: Vec<f32> = Vec::new();
        for cell in 0..cells {
            let middle = scan.grid.middle(cell);
            let mut top = f64::NEG_INFINITY;
            for sample in scan.column(cell) {
                let z = f64::from(sample.z);
                if z < storey.low_m || z > storey.high_m {
                    continue;
                }
                let facet = scan.facet(sample.face);
                is_seen[cell] = true;
                if z >= floor_m {
                    layers[cell] |= 1 << (((z - floor_m) / LAYER_M) as u32).min(127);
                }
                storey.has_floor[cell] |= facet.is_level() && z < floor_m + 0.35;
                let is_above = z > floor_m + LOWEST_CEILING_M && facet.normal.z.abs() >= OVERHEAD;
                if is_above && fronts.look(-facet.normal.z) {
                    top = top.max(facet.height_at(middle));
                }
            }
            if top.is_finite() {
                storey.top_m[cell] = top as f32;
            }
            let last = scan
                .column(cell)
                .iter()
                .rfind(|sample| f64::from(sample.z) <= storey.high_m);
            highest.extend(last.map(|l| l.z).filter(|z| f64::from(*z) > floor_m + LOWEST_CEILING_M));
        }
        storey.extend_ceilings(scan, &mut highest);

        let is_filled = storey.filled(scan, &layers);
        let is_inside = closed(scan, &is_seen);
        storey.is_free = (0..cells)
            .map(|cell| is_inside[cell] && !is_filled[cell] && !storey.is_opening(scan, cell))
            .collect();
        storey
    }

    /// Returns whether a cell is in the recess of a window or door, which has its own low ceiling and belongs
    /// to the wall.
    pub(super) fn is_recess(&self, cell: usize) -> bool {
        self.ceiling_m[cell] - self.top_m[cell] > LOWER_M
    }

    /// Returns whether a cell is in the recess of a window or door. What is over a floor and higher than a
    /// door is the underside of a beam: it parts no rooms. In a scan with noise, only some of its cells are
    /// lower than the ceiling around them, and those would be narrow passages.
    fn is_opening(&self, scan: &Scan, cell: usize) -> bool {
        // Noise takes the floor from single cells.
        let beside = scan.grid.beside(cell).filter(|next| self.has_floor[*next]);
        let is_over_floor = self.has_floor[cell] || beside.count() >= 2;
        let is_beam = is_over_floor && f64::from(self.top_m[cell]) > self.floor_m + DOOR_M;
        self.is_recess(cell) && !is_beam
    }

    /// Takes the large pieces of what is highest as ceilings, and extends them over walls and holes.
    /// Elsewhere, nine of ten high columns are no higher than what counts as the ceiling.
    fn extend_ceilings(&mut self, scan: &Scan, highest: &mut [f32]) {
        let place = highest.len() * 9 / 10;
        let usual = if highest.is_empty() {
            f32::NAN
        } else {
            *highest.select_nth_unstable_by(place, f32::total_cmp).1
        };
        let top_m = &self.top_m;
        let is_even = |a: usize, b: usize| (top_m[a] - top_m[b]).abs() <= EVEN_M;
        let mut ring: Vec<usize> = Vec::new();
        for piece in pieces(scan, |cell| top_m[cell].is_finite(), is_even) {
            if piece.len() as f64 * scan.grid.cell_m2() >= LEAST_CEILING_M2 {
                piece.iter().for_each(|cell| self.ceiling_m[*cell] = top_m[*cell]);
                ring.extend(piece);
            }
        }
        for _ in 0..(CEILING_REACH_M / scan.grid.step_m) as usize {
            let mut found: Vec<(usize, f32)> = Vec::new();
            for &cell in &ring {
                let next = scan.grid.beside(cell).filter(|next| self.ceiling_m[*next].is_nan());
                found.extend(next.map(|next| (next, self.ceiling_m[cell])));
            }
            found.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            found.dedup_by_key(|(cell, _)| *cell);
            ring.clear();
            for (cell, height) in found {
                self.ceiling_m[cell] = height;
                ring.push(cell);
            }
        }
        for height in &mut self.ceiling_m {
            if height.is_nan() {
                *height = usual;
            }
        }
    }

    /// Returns the cells that a wall fills between the tops of doors and the ceiling. Walls do so above
    /// doors and windows too, and furniture does not.
    fn filled(&self, scan: &Scan, layers: &[u128]) -> Vec<bool> {
        let floor_m = self.floor_m;
        let share = |layers: u128, low_m: f64, high_m: f64| {
            let [from, to] = [low_m, high_m].map(|z| ((z / LAYER_M).round().max(0.0) as u32).min(126));
            if to <= from {
                return 0.0;
            }
            let mask = ((1u128 << (to - from)) - 1) << from;
            f64::from((layers & mask).count_ones()) / f64::from(to - from)
        };
        // A wall on the border of two cells has its samples in both.
        let both = |cell: usize| {
            scan.grid
                .beside(cell)
                .fold(layers[cell], |all, next| all | layers[next])
        };
        let mut is_filled: Vec<bool> = (0..layers.len())
            .map(|cell| {
                let top = f64::from(self.ceiling_m[cell]) - floor_m - 0.1;
                // Under a low ceiling, there is little above doors.
                let low = DOOR_M.min(top - 0.25);
                let is_part = top.is_finite() && share(layers[cell], low, top) >= PART;
                is_part && share(both(cell), low, top) >= FILLED
            })
            .collect();

        // What is open below, over a floor, and wider than a door is a beam.
        let floor_near =
            |cell: usize| self.has_floor[cell] || scan.grid.beside(cell).any(|next| self.has_floor[next]);
        let is_lintel = |cell: usize| floor_near(cell) && share(both(cell), 1.0, 1.9) <= 0.25;
        let lintels: Vec<bool> = (0..layers.len())
            .map(|cell| is_filled[cell] && is_lintel(cell))
            .collect();
        // Cells that touch in corners are of one lintel.
        let is_near = |cell: usize| lintels[cell] || scan.grid.beside(cell).any(|next| lintels[next]);
        for piece in pieces(scan, is_near, |_, _| true) {
            let mut low = [usize::MAX; 2];
            let mut high = [0; 2];
            for &cell in &piece {
                let place = scan.grid.place(cell);
                low = [low[0].min(place[0]), low[1].min(place[1])];
                high = [high[0].max(place[0]), high[1].max(place[1])];
            }
            let [x, y] = [0, 1].map(|k| (high[k] - low[k]) as f64 * scan.grid.step_m);
            if x.hypot(y) > WIDEST_DOOR_M {
                piece.into_iter().for_each(|cell| is_filled[cell] &= !lintels[cell]);
            }
        }
        is_filled
    }
}

/// Closes the gaps and fills the holes of what a scan saw. Floor lies hidden under furniture.
fn closed(scan: &Scan, is_seen: &[bool]) -> Vec<bool> {
    let reach = (GAP_M / scan.grid.step_m) as f32;
    let far = distances(&scan.grid, |cell| is_seen[cell]);
    let back = distances(&scan.grid, |cell| far[cell] > reach);
    let mut is_inside: Vec<bool> = (0..is_seen.len())
        .map(|cell| is_seen[cell] || back[cell] > reach)
        .collect();

    for hole in pieces(scan, |cell| !is_inside[cell], |_, _| true) {
        // The first cell is the lowest: that of the space around everything is the corner of the plan.
        let is_hole = hole.first().is_some_and(|first| *first != 0);
        if is_hole && hole.len() as f64 * scan.grid.cell_m2() <= HOLE_M2 {
            hole.into_iter().for_each(|cell| is_inside[cell] = true);
        }
    }
    is_inside
}

/// Returns the connected pieces of a set of cells, by their lowest cells. Neighbours are connected if they
/// are `alike`.
pub(super) fn pieces(
    scan: &Scan,
    is_in: impl Fn(usize) -> bool,
    alike: impl Fn(usize, usize) -> bool,
) -> Vec<Vec<usize>> {
    let mut is_done = vec![false; scan.grid.cells()];
    let mut all = Vec::new();
    for start in 0..is_done.len() {
        if is_done[start] || !is_in(start) {
            continue;
        }
        is_done[start] = true;
        let mut piece = vec![start];
        let mut next = 0;
        while next < piece.len() {
            let from = piece[next];
            for cell in scan.grid.beside(from) {
                if !is_done[cell] && is_in(cell) && alike(from, cell) {
                    is_done[cell] = true;
                    piece.push(cell);
                }
            }
            next += 1;
        }
        all.push(piece);
    }
    all
}
