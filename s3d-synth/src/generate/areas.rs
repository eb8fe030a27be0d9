//! Six areas in three buildings, so that one can train on some and test on others.
//!
//! Areas 1, 3 and 6 are of one building, 2 and 4 of another, 5 of a third, as in 2D-3D-S. How many rooms of
//! each type an area has, and how many beams, columns and windows, is counted from the names in the published
//! table of labels; area 5 has 60 of its 68 rooms. The things in a room follow `outfit`. Everything else is
//! made up.
//!
//! Each building has materials of its own, of the kinds that offices have: doors of veneer or painted, light
//! table tops, dark chairs, sofas in warm colours, bookcases of painted steel or dark wood, boards white,
//! green, black or of cork, all before walls that are almost white. So colours tell classes apart, though
//! hardly any colour is the same in two buildings.

use super::models::Models;
use super::{BuildingOptions, FloorPlan, RoomOptions, Style, between, rng};
use crate::RangeError;
use crate::building::{LeafModel, SeatBase, ShelfFront, TableBase};
use crate::look::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use s3d_label::RoomType;

/// The types of rooms, and the ranges of their sizes in the first building: along the hallway, and away from
/// it.
const TYPES: [(RoomType, [[f32; 2]; 2]); 10] = [
    (RoomType::CONFERENCE_ROOM, [[6.8, 9.0], [5.2, 6.6]]),
    (RoomType::AUDITORIUM, [[13.5, 15.0], [12.0, 13.0]]),
    (RoomType::LOBBY, [[9.0, 11.5], [7.0, 8.5]]),
    (RoomType::LOUNGE, [[8.0, 10.0], [6.5, 7.8]]),
    (RoomType::OFFICE, [[3.7, 5.3], [4.2, 5.8]]),
    (RoomType::OPENSPACE, [[9.5, 11.5], [6.5, 8.0]]),
    (RoomType::PANTRY, [[3.4, 4.6], [3.2, 4.4]]),
    (RoomType::COPY_ROOM, [[3.4, 4.4], [3.8, 4.6]]),
    (RoomType::STORAGE, [[2.6, 4.2], [2.8, 4.4]]),
    (RoomType::WC, [[4.0, 5.0], [4.2, 5.4]]),
];

/// The counts of an area.
struct Area {
    /// The index of its building.
    building: usize,
    /// Rooms by type, in the order of `TYPES`.
    rooms: [u32; 10],
    hallways: u32,
    /// The number of wings, which is made up.
    wings: u32,
    beams: u32,
    columns: u32,
    windows: u32,
}

/// Areas 1 to 6.
const AREAS: [Area; 6] = [
    area(0, [2, 0, 0, 0, 31, 0, 1, 1, 0, 1], [8, 3], [61, 57, 29]),
    area(1, [1, 2, 0, 0, 14, 0, 0, 0, 9, 2], [12, 3], [11, 19, 8]),
    area(0, [1, 0, 0, 2, 10, 0, 0, 0, 2, 2], [6, 2], [13, 12, 8]),
    area(1, [3, 0, 2, 0, 22, 0, 0, 0, 4, 4], [14, 3], [3, 38, 40]),
    area(2, [3, 0, 1, 0, 36, 0, 1, 0, 4, 2], [13, 4], [3, 65, 46]),
    area(0, [1, 0, 0, 1, 37, 1, 1, 1, 0, 0], [6, 2], [68, 54, 31]),
];

const fn area(
    building: usize,
    rooms: [u32; 10],
    [hallways, wings]: [u32; 2],
    [beams, columns, windows]: [u32; 3],
) -> Area {
    Area { building, rooms, hallways, wings, beams, columns, windows }
}

/// The proportions of a building: the factor of all room sizes, the width and height of hallways, walls,
/// ceilings, courtyards.
struct Proportions {
    rooms: f32,
    hallway_m: [f32; 2],
    wall_m: f32,
    ceiling_m: [f32; 2],
    courtyard_m: f32,
}

