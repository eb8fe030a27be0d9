//! Nothing reaches through a wall.
//!
//! A group of things takes a rectangle of the room that holds its things as they usually stand. A thing that
//! is turned, or larger than usual, may reach a few centimetres beyond the rectangle, and beside a wall
//! through the wall. Such a thing is moved off the wall here.

use crate::building::{Item, RoomPlan};
use s3d_geom::Aabb;
use s3d_geom::glam::Vec3;

/// The distance from the wall of a thing that was moved, metres.
const OFF_M: f32 = 0.002;

/// Moves the items that leave the room back into it, each by as little as possible. Items that stay in the
/// room are not touched. An item that no move brings into the room is left out.
pub(super) fn keep_inside(room: &mut RoomPlan) {
    let items = std::mem::take(&mut room.items);
    room.items = items.into_iter().filter_map(|item| kept(room, item)).collect();
}

fn kept(room: &RoomPlan, item: Item) -> Option<Item> {
    let inside = room.inside();
    let bounds = room.bounds_of(&item);
    if holds(inside, bounds) {
        return Some(item);
    }

    let Item::Standing { thing, position, yaw_deg } = item else { return None };
    let low = (room.low + OFF_M).extend(bounds.min.z);
    let high = (room.high - OFF_M).extend(bounds.max.z);
    let shift = (low - bounds.min).max(Vec3::ZERO) + (high - bounds.max).min(Vec3::ZERO);
    let moved = Item::Standing { thing, position: position + shift, yaw_deg };
    holds(inside, room.bounds_of(&moved)).then_some(moved)
}

fn holds(outer: Aabb, inner: Aabb) -> bool {
    outer.contains(inner.min) && outer.contains(inner.max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Building;
    use crate::building::{Thing, Wall};
    use crate::look::OAK;

    /// The office of the demo with these items: 5 m along x.
    fn office(items: Vec<Item>) -> RoomPlan {
        let mut room = Building::demo().rooms[0].clone();
        room.items = items;
        keep_inside(&mut room);
        room
    }

    fn lamp(x: f32) -> Item {
        Item::standing([x, 2.0, 0.74], 90.0, Thing::DeskLamp)
    }

    #[test]
    fn a_thing_is_moved_off_a_wall_and_no_farther() {
        let end = Building::demo().rooms[0].high.x;
        // Turned so, its arm reaches 28 cm along x.
        let room = office(vec![lamp(2.0), lamp(end - 0.2)]);

        assert_eq!(room.items[0], lamp(2.0));
        let Item::Standing { position, yaw_deg, .. } = room.items[1] else { panic!("a lamp stands") };
        assert_eq!((position.y, position.z, yaw_deg), (2.0, 0.74, 90.0));
        assert!((room.bounds_of(&room.items[1]).max.x - (end - OFF_M)).abs() < 1e-4);
    }

    #[test]
    fn a_thing_that_is_too_large_is_left_out() {
        let table = Thing::Table { width_m: 9.0, depth_m: 0.6, height_m: 0.7, top: OAK };
        let room = office(vec![
            Item::standing([2.0, 2.0, 0.0], 0.0, table),
            Item::standing([2.0, 2.0, 2.7], 0.0, Thing::DeskLamp),
            Item::on_wall(Wall::North, 0.1, Thing::Radiator { width_m: 1.0 }),
        ]);
        assert_eq!(room.items, []);
    }

    fn are_near(a: Aabb, b: Aabb) -> bool {
        a.min.distance(b.min) < 1e-3 && a.max.distance(b.max) < 1e-3
    }

    #[test]
    fn a_thing_reaches_as_far_as_the_surfaces_that_are_built_of_it() {
        let building = Building { texture_scale: 0.02, ..Building::demo() };
        let scene = building.build().unwrap();
        let mut boxes = vec![Aabb::EMPTY; scene.instances.len()];
        for (face, &instance) in (0..).zip(&scene.instance_of_face) {
            let corners = scene.mesh.triangle(face).map(|p| p - building.origin);
            boxes[instance as usize] = corners.into_iter().fold(boxes[instance as usize], Aabb::with);
        }

        for room in &building.rooms {
            for item in &room.items {
                let bounds = room.bounds_of(item);
                assert!(boxes.iter().any(|&built| are_near(built, bounds)), "{item:?}: {bounds:?}");
            }
        }
    }
}
