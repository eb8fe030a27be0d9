//! What stands where: a hallway with an office and a conference room to its south and a lounge under a slanted roof to
//! its north. Building coordinates: metres, x to the east, y to the north.

use crate::construct::builder::Builder;
use crate::construct::furniture::*;
use crate::construct::shell::{Filling, Opening, Shell, Wall};
use crate::construct::things::*;
use crate::look::finishes::{Ceiling, Floor, Paint};
use crate::look::materials::*;
use crate::look::textures::{OAK as OAK_WOOD, Pattern, WALNUT as WALNUT_WOOD};
use s3d_geom::glam::{vec2, vec3};

const WALL_M: f32 = 0.15;
const DOOR_M: f32 = 2.1;

fn window(wall: Wall, from: f32, to: f32, heights: [f32; 2]) -> Opening {
    Opening { wall, span: [from, to], heights, filling: Filling::Window }
}

fn door(wall: Wall, from: f32, to: f32, filling: Filling) -> Opening {
    Opening { wall, span: [from, to], heights: [0.0, DOOR_M], filling }
}

fn swung(hinge_left: bool, open_deg: f32) -> Filling {
    Filling::Door { thickness: WALL_M, hinge_left, open_deg }
}

/// Builds a room: what is in it first, so that it throws its shade on the shell.
fn room(b: &mut Builder, name: &'static str, shell: &Shell, furnish: impl FnOnce(&mut Builder)) {
    b.enter(name, shell.light());
    shell.fill(b);
    furnish(b);
    shell.build(b, name);
}

/// All rooms.
pub(crate) fn build(b: &mut Builder) {
    office(b);
    conference_room(b);
    lounge(b);
    hallway(b);
}

/// A thing in the middle of the room: at (x, y), on something `z` high, turned.
fn put(b: &mut Builder, [x, y, z]: [f32; 3], yaw_deg: f32, thing: impl FnOnce(&mut Builder)) {
    b.place(vec3(x, y, z), yaw_deg, thing);
}

fn office(b: &mut Builder) {
    let shell = Shell {
        low: vec2(0.0, 0.0),
        high: vec2(5.2, 4.5),
        heights: [2.8; 2],
        openings: vec![
            window(Wall::South, 0.6, 2.1, [0.9, 2.1]),
            window(Wall::South, 2.9, 4.6, [0.9, 2.1]),
            door(Wall::North, 3.9, 4.8, swung(false, 104.0)),
        ],
        hole: None,
        lamps: vec![[1.5, 2.3, 0.6, 1.2], [3.7, 2.3, 0.6, 1.2]],
        paint: Paint { color: [228.0, 226.0, 214.0], band: None, skirting: [196.0, 192.0, 182.0] },
        accent: Some((
            Wall::North,
            Paint { color: [158.0, 182.0, 172.0], band: None, skirting: [196.0, 192.0, 182.0] },
        )),
        floor: Floor::CarpetTiles([112.0, 120.0, 132.0]),
        ceiling: Ceiling::Tiles,
    };
    room(b, "office_1", &shell, |b| {
        // A desk at the west wall …
        put(b, [0.43, 1.75, 0.0], 90.0, |b| desk(b, 1.6, 0.78));
        put(b, [0.34, 1.85, 0.74], 96.0, |b| monitor(b, Pattern::Editor));
        put(b, [0.62, 1.8, 0.74], 92.0, keyboard);
        put(b, [0.6, 1.25, 0.74], 40.0, |b| mug(b, TEAL));
        put(b, [0.3, 2.38, 0.74], 100.0, desk_lamp);
        put(b, [0.55, 2.25, 0.74], 110.0, papers);
        put(b, [1.15, 1.72, 0.0], -74.0, |b| office_chair(b, BLUE_FABRIC));
        // … and one under the window.
        put(b, [3.75, 0.56, 0.0], 180.0, |b| desk(b, 1.6, 0.78));
        put(b, [3.7, 0.42, 0.74], 176.0, |b| monitor(b, Pattern::Chart));
        put(b, [3.7, 0.74, 0.74], 180.0, keyboard);
        put(b, [3.2, 0.6, 0.74], 200.0, papers);
        put(b, [4.25, 0.72, 0.74], 10.0, |b| mug(b, YELLOW));
        put(b, [3.85, 1.3, 0.0], 20.0, |b| office_chair(b, GREY_FABRIC));
        put(b, [5.02, 2.1, 0.0], -90.0, |b| bookcase(b, 0.95, 5, OAK, 1));
        put(b, [5.02, 3.07, 0.0], -90.0, |b| bookcase(b, 0.95, 5, OAK, 2));
        shell.at_wall(b, Wall::North, 1.75, |b| {
            hanging(b, "board", 2.0, [0.95, 2.06], Pattern::Whiteboard, STEEL);
            pen_tray(b, 0.9, 0.95);
        });
        shell.at_wall(b, Wall::West, 3.35, |b| {
            hanging(b, "clutter", 0.6, [1.2, 2.04], Pattern::Poster, BLACK)
        });
        shell.at_wall(b, Wall::South, 2.5, |b| column(b, 0.34, 0.3, 2.8));
        shell.at_wall(b, Wall::South, 1.35, |b| radiator(b, 1.3));
        put(b, [0.42, 4.08, 0.0], 0.0, |b| plant(b, 1.1, CLAY));
        put(b, [2.55, 0.52, 0.0], 0.0, |b| bin(b, BLACK));
        put(b, [4.92, 0.3, 0.0], 8.0, |b| carton(b, [0.44, 0.36, 0.34]));
        put(b, [4.9, 0.32, 0.34], -14.0, |b| carton(b, [0.36, 0.3, 0.24]));
        put(b, [4.88, 0.84, 0.0], 24.0, |b| carton(b, [0.4, 0.32, 0.3]));
    });
}

