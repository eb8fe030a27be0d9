//! Where rooms are, and how they are joined: a hallway a storey, with rooms to its south and north.

use super::wings::arrange_wings;
use super::{BuildingOptions, FloorPlan, RoomOptions, between, pick, rng};
use crate::building::{Filling, Opening, RoomPlan, Wall};
use crate::look::{CeilingFinish, FloorFinish, Paint};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::{Vec2, vec2};
use s3d_label::{Room, RoomType};
use std::collections::BTreeMap;

/// An empty room, and the wishes for its content.
pub(super) struct Site {
    pub(super) plan: RoomPlan,
    /// Its place in the list of rooms. `usize::MAX` for a hallway.
    pub(super) index: usize,
    pub(super) furnishing: f32,
    pub(super) locations: u32,
}

/// The distance from the highest ceiling of a storey to the next floor.
const SLAB_M: f32 = 0.3;
const DOOR_M: [f32; 2] = [0.9, 2.1];
/// The distance of a doorway from the next wall, which leaves room for its leaf.
const BESIDE_DOOR_M: f32 = 0.45;
const WINDOW_TOP_M: f32 = 2.1;

/// Arranges the rooms in their order. The hallway of a storey follows its rooms.
pub(super) fn arrange(options: &BuildingOptions) -> Vec<Site> {
    let mut rng = rng(options.seed, u64::MAX - 1);
    let mut numbers = BTreeMap::new();
    let mut sites = Vec::new();
    let mut floor_m = 0.0;
    let rooms = &options.rooms;
    let storeys = options.storeys as usize;

    for storey in 0..storeys {
        let here = &rooms[rooms.len() * storey / storeys..rooms.len() * (storey + 1) / storeys];
        let first = sites.len();
        match options.plan {
            FloorPlan::OneHallway => arrange_storey(options, here, &mut rng, &mut sites),
            FloorPlan::Wings { .. } => arrange_wings(options, here, &mut rng, &mut sites),
        }

        let mut top = 0f32;
        for site in &mut sites[first..] {
            let number = numbers.entry(site.plan.room.room_type).or_insert(0);
            *number += 1;
            site.plan.room.number = *number;
            site.plan.floor_m = floor_m;
            top = top.max(site.plan.top());
        }

        floor_m += top + SLAB_M;
    }
    sites
}

fn arrange_storey(
    options: &BuildingOptions,
    rooms: &[RoomOptions],
    rng: &mut ChaCha8Rng,
    sites: &mut Vec<Site>,
) {
    let wall_m = options.wall_m;
    // Each room goes to the side that is shorter so far. Nothing lies below zero: patterns of floors start
    // there.
    let mut ends = [0f32; 2];
    let places: Vec<(usize, f32)> = rooms
        .iter()
        .map(|room| {
            let side = usize::from(ends[1] < ends[0]);
            let from = ends[side];
            ends[side] = from + room.size_m[0] + wall_m;
            (side, from)
        })
        .collect();

    let deepest = |side: usize| {
        let depths = rooms
            .iter()
            .zip(&places)
            .filter(|(_, place)| place.0 == side)
            .map(|(r, _)| r.size_m[1]);
        depths.fold(0f32, f32::max)
    };
    let south = deepest(0) + wall_m;
    let north = south + options.hallway_width_m;
    let length = (ends[0].max(ends[1]) - wall_m).max(2.0);

    let mut hallway_openings = Vec::new();
    for (index, (room, &(side, from))) in rooms.iter().zip(&places).enumerate() {
        let to = from + room.size_m[0];
        let (low, high, inner, outer) = if side == 0 {
            let y = south - wall_m;
            (vec2(from, y - room.size_m[1]), vec2(to, y), Wall::North, Wall::South)
        } else {
            let y = north + wall_m;
            (vec2(from, y), vec2(to, y + room.size_m[1]), Wall::South, Wall::North)
        };

        let at = between(rng, from + BESIDE_DOOR_M, to - BESIDE_DOOR_M - DOOR_M[0]);
        let opening =
            |wall, filling| Opening { wall, span: [at, at + DOOR_M[0]], heights: [0.0, DOOR_M[1]], filling };

        let hinge_left = rng.random();
        let open_deg = between(rng, 94.0, 107.0);
        let door = Filling::Door { thickness_m: wall_m, hinge_left, open_deg };
        let mut openings = vec![opening(inner, door)];
        openings.extend(windows(room, outer, [from, to], rng));

        // The hallway's wall is opposite to the room's.
        hallway_openings.push(opening(outer, Filling::Nothing));
        let plan = shell(options, room.room_type, [low, high], room.heights_m, openings, rng);
        sites.push(Site { plan, index, furnishing: room.furnishing, locations: room.locations });
    }

    let middle = 0.5 * (south + north);

    let half = (0.5 * options.hallway_width_m - 0.2).min(0.9);
    let end = |wall, half, heights, filling| Opening {
        wall,
        span: [middle - half, middle + half],
        heights,
        filling,
    };

    hallway_openings.push(end(Wall::West, half, [0.8, WINDOW_TOP_M], Filling::Window));
    hallway_openings.push(end(Wall::East, 0.5 * DOOR_M[0], [0.0, DOOR_M[1]], Filling::ShutDoor));

    let corners = [vec2(0.0, south), vec2(length, north)];
    let heights = [options.hallway_height_m; 2];
    let plan = shell(options, RoomType::HALLWAY, corners, heights, hallway_openings, rng);
    let locations = (length / 8.0).ceil() as u32;
    sites.push(Site { plan, index: usize::MAX, furnishing: 1.0, locations });
}

