//! Where in a room there is space: in the plan, and along the walls.

use super::between;
use crate::building::{Filling, Item, RoomPlan, Thing, Wall};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::{Vec2, Vec3, vec2};

/// The gap between two things, and between a thing and a wall, metres.
const GAP_M: f32 = 0.04;
/// How often a place is drawn before a thing is left out.
const TRIES: u32 = 60;

/// A rectangle of the plan.
type Rect = [Vec2; 2];

/// The places of a room that are taken.
pub(super) struct Space {
    low: Vec2,
    high: Vec2,
    taken: Vec<Rect>,
    /// The stretches of each wall that are taken at eye level.
    walls: [Vec<[f32; 2]>; 4],
}

/// The place of a group of things. The origin is at the group's back, or at its middle if it stands away from
/// walls.
pub(super) struct Frame {
    origin: Vec2,
    yaw_deg: f32,
}

impl Frame {
    /// A thing at a place in the frame (x to the right, y to the back, z from the floor), turned in the
    /// frame.
    pub(super) fn put(&self, [x, y, z]: [f32; 3], yaw_deg: f32, thing: Thing) -> Item {
        // The turns of frames are right angles.
        let right = match self.yaw_deg.rem_euclid(360.0) {
            0.0 => Vec2::X,
            90.0 => Vec2::Y,
            180.0 => Vec2::NEG_X,
            _ => Vec2::NEG_Y,
        };
        let position: Vec3 = (self.origin + right * x + right.perp() * y).extend(z);
        Item::Standing { thing, position, yaw_deg: self.yaw_deg + yaw_deg }
    }
}

/// Whether a door stands open into the room.
fn has_open_leaf(filling: Filling) -> bool {
    matches!(filling, Filling::Door { .. } | Filling::Leaf { .. })
        && !matches!(filling, Filling::Leaf { open_deg: 0.0, .. })
}

impl Space {
    /// The space of a room without furniture. Windows and the leaves of doors have taken their places.
    pub(super) fn new(room: &RoomPlan) -> Self {
        let low = room.low;
        let high = room.high;
        let mut space = Self { low, high, taken: Vec::new(), walls: Default::default() };
        for opening in &room.openings {
            let [from, to] = opening.span;
            let beside = if opening.filling.is_window() { 0.1 } else { 0.4 };
            space.walls[opening.wall as usize].push([from - beside, to + beside]);
            if has_open_leaf(opening.filling) {
                let leaf =
                    space.at_wall(opening.wall, [from - beside, to + beside], [-GAP_M, to - from + 0.1]);
                space.taken.push(leaf);
            }
        }
        space
    }

    /// Takes the places in front of doorways without a leaf in this room. A scanner may stand there,
    /// furniture may not.
    pub(super) fn keep_ways_free(&mut self, room: &RoomPlan) {
        for opening in &room.openings {
            if !opening.filling.is_window() && !has_open_leaf(opening.filling) {
                let [from, to] = opening.span;
                let way = self.at_wall(opening.wall, [from - 0.15, to + 0.15], [-GAP_M, to - from]);
                self.taken.push(way);
            }
        }
    }

    /// The rectangle along a wall between two distances from it.
    fn at_wall(&self, wall: Wall, [from, to]: [f32; 2], [near, far]: [f32; 2]) -> Rect {
        let low = self.low;
        let high = self.high;
        match wall {
            Wall::South => [vec2(from, low.y + near), vec2(to, low.y + far)],
            Wall::North => [vec2(from, high.y - far), vec2(to, high.y - near)],
            Wall::West => [vec2(low.x + near, from), vec2(low.x + far, to)],
            Wall::East => [vec2(high.x - far, from), vec2(high.x - near, to)],
        }
    }

    fn ends(&self, wall: Wall) -> [f32; 2] {
        if wall.along_x() {
            [self.low.x, self.high.x]
        } else {
            [self.low.y, self.high.y]
        }
    }

    fn is_free(&self, [low, high]: Rect) -> bool {
        let inside = low.cmpge(self.low + 0.5 * GAP_M).all() && high.cmple(self.high - 0.5 * GAP_M).all();
        let mut taken = self.taken.iter();
        inside && taken.all(|&[l, h]| low.cmpge(h + GAP_M).any() || l.cmpge(high + GAP_M).any())
    }

    fn wall_is_free(&self, wall: Wall, [from, to]: [f32; 2]) -> bool {
        let [start, end] = self.ends(wall);
        let mut taken = self.walls[wall as usize].iter();
        from >= start + GAP_M
            && to <= end - GAP_M
            && taken.all(|&[l, h]| from >= h + GAP_M || l >= to + GAP_M)
    }

    /// Takes the rectangle along a wall up to `depth` if it is free, and the wall behind it if it is `tall`.
    pub(super) fn take_at_wall(&mut self, wall: Wall, span: [f32; 2], depth: f32, tall: bool) -> bool {
        let rect = self.at_wall(wall, span, [0.5 * GAP_M, depth]);
        if !self.is_free(rect) || (tall && !self.wall_is_free(wall, span)) {
            return false;
        }
        self.taken.push(rect);
        if tall {
            self.walls[wall as usize].push(span);
        }
        true
    }