fn conference_room(b: &mut Builder) {
    let shell = Shell {
        low: vec2(5.35, 0.0),
        high: vec2(13.0, 4.5),
        heights: [2.9; 2],
        openings: vec![
            window(Wall::South, 6.2, 7.8, [0.9, 2.1]),
            window(Wall::South, 8.6, 10.0, [0.9, 2.1]),
            window(Wall::South, 10.7, 12.3, [0.9, 2.1]),
            door(Wall::North, 6.0, 6.9, swung(true, 100.0)),
        ],
        // The tile that is missing from the ceiling: the seventh along x, the sixth along y.
        hole: Some([vec2(5.35 + 3.6, 3.0), vec2(5.35 + 4.2, 3.6)]),
        lamps: vec![[7.1, 2.1, 1.2, 0.6], [9.25, 2.1, 1.2, 0.6], [12.0, 2.1, 0.6, 1.2]],
        paint: Paint { color: [232.0, 228.0, 218.0], band: None, skirting: [120.0, 84.0, 58.0] },
        accent: Some((
            Wall::West,
            Paint { color: [74.0, 100.0, 128.0], band: None, skirting: [120.0, 84.0, 58.0] },
        )),
        floor: Floor::PlanksAlongX(&OAK_WOOD),
        ceiling: Ceiling::Tiles,
    };
    room(b, "conferenceRoom_1", &shell, |b| {
        put(b, [9.2, 2.15, 0.0], 0.0, |b| table(b, 3.4, 1.2, 0.74, WALNUT));
        for (x, south, north) in [(8.05, 172.0, 8.0), (9.2, 186.0, -6.0), (10.3, 178.0, 14.0)] {
            put(b, [x, 1.28, 0.0], south, |b| chair(b, RUST_FABRIC));
            put(b, [x + 0.05, 3.04, 0.0], north, |b| chair(b, RUST_FABRIC));
        }
        put(b, [7.1, 2.1, 0.0], 84.0, |b| chair(b, RUST_FABRIC));
        put(b, [11.35, 2.25, 0.0], -110.0, |b| chair(b, RUST_FABRIC));
        put(b, [9.3, 1.85, 0.74], 184.0, laptop);
        put(b, [8.2, 2.45, 0.74], 10.0, laptop);
        put(b, [8.7, 1.8, 0.74], 30.0, |b| mug(b, WHITE));
        put(b, [10.2, 2.4, 0.74], 130.0, |b| mug(b, RED));
        put(b, [10.3, 1.95, 0.74], 170.0, papers);
        put(b, [8.75, 2.4, 0.74], 20.0, papers);
        put(b, [7.85, 1.9, 0.74], 80.0, papers);
        shell.at_wall(b, Wall::East, 2.3, |b| {
            hanging(b, "board", 2.4, [0.9, 2.2], Pattern::Whiteboard, STEEL);
            pen_tray(b, 1.2, 0.9);
        });
        shell.at_wall(b, Wall::North, 8.9, |b| {
            hanging(b, "board", 1.5, [1.0, 1.9], Pattern::Plan, WALNUT);
        });
        shell.at_wall(b, Wall::West, 2.1, |b| wall_screen(b, 1.5, [1.1, 1.95]));
        put(b, [5.56, 2.1, 0.0], 90.0, |b| bookcase(b, 1.7, 2, WALNUT, 3));
        put(b, [11.0, 4.32, 0.0], 0.0, |b| bookcase(b, 1.1, 5, WALNUT, 4));
        put(b, [12.12, 4.32, 0.0], 0.0, |b| bookcase(b, 1.1, 5, WALNUT, 5));
        for x in [8.2, 10.35] {
            shell.at_wall(b, Wall::South, x, |b| column(b, 0.34, 0.22, 2.66));
            beam(b, vec3(x, 0.0, 2.9), vec3(x, 4.5, 2.9), 0.17, 0.24, CONCRETE);
        }
        for x in [7.0, 9.3, 11.5] {
            shell.at_wall(b, Wall::South, x, |b| radiator(b, 1.3));
        }
        put(b, [12.6, 0.48, 0.0], 30.0, |b| plant(b, 1.3, WHITE));
        put(b, [5.75, 0.45, 0.0], 70.0, |b| plant(b, 0.9, TEAL));
        put(b, [5.6, 3.28, 0.0], 0.0, |b| bin(b, STEEL));
    });
}

