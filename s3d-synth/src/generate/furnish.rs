//! The things in rooms of each type.

use super::arrange::{Site, lamp_cells};
use super::inside::keep_inside;
use super::outfit::outfit;
use super::space::{Frame, Space};
use super::{BuildingOptions, Style, between, pick};
use crate::building::{Beam, Item, RoomPlan, ScanLocation, Thing, Wall};
use crate::look::{BLACK, CONCRETE, Look, Pattern};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::{Vec2, vec2};
use s3d_label::RoomType;
use std::f32::consts::TAU;

/// Half of the free square around a scanner.
const STAND_M: f32 = 0.45;
/// Half of the free square around a scanner that stands between furniture.
const BETWEEN_M: f32 = 0.3;
const BEAM_DEPTH_M: f32 = 0.2;
const BEAM_HALF_M: f32 = 0.17;

/// A group of things that is placed as a whole.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Group {
    Workplace,
    MeetingTable,
    SofaCorner,
    CoffeeTable,
    BarTable,
    Bookcase { most_shelves: u32 },
    Copier,
    Chairs,
    Carton,
    Plant,
    Bin,
    FloorLamp,
    Board,
    Picture,
    WallScreen,
    Extinguisher,
}

/// Whether rooms of this type can be furnished.
pub(super) fn can_furnish(room_type: RoomType) -> bool {
    room_type != RoomType::HALLWAY && !groups(room_type, 20.0).is_empty()
}

/// The groups of a room of this area, the largest first, and the mean number of each.
fn groups(room_type: RoomType, area_m2: f32) -> Vec<(Group, f32)> {
    use Group::*;
    let low = Bookcase { most_shelves: 2 };
    let high = Bookcase { most_shelves: 5 };
    match room_type {
        RoomType::OFFICE => vec![
            (Workplace, (area_m2 / 9.0).min(4.0)),
            (Board, 1.0),
            (high, area_m2 / 14.0),
            (Picture, 1.0),
            (low, 0.6),
            (Plant, 1.0),
            (Carton, 1.5),
            (Bin, 1.0),
        ],
        RoomType::CONFERENCE_ROOM => vec![
            (MeetingTable, 1.0),
            (Board, 1.6),
            (WallScreen, 1.0),
            (high, 1.0),
            (low, 1.0),
            (Picture, 1.0),
            (Plant, 1.6),
            (Bin, 1.0),
        ],
        RoomType::LOUNGE | RoomType::LOBBY => vec![
            (CoffeeTable, area_m2 / 30.0),
            (SofaCorner, (area_m2 / 14.0).min(4.0)),
            (BarTable, 1.0),
            (high, 1.0),
            (Picture, 2.0),
            (low, 1.0),
            (FloorLamp, 1.0),
            (Plant, 2.0),
            (Bin, 1.0),
        ],
        RoomType::OPENSPACE => vec![
            (Workplace, area_m2 / 7.0),
            (SofaCorner, 0.5),
            (Board, 2.0),
            (high, area_m2 / 20.0),
            (Picture, 2.0),
            (Plant, area_m2 / 20.0),
            (Carton, 2.0),
            (Bin, area_m2 / 20.0),
        ],
        RoomType::PANTRY => {
            vec![(BarTable, area_m2 / 9.0), (high, 1.0), (low, 1.0), (Board, 0.6), (Plant, 1.0), (Bin, 1.0)]
        }
        RoomType::COPY_ROOM => {
            vec![(Copier, area_m2 / 6.0), (high, area_m2 / 6.0), (Board, 0.7), (Carton, 2.5), (Bin, 1.0)]
        }
        RoomType::STORAGE => vec![(high, area_m2 / 4.0), (low, 0.5), (Carton, area_m2 / 3.0), (Bin, 0.5)],
        RoomType::HALLWAY => vec![
            (Copier, 0.3),
            (Board, area_m2 / 20.0),
            (Extinguisher, 1.0 + area_m2 / 60.0),
            (Picture, area_m2 / 10.0),
            (Chairs, area_m2 / 25.0),
            (low, area_m2 / 40.0),
            (Plant, area_m2 / 15.0),
            (Bin, area_m2 / 30.0),
            (Carton, 0.5),
        ],
        _ => Vec::new(),
    }
}

