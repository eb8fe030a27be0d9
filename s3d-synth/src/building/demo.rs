//! The building of `s3d demo`: a hallway with an office and a conference room to its south and a lounge under
//! a slanted roof to its north.

use super::{Beam, Building, Filling, Item, Opening, RoomPlan, ScanLocation, Thing, Wall};
use crate::look::*;
use Thing::{
    Bin, Chair, Copier, DeskLamp, Extinguisher, FloorLamp, Keyboard, Laptop, Monitor, Mug, OfficeChair,
    Papers, Rug, Stool, WallScreen,
};
use s3d_geom::glam::{DVec3, Vec3, vec2};
use s3d_label::{Room, RoomType};

pub(super) const WALL_M: f32 = 0.15;
const DOOR_M: f32 = 2.1;

impl Building {
    /// The building of `s3d demo`: three rooms and a hallway of about 120 m². It has the peculiarities of a
    /// scan: textures with light and shade in them, windows as opaque surfaces, open doors, a slanted
    /// ceiling, all 13 classes, and a place that was not captured (a tile of the conference room's ceiling).
    pub fn demo() -> Self {
        Self {
            title: "The built-in scene of s3d: three rooms and a hallway".to_owned(),
            origin: Vec3::new(10.0, 5.0, 0.0),
            rooms: vec![office(), conference_room(), lounge(), hallway()],
            locations: LOCATIONS
                .map(|(uuid, position, yaw_deg)| ScanLocation {
                    uuid: uuid.to_owned(),
                    position: DVec3::from_array(position),
                    yaw_rad: yaw_deg.to_radians(),
                })
                .to_vec(),
            texture_scale: 1.0,
        }
    }
}

/// Scan locations: building coordinates and heading in degrees.
const LOCATIONS: [(&str, [f64; 3], f64); 6] = [
    // Office, towards its desks and the whiteboard.
    ("0c5a7d1e93b84f62a1d7e0f4b2683c95", [4.15, 2.75, 1.5], 86.0),
    // Conference room: from the door, and from the far corner.
    ("2f91c04b7ae64d38b5160d9a83ce7f24", [6.9, 3.35, 1.52], -118.0),
    ("5b3e8a76d0f1492c8e47a92b6c1d05f3", [12.0, 1.1, 1.48], 62.5),
    // Lounge.
    ("7d20f6b91c354ea89a03c8e571b4d26e", [5.9, 8.1, 1.55], -64.0),
    // Hallway, between the doors, and at its far end.
    ("93e6b1d45f7c40a2bd98127f0e3ac56b", [5.65, 5.5, 1.5], 90.0),
    ("c48d2a0f6b9143e7952fe1b07d83a6c1", [11.2, 5.45, 1.46], 81.0),
];

// Short words, so that a room can be read as a list.

pub(super) fn window(wall: Wall, from: f32, to: f32, heights: [f32; 2]) -> Opening {
    Opening { wall, span: [from, to], heights, filling: Filling::Window }
}

pub(super) fn door(wall: Wall, from: f32, to: f32, filling: Filling) -> Opening {
    Opening { wall, span: [from, to], heights: [0.0, DOOR_M], filling }
}

pub(super) fn swung(hinge_left: bool, open_deg: f32) -> Filling {
    Filling::Door { thickness_m: WALL_M, hinge_left, open_deg }
}

pub(super) fn put(position: [f32; 3], yaw_deg: f32, thing: Thing) -> Item {
    Item::standing(position, yaw_deg, thing)
}

pub(super) fn on(wall: Wall, along: f32, thing: Thing) -> Item {
    Item::on_wall(wall, along, thing)
}

fn beam(x: f32, [south, north]: [f32; 2], half_width_m: f32, depth_m: f32, look: Look) -> Item {
    Item::Beam(Beam { from: vec2(x, south), to: vec2(x, north), half_width_m, depth_m, look })
}