fn lounge(b: &mut Builder) {
    let shell = Shell {
        low: vec2(3.0, 6.6),
        high: vec2(10.0, 11.0),
        heights: [3.5, 2.4],
        openings: vec![
            window(Wall::North, 3.9, 5.7, [0.8, 2.1]),
            window(Wall::North, 6.7, 8.7, [0.8, 2.1]),
            door(Wall::South, 4.2, 5.2, swung(false, 108.0)),
        ],
        hole: None,
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
        floor: Floor::PlanksAlongY(&WALNUT_WOOD),
        ceiling: Ceiling::Boards,
    };
    room(b, "lounge_1", &shell, |b| {
        put(b, [7.45, 8.7, 0.0], 0.0, rug);
        put(b, [9.52, 8.7, 0.0], -90.0, |b| sofa(b, 3, BLUE_FABRIC, RUST_FABRIC));
        put(b, [7.6, 10.4, 0.0], 3.0, |b| sofa(b, 2, GREY_FABRIC, BLUE_FABRIC));
        put(b, [7.6, 8.75, 0.012], 4.0, |b| table(b, 1.15, 0.65, 0.42, OAK));
        put(b, [7.35, 8.7, 0.432], 70.0, |b| mug(b, YELLOW));
        put(b, [7.85, 8.85, 0.432], 30.0, papers);
        put(b, [4.75, 9.1, 0.0], 0.0, |b| round_table(b, 0.42, 1.02, OAK));
        for (x, y, yaw) in [(4.15, 9.3, 0.0), (5.2, 9.5, 20.0), (4.8, 8.42, 40.0)] {
            put(b, [x, y, 0.0], yaw, |b| stool(b, RUST_FABRIC));
        }
        put(b, [4.65, 9.15, 1.02], 200.0, laptop);
        put(b, [4.98, 8.95, 1.02], 0.0, |b| mug(b, TEAL));
        put(b, [3.18, 8.0, 0.0], 90.0, |b| bookcase(b, 1.1, 5, OAK, 6));
        put(b, [3.18, 9.12, 0.0], 90.0, |b| bookcase(b, 1.1, 3, OAK, 7));
        put(b, [9.55, 10.4, 0.0], 0.0, floor_lamp);
        put(b, [3.5, 10.5, 0.0], 50.0, |b| plant(b, 1.2, TEAL));
        put(b, [9.5, 7.1, 0.0], 10.0, |b| plant(b, 1.4, CLAY));
        shell.at_wall(b, Wall::South, 7.2, |b| {
            hanging(b, "clutter", 1.8, [1.15, 2.35], Pattern::Landscape, WALNUT);
        });
        shell.at_wall(b, Wall::East, 8.7, |b| {
            hanging(b, "clutter", 0.62, [1.35, 2.2], Pattern::Poster, WHITE);
        });
        for x in [4.6, 6.4, 8.2] {
            let [south, north] = [6.6, 11.0].map(|y| vec3(x, y, shell.ceiling_at(y)));
            beam(b, south, north, 0.07, 0.2, WALNUT);
        }
        put(b, [6.2, 7.0, 0.0], 12.0, |b| carton(b, [0.5, 0.36, 0.36]));
    });
}

