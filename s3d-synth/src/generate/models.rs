//! The models of furniture, doors and windows of a building, and their sizes.

use super::{BuildingOptions, between, pick};
use crate::building::{LeafModel, SeatBase, ShelfFront, TableBase, Thing};
use crate::look::{Look, Pattern};
use crate::{BuildingError, RangeError};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The shapes of things to choose from. Sizes are in metres, drawn evenly from their ranges. No list may be
/// empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Models {
    /// What tables rest on.
    pub tables: Vec<TableBase>,
    /// Width, depth and height of the tables that one works at.
    pub table_m: [[f32; 2]; 3],
    /// What chairs rest on, and whether they have arms.
    pub seats: Vec<(SeatBase, bool)>,
    /// Width of a chair's seat, height of the seat, height of the back.
    pub seat_m: [[f32; 2]; 3],
    /// Whether sofas have arms.
    pub couches: Vec<bool>,
    /// Width of a seat of a sofa, depth of the whole, height of the back.
    pub couch_m: [[f32; 2]; 3],
    /// What covers the front of bookcases.
    pub shelves: Vec<ShelfFront>,
    /// Width, depth and height of bookcases.
    pub shelf_m: [[f32; 2]; 3],
    /// The share of boards without a frame.
    pub plain_boards: f64,
    /// Width of boards, and their height from lower to upper edge.
    pub board_m: [[f32; 2]; 2],
    /// What tables are made of.
    pub table_looks: Vec<Look>,
    /// What chairs are covered with.
    pub seat_looks: Vec<Look>,
    /// What sofas are covered with.
    pub couch_looks: Vec<Look>,
    /// What bookcases are made of.
    pub shelf_looks: Vec<Look>,
    /// How door leaves are made.
    pub leaves: Vec<LeafModel>,
    /// What door leaves are made of.
    pub leaf_looks: Vec<Look>,
    /// Width and height of doorways.
    pub door_m: [f32; 2],
    /// The share of doors that are shut.
    pub shut: f64,
    /// Panes of a window beside and above one another.
    pub panes: Vec<[u32; 2]>,
    /// The lower and the upper edge of windows.
    pub window_m: [f32; 2],
    /// The mean number of beams in a room of 20 m².
    pub beams: f32,
    /// The mean number of columns in a room of 20 m².
    pub columns: f32,
    /// The share of the ends of hallways that have a window. The others have a door.
    pub end_windows: f64,
}

