//! The things in rooms of each type if furniture comes in several models. On average a room has as many as
//! rooms of its type have in the published areas, counted from the names in their table of labels.

use super::furnish::{Group, add_radiators, at_a_seat, place, windows, wobble};
use super::models::{Models, sized};
use super::space::{Frame, Space};
use super::{Style, between, pick};
use crate::building::check::LARGE_M;
use crate::building::{Beam, Item, RoomPlan, TableBase, Thing, Wall};
use crate::look::{CONCRETE, Look, Pattern};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::{Vec2, vec2};
use s3d_label::RoomType;

/// A piece that is placed as a whole.
#[derive(Clone, Copy)]
enum Piece {
    /// A table with a chair, and things on it.
    Desk,
    /// Tables in a row with chairs around them.
    Meeting,
    /// A table with chairs on its sides.
    Cafe,
    SideTable,
    CoffeeTable,
    Couch,
    Shelves,
    /// A chair at a wall.
    Chair,
    Board,
    /// Rows of chairs, all over the room.
    Rows,
    Stalls,
    Basins,
    Usual(Group),
}

use Group::{Bin, Carton, Copier, Extinguisher, FloorLamp, Picture, Plant, WallScreen};
use Piece::{
    Basins, Board, Cafe, Chair, CoffeeTable, Couch, Desk, Meeting, Rows, Shelves, SideTable, Stalls, Usual,
};

/// Whether rooms of this type can be furnished with models.
pub(super) fn can_outfit(room_type: RoomType) -> bool {
    room_type != RoomType::HALLWAY && !pieces(room_type).is_empty()
}

/// The pieces of a room, the largest first, and the mean number of each.
fn pieces(room_type: RoomType) -> &'static [(Piece, f32)] {
    match room_type {
        RoomType::OFFICE => &[
            (Desk, 1.9),
            (Couch, 0.16),
            (Shelves, 3.9),
            (Board, 0.66),
            (Chair, 2.5),
            (SideTable, 0.7),
            (Usual(Plant), 0.6),
            (Usual(Carton), 1.3),
            (Usual(Picture), 1.2),
            (Usual(Bin), 1.2),
            (Usual(FloorLamp), 0.2),
        ],
        RoomType::CONFERENCE_ROOM => &[
            (Meeting, 1.0),
            (Board, 1.9),
            (Shelves, 1.25),
            (Couch, 0.3),
            (Chair, 4.0),
            (Usual(WallScreen), 0.4),
            (Usual(Plant), 0.5),
            (Usual(Picture), 0.5),
            (Usual(Bin), 0.6),
        ],
        RoomType::AUDITORIUM => &[
            (Board, 3.0),
            (Shelves, 2.0),
            (Rows, 1.0),
            (Usual(Picture), 4.0),
            (Usual(Extinguisher), 2.0),
            (Usual(Bin), 2.0),
        ],
        RoomType::LOBBY => &[
            (Cafe, 4.4),
            (Couch, 1.4),
            (Shelves, 4.8),
            (Chair, 3.0),
            (Usual(Plant), 3.0),
            (Usual(Picture), 3.0),
            (Usual(FloorLamp), 1.0),
            (Usual(Bin), 2.0),
            (Usual(Extinguisher), 1.0),
        ],
        RoomType::LOUNGE => &[
            (Couch, 3.8),
            (CoffeeTable, 2.8),
            (Cafe, 2.3),
            (Shelves, 1.0),
            (Usual(Plant), 2.0),
            (Usual(Picture), 2.0),
            (Usual(FloorLamp), 1.0),
            (Usual(Bin), 1.0),
        ],
        RoomType::OPENSPACE => &[
            (Cafe, 3.2),
            (Chair, 4.0),
            (Usual(Plant), 2.0),
            (Usual(Picture), 2.0),
            (Usual(Carton), 1.0),
            (Usual(Bin), 2.0),
        ],
        RoomType::PANTRY => &[
            (SideTable, 1.0),
            (Shelves, 0.7),
            (Usual(Copier), 1.0),
            (Usual(Carton), 2.0),
            (Usual(Plant), 1.0),
            (Usual(Picture), 1.0),
            (Usual(Bin), 2.0),
        ],
        RoomType::COPY_ROOM => &[
            (Usual(Copier), 1.6),
            (Shelves, 2.6),
            (SideTable, 1.5),
            (Usual(Carton), 2.0),
            (Usual(Picture), 1.0),
            (Usual(Bin), 1.0),
        ],
        RoomType::STORAGE => &[
            (Shelves, 1.45),
            (SideTable, 0.35),
            (Board, 0.1),
            (Chair, 0.5),
            (Usual(Carton), 2.4),
            (Usual(Bin), 0.4),
        ],
        RoomType::WC => {
            &[(Stalls, 1.0), (Basins, 1.0), (Couch, 0.15), (Usual(Bin), 1.6), (Usual(Plant), 0.3)]
        }
        RoomType::HALLWAY => &[
            (Couch, 0.3),
            (Shelves, 0.6),
            (SideTable, 0.14),
            (Board, 0.08),
            (Chair, 0.35),
            (Usual(Plant), 0.5),
            (Usual(Carton), 0.3),
            (Usual(Extinguisher), 0.7),
            (Usual(Picture), 0.9),
            (Usual(Bin), 0.5),
        ],
        _ => &[],
    }
}

