//! Whose surface is around a place: the rooms that a camera sees, and the one in which it stands.

use crate::survey::annotated::SurveyedRoom;
use glam::{DVec2, DVec3, dvec3};
use s3d_label::Room;
use s3d_render::{Scene, cast_ray};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// The number of rays that look around. Each stands for the same solid angle.
const RAYS: u32 = 2048;

/// The lowest share of rays with a label for which they tell the room.
const ENOUGH: f64 = 0.25;

/// The rooms of the labelled surface around a place, each with the number of rays that end there.
pub(crate) struct RoomsAround<R> {
    /// The rays within 45° of straight down.
    below: Rays<R>,
    /// The rays in all directions.
    around: Rays<R>,
}

struct Rays<R> {
    cast: u32,
    by_room: BTreeMap<R, u32>,
}

impl<R: Ord + Clone> RoomsAround<R> {
    /// Looks around from `place`. `room_of_face` tells the room of a labelled face.
    pub(crate) fn of(scene: &Scene<'_>, place: DVec3, room_of_face: impl Fn(u32) -> Option<R>) -> Self {
        let mut below = Rays { cast: 0, by_room: BTreeMap::new() };
        let mut around = Rays { cast: 0, by_room: BTreeMap::new() };
        for direction in directions(RAYS) {
            let room = cast_ray(scene, place, direction).and_then(|hit| room_of_face(hit.face));
            let is_below = direction.z < -0.5f64.sqrt();
            around.count(room.clone());
            if is_below {
                below.count(room);
            }
        }
        Self { below, around }
    }

    /// Returns the room of most of the surface below, or if little of it has a label, of most of all surface.
    /// The first by name wins a tie. `None` if little has a label there, too.
    pub(crate) fn stands_in(&self) -> Option<R> {
        self.below.most().or_else(|| self.around.most())
    }

    /// Returns the number of rays that end on the surface of a room.
    pub(crate) fn rays_to(&self, room: &R) -> u32 {
        self.around.by_room.get(room).copied().unwrap_or(0)
    }
}

impl<R: Ord + Clone> Rays<R> {
    fn count(&mut self, room: Option<R>) {
        self.cast += 1;
        if let Some(room) = room {
            *self.by_room.entry(room).or_default() += 1;
        }
    }

    /// The room of most rays, unless too few have one.
    fn most(&self) -> Option<R> {
        let labelled: u32 = self.by_room.values().sum();
        if f64::from(labelled) < ENOUGH * f64::from(self.cast) {
            return None;
        }
        let most = self.by_room.iter().rev().max_by_key(|(_, rays)| **rays)?;
        Some(most.0.clone())
    }
}

/// Returns evenly spread unit vectors, a Fibonacci lattice.
pub(crate) fn directions(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sin, cos) = libm::sincos(f64::from(i) * PI * (3.0 - 5f64.sqrt()));
        let r = (1.0 - z * z).sqrt();
        dvec3(r * cos, r * sin, z)
    })
}

/// Returns the room whose floor outline and heights are nearest to a place. The first by name wins a tie. A
/// room with too few points for an outline has the box of its points instead. Returns `None` if there is no
/// room.
pub(crate) fn nearest_room(rooms: &[SurveyedRoom], place: DVec3) -> Option<Room> {
    let mut best = (f64::INFINITY, rooms.first()?.room);
    for room in rooms {
        let min = room.bbox.min.as_dvec3();
        let max = room.bbox.max.as_dvec3();
        let off = place - place.clamp(min, max);
        let mut distance = off.length();
        // The outline lies in the box: it is no nearer, but for rounding.
        if distance > 1.000_001 * best.0 {
            continue;
        }
        if !room.footprint.polygons.is_empty() {
            distance = DVec2::new(room.footprint.distance(place.x, place.y), off.z).length();
        }
        if distance < best.0 {
            best = (distance, room.room);
        }
    }
    Some(best.1)
}