pub(super) const DESK: Thing = Thing::Desk { width_m: 1.6, depth_m: 0.78 };
const RADIATOR: Thing = Thing::Radiator { width_m: 1.3 };

pub(super) fn table([width_m, depth_m, height_m]: [f32; 3], top: Look) -> Thing {
    Thing::Table { width_m, depth_m, height_m, top }
}

pub(super) fn sofa(seats: u32, fabric: Look, cushion: Look) -> Thing {
    Thing::Sofa { seats, fabric, cushion }
}

pub(super) fn bookcase(width_m: f32, shelves: u32, wood: Look, seed: u32) -> Thing {
    Thing::Bookcase { width_m, shelves, wood, seed }
}

fn board(width_m: f32, heights_m: [f32; 2], picture: Pattern, frame: Look, tray_m: Option<f32>) -> Thing {
    Thing::Board { width_m, heights_m, picture, frame, tray_m }
}

fn picture(width_m: f32, heights_m: [f32; 2], picture: Pattern, frame: Look) -> Thing {
    Thing::Picture { width_m, heights_m, picture, frame }
}

fn plant(height_m: f32, pot: Look) -> Thing {
    Thing::Plant { height_m, pot }
}

fn carton(size_m: [f32; 3]) -> Thing {
    Thing::Carton { size_m }
}

fn column([width_m, depth_m, height_m]: [f32; 3]) -> Thing {
    Thing::Column { width_m, depth_m, height_m }
}

fn office() -> RoomPlan {
    RoomPlan {
        room: Room { room_type: RoomType::OFFICE, number: 1 },
        low: vec2(0.0, 0.0),
        high: vec2(5.2, 4.5),
        floor_m: 0.0,
        heights_m: [2.8; 2],
        openings: vec![
            window(Wall::South, 0.6, 2.1, [0.9, 2.1]),
            window(Wall::South, 2.9, 4.6, [0.9, 2.1]),
            door(Wall::North, 3.9, 4.8, swung(false, 104.0)),
        ],
        ceiling_hole: None,
        stairwell: None,
        lamps: vec![[1.5, 2.3, 0.6, 1.2], [3.7, 2.3, 0.6, 1.2]],
        paint: Paint { color: [228.0, 226.0, 214.0], band: None, skirting: [196.0, 192.0, 182.0] },
        accent: Some((
            Wall::North,
            Paint { color: [158.0, 182.0, 172.0], band: None, skirting: [196.0, 192.0, 182.0] },
        )),
        floor: FloorFinish::CarpetTiles([112.0, 120.0, 132.0]),
        ceiling: CeilingFinish::Tiles,
        items: vec![
            // A desk at the west wall …
            put([0.43, 1.75, 0.0], 90.0, DESK),
            put([0.34, 1.85, 0.74], 96.0, Monitor(Pattern::Editor)),
            put([0.62, 1.8, 0.74], 92.0, Keyboard),
            put([0.6, 1.25, 0.74], 40.0, Mug(TEAL)),
            put([0.3, 2.38, 0.74], 100.0, DeskLamp),
            put([0.55, 2.25, 0.74], 110.0, Papers),
            put([1.15, 1.72, 0.0], -74.0, OfficeChair(BLUE_FABRIC)),
            // … and one under the window.
            put([3.75, 0.56, 0.0], 180.0, DESK),
            put([3.7, 0.42, 0.74], 176.0, Monitor(Pattern::Chart)),
            put([3.7, 0.74, 0.74], 180.0, Keyboard),
            put([3.2, 0.6, 0.74], 200.0, Papers),
            put([4.25, 0.72, 0.74], 10.0, Mug(YELLOW)),
            put([3.85, 1.3, 0.0], 20.0, OfficeChair(GREY_FABRIC)),
            put([5.02, 2.1, 0.0], -90.0, bookcase(0.95, 5, OAK, 1)),
            put([5.02, 3.07, 0.0], -90.0, bookcase(0.95, 5, OAK, 2)),
            on(Wall::North, 1.75, board(2.0, [0.95, 2.06], Pattern::Whiteboard, STEEL, Some(0.9))),
            on(Wall::West, 3.35, picture(0.6, [1.2, 2.04], Pattern::Poster, BLACK)),
            on(Wall::South, 2.5, column([0.34, 0.3, 2.8])),
            on(Wall::South, 1.35, RADIATOR),
            put([0.42, 4.08, 0.0], 0.0, plant(1.1, CLAY)),
            put([2.55, 0.52, 0.0], 0.0, Bin(BLACK)),
            put([4.92, 0.3, 0.0], 8.0, carton([0.44, 0.36, 0.34])),
            put([4.9, 0.32, 0.34], -14.0, carton([0.36, 0.3, 0.24])),
            put([4.88, 0.84, 0.0], 24.0, carton([0.4, 0.32, 0.3])),
        ],
    }
}

