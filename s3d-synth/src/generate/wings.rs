//! Wings side by side, each a row of hallways with rooms on both sides, and a cross hallway at their west
//! ends. Doors divide the hallways.

use super::arrange::{Site, shell};
use super::{BuildingOptions, FloorPlan, Models, RoomOptions, between, pick};
use crate::building::check::most_panes;
use crate::building::{Filling, Opening, Wall};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::vec2;
use s3d_label::RoomType;

/// The distance of a doorway from the next wall, which leaves room for its leaf.
const BESIDE_DOOR_M: f32 = 0.45;
/// The shortest piece of a hallway.
const SHORTEST_M: f32 = 2.5;

/// A wing: the rooms to its south and to its north, with their stretches along x.
#[derive(Default)]
struct Wing {
    rows: [Vec<(usize, [f32; 2])>; 2],
    ends: [f32; 2],
}

/// A doorway, with its filling on either side.
struct Doorway {
    span: [f32; 2],
    sides: [Filling; 2],
}

/// Rounds to the millimetre. Things that should be at one place then are, to the last bit.
fn snapped(m: f32) -> f32 {
    (m * 1000.0).round() / 1000.0
}

struct Planner<'a> {
    options: &'a BuildingOptions,
    models: &'a Models,
    rooms: &'a [RoomOptions],
}

pub(super) fn arrange_wings(
    options: &BuildingOptions,
    rooms: &[RoomOptions],
    rng: &mut ChaCha8Rng,
    sites: &mut Vec<Site>,
) {
    // The options were checked for both.
    let (FloorPlan::Wings { wings, hallways, courtyard_m }, Some(models)) = (options.plan, &options.models)
    else {
        return;
    };

    let planner = Planner { options, models, rooms };
    let wall_m = options.wall_m;
    // A wall that divides the cross hallway stands in it.
    let courtyard_m = courtyard_m.max(wall_m);

    let has_cross = wings > 1;
    let start = if has_cross {
        options.hallway_width_m + wall_m
    } else {
        0.0
    };

    let wings = planner.deal(wings, start);
    // The hallways left for the wings, dealt evenly.
    let left = hallways as usize - if has_cross { wings.len() } else { 0 };

    let first = sites.len();
    let mut hallway_sites = Vec::new();
    let mut cross = Vec::new();
    let mut y = 0.0;

    for (index, wing) in wings.iter().enumerate() {
        let deepest = |row: usize| {
            let depths = wing.rows[row].iter().map(|(room, _)| rooms[*room].size_m[1] + wall_m);
            depths.fold(0f32, f32::max)
        };

        let south = y + deepest(0);
        let north = south + options.hallway_width_m;
        let top = north + deepest(1);

        let pieces = left / wings.len() + usize::from(index < left % wings.len());
        let entry =
            planner.wing(wing, [start, south, north], pieces, has_cross, (sites, &mut hallway_sites), rng);
        cross.push(([y, top], entry));
        y = top + courtyard_m;
    }

    // The rooms in the order in which they were asked for: they are numbered so.
    sites[first..].sort_by_key(|site| site.index);
    if has_cross {
        planner.cross(&cross, courtyard_m, &mut hallway_sites, rng);
    }
    sites.append(&mut hallway_sites);
}