/// Furnishes a room. Returns it with its scan locations.
pub(super) fn furnish(
    site: Site,
    options: &BuildingOptions,
    rng: &mut ChaCha8Rng,
) -> (RoomPlan, Vec<ScanLocation>) {
    let Site { plan: mut room, furnishing, locations, .. } = site;
    let style = &options.style;
    let mut space = Space::new(&room);

    // The first location is found before the furniture, so that every room has one. If furniture is as dense
    // as in published rooms, the other locations are found between it.
    let find = |space: &mut Space, rng: &mut ChaCha8Rng| {
        let by_wall = options
            .models
            .as_ref()
            .and_then(|_| space.find_stand_at_wall(rng, STAND_M));
        by_wall.or_else(|| space.find_stand(rng, STAND_M))
    };

    let first = if options.models.is_some() { 1 } else { locations };
    let mut stands: Vec<Vec2> = (0..first).map_while(|_| find(&mut space, rng)).collect();
    if stands.is_empty() {
        stands.extend(space.find_stand(rng, BETWEEN_M));
    }

    space.keep_ways_free(&room);
    let mut places = stand_at(&stands, room.floor_m, rng);

    if let Some(models) = options.models.as_ref().filter(|_| furnishing > 0.0) {
        outfit(&mut room, &mut space, (models, style), furnishing, rng);
    } else if furnishing > 0.0 {
        add_structure(&mut room, &mut space, rng);
        let size = room.high - room.low;
        for (group, count) in groups(room.room.room_type, size.x * size.y) {
            // 1.6 means two with a chance of 60 %, and one otherwise.
            let count = (count * furnishing + rng.random::<f32>()).floor() as u32;
            for _ in 0..count {
                let items = place(group, &mut space, [size.x, size.y], style, rng);
                room.items.extend(items);
            }
        }
    }

    keep_inside(&mut room);
    let more = (first..locations).map_while(|_| space.find_stand(rng, BETWEEN_M));
    let more: Vec<Vec2> = more.collect();
    places.extend(stand_at(&more, room.floor_m, rng));

    (room, places)
}

/// Makes scan locations at places in the plan.
fn stand_at(plan: &[Vec2], floor_m: f32, rng: &mut ChaCha8Rng) -> Vec<ScanLocation> {
    plan.iter()
        .map(|p| ScanLocation {
            uuid: format!("{:016x}{:016x}", rng.random::<u64>(), rng.random::<u64>()),
            position: p.extend(floor_m + between(rng, 1.4, 1.6)).as_dvec3(),
            yaw_rad: f64::from(between(rng, -180.0, 180.0)).to_radians(),
        })
        .collect()
}

/// Adds beams between the lamps, columns under them at outer walls, and radiators under windows.
fn add_structure(room: &mut RoomPlan, space: &mut Space, rng: &mut ChaCha8Rng) {
    let low = room.low;
    let high = room.high;
    let lowest = room.heights_m[0].min(room.heights_m[1]);
    let cells = lamp_cells(high.x - low.x);
    let windows = windows(room);

    if lowest >= 2.6 && rng.random_bool(0.6) {
        for k in 1..cells {
            let x = low.x + (high.x - low.x) * k as f32 / cells as f32;
            let from = vec2(x, low.y);
            let to = vec2(x, high.y);
            let beam = Beam { from, to, half_width_m: BEAM_HALF_M, depth_m: BEAM_DEPTH_M, look: CONCRETE };
            room.items.push(Item::Beam(beam));

            // Under a slanted ceiling a column would not meet its beam.
            let Some(&(wall, _)) = windows.first().filter(|(wall, _)| wall.along_x()) else { continue };
            let depth_m = 0.3;
            let is_level = room.heights_m[0] == room.heights_m[1];
            if is_level && space.take_at_wall(wall, [x - BEAM_HALF_M, x + BEAM_HALF_M], depth_m, true) {
                let height_m = lowest - BEAM_DEPTH_M;
                let column = Thing::Column { width_m: 2.0 * BEAM_HALF_M, depth_m, height_m };
                room.items.push(Item::on_wall(wall, x, column));
            }
        }
    }

    add_radiators(room, space, &windows);
}

