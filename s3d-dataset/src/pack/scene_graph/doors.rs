//! Which rooms a door joins: those between which one sees through it.

use crate::context::Context;
use crate::error::Result;
use crate::parallel::map_in_order;
use glam::{DVec2, DVec3};
use s3d_geom::{MeshError, OrientedBox, Polygon, TriMesh};
use s3d_render::{Scene, cast_ray};
use std::collections::BTreeMap;

/// How far around a door places are tried, metres. A leaf that stands open is this far from the other room at
/// most.
const REACH_M: f64 = 0.8;

/// The distance between places, metres.
const STEP_M: f64 = 0.15;

/// The height of places above the higher one of the two floors, metres: above seats, below lintels.
const EYE_M: f64 = 1.2;

/// A door joins two rooms only if so many lines of sight lead from one to the other.
const LEAST_SIGHTS: usize = 3;

/// The space of a room.
pub(super) struct Space {
    pub(super) outline: Vec<Polygon>,
    /// The heights of its floor and of its ceiling, world metres.
    pub(super) heights: [f64; 2],
}

impl Space {
    fn contains(&self, place: DVec2, heights: [f64; 2]) -> bool {
        let is_beside = self.heights[0] < heights[1] && heights[0] < self.heights[1];
        is_beside && self.outline.iter().any(|polygon| polygon.contains(place))
    }
}

/// Returns the two rooms that each door joins, by their indices in `rooms`, the lower one first. `None`: the
/// door joins none. `doors` are upright boxes.
///
/// A door joins the two rooms between which most lines of sight lead near it, if the faces of all doors are
/// away. So it does not matter whether a door is open, closed, or was seen from both sides.
pub(super) fn joined_rooms(
    ctx: &Context,
    mesh: &TriMesh,
    is_door: impl Fn(usize) -> bool,
    doors: &[OrientedBox],
    rooms: &[Space],
) -> Result<Vec<Option<[usize; 2]>>> {
    let Some(without_doors) = rest_of(mesh, is_door) else { return Ok(vec![None; doors.len()]) };
    let scene = Scene::new(&without_doors);
    map_in_order(ctx, doors, || (), |(), door| Ok(rooms_beside(&scene, door, rooms)))
}

/// Returns the faces that are no doors. `None` if there are none.
fn rest_of(mesh: &TriMesh, is_door: impl Fn(usize) -> bool) -> Option<TriMesh> {
    let faces = mesh.faces().iter().enumerate();
    let kept = faces.filter(|(face, _)| !is_door(*face)).map(|(_, corners)| *corners);
    let rest: std::result::Result<TriMesh, MeshError> =
        TriMesh::from_faces(mesh.positions().to_vec(), kept.collect());
    rest.ok()
}

fn rooms_beside(scene: &Scene<'_>, door: &OrientedBox, rooms: &[Space]) -> Option<[usize; 2]> {
    let [bottom, top] = [-0.5, 0.5].map(|half| door.center.z + half * door.size.z);
    let mut places: BTreeMap<usize, Vec<DVec2>> = BTreeMap::new();
    for place in places_around(door) {
        let inside = |room: &Space| room.contains(place, [bottom, top]);
        if let Some(room) = rooms.iter().position(inside) {
            places.entry(room).or_default().push(place);
        }
    }

    let mut best: Option<(usize, [usize; 2])> = None;
    for (&a, from) in &places {
        for (&b, to) in places.range(a + 1..) {
            let height = rooms[a].heights[0].max(rooms[b].heights[0]) + EYE_M;
            let at = |place: &DVec2| place.extend(height);
            let pairs = from.iter().flat_map(|from| to.iter().map(move |to| [at(from), at(to)]));
            let sights = pairs.filter(|[from, to]| sees(scene, *from, *to)).count();
            if sights >= LEAST_SIGHTS && best.is_none_or(|(most, _)| sights > most) {
                best = Some((sights, [a, b]));
            }
        }
    }
    best.map(|(_, rooms)| rooms)
}