impl Models {
    pub(super) fn check(&self, options: &BuildingOptions) -> Result<(), BuildingError> {
        let lists = [
            ("models of tables", self.tables.is_empty()),
            ("models of chairs", self.seats.is_empty()),
            ("models of sofas", self.couches.is_empty()),
            ("models of bookcases", self.shelves.is_empty()),
            ("materials of tables", self.table_looks.is_empty()),
            ("materials of chairs", self.seat_looks.is_empty()),
            ("materials of sofas", self.couch_looks.is_empty()),
            ("materials of bookcases", self.shelf_looks.is_empty()),
            ("models of door leaves", self.leaves.is_empty()),
            ("materials of door leaves", self.leaf_looks.is_empty()),
            ("divisions of windows", self.panes.is_empty()),
        ];
        if let Some((what, _)) = lists.into_iter().find(|(_, is_empty)| *is_empty) {
            return Err(BuildingError::EmptyStyle { what });
        }

        let sizes = [
            (&self.table_m, [[1.4, 3.0], [0.6, 1.5], [0.6, 1.1]], "the size of tables"),
            (&self.seat_m, [[0.35, 0.65], [0.38, 0.55], [0.65, 1.3]], "the size of chairs"),
            (&self.couch_m, [[0.5, 0.9], [0.65, 1.2], [0.6, 1.2]], "the size of sofas"),
            (&self.shelf_m, [[0.5, 2.5], [0.22, 0.7], [0.6, 2.3]], "the size of bookcases"),
        ];

        for (ranges, allowed, what) in sizes {
            for (range, allowed) in ranges.iter().zip(allowed) {
                range.iter().try_for_each(|&m| check_range(m, allowed, what))?;
            }
        }

        let lowest = options
            .rooms
            .iter()
            .flat_map(|room| room.heights_m)
            .fold(options.hallway_height_m, f32::min);

        // Boards hang above the highest sofa.
        let board = f64::from(lowest - self.couch_m[2][1] - 0.2);
        for (range, allowed) in self.board_m.iter().zip([[0.4, 5.0], [0.4, board]]) {
            range
                .iter()
                .try_for_each(|&m| check_range(m, allowed, "the size of boards"))?;
        }

        let most = options.hallway_width_m - 0.2;
        check_range(self.door_m[0], [0.7, f64::from(most.min(1.1))], "the width of doorways")?;
        check_range(self.door_m[1], [1.9, 2.1], "the height of doorways")?;
        check_range(self.window_m[0], [0.3, 1.2], "the lower edge of windows")?;

        // Under a slanted ceiling, openings end below the slant.
        let top = if options.rooms.iter().all(|r| r.heights_m[0] == r.heights_m[1]) {
            lowest - 0.1
        } else {
            2.1
        };
        check_range(self.window_m[1], [1.9, f64::from(top)], "the upper edge of windows")?;

        for panes in self.panes.iter().flatten() {
            check_range(*panes as f32, [1.0, 3.0], "the panes of a window")?;
        }

        check_range(self.beams, [0.0, 20.0], "the number of beams")?;
        check_range(self.columns, [0.0, 20.0], "the number of columns")?;

        for (share, what) in [
            (self.plain_boards, "the share of boards without a frame"),
            (self.shut, "the share of doors that are shut"),
            (self.end_windows, "the share of ends with a window"),
        ] {
            RangeError::check(share, [0.0, 1.0], || format!("the models: {what}"))?;
        }
        check_range(options.wall_m, [0.15, 1.0], "the thickness of walls that doors divide")?;
        Ok(())
    }

    pub(super) fn table(&self, size_m: [f32; 3], top: Look, rng: &mut ChaCha8Rng) -> Thing {
        Thing::ModelTable { base: pick(rng, &self.tables), size_m, top }
    }

    /// Draws a chair. Returns its width too, arms included.
    pub(super) fn seat(&self, fabric: Look, rng: &mut ChaCha8Rng) -> (Thing, f32) {
        let (base, has_arms) = pick(rng, &self.seats);
        let [width, seat, back] = sized(&self.seat_m, rng);
        let size_m = [width, seat, back.max(seat + 0.27)];
        (Thing::Seat { base, size_m, has_arms, fabric }, width + if has_arms { 0.1 } else { 0.0 })
    }

    pub(super) fn board(&self, (picture, frame): (Pattern, Look), rng: &mut ChaCha8Rng) -> (Thing, f32) {
        let [width_m, height_m] = sized(&self.board_m, rng);
        // The highest sofa may stand below it.
        let low = self.couch_m[2][1] + between(rng, 0.06, 0.14);
        let heights_m = [low, low + height_m];
        let tray_m = (picture == Pattern::Whiteboard).then_some(width_m.clamp(0.6, 0.9));
        let thing = if rng.random_bool(self.plain_boards) {
            Thing::PlainBoard { width_m, heights_m, picture }
        } else {
            Thing::Board { width_m, heights_m, picture, frame, tray_m }
        };
        (thing, width_m)
    }
}

fn check_range(value: f32, range: [f64; 2], what: &str) -> Result<(), RangeError> {
    RangeError::check(value, range, || format!("the models: {what}"))
}

/// Draws one size from each range.
pub(super) fn sized<const N: usize>(ranges: &[[f32; 2]; N], rng: &mut ChaCha8Rng) -> [f32; N] {
    ranges.map(|[from, to]| between(rng, from, to))
}