/// The windows of a room: the wall, and the stretch of it.
pub(super) fn windows(room: &RoomPlan) -> Vec<(Wall, [f32; 2])> {
    let windows = room.openings.iter().filter(|opening| opening.filling.is_window());
    windows.map(|opening| (opening.wall, opening.span)).collect()
}

/// Adds radiators under windows.
pub(super) fn add_radiators(room: &mut RoomPlan, space: &mut Space, windows: &[(Wall, [f32; 2])]) {
    for &(wall, [from, to]) in windows {
        let middle = 0.5 * (from + to);
        let width_m = (to - from - 0.1).clamp(0.4, 1.3);
        let span = [middle - 0.5 * width_m, middle + 0.5 * width_m];
        if space.take_at_wall(wall, span, 0.14, false) {
            room.items
                .push(Item::on_wall(wall, middle, Thing::Radiator { width_m }));
        }
    }
}

/// Places a group where there is space for it. Returns no items if there is none.
pub(super) fn place(
    group: Group,
    space: &mut Space,
    room: [f32; 2],
    style: &Style,
    rng: &mut ChaCha8Rng,
) -> Vec<Item> {
    let wood = pick(rng, &style.woods);
    let fabric = pick(rng, &style.fabrics);
    let glaze = pick(rng, &style.glazes);
    let frame_look = pick(rng, &style.frames);

    let mut hang = |rng: &mut ChaCha8Rng, width: f32, depth: f32, thing: Thing| {
        let place = space.find_on_wall(rng, width, depth);
        place
            .map(|(wall, along)| vec![Item::on_wall(wall, along, thing)])
            .unwrap_or_default()
    };

    match group {
        Group::Board => {
            let width_m = between(rng, 1.2, 2.4);
            let picture = pick(rng, &style.boards);
            let tray_m = (picture == Pattern::Whiteboard).then_some(0.9);
            // The tray below it is above the backs of chairs.
            let heights_m = [0.98, 2.05];
            hang(rng, width_m, 0.0, Thing::Board { width_m, heights_m, picture, frame: frame_look, tray_m })
        }
        Group::Picture => {
            let picture = pick(rng, &style.pictures);
            let width_m = if picture == Pattern::Landscape { 1.2 } else { 0.6 };
            let heights_m = [1.2, 2.0];
            hang(rng, width_m, 0.0, Thing::Picture { width_m, heights_m, picture, frame: frame_look })
        }
        Group::WallScreen => {
            let width_m = between(rng, 1.3, 1.7);
            hang(rng, width_m, 0.0, Thing::WallScreen { width_m, heights_m: [1.1, 2.0] })
        }
        Group::Extinguisher => hang(rng, 0.24, 0.2, Thing::Extinguisher),
        Group::Workplace => {
            let width = between(rng, 1.4, 1.8);
            let found = space.find_at_wall(rng, [width, 1.56], false);
            found
                .map(|f| workplace(&f, width, [fabric, glaze], rng))
                .unwrap_or_default()
        }
        Group::MeetingTable => {
            // As many seats as fit.
            let longest = room[0].max(room[1]);
            let most = ((longest - 2.4) / 0.9).clamp(1.0, 8.0) as u32;
            let found = (1..=most).rev().find_map(|seats| {
                let length = 0.9 * seats as f32 + 0.3;
                space.find(rng, [length + 1.6, 1.2 + 1.6]).map(|frame| (frame, seats))
            });
            found
                .map(|(f, seats)| meeting_table(&f, seats, [wood, fabric, glaze], rng))
                .unwrap_or_default()
        }
        Group::SofaCorner => {
            let seats = rng.random_range(2..=3);
            let found = space.find_at_wall(rng, [0.66 * seats as f32 + 0.36, 0.94], false);
            let cushion = pick(rng, &style.fabrics);
            let sofa = Thing::Sofa { seats, fabric, cushion };
            found
                .map(|f| vec![f.put([0.0, -0.46, 0.0], 0.0, sofa)])
                .unwrap_or_default()
        }
        Group::CoffeeTable => coffee_table(space, wood, glaze, rng),
        Group::BarTable => {
            let found = space.find(rng, [1.9, 1.9]);
            found
                .map(|f| bar_table(&f, [wood, fabric, glaze], rng))
                .unwrap_or_default()
        }
        Group::Bookcase { most_shelves } => {
            let width_m = between(rng, 0.8, 1.2);
            let shelves = rng.random_range(2..=most_shelves);
            // Two shelves reach a window's sill already.
            let found = space.find_at_wall(rng, [width_m, 0.32], true);
            let bookcase = Thing::Bookcase { width_m, shelves, wood, seed: rng.random() };
            found
                .map(|f| vec![f.put([0.0, -0.16, 0.0], 0.0, bookcase)])
                .unwrap_or_default()
        }
        Group::Copier => {
            let found = space.find_at_wall(rng, [0.7, 0.68], true);
            found
                .map(|f| vec![f.put([0.0, -0.33, 0.0], 0.0, Thing::Copier)])
                .unwrap_or_default()
        }
        Group::Chairs => {
            let count = rng.random_range(2..=3);
            let width = 0.6 * count as f32;
            let found = space.find_at_wall(rng, [width, 0.62], false);
            let chair = |f: &Frame, k: u32| {
                f.put([0.6 * (k as f32 + 0.5) - 0.5 * width, -0.33, 0.0], 0.0, Thing::Chair(fabric))
            };
            found
                .map(|f| (0..count).map(|k| chair(&f, k)).collect())
                .unwrap_or_default()
        }
        Group::Carton => {
            let found = space.find_at_wall(rng, [0.64, 0.64], false);
            found.map(|f| cartons(&f, rng)).unwrap_or_default()
        }
        Group::Plant => {
            let plant = Thing::Plant { height_m: between(rng, 0.9, 1.4), pot: glaze };
            alone(space, rng, 0.86, plant)
        }
        Group::Bin => {
            let look = if rng.random() { BLACK } else { glaze };
            alone(space, rng, 0.32, Thing::Bin(look))
        }
        Group::FloorLamp => alone(space, rng, 0.54, Thing::FloorLamp),
    }
}

