//! Rooms on the plan: cut by a line, and the faces that they hold.

use super::column::NONE;
use super::event::{Room, RoomPart};
use super::fault::Fault;
use super::state::State;
use rayon::prelude::*;
use s3d_geom::glam::{DVec2, DVec3};
use s3d_geom::{Polygon, TriMesh};

/// A face in no room belongs to the nearest one if that is no farther than this, metres. Walls lie on the
/// outlines, or a little outside.
const RIM_M: f64 = 0.25;

/// Polygons of less are none, m².
const LEAST_AREA_M2: f64 = 1e-6;

/// Returns whether a part of a room is a polygon with heights.
pub(super) fn is_shape(part: &RoomPart) -> bool {
    let [low, high] = part.heights;
    let is_finite = part.outline.iter().flatten().all(|v| v.is_finite());
    is_finite && low.is_finite() && high.is_finite() && low < high && area(&part.outline) >= LEAST_AREA_M2
}

/// Returns the two rooms left and right of a line.
///
/// # Errors
/// [`Fault::Line`]; [`Fault::Nothing`] if the room lies on one side of the line.
pub(super) fn split(room: &Room, line: [[f64; 2]; 2]) -> Result<[Room; 2], Fault> {
    let [from, to] = line.map(DVec2::from);
    let along = to - from;
    if !along.is_finite() || along == DVec2::ZERO {
        return Err(Fault::Line);
    }

    let half = |side: f64| Room {
        kind: room.kind.clone(),
        name: room.name.clone().filter(|_| side > 0.0),
        parts: room
            .parts
            .iter()
            .map(|part| RoomPart { outline: clipped(&part.outline, from, along * side), ..part.clone() })
            .filter(is_shape)
            .collect(),
    };
    let halves = [half(1.0), half(-1.0)];
    if halves.iter().any(|half| half.parts.is_empty()) {
        return Err(Fault::Nothing { why: "the line does not cross the room" });
    }
    Ok(halves)
}

/// Returns the part of a polygon left of a line (Sutherland and Hodgman 1974). Pieces of a polygon that is
/// not convex are joined by edges along the line, which hold no area.
fn clipped(outline: &[[f64; 2]], from: DVec2, along: DVec2) -> Vec<[f64; 2]> {
    let side = |corner: DVec2| along.perp_dot(corner - from);
    let corners: Vec<DVec2> = outline.iter().copied().map(DVec2::from).collect();
    let mut left = Vec::new();
    for (&a, &b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let [at_a, at_b] = [side(a), side(b)];
        if at_a >= 0.0 {
            left.push(a.to_array());
        }
        if (at_a > 0.0 && at_b < 0.0) || (at_a < 0.0 && at_b > 0.0) {
            left.push((a + (b - a) * (at_a / (at_a - at_b))).to_array());
        }
    }
    left
}

fn area(outline: &[[f64; 2]]) -> f64 {
    polygon(outline).area()
}

fn polygon(outline: &[[f64; 2]]) -> Polygon {
    Polygon { outer: outline.iter().copied().map(DVec2::from).collect(), holes: Vec::new() }
}

/// A part of a room, ready for questions.
struct Space {
    room: u32,
    polygon: Polygon,
    heights: [f64; 2],
    low: DVec3,
    high: DVec3,
}

impl Space {
    fn new(room: u32, part: &RoomPart) -> Self {
        let polygon = polygon(&part.outline);
        let [bottom, top] = part.heights;
        let [mut low, mut high] =
            [DVec2::INFINITY.extend(bottom - RIM_M), DVec2::NEG_INFINITY.extend(top + RIM_M)];
        for corner in &polygon.outer {
            low = low.min((*corner - RIM_M).extend(low.z));
            high = high.max((*corner + RIM_M).extend(high.z));
        }
        Self { room, polygon, heights: part.heights, low, high }
    }

    /// Returns the distance of a place: 0 inside, or else the larger one of plan and height. `None` beyond
    /// the rim.
    fn distance(&self, place: DVec3) -> Option<f64> {
        if !(place.cmpge(self.low) & place.cmple(self.high)).all() {
            return None;
        }
        let [bottom, top] = self.heights;
        let above = (bottom - place.z).max(place.z - top).max(0.0);
        let distance = self.polygon.distance(place.truncate()).max(above);
        (distance <= RIM_M).then_some(distance)
    }
}

impl State {
    /// Returns the room of each face of the mesh; 0 for a face without one.
    ///
    /// A face belongs to the room that it was painted for. Otherwise it belongs to the room that its middle
    /// lies in, or is nearest to, no farther than 25 cm; of several, to the one with the smallest number.
    ///
    /// # Panics
    /// If the mesh has fewer faces than this state.
    pub fn room_of_face(&self, mesh: &TriMesh) -> Vec<u32> {
        let spaces: Vec<Space> = self
            .rooms()
            .iter()
            .flat_map(|(&room, is)| is.parts.iter().map(move |part| Space::new(room, part)))
            .collect();

        let painted = self.painted_room_of_face().par_iter().enumerate();
        let found = painted.map(|(face, &room)| {
            if room != NONE || spaces.is_empty() {
                return room;
            }
            let [a, b, c] = mesh.triangle(face as u32).map(|corner| corner.as_dvec3());
            let middle = (a + b + c) / 3.0;
            let near = spaces
                .iter()
                .filter_map(|space| Some((space.distance(middle)?, space.room)));
            near.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(NONE, |(_, room)| room)
        });
        found.collect()
    }
}
