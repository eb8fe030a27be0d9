//! Halls: rooms without a ceiling in their storey, which go on through storeys above and have one there.

use super::scan::Scan;
use super::storey::{Fronts, Storey};

/// A room has no ceiling below a height if less than this share of its cells has one. It is open to the next
/// storey if less than this share of its cells has a floor there.
const LEAST_SHARE: f64 = 0.3;

/// A floor lies within this of its height, metres.
const NEAR_M: f64 = 0.1;

/// The halls of a storey.
pub(super) struct Halls {
    /// The storey from the halls' floor through one storey above it, through two, and so on.
    tall: Vec<Storey>,
    /// For each room of the storey, from 1, the number of storeys above that it goes on through.
    through: Vec<usize>,
}

impl Halls {
    /// Finds the halls among the rooms of a storey, whose floor is at a place among all `floors`.
    /// `room_of_cell` has the room of each cell, from 1 to `count`, or 0.
    pub(super) fn find(
        scan: &Scan,
        floors: &[f64],
        place: usize,
        storey: &Storey,
        fronts: Fronts,
        room_of_cell: &[u32],
        count: u32,
    ) -> Self {
        let shares = |is_in: &dyn Fn(usize) -> bool| -> Vec<f64> {
            let mut cells = vec![[0usize; 2]; count as usize + 1];
            for (cell, room) in room_of_cell.iter().enumerate() {
                let [part, all] = &mut cells[*room as usize];
                *part += usize::from(is_in(cell));
                *all += 1;
            }
            cells
                .into_iter()
                .map(|[part, all]| part as f64 / all.max(1) as f64)
                .collect()
        };

        let mut halls = Self { tall: Vec::new(), through: vec![0; count as usize + 1] };
        for next in place + 1..floors.len() {
            let storey = halls.tall.last().unwrap_or(storey);
            let has_ceiling = shares(&|cell| storey.top_m[cell].is_finite());
            let has_floor = shares(&|cell| has_floor(scan, cell, floors[next]));
            let through = halls.tall.len();
            let mut is_any = false;
            for room in 1..=count as usize {
                let is_open = has_ceiling[room] < LEAST_SHARE && has_floor[room] < LEAST_SHARE;
                if halls.through[room] == through && is_open {
                    halls.through[room] += 1;
                    is_any = true;
                }
            }
            if !is_any {
                break;
            }
            halls.tall.push(Storey::new(scan, floors, place..next + 1, fronts));
        }

        // Without a ceiling at its end, nobody knows how high it is: the scan may have lost ceilings.
        for (storey, through) in halls.tall.iter().zip(1..) {
            let has_ceiling = shares(&|cell| storey.top_m[cell].is_finite());
            for (room, passed) in halls.through.iter_mut().enumerate() {
                if *passed == through && has_ceiling[room] < LEAST_SHARE {
                    *passed = 0;
                }
            }
        }
        halls
    }

    /// Returns the height below which all halls lie, metres; negative infinity without any.
    pub(super) fn high_m(&self) -> f64 {
        self.tall.last().map_or(f64::NEG_INFINITY, |storey| storey.high_m)
    }

    /// Returns the storeys of a hall as one; `None` for any other room.
    pub(super) fn of(&self, room: u32) -> Option<&Storey> {
        self.tall.get(self.through[room as usize].checked_sub(1)?)
    }
}

/// Returns whether there is something level in a column at the height of a floor, metres.
fn has_floor(scan: &Scan, cell: usize, floor_m: f64) -> bool {
    scan.column(cell).iter().any(|sample| {
        let above_m = f64::from(sample.z) - floor_m;
        above_m.abs() <= NEAR_M && scan.facet(sample.face).is_level()
    })
}
