//! Options from the whole of their ranges, with furniture of several models and with wings. The generator
//! refuses them for a reason that no seed changes, or it makes a building that can be built.

use crate::common;

use common::TYPES;
use proptest::prelude::*;
use s3d_label::RoomType;
use s3d_synth::building::{LeafModel, SeatBase, ShelfFront, TableBase};
use s3d_synth::{Building, BuildingError, BuildingOptions, FloorPlan, Models, RoomOptions};

/// Lengths from `low` to `high`, often exactly at one of the ends.
fn length(low: f32, high: f32) -> BoxedStrategy<f32> {
    prop_oneof![1 => Just(low), 1 => Just(high), 6 => low..high].boxed()
}

/// Sides of rooms, seldom long ones, since these take long to build.
fn side(low: f32) -> BoxedStrategy<f32> {
    prop_oneof![4 => Just(low), 24 => low..low + 4.0, 6 => low..10.0, 1 => low..40.0].boxed()
}

/// Two such lengths, in any order.
fn range(low: f32, high: f32) -> BoxedStrategy<[f32; 2]> {
    prop_oneof![length(low, high).prop_map(|m| [m; 2]), [length(low, high), length(low, high)]].boxed()
}

fn some<T: Clone + std::fmt::Debug + 'static>(of: &'static [T]) -> BoxedStrategy<Vec<T>> {
    prop::collection::vec(prop::sample::select(of), 1..3).boxed()
}

fn room() -> BoxedStrategy<RoomOptions> {
    let heights = prop_oneof![length(2.4, 10.0).prop_map(|h| [h; 2]), [length(2.4, 10.0), length(2.4, 10.0)]];
    let sizes = [side(1.8), side(2.2)];
    let shares = [length(0.0, 1.0), length(0.0, 1.0)];
    let draw = (0..TYPES.len(), sizes, heights, shares, 1u32..6);
    draw.prop_map(|(room_type, size_m, heights_m, [windows, furnishing], locations)| RoomOptions {
        room_type: TYPES[room_type],
        size_m,
        heights_m,
        windows: (windows * ((size_m[0] - 0.8) / 1.1).floor()) as u32,
        furnishing,
        locations,
    })
    .boxed()
}

/// Models for a lowest ceiling at `lowest` and hallways of this width.
fn models(lowest: f32, is_level: bool, hallway_width_m: f32) -> BoxedStrategy<Models> {
    let sofa = [range(0.5, 0.9), range(0.65, 1.2), range(0.6, 1.2)];
    let furniture = (
        [range(1.4, 3.0), range(0.6, 1.5), range(0.6, 1.1)],
        [range(0.35, 0.65), range(0.38, 0.55), range(0.65, 1.3)],
        sofa,
        [range(0.5, 2.5), range(0.22, 0.7), range(0.6, 2.3)],
        [range(0.4, 5.0), range(0.0, 1.0)],
    );
    let kinds = (
        some(&[TableBase::Legs, TableBase::Trestles, TableBase::Panels, TableBase::Pedestal]),
        some(&[
            (SeatBase::Legs, true),
            (SeatBase::Star, true),
            (SeatBase::Sled, false),
            (SeatBase::Block, true),
        ]),
        some(&[true, false]),
        some(&[ShelfFront::Open, ShelfFront::Doors, ShelfFront::HalfDoors]),
        some(&[LeafModel::Flush, LeafModel::Panelled, LeafModel::Glazed]),
        some(&[[1, 1], [3, 3], [2, 1], [3, 2]]),
    );
    let highest_edge = if is_level { lowest - 0.1 } else { 2.1 };
    let openings = (
        [length(0.7, (hallway_width_m - 0.2).min(1.1)), length(1.9, 2.1)],
        [length(0.3, 1.2), length(1.9, highest_edge)],
        [length(0.0, 20.0), length(0.0, 20.0)],
        [0.0f64..=1.0, 0.0f64..=1.0, 0.0f64..=1.0],
    );
    (furniture, kinds, openings)
        .prop_map(
            move |((table_m, seat_m, couch_m, shelf_m, [board_width, board_share]), kinds, openings)| {
                let (tables, seats, couches, shelves, leaves, panes) = kinds;
                let (door_m, window_m, [beams, columns], [plain_boards, shut, end_windows]) = openings;
                let highest_board = lowest - couch_m[2][1] - 0.2;
                let board_height = board_share.map(|share| 0.4 + share * (highest_board - 0.4).max(0.0));
                Models {
                    tables,
                    table_m,
                    seats,
                    seat_m,
                    couches,
                    couch_m,
                    shelves,
                    shelf_m,
                    board_m: [board_width, board_height],
                    leaves,
                    door_m,
                    panes,
                    window_m,
                    beams,
                    columns,
                    plain_boards,
                    shut,
                    end_windows,
                    ..BuildingOptions::area(1, 1).unwrap().models.unwrap()
                }
            },
        )
        .boxed()
}

