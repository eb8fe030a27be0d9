//! The canonical frame of a space.

use glam::{Vec2, Vec3, vec2, vec3};
use s3d_geom::Aabb;

/// The boxes of neighbours are nearer to each other than this, in metres.
const NEIGHBOUR_M: f32 = 0.7;
/// Neighbours face each other over this length at least, in metres.
const FACING_M: f32 = 0.8;

/// A frame of a space, in metres: the axes of the building, turned about Z by quarters, so that x runs along
/// the wall of the entrance and y away from it. Its origin is the least corner. [`Frame::extent`] scales to
/// the unit cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Quarter turns to the left, 0 to 3.
    pub turns: u8,
    /// The least corner, after the turn.
    pub origin: Vec3,
    /// The size along the frame's axes.
    pub extent: Vec3,
}

fn turned(p: Vec3, turns: u8) -> Vec3 {
    match turns % 4 {
        0 => p,
        1 => vec3(-p.y, p.x, p.z),
        2 => vec3(-p.x, -p.y, p.z),
        _ => vec3(p.y, -p.x, p.z),
    }
}

fn turned_box(b: &Aabb, turns: u8) -> Aabb {
    Aabb::from_points([turned(b.min, turns), turned(b.max, turns)])
}

impl Frame {
    /// Makes the frame of a space that fills a box, turned this many times.
    pub fn new(bounds: &Aabb, turns: u8) -> Self {
        let bounds = turned_box(bounds, turns);
        Self { turns, origin: bounds.min, extent: bounds.size() }
    }

    /// Takes a point of the building to this frame.
    pub fn point(&self, p: Vec3) -> Vec3 {
        turned(p, self.turns) - self.origin
    }

    /// Takes a direction of the building to this frame.
    pub fn direction(&self, d: Vec3) -> Vec3 {
        turned(d, self.turns)
    }

    /// Takes a box of the building to this frame.
    pub fn to_frame(&self, b: &Aabb) -> Aabb {
        let b = turned_box(b, self.turns);
        Aabb { min: b.min - self.origin, max: b.max - self.origin }
    }

    /// Takes a box of this frame to the building.
    pub fn to_building(&self, b: &Aabb) -> Aabb {
        turned_box(&Aabb { min: b.min + self.origin, max: b.max + self.origin }, 4 - self.turns)
    }
}

/// Returns the frames of spaces that fill these boxes.
///
/// The entrance of a space is towards the neighbour with the most neighbours, which in a building is a
/// hallway. In a tie the neighbour that faces it over the greatest length wins, then the first. A space
/// without neighbours has its longer side along x.
pub fn canonical_frames(bounds: &[Aabb]) -> Vec<Frame> {
    let sides: Vec<Vec<(usize, u8, f32)>> = (0..bounds.len())
        .map(|i| {
            let others = (0..bounds.len()).filter(|&j| j != i);
            others
                .filter_map(|j| side(&bounds[i], &bounds[j]).map(|(turns, m)| (j, turns, m)))
                .collect()
        })
        .collect();

    bounds
        .iter()
        .zip(&sides)
        .map(|(bounds, near)| {
            let entrance = near.iter().reduce(|best, other| {
                let rank = |n: &(usize, u8, f32)| (sides[n.0].len(), n.2);
                if rank(other) > rank(best) { other } else { best }
            });
            let size = bounds.size();
            Frame::new(bounds, entrance.map_or(u8::from(size.y > size.x), |(_, turns, _)| *turns))
        })
        .collect()
}

/// Returns the turns that bring `b` before `a` along y, and the length over which they face each other, in
/// metres; `None` if the two boxes are no neighbours.
fn side(a: &Aabb, b: &Aabb) -> Option<(u8, f32)> {
    let gaps: Vec2 = flat(b.min - a.max).max(flat(a.min - b.max));
    if a.max.z.min(b.max.z) <= a.min.z.max(b.min.z) {
        return None;
    }
    let middle = b.center() - a.center();
    if gaps.y >= gaps.x && gaps.y <= NEIGHBOUR_M && -gaps.x >= FACING_M {
        Some((if middle.y < 0.0 { 0 } else { 2 }, -gaps.x))
    } else if gaps.x > gaps.y && gaps.x <= NEIGHBOUR_M && -gaps.y >= FACING_M {
        Some((if middle.x < 0.0 { 1 } else { 3 }, -gaps.y))
    } else {
        None
    }
}

fn flat(v: Vec3) -> Vec2 {
    vec2(v.x, v.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room(x: [f32; 2], y: [f32; 2]) -> Aabb {
        Aabb { min: vec3(x[0], y[0], 0.5), max: vec3(x[1], y[1], 3.0) }
    }

    #[test]
    fn frames_turn_there_and_back() {
        let bounds = room([2.0, 5.0], [-1.0, 7.0]);
        let inner = Aabb { min: vec3(2.5, 0.0, 1.0), max: vec3(3.0, 2.0, 1.5) };
        for turns in 0..4 {
            let frame = Frame::new(&bounds, turns);
            assert_eq!(frame.to_frame(&bounds).min, Vec3::ZERO);
            assert_eq!(frame.to_frame(&bounds).max, frame.extent);
            let back = frame.to_building(&frame.to_frame(&inner));
            assert!((back.min - inner.min).abs().max_element() < 1e-6, "{turns}: {back:?}");
            assert!((back.max - inner.max).abs().max_element() < 1e-6, "{turns}: {back:?}");
            assert!(frame.to_frame(&inner).contains(frame.point(inner.center())));
        }
        assert_eq!(Frame::new(&bounds, 1).extent, vec3(8.0, 3.0, 2.5));
    }

    #[test]
    fn the_hallway_lies_before_every_room() {
        // A hallway along x with a room on each long side and one at its end.
        let hallway = room([0.0, 10.0], [0.0, 2.0]);
        let rooms = [
            hallway,
            room([0.0, 4.0], [2.2, 6.0]),
            room([1.0, 9.0], [-5.0, -0.2]),
            room([10.2, 14.0], [0.0, 2.0]),
        ];
        let frames = canonical_frames(&rooms);
        for (room, frame) in rooms.iter().zip(&frames).skip(1) {
            let towards = frame.point(hallway.center()) - frame.point(room.center());
            assert!(towards.y < -1.0 && towards.y.abs() > towards.x.abs(), "{frame:?}: {towards}");
        }
        let alone = canonical_frames(&[room([0.0, 2.0], [0.0, 5.0])]);
        assert_eq!(alone[0].extent.x, 5.0);
    }
}