fn conference_room() -> RoomPlan {
    RoomPlan {
        room: Room { room_type: RoomType::CONFERENCE_ROOM, number: 1 },
        low: vec2(5.35, 0.0),
        high: vec2(13.0, 4.5),
        floor_m: 0.0,
        heights_m: [2.9; 2],
        openings: vec![
            window(Wall::South, 6.2, 7.8, [0.9, 2.1]),
            window(Wall::South, 8.6, 10.0, [0.9, 2.1]),
            window(Wall::South, 10.7, 12.3, [0.9, 2.1]),
            door(Wall::North, 6.0, 6.9, swung(true, 100.0)),
        ],
        // The tile that is missing from the ceiling: the seventh along x, the sixth along y.
        ceiling_hole: Some([vec2(5.35 + 3.6, 3.0), vec2(5.35 + 4.2, 3.6)]),
        stairwell: None,
        lamps: vec![[7.1, 2.1, 1.2, 0.6], [9.25, 2.1, 1.2, 0.6], [12.0, 2.1, 0.6, 1.2]],
        paint: Paint { color: [232.0, 228.0, 218.0], band: None, skirting: [120.0, 84.0, 58.0] },
        accent: Some((
            Wall::West,
            Paint { color: [74.0, 100.0, 128.0], band: None, skirting: [120.0, 84.0, 58.0] },
        )),
        floor: FloorFinish::PlanksAlongX(Wood::OAK),
        ceiling: CeilingFinish::Tiles,
        items: vec![
            put([9.2, 2.15, 0.0], 0.0, table([3.4, 1.2, 0.74], WALNUT)),
            put([8.05, 1.28, 0.0], 172.0, Chair(RUST_FABRIC)),
            put([8.05 + 0.05, 3.04, 0.0], 8.0, Chair(RUST_FABRIC)),
            put([9.2, 1.28, 0.0], 186.0, Chair(RUST_FABRIC)),
            put([9.2 + 0.05, 3.04, 0.0], -6.0, Chair(RUST_FABRIC)),
            put([10.3, 1.28, 0.0], 178.0, Chair(RUST_FABRIC)),
            put([10.3 + 0.05, 3.04, 0.0], 14.0, Chair(RUST_FABRIC)),
            put([7.1, 2.1, 0.0], 84.0, Chair(RUST_FABRIC)),
            put([11.35, 2.25, 0.0], -110.0, Chair(RUST_FABRIC)),
            put([9.3, 1.85, 0.74], 184.0, Laptop),
            put([8.2, 2.45, 0.74], 10.0, Laptop),
            put([8.7, 1.8, 0.74], 30.0, Mug(WHITE)),
            put([10.2, 2.4, 0.74], 130.0, Mug(RED)),
            put([10.3, 1.95, 0.74], 170.0, Papers),
            put([8.75, 2.4, 0.74], 20.0, Papers),
            put([7.85, 1.9, 0.74], 80.0, Papers),
            on(Wall::East, 2.3, board(2.4, [0.9, 2.2], Pattern::Whiteboard, STEEL, Some(1.2))),
            on(Wall::North, 8.9, board(1.5, [1.0, 1.9], Pattern::Plan, WALNUT, None)),
            on(Wall::West, 2.1, WallScreen { width_m: 1.5, heights_m: [1.1, 1.95] }),
            put([5.56, 2.1, 0.0], 90.0, bookcase(1.7, 2, WALNUT, 3)),
            put([11.0, 4.32, 0.0], 0.0, bookcase(1.1, 5, WALNUT, 4)),
            put([12.12, 4.32, 0.0], 0.0, bookcase(1.1, 5, WALNUT, 5)),
            on(Wall::South, 8.2, column([0.34, 0.22, 2.66])),
            beam(8.2, [0.0, 4.5], 0.17, 0.24, CONCRETE),
            on(Wall::South, 10.35, column([0.34, 0.22, 2.66])),
            beam(10.35, [0.0, 4.5], 0.17, 0.24, CONCRETE),
            on(Wall::South, 7.0, RADIATOR),
            on(Wall::South, 9.3, RADIATOR),
            on(Wall::South, 11.5, RADIATOR),
            put([12.6, 0.48, 0.0], 30.0, plant(1.3, WHITE)),
            put([5.75, 0.45, 0.0], 70.0, plant(0.9, TEAL)),
            put([5.6, 3.28, 0.0], 0.0, Bin(STEEL)),
        ],
    }
}