/// Rooms and all other options of a building except models.
fn plain_options() -> BoxedStrategy<BuildingOptions> {
    let rooms = prop_oneof![
        20 => prop::collection::vec(room(), 1..4),
        2 => prop::collection::vec(room(), 4..9),
        // Many rooms of one kind.
        1 => (room(), 9usize..80).prop_map(|(room, count)| vec![room; count]),
    ];
    let lengths = [length(1.2, 10.0), length(2.4, 10.0), length(0.1, 1.0)];
    (rooms, 1u32..5, lengths, any::<u64>())
        .prop_map(|(rooms, storeys, [hallway_width_m, hallway_height_m, wall_m], seed)| BuildingOptions {
            storeys: storeys.min(rooms.len() as u32),
            rooms,
            hallway_width_m,
            hallway_height_m,
            wall_m,
            texture_scale: 0.01,
            seed,
            ..BuildingOptions::default()
        })
        .boxed()
}

fn with_models(options: BuildingOptions) -> BoxedStrategy<BuildingOptions> {
    let heights = || options.rooms.iter().flat_map(|room| room.heights_m);
    let lowest = heights().fold(options.hallway_height_m, f32::min);
    let is_level = options.rooms.iter().all(|room| room.heights_m[0] == room.heights_m[1]);
    let wings = (1u32..6, 0u32..8, length(0.5, 100.0)).prop_map(|(wings, more, courtyard_m)| {
        let least = if wings > 1 { 2 * wings } else { 1 };
        FloorPlan::Wings { wings, hallways: least + more, courtyard_m }
    });
    let plan = prop_oneof![Just(FloorPlan::OneHallway), wings];
    (models(lowest, is_level, options.hallway_width_m), plan)
        .prop_map(move |(models, plan)| BuildingOptions {
            models: Some(models),
            plan,
            wall_m: options.wall_m.max(0.15),
            ..options.clone()
        })
        .boxed()
}

fn without_models(mut options: BuildingOptions) -> BuildingOptions {
    for room in &mut options.rooms {
        if [RoomType::AUDITORIUM, RoomType::WC].contains(&room.room_type) {
            room.room_type = RoomType::OFFICE;
        }
    }
    options
}

fn options() -> impl Strategy<Value = BuildingOptions> {
    prop_oneof![plain_options().prop_map(without_models), plain_options().prop_flat_map(with_models)]
}

/// Whether this error may refuse options that are all in range: the building is too large, or the ceiling too
/// low for a board above a sofa.
fn is_refusal(error: &BuildingError) -> bool {
    let BuildingError::Range(error) = error else { return false };
    ["the length along", "the height of the floor", "the size of boards"]
        .iter()
        .any(|w| error.what.contains(w))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn what_is_generated_can_be_built(options in options()) {
        let building = match Building::generate(&options) {
            Ok(building) => building,
            Err(error) => {
                prop_assert!(is_refusal(&error), "{}", error);
                let other = BuildingOptions { seed: options.seed ^ 1, ..options };
                prop_assert_eq!(Building::generate(&other).unwrap_err(), error);
                return Ok(());
            }
        };
        let scene = building.build();
        prop_assert!(scene.is_ok(), "{}", scene.unwrap_err());

        // Open doors may fill a short hallway.
        let rooms = building.rooms.iter().filter(|plan| plan.room.room_type != RoomType::HALLWAY);
        for plan in rooms {
            let is_seen = building.locations.iter().any(|location| plan.contains(location.position));
            prop_assert!(is_seen, "no location in {}", plan.room);
        }
    }
}