impl BuildingOptions {
    /// The number of areas.
    pub const AREAS: u32 = 6;

    /// The options of one of six areas in three buildings (1, 3 and 6; 2 and 4; 5), with 23 to 60 rooms,
    /// hallways among them. Types of rooms are as frequent as in the published area of the same number, and
    /// things as frequent as in published rooms of the type. Each building has proportions, materials and
    /// models of furniture of its own. The same number and seed give the same options.
    ///
    /// ```
    /// use s3d_synth::{Building, BuildingOptions};
    ///
    /// let options = BuildingOptions { texture_scale: 0.05, ..BuildingOptions::area(3, 7)? };
    /// let building = Building::generate(&options)?;
    /// assert_eq!(building.rooms.len(), 23);
    /// # Ok::<(), s3d_synth::BuildingError>(())
    /// ```
    ///
    /// # Errors
    /// [`RangeError`] if there is no area of this number.
    pub fn area(number: u32, seed: u64) -> Result<Self, RangeError> {
        RangeError::check(number, [1.0, f64::from(Self::AREAS)], || "the number of an area".to_owned())?;

        let area = &AREAS[number as usize - 1];
        let mut rng = rng(seed, u64::MAX - 1 - u64::from(number));
        let proportions = proportions(area.building);
        let with_windows = area.rooms[0] + area.rooms[2] + area.rooms[3] + area.rooms[4];
        let windows = area.windows as f32 / with_windows as f32;

        let mut rooms = Vec::new();
        for (&(room_type, size), &count) in TYPES.iter().zip(&area.rooms) {
            for _ in 0..count {
                rooms.push(room(room_type, size, &proportions, windows, &mut rng));
            }
        }

        for i in (1..rooms.len()).rev() {
            rooms.swap(i, rng.random_range(0..=i));
        }

        let surface: f32 = rooms.iter().map(|room| room.size_m[0] * room.size_m[1]).sum();
        let hallways = 0.2 * surface;
        let a_room = |count: u32| count as f32 / ((surface + hallways) / 20.0);
        let models =
            Models { beams: a_room(area.beams), columns: a_room(area.columns), ..models(area.building) };

        let [hallway_width_m, hallway_height_m] = proportions.hallway_m;
        Ok(Self {
            title: format!("A generated area of s3d: area {number}, seed {seed}"),
            rooms,
            storeys: 1,
            hallway_width_m,
            hallway_height_m,
            wall_m: proportions.wall_m,
            plan: FloorPlan::Wings {
                wings: area.wings,
                hallways: area.hallways,
                courtyard_m: proportions.courtyard_m,
            },
            style: style(area.building),
            models: Some(models),
            texture_scale: 0.4,
            // Areas of one building differ.
            seed: rng.random(),
        })
    }
}

fn room(
    room_type: RoomType,
    [along, away]: [[f32; 2]; 2],
    proportions: &Proportions,
    windows: f32,
    rng: &mut ChaCha8Rng,
) -> RoomOptions {
    let size_m = [along, away].map(|[from, to]| between(rng, from, to) * proportions.rooms);
    let height = between(rng, proportions.ceiling_m[0], proportions.ceiling_m[1]);
    let has_windows =
        [RoomType::OFFICE, RoomType::CONFERENCE_ROOM, RoomType::LOBBY, RoomType::LOUNGE].contains(&room_type);
    let wanted = (windows * between(rng, 0.4, 1.6) + rng.random::<f32>()).floor();
    let most = ((size_m[0] - 0.8) / 1.1).floor();
    let surface = size_m[0] * size_m[1];
    RoomOptions {
        room_type,
        size_m,
        heights_m: [height; 2],
        windows: if has_windows { wanted.min(most) as u32 } else { 0 },
        furnishing: 1.0,
        locations: 1 + ((surface / 14.0) as u32).min(7),
    }
}