fn lounge() -> RoomPlan {
    RoomPlan {
        room: Room { room_type: RoomType::LOUNGE, number: 1 },
        low: vec2(3.0, 6.6),
        high: vec2(10.0, 11.0),
        floor_m: 0.0,
        heights_m: [3.5, 2.4],
        openings: vec![
            window(Wall::North, 3.9, 5.7, [0.8, 2.1]),
            window(Wall::North, 6.7, 8.7, [0.8, 2.1]),
            door(Wall::South, 4.2, 5.2, swung(false, 108.0)),
        ],
        ceiling_hole: None,
        stairwell: None,
        lamps: vec![[5.4, 8.4, 0.4, 0.4], [7.4, 8.4, 0.4, 0.4]],
        paint: Paint { color: [236.0, 226.0, 206.0], band: None, skirting: [236.0, 232.0, 222.0] },
        accent: Some((
            Wall::East,
            Paint {
                color: [206.0, 132.0, 96.0],
                band: Some((0.0, 1.05, [186.0, 112.0, 80.0])),
                skirting: [236.0, 232.0, 222.0],
            },
        )),
        floor: FloorFinish::PlanksAlongY(Wood::WALNUT),
        ceiling: CeilingFinish::Boards,
        items: vec![
            put([7.45, 8.7, 0.0], 0.0, Rug),
            put([9.52, 8.7, 0.0], -90.0, sofa(3, BLUE_FABRIC, RUST_FABRIC)),
            put([7.6, 10.4, 0.0], 3.0, sofa(2, GREY_FABRIC, BLUE_FABRIC)),
            put([7.6, 8.75, 0.012], 4.0, table([1.15, 0.65, 0.42], OAK)),
            put([7.35, 8.7, 0.432], 70.0, Mug(YELLOW)),
            put([7.85, 8.85, 0.432], 30.0, Papers),
            put([4.75, 9.1, 0.0], 0.0, Thing::RoundTable { radius_m: 0.42, height_m: 1.02, top: OAK }),
            put([4.15, 9.3, 0.0], 0.0, Stool(RUST_FABRIC)),
            put([5.2, 9.5, 0.0], 20.0, Stool(RUST_FABRIC)),
            put([4.8, 8.42, 0.0], 40.0, Stool(RUST_FABRIC)),
            put([4.65, 9.15, 1.02], 200.0, Laptop),
            put([4.98, 8.95, 1.02], 0.0, Mug(TEAL)),
            put([3.18, 8.0, 0.0], 90.0, bookcase(1.1, 5, OAK, 6)),
            put([3.18, 9.12, 0.0], 90.0, bookcase(1.1, 3, OAK, 7)),
            put([9.55, 10.4, 0.0], 0.0, FloorLamp),
            put([3.5, 10.5, 0.0], 50.0, plant(1.2, TEAL)),
            put([9.5, 7.1, 0.0], 10.0, plant(1.4, CLAY)),
            on(Wall::South, 7.2, picture(1.8, [1.15, 2.35], Pattern::Landscape, WALNUT)),
            on(Wall::East, 8.7, picture(0.62, [1.35, 2.2], Pattern::Poster, WHITE)),
            beam(4.6, [6.6, 11.0], 0.07, 0.2, WALNUT),
            beam(6.4, [6.6, 11.0], 0.07, 0.2, WALNUT),
            beam(8.2, [6.6, 11.0], 0.07, 0.2, WALNUT),
            put([6.2, 7.0, 0.0], 12.0, carton([0.5, 0.36, 0.36])),
        ],
    }
}