fn windows(room: &RoomOptions, wall: Wall, [from, to]: [f32; 2], rng: &mut ChaCha8Rng) -> Vec<Opening> {
    let sill = pick(rng, &[0.8, 0.9]);
    let slot = (to - from - 0.8) / room.windows.max(1) as f32;
    let half = 0.5 * (slot - 0.5).min(1.8);
    (0..room.windows)
        .map(|k| {
            let middle = from + 0.4 + slot * (k as f32 + 0.5);
            let span = [middle - half, middle + half];
            Opening { wall, span, heights: [sill, WINDOW_TOP_M], filling: Filling::Window }
        })
        .collect()
}

/// A room with finishes and lamps.
pub(super) fn shell(
    options: &BuildingOptions,
    room_type: RoomType,
    [low, high]: [Vec2; 2],
    heights_m: [f32; 2],
    openings: Vec<Opening>,
    rng: &mut ChaCha8Rng,
) -> RoomPlan {
    let style = &options.style;
    let skirting = pick(rng, &style.skirtings);
    let paint = Paint { color: pick(rng, &style.walls), band: None, skirting };
    let accent = Paint { color: pick(rng, &style.accents), ..paint };
    let accent = rng.random_bool(0.6).then(|| (pick(rng, &Wall::ALL), accent));

    let floor: FloorFinish = pick(rng, &style.floors);
    let ceiling: CeilingFinish = pick(rng, &style.ceilings);

    RoomPlan {
        room: Room { room_type, number: 0 },
        low,
        high,
        floor_m: 0.0,
        heights_m,
        openings,
        ceiling_hole: None,
        stairwell: None,
        lamps: lamps(high - low, heights_m)
            .into_iter()
            .map(|l| [l[0] + low.x, l[1] + low.y, l[2], l[3]])
            .collect(),
        paint,
        accent,
        floor,
        ceiling,
        items: Vec::new(),
    }
}

/// The number of lamps along a length: one in the middle of each cell.
pub(super) fn lamp_cells(length_m: f32) -> u32 {
    (length_m / 3.2).ceil().max(1.0) as u32
}

fn lamps(size: Vec2, heights_m: [f32; 2]) -> Vec<[f32; 4]> {
    let [nx, ny] = [lamp_cells(size.x), lamp_cells(size.y)];
    let cell = size / vec2(nx as f32, ny as f32);
    // Level bodies under a slanted ceiling are small.
    let lamp = match heights_m[0] == heights_m[1] {
        true if cell.x > cell.y => vec2(1.2, 0.3),
        true => vec2(0.6, 1.2),
        false => vec2(0.3, 0.3),
    };
    let lamp = lamp.min(0.5 * cell);
    let at = |i: u32, j: u32| cell * vec2(i as f32 + 0.5, j as f32 + 0.5);
    let all = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
    all.map(|(i, j)| [at(i, j).x, at(i, j).y, lamp.x, lamp.y]).collect()
}