    /// Finds a place for a group with its back to any wall: `size` along the wall and away from it. A `tall`
    /// group, which reaches the sill of a window, does not stand in front of windows or hanging things.
    pub(super) fn find_at_wall(&mut self, rng: &mut ChaCha8Rng, size: [f32; 2], tall: bool) -> Option<Frame> {
        (0..TRIES).find_map(|_| {
            let (wall, along) = self.draw_on_wall(rng, size[0])?;
            let span = [along - 0.5 * size[0], along + 0.5 * size[0]];
            // A hand's breadth off the wall.
            let origin = self.at_wall(wall, [along; 2], [0.03; 2])[0];
            self.take_at_wall(wall, span, size[1] + 0.03, tall)
                .then(|| Frame { origin, yaw_deg: wall.yaw_deg() })
        })
    }

    /// Takes the square around a place if it is free.
    pub(super) fn take_around(&mut self, at: Vec2, half: Vec2) -> Option<Frame> {
        let rect = [at - half, at + half];
        self.is_free(rect).then(|| {
            self.taken.push(rect);
            Frame { origin: at, yaw_deg: 0.0 }
        })
    }

    /// Finds a place to hang something `width` wide. The floor below is taken too if `depth` is not 0.
    /// Returns the wall and the place along it.
    pub(super) fn find_on_wall(
        &mut self,
        rng: &mut ChaCha8Rng,
        width: f32,
        depth: f32,
    ) -> Option<(Wall, f32)> {
        (0..TRIES).find_map(|_| {
            let (wall, along) = self.draw_on_wall(rng, width)?;
            let span = [along - 0.5 * width, along + 0.5 * width];
            if !self.wall_is_free(wall, span) {
                return None;
            }
            if depth > 0.0 {
                return self.take_at_wall(wall, span, depth, true).then_some((wall, along));
            }
            self.walls[wall as usize].push(span);
            Some((wall, along))
        })
    }

    /// Draws a wall and a place along it. Returns `None` if the wall is too short.
    fn draw_on_wall(&self, rng: &mut ChaCha8Rng, width: f32) -> Option<(Wall, f32)> {
        let wall = Wall::ALL[rng.random_range(0..4)];
        let [start, end] = self.ends(wall);
        let [from, to] = [start + GAP_M + 0.5 * width, end - GAP_M - 0.5 * width];
        let along = between(rng, from, to);
        (from <= to).then_some((wall, along))
    }

    /// Finds a place for a group anywhere: `size` in the group's frame, which may be turned by a right angle.
    pub(super) fn find(&mut self, rng: &mut ChaCha8Rng, size: [f32; 2]) -> Option<Frame> {
        (0..TRIES).find_map(|_| {
            let turned = rng.random_bool(0.5);
            let half = 0.5
                * if turned {
                    vec2(size[1], size[0])
                } else {
                    Vec2::from_array(size)
                };
            let [from, to] = [self.low + half + GAP_M, self.high - half - GAP_M];
            let origin = vec2(between(rng, from.x, to.x), between(rng, from.y, to.y));
            let rect = [origin - half, origin + half];
            if !self.is_free(rect) {
                return None;
            }
            self.taken.push(rect);
            Some(Frame { origin, yaw_deg: if turned { 90.0 } else { 0.0 } })
        })
    }

    /// Finds a place at a wall that stays free for a scanner, `half` to each side.
    pub(super) fn find_stand_at_wall(&mut self, rng: &mut ChaCha8Rng, half: f32) -> Option<Vec2> {
        let frame = self.find_at_wall(rng, [2.0 * half; 2], false)?;
        // The back is at the wall, so −y of the frame leads away from it.
        Some(frame.origin + Vec2::from_angle(frame.yaw_deg.to_radians()).perp() * -half)
    }

    /// Finds a place that stays free for a scanner, `half` to each side: a drawn one, or else the first free
    /// one of a fine grid.
    pub(super) fn find_stand(&mut self, rng: &mut ChaCha8Rng, half: f32) -> Option<Vec2> {
        let stand = self.find(rng, [2.0 * half; 2]).map(|frame| frame.origin);
        stand.or_else(|| {
            let [from, to] = [self.low + half + 0.5 * GAP_M, self.high - half - 0.5 * GAP_M];
            let [nx, ny] = ((to - from) / 0.02).max(Vec2::ZERO).as_uvec2().to_array();
            let mut grid = (0..=ny).flat_map(|j| (0..=nx).map(move |i| vec2(i as f32, j as f32)));
            let free = grid.find_map(|ij| {
                let p = from + 0.02 * ij;
                self.is_free([p - half, p + half]).then_some(p)
            })?;
            self.taken.push([free - half, free + half]);
            Some(free)
        })
    }
}