fn hallway() -> RoomPlan {
    RoomPlan {
        room: Room { room_type: RoomType::HALLWAY, number: 1 },
        low: vec2(0.0, 4.65),
        high: vec2(13.0, 6.45),
        floor_m: 0.0,
        heights_m: [2.6; 2],
        openings: vec![
            door(Wall::South, 3.9, 4.8, Filling::Nothing),
            door(Wall::South, 6.0, 6.9, Filling::Nothing),
            door(Wall::North, 4.2, 5.2, Filling::Nothing),
            window(Wall::West, 4.95, 6.15, [0.8, 2.1]),
            door(Wall::East, 5.1, 6.0, Filling::ShutDoor),
        ],
        ceiling_hole: None,
        stairwell: None,
        lamps: vec![[1.5, 5.55, 1.2, 0.3], [5.6, 5.55, 1.2, 0.3], [10.6, 5.55, 1.2, 0.3]],
        paint: Paint {
            color: [236.0, 232.0, 220.0],
            band: Some((1.0, 1.12, [96.0, 138.0, 146.0])),
            skirting: [108.0, 116.0, 120.0],
        },
        accent: None,
        floor: FloorFinish::Terrazzo,
        ceiling: CeilingFinish::Plaster,
        items: vec![
            beam(2.8, [4.65, 6.45], 0.12, 0.2, WHITE),
            beam(8.2, [4.65, 6.45], 0.12, 0.2, WHITE),
            on(Wall::North, 9.6, board(1.5, [1.15, 2.1], Pattern::Cork, OAK, None)),
            on(Wall::South, 9.4, picture(1.1, [1.2, 1.95], Pattern::Landscape, BLACK)),
            on(Wall::North, 7.1, picture(0.6, [1.25, 2.05], Pattern::Poster, STEEL)),
            on(Wall::South, 5.4, Extinguisher),
            put([2.2, 6.1, 0.0], 0.0, Copier),
            put([1.5, 6.2, 0.0], 4.0, carton([0.44, 0.34, 0.32])),
            put([1.48, 6.22, 0.32], -8.0, carton([0.38, 0.3, 0.2])),
            put([6.3, 6.25, 0.0], 0.0, Bin(TEAL)),
            put([12.6, 6.08, 0.0], 0.0, plant(1.2, WHITE)),
            put([11.0, 6.12, 0.0], 0.0, Chair(BLUE_FABRIC)),
            put([11.6, 6.12, 0.0], 0.0, Chair(BLUE_FABRIC)),
            put([12.55, 4.86, 0.0], 180.0, bookcase(0.8, 3, WALNUT, 8)),
            put([0.37, 6.08, 0.0], 20.0, plant(1.0, CLAY)),
        ],
    }
}