/// Draws a whole number around `mean`.
fn drawn(mean: f32, rng: &mut ChaCha8Rng) -> u32 {
    (mean * between(rng, 0.5, 1.5) + rng.random::<f32>()).floor() as u32
}

/// Fills a room.
pub(super) fn outfit(
    room: &mut RoomPlan,
    space: &mut Space,
    (models, style): (&Models, &Style),
    furnishing: f32,
    rng: &mut ChaCha8Rng,
) {
    add_structure(room, space, models, rng);
    let windows = windows(room);
    add_radiators(room, space, &windows);

    let size = room.high - room.low;
    for &(piece, mean) in pieces(room.room.room_type) {
        for _ in 0..drawn(mean * furnishing, rng) {
            let placed = match piece {
                Usual(group) => place(group, space, size.to_array(), style, rng),
                _ => Outfitter { models, style, room: [room.low, room.high] }.place(piece, space, rng),
            };
            room.items.extend(placed);
        }
    }
}

/// Adds beams from south to north between the lamps, and columns at the walls.
fn add_structure(room: &mut RoomPlan, space: &mut Space, models: &Models, rng: &mut ChaCha8Rng) {
    let low = room.low;
    let high = room.high;
    let lowest = room.heights_m[0].min(room.heights_m[1]);
    let share = (high - low).element_product() / 20.0;
    let half_width_m = between(rng, 0.1, 0.2);
    let depth_m = between(rng, 0.16, (lowest - 2.3).min(0.35));

    let lamps = room.lamps.clone();
    let is_free = |x: f32, beams: &[f32]| {
        x - half_width_m > low.x + 0.1
            && x + half_width_m < high.x - 0.1
            && lamps
                .iter()
                .all(|l| (l[0] - x).abs() > 0.5 * l[2] + half_width_m + 0.05)
            && beams.iter().all(|other| (other - x).abs() > 2.0 * half_width_m + 0.3)
    };

    let mut beams: Vec<f32> = Vec::new();
    if lowest >= 2.5 && f64::from(high.y - low.y) <= LARGE_M {
        for _ in 0..drawn(models.beams * share, rng) {
            let found = (0..30)
                .map(|_| between(rng, low.x, high.x))
                .find(|&x| is_free(x, &beams));
            beams.extend(found);
        }
    }

    for &x in &beams {
        let from = vec2(x, low.y);
        let to = vec2(x, high.y);
        room.items
            .push(Item::Beam(Beam { from, to, half_width_m, depth_m, look: CONCRETE }));
    }

    // A column would not meet a slanted ceiling.
    if room.heights_m[0] != room.heights_m[1] {
        return;
    }

    for _ in 0..drawn(models.columns * share, rng) {
        let width_m = between(rng, 0.3, 0.55);
        let out_m = between(rng, 0.15, 0.35);
        let Some((wall, along)) = space.find_on_wall(rng, width_m, out_m) else { continue };

        let [from, to] = match wall {
            Wall::South | Wall::North => [along - 0.5 * width_m, along + 0.5 * width_m],
            Wall::West => [low.x, low.x + out_m],
            Wall::East => [high.x - out_m, high.x],
        };

        let under_beam = beams.iter().any(|x| x - half_width_m < to && x + half_width_m > from);
        let under_lamp = lamps.iter().any(|l| l[0] - 0.5 * l[2] < to && l[0] + 0.5 * l[2] > from);
        let height_m = if under_beam { lowest - depth_m } else { lowest };

        if under_lamp && !wall.along_x() {
            continue;
        }
        room.items
            .push(Item::on_wall(wall, along, Thing::Column { width_m, depth_m: out_m, height_m }));
    }
}