fn proportions(building: usize) -> Proportions {
    match building {
        0 => Proportions {
            rooms: 1.0,
            hallway_m: [1.9, 2.6],
            wall_m: 0.2,
            ceiling_m: [2.6, 2.9],
            courtyard_m: 3.0,
        },
        1 => Proportions {
            rooms: 1.12,
            hallway_m: [2.7, 3.0],
            wall_m: 0.36,
            ceiling_m: [3.1, 3.8],
            courtyard_m: 5.0,
        },
        _ => Proportions {
            rooms: 0.95,
            hallway_m: [2.2, 2.8],
            wall_m: 0.26,
            ceiling_m: [2.75, 3.2],
            courtyard_m: 1.0,
        },
    }
}

fn models(building: usize) -> Models {
    match building {
        0 => common(
            vec![TableBase::Legs, TableBase::Legs, TableBase::Pedestal],
            vec![(SeatBase::Star, true), (SeatBase::Star, false), (SeatBase::Legs, false)],
            vec![true],
            vec![ShelfFront::Open, ShelfFront::Open, ShelfFront::HalfDoors],
            vec![LeafModel::Panelled],
            vec![[2, 1]],
        ),
        1 => Models {
            table_m: [[1.7, 2.2], [0.8, 0.98], [0.74, 0.78]],
            seat_m: [[0.5, 0.58], [0.45, 0.5], [0.8, 0.92]],
            couch_m: [[0.68, 0.78], [0.92, 1.05], [0.7, 0.78]],
            shelf_m: [[1.0, 1.4], [0.4, 0.5], [1.8, 2.2]],
            plain_boards: 0.9,
            board_m: [[1.8, 3.2], [1.1, 1.3]],
            table_looks: vec![WHITE, Look::Plain("grey_laminate", [204, 206, 206])],
            seat_looks: vec![
                Look::Plain("charcoal_fabric", [66, 68, 72]),
                Look::Plain("black_leather", [48, 45, 44]),
            ],
            couch_looks: vec![
                Look::Plain("red_leather", [172, 52, 44]),
                Look::Plain("cognac_leather", [168, 98, 52]),
            ],
            shelf_looks: vec![
                Look::Plain("teal_steel", [76, 116, 122]),
                Look::Plain("anthracite_steel", [74, 80, 88]),
            ],
            leaf_looks: vec![
                Look::Plain("cherry_veneer", [158, 92, 58]),
                Look::Plain("blue_lacquer", [64, 104, 140]),
            ],
            door_m: [1.0, 2.1],
            shut: 0.35,
            window_m: [0.6, 2.4],
            ..common(
                vec![TableBase::Panels, TableBase::Panels, TableBase::Legs],
                vec![(SeatBase::Sled, true), (SeatBase::Sled, false), (SeatBase::Star, true)],
                vec![false],
                vec![ShelfFront::Doors, ShelfFront::HalfDoors],
                vec![LeafModel::Flush],
                vec![[3, 2], [2, 2]],
            )
        },
        _ => Models {
            table_m: [[1.4, 1.6], [0.6, 0.7], [0.7, 0.73]],
            seat_m: [[0.4, 0.45], [0.42, 0.46], [0.95, 1.12]],
            couch_m: [[0.55, 0.64], [0.74, 0.84], [0.85, 0.98]],
            shelf_m: [[1.2, 1.8], [0.3, 0.38], [1.0, 1.35]],
            plain_boards: 0.4,
            board_m: [[0.9, 1.6], [0.8, 1.0]],
            table_looks: vec![
                Look::Plain("birch", [232, 214, 180]),
                Look::Plain("ivory_laminate", [240, 232, 214]),
            ],
            seat_looks: vec![
                Look::Plain("forest_felt", [52, 74, 58]),
                Look::Plain("black_fabric", [52, 50, 54]),
            ],
            couch_looks: vec![
                Look::Plain("mustard_fabric", [206, 158, 54]),
                Look::Plain("terracotta_fabric", [196, 104, 72]),
            ],
            shelf_looks: vec![Look::Plain("slate_blue_board", [82, 98, 124]), WALNUT],
            leaf_looks: vec![WALNUT, Look::Plain("chestnut_veneer", [128, 82, 54])],
            door_m: [0.85, 2.0],
            shut: 0.2,
            window_m: [1.0, 2.2],
            ..common(
                vec![TableBase::Trestles, TableBase::Trestles, TableBase::Pedestal],
                vec![(SeatBase::Legs, false), (SeatBase::Legs, true), (SeatBase::Block, true)],
                vec![true, false],
                vec![ShelfFront::Open, ShelfFront::HalfDoors],
                vec![LeafModel::Glazed],
                vec![[1, 1]],
            )
        },
    }
}