fn hallway(b: &mut Builder) {
    let shell = Shell {
        low: vec2(0.0, 4.65),
        high: vec2(13.0, 6.45),
        heights: [2.6; 2],
        openings: vec![
            door(Wall::South, 3.9, 4.8, Filling::Nothing),
            door(Wall::South, 6.0, 6.9, Filling::Nothing),
            door(Wall::North, 4.2, 5.2, Filling::Nothing),
            window(Wall::West, 4.95, 6.15, [0.8, 2.1]),
            door(Wall::East, 5.1, 6.0, Filling::ShutDoor),
        ],
        hole: None,
        lamps: vec![[1.5, 5.55, 1.2, 0.3], [5.6, 5.55, 1.2, 0.3], [10.6, 5.55, 1.2, 0.3]],
        paint: Paint {
            color: [236.0, 232.0, 220.0],
            band: Some((1.0, 1.12, [96.0, 138.0, 146.0])),
            skirting: [108.0, 116.0, 120.0],
        },
        accent: None,
        floor: Floor::Terrazzo,
        ceiling: Ceiling::Plaster,
    };
    room(b, "hallway_1", &shell, |b| {
        for x in [2.8, 8.2] {
            beam(b, vec3(x, 4.65, 2.6), vec3(x, 6.45, 2.6), 0.12, 0.2, WHITE);
        }
        shell.at_wall(b, Wall::North, 9.6, |b| {
            hanging(b, "board", 1.5, [1.15, 2.1], Pattern::Cork, OAK);
        });
        shell.at_wall(b, Wall::South, 9.4, |b| {
            hanging(b, "clutter", 1.1, [1.2, 1.95], Pattern::Landscape, BLACK);
        });
        shell.at_wall(b, Wall::North, 7.1, |b| {
            hanging(b, "clutter", 0.6, [1.25, 2.05], Pattern::Poster, STEEL);
        });
        shell.at_wall(b, Wall::South, 5.4, extinguisher);
        put(b, [2.2, 6.1, 0.0], 0.0, copier);
        put(b, [1.5, 6.2, 0.0], 4.0, |b| carton(b, [0.44, 0.34, 0.32]));
        put(b, [1.48, 6.22, 0.32], -8.0, |b| carton(b, [0.38, 0.3, 0.2]));
        put(b, [6.3, 6.25, 0.0], 0.0, |b| bin(b, TEAL));
        put(b, [12.6, 6.08, 0.0], 0.0, |b| plant(b, 1.2, WHITE));
        put(b, [11.0, 6.12, 0.0], 0.0, |b| chair(b, BLUE_FABRIC));
        put(b, [11.6, 6.12, 0.0], 0.0, |b| chair(b, BLUE_FABRIC));
        put(b, [12.55, 4.86, 0.0], 180.0, |b| bookcase(b, 0.8, 3, WALNUT, 8));
        put(b, [0.37, 6.08, 0.0], 20.0, |b| plant(b, 1.0, CLAY));
    });
}
