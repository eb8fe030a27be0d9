//! A small house of two storeys with stairs between them.

use super::demo::{DESK, WALL_M, bookcase, door, on, put, sofa, swung, table, window};
use super::{Building, Filling, Item, Opening, RoomPlan, ScanLocation, Stairwell, Thing, Wall};
use crate::look::*;
use s3d_geom::glam::{DVec3, Vec2, Vec3, vec2};
use s3d_label::{Room, RoomType};

const CEILING_M: f32 = 2.7;
/// The distance between a ceiling and the floor above it.
const SLAB_M: f32 = 0.15;
/// The number of treads. The floor above is one riser higher.
const STEPS: u32 = 15;
const TREAD_M: f32 = 0.26;
/// The place where the stairs begin, and the opening above them, which leaves room for a person's head.
const STAIRS_Y: f32 = 1.2;
const WELL: [Vec2; 2] = [vec2(0.0, 2.2), vec2(1.15, STAIRS_Y + STEPS as f32 * TREAD_M)];

impl Building {
    /// A house of two storeys of 45 m² each: a lounge with open stairs, a storage and a pantry below, a
    /// hallway with the stairwell and two offices above. One walks from every room to every other.
    ///
    /// ```
    /// let building = s3d_synth::Building { texture_scale: 0.1, ..s3d_synth::Building::two_storeys() };
    /// let storey = |room: usize| (building.rooms[room].floor_m / 2.85).round();
    /// assert_eq!([0, 2, 3, 5].map(storey), [0.0, 0.0, 1.0, 1.0]);
    /// assert!(building.build()?.mesh.aabb().max.z > 5.5);
    /// # Ok::<(), s3d_synth::BuildingError>(())
    /// ```
    pub fn two_storeys() -> Self {
        Self {
            title: "A house of two storeys".to_owned(),
            origin: Vec3::ZERO,
            rooms: vec![lounge(), storage(), pantry(), hallway(), office(1), office(2)],
            locations: LOCATIONS
                .map(|(uuid, position)| ScanLocation {
                    uuid: uuid.to_owned(),
                    position: DVec3::from_array(position),
                    yaw_rad: 0.0,
                })
                .to_vec(),
            texture_scale: 1.0,
        }
    }
}

/// One location in each room but the storage.
const LOCATIONS: [(&str, [f64; 3]); 5] = [
    ("1f0c7a52e9d84b36a7c15e08d24b9f61", [2.4, 3.2, 1.5]),
    ("62b8d3f1047e4c9ab5e92f6d71c0a834", [5.4, 4.6, 1.5]),
    ("a94e1d07c6b2483f8d50e7f329b61c75", [2.0, 3.4, 4.35]),
    ("d7530be84f1946c2be6a91c8075f2e3d", [4.8, 1.9, 4.35]),
    ("3e86f9c1b2a740d5940d7ce5168fa2b7", [4.8, 4.6, 4.35]),
];

fn room(
    room_type: RoomType,
    number: u32,
    [low, high]: [Vec2; 2],
    floor_m: f32,
    openings: Vec<Opening>,
) -> RoomPlan {
    let middle = 0.5 * (low + high);
    RoomPlan {
        room: Room { room_type, number },
        low,
        high,
        floor_m,
        heights_m: [CEILING_M; 2],
        openings,
        ceiling_hole: None,
        stairwell: None,
        lamps: vec![[middle.x, middle.y, 0.6, 0.6]],
        paint: Paint { color: [232.0, 228.0, 218.0], band: None, skirting: [150.0, 120.0, 90.0] },
        accent: None,
        floor: FloorFinish::PlanksAlongY(Wood::OAK),
        ceiling: CeilingFinish::Plaster,
        items: Vec::new(),
    }
}

fn passage(wall: Wall, from: f32, filling: Filling) -> Opening {
    door(wall, from, from + 0.9, filling)
}