/// Places a round thing near a wall, with a random turn.
fn alone(space: &mut Space, rng: &mut ChaCha8Rng, width: f32, thing: Thing) -> Vec<Item> {
    let found = space.find_at_wall(rng, [width, width], false);
    let yaw = between(rng, 0.0, 360.0);
    found
        .map(|f| vec![f.put([0.0, -0.5 * width, 0.0], yaw, thing)])
        .unwrap_or_default()
}

fn workplace(f: &Frame, width_m: f32, [fabric, glaze]: [Look; 2], rng: &mut ChaCha8Rng) -> Vec<Item> {
    let top = 0.74;
    let x = between(rng, -0.12, 0.12);
    let screen = pick(rng, &[Pattern::Editor, Pattern::Chart]);
    let mut items = vec![
        f.put([0.0, -0.39, 0.0], 0.0, Thing::Desk { width_m, depth_m: 0.78 }),
        f.put([x, -0.3, top], between(rng, -8.0, 8.0), Thing::Monitor(screen)),
        f.put([x, -0.59, top], between(rng, -5.0, 5.0), Thing::Keyboard),
        f.put([x, -1.18, 0.0], between(rng, -40.0, 40.0), Thing::OfficeChair(fabric)),
    ];
    if rng.random_bool(0.7) {
        items.push(f.put([0.15 - 0.5 * width_m, -0.55, top], between(rng, 90.0, 270.0), Thing::Mug(glaze)));
    }
    if rng.random_bool(0.7) {
        items.push(f.put([0.5 * width_m - 0.2, -0.56, top], between(rng, -20.0, 20.0), Thing::Papers));
    }
    if rng.random_bool(0.5) {
        items.push(f.put([0.5 * width_m - 0.12, -0.16, top], between(rng, -30.0, 30.0), Thing::DeskLamp));
    }
    items
}