impl Planner<'_> {
    /// Each room goes to the row that is shortest so far.
    fn deal(&self, wings: u32, start: f32) -> Vec<Wing> {
        let mut all: Vec<Wing> = (0..wings)
            .map(|_| Wing { ends: [start; 2], ..Wing::default() })
            .collect();
        for (index, room) in self.rooms.iter().enumerate() {
            let rows = (0..all.len()).flat_map(|w| [(w, 0), (w, 1)]);
            let shortest = rows.min_by(|a, b| all[a.0].ends[a.1].total_cmp(&all[b.0].ends[b.1]));
            let (w, row) = shortest.unwrap_or_default();
            let from = all[w].ends[row];
            let to = from + room.size_m[0];
            all[w].rows[row].push((index, [from, to]));
            all[w].ends[row] = to + self.options.wall_m;
        }
        all
    }

    /// Draws a doorway within a stretch of wall, and its door. The leaf is on the first side.
    fn doorway(&self, [from, to]: [f32; 2], rng: &mut ChaCha8Rng) -> Doorway {
        let models = self.models;
        let at = between(rng, from, (to - models.door_m[0]).max(from));
        let shut = rng.random_bool(models.shut);
        let model = pick(rng, &models.leaves);
        let look = pick(rng, &models.leaf_looks);
        let depth_m = 0.5 * self.options.wall_m;
        let hinge_left = rng.random();
        let angle = between(rng, 60.0, 107.0);
        let leaf = |open_deg| Filling::Leaf { model, look, depth_m, hinge_left, open_deg };
        let sides = if shut {
            [leaf(0.0); 2]
        } else {
            [leaf(angle), Filling::Frame { depth_m }]
        };
        Doorway { span: [at, at + models.door_m[0]], sides }
    }

    fn opening(&self, wall: Wall, door: &Doorway, side: usize) -> Opening {
        Opening {
            wall,
            span: door.span.map(snapped),
            heights: [0.0, self.models.door_m[1]],
            filling: door.sides[side],
        }
    }

    fn window(&self, wall: Wall, middle: f32, width: f32, rng: &mut ChaCha8Rng) -> Opening {
        let span = [middle - 0.5 * width, middle + 0.5 * width].map(snapped);
        let size = [span[1] - span[0], self.models.window_m[1] - self.models.window_m[0]];
        let [across, up] = pick(rng, &self.models.panes);
        let panes = [across.min(most_panes(size[0])), up.min(most_panes(size[1]))];
        let filling = Filling::Glazing { panes, depth_m: 0.12 };
        Opening { wall, span, heights: self.models.window_m, filling }
    }

    /// The rooms and hallways of a wing. Returns the doorway to the cross hallway, if there is one.
    fn wing(
        &self,
        wing: &Wing,
        [start, south, north]: [f32; 3],
        pieces: usize,
        has_cross: bool,
        (sites, hallways): (&mut Vec<Site>, &mut Vec<Site>),
        rng: &mut ChaCha8Rng,
    ) -> Option<Doorway> {
        let wall_m = self.options.wall_m;
        let end = (wing.ends[0].max(wing.ends[1]) - wall_m).max(start + SHORTEST_M);
        let cuts = self.cuts(wing, [start, end], pieces);

        let mut doors: Vec<Opening> = Vec::new();
        for (row, (inner, outer)) in [(Wall::North, Wall::South), (Wall::South, Wall::North)]
            .into_iter()
            .enumerate()
        {
            for &(index, span) in &wing.rows[row] {
                let room = &self.rooms[index];
                let (y0, y1) = if row == 0 {
                    (south - wall_m - room.size_m[1], south - wall_m)
                } else {
                    (north + wall_m, north + wall_m + room.size_m[1])
                };

                let door = self.doorway(self.free_for_door(span, &cuts), rng);
                let mut openings = vec![self.opening(inner, &door, 0)];
                let slot = (span[1] - span[0] - 0.8) / room.windows.max(1) as f32;
                for k in 0..room.windows {
                    let middle = span[0] + 0.4 + slot * (k as f32 + 0.5);
                    openings.push(self.window(outer, middle, (slot - 0.5).min(2.0), rng));
                }

                // The hallway's wall is opposite to the room's.
                doors.push(self.opening(outer, &door, 1));
                let corners = [[span[0], y0], [span[1], y1]].map(|[x, y]| vec2(snapped(x), snapped(y)));
                let mut plan = shell(self.options, room.room_type, corners, room.heights_m, openings, rng);
                plan.accent = plan.accent.filter(|_| room.room_type != RoomType::WC);
                sites.push(Site { plan, index, furnishing: room.furnishing, locations: room.locations });
            }
        }

        let middle = 0.5 * (south + north);
        let half = 0.5 * self.models.door_m[0];
        let across = [middle - half, middle + half];
        let entry = has_cross.then(|| self.doorway(across, rng));
        let mut west = entry.as_ref().map(|door| self.opening(Wall::West, door, 1));

        let mut from = start;
        let ends: Vec<f32> = cuts.iter().copied().chain([end + 0.5 * wall_m]).collect();
        for (k, cut) in ends.iter().enumerate() {
            let to = cut - 0.5 * wall_m;

            let mut openings: Vec<Opening> = doors
                .iter()
                .filter(|o| o.span[0] >= from && o.span[1] <= to)
                .copied()
                .collect();
            openings.extend(west.take());
            if k + 1 < ends.len() {
                let door = self.doorway(across, rng);
                openings.push(self.opening(Wall::East, &door, 0));
                west = Some(self.opening(Wall::West, &door, 1));
            } else {
                openings.push(self.end(Wall::East, middle, rng));
            }

            hallways.push(self.hallway([[from, south], [to, north]], openings, rng));
            from = cut + 0.5 * wall_m;
        }
        entry
    }

    /// The end of a hallway: a window, or a door that leads outside and is shut.
    fn end(&self, wall: Wall, middle: f32, rng: &mut ChaCha8Rng) -> Opening {
        let width = (self.options.hallway_width_m - 0.4).min(1.6);
        if rng.random_bool(self.models.end_windows) {
            return self.window(wall, middle, width, rng);
        }
        let half = 0.5 * self.models.door_m[0];
        let mut door = self.doorway([middle - half, middle + half], rng);
        for side in &mut door.sides {
            if let Filling::Leaf { open_deg, .. } = side {
                *open_deg = 0.0;
            }
        }
        self.opening(wall, &door, 0)
    }

    fn hallway(&self, [low, high]: [[f32; 2]; 2], openings: Vec<Opening>, rng: &mut ChaCha8Rng) -> Site {
        let corners = [low, high].map(|[x, y]| vec2(snapped(x), snapped(y)));
        let heights = [self.options.hallway_height_m; 2];
        let plan = shell(self.options, RoomType::HALLWAY, corners, heights, openings, rng);
        let length = (high[0] - low[0]).max(high[1] - low[1]);
        Site { plan, index: usize::MAX, furnishing: 1.0, locations: (length / 6.0).ceil() as u32 }
    }

    /// Adds the hallway that joins the wings. Each wing has a piece, which ends at a wall in the middle of
    /// the courtyard.
    fn cross(
        &self,
        wings: &[([f32; 2], Option<Doorway>)],
        courtyard_m: f32,
        hallways: &mut Vec<Site>,
        rng: &mut ChaCha8Rng,
    ) {
        let width = self.options.hallway_width_m;
        let wall_m = self.options.wall_m;
        let half = 0.5 * self.models.door_m[0];
        let across = [0.5 * width - half, 0.5 * width + half];

        let mut from = wings.first().map_or(0.0, |(span, _)| span[0]);
        let mut before = None;

        for (k, ([_, top], entry)) in wings.iter().enumerate() {
            let mut openings: Vec<Opening> =
                entry.iter().map(|door| self.opening(Wall::East, door, 0)).collect();

            let is_last = k + 1 == wings.len();
            let to = if is_last {
                *top
            } else {
                top + 0.5 * (courtyard_m - wall_m)
            };

            openings.push(match before.take() {
                Some(door) => self.opening(Wall::South, &door, 1),
                None => self.end(Wall::South, 0.5 * width, rng),
            });

            if is_last {
                openings.push(self.end(Wall::North, 0.5 * width, rng));
            } else {
                let door = self.doorway(across, rng);
                openings.push(self.opening(Wall::North, &door, 0));
                before = Some(door);
            }

            hallways.push(self.hallway([[0.0, from], [width, to]], openings, rng));
            from = to + wall_m;
        }
    }

    /// Returns the middles of the walls that divide the hallway of a wing. Each is at the edge of a room.
    /// Together they leave every room a place for its door.
    fn cuts(&self, wing: &Wing, [start, end]: [f32; 2], pieces: usize) -> Vec<f32> {
        let rooms = || wing.rows.iter().flatten().map(|(_, span)| *span);
        let have_place = |cuts: &[f32]| {
            rooms().all(|span| {
                let [from, to] = self.free_for_door(span, cuts);
                to - from >= self.models.door_m[0]
            })
        };

        let places: Vec<f32> = rooms()
            .map(|[_, to]| to + 0.5 * self.options.wall_m)
            .filter(|&cut| have_place(&[cut]))
            .collect();

        let mut cuts: Vec<f32> = Vec::new();
        for k in 1..pieces {
            let wanted = start + (end - start) * k as f32 / pieces as f32;
            let least = cuts.last().map_or(start, |cut| *cut) + SHORTEST_M + self.options.wall_m;

            let nearest = places
                .iter()
                .filter(|cut| {
                    **cut >= least
                        && **cut <= end - SHORTEST_M - self.options.wall_m
                        && have_place(&[cuts.as_slice(), &[**cut]].concat())
                })
                .min_by(|a, b| (**a - wanted).abs().total_cmp(&(**b - wanted).abs()));
            cuts.extend(nearest.copied());
        }
        cuts
    }

    /// The longest stretch of a room's wall on which its door can be, away from its corners and from the
    /// walls that divide the hallway.
    fn free_for_door(&self, [from, to]: [f32; 2], cuts: &[f32]) -> [f32; 2] {
        let keep = 0.5 * self.options.wall_m + 0.15;
        let mut best = [0.0; 2];
        let mut start = from + BESIDE_DOOR_M;
        let end = to - BESIDE_DOOR_M;
        for cut in cuts
            .iter()
            .copied()
            .filter(|cut| *cut > from && *cut < to)
            .chain([f32::MAX])
        {
            let stop = end.min(cut - keep);
            if stop - start > best[1] - best[0] {
                best = [start, stop];
            }
            start = start.max(cut + keep);
        }
        best
    }
}