/// Half of the square in which a chair of usual size turns.
const CHAIR_M: f32 = 0.42;

struct Outfitter<'a> {
    models: &'a Models,
    style: &'a Style,
    room: [Vec2; 2],
}

impl Outfitter<'_> {
    /// Places a piece where there is space for it. Returns no items if there is none.
    fn place(&self, piece: Piece, space: &mut Space, rng: &mut ChaCha8Rng) -> Vec<Item> {
        let models = self.models;
        let style = self.style;
        let woods = if matches!(piece, Shelves) {
            &models.shelf_looks
        } else {
            &models.table_looks
        };

        let fabrics = if matches!(piece, Couch) {
            &models.couch_looks
        } else {
            &models.seat_looks
        };

        let wood = pick(rng, woods);
        let fabric = pick(rng, fabrics);

        match piece {
            Desk => {
                let size = sized(&models.table_m, rng);
                let found = space.find_at_wall(rng, [size[0] + 0.02, size[1] + 2.0 * CHAIR_M + 0.06], false);
                found
                    .map(|f| self.desk(&f, size, [wood, fabric], rng))
                    .unwrap_or_default()
            }
            Meeting => self.meeting(space, [wood, fabric], rng),
            Cafe => {
                let side = between(rng, 0.7, 0.95);
                let found = space.find(rng, [side + 4.0 * CHAIR_M; 2]);
                found
                    .map(|f| self.cafe(&f, side, [wood, fabric], rng))
                    .unwrap_or_default()
            }
            SideTable => {
                let size = [between(rng, 0.6, 1.1), between(rng, 0.5, 0.7), between(rng, 0.55, 0.78)];
                let found = space.find_at_wall(rng, [size[0], size[1]], false);
                found
                    .map(|f| vec![f.put([0.0, -0.5 * size[1], 0.0], 0.0, self.table(size, wood, rng))])
                    .unwrap_or_default()
            }
            CoffeeTable => {
                let size = [between(rng, 0.8, 1.3), between(rng, 0.5, 0.75), between(rng, 0.36, 0.46)];
                let found = space.find(rng, [size[0] + 0.5, size[1] + 0.5]);
                let mut on = |f: Frame| {
                    let table = self.table(size, wood, rng);
                    let turn = between(rng, 0.0, 360.0);
                    vec![f.put([0.0; 3], 0.0, table), f.put([0.1, 0.0, size[2]], turn, Thing::Papers)]
                };
                found.map(&mut on).unwrap_or_default()
            }
            Couch => {
                let seats = rng.random_range(2..=3);
                let has_arms = pick(rng, &models.couches);
                let size_m = sized(&models.couch_m, rng);
                let width = size_m[0] * seats as f32 + if has_arms { 0.28 } else { 0.0 };
                let found = space.find_at_wall(rng, [width, size_m[1] + 0.03], false);
                let couch = Thing::Couch { seats, size_m, has_arms, fabric };
                found
                    .map(|f| vec![f.put([0.0, -0.5 * size_m[1], 0.0], 0.0, couch)])
                    .unwrap_or_default()
            }
            Shelves => {
                let size_m = sized(&models.shelf_m, rng);
                let found = space.find_at_wall(rng, [size_m[0], size_m[1] + 0.03], true);
                let front = pick(rng, &models.shelves);
                let shelves = Thing::Shelves { front, size_m, wood, seed: rng.random() };
                found
                    .map(|f| vec![f.put([0.0, -0.5 * size_m[1], 0.0], 0.0, shelves)])
                    .unwrap_or_default()
            }
            Chair => {
                let (chair, _) = models.seat(fabric, rng);
                let found = space.find_at_wall(rng, [2.0 * CHAIR_M; 2], false);
                let yaw = between(rng, -25.0, 25.0);
                found
                    .map(|f| vec![f.put([0.0, -CHAIR_M, 0.0], yaw, chair)])
                    .unwrap_or_default()
            }
            Board => {
                let (board, width) = models.board((pick(rng, &style.boards), pick(rng, &style.frames)), rng);
                // A bookcase in the corner does not reach it.
                let free = width + 2.0 * (models.shelf_m[1][1] + 0.06);
                let found = space.find_on_wall(rng, free, 0.0);
                found
                    .map(|(wall, along)| vec![Item::on_wall(wall, along, board)])
                    .unwrap_or_default()
            }
            Rows => self.rows(space, fabric, rng),
            Stalls => {
                let toilets = rng.random_range(2..=4u32);
                let found = space.find_at_wall(rng, [toilets as f32 + 0.06, 1.5], true);
                let at = |k: f32| k - 0.5 * toilets as f32;
                let partition = Thing::Partition { depth_m: 1.4, height_m: 1.9 };
                found
                    .map(|f| {
                        let screens = (0..=toilets).map(|k| f.put([at(k as f32), 0.0, 0.0], 0.0, partition));
                        let bowls =
                            (0..toilets).map(|k| f.put([at(k as f32 + 0.5), 0.0, 0.0], 0.0, Thing::Toilet));
                        screens.chain(bowls).collect()
                    })
                    .unwrap_or_default()
            }
            Basins => {
                let basins = rng.random_range(1..=3u32);
                let found = space.find_at_wall(rng, [0.75 * basins as f32, 0.52], true);
                let at = |k: u32| [0.75 * (k as f32 + 0.5 - 0.5 * basins as f32), 0.0, 0.0];
                found
                    .map(|f| (0..basins).map(|k| f.put(at(k), 0.0, Thing::Basin)).collect())
                    .unwrap_or_default()
            }
            Usual(_) => Vec::new(),
        }
    }

    /// A table; short ones have no trestles.
    fn table(&self, size: [f32; 3], top: Look, rng: &mut ChaCha8Rng) -> Thing {
        match self.models.table(size, top, rng) {
            Thing::ModelTable { base: TableBase::Trestles, .. } if size[0] < 1.0 => {
                Thing::ModelTable { base: TableBase::Legs, size_m: size, top }
            }
            table => table,
        }
    }

    fn desk(
        &self,
        f: &Frame,
        [width, depth, top]: [f32; 3],
        [wood, fabric]: [Look; 2],
        rng: &mut ChaCha8Rng,
    ) -> Vec<Item> {
        let x = between(rng, -0.12, 0.12);
        let screen = pick(rng, &[Pattern::Editor, Pattern::Chart]);
        let (chair, _) = self.models.seat(fabric, rng);
        let glaze = pick(rng, &self.style.glazes);

        let mut items = vec![
            f.put([0.0, -0.5 * depth, 0.0], 0.0, self.table([width, depth, top], wood, rng)),
            f.put([x, 0.15 - 0.5 * depth, top], between(rng, -8.0, 8.0), Thing::Monitor(screen)),
            f.put([x, 0.17 - depth, top], between(rng, -5.0, 5.0), Thing::Keyboard),
            f.put([x, -depth - 0.03 - CHAIR_M, 0.0], between(rng, 140.0, 220.0), chair),
        ];

        let on_left = between(rng, 90.0, 270.0);
        for (thing, at, chance) in [
            (Thing::Mug(glaze), [0.15 - 0.5 * width, 0.25 - depth, top], 0.7),
            (Thing::Papers, [0.5 * width - 0.2, 0.2 - depth, top], 0.7),
            (Thing::DeskLamp, [0.5 * width - 0.12, -0.2, top], 0.4),
        ] {
            if rng.random_bool(chance) {
                let yaw = if thing == Thing::Papers {
                    between(rng, -20.0, 20.0)
                } else {
                    on_left
                };
                let yaw = if thing == Thing::DeskLamp {
                    between(rng, -30.0, 30.0)
                } else {
                    yaw
                };
                items.push(f.put(at, yaw, thing));
            }
        }
        items
    }

    /// Places as many tables in a row as fit, with chairs of one model around them.
    fn meeting(&self, space: &mut Space, [wood, fabric]: [Look; 2], rng: &mut ChaCha8Rng) -> Vec<Item> {
        let [width, depth, height] = sized(&self.models.table_m, rng);
        let depth = depth.max(0.8) * 1.2;
        let table = self.table([width, depth, height], wood, rng);

        let length = |tables: u32| tables as f32 * (width + 0.02) - 0.02;

        let found = [4, 3, 2, 1].into_iter().find_map(|tables| {
            let size = [length(tables) + 4.0 * CHAIR_M + 0.1, depth + 4.0 * CHAIR_M + 0.1];
            space.find(rng, size).map(|frame| (frame, tables))
        });
        let Some((f, tables)) = found else { return Vec::new() };

        let half = 0.5 * length(tables);
        let mut items = Vec::new();
        for k in 0..tables {
            let x = (width + 0.02) * (k as f32 + 0.5) - 0.01 - half;
            items.push(f.put([x, 0.0, 0.0], 0.0, table));
        }
        let (chair, _) = self.models.seat(fabric, rng);

        let seats = (2.0 * half / (2.0 * CHAIR_M)).floor() as u32;
        let glaze = pick(rng, &self.style.glazes);
        for seat in 0..seats {
            let x = 2.0 * half * ((seat as f32 + 0.5) / seats as f32 - 0.5);
            for (side, yaw) in [(-1.0, 180.0), (1.0, 0.0)] {
                let turn = yaw + wobble(rng);
                items.push(f.put([x, side * (0.5 * depth + CHAIR_M + 0.02), 0.0], turn, chair));
                let at = [x, side * (0.5 * depth - 0.26), height];
                items.extend(at_a_seat(&f, at, yaw, rng.random_range(0..6), glaze, rng));
            }
        }

        for (side, yaw) in [(-1.0, 90.0), (1.0, -90.0)] {
            if rng.random_bool(0.5) {
                let turn = yaw + wobble(rng);
                items.push(f.put([side * (half + CHAIR_M + 0.02), 0.0, 0.0], turn, chair));
            }
        }
        items
    }

    fn cafe(&self, f: &Frame, side: f32, [wood, fabric]: [Look; 2], rng: &mut ChaCha8Rng) -> Vec<Item> {
        let height = between(rng, 0.7, 0.78);
        let table = if rng.random_bool(0.3) {
            Thing::RoundTable { radius_m: 0.5 * side, height_m: height, top: wood }
        } else {
            self.table([side, side, height], wood, rng)
        };
        let (chair, _) = self.models.seat(fabric, rng);
        let mut items = vec![f.put([0.0; 3], 0.0, table)];
        for (at, yaw) in [([0.0, -1.0], 180.0), ([0.0, 1.0], 0.0), ([-1.0, 0.0], 90.0), ([1.0, 0.0], -90.0)] {
            if rng.random_bool(0.82) {
                let away = 0.5 * side + CHAIR_M;
                let turn = yaw + between(rng, -20.0, 20.0);
                items.push(f.put([at[0] * away, at[1] * away, 0.0], turn, chair));
            }
        }
        let turn = between(rng, 0.0, 360.0);
        items.push(f.put([0.1, 0.05, height], turn, Thing::Mug(pick(rng, &self.style.glazes))));
        items
    }

    /// Places rows of chairs that look to the north, with an aisle in the middle.
    fn rows(&self, space: &mut Space, fabric: Look, rng: &mut ChaCha8Rng) -> Vec<Item> {
        let [low, high] = self.room;
        let (chair, width) = self.models.seat(fabric, rng);
        let pitch = width + 0.06;
        let aisle = 0.5 * (low.x + high.x);
        let mut items = Vec::new();
        let mut y = low.y + 1.0;
        while y < high.y - 2.5 {
            let mut x = low.x + 0.9;
            while x < high.x - 0.9 {
                let half = vec2(0.5 * pitch - 0.021, 0.36);
                if (x - aisle).abs() > 0.8
                    && let Some(f) = space.take_around(vec2(x, y), half)
                {
                    items.push(f.put([0.0; 3], 180.0, chair));
                }
                x += pitch;
            }
            y += 0.95;
        }
        items
    }
}