/// Returns places on a grid over the ground of a door, and around it.
fn places_around(door: &OrientedBox) -> impl Iterator<Item = DVec2> {
    let [u, v] = [door.axes.x_axis.truncate(), door.axes.y_axis.truncate()];
    let steps = [door.size.x, door.size.y].map(|size| ((0.5 * size + REACH_M) / STEP_M).ceil() as i32);
    let center = door.center.truncate();
    (-steps[0]..=steps[0]).flat_map(move |i| {
        (-steps[1]..=steps[1]).map(move |j| center + (f64::from(i) * u + f64::from(j) * v) * STEP_M)
    })
}

fn sees(scene: &Scene<'_>, from: DVec3, to: DVec3) -> bool {
    let way = to - from;
    let Some(direction) = way.try_normalize() else { return false };
    cast_ray(scene, from, direction).is_none_or(|hit| hit.t > way.length())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, Vec3, dvec2, dvec3};

    fn rectangle(low: [f64; 2], high: [f64; 2]) -> Vec<Polygon> {
        let [[a, b], [c, d]] = [low, high];
        vec![Polygon { outer: vec![dvec2(a, b), dvec2(c, b), dvec2(c, d), dvec2(a, d)], holes: Vec::new() }]
    }

    /// Walls along x at y = 4 and 4.2 with a gap, and one along y at x = 5 between two rooms below.
    fn walls() -> TriMesh {
        let mut positions: Vec<Vec3> = Vec::new();
        let mut wall = |from: [f32; 2], to: [f32; 2]| {
            let [[a, b], [c, d]] = [from, to];
            positions.extend([[a, b, 0.0], [c, d, 0.0], [c, d, 2.6], [a, b, 2.6]].map(Vec3::from));
        };
        for y in [4.0, 4.2] {
            wall([0.0, y], [3.5, y]);
            // The door.
            wall([3.5, y], [4.4, y]);
            wall([4.4, y], [10.0, y]);
        }
        for x in [4.9, 5.1] {
            wall([x, 0.0], [x, 4.0]);
        }
        let faces = (0..positions.len() as u32 / 4).flat_map(|i| {
            let corner = 4 * i;
            [[corner, corner + 1, corner + 2], [corner, corner + 2, corner + 3]]
        });
        TriMesh::from_faces(positions.clone(), faces.collect()).unwrap()
    }

    #[test]
    fn a_door_joins_the_rooms_on_its_sides_whether_it_is_open_or_not() {
        let mesh = walls();
        let heights = [0.0, 2.6];
        let rooms = [
            Space { outline: rectangle([0.0, 4.2], [10.0, 6.0]), heights },
            Space { outline: rectangle([0.0, 0.0], [4.9, 4.0]), heights },
            Space { outline: rectangle([5.1, 0.0], [10.0, 4.0]), heights },
            // Exactly above the first.
            Space { outline: rectangle([0.0, 4.2], [10.0, 6.0]), heights: [3.0, 5.6] },
        ];
        let is_door = |face: usize| [2, 3, 8, 9].contains(&face);
        let upright = |center: DVec3, size: DVec3| OrientedBox { center, axes: DMat3::IDENTITY, size };
        let closed = upright(dvec3(3.95, 4.1, 1.05), dvec3(0.9, 0.2, 2.1));
        // Its leaf is in the second room, along the wall of the third.
        let turned = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let open = OrientedBox { center: dvec3(4.4, 3.55, 1.05), axes: turned, size: dvec3(0.9, 0.05, 2.1) };
        let nowhere = upright(dvec3(8.0, 4.1, 1.05), dvec3(0.9, 0.2, 2.1));

        let ctx = Context::default();
        let joined = joined_rooms(&ctx, &mesh, is_door, &[closed, open, nowhere], &rooms).unwrap();
        assert_eq!(joined, [Some([0, 1]), Some([0, 1]), None]);
    }
}