fn meeting_table(f: &Frame, seats: u32, [wood, fabric, glaze]: [Look; 3], rng: &mut ChaCha8Rng) -> Vec<Item> {
    let width_m = 0.9 * seats as f32 + 0.3;
    let depth_m = 1.2;
    let height_m = 0.74;
    let mut items = vec![f.put([0.0; 3], 0.0, Thing::Table { width_m, depth_m, height_m, top: wood })];
    for seat in 0..seats {
        let x = 0.9 * (seat as f32 - 0.5 * (seats - 1) as f32);
        for (side, yaw) in [(-1.0, 180.0), (1.0, 0.0)] {
            let chair = f.put([x, side * 0.98, 0.0], yaw + wobble(rng), Thing::Chair(fabric));
            items.push(chair);
            let at = [x, side * 0.33, height_m];
            items.extend(at_a_seat(f, at, yaw, rng.random_range(0..4), glaze, rng));
        }
    }
    for (side, yaw) in [(-1.0, 90.0), (1.0, -90.0)] {
        if rng.random_bool(0.5) {
            let at = [side * (0.5 * width_m + 0.4), 0.0, 0.0];
            items.push(f.put(at, yaw + wobble(rng), Thing::Chair(fabric)));
        }
    }
    items
}

/// Draws the thing on a table in front of a seat. `number` chooses it: nothing from 3 on.
pub(super) fn at_a_seat(
    f: &Frame,
    at: [f32; 3],
    yaw: f32,
    number: u32,
    glaze: Look,
    rng: &mut ChaCha8Rng,
) -> Option<Item> {
    match number {
        0 => Some(f.put(at, yaw + wobble(rng), Thing::Laptop)),
        1 => Some(f.put(at, yaw + wobble(rng), Thing::Papers)),
        2 => Some(f.put(at, yaw, Thing::Mug(glaze))),
        _ => None,
    }
}

/// Draws a small turn, in degrees.
pub(super) fn wobble(rng: &mut ChaCha8Rng) -> f32 {
    between(rng, -8.0, 8.0)
}

/// A low table, on a rug where there is space for one.
fn coffee_table(space: &mut Space, wood: Look, glaze: Look, rng: &mut ChaCha8Rng) -> Vec<Item> {
    let mut items = Vec::new();
    let (frame, foot) = match space.find(rng, [2.54, 2.14]) {
        Some(frame) => {
            items.push(frame.put([0.0; 3], 0.0, Thing::Rug));
            (frame, 0.012)
        }
        None => match space.find(rng, [1.2, 0.7]) {
            Some(frame) => (frame, 0.0),
            None => return items,
        },
    };
    let table = Thing::Table { width_m: 1.15, depth_m: 0.65, height_m: 0.42, top: wood };
    items.push(frame.put([0.0, 0.0, foot], 0.0, table));
    items.push(frame.put([-0.25, 0.05, foot + 0.42], between(rng, 0.0, 360.0), Thing::Mug(glaze)));
    items.push(frame.put([0.25, -0.05, foot + 0.42], between(rng, 0.0, 360.0), Thing::Papers));
    items
}

/// A high round table with stools.
fn bar_table(f: &Frame, [wood, fabric, glaze]: [Look; 3], rng: &mut ChaCha8Rng) -> Vec<Item> {
    let table = Thing::RoundTable { radius_m: 0.42, height_m: 1.02, top: wood };
    let mut items = vec![f.put([0.0; 3], 0.0, table)];
    let stools = rng.random_range(2..=4);
    let first = between(rng, 0.0, TAU);
    for k in 0..stools {
        let at = 0.7 * Vec2::from_angle(first + TAU * k as f32 / stools as f32);
        items.push(f.put([at.x, at.y, 0.0], between(rng, 0.0, 360.0), Thing::Stool(fabric)));
    }
    items.push(f.put([0.2, 0.1, 1.02], between(rng, 0.0, 360.0), Thing::Mug(glaze)));
    items.push(f.put([-0.12, -0.05, 1.02], between(rng, 0.0, 360.0), Thing::Papers));
    items
}

/// A box, or two on one another.
fn cartons(f: &Frame, rng: &mut ChaCha8Rng) -> Vec<Item> {
    let height = between(rng, 0.24, 0.38);
    let size_m = [between(rng, 0.36, 0.46), between(rng, 0.3, 0.38), height];
    let yaw = between(rng, -15.0, 15.0);
    let mut items = vec![f.put([0.0, -0.32, 0.0], yaw, Thing::Carton { size_m })];
    if rng.random_bool(0.4) {
        let size_m = [between(rng, 0.24, 0.3), between(rng, 0.2, 0.26), between(rng, 0.14, 0.26)];
        items.push(f.put([0.0, -0.32, height], yaw + between(rng, 3.0, 12.0), Thing::Carton { size_m }));
    }
    items
}