fn lounge() -> RoomPlan {
    let stairs = Thing::Stairs {
        width_m: 1.05,
        steps: STEPS,
        tread_m: TREAD_M,
        riser_m: (CEILING_M + SLAB_M) / (STEPS + 1) as f32,
    };
    let openings = vec![
        window(Wall::South, 1.6, 3.2, [0.9, 2.1]),
        window(Wall::North, 1.6, 3.2, [0.9, 2.1]),
        passage(Wall::East, 1.2, Filling::Nothing),
        passage(Wall::East, 4.4, Filling::Nothing),
    ];
    RoomPlan {
        ceiling_hole: Some(WELL),
        items: vec![
            Item::standing([0.575, STAIRS_Y, 0.0], 0.0, stairs),
            put([2.6, 5.95, 0.0], 0.0, sofa(3, BLUE_FABRIC, RUST_FABRIC)),
            put([2.6, 4.7, 0.0], 0.0, table([1.2, 0.7, 0.42], OAK)),
            put([2.7, 1.2, 0.0], 0.0, table([1.4, 0.8, 0.74], WALNUT)),
            put([2.7, 2.0, 0.0], 0.0, Thing::Chair(RUST_FABRIC)),
        ],
        ..room(RoomType::LOUNGE, 1, [vec2(0.0, 0.0), vec2(4.0, 6.5)], 0.0, openings)
    }
}

fn storage() -> RoomPlan {
    let openings = vec![passage(Wall::West, 1.2, swung(false, 95.0))];
    RoomPlan {
        items: vec![
            put([6.8, 1.6, 0.0], -90.0, bookcase(1.6, 5, OAK, 11)),
            put([5.2, 0.4, 0.0], 0.0, Thing::Carton { size_m: [0.6, 0.5, 0.5] }),
            put([5.2, 0.4, 0.5], 12.0, Thing::Carton { size_m: [0.5, 0.4, 0.4] }),
        ],
        ..room(RoomType::STORAGE, 1, [vec2(4.0 + WALL_M, 0.0), vec2(7.0, 3.2)], 0.0, openings)
    }
}

fn pantry() -> RoomPlan {
    let openings =
        vec![passage(Wall::West, 4.4, swung(true, 100.0)), window(Wall::East, 4.2, 5.6, [0.9, 2.1])];
    RoomPlan {
        items: vec![
            put([5.9, 5.2, 0.0], 0.0, table([1.0, 1.0, 0.74], OAK)),
            put([5.9, 4.4, 0.0], 180.0, Thing::Stool(RUST_FABRIC)),
            on(
                Wall::North,
                5.0,
                Thing::Board {
                    width_m: 0.9,
                    heights_m: [1.2, 2.0],
                    picture: Pattern::Cork,
                    frame: OAK,
                    tray_m: None,
                },
            ),
        ],
        ..room(RoomType::PANTRY, 1, [vec2(4.0 + WALL_M, 3.2 + WALL_M), vec2(7.0, 6.5)], 0.0, openings)
    }
}

const UPPER_M: f32 = CEILING_M + SLAB_M;

fn hallway() -> RoomPlan {
    let openings = vec![
        window(Wall::South, 0.8, 2.2, [0.9, 2.1]),
        passage(Wall::East, 1.4, Filling::Nothing),
        passage(Wall::East, 4.6, Filling::Nothing),
    ];
    let [low, high] = WELL;
    RoomPlan {
        stairwell: Some(Stairwell { low, high, depth_m: SLAB_M }),
        items: vec![put([2.7, 0.5, 0.0], 0.0, Thing::Plant { height_m: 1.1, pot: CLAY })],
        ..room(RoomType::HALLWAY, 1, [vec2(0.0, 0.0), vec2(3.0, 6.5)], UPPER_M, openings)
    }
}

fn office(number: u32) -> RoomPlan {
    let (y, passage_y) = if number == 1 { (0.0, 1.4) } else { (3.2 + WALL_M, 4.6) };
    let openings = vec![
        passage(Wall::West, passage_y, swung(number == 1, 98.0)),
        window(Wall::East, y + 0.8, y + 2.2, [0.9, 2.1]),
    ];
    RoomPlan {
        items: vec![
            put([6.2, y + 1.5, 0.0], -90.0, DESK),
            put([5.5, y + 1.5, 0.0], 90.0, Thing::OfficeChair(GREY_FABRIC)),
        ],
        ..room(RoomType::OFFICE, number, [vec2(3.0 + WALL_M, y), vec2(7.0, y + 3.15)], UPPER_M, openings)
    }
}