/// Returns models of the given kinds, with the sizes and looks of the first building.
fn common(
    tables: Vec<TableBase>,
    seats: Vec<(SeatBase, bool)>,
    couches: Vec<bool>,
    shelves: Vec<ShelfFront>,
    leaves: Vec<LeafModel>,
    panes: Vec<[u32; 2]>,
) -> Models {
    Models {
        tables,
        table_m: [[1.4, 1.7], [0.68, 0.8], [0.72, 0.75]],
        seats,
        seat_m: [[0.44, 0.48], [0.44, 0.48], [0.86, 1.02]],
        couches,
        couch_m: [[0.6, 0.68], [0.82, 0.9], [0.78, 0.86]],
        shelves,
        shelf_m: [[0.8, 1.0], [0.28, 0.34], [1.9, 2.15]],
        plain_boards: 0.1,
        board_m: [[1.2, 2.4], [1.0, 1.2]],
        table_looks: vec![WHITE, Look::Plain("maple", [226, 202, 164])],
        seat_looks: vec![Look::Plain("black_mesh", [46, 48, 52]), Look::Plain("navy_fabric", [44, 58, 92])],
        couch_looks: vec![RUST_FABRIC, Look::Plain("burgundy_fabric", [136, 44, 52])],
        shelf_looks: vec![
            Look::Plain("blue_steel", [92, 112, 138]),
            Look::Plain("graphite_steel", [88, 92, 98]),
        ],
        leaves,
        leaf_looks: vec![OAK, Look::Plain("beech_veneer", [206, 160, 112])],
        door_m: [0.9, 2.05],
        shut: 0.3,
        panes,
        window_m: [0.85, 2.1],
        beams: 0.0,
        columns: 0.0,
        end_windows: 0.3,
    }
}

fn style(building: usize) -> Style {
    let plain = Style::default();
    match building {
        0 => Style {
            floors: vec![
                FloorFinish::CarpetTiles([112.0, 120.0, 132.0]),
                FloorFinish::CarpetTiles([128.0, 112.0, 98.0]),
            ],
            ceilings: vec![CeilingFinish::Tiles],
            accents: vec![[158.0, 182.0, 172.0], [196.0, 176.0, 120.0]],
            boards: vec![Pattern::Whiteboard, Pattern::Plan, Pattern::GreenBoard],
            ..plain
        },
        1 => Style {
            walls: vec![[214.0, 218.0, 220.0], [204.0, 206.0, 204.0], [226.0, 226.0, 224.0]],
            accents: vec![[150.0, 158.0, 164.0], [172.0, 184.0, 170.0]],
            floors: vec![FloorFinish::Terrazzo],
            ceilings: vec![CeilingFinish::Plaster],
            boards: vec![Pattern::Whiteboard, Pattern::BlackBoard],
            ..plain
        },
        _ => Style {
            walls: vec![[238.0, 228.0, 204.0], [232.0, 218.0, 196.0]],
            accents: vec![[150.0, 170.0, 180.0], [160.0, 174.0, 136.0]],
            floors: vec![FloorFinish::PlanksAlongX(Wood::OAK), FloorFinish::PlanksAlongY(Wood::WALNUT)],
            ceilings: vec![CeilingFinish::Boards, CeilingFinish::Plaster],
            boards: vec![Pattern::Plan, Pattern::GreenBoard, Pattern::Cork],
            ..plain
        },
    }
}
